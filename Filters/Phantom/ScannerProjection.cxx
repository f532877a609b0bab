#include "ScannerProjection.h"

#include "Numbers.h"
#include "ScannerKernels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr int SubRays = 2;     ///< along both sides of a cell, through tubes and balls
constexpr int Neighbours = 16; ///< detector columns whose rays go side by side
constexpr int Gathered = 4; ///< columns of voxels on a ray between which its rise is taken as none

constexpr double ThinRadius = 0.1; ///< mm, of tubes that could fall between rays
constexpr double ThinStep = 0.1;   ///< mm along them

/// Along a ray, in units of its parameter.
struct Interval
{
  double enter;
  double leave;
};

/// Part of a ray in a tube or ball.
struct Crossing
{
  std::int32_t ray;
  std::int32_t object;
  double enter;
  double leave;

  bool operator<(const Crossing& other) const
  {
    return this->ray != other.ray ? this->ray < other.ray : this->object < other.object;
  }
};

/// Disjoint parts of one ray, in order.
class Covered
{
public:
  void Clear() { this->Parts.clear(); }

  /// Covers a part. @return the length of it that was not covered before
  double Add(double enter, double leave)
  {
    double length = leave - enter;
    auto first = this->Parts.begin();
    while (first != this->Parts.end() && first->leave < enter)
    {
      ++first;
    }
    auto last = first;
    Interval whole{ enter, leave };
    for (; last != this->Parts.end() && last->enter <= leave; ++last)
    {
      length -= std::min(leave, last->leave) - std::max(enter, last->enter);
      whole.enter = std::min(whole.enter, last->enter);
      whole.leave = std::max(whole.leave, last->leave);
    }
    this->Parts.insert(this->Parts.erase(first, last), whole);
    return std::max(0.0, length);
  }

private:
  std::vector<Interval> Parts;
};

/// Part of the ray from + l ray in a ball; empty when it leaves before it enters.
Interval ThroughBall(const Vector3& from, const Vector3& ray, const Vector3& centre, double radius)
{
  const Vector3 o = from - centre;
  const double a = ray.squaredNorm();
  const double b = o.dot(ray);
  // The distance of the ray from the centre, without the cancellation of b^2 - a c.
  const Vector3 nearest = o - (b / a) * ray;
  const double rest = radius * radius - nearest.squaredNorm();
  if (rest <= 0.0)
  {
    return { 0.0, -1.0 };
  }
  const double half = std::sqrt(rest / a);
  return { -b / a - half, -b / a + half };
}

/// The same for a cone between its two flat ends.
Interval ThroughTube(const Vector3& from, const Vector3& ray, const ScannedTube& tube)
{
  const Vector3 axis = tube.end - tube.start;
  const double square = axis.squaredNorm();
  constexpr Interval none{ 0.0, -1.0 };
  if (!(square > 1e-18))
  {
    return none;
  }
  // Near the tube: so the numbers stay small.
  const double towards = (tube.start - from).dot(ray) / ray.squaredNorm();
  const Vector3 o = from + towards * ray - tube.start;
  const double u0 = o.dot(axis) / square;
  const double u1 = ray.dot(axis) / square;
  Interval inside{ -std::numeric_limits<double>::max(), std::numeric_limits<double>::max() };
  if (std::abs(u1) > 1e-12)
  {
    inside = { std::min(-u0 / u1, (1.0 - u0) / u1), std::max(-u0 / u1, (1.0 - u0) / u1) };
  }
  else if (u0 < 0.0 || u0 > 1.0)
  {
    return none;
  }
  const double widening = tube.endRadius - tube.startRadius;
  const double radius = tube.startRadius + widening * u0;
  const double slope = widening * u1;
  const double a = ray.squaredNorm() - square * u1 * u1 - slope * slope;
  const double b = o.dot(ray) - square * u0 * u1 - radius * slope;
  const double c = o.squaredNorm() - square * u0 * u0 - radius * radius;
  const double root = b * b - a * c;
  if (a > 1e-9)
  {
    if (root <= 0.0)
    {
      return none;
    }
    inside.enter = std::max(inside.enter, (-b - std::sqrt(root)) / a);
    inside.leave = std::min(inside.leave, (-b + std::sqrt(root)) / a);
  }
  else
  {
    // Along the axis: inside where it is so in the middle between the ends.
    const double middle = 0.5 * (inside.enter + inside.leave);
    if (a * middle * middle + 2.0 * b * middle + c > 0.0)
    {
      return none;
    }
  }
  return { inside.enter + towards, inside.leave + towards };
}

