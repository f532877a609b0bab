#include "OstiaCases.h"

#include "CounterRandom.h"
#include "PhantomAnatomy.h"

#include <cmath>
#include <functional>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double Pi = 3.14159265358979323846;
constexpr double Fat = -90.0; // HU
constexpr double Wall = 60.0; // HU

double Degrees(double angle)
{
  return angle * Pi / 180.0;
}

/// How an image is taken of a phantom.
struct Recipe
{
  PhantomSettings settings;
  double moment = 0.75;
  double spacing = 0.7;                 ///< mm
  Matrix3 body = Matrix3::Identity();   ///< how the body lies, against what the image says
  Matrix3 voxels = Matrix3::Identity(); ///< directions of the image in the body's world
  double scale = 1.0;                   ///< factor on all lengths
  Vector3 low{ -55.0, -55.0, -55.0 };   ///< of the field of view about the ostia's middle, mm
  Vector3 high{ 60.0, 45.0, 55.0 };     ///< mm; left, back, up
  bool mirrored = false;
};

/// Things drawn over a rendered image, in the phantom's coordinates.
class Painter
{
public:
  Painter(OstiaCase& image, const ImageGrid& grid, double noise, std::uint64_t seed)
    : Image(image)
    , Grid(grid)
    , Noise(noise)
    , Seed(seed)
  {
  }

  /// @param depth  of a place inside of the thing, mm, negative outside
  void Paint(double value, const std::function<double(const Vector3&)>& depth)
  {
    constexpr double blur = 0.4; // mm
    const std::array<int, 6>& e = this->Grid.extent;
    const int nx = e[1] - e[0] + 1;
    const int ny = e[3] - e[2] + 1;
    ParallelFor(e[5] - e[4] + 1, 1,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t k = first; k < last; ++k)
        {
          for (int j = 0; j < ny; ++j)
          {
            for (int i = 0; i < nx; ++i)
            {
              const double d =
                depth(this->Grid.IndexToWorld(e[0] + i, e[2] + j, e[4] + static_cast<double>(k)));
              if (d < -3.0 * blur)
              {
                continue;
              }
              const std::size_t p = (static_cast<std::size_t>(k) * ny + j) * nx + i;
              const double share = 0.5 * std::erfc(-d / blur / std::sqrt(2.0));
              RandomStream random(this->Seed, p);
              const double old = this->Image.values[p];
              this->Image.values[p] = static_cast<std::int16_t>(
                std::lround((1.0 - share) * old + share * (value + this->Noise * random.Normal())));
            }
          }
        }
      });
  }

  void Tube(const std::vector<Vector3>& line, double radius, double value)
  {
    this->Paint(value, [&](const Vector3& p) { return radius - DistanceTo(line, p); });
  }

  static double DistanceTo(const std::vector<Vector3>& line, const Vector3& p)
  {
    double minimum = 1e9;
    for (std::size_t n = 1; n < line.size(); ++n)
    {
      minimum = std::min(minimum, NearestOnSegment(p, line[n - 1], line[n]).squaredDistance);
    }
    return std::sqrt(minimum);
  }

private:
  OstiaCase& Image;
  ImageGrid Grid;
  double Noise;
  std::uint64_t Seed;
};

/// A smooth course from a place with a direction to another one.
std::vector<Vector3> CurveThrough(
  const Vector3& from, const Vector3& start, const Vector3& to, const Vector3& end)
{
  std::vector<Vector3> line;
  const double reach = (to - from).norm();
  constexpr int steps = 24;
  for (int n = 0; n <= steps; ++n)
  {
    const double t = static_cast<double>(n) / steps;
    line.emplace_back((1 + 2 * t) * (1 - t) * (1 - t) * from +
      t * (1 - t) * (1 - t) * reach * start.normalized() + t * t * (3 - 2 * t) * to +
      t * t * (t - 1) * reach * end.normalized());
  }
  return line;
}

