/**
 * @file IgtlOutput.h
 * @brief What the simulator shows, for 3D Slicer and others: a server of OpenIGTLink.
 */
#ifndef DynamicCoronary_IgtlOutput_h
#define DynamicCoronary_IgtlOutput_h

#include "Detector.h"
#include "Geometry.h"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
/// Where a tool is, LPS, mm: its axes as columns, of unit length and across each other, and its origin.
struct ToolPose
{
  std::array<Vector3, 3> axes{ Vector3::UnitX(), Vector3::UnitY(), Vector3::UnitZ() };
  Vector3 origin{ Vector3::Zero() };
};

/**
 * One client at a time; it gets the latest pose (TRANSFORM) and image (IMAGE), those before are left out when it is
 * slow. Everybody who reaches the port may connect, and only reads. OpenIGTLink has RAS: poses are turned into it.
 */
class IgtlOutput
{
public:
  /// Whether this build has OpenIGTLink.
  static bool IsSupported();

  /// @param port  1 to 65535; 3D Slicer looks for 18944
  /// @throws std::invalid_argument for the port, std::runtime_error: it is taken, or a build without OpenIGTLink
  explicit IgtlOutput(int port);
  ~IgtlOutput();
  IgtlOutput(const IgtlOutput&) = delete;
  IgtlOutput& operator=(const IgtlOutput&) = delete;

  ///@{
  /// From any thread but that of the physics: they lock.
  /// @param spacing  of the pixels on the detector, mm  @param seconds  of the simulation
  /// @throws std::invalid_argument: another number of pixels than columns and rows say, a spacing that is not positive
  void SendPose(const std::string& name, const ToolPose& pose, double seconds);
  void SendImage(const std::string& name, GreyImage image, double spacing, double seconds);
  ///@}

  bool HasClient() const;

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};
}

#endif
