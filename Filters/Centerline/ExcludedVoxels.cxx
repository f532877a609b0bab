#include "ExcludedVoxels.h"

#include "GridIndex.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double SamePlace = 3.0;       ///< mm: where a vein was rejected before
constexpr double LongestCrossing = 6.0; ///< mm within a vein, at most, of what crosses it
}

bool ExcludedVoxels::Contains(const Vector3& point) const
{
  const Vector3 index = GridIndex(this->Grid, point);
  return !this->Flags.empty() && IsInGrid(this->Grid, index) &&
    this->Flags[GridOffset(this->Grid, static_cast<int>(std::lround(index[0])),
      static_cast<int>(std::lround(index[1])), static_cast<int>(std::lround(index[2])))] != 0;
}

bool ExcludedVoxels::LeadsInside(const std::vector<Vector3>& points) const
{
  if (this->Flags.empty())
  {
    return false;
  }
  std::size_t inside = 0;
  double length = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    if (this->Contains(points[i]))
    {
      ++inside;
      length += i > 0 ? (points[i] - points[i - 1]).norm() : 0.0;
    }
  }
  // Along a vein, not across it.
  return length > LongestCrossing || 4 * inside > points.size();
}

void ExcludedVoxels::Close(const std::vector<VeinBranch>& found, const VesselTree& tree,
  double voxel, std::vector<RejectedVein>& veins)
{
  this->Flags.resize(GridSize(this->Grid), 0);
  // In units of the radius the nearest lumen has a voxel.
  const auto mark = [&](std::size_t p, double reach, unsigned char value)
  {
    const Vector3 centre = GridIndex(this->Grid, tree.points[p]);
    BoxAround(centre, Vector3::Constant(reach).cwiseQuotient(this->Grid.spacing), this->Grid.extent)
      .ForEach(
        [&](int i, int j, int k)
        {
          if ((Vector3(i, j, k) - centre).cwiseProduct(this->Grid.spacing).norm() <= reach)
          {
            this->Flags[GridOffset(this->Grid, i, j, k)] = value;
          }
        });
  };
  std::vector<char> closed(tree.points.size(), 0);
  for (const VeinBranch& vein : found)
  {
    double length = 0.0;
    for (std::size_t i = 0; i < vein.closed.size(); ++i)
    {
      const auto p = static_cast<std::size_t>(vein.closed[i]);
      closed[p] = 1;
      mark(p, tree.radius[p] + 0.5 * voxel, 1);
      length += i == 0 ? 0.0 : (tree.points[p] - tree.points[vein.closed[i - 1]]).norm();
    }
    const Vector3& place = tree.points[static_cast<std::size_t>(vein.closed.front())];
    const auto known = std::find_if(veins.begin(), veins.end(),
      [&](const RejectedVein& other) { return (other.position - place).norm() < SamePlace; });
    if (known != veins.end())
    {
      known->length = std::max(known->length, length);
      known->probability = std::max(known->probability, vein.probability);
    }
    else
    {
      veins.push_back({ place, length, vein.probability });
    }
  }
  // What the arteries' own lumens cover stays theirs.
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    if (closed[p] == 0)
    {
      mark(p, tree.radius[p], 0);
    }
  }
  // What leaves a vein may be an artery that it crosses: the way across stays open.
  for (const VesselTree::Branch& branch : tree.branches)
  {
    const auto first = static_cast<std::size_t>(branch.points.front());
    const auto second = static_cast<std::size_t>(branch.points[1]);
    if (closed[first] != 0 && closed[second] == 0)
    {
      const auto middle = static_cast<std::size_t>(branch.points[branch.points.size() / 2]);
      mark(first, tree.radius[first] + tree.radius[middle] + 2.0 * voxel, 0);
    }
  }
}
}