/// The phantom, its root, and the image of it that is worked on.
struct Work
{
  Recipe recipe;
  std::unique_ptr<CoronaryPhantom> phantom;
  std::unique_ptr<PhantomAnatomy> anatomy;
  PhantomTree tree;
  ImageGrid grid; ///< in the phantom's world
  OstiaCase result;
  double bloodValue = 0.0;
};

/// Points of a tree's first vessel, up to `length` mm from its ostium.
std::vector<Vector3> Beginning(const PhantomTree& tree, int treeId, double from, double to)
{
  std::vector<Vector3> line;
  int group = -1;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    if (branch.treeId == treeId && branch.parentGroupId == group)
    {
      for (const std::int64_t p : branch.points)
      {
        const double s = tree.abscissa[static_cast<std::size_t>(p)];
        if (s >= from && s <= to)
        {
          line.push_back(tree.points[static_cast<std::size_t>(p)]);
        }
      }
      group = branch.groupId;
      if (tree.abscissa[static_cast<std::size_t>(branch.points.back())] > to)
      {
        break;
      }
    }
  }
  return line;
}

/// mm outside of the arteries' wall, as if they were made of balls; 20 mm and more are as good as any
double OutsideVessels(const Work& work, const Vector3& p)
{
  double minimum = 20.0;
  for (std::size_t n = 0; n < work.tree.points.size(); n += 2)
  {
    const double square = (work.tree.points[n] - p).squaredNorm();
    if (square < 625.0)
    {
      minimum = std::min(minimum, std::sqrt(square) - work.tree.radius[n]);
    }
  }
  return minimum;
}

/// mm outside of the wall of the root and the ascending aorta
double OutsideRoot(const AorticRoot& root, const Vector3& p)
{
  const double height =
    std::clamp((p - root.centre).dot(root.axis), -AorticRoot::Below, AorticRoot::Above);
  const Vector3 off = p - root.centre - height * root.axis;
  const double up = std::clamp((height - 8.0) / 30.0, 0.0, 1.0);
  return off.norm() - root.radius * (1.0 - 0.15 * up);
}

void Start(Work& work, double coarsest)
{
  Recipe& r = work.recipe;
  work.phantom = std::make_unique<CoronaryPhantom>(r.settings);
  work.anatomy = std::make_unique<PhantomAnatomy>(work.phantom->Settings());
  work.tree = work.phantom->Tree(r.moment);
  work.bloodValue = r.settings.lumenHU + 10.0;
  const std::vector<PhantomOstium> ostia = work.phantom->Ostia(r.moment);
  const Vector3 centre = 0.5 * (ostia[0].position + ostia[1].position);
  const double spacing = std::max(coarsest, r.spacing) / r.scale;
  // In the body's world, which is `body` times the image's.
  ImageGrid label;
  label.spacing = Vector3::Constant(spacing);
  label.direction = r.voxels;
  Vector3 low = Vector3::Constant(1e9);
  Vector3 high = -low;
  for (int corner = 0; corner < 8; ++corner)
  {
    const Vector3 p(corner & 1 ? r.high[0] : r.low[0], corner & 2 ? r.high[1] : r.low[1],
      corner & 4 ? r.high[2] : r.low[2]);
    const Vector3 along = r.voxels.transpose() * p;
    low = low.cwiseMin(along);
    high = high.cwiseMax(along);
  }
  if (!r.voxels.isIdentity(1e-9))
  {
    // No larger than it has to be.
    low *= 0.85;
    high *= 0.85;
  }
  for (int axis = 0; axis < 3; ++axis)
  {
    label.extent[2 * axis] = 0;
    label.extent[2 * axis + 1] = static_cast<int>((high[axis] - low[axis]) / spacing);
  }
  label.origin = centre + label.direction * low;
  work.grid = label;
  work.grid.direction = r.body * label.direction;
  work.grid.origin = centre + r.body * (label.origin - centre);
  const std::array<int, 6>& e = label.extent;
  work.result.values.resize(
    static_cast<std::size_t>(e[1] + 1) * (e[3] + 1) * (static_cast<std::size_t>(e[5]) + 1));
  work.phantom->Render(work.grid, e, r.moment, work.result.values.data());
  work.result.truth = ostia;
  work.result.grid = label;
}

