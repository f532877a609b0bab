#include "vtkVesselPictures.h"

#include "Median.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <set>
#include <stdexcept>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;
using Anchor = PictureCanvas::Anchor;

constexpr double PixelsPerMillimetre = 6.0; // of straightened views
constexpr double SlabPixel = 0.25;          // mm
constexpr double SheetPixel = 0.5;          // mm
constexpr double SlabMargin = 10.0;         // mm around a vessel
constexpr double CurvedPixel = 0.25;        // mm
constexpr double CurvedAngle = 45.0;  // degrees: its bends are seen, and little of it is end on
constexpr double SectionPixel = 0.25; // mm
constexpr double SectionWidth = 6.0;  // mm to each side of the axis
constexpr int SectionColumns = 20;
constexpr int SectionRays = 32;           // of the boundaries around a section
constexpr double MostColumns = 6000.0;    // of a straightened view: longer vessels are coarser
constexpr double MostSlabPixels = 2000.0; // across; the same
constexpr double MostSheetPixels = 600.0; // across a slab of a sheet; the same
constexpr double SheetMargin = 20.0; // mm around the trees: missed vessels are looked for there
constexpr int SheetColumns = 5;
constexpr int MostSlabs = 40;
/// A narrowing that is written beside the vessel.
constexpr double ToldNarrowing = 0.25;

constexpr int LeftMargin = 52;
constexpr int RightMargin = 14;
constexpr int NameBand = 24;
constexpr int RulerBand = 53; // two rows of names
constexpr int DiameterBand = 84;
constexpr int AttenuationBand = 60;
constexpr int MinimumWidth = 300;

constexpr Colour Black = { 0, 0, 0 };
constexpr Colour Panel = { 22, 24, 28 };
constexpr Colour White = { 240, 240, 240 };
constexpr Colour Soft = { 150, 156, 166 };
constexpr Colour Dim = { 70, 75, 84 };
constexpr Colour Wall = { 80, 215, 255 };
constexpr Colour Outer = { 196, 140, 255 };
constexpr Colour Bridge = { 255, 150, 20 };
constexpr Colour Hand = { 255, 110, 200 };
constexpr Colour Guess = { 190, 190, 200 };
constexpr Colour Chalk = { 255, 236, 90 };
constexpr Colour Alarm = { 255, 96, 96 };
constexpr Colour Healthy = { 120, 210, 130 };
constexpr Colour Hatch = { 46, 50, 74 };
constexpr Colour HatchLine = { 84, 90, 128 };

std::string Text(const char* format, double value)
{
  char text[64];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

/// A name that has room beside a vessel; never a part of a letter.
std::string Brief(const std::string& name)
{
  constexpr std::size_t Longest = 40;
  if (name.size() <= Longest)
  {
    return name;
  }
  std::size_t end = Longest - 3;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0U) == 0x80U)
  {
    --end;
  }
  return name.substr(0, end) + "...";
}

Json Triple(const Vector3& v)
{
  const auto rounded = [](double value) { return std::round(1e4 * value) / 1e4; };
  return { rounded(v[0]), rounded(v[1]), rounded(v[2]) };
}

Json PlaneJson(const SlabPlane& plane)
{
  return { { "corner", Triple(plane.corner) }, { "right", Triple(plane.right) },
    { "down", Triple(plane.down) }, { "spacing", plane.spacing }, { "width", plane.width },
    { "height", plane.height } };
}

/// The patient's side that a direction goes to most.
const char* SideOf(const Vector3& direction)
{
  static const char* const Names[3][2] = { { "L", "R" }, { "P", "A" }, { "H", "F" } };
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return Names[axis][direction[axis] < 0.0 ? 1 : 0];
}

/// How sure the run is of a place of the tree.
enum class Sight
{
  Seen,
  ByHand,
  Interpolated,
  Bridged
};

Colour ColourOf(Sight sight)
{
  return sight == Sight::Bridged   ? Bridge
    : sight == Sight::Interpolated ? Guess
    : sight == Sight::ByHand       ? Hand
                                   : Wall;
}

/// A piece between two places is no surer than the less sure of them.
Sight Between(Sight a, Sight b)
{
  return std::max(a, b);
}

/// Lines through places, apart where the sight changes.
template <typename At>
void DrawBySight(MarkedPicture& picture, const std::vector<Sight>& sights, At at, double width,
  double opacity = 1.0)
{
  for (std::size_t begin = 0; begin + 1 < sights.size();)
  {
    const Sight sight = Between(sights[begin], sights[begin + 1]);
    std::size_t end = begin + 1;
    while (end + 1 < sights.size() && Between(sights[end], sights[end + 1]) == sight)
    {
      ++end;
    }
    std::vector<MarkedPicture::Place> places;
    for (std::size_t k = begin; k <= end; ++k)
    {
      places.push_back(at(k));
    }
    picture.Line(places, sight == Sight::Bridged ? width + 0.6 : width, ColourOf(sight),
      sight <= Sight::ByHand ? 0.0 : 4.0, opacity);
    begin = end;
  }
}

