#include "LumenSight.h"

#include "CrossFrame.h"
#include "LumenMeasurement.h"
#include "Median.h"
#include "ParallelFor.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

namespace coronary
{
namespace
{
constexpr double Step = 1.0;   ///< mm along the lines between sections
constexpr double Chord = 1.0;  ///< mm to both sides, for a section's normal
constexpr double Usual = 1.5;  ///< mm, radius where none is known
constexpr int Directions = 12; ///< around a section
/// Of the least bright of the surroundings: other vessels and chambers may be beside it.
constexpr double SurroundingQuantile = 0.4;
constexpr double WidestQuarter = 0.75;

struct Section
{
  std::size_t line = 0;
  std::size_t first = 0; ///< of its points
  std::size_t last = 0;
  Vector3 tangent = Vector3::Zero();
  double radius = Usual;
  double inside = 0.0;
  double around = 0.0;
};

std::vector<Section> SectionsOf(const Polylines& lines, const std::vector<Vector3>& places)
{
  std::vector<Section> sections;
  for (std::size_t l = 0; l < lines.lines.size(); ++l)
  {
    const std::vector<std::int64_t>& line = lines.lines[l];
    for (std::size_t i = 0; i < line.size();)
    {
      Section section;
      section.line = l;
      section.first = i;
      double passed = 0.0;
      for (++i; i < line.size() && passed < Step; ++i)
      {
        passed += (places[line[i]] - places[line[i - 1]]).norm();
      }
      section.last = i;
      const Vector3& centre = places[line[section.first]];
      std::size_t before = section.first;
      std::size_t after = section.first;
      while (before > 0 && (places[line[before]] - centre).norm() < Chord)
      {
        --before;
      }
      while (after + 1 < line.size() && (places[line[after]] - centre).norm() < Chord)
      {
        ++after;
      }
      const Vector3 chord = places[line[after]] - places[line[before]];
      if (chord.norm() > 0.0)
      {
        section.tangent = chord.normalized();
        section.radius = lines.radius.empty() ? Usual : lines.radius[line[section.first]];
        sections.push_back(section);
      }
    }
  }
  return sections;
}

void Look(const ImageInterpolator& image, const Vector3& centre, Section& section)
{
  const CrossFrame frame(section.tangent);
  const double disc = std::max(0.3, 0.5 * section.radius);
  double sum = image.At(centre);
  std::vector<double> around;
  for (int n = 0; n < Directions; ++n)
  {
    const Vector3 out = frame.Ray(n, Directions);
    sum += image.At(centre + disc * out);
    around.push_back(image.At(centre + (section.radius + 1.5) * out));
    around.push_back(image.At(centre + (section.radius + 2.5) * out));
  }
  section.inside = sum / (Directions + 1);
  section.around = QuantileOf(std::move(around), SurroundingQuantile);
}

/// What a lumen and its surroundings look like in this image: as the widest quarter of the sections does.
LumenReference ReferenceOf(const std::vector<Section>& sections)
{
  std::vector<double> radii;
  for (const Section& section : sections)
  {
    radii.push_back(section.radius);
  }
  const double wide = QuantileOf(radii, WidestQuarter);
  std::vector<double> inside;
  std::vector<double> around;
  for (const Section& section : sections)
  {
    if (section.radius >= wide)
    {
      inside.push_back(section.inside);
      around.push_back(section.around);
    }
  }
  return { MedianOf(std::move(inside)), MedianOf(std::move(around)), wide };
}
}

LumenSight SeeLumens(
  const ScalarImage& image, const Polylines& lines, const std::vector<Vector3>& places)
{
  constexpr RequireOf require{ "LumenSight" };
  require(places.size() == lines.points.size(), "the lines have other points");
  LumenSight sight{ std::vector<double>(places.size(), 0.0),
    std::vector<double>(places.size(), 0.0) };
  std::vector<Section> sections = SectionsOf(lines, places);
  if (sections.empty())
  {
    return sight;
  }
  const ImageInterpolator values(image);
  const auto count = static_cast<std::int64_t>(sections.size());
  const auto placeOf = [&](const Section& section) -> const Vector3&
  { return places[lines.lines[section.line][section.first]]; };
  const auto each = [&](const auto& work)
  {
    ParallelFor(count, 16,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          work(n);
        }
      });
  };
  each([&](std::int64_t n) { Look(values, placeOf(sections[n]), sections[n]); });
  LumenSettings settings;
  settings.reference = ReferenceOf(sections);
  std::vector<double> beside(sections.size(), NoLumenBeside);
  if (settings.reference.lumen > settings.reference.background)
  {
    each(
      [&](std::int64_t n)
      {
        const Vector3& place = placeOf(sections[n]);
        const LumenSection seen =
          MeasureLumen(values, place, sections[n].tangent, sections[n].radius, settings);
        if (seen.confidence > 0.0)
        {
          beside[n] = std::min(NoLumenBeside, (seen.centre - place).norm());
        }
      });
  }
  for (std::size_t n = 0; n < sections.size(); ++n)
  {
    const std::vector<std::int64_t>& line = lines.lines[sections[n].line];
    for (std::size_t i = sections[n].first; i < sections[n].last; ++i)
    {
      sight.beside[line[i]] = beside[n];
      sight.contrast[line[i]] = std::max(0.0, sections[n].inside - sections[n].around);
    }
  }
  return sight;
}

std::vector<LumenSight> SeeLumens(const Polylines& lines, const PoseSequence& poses,
  const std::function<ScalarImage(double time)>& imageAt, const ProgressCallback& progress,
  ItemSharing& sharing)
{
  const std::size_t phases = poses.times.size();
  const std::vector<std::string> results = sharing.ResultsOfAll(phases,
    [&](std::size_t k)
    {
      const LumenSight sight = SeeLumens(imageAt(poses.times[k]), lines, poses.points[k]);
      Report(progress, static_cast<double>(k + 1) / static_cast<double>(phases));
      return Packed(sight.beside, sight.contrast);
    });
  std::vector<LumenSight> sights(phases);
  for (std::size_t k = 0; k < phases; ++k)
  {
    Unpack(results[k], sights[k].beside, sights[k].contrast);
  }
  return sights;
}
}
