// A surface while it is cleaned: triangles that come and go, each with where it is from. Inside the library only.
#ifndef DynamicCoronary_SurfaceCells_h
#define DynamicCoronary_SurfaceCells_h

#include "HoleFilling.h"
#include "TriangleSides.h"

namespace coronary
{
/// One triangle with where it came from.
struct SurfaceCell
{
  Triangle corners;
  std::int64_t source; ///< of the input, or -1
  int cap;             ///< 0: wall
  bool band = false;   ///< joins two rims
};

/// Radians; 0 for a triangle without area.
double MinimumCornerAngle(const Vector3& a, const Vector3& b, const Vector3& c);

struct SurfaceCells
{
  std::vector<Vector3> points;      ///< mm
  std::vector<std::int64_t> source; ///< per point: of the input, or -1
  std::vector<SurfaceCell> cells;
  int caps = 0; ///< the highest number of a cap

  const Vector3& At(std::int64_t i) const { return this->points[i]; }
  Vector3 Area(const SurfaceCell& cell) const
  {
    return AreaVector(
      this->At(cell.corners[0]), this->At(cell.corners[1]), this->At(cell.corners[2]));
  }
  Vector3 Centre(const SurfaceCell& cell) const
  {
    return (this->At(cell.corners[0]) + this->At(cell.corners[1]) + this->At(cell.corners[2])) /
      3.0;
  }
  double Angle(const SurfaceCell& cell) const
  {
    return MinimumCornerAngle(
      this->At(cell.corners[0]), this->At(cell.corners[1]), this->At(cell.corners[2]));
  }

  template <typename Predicate>
  void Keep(const Predicate& keep)
  {
    std::vector<SurfaceCell> kept;
    kept.reserve(this->cells.size());
    for (const SurfaceCell& cell : this->cells)
    {
      if (keep(cell))
      {
        kept.push_back(cell);
      }
    }
    this->cells.swap(kept);
  }

  void Remove(const std::vector<char>& bad);

  std::vector<TriangleSide> Sides() const
  {
    return SidesOf(
      this->cells, [](const SurfaceCell& cell) -> const Triangle& { return cell.corners; });
  }

  /// Neighbours over edges of two triangles: three a triangle, -1 at open edges.
  std::vector<std::int64_t> Neighbours() const;

  /// Components over edges, numbered in the order of their first triangles.
  std::vector<std::int64_t> Components(std::int64_t& count) const;

  /// Per point: of the edges there; 0 where there are none.
  std::vector<double> MeanEdges() const;

  /// Appends a patch whose first points are the rim's.
  void Append(const SurfacePatch& patch, const std::vector<std::int64_t>& rim, int cap, bool band);
};
}

#endif