std::vector<double> Picked(
  const std::vector<double>& values, const std::vector<std::int64_t>& points)
{
  std::vector<double> picked;
  for (const std::int64_t point : points)
  {
    picked.push_back(values[static_cast<std::size_t>(point)]);
  }
  return picked;
}

std::vector<Vector3> AxisOf(const RunResult& result, const VesselChain& chain)
{
  std::vector<Vector3> axis;
  for (const std::int64_t point : chain.points)
  {
    axis.push_back(result.tree.points[static_cast<std::size_t>(point)]);
  }
  return axis;
}

bool HasValues(const std::vector<double>& values, const RunResult& result)
{
  return values.size() == result.tree.points.size();
}

Sight SightOf(const RunResult& result, std::int64_t point)
{
  const auto marked = [&](const std::vector<double>& values)
  { return HasValues(values, result) && values[static_cast<std::size_t>(point)] > 0.5; };
  return marked(result.bridged)   ? Sight::Bridged
    : marked(result.interpolated) ? Sight::Interpolated
    : marked(result.edited)       ? Sight::ByHand
                                  : Sight::Seen;
}

/// Of the box around points, mm.
double SizeOf(const std::vector<Vector3>& points)
{
  Vector3 low = points.front();
  Vector3 high = points.front();
  for (const Vector3& point : points)
  {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  return (high - low).norm();
}
}

std::vector<VesselView> ViewsOf(const RunResult& result)
{
  std::vector<VesselView> views;
  std::set<std::string> used;
  for (VesselChain& chain : JoinVessels(result.tree, result.names))
  {
    if (chain.Length() <= 0.0)
    {
      continue; // points that coincide
    }
    VesselView view;
    view.name = chain.name;
    for (int number = 2; !used.insert(view.name).second; ++number)
    {
      view.name = chain.name + " (" + std::to_string(number) + ")";
    }
    for (std::size_t k = 1; k < chain.points.size(); ++k)
    {
      const double step = chain.arc[k] - chain.arc[k - 1];
      if (chain.arc[k] <= 0.0)
      {
        continue;
      }
      const Sight sight =
        Between(SightOf(result, chain.points[k - 1]), SightOf(result, chain.points[k]));
      view.bridged += sight == Sight::Bridged ? step : 0.0;
      view.edited += sight == Sight::ByHand ? step : 0.0;
      view.interpolated += sight == Sight::Interpolated ? step : 0.0;
      if (HasValues(result.stenosis, result))
      {
        const double degree = result.stenosis[static_cast<std::size_t>(chain.points[k])];
        view.narrowest =
          degree >= ToldNarrowing ? std::max(view.narrowest, degree) : view.narrowest;
      }
    }
    std::vector<Vector3> own;
    for (std::size_t k = 0; k < chain.points.size(); ++k)
    {
      if (chain.arc[k] >= 0.0)
      {
        own.push_back(result.tree.points[static_cast<std::size_t>(chain.points[k])]);
      }
    }
    view.path = FollowAxis(own, 1.0).position;
    view.chain = std::move(chain);
    views.push_back(std::move(view));
  }
  return views;
}

GreyWindow WindowOf(const RunResult& result, const ImageInterpolator& image)
{
  constexpr double MinimumLumen = 120.0; // HU, of contrast in an artery
  constexpr double MaximumLumen = 1500.0;
  std::vector<double> values;
  for (const Vector3& point : result.tree.points)
  {
    if (image.Contains(point))
    {
      values.push_back(image.At(point));
    }
  }
  if (values.empty())
  {
    return { -150.0, 850.0 };
  }
  // Of the wide vessels' axes, which the many thin ones must not outnumber.
  const double lumen = InclusiveQuantileOf(std::move(values), 0.75);
  if (lumen > MinimumLumen && lumen < MaximumLumen)
  {
    return { -150.0, std::max(500.0, 2.0 * lumen) };
  }
  // Not HU: what surrounds the vessels is black.
  std::vector<double> around;
  for (std::size_t k = 0; k < result.tree.points.size(); ++k)
  {
    for (int axis = 0; axis < 6; ++axis)
    {
      Vector3 place = result.tree.points[k];
      place[axis / 2] += axis % 2 == 0 ? 6.0 : -6.0;
      if (image.Contains(place))
      {
        around.push_back(image.At(place));
      }
    }
  }
  std::sort(around.begin(), around.end());
  const double low = around.empty() ? 0.0 : around[around.size() / 50];
  return { low, low + std::max(1e-6, 2.0 * (lumen - low)) };
}

