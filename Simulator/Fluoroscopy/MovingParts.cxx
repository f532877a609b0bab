#include "MovingParts.h"

#include "CubicStep.h"
#include "Require.h"
#include "VoxelCell.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace coronary
{
namespace
{
constexpr RequireOf RequireParts{ "moving parts" };

constexpr double FinestSpacing = 1.5; ///< mm: shadows of parts are not sharper
constexpr double LungAir = -830.0;    ///< HU: what a part leaves behind where it was
constexpr double Tissue = 60.0;       ///< HU: bone counts as no more
constexpr int LungFrom = -960;
constexpr int LungTo = -500;
constexpr double LeastLung = 15.0; ///< mm of it over a diaphragm
constexpr double LungFades = 40.0; ///< mm above the diaphragm in which less and less goes with it
constexpr double SidesFade = 12.0; ///< mm from where there is no diaphragm
constexpr double HeartWhole = 1.1; ///< of the ellipsoid: all of it moves
constexpr double HeartEnds = 1.6;
constexpr double WallOfHeart = 5.0;   ///< mm outside of the arteries' ellipsoid
constexpr double NearestPart = 100.0; ///< mm from the source: what is nearer fills the image
constexpr double SolidEnough = 0.3;   ///< determinant of a motion that is believed
constexpr double Ridge =
  0.02; ///< of the mean variance: flat lists of points say nothing across themselves

/// The volume along the axes of the world.
struct Upright
{
  std::array<int, 3> size{};
  Vector3 origin;
  double spacing = FinestSpacing;
  std::vector<std::int16_t> values;

  std::size_t Index(int i, int j, int k) const
  {
    return (static_cast<std::size_t>(k) * this->size[1] + j) * this->size[0] + i;
  }
  Vector3 Place(int i, int j, int k) const
  {
    return this->origin + this->spacing * Vector3(i, j, k);
  }
};

/// Nothing outside: air.
std::int16_t ValueAt(const HounsfieldVolume& volume, const Vector3& index)
{
  const std::array<int, 6>& extent = volume.grid.extent;
  for (int a = 0; a < 3; ++a)
  {
    if (index[a] < extent[2 * a] - 0.5 || index[a] > extent[2 * a + 1] + 0.5)
    {
      return -1000;
    }
  }
  return static_cast<std::int16_t>(
    std::lround(VoxelCell<double>(index, extent).Interpolate(volume.values.data())));
}

Upright UprightOf(const HounsfieldVolume& volume, const ProgressCallback& progress)
{
  const ImageGrid& grid = volume.grid;
  Vector3 low = Vector3::Constant(1e9);
  Vector3 high = -low;
  for (int corner = 0; corner < 8; ++corner)
  {
    const Vector3 place = grid.IndexToWorld(
      grid.extent[corner & 1], grid.extent[2 + (corner >> 1 & 1)], grid.extent[4 + (corner >> 2)]);
    low = low.cwiseMin(place);
    high = high.cwiseMax(place);
  }
  Upright upright;
  upright.spacing = std::max(FinestSpacing, grid.spacing.minCoeff());
  upright.origin = low;
  for (int a = 0; a < 3; ++a)
  {
    upright.size[a] = static_cast<int>(std::floor((high[a] - low[a]) / upright.spacing + 1e-6)) + 1;
  }
  if (grid.direction == Matrix3::Identity() && grid.spacing == Vector3::Constant(upright.spacing))
  {
    upright.values = volume.values; // as the phantom's
    return upright;
  }
  upright.values.resize(upright.Index(0, 0, upright.size[2]));
  const Matrix3 toIndex = grid.spacing.cwiseInverse().asDiagonal() * grid.direction.transpose();
  ParallelFor(
    upright.size[2], 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (int k = static_cast<int>(first); k < last; ++k)
      {
        for (int j = 0; j < upright.size[1]; ++j)
        {
          for (int i = 0; i < upright.size[0]; ++i)
          {
            upright.values[upright.Index(i, j, k)] =
              ValueAt(volume, toIndex * (upright.Place(i, j, k) - grid.origin));
          }
        }
      }
    },
    progress);
  return upright;
}

/// One number a column of voxels, x and y.
struct ColumnMap
{
  int columns;
  int rows;
  std::vector<double> values;
  double& At(int i, int j) { return this->values[static_cast<std::size_t>(j) * this->columns + i]; }
  double At(int i, int j) const
  {
    return this->values[static_cast<std::size_t>(j) * this->columns + i];
  }
};

/// Index k of the lowest lung's lower end; negative: there is none, or nothing below it.
ColumnMap DiaphragmOf(const Upright& body)
{
  const int least = static_cast<int>(std::ceil(LeastLung / body.spacing));
  ColumnMap ends{ body.size[0], body.size[1], {} };
  ends.values.assign(static_cast<std::size_t>(body.size[0]) * body.size[1], -1.0);
  for (int j = 0; j < body.size[1]; ++j)
  {
    for (int i = 0; i < body.size[0]; ++i)
    {
      int length = 0;
      for (int k = 0; k < body.size[2] && length < least; ++k)
      {
        const int value = body.values[body.Index(i, j, k)];
        length = value > LungFrom && value < LungTo ? length + 1 : 0;
        if (length == least)
        {
          const int end = k - least + 1;
          ends.At(i, j) = end > 0 && body.values[body.Index(i, j, end - 1)] >= LungTo ? end : -1.0;
        }
      }
    }
  }
  return ends;
}

/// 1 where there is a diaphragm, less towards the places without, which have 0.
ColumnMap SharesOf(const ColumnMap& ends, double spacing)
{
  const int reach = std::max(1, static_cast<int>(std::lround(SidesFade / spacing)));
  ColumnMap shares = ends;
  for (int j = 0; j < ends.rows; ++j)
  {
    for (int i = 0; i < ends.columns; ++i)
    {
      int with = 0;
      int all = 0;
      for (int y = std::max(0, j - reach); y <= std::min(ends.rows - 1, j + reach); ++y)
      {
        for (int x = std::max(0, i - reach); x <= std::min(ends.columns - 1, i + reach); ++x)
        {
          with += ends.At(x, y) >= 0.0 ? 1 : 0;
          ++all;
        }
      }
      shares.At(i, j) = ends.At(i, j) < 0.0 ? 0.0 : CubicStep(2.0 * with / all - 1.0);
    }
  }
  return shares;
}

double HeartShare(const HeartPlace& heart, const Vector3& place)
{
  const double level = (heart.axes * (place - heart.centre)).cwiseQuotient(heart.radii).norm();
  return 1.0 - CubicStep((level - HeartWhole) / (HeartEnds - HeartWhole));
}

/// Of the voxels that a weight is above 0 in. @param weigh  gets i, j, k
template <typename Weigh>
std::shared_ptr<const VolumeProjector> Weighted(const Upright& body,
  const std::vector<float>& excess, const std::array<int, 6>& box, const Weigh& weigh,
  const ProgressCallback& progress)
{
  ScalarImage image;
  image.grid.extent = box;
  image.grid.origin = body.origin;
  image.grid.spacing = Vector3::Constant(body.spacing);
  const std::array<int, 3> n = image.Dimensions();
  if (n[0] < 1 || n[1] < 1 || n[2] < 1)
  {
    return nullptr;
  }
  std::vector<float> values(static_cast<std::size_t>(image.NumberOfVoxels()));
  ParallelFor(
    n[2], 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (int k = static_cast<int>(first); k < last; ++k)
      {
        float* row = &values[static_cast<std::size_t>(k) * n[1] * n[0]];
        for (int j = 0; j < n[1]; ++j)
        {
          for (int i = 0; i < n[0]; ++i, ++row)
          {
            const std::int16_t value = body.values[body.Index(i + box[0], j + box[2], k + box[4])];
            const float more = excess[static_cast<std::size_t>(value - INT16_MIN)];
            *row = more > 0.0F
              ? more * static_cast<float>(weigh(i + box[0], j + box[2], k + box[4]))
              : 0.0F;
          }
        }
      }
    },
    progress);
  image.values = values.data();
  return std::make_shared<VolumeProjector>(image, [](double value) { return value; });
}
}