/// From the phantom's world to that of the image.
void Relabel(Work& work)
{
  const Recipe& r = work.recipe;
  const Vector3 centre =
    0.5 * (work.phantom->Ostia(r.moment)[0].position + work.phantom->Ostia(r.moment)[1].position);
  const Vector3 shift(31.0, -187.0, 412.0);
  const auto place = [&](const Vector3& p) -> Vector3
  { return shift + r.scale * (r.body.transpose() * (p - centre)); };
  for (PhantomOstium& ostium : work.result.truth)
  {
    ostium.position = place(ostium.position);
    ostium.axis = r.body.transpose() * ostium.axis;
    ostium.radius *= r.scale;
  }
  ImageGrid& grid = work.result.grid;
  grid.origin = shift + r.scale * (grid.origin - centre);
  grid.spacing *= r.scale;
  if (r.mirrored)
  {
    const Matrix3 mirror = Vector3(-1.0, 1.0, 1.0).asDiagonal();
    grid.origin = mirror * grid.origin;
    // A direction that is a rotation again: columns from the other end.
    grid.direction = mirror * grid.direction;
    grid.origin += grid.direction.col(0) * grid.spacing[0] * grid.extent[1];
    grid.direction.col(0) *= -1.0;
    const int nx = grid.extent[1] + 1;
    for (std::size_t row = 0; row < work.result.values.size(); row += nx)
    {
      std::reverse(work.result.values.begin() + static_cast<std::ptrdiff_t>(row),
        work.result.values.begin() + static_cast<std::ptrdiff_t>(row + nx));
    }
    for (PhantomOstium& ostium : work.result.truth)
    {
      ostium.position = mirror * ostium.position;
      ostium.axis = mirror * ostium.axis;
    }
  }
}

/// Takes a vessel's first part away, up to the aortic wall.
void Erase(Work& work, Painter& painter, int treeId, double length)
{
  const std::vector<Vector3> line = Beginning(work.tree, treeId, 0.0, length);
  const AorticRoot& root = work.anatomy->root;
  painter.Paint(Fat,
    [&](const Vector3& p)
    { return std::min(3.2 - Painter::DistanceTo(line, p), OutsideRoot(root, p) - 1.2); });
  painter.Paint(Wall,
    [&](const Vector3& p)
    {
      const double outside = OutsideRoot(root, p);
      return std::min(3.2 - Painter::DistanceTo(line, p), std::min(outside, 1.2 - outside));
    });
  const char* name = treeId == 0 ? "LCA" : "RCA";
  auto& truth = work.result.truth;
  truth.erase(std::remove_if(
                truth.begin(), truth.end(), [&](const PhantomOstium& o) { return o.name == name; }),
    truth.end());
}

/// Plaque in place of a vessel's lumen from some millimetres behind its ostium on; it still begins there.
void Hide(Work& work, Painter& painter, int treeId, double from, double to, double value)
{
  const std::vector<Vector3> line = Beginning(work.tree, treeId, from, to);
  const AorticRoot& root = work.anatomy->root;
  painter.Paint(value,
    [&](const Vector3& p)
    { return std::min(2.8 - Painter::DistanceTo(line, p), OutsideRoot(root, p)); });
}