/// What is known at each column of a straightened view.
struct VesselPainter::Profile
{
  std::vector<double> radius;    ///< mm
  std::vector<double> reference; ///< mm; empty: not known
  std::vector<double> stenosis;  ///< 0 to 1; empty: not known
  std::vector<double> calcium;   ///< label; empty: not known
  std::vector<double> sureness;  ///< of bridges, 0 to 1; empty: not known
  std::vector<Sight> sight;
};

VesselPainter::VesselPainter(const RunResult& result, const ImageInterpolator& image,
  const ResultLabels& calcium, const ViewSettings& settings)
  : Result(result)
  , Image(image)
  , Calcium(calcium)
  , Settings(settings)
  , Greys(settings.window.size() == 2 ? GreyWindow{ settings.window[0], settings.window[1] }
                                      : WindowOf(result, image))
{
}

unsigned char VesselPainter::Grey(float value) const
{
  const double part = (value - this->Greys.low) / (this->Greys.high - this->Greys.low);
  return static_cast<unsigned char>(std::lround(255.0 * std::clamp(part, 0.0, 1.0)));
}

void VesselPainter::DrawCut(MarkedPicture& picture, const GreyPicture& cut, int x, int y) const
{
  for (int row = 0; row < cut.height; ++row)
  {
    unsigned char* pixels = picture.plain.Row(y + row) + 3 * std::size_t(x);
    for (int column = 0; column < cut.width; ++column)
    {
      const float value = cut.At(column, row);
      Colour colour = { 0, 0, 0 };
      if (std::isnan(value))
      {
        colour = (column + row) % 8 < 2 ? HatchLine : Hatch;
      }
      else
      {
        colour.fill(this->Grey(value));
      }
      std::copy(colour.begin(), colour.end(), pixels + 3 * std::size_t(column));
    }
  }
}

VesselPainter::Profile VesselPainter::ProfileOf(
  const VesselView& view, const FramedCurve& curve) const
{
  const std::vector<std::int64_t>& points = view.chain.points;
  const auto known = [&](const std::vector<double>& values)
  { return HasValues(values, this->Result) ? Picked(values, points) : std::vector<double>(); };
  Profile profile;
  profile.radius = curve.Interpolated(Picked(this->Result.tree.radius, points));
  const auto sampled = [&](const std::vector<double>& values, bool nearest)
  {
    const std::vector<double> picked = known(values);
    return picked.empty() ? picked : (nearest ? curve.Nearest(picked) : curve.Interpolated(picked));
  };
  profile.reference = sampled(this->Result.reference, false);
  profile.stenosis = sampled(this->Result.stenosis, false);
  profile.calcium = sampled(this->Result.calcium, true);
  profile.sureness = sampled(this->Result.bridgeConfidence, true);
  std::vector<double> sights;
  for (const std::int64_t point : points)
  {
    sights.push_back(static_cast<double>(SightOf(this->Result, point)));
  }
  for (const double sight : curve.Nearest(sights))
  {
    profile.sight.push_back(static_cast<Sight>(std::lround(sight)));
  }
  return profile;
}

void VesselPainter::DrawWalls(
  MarkedPicture& picture, const Profile& profile, double step, int x, int y) const
{
  for (const double side : { 1.0, -1.0 })
  {
    DrawBySight(
      picture, profile.sight,
      [&](std::size_t k) -> MarkedPicture::Place {
        return { double(x) + double(k), y - side * profile.radius[k] / step };
      },
      1.0, 0.9);
  }
  // The axis itself where it is a guess.
  for (std::size_t k = 0; k < profile.sight.size(); ++k)
  {
    if (profile.sight[k] == Sight::Bridged && k % 8 < 4)
    {
      picture.Fill(x + static_cast<int>(k), y, 1, 1, Bridge, 1.0);
    }
  }
}

VesselBoundaries VesselPainter::BoundariesOf(
  const FramedCurve& curve, const VesselView& view, const ProgressCallback& progress) const
{
  BoundarySettings settings;
  settings.rays = SectionRays;
  return TraceBoundaries(this->Image, curve,
    curve.Interpolated(Picked(this->Result.tree.radius, view.chain.points)), settings, progress);
}

