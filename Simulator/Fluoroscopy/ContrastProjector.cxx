#include "ContrastProjector.h"

#include "TubeProjection.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr const char* ContrastWords = "contrast medium";
constexpr double CutOff = 4.0; // sigma

std::vector<TubeSection> SectionsOf(const ContrastBranch& branch, double attenuation)
{
  const std::size_t count = branch.points.size();
  if (branch.radii.size() != count || branch.concentrations.size() + (count == 0 ? 0 : 1) != count)
  {
    throw std::invalid_argument("contrast medium: a branch of " + std::to_string(count) +
      " points has " + std::to_string(branch.radii.size()) + " radii and " +
      std::to_string(branch.concentrations.size()) + " concentrations");
  }
  RequirePoints(ContrastWords, branch.points);
  for (const double radius : branch.radii)
  {
    RequireWithin(ContrastWords, "a radius (mm)", radius, 0.0, 1000.0);
  }
  std::vector<TubeSection> sections;
  sections.reserve(branch.concentrations.size());
  for (std::size_t k = 0; k < branch.concentrations.size(); ++k)
  {
    RequireWithin(ContrastWords, "a concentration", branch.concentrations[k], 0.0, 1.0);
    sections.push_back({ { branch.radii[k], branch.radii[k + 1] }, { 0.0, 0.0 },
      attenuation * branch.concentrations[k] });
  }
  return sections;
}

/// What each of `count` pixels has of a Gauss curve, in `share`. @return the first that is within the cut-off
int PixelShares(double centre, double sigma, int count, std::vector<float>& share)
{
  const double reach = CutOff * sigma + 0.5;
  const int first = static_cast<int>(std::ceil(std::clamp(centre - reach, 0.0, double(count))));
  const int last = static_cast<int>(std::floor(std::clamp(centre + reach, -1.0, count - 1.0)));
  share.clear();
  const double scale = 1.0 / (sigma * std::sqrt(2.0));
  const auto cumulated = [&](double place)
  {
    return std::erf(
      std::clamp(scale * (place - centre), -CutOff / std::sqrt(2.0), CutOff / std::sqrt(2.0)));
  };
  const double whole = 2.0 * std::erf(CutOff / std::sqrt(2.0));
  for (int k = first; k <= last; ++k)
  {
    share.push_back(static_cast<float>((cumulated(k + 0.5) - cumulated(k - 0.5)) / whole));
  }
  return first;
}
}

void AddContrast(const std::vector<ContrastBranch>& branches, double attenuation,
  const CArmGeometry& geometry, LineIntegrals& image)
{
  RequireFormat(ContrastWords, geometry, image);
  RequireWithin(ContrastWords, "the attenuation (1/mm)", attenuation, 0.0, 1000.0);
  for (const ContrastBranch& branch : branches)
  {
    AddTubes(branch.points, SectionsOf(branch, attenuation), geometry, image);
  }
}

void AddBlush(const std::vector<ContrastBlush>& clouds, double attenuation,
  const CArmGeometry& geometry, LineIntegrals& image)
{
  RequireFormat(ContrastWords, geometry, image);
  RequireWithin(ContrastWords, "the attenuation (1/mm)", attenuation, 0.0, 1000.0);
  const DetectorFormat& format = geometry.Format();
  const double columnSpacing = format.width / format.columns;
  const double rowSpacing = format.height / format.rows;
  std::vector<float> across;
  std::vector<float> down;
  for (const ContrastBlush& cloud : clouds)
  {
    RequireWithin(ContrastWords, "a cloud's volume (mL)", cloud.volume, 0.0, 1e4);
    RequireWithin(ContrastWords, "a cloud's sigma (mm)", cloud.sigma, 1e-3, 1000.0);
    RequireWithin(
      ContrastWords, "a cloud's distance from the origin", cloud.position.norm(), 0.0, 1e6);
    const Vector3 centre = geometry.Project(cloud.position);
    if (!(centre.z() > CutOff * cloud.sigma))
    {
      continue;
    }
    const double magnification = geometry.Magnification(centre.z());
    const int firstColumn =
      PixelShares(centre.x(), cloud.sigma * magnification / columnSpacing, image.columns, across);
    const int firstRow =
      PixelShares(centre.y(), cloud.sigma * magnification / rowSpacing, image.rows, down);
    // A ray that is not perpendicular to the detector meets less of its area.
    const double cosine = centre.z() / (cloud.position - geometry.Source()).norm();
    const auto total = static_cast<float>(attenuation * 1000.0 * cloud.volume * magnification *
      magnification / (cosine * columnSpacing * rowSpacing));
    for (std::size_t j = 0; j < down.size(); ++j)
    {
      float* row =
        &image.values[(static_cast<std::size_t>(firstRow) + j) * image.columns + firstColumn];
      const float factor = total * down[j];
      for (std::size_t i = 0; i < across.size(); ++i)
      {
        row[i] += factor * across[i];
      }
    }
  }
}
}
