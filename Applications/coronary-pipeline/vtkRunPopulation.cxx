#include "vtkRunPopulation.h"

#include "CyclicTime.h"
#include "PopulationMotion.h"
#include "Ranks.h"
#include "vtkMessageTrap.h"
#include "vtkRunTrees.h"

#include "vtkCenterlineTracker.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkDataArray.h"
#include "vtkDataSet.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkGatedImageReader.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkPopulationMotion.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;
namespace names = vtkCoronaryArrayNames;

/// Fewer moments do not show how a heart moves between them.
constexpr int LeastPhases = 4;

/// Taken for the phase of what does not tell it, as masks and surfaces: most are of mid-diastole.
constexpr double UsualPhase = 0.75;

int DifferentPhases(vtkGatedImageReader* reader)
{
  std::vector<double> times;
  for (int n = 0; n < reader->GetNumberOfPhases(); ++n)
  {
    const double time = reader->GetPhaseTime(n);
    if (std::none_of(times.begin(), times.end(),
          [time](double other) { return CyclicDistance(time, other) < SameMoment; }))
    {
      times.push_back(time);
    }
  }
  return static_cast<int>(times.size());
}

/// Whether the input tells where in the cycle its only phase is. A reader that does not know puts it at 0.
bool TellsPhase(const RunInput& input)
{
  const std::vector<std::string>& files = input.Settings.input;
  return input.Chosen &&
    (input.Chosen->time != 0.0 || !input.Settings.fractions.empty() ||
      input.Reader->GetNumberOfPhases() > 1 ||
      (files.size() == 1 && files.front().size() > 5 &&
        files.front().substr(files.front().size() - 5) == ".json"));
}

double ReferenceOf(const RunInput& input)
{
  return TellsPhase(input)               ? input.Chosen->time
    : std::isfinite(input.Settings.time) ? input.Settings.time
                                         : UsualPhase;
}

std::string Text(vtkDataSet* data, const char* name, vtkIdType n)
{
  auto* array = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray(name));
  return array && n < array->GetNumberOfValues() ? std::string(array->GetValue(n)) : std::string();
}
}

MotionPlan PlanMotion(const RunInput& input)
{
  const std::string& wanted = input.Settings.motion;
  MotionPlan plan;
  plan.asked = wanted != "automatic";
  if (wanted == "none")
  {
    return { MotionKind::Rest, "--motion none", false, true };
  }
  plan.reason = input.ReasonWithoutMotion();
  plan.hasPhases = plan.reason.empty();
  if (wanted == "tracked")
  {
    plan.kind = plan.hasPhases ? MotionKind::Tracked : MotionKind::Rest;
    return plan;
  }
  const int phases = plan.hasPhases ? DifferentPhases(input.Reader) : 0;
  if (plan.hasPhases && phases < LeastPhases)
  {
    plan.reason = std::to_string(phases) + (phases == 1 ? " moment only" : " phases only");
    plan.hasPhases = phases > 1;
    plan.kind = MotionKind::Population;
  }
  else
  {
    plan.kind =
      plan.hasPhases && wanted == "automatic" ? MotionKind::Tracked : MotionKind::Population;
  }
  return plan;
}

void ConnectTracker(vtkCenterlineTracker* tracker, const RunStep& step, vtkPolyData* tree)
{
  const RunSettings& settings = step.input.Settings;
  tracker->SetInputConnection(step.input.Reader->GetOutputPort());
  tracker->SetInputDataObject(1, tree);
  tracker->SetTemporalWindow(settings.temporalWindowMs / 1000.0);
  tracker->SetTrackedPhases(settings.tracked == "even" ? vtkCenterlineTracker::EvenPhases
                                                       : vtkCenterlineTracker::AllPhases);
  tracker->SetSharing(&Ranks());
}

