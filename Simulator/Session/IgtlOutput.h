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
 * One client at a time; another one is turned away until it has gone. It gets the latest pose (TRANSFORM) and image
 * (IMAGE), those before are left out when it is slow, and it is dropped when it takes nothing for a second; who sends never
 * waits for it. OpenIGTLink has no authentication and no encryption: everybody who reaches the address may read, so that it
 * is this machine's own unless another is wanted. OpenIGTLink has RAS: poses are turned into it.
 */
class IgtlOutput
{
public:
  /// Whether this build has OpenIGTLink.
  static bool IsSupported();

  /// @param port     1 to 65535; 3D Slicer looks for 18944
  /// @param address  IPv4, of this machine: where it listens; 0.0.0.0: at all of them
  /// @throws std::invalid_argument for the port or what is no address, std::runtime_error: they can not be had (taken, not
  /// of this machine), or a build without OpenIGTLink
  explicit IgtlOutput(int port, const std::string& address = "127.0.0.1");
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

  /// Whether other machines can not reach this IPv4 address.
  static bool IsLocal(const std::string& address);

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};
}

#endif
