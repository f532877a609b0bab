/**
 * @file vtkCoronaryUpstream.h
 * @brief For filters that, to answer one request, need their input at another time or extent too.
 */
#ifndef vtkCoronaryUpstream_h
#define vtkCoronaryUpstream_h

#include "vtkCoronaryCommonModule.h" // for the export macro

#include "vtkType.h"

#include <array>

class vtkInformation;
class vtkInformationVector;

namespace vtkCoronary
{
/// A time of the pipeline; none for data without time.
struct Moment
{
  bool exists = false;
  double time = 0.0;

  bool operator==(const Moment& other) const
  {
    return this->exists == other.exists && this->time == other.time;
  }
};

/// The step that is nearest to `time`, or the time itself where the connection offers a continuous
/// range; `first`: the first one.
VTKCORONARYCOMMON_EXPORT Moment NearestMoment(vtkInformation* inInfo, bool first, double time);

/// Modified time of all that is upstream of a connection: a key of what was learned from its data.
VTKCORONARYCOMMON_EXPORT vtkMTimeType UpstreamTime(vtkInformation* inInfo);

/// Sets an extent as the request, and whole data instead of a piece.
VTKCORONARYCOMMON_EXPORT void SetRequest(vtkInformation* inInfo, const std::array<int, 6>& extent);

/// Inside RequestUpdateExtent, for unstructured data that are worked on as a whole: the first piece
/// asks all connections of the `ports` input ports for all, the others for nothing.
VTKCORONARYCOMMON_EXPORT void RequestWholeForFirstPiece(
  vtkInformation* request, vtkInformationVector** inputs, int ports, vtkInformationVector* outputs);

/**
 * Inside RequestData: asks an input connection for something else than what it has been asked for,
 * and at the end for that again. Not CONTINUE_EXECUTING: its loop never ends when an input fails.
 *
 * After each call the input's data object has to be fetched again. Both throw std::runtime_error
 * when the input fails.
 */
class VTKCORONARYCOMMON_EXPORT UpstreamRequest
{
public:
  /// @param original  whose request is restored: the connection's own, or that of an output port
  UpstreamRequest(vtkInformation* inInfo, vtkInformation* original);

  /// @param extent  in voxels; null for data without extents
  void Ask(const std::array<int, 6>* extent, const Moment& moment);

  /// Also for another time than that of the original request.
  void Restore(const Moment* moment = nullptr);

private:
  void Update(const Moment& moment);

  vtkInformation* Info;
  bool HasExtent = false;
  std::array<int, 6> Extent{};
  int Piece = 0;
  int Pieces = 1;
  int Ghosts = 0;
  Moment When;
  bool Changed = false;
};
}

#endif
