#include "MeshAnatomy.h"

#include "Numbers.h"
#include "Require.h"
#include "SurfaceCheck.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr int TrunkSides = 256;
constexpr double TrunkHeight = 1e4; ///< mm to both sides: out of every image
/// What the usual trunk is at least, mm, and how far parts are from its skin.
constexpr double TrunkWidth = 300.0;
constexpr double TrunkDepth = 220.0;
constexpr double TrunkMargin = 20.0;
/// Of the heart's box, mm: shifts, what a spline overshoots, and the rim in which it fades into the chest.
constexpr double HeartMargin = 20.0;

/// A flat convex polygon, as cutting a triangle by the six sides of a box leaves it.
struct Polygon
{
  int count = 0;
  std::array<Vector3, 12> corners;

  double Least(int axis) const { return this->Extreme(axis, -1.0); }
  double Greatest(int axis) const { return this->Extreme(axis, 1.0); }

  /// The part on one side of a plane across an axis. @param side  1: above, -1: below
  Polygon Cut(int axis, double place, double side) const
  {
    Polygon rest;
    for (int n = 0; n < this->count; ++n)
    {
      const Vector3& a = this->corners[n];
      const Vector3& b = this->corners[n + 1 < this->count ? n + 1 : 0];
      const double da = side * (a[axis] - place);
      const double db = side * (b[axis] - place);
      if (da >= 0.0)
      {
        rest.corners[rest.count++] = a;
      }
      if ((da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0))
      {
        Vector3 between = a + (da / (da - db)) * (b - a);
        between[axis] = place;
        rest.corners[rest.count++] = between;
      }
    }
    return rest;
  }

  Polygon Between(int axis, int cell) const
  {
    return this->Cut(axis, cell, 1.0).Cut(axis, cell + 1, -1.0);
  }

  /// Of the shadow along z: positive where the upper side is outside; `height`: times the mean z.
  void Integrate(double& area, double& height) const
  {
    area = 0.0;
    height = 0.0;
    for (int n = 2; n < this->count; ++n)
    {
      const Vector3& a = this->corners[0];
      const Vector3& b = this->corners[n - 1];
      const Vector3& c = this->corners[n];
      const double one = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
      area += one;
      height += one * (a[2] + b[2] + c[2]) / 3.0;
    }
  }

private:
  double Extreme(int axis, double sign) const
  {
    double extreme = this->corners[0][axis];
    for (int n = 1; n < this->count; ++n)
    {
      extreme = sign * std::max(sign * extreme, sign * this->corners[n][axis]);
    }
    return extreme;
  }
};

Polygon TriangleAt(const std::vector<Vector3>& points, const Triangle& triangle)
{
  Polygon polygon;
  polygon.count = 3;
  for (int n = 0; n < 3; ++n)
  {
    polygon.corners[n] = points[triangle[n]];
  }
  return polygon;
}

/// Shares of the boxes of one sheet of voxels, [j][k], that are below a surface's upper sides and not
/// below its lower ones: within it.
class SheetCoverage
{
public:
  SheetCoverage(int rows, int slices)
    : Rows(rows)
    , Slices(slices)
    , Own(static_cast<std::size_t>(rows) * slices)
    , Whole(static_cast<std::size_t>(rows) * (slices + 1))
    , Touched(rows)
  {
  }

  /// What is below a polygon within the sheet; voxels are boxes of side 1 from 0 on.
  void Add(const Polygon& sheet)
  {
    if (sheet.count < 3)
    {
      return;
    }
    const auto cell = [](double place, int count)
    { return static_cast<int>(std::floor(std::clamp(place, -1.0, count + 1.0))); };
    const int first = std::max(0, cell(sheet.Least(1), this->Rows));
    const int last = std::min(this->Rows - 1, cell(sheet.Greatest(1), this->Rows));
    for (int j = first; j <= last; ++j)
    {
      const Polygon column = sheet.Between(1, j);
      if (column.count < 3)
      {
        continue;
      }
      this->Touched[j] = 1;
      const double top = column.Greatest(2);
      const int low = std::max(0, cell(column.Least(2), this->Slices));
      const int high = std::min(this->Slices - 1, cell(top, this->Slices));
      for (int k = low; k <= high; ++k)
      {
        this->AddSlice(j, k, column.Between(2, k));
      }
      if (top > this->Slices)
      {
        double area = 0.0;
        double height = 0.0;
        column.Cut(2, this->Slices, 1.0).Integrate(area, height);
        this->Whole[this->At(j) + this->Slices] += area;
      }
    }
  }