/**
 * The rays of one detector column, which lie over each other. Columns of voxels that they pass close
 * together are added first and read at the rays' heights once: on such a way a ray hardly rises.
 */
class RayFan
{
public:
  /// @param middle  of the central plane over the lowest slice, mm
  RayFan(const ScannerSettings& settings, double middle, double spacing, int slices)
    : Settings(settings)
    , Kernels(ScannerKernelChoice().Get())
    , Slices(slices)
    , Spacing(spacing)
    , Middle(middle / spacing)
    , Columns(static_cast<std::size_t>(BasisMaterials) * (slices + 1))
    , Totals(static_cast<std::size_t>(BasisMaterials) * settings.rows)
  {
  }

  /// A new detector column.
  void Begin() { std::fill(this->Totals.begin(), this->Totals.end(), 0.0f); }

  /// Next voxels: from one way from the tube (mm in the plane) to another.
  void Place(const double (&ways)[2])
  {
    const double scale =
      0.5 * (ways[0] + ways[1]) / (this->Settings.sourceToDetector * this->Spacing);
    this->First = static_cast<float>(this->Middle + this->Settings.RowHeight(0.0) * scale);
    this->Pitch = static_cast<float>(this->Settings.rowPitch * scale);
    const float top = this->First + static_cast<float>(this->Settings.rows - 1) * this->Pitch;
    this->Low = std::clamp(static_cast<int>(this->First), 0, this->Slices - 1);
    this->High = std::clamp(static_cast<int>(top) + 2, 0, this->Slices - 1);
    std::fill(std::begin(this->Any), std::end(this->Any), false);
  }

  void Gather(
    int material, const float* left, float leftWeight, const float* right, float rightWeight)
  {
    float* column = &this->Columns[static_cast<std::size_t>(material) * (this->Slices + 1)];
    if (!this->Any[material])
    {
      this->Any[material] = true;
      std::fill(column + this->Low, column + this->High + 2, 0.0f);
    }
    this->Kernels.gather(left + this->Low, leftWeight, right + this->Low, rightWeight,
      column + this->Low, this->High - this->Low + 1);
  }

  void Spread()
  {
    for (int m = 0; m < BasisMaterials; ++m)
    {
      if (this->Any[m])
      {
        this->Kernels.addLine(&this->Columns[static_cast<std::size_t>(m) * (this->Slices + 1)],
          this->Slices, this->First, this->Pitch,
          &this->Totals[static_cast<std::size_t>(m) * this->Settings.rows], this->Settings.rows);
      }
    }
  }

  const float* Sums(int material) const
  {
    return &this->Totals[static_cast<std::size_t>(material) * this->Settings.rows];
  }

private:
  const ScannerSettings& Settings;
  const ScannerKernels& Kernels;
  int Slices;
  double Spacing;
  double Middle;      ///< of the central plane, in slices
  float First = 0.0f; ///< slice of the lowest ray
  float Pitch = 0.0f; ///< slices between rays
  int Low = 0;        ///< slices that the rays touch
  int High = 0;
  bool Any[BasisMaterials] = {};
  std::vector<float> Columns;
  std::vector<float> Totals;
};

Vector3 SourceOf(const ScannerSettings& s, const ScannerView& view)
{
  return view.axis +
    Vector3(s.sourceToAxis * std::cos(view.angle), s.sourceToAxis * std::sin(view.angle), 0.0);
}

/// Where the ray through a place meets the detector.
struct DetectorPlace
{
  double way; ///< of the place from the tube in the plane, mm
  double column;
  double row;
};

/// @param to  from the tube to the place, mm
DetectorPlace PlaceOf(const ScannerSettings& s, const ScannerView& view, const Vector3& to)
{
  const double way = std::max(1.0, std::hypot(to[0], to[1]));
  const double off = std::remainder(std::atan2(to[1], to[0]) - view.angle - Pi, 2.0 * Pi);
  return { way, off / s.ColumnPitch() + s.MiddleColumn(),
    to[2] * (s.sourceToDetector / (s.rowPitch * way)) + 0.5 * (s.rows - 1) };
}

