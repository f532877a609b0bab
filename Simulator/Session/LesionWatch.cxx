#include "LesionWatch.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace coronary
{
namespace
{
constexpr double PressureTime = 2.0;    // s of the running means
constexpr double ThinnestGraded = 0.75; // mm, radius without the lesion, as in docs/lesions.md
constexpr double Relaxed = 0.5;         // atm: what is below is another inflation
}

LesionWatch::LesionWatch(const WallTopology& topology, const ContrastModel& medium)
  : Reference(ReferenceRadii(topology))
  , Names(topology.groupName)
{
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    this->First.push_back(FirstAxisPoint(topology, static_cast<int>(b)));
  }
  for (FoundLesion& lesion : FindLesions(topology))
  {
    Watched one;
    const std::int64_t last = lesion.points.back();
    const int branch = this->BranchOf(last);
    const FlowBranch& along = medium.FlowModel().Network().Branches()[branch];
    one.reference = this->Reference[lesion.branch][lesion.throat - this->First[lesion.branch]];
    if (one.reference < ThinnestGraded)
    {
      continue;
    }
    this->Distal.push_back({ branch, along.abscissa[last - this->First[branch]] });
    one.lesion = std::move(lesion);
    this->Lesions.push_back(std::move(one));
  }
  this->Reserve = this->ReserveBefore = medium.FlowModel().FlowReserves(this->Distal);
}

int LesionWatch::BranchOf(std::int64_t point) const
{
  return static_cast<int>(
    std::upper_bound(this->First.begin(), this->First.end(), point) - this->First.begin() - 1);
}

void LesionWatch::StepFlow(double seconds, const Intervention& instruments, ContrastModel& medium)
{
  if (const DilatableWall* wall = instruments.Dilated())
  {
    std::vector<double> filled(wall->Radii().size(), 0.0);
    for (const auto& [point, radius] : instruments.Balloon()->Sections())
    {
      filled[point] = radius;
    }
    if (filled != this->Filled_ || wall->Radii() != this->Lumen_)
    {
      this->Filled_ = std::move(filled);
      this->Lumen_ = wall->Radii();
      medium.SetLumen(this->Lumen_, this->Filled_);
      this->ReserveIsOld = true;
    }
    else if (this->ReserveIsOld)
    {
      // A network to be solved until it rests: not while a balloon moves or fills.
      this->Reserve = medium.FlowModel().FlowReserves(this->Distal);
      this->ReserveIsOld = false;
    }
  }
  const double share = -std::expm1(-seconds / PressureTime);
  for (std::size_t n = 0; n < this->Lesions.size(); ++n)
  {
    Watched& one = this->Lesions[n];
    const double aortic = medium.AorticPressure();
    const double distal = medium.FlowModel().PressureAt(this->Distal[n]);
    const bool first = one.meanAortic == 0.0;
    one.meanAortic += (first ? 1.0 : share) * (aortic - one.meanAortic);
    one.meanDistal += (first ? 1.0 : share) * (distal - one.meanDistal);
  }
}

void LesionWatch::StepTick(double seconds, const Intervention& instruments,
  const std::optional<BalloonCatheter>& balloon, std::vector<std::string>& said)
{
  if (!balloon)
  {
    return;
  }
  const BalloonReport& report = instruments.Report().balloon;
  const int branch = report.place >= 0 ? this->BranchOf(report.place) : -1;
  const auto add = [&](ProcedureEvent::Kind kind, double value, const char* text)
  {
    this->Events_.push_back({ kind, seconds, branch, value });
    char sentence[200];
    const bool named = branch >= 0 && branch < static_cast<int>(this->Names.size());
    std::snprintf(sentence, sizeof(sentence), text, value,
      named ? this->Names[branch].c_str() : "the guide catheter");
    said.emplace_back(sentence);
  };
  const double tearing = instruments.Dilated()->Settings().tearing;
  if (report.stretch > tearing && !this->Stretched)
  {
    add(ProcedureEvent::Kind::OverExpansion, report.stretch,
      "The wall is stretched to %.2f of its reference diameter in %s: dissection threatens.");
  }
  if (report.pressure > balloon->ratedPressure && !this->Pressed)
  {
    add(ProcedureEvent::Kind::OverPressure, report.pressure,
      "The balloon is at %.1f atm in %s, above its rated pressure.");
  }
  this->Stretched = report.stretch > tearing || (this->Stretched && report.pressure > Relaxed);
  this->Pressed =
    report.pressure > balloon->ratedPressure || (this->Pressed && report.pressure > Relaxed);
  for (Watched& one : this->Lesions)
  {
    const std::vector<std::int64_t>& points = one.lesion.points;
    if (report.stretch > one.stretch &&
      std::find(points.begin(), points.end(), report.place) != points.end())
    {
      one.stretch = report.stretch;
    }
  }
}

std::vector<LesionResult> LesionWatch::Results(
  const Intervention& instruments, const ContrastModel& medium) const
{
  const DilatableWall* wall = instruments.Dilated();
  const std::vector<double> reserve =
    this->ReserveIsOld ? medium.FlowModel().FlowReserves(this->Distal) : this->Reserve;
  std::vector<LesionResult> results;
  for (std::size_t n = 0; n < this->Lesions.size(); ++n)
  {
    const Watched& one = this->Lesions[n];
    LesionResult result;
    result.branch = one.lesion.branch;
    result.vessel = one.lesion.vessel;
    result.reference = 2.0 * one.reference;
    result.degreeBefore = result.degree = one.lesion.degree;
    result.least = 2.0 * one.reference * (1.0 - one.lesion.degree);
    if (wall)
    {
      result.degree = 0.0;
      result.least = 1e9;
      for (const std::int64_t point : one.lesion.points)
      {
        const int branch = this->BranchOf(point);
        const double radius = wall->Radii()[point];
        result.degree = std::max(
          result.degree, 1.0 - radius / this->Reference[branch][point - this->First[branch]]);
        result.least = std::min(result.least, 2.0 * radius);
      }
    }
    result.pressureRatio = one.meanAortic > 0.0 ? one.meanDistal / one.meanAortic : 0.0;
    result.reserveBefore = this->ReserveBefore[n];
    result.reserve = reserve[n];
    result.stretch = one.stretch;
    results.push_back(std::move(result));
  }
  return results;
}
}