  /// Gives the shares of each column that was touched, and is empty again.
  template <typename Taker>
  void Take(const Taker& take)
  {
    std::vector<float> shares(this->Slices);
    for (int j = 0; j < this->Rows; ++j)
    {
      if (!this->Touched[j])
      {
        continue;
      }
      double above = this->Whole[this->At(j) + this->Slices];
      for (int k = this->Slices - 1; k >= 0; --k)
      {
        double& own = this->Own[static_cast<std::size_t>(j) * this->Slices + k];
        shares[k] = static_cast<float>(std::clamp(above + own, 0.0, 1.0));
        above += this->Whole[this->At(j) + k];
        own = 0.0;
      }
      std::fill_n(
        this->Whole.begin() + static_cast<std::ptrdiff_t>(this->At(j)), this->Slices + 1, 0.0);
      this->Touched[j] = 0;
      take(j, shares);
    }
  }

private:
  std::size_t At(int j) const { return static_cast<std::size_t>(j) * (this->Slices + 1); }

  void AddSlice(int j, int k, const Polygon& piece)
  {
    double area = 0.0;
    double height = 0.0;
    piece.Integrate(area, height);
    this->Own[static_cast<std::size_t>(j) * this->Slices + k] += height - k * area;
    this->Whole[this->At(j) + k] += area;
  }

  int Rows;
  int Slices;
  std::vector<double> Own;   ///< below pieces that are in the voxel itself
  std::vector<double> Whole; ///< areas of pieces in a voxel: all voxels below are that full
  std::vector<char> Touched;
};

void Grow(CoronaryPhantom::Box& box, const std::vector<Vector3>& points)
{
  for (const Vector3& point : points)
  {
    box.low = box.low.cwiseMin(point);
    box.high = box.high.cwiseMax(point);
  }
}

CoronaryPhantom::Box EmptyBox()
{
  constexpr double far = std::numeric_limits<double>::max();
  return { Vector3::Constant(far), Vector3::Constant(-far) };
}

double EnclosedVolume(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  const Vector3& origin = points[triangles.front()[0]];
  double volume = 0.0;
  for (const Triangle& t : triangles)
  {
    volume +=
      (points[t[0]] - origin).dot((points[t[1]] - origin).cross(points[t[2]] - origin)) / 6.0;
  }
  return volume;
}

AnatomyTrunk UsualTrunk(const CoronaryPhantom::Box& parts)
{
  AnatomyTrunk trunk;
  trunk.material = TissueMaterials().Soft(0.0);
  const Vector3 middle = 0.5 * (parts.low + parts.high);
  trunk.centre = { middle[0], middle[1] };
  // An ellipse around a rectangle is longer by the square root of two.
  const auto around = [&](int axis)
  { return std::sqrt(2.0) * (parts.high[axis] - parts.low[axis]) + 2.0 * TrunkMargin; };
  trunk.width = std::max(TrunkWidth, around(0));
  trunk.depth = std::max(TrunkDepth, around(1));
  return trunk;
}

AnatomyPart CylinderOf(const AnatomyTrunk& trunk)
{
  AnatomyPart part;
  part.name = "trunk";
  part.material = trunk.material;
  part.still = true;
  part.phases = { 0.0 };
  std::vector<Vector3>& points = part.positions.emplace_back();
  for (const double z : { -TrunkHeight, TrunkHeight })
  {
    points.emplace_back(trunk.centre[0], trunk.centre[1], z);
    for (int n = 0; n < TrunkSides; ++n)
    {
      const double angle = 2.0 * Pi * n / TrunkSides;
      points.emplace_back(trunk.centre[0] + 0.5 * trunk.width * std::cos(angle),
        trunk.centre[1] + 0.5 * trunk.depth * std::sin(angle), z);
    }
  }
  constexpr std::int64_t upper = TrunkSides + 1;
  for (int n = 0; n < TrunkSides; ++n)
  {
    const std::int64_t a = 1 + n;
    const std::int64_t b = 1 + (n + 1) % TrunkSides;
    part.triangles.push_back({ 0, b, a });
    part.triangles.push_back({ upper, upper + a, upper + b });
    part.triangles.push_back({ a, b, upper + b });
    part.triangles.push_back({ a, upper + b, upper + a });
  }
  return part;
}

