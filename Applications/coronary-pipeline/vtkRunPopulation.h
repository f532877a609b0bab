/**
 * @file vtkRunPopulation.h
 * @brief What of `run` is about the motion of a population: when it is taken, its poses, and what the report tells.
 */
#ifndef vtkRunPopulation_h
#define vtkRunPopulation_h

#include "vtkRunStages.h"

#include "vtkNew.h"

#include <string>
#include <vector>

class vtkCenterlineTracker;
class vtkPolyData;
class vtkPopulationMotion;

namespace coronary
{
/// What the last stage makes.
enum class MotionKind
{
  Rest,       ///< the model at rest in the files of a moving one
  Population, ///< that of a population, bent to the phases that can be tracked, if there are any
  Tracked
};

struct MotionPlan
{
  MotionKind kind = MotionKind::Tracked;
  std::string reason;     ///< why it is not the tracked one; empty when it is, or was asked for
  bool hasPhases = false; ///< there are phases to track
  bool asked = false;     ///< by --motion: what is not possible is an error then
};

/// What --motion and the input's phases lead to.
MotionPlan PlanMotion(const RunInput& input);

/// Tracks the tree through the phases of the input, as the settings say. A skeleton is the caller's to give.
void ConnectTracker(vtkCenterlineTracker* tracker, const RunStep& step, vtkPolyData* tree);

/// The poses of a population motion.
class PopulationPoses
{
public:
  PopulationPoses(
    const RunStep& step, vtkPolyData* tree, vtkPolyData* skeleton, const MotionPlan& plan);
  ~PopulationPoses();

  /// Makes them; the images are read now. @throws std::runtime_error, Cancelled
  void Update(const RunStep& step, const std::function<void(double)>& progress);

  /// At which they are given.
  std::vector<double> Times() const;

  /// What had to be assumed, one sentence; empty: nothing.
  std::string Assumption() const;

  /// One sentence for people.
  std::string Statement() const;

  /// Members for the report.
  nlohmann::ordered_json Describe(const MotionPlan& plan) const;

  vtkNew<vtkPopulationMotion> Motion; ///< lines at port 0, skeleton at port 1

private:
  vtkNew<vtkCenterlineTracker> Tracker;
  bool Guessed = false; ///< the reference
};
}

#endif