PopulationPoses::PopulationPoses(
  const RunStep& step, vtkPolyData* tree, vtkPolyData* skeleton, const MotionPlan& plan)
{
  const RunSettings& settings = step.input.Settings;
  this->Motion->SetInputDataObject(0, tree);
  this->Motion->SetInputDataObject(1, skeleton);
  this->Motion->AutomaticReferenceOff();
  this->Motion->SetReferenceTime(ReferenceOf(step.input));
  this->Guessed = !TellsPhase(step.input) && !std::isfinite(settings.time);
  this->Motion->SetAmplitude(settings.motionAmplitude);
  this->Motion->SetTemporalWindow(settings.temporalWindowMs / 1000.0);
  this->Motion->SetHeartRate(std::isfinite(settings.heartRate) ? settings.heartRate : 0.0);
  if (plan.hasPhases)
  {
    ConnectTracker(this->Tracker, step, tree);
    this->Motion->SetTrackedConnection(this->Tracker->GetOutputPort(0));
  }
}

PopulationPoses::~PopulationPoses() = default;

void PopulationPoses::Update(const RunStep& step, const std::function<void(double)>& progress)
{
  UpdateAtTime(this->Motion, 0, this->Motion->GetReferenceTime(), step.input.Messages, progress);
}

std::vector<double> PopulationPoses::Times() const
{
  return TimeSteps(this->Motion);
}

std::string PopulationPoses::Assumption() const
{
  return this->Guessed ? "the files do not tell their phase: it is taken for 75 % of R-R "
                         "(--time or --fractions tells it)"
                       : "";
}

std::string PopulationPoses::Statement() const
{
  return Text(
    vtkDataSet::SafeDownCast(this->Motion->GetOutputDataObject(0)), names::MotionSource, 0);
}

Json PopulationPoses::Describe(const MotionPlan& plan) const
{
  auto* lines = vtkDataSet::SafeDownCast(this->Motion->GetOutputDataObject(0));
  const auto number = [lines](const char* name, int n)
  {
    vtkDataArray* array = lines->GetFieldData()->GetArray(name);
    return array && n < array->GetNumberOfValues() ? array->GetVariantValue(n).ToDouble() : 0.0;
  };
  Json heart = { { "from", Json::array() } };
  for (vtkIdType n = 0; !Text(lines, names::HeartLandmarks, n).empty(); ++n)
  {
    heart["from"].push_back(Text(lines, names::HeartLandmarks, n));
  }
  heart["base_mm"] = { number(names::LongAxis, 0), number(names::LongAxis, 1),
    number(names::LongAxis, 2) };
  heart["apex_mm"] = { number(names::LongAxis, 3), number(names::LongAxis, 4),
    number(names::LongAxis, 5) };
  heart["axis_deviation_degrees"] = number(names::LongAxisDeviation, 0) * 180.0 / EIGEN_PI;
  heart["base_deviation_mm"] = number(names::LongAxisDeviation, 1);
  heart["length_deviation_mm"] = number(names::LongAxisDeviation, 2);
  Json parameters = Json::object();
  int n = 0;
  for (const PopulationParameter& parameter : PopulationParameters())
  {
    parameters[parameter.name] = number(names::PopulationValues, n++);
  }
  Json told = { { "possible", true }, { "motion", "population" },
    { "statement", this->Statement() }, { "reason", plan.reason },
    { "phases", static_cast<int>(number(names::MotionPhases, 0)) },
    { "heart_rate", 60.0 / number(names::CycleLength, 0) },
    { "amplitude", this->Motion->GetAmplitude() },
    { "reference_time", this->Motion->GetReferenceTime() }, { "reference_told", !this->Guessed },
    { "heart", heart }, { "parameters", parameters } };
  if (lines->GetFieldData()->GetArray(names::PopulationMisfit)->GetNumberOfValues() == 2)
  {
    told["misfit_mm"] = { { "population", number(names::PopulationMisfit, 0) },
      { "bent", number(names::PopulationMisfit, 1) } };
  }
  // What is not among these is the population's alone.
  told["tracked_times"] = { this->Motion->GetReferenceTime() };
  told["tracked_share"] = { 1.0 };
  if (plan.hasPhases)
  {
    told["tracked_times"] = TimeSteps(this->Tracker);
    told["tracked_share"] =
      Numbers(vtkDataSet::SafeDownCast(this->Tracker->GetOutputDataObject(0)), names::TrackedShare);
  }
  return told;
}
}