/// A vessel that begins `rise` mm above its usual place.
void RaiseOstium(Work& work, Painter& painter, int treeId, double rise)
{
  const PhantomOstium old = work.result.truth[static_cast<std::size_t>(treeId)];
  Erase(work, painter, treeId, 14.0);
  const AorticRoot& root = work.anatomy->root;
  const std::vector<Vector3> rest = Beginning(work.tree, treeId, 13.0, 17.0);
  const Vector3 height = (old.position - root.centre).dot(root.axis) * root.axis;
  const Vector3 outward = (old.position - root.centre - height).normalized();
  const Vector3 above = root.centre + height + rise * root.axis;
  // On the wall there.
  double low = 0.0;
  double high = 40.0;
  while (high - low > 1e-6)
  {
    const double middle = 0.5 * (low + high);
    (OutsideRoot(root, above + middle * outward) < 0.0 ? low : high) = middle;
  }
  PhantomOstium ostium = old;
  ostium.position = above + low * outward;
  const std::vector<Vector3> line = CurveThrough(
    ostium.position - 2.0 * outward, outward, rest.front(), rest.back() - rest.front());
  painter.Tube(line, 0.9 * old.radius, work.bloodValue - 10.0);
  ostium.axis = (outward - 0.3 * root.axis).normalized();
  work.result.truth.insert(work.result.truth.begin() + treeId, ostium);
}

/// A pulmonary trunk as bright as the aorta, an atrial appendage beside the left main, a dense caval vein.
void BrightNeighbours(Work& work, Painter& painter)
{
  const PhantomAnatomy& a = *work.anatomy;
  const double blood = work.bloodValue;
  const std::vector<Vector3> trunk{ a.pulmonaryBase - 14.0 * a.pulmonaryAxis,
    a.pulmonaryBase + 120.0 * a.pulmonaryAxis };
  const auto clear = [&](const Vector3& p)
  { return std::min(OutsideRoot(a.root, p) - 1.6, OutsideVessels(work, p) - 1.0); };
  painter.Paint(blood,
    [&](const Vector3& p)
    {
      const double d = 11.5 - Painter::DistanceTo(trunk, p);
      return d < -2.0 ? d : std::min(d, clear(p));
    });
  // The caval vein: behind on the right, straight up.
  const Vector3 right =
    a.root.centre - (a.root.radius + 11.0) * Vector3(0.85, -0.5, 0.0).normalized();
  painter.Paint(1.8 * blood,
    [&](const Vector3& p)
    {
      const double d = 8.0 - Painter::DistanceTo({ right, right + Vector3(0, 0, 120) }, p);
      return d < -2.0 ? d : std::min(d, clear(p));
    });
  // The appendage: a curved finger from the atrium over the left main.
  const Vector3& left = work.phantom->Ostia(work.recipe.moment)[0].position;
  const std::vector<Vector3> finger = CurveThrough(left + Vector3(16, 12, 4), Vector3(0, -1, 0.3),
    left + Vector3(14, -16, 9), Vector3(-0.6, -1, 0));
  painter.Paint(0.95 * blood,
    [&](const Vector3& p)
    {
      const double d = 4.5 - Painter::DistanceTo(finger, p);
      return d < -2.0 ? d : std::min(d, clear(p));
    });
}

/// Everything but a bright tube with two branches at its sides, beside a spine.
void Abdomen(Work& work, RandomStream& random)
{
  std::vector<std::int16_t>& values = work.result.values;
  std::fill(values.begin(), values.end(), static_cast<std::int16_t>(50));
  Painter painter(work.result, work.grid, 25.0, random.Bits());
  const Vector3 c = work.anatomy->root.centre;
  const double radius = random.Uniform(9.0, 13.0);
  const Vector3 up(0, 0, 200);
  painter.Paint(Fat, [&](const Vector3& p) { return 40.0 - std::hypot(p[0] - c[0], p[1] - c[1]); });
  painter.Paint(300.0,
    [&](const Vector3& p) { return 17.0 - std::hypot(p[0] - c[0] + 8.0, p[1] - c[1] - 33.0); });
  painter.Tube({ c - up, c + up }, radius, 400.0);
  for (const double side : { -1.0, 1.0 })
  {
    const Vector3 from = c + Vector3(side * (radius - 2.0), 0.0, random.Uniform(-6.0, 6.0));
    const Vector3 to =
      from + Vector3(side * 45.0, random.Uniform(-5.0, 15.0), random.Uniform(-20.0, 5.0));
    painter.Tube(CurveThrough(from, Vector3(side, -0.4, 0), to, Vector3(side, 0.5, 0)),
      random.Uniform(2.2, 3.2), 390.0);
  }
  const Vector3 from = c + Vector3(0.0, -radius + 2.0, 14.0);
  painter.Tube(
    CurveThrough(from, Vector3(0, -1, 0), from + Vector3(10, -18, -35), Vector3(0, 0, -1)), 3.0,
    390.0);
  work.result.truth.clear();
}