/// Range of sub-rays around the shadow of a ball.
struct Shadow
{
  int columns[2]; ///< inclusive
  int rows[2];
};
}

void MaterialVolume::SetGrid(const ImageGrid& where)
{
  this->grid = where;
  const std::array<int, 6>& e = where.extent;
  const std::size_t columns = static_cast<std::size_t>(e[1] - e[0] + 1) * (e[3] - e[2] + 1);
  for (int m = 0; m < BasisMaterials; ++m)
  {
    this->maps[m].resize(columns * (e[5] - e[4] + 1));
    this->present[m].resize(columns);
  }
}

void MaterialVolume::FindColumns()
{
  const std::size_t slices = this->grid.extent[5] - this->grid.extent[4] + 1;
  for (int m = 0; m < BasisMaterials; ++m)
  {
    for (std::size_t c = 0; c < this->present[m].size(); ++c)
    {
      const float* first = &this->maps[m][c * slices];
      this->present[m][c] =
        std::any_of(first, first + slices, [](float amount) { return std::abs(amount) > 1e-6f; });
    }
  }
}

void ScannerProjector::Clear(ViewPaths& paths) const
{
  for (std::vector<float>& path : paths)
  {
    path.assign(static_cast<std::size_t>(this->Settings.channels) * this->Settings.rows, 0.0f);
  }
}

void ScannerProjector::Add(
  const MaterialVolume& volume, const ScannerView& view, ViewPaths& paths) const
{
  const ScannerSettings& s = this->Settings;
  const ImageGrid& grid = volume.grid;
  const std::array<int, 6>& e = grid.extent;
  const int size[3] = { e[1] - e[0] + 1, e[3] - e[2] + 1, e[5] - e[4] + 1 };
  const Vector3 corner = grid.IndexToWorld(e[0], e[2], e[4]);
  const int rows = s.rows;
  const double source[2] = { view.axis[0] + s.sourceToAxis * std::cos(view.angle),
    view.axis[1] + s.sourceToAxis * std::sin(view.angle) };
  std::vector<std::array<double, 2>> directions(s.channels);
  for (int c = 0; c < s.channels; ++c)
  {
    const double angle = view.angle + Pi + s.ColumnAngle(c);
    directions[c] = { std::cos(angle), std::sin(angle) };
  }
  const auto mainAxis = [](const std::array<double, 2>& direction)
  { return std::abs(direction[0]) >= std::abs(direction[1]) ? 0 : 1; };
  // Neighbouring fans go side by side: they read the same voxels.
  std::vector<RayFan> fans(
    Neighbours, RayFan(s, view.axis[2] - corner[2], grid.spacing[2], size[2]));
  for (int begin = 0; begin < s.channels;)
  {
    const int along = mainAxis(directions[begin]);
    const int across = 1 - along;
    int end = begin;
    for (; end < s.channels && end < begin + Neighbours && mainAxis(directions[end]) == along;
         ++end)
    {
      fans[end - begin].Begin();
    }
    const std::size_t step = along == 0 ? size[1] : 1; // in columns of voxels
    const std::size_t sideStep = along == 0 ? 1 : size[1];
    for (int first = 0; first < size[along]; first += Gathered)
    {
      const int last = std::min(size[along], first + Gathered) - 1;
      for (int c = begin; c < end; ++c)
      {
        RayFan& fan = fans[c - begin];
        const std::array<double, 2>& direction = directions[c];
        const auto wayTo = [&](double n)
        { return (corner[along] + n * grid.spacing[along] - source[along]) / direction[along]; };
        const auto sideAt = [&](double n) {
          return (source[across] + wayTo(n) * direction[across] - corner[across]) /
            grid.spacing[across];
        };
        const double ways[2] = { wayTo(first), wayTo(last) };
        const double sides[2] = { sideAt(first), sideAt(last) };
        if (std::min(ways[0], ways[1]) <= 0.0 || std::max(sides[0], sides[1]) <= -1.0 ||
          std::min(sides[0], sides[1]) >= size[across])
        {
          continue;
        }
        fan.Place(ways);
        for (int n = first; n <= last; ++n)
        {
          const double side = sideAt(n);
          if (side <= -1.0 || side >= size[across])
          {
            continue;
          }
          const double whole = std::floor(side);
          const int j = static_cast<int>(whole);
          // Outside of the volume there is air.
          const float weights[2] = { j < 0 ? 0.0f : static_cast<float>(1.0 - (side - whole)),
            j + 1 < size[across] ? static_cast<float>(side - whole) : 0.0f };
          const std::size_t at[2] = { n * step + std::max(0, j) * sideStep,
            n * step + std::min(size[across] - 1, j + 1) * sideStep };
          for (int m = 0; m < BasisMaterials; ++m)
          {
            if (volume.present[m][at[0]] || volume.present[m][at[1]])
            {
              fan.Gather(m, &volume.maps[m][at[0] * size[2]], weights[0],
                &volume.maps[m][at[1] * size[2]], weights[1]);
            }
          }
        }
        fan.Spread();
      }
    }
    for (int c = begin; c < end; ++c)
    {
      const double length = grid.spacing[along] / std::abs(directions[c][along]);
      for (int m = 0; m < BasisMaterials; ++m)
      {
        float* out = &paths[m][static_cast<std::size_t>(c) * rows];
        const float* sum = fans[c - begin].Sums(m);
        for (int r = 0; r < rows; ++r)
        {
          const double rise = s.RowHeight(r) / s.sourceToDetector;
          out[r] += sum[r] * static_cast<float>(length * std::sqrt(1.0 + rise * rise));
        }
      }
    }
    begin = end;
  }
}