/// On both sides of the axis. @param angle  degrees of the upper side
void VesselPainter::DrawOuter(MarkedPicture& picture, const VesselBoundaries& boundaries,
  std::size_t places, double angle, double step, int x, int y) const
{
  for (const double side : { 1.0, -1.0 })
  {
    std::vector<MarkedPicture::Place> line;
    for (std::size_t k = 0; k <= places; ++k)
    {
      const double away = k < places
        ? boundaries.At(boundaries.outer, k, side > 0.0 ? angle : angle + 180.0)
        : std::numeric_limits<double>::quiet_NaN();
      if (!std::isnan(away))
      {
        line.push_back({ double(x) + double(k), y - side * away / step });
      }
      else if (!line.empty())
      {
        picture.Line(line, 0.8, Outer, 0.0, 0.8);
        line.clear();
      }
    }
  }
}

void VesselPainter::DrawCalcium(MarkedPicture& picture, const FramedCurve& curve,
  const std::vector<Vector3>& across, int x, int y) const
{
  if (this->Calcium.Empty())
  {
    return;
  }
  const int half = static_cast<int>(std::lround(this->Settings.halfWidth / curve.step));
  const auto inside = [&](int column, int row)
  {
    if (column < 0 || column >= static_cast<int>(curve.position.size()) || std::abs(row) > half)
    {
      return false;
    }
    const auto k = static_cast<std::size_t>(column);
    return this->Calcium.At(curve.position[k] + row * curve.step * across[k]) != 0;
  };
  for (int row = -half; row <= half; ++row)
  {
    for (int column = 0; column < static_cast<int>(curve.position.size()); ++column)
    {
      if (inside(column, row) &&
        !(inside(column - 1, row) && inside(column + 1, row) && inside(column, row - 1) &&
          inside(column, row + 1)))
      {
        picture.Fill(x + column, y - row, 1, 1, Chalk, 0.9);
      }
    }
  }
}

void VesselPainter::DrawRuler(MarkedPicture& picture, const VesselView& view,
  const FramedCurve& curve, double lead, int x, int y) const
{
  const auto at = [&](double arc)
  { return x + static_cast<int>(std::lround((arc + lead) / curve.step)); };
  PictureCanvas& canvas = picture.plain;
  for (int arc = 0; arc <= static_cast<int>(view.chain.Length()); arc += 5)
  {
    const bool tens = arc % 10 == 0;
    canvas.Fill(at(arc), y, 1, tens ? 7 : 4, Soft);
    if (tens)
    {
      canvas.Write(at(arc), y + 14, std::to_string(arc), 11, Soft, Anchor::Centre);
    }
  }
  canvas.Write(x - 6, y + 14, "mm", 11, Soft, Anchor::Right);
  int free[2] = { 0, 0 };
  for (const VesselFork& fork : view.chain.forks)
  {
    const int place = at(fork.arc);
    for (int k = 0; k < 5; ++k)
    {
      canvas.Fill(place - k, y + 22 + k, 2 * k + 1, 1, White);
    }
    const int row = place + 7 > free[0] ? 0 : 1;
    if (place + 7 > free[row])
    {
      free[row] =
        place + 15 + canvas.Write(place + 8, y + 28 + 13 * row, Brief(fork.name), 11, White);
    }
  }
}