/// Makes the triangles look outwards and neighbours have common points.
/// @throws std::invalid_argument naming the part
void CheckPart(AnatomyPart& part)
{
  const std::string name = "part '" + part.name + "': ";
  Require(!part.positions.empty() && part.positions.size() == part.phases.size(),
    name + "as many phases as surfaces are needed, and one at least");
  for (const std::vector<Vector3>& points : part.positions)
  {
    Require(points.size() == part.positions.front().size(),
      name + "its surfaces have different numbers of points");
  }
  try
  {
    const ClosedSurface closed = CheckSurface(part.positions.front(), part.triangles);
    part.triangles = closed.triangles;
    for (Triangle& triangle : part.triangles)
    {
      for (std::int64_t& corner : triangle)
      {
        corner = closed.sourcePoint[corner];
      }
    }
  }
  catch (const std::invalid_argument& error)
  {
    throw std::invalid_argument(name + error.what());
  }
  for (std::size_t p = 1; p < part.positions.size(); ++p)
  {
    Require(EnclosedVolume(part.positions[p], part.triangles) > 0.0,
      name + "surface " + std::to_string(p + 1) + " of " + std::to_string(part.positions.size()) +
        " is inside out");
  }
}

constexpr double HydroxyapatiteDensity = 3160.0; ///< mg/cm^3

struct KnownMaterial
{
  const char* name;
  double usual;       ///< HU
  const char* amount; ///< unit besides HU; empty: none
};

constexpr KnownMaterial KnownMaterials[] = { { "water", 0.0, "" }, { "fat", -95.0, "" },
  { "soft", 55.0, "" }, { "muscle", 110.0, "mg/mL" }, { "lung", -820.0, "" },
  { "bone", 700.0, "mg/cm3" }, { "blood", 420.0, "mg/mL" }, { "calcium", 850.0, "mg/cm3" },
  { "metal", 0.0, "" } };

/// @throws std::invalid_argument
const KnownMaterial& FindMaterial(const std::string& name)
{
  std::string names;
  for (const KnownMaterial& one : KnownMaterials)
  {
    if (name == one.name)
    {
      return one;
    }
    names += (names.empty() ? "" : ", ") + std::string(one.name);
  }
  throw std::invalid_argument("material '" + name + "' is none of " + names);
}
}

MaterialAmounts MaterialOf(const TissueMaterials& tissue, const std::string& name,
  const std::optional<double>& value, const std::string& unit)
{
  const KnownMaterial& known = FindMaterial(name);
  if (name == "metal")
  {
    Require(!value, "metal has no value: it is steel");
    return tissue.Metal();
  }
  const std::string amount = known.amount;
  const bool hounsfield = unit == "HU";
  Require(hounsfield || (unit == amount && !amount.empty()),
    "unit '" + unit + "': " + name + " has HU" + (amount.empty() ? "" : " or " + amount));
  Require(hounsfield || value, "a unit needs a value");
  const double given = value.value_or(known.usual);
  Require(hounsfield ? given > -1000.0 && given <= 20000.0
                     : given >= 0.0 && given <= HydroxyapatiteDensity,
    "value " + std::to_string(given) + " " + unit +
      (hounsfield ? ": above -1000 and up to 20000 HU" : ": 0 to 3160 " + unit));
  if (!hounsfield)
  {
    // Without iodine or mineral, and then with what was asked for.
    MaterialAmounts amounts = name == "blood" ? tissue.Blood(known.usual)
      : name == "muscle"                      ? tissue.Muscle(55.0)
                                              : tissue.Soft(55.0);
    if (unit == "mg/mL")
    {
      amounts[1] = static_cast<float>(given);
      return amounts;
    }
    amounts *= static_cast<float>(1.0 - given / HydroxyapatiteDensity);
    amounts[2] += static_cast<float>(given);
    return amounts;
  }
  if (name == "water")
  {
    MaterialAmounts water = MaterialAmounts::Zero();
    water[0] = static_cast<float>(1.0 + 1e-3 * given);
    return water;
  }
  return name == "fat" ? tissue.Fat(given)
    : name == "lung"   ? tissue.Lung(given)
    : name == "soft"   ? tissue.Soft(given)
    : name == "muscle" ? tissue.Muscle(given)
    : name == "blood"  ? tissue.Blood(given)
                       : tissue.Calcified(given);
}