Matrix3 Tilt(RandomStream& random, double minimum, double most)
{
  const double about = random.Uniform(0.0, 2.0 * Pi);
  const double tilt = Degrees(random.Uniform(minimum, most));
  const double roll = Degrees(random.Uniform(-15.0, 15.0));
  return (Eigen::AngleAxisd(tilt, Vector3(std::cos(about), std::sin(about), 0.0)) *
    Eigen::AngleAxisd(roll, Vector3::UnitZ()))
    .toRotationMatrix();
}

/// What of a group's recipe is settled before the image is rendered.
void Prepare(const std::string& group, RandomStream& random, Recipe& r)
{
  const auto is = [&](const char* name) { return group == name; };
  if (is("oblique"))
  {
    r.body = Tilt(random, 20.0, 50.0);
    if (random.Uniform() < 0.5)
    {
      r.voxels = Tilt(random, 5.0, 30.0);
    }
  }
  else if (is("corner"))
  {
    r.body = Tilt(random, 20.0, 45.0);
    const int side = static_cast<int>(4.0 * random.Uniform());
    r.high[2] = random.Uniform(24.0, 36.0);
    (side % 2 ? r.low : r.high)[side / 2] = (side % 2 ? -1.0 : 1.0) * random.Uniform(26.0, 36.0);
    r.low[2] = -75.0;
  }
  else if (is("cut"))
  {
    r.high[2] = random.Uniform(9.0, 18.0);
    r.body = Tilt(random, 0.0, 25.0);
  }
  else if (is("diseased"))
  {
    r.settings.stenoses = 4;
    r.settings.stenosisDegree = random.Uniform(0.5, 0.9);
    r.settings.calcifiedPlaques = 20;
    r.settings.chronicOcclusion = random.Uniform() < 0.3;
    r.settings.noise = 30.0;
  }
  else if (is("dim"))
  {
    r.settings.lumenHU = random.Uniform(230.0, 300.0);
    r.settings.noise = random.Uniform(20.0, 40.0);
  }
  else if (is("noisy"))
  {
    r.settings.noise = 60.0;
    r.settings.noiseCorrelation = 0.6;
  }
  else if (is("moving"))
  {
    r.moment = random.Uniform();
    r.settings.temporalWindow = 0.140;
    r.settings.noise = 35.0;
  }
  else if (is("other size"))
  {
    r.scale = random.Uniform() < 0.5 ? random.Uniform(0.75, 0.85) : random.Uniform(1.15, 1.3);
  }
  else if (is("below the root"))
  {
    r.high[2] = -random.Uniform(14.0, 20.0);
    r.low[2] = -95.0;
  }
  else if (is("mirrored"))
  {
    r.mirrored = true;
  }
  else if (is("upside down"))
  {
    r.body = Eigen::AngleAxisd(Pi, Vector3::UnitX()).toRotationMatrix();
  }
  else if (is("lungs' phase"))
  {
    r.settings.lumenHU = random.Uniform(60.0, 130.0);
  }
}