void VesselPainter::DrawDiameter(MarkedPicture& picture, const Profile& profile, int x, int y) const
{
  PictureCanvas& canvas = picture.plain;
  const int width = static_cast<int>(profile.radius.size());
  const int height = DiameterBand - 14;
  double maximum = 2.0;
  for (const std::vector<double>* values : { &profile.radius, &profile.reference })
  {
    for (const double value : *values)
    {
      maximum = std::isfinite(value) ? std::max(maximum, 2.0 * value) : maximum;
    }
  }
  maximum = std::min(2.0 * std::ceil(0.5 * maximum), 40.0);
  canvas.Fill(x, y, width, height, Panel);
  const double scale = height / maximum;
  for (int k = 0; k <= 2; ++k)
  {
    const int row = y + height - static_cast<int>(std::lround(0.5 * k * maximum * scale));
    canvas.Fill(x, std::min(row, y + height - 1), width, 1, Dim);
    canvas.Write(x - 6, row, Text("%g", 0.5 * k * maximum), 11, Soft, Anchor::Right);
  }
  canvas.Write(4, y + height / 2, "\xC3\x98", 12, Soft);
  const auto bottom = double(y + height);
  const auto curve = [&](const std::vector<double>& radii)
  {
    return [&radii, x, bottom, scale](std::size_t k) -> MarkedPicture::Place {
      return { double(x) + double(k), bottom - 2.0 * radii[k] * scale };
    };
  };
  for (std::size_t k = 0; k < profile.sight.size(); ++k)
  {
    if (profile.sight[k] != Sight::Seen)
    {
      picture.Fill(x + static_cast<int>(k), y, 1, height, ColourOf(profile.sight[k]), 0.25);
    }
    if (!profile.calcium.empty() && profile.calcium[k] > 0.0)
    {
      picture.Fill(x + static_cast<int>(k), y + height - 4, 1, 4, Chalk, 1.0);
    }
  }
  if (!profile.reference.empty())
  {
    std::vector<MarkedPicture::Place> places;
    for (std::size_t k = 0; k < profile.reference.size(); ++k)
    {
      places.push_back(curve(profile.reference)(k));
    }
    picture.Line(places, 1.0, Healthy, 5.0);
  }
  DrawBySight(picture, profile.sight, curve(profile.radius), 1.4);
  // How sure the run is of each bridge, where it is least so.
  for (std::size_t begin = 0; begin < profile.sureness.size(); ++begin)
  {
    std::size_t end = begin;
    double minimum = 1.0;
    while (end < profile.sureness.size() && profile.sight[end] == Sight::Bridged)
    {
      minimum = std::min(minimum, profile.sureness[end++]);
    }
    if (end > begin)
    {
      picture.Write(x + static_cast<int>((begin + end) / 2), y + height - 9, Text("%.2f", minimum),
        11, Bridge, Anchor::Centre);
      begin = end;
    }
  }
  // Each narrowing at its narrowest place.
  for (std::size_t begin = 0; begin < profile.stenosis.size(); ++begin)
  {
    std::size_t end = begin;
    std::size_t worst = begin;
    while (end < profile.stenosis.size() && profile.stenosis[end] >= ToldNarrowing)
    {
      worst = profile.stenosis[end] > profile.stenosis[worst] ? end : worst;
      ++end;
    }
    if (end > begin)
    {
      picture.Fill(x + static_cast<int>(begin), y, static_cast<int>(end - begin), 3, Alarm, 1.0);
      picture.Write(x + static_cast<int>(worst), y + 12,
        Text("%.0f %%", 100.0 * profile.stenosis[worst]), 12, Alarm, Anchor::Centre);
      begin = end;
    }
  }
}

void VesselPainter::DrawAttenuation(
  MarkedPicture& picture, const GreyPicture& cut, int x, int y) const
{
  PictureCanvas& canvas = picture.plain;
  const int height = AttenuationBand - 14;
  canvas.Fill(x, y, cut.width, height, Panel);
  const double low = std::min(0.0, this->Greys.low);
  const double scale = height / std::max(1e-9, this->Greys.high - low);
  for (const double value : { 0.0, 0.5 * this->Greys.high, this->Greys.high })
  {
    const int row = y + height - static_cast<int>(std::lround((value - low) * scale));
    canvas.Fill(x, std::clamp(row, y, y + height - 1), cut.width, 1, Dim);
    canvas.Write(x - 6, row, Text("%.0f", value), 11, Soft, Anchor::Right);
  }
  canvas.Write(2, y + height + 6, "on axis", 10, Soft);
  std::vector<MarkedPicture::Place> places;
  const int middle = cut.height / 2;
  for (int column = 0; column <= cut.width; ++column)
  {
    const float value =
      column < cut.width ? cut.At(column, middle) : std::numeric_limits<float>::quiet_NaN();
    if (std::isnan(value))
    {
      picture.Line(places, 1.0, White);
      places.clear();
      continue;
    }
    const double shown = std::clamp(double(value), low, this->Greys.high);
    places.push_back({ double(x + column), y + height - (shown - low) * scale });
  }
}