/// A volume's share of a cell is that volume over the section of the cell's beam.
void ScannerProjector::AddThin(
  const ScannedTube& tube, const ScannerView& view, ViewPaths& paths) const
{
  const ScannerSettings& s = this->Settings;
  const Vector3 source = SourceOf(s, view);
  const double length = (tube.end - tube.start).norm();
  const int steps = std::max(1, static_cast<int>(std::ceil(length / ThinStep)));
  for (int n = 0; n < steps; ++n)
  {
    const double u = (n + 0.5) / steps;
    const double radius = (1.0 - u) * tube.startRadius + u * tube.endRadius;
    const Vector3 to = (1.0 - u) * tube.start + u * tube.end - source;
    const DetectorPlace place = PlaceOf(s, view, to);
    const long column = std::lround(place.column);
    const long row = std::lround(place.row);
    if (column < 0 || column >= s.channels || row < 0 || row >= s.rows)
    {
      continue;
    }
    // The beam's section across the plane's ray; the ray itself is longer by as much as it rises.
    const double scale = s.sourceToDetector / place.way;
    const double section = s.channelPitch * s.rowPitch / (scale * scale) * place.way / to.norm();
    const auto path = static_cast<float>(Pi * radius * radius * length / steps / section);
    const std::size_t cell = static_cast<std::size_t>(column) * s.rows + row;
    for (int m = 0; m < BasisMaterials; ++m)
    {
      paths[m][cell] += path * tube.difference[m];
    }
  }
}

