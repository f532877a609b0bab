#include "WeightTransfer.h"

#include "Require.h"
#include "TetrahedralBoundary.h"
#include "TriangleBvh.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace coronary
{
namespace
{
constexpr double Inside = -1e-9; // least barycentric coordinate

struct Mix
{
  std::array<std::int64_t, 4> point{ 0, 0, 0, 0 };
  std::array<double, 4> share{ 0.0, 0.0, 0.0, 0.0 };
};

/// Which tetrahedron a place is in: by a grid of boxes with what meets them.
class TetrahedronGrid
{
public:
  TetrahedronGrid(const std::vector<Vector3>& points, const std::vector<Tetrahedron>& tetrahedra)
    : Points(points)
    , Tetrahedra(tetrahedra)
  {
    double sizes = 0.0;
    for (const Tetrahedron& t : tetrahedra)
    {
      const auto [low, high] = this->BoxOf(t);
      sizes += (high - low).maxCoeff();
    }
    this->Size = std::max(1e-9, sizes / static_cast<double>(tetrahedra.size()));
    for (std::size_t n = 0; n < tetrahedra.size(); ++n)
    {
      const auto [low, high] = this->BoxOf(tetrahedra[n]);
      const Key first = this->KeyOf(low);
      const Key last = this->KeyOf(high);
      for (std::int64_t i = first[0]; i <= last[0]; ++i)
      {
        for (std::int64_t j = first[1]; j <= last[1]; ++j)
        {
          for (std::int64_t k = first[2]; k <= last[2]; ++k)
          {
            this->Boxes[{ i, j, k }].push_back(n);
          }
        }
      }
    }
  }

  /// False: in none.
  bool Find(const Vector3& place, Mix& mix) const
  {
    const auto box = this->Boxes.find(this->KeyOf(place));
    if (box == this->Boxes.end())
    {
      return false;
    }
    for (const std::size_t n : box->second)
    {
      const Tetrahedron& t = this->Tetrahedra[n];
      Matrix3 edges;
      for (int k = 0; k < 3; ++k)
      {
        edges.col(k) = this->Points[t[static_cast<std::size_t>(k) + 1]] - this->Points[t[0]];
      }
      if (edges.determinant() == 0.0)
      {
        continue;
      }
      const Vector3 share = edges.inverse() * (place - this->Points[t[0]]);
      if (share.minCoeff() >= Inside && share.sum() <= 1.0 - Inside)
      {
        mix.point = t;
        mix.share = { 1.0 - share.sum(), share[0], share[1], share[2] };
        return true;
      }
    }
    return false;
  }

private:
  using Key = std::array<std::int64_t, 3>;

  std::pair<Vector3, Vector3> BoxOf(const Tetrahedron& t) const
  {
    Vector3 low = this->Points[t[0]];
    Vector3 high = low;
    for (const std::int64_t p : t)
    {
      low = low.cwiseMin(this->Points[p]);
      high = high.cwiseMax(this->Points[p]);
    }
    return { low, high };
  }

  Key KeyOf(const Vector3& place) const
  {
    Key key{};
    for (int k = 0; k < 3; ++k)
    {
      key[static_cast<std::size_t>(k)] =
        static_cast<std::int64_t>(std::floor(place[k] / this->Size));
    }
    return key;
  }

  const std::vector<Vector3>& Points;
  const std::vector<Tetrahedron>& Tetrahedra;
  double Size = 1.0;
  std::map<Key, std::vector<std::size_t>> Boxes;
};

Mix OnBoundary(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles,
  const TriangleBvh& tree, const Vector3& place)
{
  const TriangleBvh::Nearest nearest = tree.Closest(place);
  Require(nearest.triangle >= 0, "a place of the mesh is not finite");
  const Triangle& t = triangles[nearest.triangle];
  const Vector3& a = points[t[0]];
  const Vector3 across = (points[t[1]] - a).cross(points[t[2]] - a);
  const double square = std::max(1e-300, across.squaredNorm());
  const double b = (nearest.point - a).cross(points[t[2]] - a).dot(across) / square;
  const double c = (points[t[1]] - a).cross(nearest.point - a).dot(across) / square;
  return { { t[0], t[1], t[2], t[0] }, { 1.0 - b - c, b, c, 0.0 } };
}
}

CompactSkinWeights TransferWeights(const std::vector<Vector3>& points,
  const std::vector<Tetrahedron>& tetrahedra, const CompactSkinWeights& weights,
  const std::vector<Vector3>& places, int influences, const ProgressCallback& progress)
{
  Require(!tetrahedra.empty(), "weights to be transferred need tetrahedra");
  Require(weights.influences >= 1 &&
      weights.weight.size() == points.size() * static_cast<std::size_t>(weights.influences) &&
      weights.bone.size() == weights.weight.size(),
    "there is another number of weights than the mesh has points");
  for (const Tetrahedron& t : tetrahedra)
  {
    for (const std::int64_t p : t)
    {
      Require(p >= 0 && p < static_cast<std::int64_t>(points.size()),
        "a tetrahedron has a point that does not exist");
    }
  }
  std::vector<Triangle> triangles;
  for (const auto& [face, tetrahedron] : BoundaryFaces(tetrahedra))
  {
    triangles.push_back(face);
  }
  const TriangleBvh boundary(points, triangles);
  const TetrahedronGrid grid(points, tetrahedra);
  SkinWeights mixed;
  mixed.offset.push_back(0);
  for (std::size_t n = 0; n < places.size(); ++n)
  {
    if (n % 4096 == 0)
    {
      Report(progress, static_cast<double>(n) / static_cast<double>(places.size()));
    }
    Mix mix;
    if (!grid.Find(places[n], mix))
    {
      mix = OnBoundary(points, triangles, boundary, places[n]);
    }
    std::map<std::int32_t, double> sum;
    for (std::size_t k = 0; k < mix.point.size(); ++k)
    {
      for (int i = 0; mix.share[k] != 0.0 && i < weights.influences; ++i)
      {
        const auto at = static_cast<std::size_t>(mix.point[k] * weights.influences + i);
        if (weights.weight[at] != 0.0F)
        {
          sum[weights.bone[at]] += mix.share[k] * static_cast<double>(weights.weight[at]);
        }
      }
    }
    for (const auto& [bone, weight] : sum)
    {
      mixed.bone.push_back(bone);
      mixed.weight.push_back(weight);
      mixed.bones = std::max<std::int64_t>(mixed.bones, bone + 1);
    }
    mixed.offset.push_back(static_cast<std::int64_t>(mixed.bone.size()));
  }
  return CompactWeights(mixed, influences);
}
}
