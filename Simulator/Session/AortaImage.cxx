#include "AortaImage.h"

#include "Numbers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr double Faintest = 1.5e-4; // of neat medium: a grey value or so across the aorta
constexpr double FaintSinus = 1e-4; // mL
// How it looks, chosen.
constexpr double SinusPart = 0.8; // sigma of each part of a sinus, of a ball's of its whole volume
constexpr std::array<std::pair<double, double>, 3> SinusParts{ { { -1.2, 0.4 }, { 0.3, 0.4 },
  { 1.8, 0.2 } } };                   // sigmas up the aorta, and the part
constexpr double StreamLength = 25.0; // mm after which medium is mixed across
constexpr double StreamMedium = 0.1;  // mL in the sinus from where on most of it comes from there

/// Of a ball of so many mL, mixed: the root of its mean square along a line.
double SigmaOf(double volume)
{
  return std::cbrt(750.0 * volume / Pi) / std::sqrt(5.0);
}
}

AortaImage::AortaImage(const WallTopology& topology)
  : Sections(SectionsOfAorta(topology))
  , Motion(topology, Sections.points)
{
  std::size_t point = 0;
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    if (b >= topology.parent.size() || topology.parent[b] < 0)
    {
      this->Ostia.push_back(point);
    }
    point += topology.axis[b].size();
  }
}

std::unique_ptr<AortaImage> AortaImage::Make(const WallTopology& topology)
{
  if (!topology.aorta)
  {
    return nullptr;
  }
  try
  {
    return std::unique_ptr<AortaImage>(new AortaImage(topology));
  }
  catch (const std::invalid_argument&)
  {
    return nullptr; // no artery comes from it
  }
}

std::size_t AortaImage::SectionAt(double place) const
{
  return std::min(
    static_cast<std::size_t>(std::lround(place / AorticSections::Length)), this->Points.size() - 1);
}

/// Unit, up the aorta.
Vector3 AortaImage::DirectionAt(std::size_t section) const
{
  const std::size_t after = std::min(section + 1, this->Points.size() - 1);
  return (this->Points[after] - this->Points[after - 1]).stableNormalized();
}

/// Where a sinus' medium is: parts of it in the cusp, before the ostium and above.
void AortaImage::AddSinus(std::size_t sinus, double medium, const Vector3& ostium)
{
  const double sigma = SigmaOf(AorticFlowSettings().sinusVolume) * SinusPart;
  const std::size_t near = this->SectionAt(this->Sections.mouths[sinus]);
  const Vector3 inwards = (this->Points[near] - ostium).stableNormalized();
  const Vector3 up = this->DirectionAt(near);
  for (const auto& [place, share] : SinusParts)
  {
    this->Clouds.push_back(
      { ostium + 2.0 * sigma * inwards + place * sigma * up, share * medium, sigma });
  }
}

/// Medium out of an ostium keeps to its side before it is mixed across. @return of each slice: the part that does
std::vector<double> AortaImage::AddStream(
  std::size_t sinus, double medium, const Vector3& ostium, const std::vector<double>& slices)
{
  std::vector<double> aside(slices.size(), 0.0);
  const double mouth = this->Sections.mouths[sinus];
  const Vector3 outwards = (ostium - this->Points[this->SectionAt(mouth)]).stableNormalized();
  for (std::size_t k = 0; k < slices.size(); ++k)
  {
    const double away = AorticSections::Length * (static_cast<double>(k) + 0.5) - mouth;
    const double share =
      medium / (medium + StreamMedium) * std::exp(-std::abs(away) / StreamLength);
    const double radius = 0.5 * (this->Sections.radii[k] + this->Sections.radii[k + 1]);
    aside[k] = share;
    if (share * slices[k] > Faintest)
    {
      const Vector3 direction = this->DirectionAt(k);
      const Vector3 side = (outwards - direction * direction.dot(outwards)).stableNormalized();
      const double sigma = 0.3 * radius;
      this->Clouds.push_back(
        { 0.5 * (this->Points[k] + this->Points[k + 1]) + (radius - 2.0 * sigma) * side,
          share * slices[k] * this->Sections.Volume(k), sigma });
    }
  }
  return aside;
}

void AortaImage::Add(const std::vector<Vector3>& axis, const std::vector<double>& slices,
  const std::vector<double>& sinuses, double attenuation, const CArmGeometry& geometry,
  LineIntegrals& image)
{
  const bool any =
    std::any_of(slices.begin(), slices.end(), [](double medium) { return medium > Faintest; });
  const bool cloudy =
    std::any_of(sinuses.begin(), sinuses.end(), [](double medium) { return medium > FaintSinus; });
  if (!any && !cloudy)
  {
    return;
  }
  this->Motion.Positions(axis, this->Points);
  this->Clouds.clear();
  std::vector<double> mixed = slices;
  for (std::size_t s = 0; s < sinuses.size() && s < this->Ostia.size(); ++s)
  {
    if (sinuses[s] > FaintSinus)
    {
      const Vector3& ostium = axis[this->Ostia[s]];
      this->AddSinus(s, sinuses[s], ostium);
      const std::vector<double> aside = this->AddStream(s, sinuses[s], ostium, mixed);
      for (std::size_t k = 0; k < mixed.size(); ++k)
      {
        mixed[k] *= mixed[k] * aside[k] > Faintest ? 1.0 - aside[k] : 1.0;
      }
    }
  }
  if (any)
  {
    // From the first to the last slice that shows: time goes with the pixels.
    const auto shows = [](double medium) { return medium > Faintest; };
    const auto first = std::find_if(mixed.begin(), mixed.end(), shows);
    const auto last = std::find_if(mixed.rbegin(), mixed.rend(), shows).base();
    const auto from = first - mixed.begin();
    const auto to = last - mixed.begin();
    this->Branch.concentrations.assign(first, std::max(first, last));
    this->Branch.points.clear();
    this->Branch.radii.clear();
    for (auto k = from; k <= to && !this->Branch.concentrations.empty(); ++k)
    {
      this->Branch.points.push_back(this->Points[static_cast<std::size_t>(k)]);
      this->Branch.radii.push_back(this->Sections.radii[static_cast<std::size_t>(k)]);
    }
    for (double& medium : this->Branch.concentrations)
    {
      medium = std::clamp(medium, 0.0, 1.0);
    }
    AddContrast({ this->Branch }, attenuation, geometry, image);
  }
  if (!this->Clouds.empty())
  {
    AddBlush(this->Clouds, attenuation, geometry, image);
  }
}
}