HeartPlace HeartAbout(const std::vector<Vector3>& arteries, const Vector3& base)
{
  RequireParts(arteries.size() >= 4, "a heart has to have four points of its arteries");
  Vector3 mean = Vector3::Zero();
  for (const Vector3& point : arteries)
  {
    mean += point / static_cast<double>(arteries.size());
  }
  Matrix3 spread = Matrix3::Zero();
  for (const Vector3& point : arteries)
  {
    spread += (point - mean) * (point - mean).transpose();
  }
  HeartPlace heart;
  heart.axes = Eigen::SelfAdjointEigenSolver<Matrix3>(spread).eigenvectors().transpose();
  Vector3 low = Vector3::Constant(1e9);
  Vector3 high = -low;
  for (const Vector3& point : arteries)
  {
    const Vector3 own = heart.axes * point;
    low = low.cwiseMin(own);
    high = high.cwiseMax(own);
  }
  heart.centre = heart.axes.transpose() * (0.5 * (low + high));
  heart.radii = (0.5 * (high - low)).array() + WallOfHeart;
  const Vector3 apex = *std::max_element(arteries.begin(), arteries.end(),
    [&](const Vector3& a, const Vector3& b)
    { return (a - base).squaredNorm() < (b - base).squaredNorm(); });
  RequireParts(apex != base, "a heart has to have arteries away from its base");
  heart.toApex = (apex - base).normalized();
  // One artery alone is flat; a heart is not.
  heart.radii = heart.radii.cwiseMax(0.6 * heart.radii.maxCoeff());
  return heart;
}

