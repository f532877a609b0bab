/**
 * @file vtkMovedLines.h
 * @brief Lines and skeleton at one moment, as the tracker and the population motion write them.
 */
#ifndef vtkMovedLines_h
#define vtkMovedLines_h

#include "BranchPlacement.h"
#include "Polylines.h"
#include "vtkPoseSequences.h"

#include <vector>

class vtkDataObject;
class vtkInformation;
class vtkInformationVector;
class vtkPolyData;

namespace vtkMovedLines
{
/// Of an input port; null: nothing is connected.
vtkInformation* Connection(vtkInformationVector** inputs, int port);

/// The value of a field array of one; else another.
double FieldValue(vtkDataObject* data, const char* name, double otherwise);

/// The output that a request came from: the executive takes all outputs for those of its time.
vtkInformation* AskedOutput(vtkInformation* request, vtkInformationVector* outputs);

/// The time that it was asked for; else another.
double AskedTime(vtkInformation* request, vtkInformationVector* outputs, double otherwise);

/// The number of the time nearest to the wanted one; of no times 0.
std::size_t NearestIndex(const std::vector<double>& times, double wanted);

/// TIME_STEPS and TIME_RANGE of all outputs; without times none.
void SetTimes(vtkInformationVector* outputs, const std::vector<double>& times);

/// How sure a tree is of its sections, its ostia, and that it is no vein, as its point arrays `Confidence`, `OstiumConfidence` and `VeinProbability` tell.
coronary::PlacementEvidence EvidenceOf(vtkPolyData* lines);

/// Where the points of a skeleton are nearest to the lines that it was made of.
class Feet
{
public:
  Feet(const coronary::Polylines& lines, vtkPolyData* skeleton);

  /// Values of the lines' points, between them.
  template <typename Value>
  std::vector<Value> At(const std::vector<Value>& values) const
  {
    std::vector<Value> result;
    result.reserve(this->Places.size());
    for (const Foot& foot : this->Places)
    {
      result.push_back(
        values[foot.first] + foot.fraction * (values[foot.second] - values[foot.first]));
    }
    return result;
  }

  /// The status of the nearer point.
  std::vector<coronary::TrackingStatus> At(
    const std::vector<coronary::TrackingStatus>& status) const;

private:
  struct Foot
  {
    std::size_t first = 0;
    std::size_t second = 0;
    double fraction = 0.0;
  };
  std::vector<Foot> Places;
};

/// A skeleton that follows its lines, at one phase.
struct PosedSkeleton
{
  std::vector<coronary::Vector3> joints;
  std::vector<double> confidence;
  std::vector<coronary::TrackingStatus> status;
  std::vector<double> calibre;

  /// @param rest  the lines' points at rest
  PosedSkeleton(const Feet& feet, const std::vector<coronary::Vector3>& rest,
    const coronary::PoseSequence& poses, std::size_t phase, vtkPolyData* skeleton);

  /// Valid as long as this is.
  vtkPoseSequences::Moment At(double time) const;
};

/**
 * Makes `output` the data `like` at a moment: with `Displacement`, `AxialStrain`, the field data of `lines` and of `like`,
 * `PhaseTime`, `CycleLength` and `ReferenceTime`.
 */
void Write(vtkPolyData* lines, vtkPolyData* like, const vtkPoseSequences::Moment& moment,
  double cycle, double reference, vtkPolyData* output);
}

#endif