void ScannerProjector::Add(const std::vector<ScannedTube>& tubes,
  const std::vector<ScannedBall>& balls, const ScannerView& view, ViewPaths& paths) const
{
  const ScannerSettings& s = this->Settings;
  const Vector3 source = SourceOf(s, view);
  const int columns = SubRays * s.channels;
  const int rows = SubRays * s.rows;
  // Sub-ray n of a line of cells is at cell n / SubRays, off its middle.
  const auto cellOf = [](double sub) { return (sub + 0.5) / SubRays - 0.5; };
  const auto subOf = [](double cell) { return (cell + 0.5) * SubRays - 0.5; };
  const auto shadowOf = [&](const Vector3& centre, double radius, Shadow& shadow)
  {
    const Vector3 to = centre - source;
    const DetectorPlace place = PlaceOf(s, view, to);
    const double way = place.way;
    const double column = subOf(place.column);
    const double width = SubRays * std::asin(std::min(1.0, radius / way)) / s.ColumnPitch() + 1.0;
    const double scale = s.sourceToDetector / (s.rowPitch * way);
    const double row = subOf(place.row);
    // What is nearer has a wider shadow, and lies higher.
    const double near = way / std::max(1.0, way - radius);
    const double height =
      SubRays * (radius * scale * near + std::abs(to[2]) * scale * (near - 1.0)) + 1.0;
    const auto inside = [](double at, int count)
    { return static_cast<int>(std::clamp(at, -1.0, static_cast<double>(count))); };
    const int range[4] = { inside(std::floor(column - width), columns),
      inside(std::ceil(column + width), columns), inside(std::floor(row - height), rows),
      inside(std::ceil(row + height), rows) };
    shadow.columns[0] = std::min(shadow.columns[0], range[0]);
    shadow.columns[1] = std::max(shadow.columns[1], range[1]);
    shadow.rows[0] = std::min(shadow.rows[0], range[2]);
    shadow.rows[1] = std::max(shadow.rows[1], range[3]);
  };
  thread_local std::vector<Crossing> crossings;
  crossings.clear();
  const auto rayOf = [&](int column, int row)
  {
    const double angle = view.angle + Pi + s.ColumnAngle(cellOf(column));
    return Vector3(std::cos(angle), std::sin(angle), s.RowHeight(cellOf(row)) / s.sourceToDetector);
  };
  const auto cross = [&](const Shadow& shadow, std::size_t object, const auto& intersect)
  {
    for (int c = std::max(0, shadow.columns[0]); c <= std::min(columns - 1, shadow.columns[1]); ++c)
    {
      Vector3 ray = rayOf(c, 0);
      for (int r = std::max(0, shadow.rows[0]); r <= std::min(rows - 1, shadow.rows[1]); ++r)
      {
        ray[2] = s.RowHeight(cellOf(r)) / s.sourceToDetector;
        const Interval inside = intersect(ray);
        if (inside.leave > inside.enter)
        {
          crossings.push_back(
            { c * rows + r, static_cast<std::int32_t>(object), inside.enter, inside.leave });
        }
      }
    }
  };
  const Shadow nothing{ { columns, -1 }, { rows, -1 } };
  for (std::size_t t = 0; t < tubes.size(); ++t)
  {
    const ScannedTube& tube = tubes[t];
    if (std::max(tube.startRadius, tube.endRadius) < ThinRadius)
    {
      this->AddThin(tube, view, paths);
      continue;
    }
    Shadow shadow = nothing;
    shadowOf(tube.start, tube.startRadius, shadow);
    if (tube.round)
    {
      cross(shadow, t,
        [&](const Vector3& ray) { return ThroughBall(source, ray, tube.start, tube.startRadius); });
    }
    shadowOf(tube.end, tube.endRadius, shadow);
    cross(shadow, t, [&](const Vector3& ray) { return ThroughTube(source, ray, tube); });
  }
  for (std::size_t b = 0; b < balls.size(); ++b)
  {
    Shadow shadow = nothing;
    shadowOf(balls[b].centre, balls[b].radius, shadow);
    cross(shadow, tubes.size() + b,
      [&](const Vector3& ray)
      { return ThroughBall(source, ray, balls[b].centre, balls[b].radius); });
  }
  std::sort(crossings.begin(), crossings.end());
  Covered covered;
  std::int32_t last = -1;
  double length = 0.0;
  for (const Crossing& crossing : crossings)
  {
    if (crossing.ray != last)
    {
      covered.Clear();
      last = crossing.ray;
      length = rayOf(last / rows, last % rows).norm() / (SubRays * SubRays);
    }
    const auto inside = static_cast<float>(length * covered.Add(crossing.enter, crossing.leave));
    const auto object = static_cast<std::size_t>(crossing.object);
    const MaterialAmounts& difference =
      object < tubes.size() ? tubes[object].difference : balls[object - tubes.size()].difference;
    const std::size_t cell = static_cast<std::size_t>(last / rows / SubRays) * s.rows +
      static_cast<std::size_t>(last % rows / SubRays);
    for (int m = 0; m < BasisMaterials; ++m)
    {
      paths[m][cell] += inside * difference[m];
    }
  }
}
}