MovingParts FindMovingParts(const HounsfieldVolume& patient, const HeartPlace& heart,
  const std::function<double(double)>& attenuation, const ProgressCallback& progress)
{
  const Upright body = UprightOf(patient, progress);
  std::vector<float> excess(65536);
  const double lung = attenuation(LungAir);
  const double tissue = attenuation(Tissue);
  for (std::size_t n = 0; n < excess.size(); ++n)
  {
    const double own = attenuation(static_cast<double>(n) + INT16_MIN);
    excess[n] = static_cast<float>(std::clamp(own, lung, tissue) - lung);
  }
  MovingParts parts;
  parts.place = heart;
  parts.heart.middle = heart.centre;
  std::array<int, 6> box{};
  const double reach = HeartEnds * heart.radii.maxCoeff();
  for (int a = 0; a < 3; ++a)
  {
    const double at = (heart.centre[a] - body.origin[a]) / body.spacing;
    box[2 * a] = std::max(0, static_cast<int>(std::floor(at - reach / body.spacing)));
    box[2 * a + 1] =
      std::min(body.size[a] - 1, static_cast<int>(std::ceil(at + reach / body.spacing)));
  }
  parts.heart.projector = Weighted(
    body, excess, box, [&](int i, int j, int k) { return HeartShare(heart, body.Place(i, j, k)); },
    progress);

  const ColumnMap ends = DiaphragmOf(body);
  const ColumnMap shares = SharesOf(ends, body.spacing);
  double highest = 0.0;
  double sum = 0.0;
  for (int j = 0; j < ends.rows; ++j)
  {
    for (int i = 0; i < ends.columns; ++i)
    {
      const double share = shares.At(i, j);
      parts.diaphragm.middle += share * body.Place(i, j, static_cast<int>(ends.At(i, j)));
      sum += share;
      highest = share > 0.0 ? std::max(highest, ends.At(i, j)) : highest;
    }
  }
  if (sum == 0.0)
  {
    return parts;
  }
  parts.diaphragm.middle /= sum;
  const int top = static_cast<int>(highest + LungFades / body.spacing) + 1;
  parts.diaphragm.projector = Weighted(
    body, excess, { 0, body.size[0] - 1, 0, body.size[1] - 1, 0, std::min(top, body.size[2] - 1) },
    [&](int i, int j, int k)
    {
      const double share = shares.At(i, j);
      const double above = (k - ends.At(i, j)) * body.spacing;
      return share > 0.0 && above < LungFades ? share * (1.0 - CubicStep(above / LungFades)) *
          (1.0 - HeartShare(heart, body.Place(i, j, k)))
                                              : 0.0;
    },
    progress);
  return parts;
}

