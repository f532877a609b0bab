#include "AorticContrast.h"

#include "AortaMotion.h"
#include "CyclicTime.h"
#include "Numbers.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr double StandardRadius =
  15.0; // mm (Hager 2002: 29.8 +- 4.6 mm at the sinus, 30.9 +- 4.1 above)
constexpr double StandardMouth = 15.0; // mm above the valve
constexpr double Trace = 1e-6;         // mL that are not followed any more

constexpr RequireOf RequireAorta{ "contrast medium in the aorta" };
}

void AorticFlowSettings::Validate() const
{
  RequireAorta(
    Within(this->strokeVolume, 5.0, 200.0), "strokeVolume", this->strokeVolume, "5 to 200 mL");
  RequireAorta(
    Within(this->sinusVolume, 0.5, 30.0), "sinusVolume", this->sinusVolume, "0.5 to 30 mL");
  RequireAorta(
    Within(this->systolicExchange, 0.0, 1.0), "systolicExchange", this->systolicExchange, "0 to 1");
  RequireAorta(Within(this->diastolicExchange, 0.0, 100.0), "diastolicExchange",
    this->diastolicExchange, "0 to 100 mL/s");
  RequireAorta(Within(this->axialDiffusivity, 0.0, 1e5), "axialDiffusivity", this->axialDiffusivity,
    "0 to 100000 mm^2/s");
}

double EjectedFlow(
  const AorticFlowSettings& settings, double begin, double end, double phase, double heartRate)
{
  const double part = (Modulo(phase) - begin) / (end - begin);
  if (part <= 0.0 || part >= 1.0 || heartRate <= 0.0)
  {
    return 0.0;
  }
  const double seconds = (end - begin) * 60.0 / heartRate;
  return settings.strokeVolume * 0.5 * Pi / seconds * std::sin(Pi * part);
}

double AorticSections::Volume(std::size_t slice) const
{
  const double a = this->radii[slice];
  const double b = this->radii[slice + 1];
  return 1e-3 * Pi * Length * (a * a + a * b + b * b) / 3.0;
}

AorticSections SectionsOfAorta(const WallTopology& topology)
{
  AorticSections sections;
  std::vector<Vector3> ostia;
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    if (b >= topology.parent.size() || topology.parent[b] < 0)
    {
      ostia.push_back(topology.axis[b].front());
    }
  }
  if (!topology.aorta || topology.aorta->axis.size() < 2)
  {
    sections.radii.assign(AorticSections::Count + 1, StandardRadius);
    sections.mouths.assign(ostia.size(), StandardMouth);
    return sections;
  }
  const std::vector<Vector3>& axis = topology.aorta->axis;
  double along = 0.0;
  for (std::size_t i = 1; i < axis.size(); ++i)
  {
    const double length = (axis[i] - axis[i - 1]).norm();
    while (sections.points.size() <= AorticSections::Count &&
      AorticSections::Length * static_cast<double>(sections.points.size()) <= along + length)
    {
      const double place =
        AorticSections::Length * static_cast<double>(sections.points.size()) - along;
      sections.points.push_back(axis[i - 1] + place / length * (axis[i] - axis[i - 1]));
    }
    along += length;
  }
  if (sections.points.size() < 2)
  {
    throw std::invalid_argument("the aorta's axis is shorter than 5 mm");
  }
  // The caps' middles are no wall: what counts is the wall's most common distance, its upper middle.
  std::vector<std::vector<double>> distances(sections.points.size());
  std::vector<Vector3> line = sections.points;
  line.push_back(2.0 * line.back() - line[line.size() - 2]); // what is nearest to it is further
  for (const Vector3& point : topology.aorta->points)
  {
    const double place = PlaceAlong(line, point) / AorticSections::Length;
    const auto k = static_cast<std::size_t>(std::lround(place));
    if (k < distances.size())
    {
      distances[k].push_back((point - line[k]).norm());
    }
  }
  double radius = StandardRadius;
  for (std::vector<double>& here : distances)
  {
    if (!here.empty())
    {
      const auto middle = here.begin() + static_cast<std::ptrdiff_t>(here.size() / 2);
      std::nth_element(here.begin(), middle, here.end());
      radius = std::max(1.0, *middle);
    }
    sections.radii.push_back(radius);
  }
  for (const Vector3& ostium : ostia)
  {
    sections.mouths.push_back(PlaceAlong(sections.points, ostium));
  }
  return sections;
}

