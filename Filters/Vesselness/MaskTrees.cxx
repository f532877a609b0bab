#include "MaskTrees.h"

#include "DistanceTransform.h"
#include "GridIndex.h"
#include "PlaceText.h"
#include "VoxelLattice.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <set>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr double MinimumTree = 15.0; ///< mm, diagonal of its box
constexpr double MinimumReach =
  10.0; ///< mm that a tree leads away from the aorta: its sharp rims do not
constexpr double MinimumNamed = 3.0;   ///< mm^3; smaller fragments are not worth a remark
constexpr double MinimumAorta = 3.0;   ///< volumes of the ball
constexpr double MinimumHeart = 60.0;  ///< mm, diagonal of the box around the trees of one heart
constexpr double MaximumHeart = 260.0; ///< mm

constexpr int MostNamed = 5; ///< pieces that are left out, one by one

/// Voxels that hang together, and where they touch the aorta.
struct Piece
{
  std::vector<std::int64_t> voxels;
  std::vector<std::int64_t> contact;
  double diagonal = 0.0;
  double reach = 0.0; ///< mm away from the aorta
};

class Finder
{
public:
  Finder(const ImageGrid& grid, const std::vector<unsigned char>& mask)
    : Grid(grid)
    , Mask(mask)
    , Voxel(grid.spacing.prod())
    , Box(grid)
  {
  }

  MaskTrees Run(double maximumRadius, const ProgressCallback& progress);

private:
  Vector3 Place(std::int64_t number) const { return this->Box.World(this->Box.Place(number)); }
  std::size_t Whole(std::int64_t number) const;
  bool Crop();
  void CutAorta(double radius, const ProgressCallback& progress);
  std::vector<Piece> Pieces() const;
  std::vector<std::int64_t> MaximumPatch(const std::vector<std::int64_t>& voxels) const;
  void Question();

  const ImageGrid& Grid;
  const std::vector<unsigned char>& Mask;
  const double Voxel;
  VoxelLattice Box; ///< what is worked on: around all that is in the mask, with a voxel of air
  std::vector<unsigned char> Inside; ///< of the box: 0 nothing, 1 vessel, 2 aorta
  std::vector<float> FromAorta;      ///< squared, mm^2; empty without one
  MaskTrees Result;
};

/// Number in the mask of a voxel of the box.
std::size_t Finder::Whole(std::int64_t number) const
{
  const std::array<int, 3> at = this->Box.Place(number);
  const std::array<int, 6>& e = this->Box.Grid.extent;
  return GridOffset(this->Grid, e[0] + at[0], e[2] + at[1], e[4] + at[2]);
}

bool Finder::Crop()
{
  const std::array<int, 6>& e = this->Grid.extent;
  const int size[3] = { e[1] - e[0] + 1, e[3] - e[2] + 1, e[5] - e[4] + 1 };
  std::array<int, 3> low = { size[0], size[1], size[2] };
  std::array<int, 3> high = { -1, -1, -1 };
  std::size_t number = 0;
  for (int k = 0; k < size[2]; ++k)
  {
    for (int j = 0; j < size[1]; ++j)
    {
      for (int i = 0; i < size[0]; ++i, ++number)
      {
        if (this->Mask[number] != 0)
        {
          const int at[3] = { i, j, k };
          for (int axis = 0; axis < 3; ++axis)
          {
            low[axis] = std::min(low[axis], at[axis]);
            high[axis] = std::max(high[axis], at[axis]);
          }
        }
      }
    }
  }
  if (high[0] < 0)
  {
    return false;
  }
  ImageGrid box = this->Grid;
  for (int axis = 0; axis < 3; ++axis)
  {
    box.extent[2 * axis] = e[2 * axis] + std::max(0, low[axis] - 1);
    box.extent[2 * axis + 1] = e[2 * axis] + std::min(size[axis] - 1, high[axis] + 1);
  }
  this->Box = VoxelLattice(box);
  this->Inside.assign(GridSize(box), 0);
  for (std::size_t n = 0; n < this->Inside.size(); ++n)
  {
    this->Inside[n] = this->Mask[this->Whole(n)] != 0 ? 1 : 0;
  }
  return true;
}