/// What is drawn over the image.
void Change(const std::string& group, RandomStream& random, Work& work)
{
  const auto is = [&](const char* name) { return group == name; };
  Painter painter(work.result, work.grid, 0.8 * work.recipe.settings.noise, random.Bits());
  const AorticRoot root = work.anatomy->root;
  const double blood = work.bloodValue;
  if (is("wide aorta"))
  {
    const double widest = random.Uniform(20.0, 24.0);
    const double begin = random.Uniform(8.0, 14.0);
    const auto depth = [&](const Vector3& p)
    {
      const double height = (p - root.centre).dot(root.axis);
      const double share = SmoothStep((height - begin) / 22.0);
      const double radius = root.radius + share * (widest - root.radius);
      return height < begin ? -1e3 : radius - (p - root.centre - height * root.axis).norm();
    };
    painter.Paint(Wall, [&](const Vector3& p) { return depth(p) + 1.6; });
    painter.Paint(blood, depth);
  }
  else if (is("bicuspid"))
  {
    // Two large sinuses in place of a round root.
    const Vector3 across =
      (work.result.truth[0].position - work.result.truth[1].position).normalized();
    const Vector3 side = root.axis.cross(across);
    const double size = random.Uniform(0.55, 0.7) * root.radius;
    const double offset = random.Uniform(0.55, 0.8) * root.radius;
    for (const double sign : { -1.0, 1.0 })
    {
      const Vector3 c = root.centre - 6.0 * root.axis + sign * offset * side;
      const auto clear = [&](const Vector3& p, double depth)
      { return depth < -2.0 ? depth : std::min(depth, OutsideVessels(work, p) - 1.0); };
      painter.Paint(Wall,
        [&](const Vector3& p)
        { return OutsideRoot(root, p) < 0.0 ? -1e3 : clear(p, size + 1.6 - (p - c).norm()); });
      painter.Paint(blood, [&](const Vector3& p) { return clear(p, size - (p - c).norm()); });
    }
  }
  else if (is("bright neighbours"))
  {
    BrightNeighbours(work, painter);
  }
  else if (is("conus"))
  {
    // Its own ostium, 5 to 8 mm in front of the right one.
    const PhantomOstium& rca = work.result.truth[1];
    const Vector3 outward = (rca.position - root.centre).normalized();
    const Vector3 turned =
      Eigen::AngleAxisd(Degrees(random.Uniform(28.0, 42.0)), -root.axis) * outward;
    const Vector3 from = root.centre + (root.radius - 1.0) * turned + 3.0 * root.axis;
    painter.Tube(CurveThrough(from, turned, from + 12.0 * turned + Vector3(12, -18, -12),
                   Vector3(0.6, -0.3, -1.0)),
      random.Uniform(0.7, 1.1), blood - 20.0);
  }
  else if (is("high take-off"))
  {
    RaiseOstium(work, painter, random.Uniform() < 0.5 ? 0 : 1, random.Uniform(9.0, 18.0));
  }
  else if (is("hidden mouth"))
  {
    const int treeId = random.Uniform() < 0.5 ? 0 : 1;
    const double from = random.Uniform(0.0, 4.0);
    Hide(work, painter, treeId, from, from + random.Uniform(4.0, 8.0), random.Uniform(30.0, 90.0));
  }
  else if (is("no right ostium"))
  {
    Erase(work, painter, 1, 25.0);
  }
  else if (is("no left ostium"))
  {
    Erase(work, painter, 0, 25.0);
  }
  else if (is("no ostia"))
  {
    Erase(work, painter, 0, 30.0);
    Erase(work, painter, 1, 30.0);
  }
  else if (is("native"))
  {
    for (std::int16_t& value : work.result.values)
    {
      value = value > 60 && value < 1000 ? static_cast<std::int16_t>(40 + value % 32) : value;
    }
    work.result.truth.clear();
  }
  else if (is("lungs' phase"))
  {
    const double bright = random.Uniform(400.0, 600.0);
    const PhantomAnatomy& a = *work.anatomy;
    painter.Tube(
      { a.pulmonaryBase - 14.0 * a.pulmonaryAxis, a.pulmonaryBase + 120.0 * a.pulmonaryAxis }, 11.5,
      bright);
    const Vector3 side = a.pulmonaryBase + 40.0 * a.pulmonaryAxis;
    painter.Tube(
      CurveThrough(side, Vector3(1, 0.5, 0), side + Vector3(45, 20, 5), Vector3(1, 0, 0)), 4.0,
      bright);
    painter.Tube(
      CurveThrough(side, Vector3(-1, 0.5, 0), side + Vector3(-50, 20, 5), Vector3(-1, 0, 0)), 4.0,
      bright);
    work.result.truth.clear();
  }
  else if (is("abdomen"))
  {
    Abdomen(work, random);
  }
  else if (is("below the root"))
  {
    work.result.truth.clear();
  }
}
}