ViewPicture VesselPainter::Straightened(
  const VesselView& view, const ProgressCallback& progress) const
{
  const double whole = view.chain.arc.back() - view.chain.arc.front();
  const FramedCurve curve = FollowAxis(
    AxisOf(this->Result, view.chain), std::max(1.0 / PixelsPerMillimetre, whole / MostColumns));
  const auto cuts = StraightenVessel(this->Image, curve, this->Settings.halfWidth, progress);
  const Profile profile = this->ProfileOf(view, curve);
  const VesselBoundaries boundaries = this->BoundariesOf(curve, view, progress);
  const int columns = cuts[0].width;
  const int rows = cuts[0].height;
  const int gap = 4;
  const int ruler = NameBand + 2 * rows + gap;
  MarkedPicture picture(std::max(MinimumWidth, LeftMargin + columns + RightMargin),
    ruler + RulerBand + DiameterBand + AttenuationBand, Black);
  const int x = LeftMargin;
  const int firstRow = NameBand;
  const int secondRow = NameBand + rows + gap;
  const double lead = -view.chain.arc.front();
  const auto at = [&](double arc)
  { return x + static_cast<int>(std::lround((arc + lead) / curve.step)); };

  int free = 0;
  if (lead > 0.0)
  {
    free = x + 4 + picture.plain.Write(x, NameBand / 2, "from", 11, Soft);
  }
  for (const VesselPiece& piece : view.chain.pieces)
  {
    const int begin = at(piece.begin);
    picture.plain.Fill(begin, 3, 1, NameBand - 3, Soft);
    if (begin + 4 > free)
    {
      free = begin + 8 +
        picture.plain.Write(
          begin + 4, NameBand / 2, Brief(piece.name), 13, White, Anchor::Left, true);
    }
  }
  int number = 0;
  for (const int row : { firstRow, secondRow })
  {
    const GreyPicture& cut = cuts[static_cast<std::size_t>(number)];
    this->DrawCut(picture, cut, x, row);
    picture.plain.Write(
      x - 6, row + rows / 2, number == 0 ? "0\xC2\xB0" : "90\xC2\xB0", 11, Soft, Anchor::Right);
    this->DrawCalcium(
      picture, curve, number == 0 ? curve.normal : curve.binormal, x, row + rows / 2);
    this->DrawOuter(picture, boundaries, curve.position.size(), number == 0 ? 0.0 : 90.0,
      curve.step, x, row + rows / 2);
    this->DrawWalls(picture, profile, curve.step, x, row + rows / 2);
    if (lead > 0.0)
    {
      picture.Line(
        { { double(at(0.0)), double(row) }, { double(at(0.0)), double(row + rows - 1) } }, 1.0,
        Soft, 3.0, 0.8);
    }
    ++number;
  }
  // 5 mm, upright.
  picture.plain.Fill(x - 24, firstRow + rows / 2 + 14, 2, static_cast<int>(5.0 / curve.step), Soft);
  this->DrawRuler(picture, view, curve, lead, x, ruler + 2);
  this->DrawDiameter(picture, profile, x, ruler + RulerBand);
  this->DrawAttenuation(picture, cuts[0], x, ruler + RulerBand + DiameterBand);
  return { std::move(picture),
    { { "left", at(0.0) }, { "per_mm", 1.0 / curve.step }, { "top", firstRow },
      { "bottom", ruler } } };
}

void VesselPainter::DrawTree(MarkedPicture& picture, const SlabPlane& plane,
  const std::vector<float>& depths, int x, int y, bool thin) const
{
  const double half = 0.5 * this->Settings.thickness;
  const auto within = [&](const Vector3& place)
  {
    const auto column = static_cast<int>(std::lround(place[0]));
    const auto row = static_cast<int>(std::lround(place[1]));
    if (column < 0 || row < 0 || column >= plane.width || row >= plane.height)
    {
      return false;
    }
    const double middle =
      depths.empty() ? 0.0 : depths[static_cast<std::size_t>(row * plane.width + column)];
    return std::abs(place[2] - middle) <= half;
  };
  for (const VesselTree::Branch& branch : this->Result.tree.branches)
  {
    std::vector<Sight> sights;
    std::vector<MarkedPicture::Place> places;
    const auto finish = [&]()
    {
      DrawBySight(
        picture, sights, [&](std::size_t k) { return places[k]; }, thin ? 1.0 : 1.3, 0.85);
      sights.clear();
      places.clear();
    };
    for (const std::int64_t point : branch.points)
    {
      const Vector3 place =
        plane.ToPicture(this->Result.tree.points[static_cast<std::size_t>(point)]);
      if (!within(place))
      {
        finish();
        continue;
      }
      sights.push_back(SightOf(this->Result, point));
      places.push_back({ x + place[0], y + place[1] });
    }
    finish();
  }
}

namespace
{
/// The patient's sides at a picture's edges, and 10 mm.
void DrawFrame(MarkedPicture& picture, const SlabPlane& plane, int x, int y, bool scale)
{
  const int right = x + plane.width;
  const int bottom = y + plane.height;
  picture.Write(right - 5, y + plane.height / 2, SideOf(plane.right), 12, White, Anchor::Right);
  picture.Write(x + 5, y + plane.height / 2, SideOf(-plane.right), 12, White);
  picture.Write(x + plane.width / 2, y + 9, SideOf(-plane.down), 12, White, Anchor::Centre);
  picture.Write(x + plane.width / 2, bottom - 9, SideOf(plane.down), 12, White, Anchor::Centre);
  if (scale)
  {
    const int length = static_cast<int>(std::lround(10.0 / plane.spacing));
    picture.Fill(right - 8 - length, bottom - 8, length, 2, White, 1.0);
    picture.Write(right - 8 - length / 2, bottom - 17, "10 mm", 11, White, Anchor::Centre);
  }
}
}