void Finder::CutAorta(double radius, const ProgressCallback& progress)
{
  const std::vector<unsigned char> body =
    OpenWithBall(this->Inside.data(), this->Box.Size, this->Grid.spacing, radius, progress);
  const auto count = std::count(body.begin(), body.end(), 1);
  const double ball = 4.0 / 3.0 * 3.14159265358979323846 * radius * radius * radius;
  if (static_cast<double>(count) * this->Voxel < MinimumAorta * ball)
  {
    return;
  }
  this->Result.hasAorta = true;
  // With a voxel around it: a ball leaves the corners of a voxelised wall over.
  for (std::size_t n = 0; n < body.size(); ++n)
  {
    if (body[n] != 0)
    {
      this->Inside[n] = 2;
      this->Box.Neighbours(static_cast<std::int64_t>(n),
        [&](std::int64_t other, float)
        { this->Inside[other] = this->Inside[other] != 0 ? 2 : this->Inside[other]; });
    }
  }
  std::vector<unsigned char> outside(body.size());
  std::transform(this->Inside.begin(), this->Inside.end(), outside.begin(),
    [](unsigned char value) { return value == 2 ? 0 : 1; });
  this->FromAorta = SquaredDistanceTransform(outside.data(), this->Box.Size, this->Grid.spacing);
  this->Result.aortaVolume =
    static_cast<double>(std::count(this->Inside.begin(), this->Inside.end(), 2)) * this->Voxel;
}

std::vector<Piece> Finder::Pieces() const
{
  std::vector<Piece> pieces;
  std::vector<char> done(this->Inside.size(), 0);
  for (std::size_t n = 0; n < this->Inside.size(); ++n)
  {
    Piece piece;
    piece.voxels = this->Box.Connected(static_cast<std::int64_t>(n),
      [&](std::int64_t other)
      { return this->Inside[other] == 1 && std::exchange(done[other], 1) == 0; });
    if (piece.voxels.empty())
    {
      continue;
    }
    Vector3 low = this->Place(piece.voxels.front());
    Vector3 high = low;
    for (const std::int64_t voxel : piece.voxels)
    {
      const Vector3 place = this->Place(voxel);
      low = low.cwiseMin(place);
      high = high.cwiseMax(place);
      if (!this->FromAorta.empty())
      {
        piece.reach = std::max(piece.reach, std::sqrt(static_cast<double>(this->FromAorta[voxel])));
      }
      bool touches = false;
      this->Box.Neighbours(
        voxel, [&](std::int64_t other, float) { touches = touches || this->Inside[other] == 2; });
      if (touches)
      {
        piece.contact.push_back(voxel);
      }
    }
    piece.diagonal = (high - low).norm();
    pieces.push_back(std::move(piece));
  }
  std::stable_sort(pieces.begin(), pieces.end(),
    [](const Piece& a, const Piece& b) { return a.voxels.size() > b.voxels.size(); });
  return pieces;
}

/// Of voxels those that hang together and are most.
std::vector<std::int64_t> Finder::MaximumPatch(const std::vector<std::int64_t>& voxels) const
{
  std::set<std::int64_t> left(voxels.begin(), voxels.end());
  std::vector<std::int64_t> best;
  while (!left.empty())
  {
    std::vector<std::int64_t> patch = this->Box.Connected(
      *left.begin(), [&](std::int64_t voxel) { return left.erase(voxel) != 0; });
    best = patch.size() > best.size() ? std::move(patch) : best;
  }
  return best;
}

/// Whether the size is that of a heart.
void Finder::Question()
{
  const double size = this->Result.size;
  if (size >= MinimumHeart && size <= MaximumHeart)
  {
    return;
  }
  char text[400];
  const bool unit = (this->Grid.spacing - Vector3::Ones()).norm() < 1e-9;
  std::snprintf(text, sizeof(text),
    "the trees of the mask are %.0f mm in size, those of human hearts %.0f to %.0f mm%s", size,
    MinimumHeart, MaximumHeart,
    unit
      ? ": its voxels of exactly 1 mm are what a header without a voxel size says; give the file "
        "that of its image"
      : "");
  this->Result.remarks.emplace_back(text);
}