AorticContrast::AorticContrast(AorticSections sections, const AorticFlowSettings& settings)
  : Sections_(std::move(sections))
  , Settings(settings)
{
  settings.Validate();
  if (this->Sections_.radii.size() < 2)
  {
    throw std::invalid_argument("contrast medium in the aorta: its sections have no slice");
  }
  const std::size_t count = this->Sections_.radii.size() - 1;
  for (std::size_t i = 0; i < count; ++i)
  {
    this->Volume.push_back(this->Sections_.Volume(i));
    const double area = Pi * this->Sections_.radii[i + 1] * this->Sections_.radii[i + 1];
    this->Exchange.push_back(
      i + 1 < count ? 1e-3 * settings.axialDiffusivity * area / AorticSections::Length : 0.0);
  }
  this->Concentration_.assign(count, 0.0);
  this->Sinuses_.assign(this->Sections_.mouths.size(), 0.0);
  this->Pivot.resize(count);
  this->Right.resize(count);
  this->Flow.resize(count);
}

std::size_t AorticContrast::SliceAt(double place) const
{
  const double slice = std::floor(place / AorticSections::Length);
  return static_cast<std::size_t>(
    std::clamp(slice, 0.0, static_cast<double>(this->Volume.size() - 1)));
}

void AorticContrast::Step(double dt, double flow, const Inflow& inflow)
{
  const double entered = inflow.spilled + inflow.direct;
  if (this->Inside == 0.0 && entered == 0.0)
  {
    return;
  }
  const std::size_t count = this->Volume.size();
  const double wash =
    dt * (this->Settings.systolicExchange * flow + this->Settings.diastolicExchange);
  std::fill(this->Flow.begin(), this->Flow.end(), dt * flow);
  for (std::size_t i = 0; i < count; ++i)
  {
    this->Pivot[i] = this->Volume[i];
    this->Right[i] = this->Volume[i] * this->Concentration_[i];
  }
  // What comes in pushes on what is above it.
  const auto push = [&](std::size_t slice, double volume)
  {
    for (std::size_t i = slice; volume > 0.0 && i < count; ++i)
    {
      this->Flow[i] += volume;
    }
  };
  push(this->SliceAt(inflow.place), inflow.direct);
  this->Right[this->SliceAt(inflow.place)] += inflow.direct;
  // Sinuses, eliminated: c of a sinus = (fixed + wash c of its slice) / whole.
  const double sinusVolume = this->Settings.sinusVolume;
  const auto into = [&](std::size_t s) { return s == inflow.mouth ? inflow.spilled : 0.0; };
  for (std::size_t s = 0; s < this->Sinuses_.size(); ++s)
  {
    const double pushed = into(s);
    const std::size_t slice = this->SliceAt(this->Sections_.mouths[s]);
    const double whole = sinusVolume + wash + pushed;
    this->Pivot[slice] += wash - wash * (wash + pushed) / whole;
    this->Right[slice] += (wash + pushed) * (this->Sinuses_[s] + pushed) / whole;
    push(slice, pushed);
  }
  // Forward: each slice from the one before.
  for (std::size_t i = 0; i < count; ++i)
  {
    const double above = dt * this->Exchange[i];
    const double below = i > 0 ? dt * this->Exchange[i - 1] : 0.0;
    this->Pivot[i] += this->Flow[i] + above + below;
    if (i > 0)
    {
      const double factor = (this->Flow[i - 1] + below) / this->Pivot[i - 1];
      this->Pivot[i] -= factor * below;
      this->Right[i] += factor * this->Right[i - 1];
    }
  }
  for (std::size_t i = count; i-- > 0;)
  {
    const double next = i + 1 < count ? dt * this->Exchange[i] * this->Concentration_[i + 1] : 0.0;
    this->Concentration_[i] = (this->Right[i] + next) / this->Pivot[i];
  }
  for (std::size_t s = 0; s < this->Sinuses_.size(); ++s)
  {
    const double here = this->Concentration_[this->SliceAt(this->Sections_.mouths[s])];
    this->Sinuses_[s] =
      sinusVolume * (this->Sinuses_[s] + into(s) + wash * here) / (sinusVolume + wash + into(s));
  }
  this->Left_ += this->Flow[count - 1] * this->Concentration_[count - 1];
  this->Inside =
    std::inner_product(this->Volume.begin(), this->Volume.end(), this->Concentration_.begin(),
      std::accumulate(this->Sinuses_.begin(), this->Sinuses_.end(), 0.0));
  if (this->Inside < Trace && entered == 0.0)
  {
    this->Left_ += std::exchange(this->Inside, 0.0);
    std::fill(this->Concentration_.begin(), this->Concentration_.end(), 0.0);
    std::fill(this->Sinuses_.begin(), this->Sinuses_.end(), 0.0);
  }
}
}