AffineMotion MotionOf(const std::vector<Vector3>& rest, const std::vector<Vector3>& now)
{
  RequireParts(rest.size() == now.size(), "points at rest and now have to be as many");
  AffineMotion motion;
  if (rest.empty() || rest == now)
  {
    return motion;
  }
  Vector3 from = Vector3::Zero();
  Vector3 to = Vector3::Zero();
  for (std::size_t n = 0; n < rest.size(); ++n)
  {
    from += rest[n] / static_cast<double>(rest.size());
    to += now[n] / static_cast<double>(rest.size());
  }
  Matrix3 spread = Matrix3::Zero();
  Matrix3 moved = Matrix3::Zero();
  for (std::size_t n = 0; n < rest.size(); ++n)
  {
    const Vector3 own = rest[n] - from;
    spread += own * own.transpose();
    moved += (now[n] - to - own) * own.transpose();
  }
  spread.diagonal().array() += Ridge * spread.trace() / 3.0 + 1e-9;
  const Matrix3 linear = Matrix3::Identity() + moved * spread.inverse();
  motion.linear = linear.determinant() > SolidEnough ? linear : Matrix3(Matrix3::Identity());
  motion.shift = to - motion.linear * from;
  return motion;
}

AffineMotion AcrossHeart(const AffineMotion& arteries, const HeartPlace& heart)
{
  const Matrix3 across = Matrix3::Identity() - heart.toApex * heart.toApex.transpose();
  const Matrix3 change = across * (arteries.linear - Matrix3::Identity()) * across;
  const Vector3 moved = arteries.linear * heart.centre + arteries.shift - heart.centre;
  return { Matrix3::Identity() + change, across * moved - change * heart.centre };
}

void AddMotion(const LineIntegrals& part, const CArmGeometry& geometry, const Vector3& middle,
  const AffineMotion& motion, LineIntegrals& image)
{
  const DetectorFormat& format = geometry.Format();
  const auto fits = [&](const LineIntegrals& one)
  { return one.columns == format.columns && one.rows == format.rows; };
  RequireParts(fits(part) && fits(image) && format.columns > 1 && format.rows > 1,
    "images have to be of the detector's format, two pixels each way or more");
  if (motion.IsRest())
  {
    return;
  }
  // From a place in the image, columns and rows from the middle's new place, back to where that was.
  const Vector3 from = geometry.Project(middle);
  const Vector3 to = geometry.Project(motion.linear * middle + motion.shift);
  if (!(std::min(from.z(), to.z()) > NearestPart))
  {
    return;
  }
  const Matrix3 back = motion.linear.inverse();
  const Vector3& u = geometry.ColumnDirection();
  const Vector3& v = geometry.RowDirection();
  const Vector3& along = geometry.TowardsDetector();
  const double nearer = to.z() / from.z();
  const double aspect = format.width / format.columns / (format.height / format.rows);
  const auto slope = [&](const Vector3& a, const Vector3& b) { return nearer * a.dot(back * b); };
  const double perColumn[2] = { slope(u, u), slope(v, u) * aspect };
  const double perRow[2] = { slope(u, v) / aspect, slope(v, v) };
  // Where it is squeezed along the beam there is less of it.
  const auto depth = static_cast<float>(1.0 / along.dot(back * along));
  // Just inside of the image, so that there is a pixel to the right and below.
  const float lastColumn = std::nextafter(static_cast<float>(format.columns - 1), 0.0F);
  const float lastRow = std::nextafter(static_cast<float>(format.rows - 1), 0.0F);
  const auto stepX = static_cast<float>(perColumn[0]);
  const auto stepY = static_cast<float>(perColumn[1]);
  for (int row = 0; row < format.rows; ++row)
  {
    const auto startX =
      static_cast<float>(from.x() - to.x() * perColumn[0] + (row - to.y()) * perRow[0]);
    const auto startY =
      static_cast<float>(from.y() - to.x() * perColumn[1] + (row - to.y()) * perRow[1]);
    const float* rest = &part.values[static_cast<std::size_t>(row) * format.columns];
    float* out = &image.values[static_cast<std::size_t>(row) * format.columns];
    for (int column = 0; column < format.columns; ++column)
    {
      const auto at = static_cast<float>(column);
      const float x = std::min(std::max(startX + at * stepX, 0.0F), lastColumn);
      const float y = std::min(std::max(startY + at * stepY, 0.0F), lastRow);
      const int i = static_cast<int>(x);
      const int j = static_cast<int>(y);
      const float fx = x - static_cast<float>(i);
      const float fy = y - static_cast<float>(j);
      const float* upper = &part.values[static_cast<std::size_t>(j) * format.columns + i];
      const float* lower = upper + format.columns;
      const float above = upper[0] + fx * (upper[1] - upper[0]);
      const float below = lower[0] + fx * (lower[1] - lower[0]);
      out[column] += depth * (above + fy * (below - above)) - rest[column];
    }
  }
}
}