MeshAnatomy::MeshAnatomy(
  std::vector<AnatomyPart> parts, double cycleLength, const std::optional<AnatomyTrunk>& trunk)
  : Cycle(cycleLength)
{
  Require(!parts.empty(), "the anatomy has no part");
  Require(cycleLength > 0.0, "the cycle has no length");
  CoronaryPhantom::Box all = EmptyBox();
  CoronaryPhantom::Box moving = EmptyBox();
  const auto take = [&](AnatomyPart& part)
  {
    CheckPart(part);
    try
    {
      this->Parts.push_back({ part.name, part.material, part.still, std::move(part.triangles),
        PeriodicPositions(part.phases, part.positions) });
    }
    catch (const std::invalid_argument& error)
    {
      throw std::invalid_argument("part '" + part.name + "': " + error.what());
    }
  };
  for (AnatomyPart& part : parts)
  {
    take(part);
    for (const std::vector<Vector3>& points : part.positions)
    {
      Grow(all, points);
      if (!part.still)
      {
        Grow(moving, points);
      }
    }
  }
  this->HeartBox = moving.low[0] <= moving.high[0] ? moving : all;
  this->Around = trunk.value_or(UsualTrunk(all));
  Require(this->Around.width > 0.0 && this->Around.depth > 0.0,
    "trunk: width and depth are not positive");
  AnatomyPart cylinder = CylinderOf(this->Around);
  take(cylinder);
  const Vector3 half(0.5 * this->Around.width, 0.5 * this->Around.depth, 0.0);
  const Vector3 middle(this->Around.centre[0], this->Around.centre[1], all.low[2]);
  Grow(all, { middle - half, middle + half });
  this->Box = all;
}

CoronaryPhantom::Box MeshAnatomy::Moving() const
{
  const Vector3 margin = Vector3::Constant(HeartMargin);
  return { this->HeartBox.low - margin, this->HeartBox.high + margin };
}

std::vector<Vector3> MeshAnatomy::Surface(std::size_t part, double phase) const
{
  std::vector<Vector3> points;
  this->Parts[part].positions.Evaluate(phase, points);
  return points;
}

void MeshAnatomy::Render(const PatientState& state, const ImageGrid& grid, MaterialVolume& volume,
  const ProgressCallback& progress) const
{
  volume.SetGrid(grid);
  const std::array<int, 6>& e = grid.extent;
  const int size[3] = { e[1] - e[0] + 1, e[3] - e[2] + 1, e[5] - e[4] + 1 };
  const Vector3 corner =
    grid.IndexToWorld(e[0], e[2], e[4]) - 0.5 * grid.spacing; // of the first voxel's box
  for (std::vector<float>& map : volume.maps)
  {
    std::fill(map.begin(), map.end(), 0.0f);
  }
  std::vector<std::vector<Vector3>> points(this->Parts.size());
  /// Triangles that touch a sheet, i, of a part: [part][i].
  std::vector<std::vector<std::vector<std::int32_t>>> touching(this->Parts.size());
  for (std::size_t p = 0; p < this->Parts.size(); ++p)
  {
    const Part& part = this->Parts[p];
    part.positions.Evaluate(state.phase, points[p]);
    const Vector3 origin = part.still ? corner : Vector3(corner - state.shift);
    for (Vector3& point : points[p])
    {
      point = (point - origin).cwiseQuotient(grid.spacing);
    }
    touching[p].resize(size[0]);
    for (std::size_t t = 0; t < part.triangles.size(); ++t)
    {
      const Polygon triangle = TriangleAt(points[p], part.triangles[t]);
      const auto cell = [&](double place)
      { return static_cast<int>(std::floor(std::clamp(place, -1.0, size[0] + 1.0))); };
      const int last = std::min(size[0] - 1, cell(triangle.Greatest(0)));
      // What is below all voxels hides none of them.
      for (int i = std::max(0, cell(triangle.Least(0))); i <= last && triangle.Greatest(2) > 0.0;
           ++i)
      {
        touching[p][i].push_back(static_cast<std::int32_t>(t));
      }
    }
  }
  ParallelFor(
    size[0], 1,
    [&](std::int64_t first, std::int64_t end)
    {
      SheetCoverage coverage(size[1], size[2]);
      for (std::int64_t i = first; i < end; ++i)
      {
        // The trunk is the last one, and what all others lie in.
        for (std::size_t n = 0; n < this->Parts.size(); ++n)
        {
          const std::size_t p = n == 0 ? this->Parts.size() - 1 : n - 1;
          const Part& part = this->Parts[p];
          for (const std::int32_t t : touching[p][i])
          {
            coverage.Add(TriangleAt(points[p], part.triangles[t]).Between(0, static_cast<int>(i)));
          }
          MaterialAmounts amounts = part.material;
          amounts[1] *= static_cast<float>(state.iodine);
          coverage.Take(
            [&](int j, const std::vector<float>& shares)
            {
              const std::size_t column = (static_cast<std::size_t>(i) * size[1] + j) * size[2];
              for (int m = 0; m < BasisMaterials; ++m)
              {
                float* map = &volume.maps[m][column];
                for (int k = 0; k < size[2]; ++k)
                {
                  map[k] += shares[k] * (amounts[m] - map[k]);
                }
              }
            });
        }
      }
    },
    progress);
}
}
