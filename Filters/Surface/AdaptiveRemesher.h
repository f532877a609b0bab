/**
 * @file AdaptiveRemesher.h
 * @brief Makes the triangles of a closed surface even and of the wanted size.
 */
#ifndef DynamicCoronary_AdaptiveRemesher_h
#define DynamicCoronary_AdaptiveRemesher_h

#include "Geometry.h"
#include "ParallelFor.h"

namespace coronary
{
/// A vertex and what a RemeshSurface must remember of it.
struct RemeshVertex
{
  Vector3 position = Vector3::Zero();
  Vector3 normal = Vector3::UnitZ(); ///< of the surface, unit, outwards
  double size = 1.0;                 ///< wanted edge length, mm
  std::int32_t patch = -1;           ///< flat patch on or around which it lies; -1 curved surface
  bool rim = false;                  ///< on the patch's edge
  std::int32_t part = 0;             ///< for the surface's own use
  std::int32_t piece = 0;
};

/// The surface that is meshed. Calls from several threads at once.
class RemeshSurface
{
public:
  virtual ~RemeshSurface() = default;
  /// Puts the vertex on the surface (its patch, its rim), and sets its normal and size.
  virtual void Project(RemeshVertex& vertex) const = 0;
  /// Called before each round with the share that is done, 0 to 1: a surface may begin in a form
  /// that is easy to follow and end in its own. From 0.75 on it must keep still.
  virtual void Begin(double /*done*/) {}
};

/**
 * Isotropic remeshing by splitting, collapsing and flipping edges and moving vertices along the
 * surface, to a size that varies: Botsch and Kobbelt, "A remeshing approach to multiresolution
 * modeling", SGP 2004; sizes as in Dunyach et al., "Adaptive remeshing for real-time mesh
 * deformation", Eurographics 2013. Afterwards the worst triangles are mended one by one.
 * Edges between triangles of different entities stay.
 */
class AdaptiveRemesher
{
public:
  /**
   * @param triangles, entity  a closed, oriented 2-manifold
   * @param gradation          greatest change of the size per length
   * @throws std::invalid_argument when it is not closed and manifold
   */
  AdaptiveRemesher(RemeshSurface& surface, std::vector<RemeshVertex> vertices,
    const std::vector<Triangle>& triangles, std::vector<int> entity, double gradation);

  void Run(const ProgressCallback& progress);

  /// Meshes the surroundings of some triangles once more, after Run.
  void Repair(const std::vector<std::int64_t>& triangles);

  const std::vector<RemeshVertex>& Vertices() const { return this->V; }
  std::vector<Triangle> Triangles() const;
  const std::vector<int>& Entities() const { return this->Entity; }

private:
  using Index = std::int32_t;

  static Index Next(Index h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static Index Previous(Index h) { return h % 3 == 0 ? h + 2 : h - 1; }
  Index From(Index h) const { return this->Corner[h]; }
  Index To(Index h) const { return this->Corner[Next(h)]; }
  Index Apex(Index h) const { return this->Corner[Previous(h)]; }
  const Vector3& P(Index v) const { return this->V[v].position; }
  double Length(Index h) const { return (this->P(this->From(h)) - this->P(this->To(h))).norm(); }
  double Wanted(Index h) const
  {
    return 0.5 * (this->V[this->From(h)].size + this->V[this->To(h)].size);
  }
  bool IsFeature(Index h) const { return this->Entity[h / 3] != this->Entity[this->Twin[h] / 3]; }
  bool Dead(Index t) const { return this->Corner[3 * t] < 0; }
  double MinimumCosine(const Vector3& a, const Vector3& b, const Vector3& c) const;
  double Quality(Index a, Index b, Index c) const;
  double TriangleQuality(Index t) const;
  double Facing(Index t, const RemeshVertex& a, const RemeshVertex& b, const RemeshVertex& c) const;
  double FacingOf(Index t) const;
  std::array<Index, 3> LongestFirst(Index t) const; ///< a triangle's half-edges
  bool KeepsFacing(Index v, const RemeshVertex& moved) const;

  template <typename Visit>
  void AroundVertex(Index v, const Visit& visit) const;

  void Link(Index a, Index b);
  void ConnectAll();
  void Project(Index v) { this->Surface.Project(this->V[v]); }
  void ProjectAll();
  void Grade();
  Index Split(Index h);
  bool KeepsManifold(Index a, Index b, Index c, Index d) const;
  bool GainsByMerging(
    Index a, Index b, const RemeshVertex& vertex, bool forQuality, bool unfold) const;
  bool Collapse(Index h, bool forQuality, bool unfold);
  bool CanFlip(Index h) const;
  void Flip(Index h);
  void SplitLong(double factor);
  void CollapseShort(double factor);
  void FlipToValence();
  void FlipToDelaunay();
  void Smooth(double step);
  void Unfold(int rounds);
  void Mend(double angle, int rounds);
  bool Relocate(Index v);
  void FlipAround(Index v);
  double WorstAround(Index v, const Vector3& position) const;
  void Compact();
  Vector3 SmoothTarget(Index v) const;

  RemeshSurface& Surface;
  std::vector<RemeshVertex> V;
  std::vector<Index> Corner; ///< three a triangle
  std::vector<Index> Twin;   ///< half-edge on the other side
  std::vector<Index> Out;    ///< some half-edge from each vertex, -1 for a removed one
  std::vector<int> Entity;
  double Gradation;
};
}

#endif