const std::vector<OstiaGroup>& OstiaGroups()
{
  static const std::vector<OstiaGroup> groups{
    { "plain", "as it is; voxels of 0.45 to 0.9 mm", false },
    { "oblique",
      "the body turned by 20 to 50 degrees about any horizontal axis; half of the images' axes as "
      "well",
      false },
    { "corner", "oblique, and the root 24 to 36 mm from two faces of the image", false },
    { "cut", "the image ends 9 to 18 mm above the ostia", false },
    { "wide aorta", "ascending aorta of 40 to 48 mm", false },
    { "other size", "a root of 0.75 to 1.3 times the size", false },
    { "bicuspid", "a root with two large sinuses", false },
    { "bright neighbours",
      "pulmonary trunk, caval vein and an appendage at the left main as bright or brighter",
      false },
    { "conus", "a third ostium beside the right one", false },
    { "high take-off", "one ostium 9 to 18 mm higher", false },
    { "diseased", "stenoses of 50 to 90 %, 20 calcifications, some occlusions", false },
    { "dim", "230 to 300 HU", false },
    { "noisy", "60 HU of noise", false },
    { "moving", "any moment, 140 ms, 35 HU", false },
    { "no right ostium", "the first 25 mm of the RCA are missing", true },
    { "no left ostium", "the first 25 mm of the left tree are missing", true },
    { "no ostia", "both are missing", true },
    { "below the root", "the image ends below the ostia", true },
    { "mirrored", "left and right exchanged", true },
    { "upside down", "feet and head, back and front exchanged", true },
    { "native", "no contrast medium", true },
    { "lungs' phase", "only the pulmonary arteries are bright", true },
    { "abdomen", "a bright aorta with renal and mesenteric arteries", true },
    { "hidden mouth", "plaque closes 4 to 8 mm of one artery, 0 to 4 mm behind its ostium", false },
  };
  return groups;
}

OstiaCase MakeOstiaCase(const std::string& group, std::uint64_t seed, double coarsest)
{
  const auto& groups = OstiaGroups();
  const auto place = std::find_if(
    groups.begin(), groups.end(), [&](const OstiaGroup& g) { return g.name == group; });
  if (place == groups.end())
  {
    throw std::invalid_argument("there is no group '" + group + "'");
  }
  RandomStream random(seed, 7000 + static_cast<std::uint64_t>(place - groups.begin()));
  Work work;
  Recipe& r = work.recipe;
  r.settings.seed = seed;
  r.settings.dominance = static_cast<Dominance>(random.Bits() % 3);
  r.settings.ramus = random.Uniform() < 0.3;
  r.settings.noise = random.Uniform(15.0, 30.0);
  r.settings.lumenHU = random.Uniform(330.0, 480.0);
  r.settings.calibre = random.Uniform(0.85, 1.1);
  r.spacing = random.Uniform(0.45, 0.9);
  Prepare(group, random, r);
  Start(work, coarsest);
  Change(group, random, work);
  Relabel(work);
  return std::move(work.result);
}
}
