/**
 * @file vtkPoseSequences.h
 * @brief Time steps of point sets as coronary::PoseSequence, read once, and moments of it as data.
 */
#ifndef vtkPoseSequences_h
#define vtkPoseSequences_h

#include "ParallelFor.h"
#include "PoseSequence.h"

#include "vtkSmartPointer.h"
#include "vtkType.h"

#include <string>
#include <vector>

class vtkAbstractArray;
class vtkDataArray;
class vtkInformation;
class vtkPointSet;
class vtkPolyData;

namespace vtkPoseSequences
{
/// An array that is not the same at all time steps, beside those of the pose.
struct VaryingArray
{
  bool cell = false;     ///< cell data, else point data
  bool floating = false; ///< float or double in all steps
  std::vector<vtkSmartPointer<vtkAbstractArray>> steps;
};

/// All time steps of one connection.
struct Sequence
{
  coronary::PoseSequence poses;       ///< checked; its times are those of the time steps
  vtkSmartPointer<vtkPointSet> first; ///< the data of the first step; null before anything was read
  std::vector<VaryingArray> varying;  ///< that all steps have with the same form
  double cycleLength = 0.0;           ///< seconds, of the field data; 0: not there
  bool Empty() const;                 ///< no points
};

/**
 * Reads every time step of an input connection once, and again only when what is upstream of it has
 * changed. Data whose arrays change in place between steps are not supported, as nowhere in VTK.
 */
class Reader
{
public:
  /// For REQUEST_UPDATE_TIME and REQUEST_UPDATE_EXTENT: asks for the step that the connection has
  /// already, so that it does not execute again.
  void RequestTime(vtkInformation* inInfo) const;

  /// True when Read would read nothing: for filters that keep what they make of a sequence.
  bool Knows(vtkInformation* inInfo) const;

  /**
   * Inside RequestData. An input without points gives an empty sequence.
   * @param outInfo  of the request that is being answered
   * @throws std::invalid_argument: no or one time step, steps that do not increase strictly or are not
   * finite, other numbers of points or cells or other lines than at the first step, an array of wrong
   * form, as coronary::CheckPoseSequence; std::runtime_error when the input fails; coronary::Cancelled
   */
  const Sequence& Read(vtkInformation* inInfo, vtkInformation* outInfo,
    const coronary::ProgressCallback& progress = {});

  /// Of the last Read.
  const Sequence& Current() const { return this->Data; }

  /// Times that the steps have been read.
  int NumberOfReads() const { return this->Reads; }

private:
  bool Known = false;
  vtkMTimeType KnownOf = 0;
  const void* KnownProducer = nullptr;
  int KnownPort = 0;
  std::vector<double> KnownSteps;
  double LastStep = 0.0;
  int Reads = 0;
  Sequence Data;
};

/// The time steps that a connection offers.
std::vector<double> StepsOf(vtkInformation* info);

/// One moment. Whatever is empty is not written.
struct Moment
{
  double time = 0.0; ///< fraction of the R-R interval
  const std::vector<coronary::Vector3>* points = nullptr;
  const std::vector<double>* confidence = nullptr;
  const std::vector<coronary::TrackingStatus>* status = nullptr;
  const std::vector<double>* calibre = nullptr;
  const std::vector<Eigen::Quaterniond>* rotation = nullptr;
};

/// Phase `k` of a sequence; the sequence has to live longer.
Moment MomentOf(const coronary::PoseSequence& sequence, std::size_t k);

/**
 * Makes `output` the data `like` with other points: cells and other arrays are shared, field data are the
 * output's own, DATA_TIME_STEP is the moment's time. Points keep their precision.
 */
void Write(vtkPointSet* like, const Moment& moment, vtkPointSet* output);

/// Gives `output` the arrays of step `k` that are not the same at all steps.
void WriteVarying(const Sequence& sequence, std::size_t k, vtkPointSet* output);

/**
 * Lines, vertices at rest and radii of poly data.
 * @param radius  mm, one value a point; null: no radii
 * @throws std::invalid_argument as coronary::CheckPolylines
 */
coronary::Polylines LinesOf(vtkPolyData* data, vtkDataArray* radius);
}

#endif