ViewPicture VesselPainter::Curved(const VesselView& view, const ProgressCallback& progress) const
{
  ReformatSettings settings;
  settings.kind = ReformatKind::Curved;
  settings.angle = CurvedAngle;
  settings.halfWidth = this->Settings.halfWidth;
  settings.spacing =
    std::max(CurvedPixel, (view.chain.arc.back() - view.chain.arc.front()) / MostSlabPixels);
  const VesselReformat reformat =
    ReformatVessel(this->Image, AxisOf(this->Result, view.chain), settings, progress);
  const Profile profile = this->ProfileOf(view, reformat.axis);
  MarkedPicture picture(
    std::max(MinimumWidth, reformat.picture.width), reformat.picture.height, Black);
  this->DrawCut(picture, reformat.picture, 0, 0);
  const int middle = reformat.picture.height / 2;
  const auto pixel = [&](const PicturePlace& place) -> MarkedPicture::Place {
    return { place[0] / settings.spacing, middle - place[1] / settings.spacing };
  };
  for (const double side : { 1.0, -1.0 })
  {
    DrawBySight(
      picture, profile.sight,
      [&](std::size_t k) { return pixel(reformat.Beside(k, side * profile.radius[k])); }, 1.0, 0.9);
  }
  const double lead = -view.chain.arc.front();
  const auto indexAt = [&](double arc)
  {
    return std::min(reformat.track.size() - 1,
      static_cast<std::size_t>(std::lround((arc + lead) / reformat.axis.step)));
  };
  for (const VesselPiece& piece : view.chain.pieces)
  {
    const auto at = pixel(reformat.track[indexAt(0.5 * (piece.begin + piece.end))]);
    picture.Write(
      static_cast<int>(at[0]) + 8, static_cast<int>(at[1]) - 18, Brief(piece.name), 12, White);
  }
  Json layout;
  layout["axis"] = Json::array();
  for (std::size_t arc = 0; arc < view.path.size(); ++arc)
  {
    const auto at = pixel(reformat.track[indexAt(double(arc))]);
    layout["axis"].push_back({ std::round(10.0 * at[0]) / 10.0, std::round(10.0 * at[1]) / 10.0 });
  }
  layout["per_mm"] = 1.0 / settings.spacing;
  return { std::move(picture), std::move(layout) };
}

ViewPicture VesselPainter::Sections(const VesselView& view, const ProgressCallback& progress) const
{
  const FramedCurve curve = FollowAxis(AxisOf(this->Result, view.chain), SectionPixel);
  const VesselBoundaries boundaries = this->BoundariesOf(curve, view, progress);
  const std::vector<double> radius =
    curve.Interpolated(Picked(this->Result.tree.radius, view.chain.points));
  const double lead = -view.chain.arc.front();
  const auto count = static_cast<int>(view.path.size());
  const int side = 2 * static_cast<int>(std::lround(SectionWidth / SectionPixel)) + 1;
  const int rows = (count + SectionColumns - 1) / SectionColumns;
  MarkedPicture picture(std::min(count, SectionColumns) * side, rows * side, Black);
  const auto rounded = [](double value)
  { return std::isnan(value) ? Json() : Json(std::round(100.0 * value) / 100.0); };
  Json layout = { { "tile", side }, { "across", std::min(count, SectionColumns) },
    { "count", count }, { "half_width", SectionWidth }, { "rays", SectionRays } };
  for (const char* name : { "radius", "edge", "outer", "edge_area", "outer_area" })
  {
    layout[name] = Json::array();
  }
  for (int n = 0; n < count; ++n)
  {
    const auto place = std::min(curve.position.size() - 1,
      static_cast<std::size_t>(std::lround((double(n) + lead) / curve.step)));
    const SlabPlane plane = SectionPlane(curve, place, 0.0, SectionWidth, SectionPixel);
    this->DrawCut(picture, ProjectSlab(this->Image, plane, {}, 0.0), (n % SectionColumns) * side,
      (n / SectionColumns) * side);
    Json edge = Json::array();
    Json outer = Json::array();
    for (int ray = 0; ray < SectionRays; ++ray)
    {
      const std::size_t at = place * SectionRays + static_cast<std::size_t>(ray);
      edge.push_back(rounded(boundaries.lumen[at]));
      outer.push_back(rounded(boundaries.outer[at]));
    }
    layout["radius"].push_back(rounded(radius[place]));
    layout["edge"].push_back(edge);
    layout["outer"].push_back(outer);
    layout["edge_area"].push_back(rounded(boundaries.Area(boundaries.lumen, place)));
    layout["outer_area"].push_back(rounded(boundaries.Area(boundaries.outer, place)));
  }
  return { std::move(picture), std::move(layout) };
}