MaskTrees Finder::Run(double maximumRadius, const ProgressCallback& progress)
{
  if (!this->Crop())
  {
    throw std::invalid_argument("the mask is empty");
  }
  this->CutAorta(maximumRadius,
    progress ? [&](double fraction) { return progress(0.8 * fraction); } : ProgressCallback());
  this->Result.vessels.assign(this->Mask.size(), 0);
  const auto place = [&](const std::vector<std::int64_t>& voxels)
  {
    Vector3 middle = Vector3::Zero();
    for (const std::int64_t voxel : voxels)
    {
      middle += this->Place(voxel) / static_cast<double>(voxels.size());
    }
    const auto nearest = std::min_element(voxels.begin(), voxels.end(),
      [&](std::int64_t a, std::int64_t b) {
        return (this->Place(a) - middle).squaredNorm() < (this->Place(b) - middle).squaredNorm();
      });
    return this->Place(*nearest);
  };
  std::vector<float> depth;
  if (!this->Result.hasAorta)
  {
    depth = SquaredDistanceTransform(this->Inside.data(), this->Box.Size, this->Grid.spacing);
  }
  Vector3 low = Vector3::Constant(1e300);
  Vector3 high = -low;
  int pieces = 0;
  double leftOut = 0.0; // beside those that were named, the largest
  for (const Piece& piece : this->Pieces())
  {
    const double volume = static_cast<double>(piece.voxels.size()) * this->Voxel;
    const bool tree = piece.diagonal >= MinimumTree &&
      (!this->Result.hasAorta || (!piece.contact.empty() && piece.reach >= MinimumReach));
    if (!tree)
    {
      if (volume >= MinimumNamed && piece.contact.empty())
      {
        ++pieces;
        leftOut += volume;
        if (pieces <= MostNamed)
        {
          char text[100];
          std::snprintf(text, sizeof(text), "a piece of %.0f mm^3 around ", volume);
          this->Result.remarks.push_back(text + PlaceText(place(piece.voxels)) +
            " is left out: it hangs on no tree of the mask");
          leftOut = 0.0;
        }
      }
      continue;
    }
    MaskTree one;
    one.volume = volume;
    one.seed = this->Result.hasAorta
      ? place(this->MaximumPatch(piece.contact))
      : this->Place(*std::max_element(piece.voxels.begin(), piece.voxels.end(),
          [&](std::int64_t a, std::int64_t b) { return depth[a] < depth[b]; }));
    this->Result.trees.push_back(one);
    for (const std::int64_t voxel : piece.voxels)
    {
      this->Result.vessels[this->Whole(voxel)] = 1;
      low = low.cwiseMin(this->Place(voxel));
      high = high.cwiseMax(this->Place(voxel));
    }
  }
  if (pieces > MostNamed)
  {
    char text[100];
    std::snprintf(text, sizeof(text), "%d more pieces of %.0f mm^3 together are left out",
      pieces - MostNamed, leftOut);
    this->Result.remarks.emplace_back(text);
  }
  if (this->Result.trees.empty())
  {
    throw std::invalid_argument(this->Result.hasAorta
        ? "nothing hangs on the aorta that is as long as a coronary artery"
        : "nothing in it is as long as a coronary artery");
  }
  this->Result.size = (high - low).norm();
  this->Question();
  Report(progress, 1.0);
  return std::move(this->Result);
}
}

MaskTrees FindMaskTrees(const ImageGrid& grid, const std::vector<unsigned char>& mask,
  double maximumRadius, const ProgressCallback& progress)
{
  std::size_t voxels = 1;
  for (int axis = 0; axis < 3; ++axis)
  {
    voxels *=
      static_cast<std::size_t>(std::max(0, grid.extent[2 * axis + 1] - grid.extent[2 * axis] + 1));
  }
  if (voxels != mask.size())
  {
    throw std::invalid_argument("the mask has another number of voxels than its grid");
  }
  if (!(maximumRadius > 0.0))
  {
    throw std::invalid_argument("the largest radius must be positive");
  }
  return Finder(grid, mask).Run(maximumRadius, progress);
}
}