ViewPicture VesselPainter::Slab(const VesselView& view, const ProgressCallback& progress) const
{
  const std::vector<Vector3> axis = AxisOf(this->Result, view.chain);
  const SlabPlane plane =
    PlaneOfVessel(axis, SlabMargin, std::max(SlabPixel, SizeOf(axis) / MostSlabPixels));
  const std::vector<float> depths = DepthsAlong(plane, view.path, 3.0, progress);
  const GreyPicture slab =
    ProjectSlab(this->Image, plane, depths, this->Settings.thickness, progress);
  MarkedPicture picture(plane.width, plane.height, Black);
  this->DrawCut(picture, slab, 0, 0);
  this->DrawTree(picture, plane, depths, 0, 0, false);
  for (const VesselPiece& piece : view.chain.pieces)
  {
    const double middle = 0.5 * (piece.begin + piece.end);
    const auto at = std::min(view.path.size() - 1, static_cast<std::size_t>(std::max(0.0, middle)));
    const Vector3 place = plane.ToPicture(view.path[at]);
    picture.Write(
      static_cast<int>(place[0]) + 8, static_cast<int>(place[1]) - 8, Brief(piece.name), 12, White);
  }
  DrawFrame(picture, plane, 0, 0, true);
  return { std::move(picture), PlaneJson(plane) };
}

bool VesselPainter::Meets(const SlabPlane& plane) const
{
  constexpr int Places = 8; // across the picture
  for (int k = 0; k < (Places + 1) * (Places + 1); ++k)
  {
    const double x = double(k % (Places + 1)) / Places * (plane.width - 1);
    const double y = double(k / (Places + 1)) / Places * (plane.height - 1);
    if (this->Image.Contains(plane.corner + plane.spacing * (x * plane.right + y * plane.down)))
    {
      return true;
    }
  }
  return false;
}

const char* VesselPainter::SheetName(int direction)
{
  static const char* const Names[3] = { "axial", "coronal", "sagittal" };
  return Names[direction];
}

ViewPicture VesselPainter::Sheet(int direction, const ProgressCallback& progress) const
{
  const Vector3 directions[3] = { -Vector3::UnitZ(), -Vector3::UnitY(), Vector3::UnitX() };
  const std::vector<Vector3>& points = this->Result.tree.points;
  const SlabPlane whole = Framed(PlaneTowards(directions[direction]), points, SheetMargin,
    std::max(SheetPixel, SizeOf(points) / MostSheetPixels));
  double reach = 0.0;
  for (const Vector3& point : points)
  {
    reach = std::max(reach, std::abs(whole.ToPicture(point)[2]));
  }
  const double thickness = this->Settings.thickness;
  // As far before and behind the trees as beside them, where the image goes so far.
  const int all =
    std::min(MostSlabs, static_cast<int>(std::ceil(2.0 * (reach + SheetMargin) / thickness)));
  std::vector<SlabPlane> planes;
  for (int n = 0; n < all; ++n)
  {
    // From the viewer away, but axial ones from the head down, as they are read.
    const double depth = (0.5 * (all - 1) - n) * thickness * (direction == 0 ? -1.0 : 1.0);
    SlabPlane plane = whole;
    plane.corner += depth * plane.towards;
    if (this->Meets(plane))
    {
      planes.push_back(plane);
    }
  }
  const int count = std::max(1, static_cast<int>(planes.size()));
  const int rows = (count + SheetColumns - 1) / SheetColumns;
  const int columns = std::min(count, SheetColumns);
  const int gap = 4;
  MarkedPicture picture(columns * (whole.width + gap) - gap, rows * (whole.height + gap) - gap);
  Json tiles = Json::array();
  for (int n = 0; n < static_cast<int>(planes.size()); ++n)
  {
    const SlabPlane& plane = planes[static_cast<std::size_t>(n)];
    const GreyPicture slab = ProjectSlab(this->Image, plane, {}, thickness,
      [&](double) { return !progress || progress(double(n) / count); });
    const int x = n % SheetColumns * (plane.width + gap);
    const int y = n / SheetColumns * (plane.height + gap);
    this->DrawCut(picture, slab, x, y);
    this->DrawTree(picture, plane, {}, x, y, true);
    const double along = plane.corner.dot(directions[direction]);
    const Vector3 side = along < 0.0 ? Vector3(-directions[direction]) : directions[direction];
    picture.Write(x + 6, y + 10, SideOf(side) + Text(" %.0f mm", std::abs(along)), 12, White);
    DrawFrame(picture, plane, x, y, n == 0);
    Json tile = PlaneJson(plane);
    tile["left"] = x;
    tile["top"] = y;
    tiles.push_back(tile);
  }
  return { std::move(picture), { { "tiles", tiles } } };
}
}
