#include "AdaptiveRemesher.h"

#include "Numbers.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace coronary
{
namespace
{
/// Cosine between a triangle's normal and the surface's below which it counts as turned over.
constexpr double MinimumFacing = 0.5;
/// Triangles with a smaller angle are got rid of at the cost of uneven edges, degrees.
constexpr double HardAngle = 16.0;
/// Least angle that a collapse may leave, degrees. Edges far too short get more freedom, else heaps of tiny triangles stay
/// within large ones: what is thin afterwards is flipped and smoothed.
constexpr double CollapseAngle = 18.0;
constexpr double TinyCollapseAngle = 6.0;
constexpr double Tiny = 0.3; ///< of the wanted length
}

AdaptiveRemesher::AdaptiveRemesher(RemeshSurface& surface, std::vector<RemeshVertex> vertices,
  const std::vector<Triangle>& triangles, std::vector<int> entity, double gradation)
  : Surface(surface)
  , V(std::move(vertices))
  , Entity(std::move(entity))
  , Gradation(gradation)
{
  this->Corner.reserve(3 * triangles.size());
  for (const Triangle& t : triangles)
  {
    for (const std::int64_t p : t)
    {
      this->Corner.push_back(static_cast<Index>(p));
    }
  }
  this->ConnectAll();
}

std::vector<Triangle> AdaptiveRemesher::Triangles() const
{
  std::vector<Triangle> triangles(this->Corner.size() / 3);
  for (std::size_t t = 0; t < triangles.size(); ++t)
  {
    triangles[t] = { this->Corner[3 * t], this->Corner[3 * t + 1], this->Corner[3 * t + 2] };
  }
  return triangles;
}

void AdaptiveRemesher::ConnectAll()
{
  const Index edges = static_cast<Index>(this->Corner.size());
  const std::size_t n = this->V.size();
  this->Twin.assign(edges, -1);
  this->Out.assign(n, -1);
  // Half-edges sorted by origin; the twin is among those that start at the other end.
  std::vector<Index> first(n + 1, 0);
  for (const Index v : this->Corner)
  {
    ++first[v + 1];
  }
  for (std::size_t v = 0; v < n; ++v)
  {
    first[v + 1] += first[v];
  }
  std::vector<Index> from(edges);
  std::vector<Index> fill(first.begin(), first.end() - 1);
  for (Index h = 0; h < edges; ++h)
  {
    from[fill[this->Corner[h]]++] = h;
    this->Out[this->Corner[h]] = h;
  }
  const auto fail = []()
  { throw std::invalid_argument("AdaptiveRemesher: the surface is not closed and manifold"); };
  for (Index h = 0; h < edges; ++h)
  {
    const Index a = this->From(h);
    const Index b = this->To(h);
    for (Index i = first[b]; i < first[b + 1]; ++i)
    {
      if (this->To(from[i]) == a)
      {
        if (this->Twin[h] >= 0 || a == b)
        {
          fail();
        }
        this->Twin[h] = from[i];
      }
    }
    if (this->Twin[h] < 0)
    {
      fail();
    }
  }
  for (Index h = 0; h < edges; ++h)
  {
    if (this->Twin[this->Twin[h]] != h)
    {
      fail();
    }
  }
  // One fan around each vertex.
  for (std::size_t v = 0; v < n; ++v)
  {
    Index count = 0;
    if (this->Out[v] >= 0)
    {
      Index h = this->Out[v];
      do
      {
        ++count;
        h = this->Twin[Previous(h)];
      } while (h != this->Out[v] && count <= first[v + 1] - first[v]);
    }
    if (count != first[v + 1] - first[v])
    {
      fail();
    }
  }
}

template <typename Visit>
void AdaptiveRemesher::AroundVertex(Index v, const Visit& visit) const
{
  Index h = this->Out[v];
  do
  {
    visit(h);
    h = this->Twin[Previous(h)];
  } while (h != this->Out[v]);
}

/// Cosine of the smallest angle: the greatest of the three; 2 for a triangle without area.
double AdaptiveRemesher::MinimumCosine(const Vector3& a, const Vector3& b, const Vector3& c) const
{
  const Vector3 u = b - a;
  const Vector3 v = c - b;
  const Vector3 w = a - c;
  const double uu = u.squaredNorm();
  const double vv = v.squaredNorm();
  const double ww = w.squaredNorm();
  if (uu * vv * ww < 1e-60)
  {
    return 2.0;
  }
  return std::max({ -u.dot(w) / std::sqrt(uu * ww), -u.dot(v) / std::sqrt(uu * vv),
    -v.dot(w) / std::sqrt(vv * ww) });
}

/// Smallest angle in a measure that rises with it: minus its cosine.
double AdaptiveRemesher::Quality(Index a, Index b, Index c) const
{
  return -this->MinimumCosine(this->P(a), this->P(b), this->P(c));
}

double AdaptiveRemesher::TriangleQuality(Index t) const
{
  return this->Quality(this->Corner[3 * t], this->Corner[3 * t + 1], this->Corner[3 * t + 2]);
}

void AdaptiveRemesher::Link(Index a, Index b)
{
  this->Twin[a] = b;
  this->Twin[b] = a;
}

void AdaptiveRemesher::ProjectAll()
{
  ParallelFor(static_cast<std::int64_t>(this->V.size()), 512,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t v = first; v < last; ++v)
      {
        this->Surface.Project(this->V[v]);
      }
    });
}

/// No vertex may want edges much longer than its neighbours do.
void AdaptiveRemesher::Grade()
{
  const Index edges = static_cast<Index>(this->Corner.size());
  for (int sweep = 0; sweep < 12; ++sweep)
  {
    bool changed = false;
    const auto relax = [&](Index h)
    {
      RemeshVertex& a = this->V[this->From(h)];
      const RemeshVertex& b = this->V[this->To(h)];
      const double most = b.size + this->Gradation * (a.position - b.position).norm();
      if (a.size > most * (1.0 + 1e-6))
      {
        a.size = most;
        changed = true;
      }
    };
    for (Index h = 0; h < edges; ++h)
    {
      relax(h);
    }
    for (Index h = edges; h-- > 0;)
    {
      relax(h);
    }
    if (!changed)
    {
      break;
    }
  }
}

AdaptiveRemesher::Index AdaptiveRemesher::Split(Index h)
{
  const Index g = this->Twin[h];
  const Index a = this->From(h);
  const Index b = this->To(h);
  const Index c = this->Apex(h);
  const Index d = this->Apex(g);
  const Index m = static_cast<Index>(this->V.size());
  RemeshVertex vertex = this->V[a];
  const RemeshVertex& other = this->V[b];
  vertex.position = 0.5 * (vertex.position + other.position);
  vertex.normal = (vertex.normal + other.normal).normalized();
  vertex.size = 0.5 * (vertex.size + other.size);
  if (this->IsFeature(h))
  {
    vertex.rim = true;
  }
  else
  {
    vertex.rim = false;
    if (this->Entity[h / 3] == 1)
    {
      if (vertex.patch >= 0 && other.patch < 0)
      {
        vertex.part = other.part;
        vertex.piece = other.piece;
      }
      vertex.patch = -1;
    }
  }
  const double size = vertex.size;
  const Vector3 middle = vertex.position;
  this->Surface.Project(vertex);
  if ((vertex.position - middle).norm() > 0.5 * this->Length(h))
  {
    return -1;
  }
  vertex.size = std::min(vertex.size, size * 1.1);
  this->V.push_back(vertex);

  const Index t = static_cast<Index>(this->Corner.size()) / 3;
  const Index hn = Next(h);
  const Index gn = Next(g);
  const Index hTwin = this->Twin[hn]; // across b-c
  const Index gTwin = this->Twin[gn]; // across a-d
  // h: a-m-c, new: m-b-c; g: b-m-d, new: m-a-d.
  this->Corner.insert(this->Corner.end(), { m, b, c, m, a, d });
  this->Twin.resize(this->Corner.size());
  this->Entity.push_back(this->Entity[h / 3]);
  this->Entity.push_back(this->Entity[g / 3]);
  this->Corner[hn] = m;
  this->Corner[gn] = m;
  const Index n1 = 3 * t;     // m-b, b-c, c-m
  const Index n2 = 3 * t + 3; // m-a, a-d, d-m
  this->Link(h, n2);
  this->Link(g, n1);
  this->Link(n1 + 1, hTwin);
  this->Link(n2 + 1, gTwin);
  this->Link(n1 + 2, hn);
  this->Link(n2 + 2, gn);
  this->Out.push_back(hn);
  this->Out[a] = h;
  this->Out[b] = g;
  this->Out[c] = n1 + 2;
  this->Out[d] = n2 + 2;
  return m;
}

/// The link condition: exactly the apices `c` and `d` may be next to both ends; none may keep too few
/// edges.
bool AdaptiveRemesher::KeepsManifold(Index a, Index b, Index c, Index d) const
{
  Index common = 0;
  Index degreeA = 0;
  Index degreeB = 0;
  Index around[64];
  this->AroundVertex(a,
    [&](Index e)
    {
      if (degreeA < 64)
      {
        around[degreeA] = this->To(e);
      }
      ++degreeA;
    });
  if (degreeA > 64)
  {
    return false;
  }
  this->AroundVertex(b,
    [&](Index e)
    {
      ++degreeB;
      common += std::count(around, around + degreeA, this->To(e)) > 0 ? 1 : 0;
    });
  if (common != 2 || degreeA + degreeB < 8)
  {
    return false;
  }
  // Both neighbours lose an edge.
  for (const Index v : { c, d })
  {
    Index degree = 0;
    this->AroundVertex(v, [&](Index) { ++degree; });
    if (degree < 5)
    {
      return false;
    }
  }
  return true;
}

/// Whether the triangles around `a` and `b` are good enough with both at one vertex.
bool AdaptiveRemesher::GainsByMerging(
  Index a, Index b, const RemeshVertex& vertex, bool forQuality, bool unfold) const
{
  double before = 1.0;
  double after = 1.0;
  double facedBefore = 1.0;
  double facesAfter = 1.0;
  bool allowed = true;
  const auto check = [&](Index keep, Index gone)
  {
    this->AroundVertex(keep,
      [&](Index e)
      {
        if (!allowed)
        {
          return;
        }
        const Index p = this->To(e);
        const Index q = this->Apex(e);
        before = std::min(before, this->TriangleQuality(e / 3));
        const double was = this->Facing(e / 3, this->V[keep], this->V[p], this->V[q]);
        facedBefore = std::min(facedBefore, was);
        if (p == gone || q == gone)
        {
          return;
        }
        const double quality = -this->MinimumCosine(vertex.position, this->P(p), this->P(q));
        after = std::min(after, quality);
        const double wanted = 0.5 * (vertex.size + this->V[p].size);
        const double length = (vertex.position - this->P(p)).norm();
        if (length > (unfold ? 2.0 : forQuality ? 1.6 : 1.36) * wanted)
        {
          allowed = false;
        }
        const bool wall = this->Entity[e / 3] == 1;
        const double now = this->Facing(e / 3, vertex, this->V[p], this->V[q]);
        facesAfter = std::min(facesAfter, now);
        if (!unfold && now < std::min(MinimumFacing, was))
        {
          allowed = false;
        }
        if (wall && vertex.rim && this->V[p].rim && this->V[q].rim)
        {
          allowed = false;
        }
      });
  };
  check(a, b);
  if (allowed)
  {
    check(b, a);
  }
  if (!allowed)
  {
    return false;
  }
  const bool tiny =
    (this->P(a) - this->P(b)).norm() < 0.5 * Tiny * (this->V[a].size + this->V[b].size);
  const double least = -std::cos((tiny ? TinyCollapseAngle : CollapseAngle) * Degree);
  return !(unfold  ? facesAfter <= facedBefore
      : forQuality ? after <= before
                   : after < std::min(before, least));
}

bool AdaptiveRemesher::Collapse(Index h, bool forQuality, bool unfold)
{
  const Index g = this->Twin[h];
  Index a = this->From(h); // stays
  Index b = this->To(h);   // goes
  const Index c = this->Apex(h);
  const Index d = this->Apex(g);
  RemeshVertex& va = this->V[a];
  RemeshVertex& vb = this->V[b];
  if (va.rim && vb.rim && !this->IsFeature(h))
  {
    return false;
  }
  if (!this->KeepsManifold(a, b, c, d))
  {
    return false;
  }
  RemeshVertex vertex = va;
  if (va.rim == vb.rim && va.patch == vb.patch)
  {
    vertex.position = 0.5 * (va.position + vb.position);
    vertex.normal = (va.normal + vb.normal).normalized();
    vertex.size = 0.5 * (va.size + vb.size);
    const double size = vertex.size;
    this->Surface.Project(vertex);
    vertex.size = std::min(vertex.size, 1.1 * size);
  }
  else if (vb.rim)
  {
    vertex = vb;
  }
  if (!this->GainsByMerging(a, b, vertex, forQuality, unfold))
  {
    return false;
  }

  va = vertex;
  const Index hn = Next(h);
  const Index hp = Previous(h);
  const Index gn = Next(g);
  const Index gp = Previous(g);
  // All of b's triangles become a's.
  std::vector<Index> moved;
  moved.reserve(16);
  this->AroundVertex(b, [&](Index e) { moved.push_back(e); });
  for (const Index e : moved)
  {
    this->Corner[e] = a;
  }
  const Index right = this->Twin[hn]; // c-b, now c-a
  const Index left = this->Twin[hp];  // a-c
  const Index low = this->Twin[gn];   // d-a
  const Index high = this->Twin[gp];  // b-d, now a-d
  this->Link(right, left);
  this->Link(low, high);
  this->Out[a] = left;
  this->Out[c] = right;
  this->Out[d] = low;
  this->Out[b] = -1;
  for (const Index t : { h / 3, g / 3 })
  {
    for (int k = 0; k < 3; ++k)
    {
      this->Corner[3 * t + k] = -1;
    }
  }
  return true;
}

bool AdaptiveRemesher::CanFlip(Index h) const
{
  if (this->IsFeature(h))
  {
    return false;
  }
  const Index g = this->Twin[h];
  const Index a = this->From(h);
  const Index b = this->To(h);
  const Index c = this->Apex(h);
  const Index d = this->Apex(g);
  if (c == d || (this->V[c].rim && this->V[d].rim))
  {
    return false;
  }
  bool adjacent = false;
  Index degreeA = 0;
  Index degreeB = 0;
  this->AroundVertex(c, [&](Index e) { adjacent = adjacent || this->To(e) == d; });
  this->AroundVertex(a, [&](Index) { ++degreeA; });
  this->AroundVertex(b, [&](Index) { ++degreeB; });
  if (adjacent || degreeA < 4 || degreeB < 4)
  {
    return false;
  }
  const Vector3 n1 = (this->P(b) - this->P(a)).cross(this->P(c) - this->P(a));
  const Vector3 n2 = (this->P(a) - this->P(b)).cross(this->P(d) - this->P(b));
  const Vector3 normal = (n1 + n2).normalized();
  const Vector3 m1 = (this->P(d) - this->P(a)).cross(this->P(c) - this->P(a));
  const Vector3 m2 = (this->P(b) - this->P(d)).cross(this->P(c) - this->P(d));
  if (m1.dot(normal) <= 0.2 * m1.norm() || m2.dot(normal) <= 0.2 * m2.norm())
  {
    return false;
  }
  // The new edge must not cut a corner that the old one went along.
  const double old = n1.dot(n2) / std::max(1e-300, n1.norm() * n2.norm());
  const double now = m1.dot(m2) / std::max(1e-300, m1.norm() * m2.norm());
  if (now <= std::min(0.75, old - 0.1))
  {
    return false;
  }
  const Index t = h / 3;
  const double was = std::min(this->Facing(t, this->V[a], this->V[b], this->V[c]),
    this->Facing(g / 3, this->V[b], this->V[a], this->V[d]));
  const double is = std::min(this->Facing(t, this->V[a], this->V[d], this->V[c]),
    this->Facing(t, this->V[d], this->V[b], this->V[c]));
  return is >= std::min(MinimumFacing, was);
}

void AdaptiveRemesher::Flip(Index h)
{
  const Index g = this->Twin[h];
  const Index hn = Next(h);
  const Index hp = Previous(h);
  const Index gn = Next(g);
  const Index gp = Previous(g);
  const Index a = this->From(h);
  const Index b = this->To(h);
  const Index c = this->From(hp);
  const Index d = this->From(gp);
  const Index bc = this->Twin[hn];
  const Index ca = this->Twin[hp];
  const Index ad = this->Twin[gn];
  const Index db = this->Twin[gp];
  // h: d-c, c-a, a-d; g: c-d, d-b, b-c.
  this->Corner[h] = d;
  this->Corner[hn] = c;
  this->Corner[hp] = a;
  this->Corner[g] = c;
  this->Corner[gn] = d;
  this->Corner[gp] = b;
  this->Link(hn, ca);
  this->Link(hp, ad);
  this->Link(gn, db);
  this->Link(gp, bc);
  this->Out[a] = hp;
  this->Out[b] = gp;
  this->Out[c] = hn;
  this->Out[d] = gn;
}

void AdaptiveRemesher::SplitLong(double factor)
{
  const Index edges = static_cast<Index>(this->Corner.size());
  for (Index h = 0; h < edges; ++h)
  {
    if (this->Corner[h] >= 0 && h < this->Twin[h] && this->Length(h) > factor * this->Wanted(h))
    {
      this->Split(h);
    }
  }
}

void AdaptiveRemesher::CollapseShort(double factor)
{
  const Index edges = static_cast<Index>(this->Corner.size());
  for (Index h = 0; h < edges; ++h)
  {
    if (this->Corner[h] >= 0 && h < this->Twin[h] && this->Length(h) < factor * this->Wanted(h))
    {
      this->Collapse(h, false, false);
    }
  }
  this->Compact();
}

void AdaptiveRemesher::FlipToValence()
{
  std::vector<int> valence(this->V.size(), 0);
  for (const Index v : this->Corner)
  {
    ++valence[v];
  }
  const Index edges = static_cast<Index>(this->Corner.size());
  const auto square = [](int x) { return x * x; };
  for (int round = 0; round < 2; ++round)
  {
    bool changed = false;
    for (Index h = 0; h < edges; ++h)
    {
      if (h > this->Twin[h])
      {
        continue;
      }
      const Index a = this->From(h);
      const Index b = this->To(h);
      const Index c = this->Apex(h);
      const Index d = this->Apex(this->Twin[h]);
      const int gain = square(valence[a] - 6) + square(valence[b] - 6) + square(valence[c] - 6) +
        square(valence[d] - 6) - square(valence[a] - 7) - square(valence[b] - 7) -
        square(valence[c] - 5) - square(valence[d] - 5);
      if (gain <= 0 || !this->CanFlip(h))
      {
        continue;
      }
      const double before = std::min(this->Quality(a, b, c), this->Quality(b, a, d));
      const double after = std::min(this->Quality(a, d, c), this->Quality(d, b, c));
      if (after < std::min(before, -std::cos(15.0 * Degree)))
      {
        continue;
      }
      this->Flip(h);
      --valence[a];
      --valence[b];
      ++valence[c];
      ++valence[d];
      changed = true;
    }
    if (!changed)
    {
      break;
    }
  }
}

void AdaptiveRemesher::FlipToDelaunay()
{
  const Index edges = static_cast<Index>(this->Corner.size());
  const auto cotangent = [&](Index apex, Index p, Index q)
  {
    const Vector3 u = this->P(p) - this->P(apex);
    const Vector3 v = this->P(q) - this->P(apex);
    return u.dot(v) / std::max(1e-300, u.cross(v).norm());
  };
  for (int round = 0; round < 4; ++round)
  {
    bool changed = false;
    for (Index h = 0; h < edges; ++h)
    {
      if (h > this->Twin[h])
      {
        continue;
      }
      const Index a = this->From(h);
      const Index b = this->To(h);
      const Index c = this->Apex(h);
      const Index d = this->Apex(this->Twin[h]);
      if (cotangent(c, a, b) + cotangent(d, a, b) > -1e-3 || !this->CanFlip(h))
      {
        continue;
      }
      if (std::min(this->Quality(a, d, c), this->Quality(d, b, c)) <=
        std::min(this->Quality(a, b, c), this->Quality(b, a, d)))
      {
        continue;
      }
      this->Flip(h);
      changed = true;
    }
    if (!changed)
    {
      break;
    }
  }
}

/// Mean of the surrounding triangles' centres, each by its area in units of the wanted size.
Vector3 AdaptiveRemesher::SmoothTarget(Index v) const
{
  const RemeshVertex& vertex = this->V[v];
  Vector3 sum = Vector3::Zero();
  double weights = 0.0;
  if (vertex.rim)
  {
    this->AroundVertex(v,
      [&](Index e)
      {
        if (this->IsFeature(e))
        {
          const Vector3& q = this->P(this->To(e));
          const double weight = (q - vertex.position).norm() / std::max(1e-12, this->Wanted(e));
          sum += weight * q;
          weights += weight;
        }
      });
  }
  else
  {
    this->AroundVertex(v,
      [&](Index e)
      {
        const Index a = this->To(e);
        const Index b = this->Apex(e);
        const double area =
          (this->P(a) - vertex.position).cross(this->P(b) - vertex.position).norm();
        const double size = (vertex.size + this->V[a].size + this->V[b].size) / 3.0;
        const double weight = area / (size * size * size * size);
        sum += weight / 3.0 * (vertex.position + this->P(a) + this->P(b));
        weights += weight;
      });
  }
  if (weights <= 0.0)
  {
    return vertex.position;
  }
  Vector3 move = sum / weights - vertex.position;
  if (!vertex.rim)
  {
    move -= move.dot(vertex.normal) * vertex.normal;
  }
  return vertex.position + move;
}

/// Cosine between a triangle's normal and the surface's at its corners.
double AdaptiveRemesher::Facing(
  Index t, const RemeshVertex& a, const RemeshVertex& b, const RemeshVertex& c) const
{
  const Vector3 normal = (b.position - a.position).cross(c.position - a.position);
  Vector3 expected = Vector3::Zero();
  if (this->Entity[t] == 1)
  {
    expected = a.normal + b.normal + c.normal;
  }
  else
  {
    // The rim has the curved side's normals; the patch is flat, and its triangles agree.
    for (const RemeshVertex* v : { &a, &b, &c })
    {
      expected += v->rim ? Vector3(Vector3::Zero()) : v->normal;
    }
    if (expected.squaredNorm() < 0.5)
    {
      return 1.0;
    }
  }
  return normal.dot(expected) / std::max(1e-300, normal.norm() * expected.norm());
}

/// Do the triangles around a vertex face outwards, or at least no less than before?
bool AdaptiveRemesher::KeepsFacing(Index v, const RemeshVertex& moved) const
{
  bool keeps = true;
  this->AroundVertex(v,
    [&](Index e)
    {
      if (keeps)
      {
        const RemeshVertex& p = this->V[this->To(e)];
        const RemeshVertex& q = this->V[this->Apex(e)];
        const double now = this->Facing(e / 3, moved, p, q);
        keeps = now >= MinimumFacing || now >= this->Facing(e / 3, this->V[v], p, q);
      }
    });
  return keeps;
}

double AdaptiveRemesher::WorstAround(Index v, const Vector3& position) const
{
  double worst = 1.0;
  this->AroundVertex(v,
    [&](Index e)
    {
      worst = std::min(
        worst, -this->MinimumCosine(position, this->P(this->To(e)), this->P(this->Apex(e))));
    });
  return worst;
}

void AdaptiveRemesher::Smooth(double step)
{
  std::vector<RemeshVertex> next(this->V);
  ParallelFor(static_cast<std::int64_t>(this->V.size()), 512,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        const Index v = static_cast<Index>(i);
        if (this->Out[v] < 0)
        {
          continue;
        }
        RemeshVertex moved = this->V[v];
        const Vector3 target = this->SmoothTarget(v);
        Vector3 move = (moved.rim ? 0.7 * step : step) * (target - moved.position);
        const double length = move.norm();
        if (length > 0.35 * moved.size)
        {
          move *= 0.35 * moved.size / length;
        }
        moved.position += move;
        this->Surface.Project(moved);
        const double limit = 0.5 * this->V[v].size;
        if ((moved.position - this->V[v].position).squaredNorm() > limit * limit)
        {
          continue; // it fell onto another side
        }
        const double before = this->WorstAround(v, this->V[v].position);
        const double after = this->WorstAround(v, moved.position);
        if (after < before && after > -2.0 && after < -0.0 && -after > std::cos(20.0 * Degree))
        {
          continue;
        }
        if (this->KeepsFacing(v, moved))
        {
          moved.size = std::min(moved.size, 1.1 * this->V[v].size);
          next[v] = moved;
        }
      }
    });
  this->V.swap(next);
}

/// Tries places around a vertex for one that raises the smallest angle beside it.
bool AdaptiveRemesher::Relocate(Index v)
{
  const RemeshVertex original = this->V[v];
  double best = this->WorstAround(v, original.position);
  RemeshVertex bestVertex = original;
  double reach = 0.25 * original.size;
  bool improved = false;
  const Vector3 u = original.normal.unitOrthogonal();
  const Vector3 w = original.normal.cross(u);
  const auto attempt = [&](const Vector3& position)
  {
    RemeshVertex moved = original;
    moved.position = position;
    this->Surface.Project(moved);
    const double worst = this->WorstAround(v, moved.position);
    if (worst <= best + 1e-6 || (moved.position - original.position).norm() > 0.6 * original.size)
    {
      return;
    }
    if (this->KeepsFacing(v, moved))
    {
      best = worst;
      bestVertex = moved;
      improved = true;
    }
  };
  attempt(this->SmoothTarget(v));
  for (int round = 0; round < 4; ++round)
  {
    const Vector3 centre = bestVertex.position;
    for (int k = 0; k < 6; ++k)
    {
      const double angle = 60.0 * Degree * (k + 0.5 * (round % 2));
      attempt(centre + reach * (std::cos(angle) * u + std::sin(angle) * w));
    }
    reach *= 0.5;
  }
  if (improved)
  {
    const double size = original.size;
    this->V[v] = bestVertex;
    this->V[v].size = std::min(bestVertex.size, 1.05 * size);
  }
  return improved;
}

/**
 * Triangles that lie across a fold: flat in themselves, but turned over. Edges are flipped and
 * collapsed and vertices moved to their neighbours' mean until all face outwards.
 */
void AdaptiveRemesher::Unfold(int rounds)
{
  for (int round = 0; round < rounds; ++round)
  {
    std::vector<Index> turned;
    for (Index t = 0; t < static_cast<Index>(this->Corner.size() / 3); ++t)
    {
      if (this->FacingOf(t) < 0.3)
      {
        turned.push_back(t);
      }
    }
    if (turned.empty())
    {
      break;
    }
    for (const Index t : turned)
    {
      if (this->Dead(t) || this->FacingOf(t) >= 0.3)
      {
        continue;
      }
      const std::array<Index, 3> order = this->LongestFirst(t);
      bool done = false;
      for (int k = 0; k < 3 && !done; ++k)
      {
        done = this->Collapse(order[2 - k], true, true);
      }
      if (!done)
      {
        for (int k = 0; k < 3; ++k)
        {
          const Index v = this->Corner[3 * t + k];
          if (this->V[v].rim)
          {
            continue;
          }
          RemeshVertex moved = this->V[v];
          Vector3 sum = Vector3::Zero();
          int count = 0;
          this->AroundVertex(v,
            [&](Index e)
            {
              sum += this->P(this->To(e));
              ++count;
            });
          moved.position = sum / count;
          this->Surface.Project(moved);
          moved.size = std::min(moved.size, 1.1 * this->V[v].size);
          this->V[v] = moved;
        }
      }
    }
    this->Compact();
  }
}

std::array<AdaptiveRemesher::Index, 3> AdaptiveRemesher::LongestFirst(Index t) const
{
  std::array<Index, 3> order{ 3 * t, 3 * t + 1, 3 * t + 2 };
  const auto put = [&](int i, int j)
  {
    if (this->Length(order[j]) > this->Length(order[i]))
    {
      std::swap(order[i], order[j]);
    }
  };
  put(0, 1);
  put(0, 2);
  put(1, 2);
  return order;
}

double AdaptiveRemesher::FacingOf(Index t) const
{
  return this->Facing(t, this->V[this->Corner[3 * t]], this->V[this->Corner[3 * t + 1]],
    this->V[this->Corner[3 * t + 2]]);
}

/// Triangles with an angle below `angle` degrees, one by one.
void AdaptiveRemesher::Mend(double angle, int rounds)
{
  const double limit = -std::cos(angle * Degree);
  for (int round = 0; round < rounds; ++round)
  {
    std::vector<std::pair<double, Index>> poor;
    for (Index t = 0; t < static_cast<Index>(this->Corner.size() / 3); ++t)
    {
      if (!this->Dead(t) && this->TriangleQuality(t) < limit)
      {
        poor.emplace_back(this->TriangleQuality(t), t);
      }
    }
    if (poor.empty())
    {
      break;
    }
    std::sort(poor.begin(), poor.end());
    bool changed = false;
    for (const auto& entry : poor)
    {
      const Index t = entry.second;
      if (this->Dead(t) || this->TriangleQuality(t) >= limit)
      {
        continue;
      }
      // The longest edge first.
      const std::array<Index, 3> order = this->LongestFirst(t);
      bool done = false;
      for (int k = 0; k < 2 && !done; ++k)
      {
        const Index h = order[k];
        const Index a = this->From(h);
        const Index b = this->To(h);
        const Index c = this->Apex(h);
        const Index d = this->Apex(this->Twin[h]);
        const double before = std::min(this->Quality(a, b, c), this->Quality(b, a, d));
        const double after = std::min(this->Quality(a, d, c), this->Quality(d, b, c));
        if (after > before + 1e-6 && this->CanFlip(h))
        {
          this->Flip(h);
          done = true;
        }
      }
      if (!done)
      {
        for (int k = 0; k < 3; ++k)
        {
          done = this->Relocate(this->Corner[3 * t + k]) || done;
        }
        done = done && this->TriangleQuality(t) >= limit;
      }
      // What is still a needle or a cap late on is worth an edge of the wrong length.
      const bool bad = round > 2 && this->TriangleQuality(t) < -std::cos(HardAngle * Degree);
      if (!done && (bad || this->Length(order[2]) < 0.85 * this->Wanted(order[2])))
      {
        done = this->Collapse(order[2], true, false);
      }
      if (!done && bad)
      {
        done = this->Collapse(order[1], true, false) || this->Collapse(order[0], true, false);
      }
      if (!done && round > 1 && !this->IsFeature(order[0]) &&
        (bad || this->Length(order[0]) > 1.15 * this->Wanted(order[0])))
      {
        const Index m = this->Split(order[0]);
        if (m >= 0)
        {
          this->Relocate(m);
          if (bad)
          {
            this->FlipAround(m);
            this->Relocate(m);
          }
          done = true;
        }
      }
      changed = changed || done;
    }
    this->Compact();
    this->FlipToDelaunay();
    if (!changed)
    {
      // Shake the surroundings loose once more.
      for (const auto& entry : poor)
      {
        const Index t = entry.second;
        if (t < static_cast<Index>(this->Corner.size() / 3))
        {
          for (int k = 0; k < 3; ++k)
          {
            this->AroundVertex(
              this->Corner[3 * t + k], [&](Index e) { this->Relocate(this->To(e)); });
          }
        }
      }
    }
  }
}

/// Flips the edges around a vertex, and those across from it, where that raises the angles.
void AdaptiveRemesher::FlipAround(Index v)
{
  std::vector<Index> edges;
  this->AroundVertex(v,
    [&](Index e)
    {
      edges.push_back(e);
      edges.push_back(Next(e));
    });
  for (const Index h : edges)
  {
    const Index a = this->From(h);
    const Index b = this->To(h);
    const Index c = this->Apex(h);
    const Index d = this->Apex(this->Twin[h]);
    const double before = std::min(this->Quality(a, b, c), this->Quality(b, a, d));
    const double after = std::min(this->Quality(a, d, c), this->Quality(d, b, c));
    if (after > before + 1e-6 && this->CanFlip(h))
    {
      this->Flip(h);
    }
  }
}

void AdaptiveRemesher::Repair(const std::vector<std::int64_t>& triangles)
{
  // Two rings around the places are shaken loose: to their neighbours' mean and back.
  std::vector<char> near(this->V.size(), 0);
  for (const std::int64_t t : triangles)
  {
    for (int k = 0; k < 3; ++k)
    {
      near[this->Corner[3 * t + k]] = 1;
    }
  }
  for (char ring = 1; ring <= 2; ++ring)
  {
    for (std::size_t h = 0; h < this->Corner.size(); ++h)
    {
      const Index i = static_cast<Index>(h);
      if (near[this->From(i)] == ring && near[this->To(i)] == 0)
      {
        near[this->To(i)] = static_cast<char>(ring + 1);
      }
    }
  }
  for (int sweep = 0; sweep < 4; ++sweep)
  {
    for (std::size_t v = 0; v < this->V.size(); ++v)
    {
      if (near[v] == 0 || this->V[v].rim)
      {
        continue;
      }
      RemeshVertex moved = this->V[v];
      Vector3 sum = Vector3::Zero();
      int count = 0;
      this->AroundVertex(static_cast<Index>(v),
        [&](Index e)
        {
          sum += this->P(this->To(e));
          ++count;
        });
      moved.position = sum / count;
      this->Surface.Project(moved);
      moved.size = std::min(moved.size, 1.1 * this->V[v].size);
      this->V[v] = moved;
    }
    this->FlipToDelaunay();
  }
  this->Unfold(6);
  this->Mend(28.0, 6);
  this->Grade();
}

void AdaptiveRemesher::Compact()
{
  const Index triangles = static_cast<Index>(this->Corner.size() / 3);
  std::vector<Index> number(triangles, -1);
  Index count = 0;
  for (Index t = 0; t < triangles; ++t)
  {
    if (!this->Dead(t))
    {
      number[t] = count++;
    }
  }
  std::vector<Index> vertexNumber(this->V.size(), -1);
  Index vertices = 0;
  for (std::size_t v = 0; v < this->V.size(); ++v)
  {
    if (this->Out[v] >= 0)
    {
      vertexNumber[v] = vertices++;
    }
  }
  if (count == triangles && vertices == static_cast<Index>(this->V.size()))
  {
    return;
  }
  for (Index t = 0; t < triangles; ++t)
  {
    if (number[t] < 0)
    {
      continue;
    }
    for (int k = 0; k < 3; ++k)
    {
      const Index twin = this->Twin[3 * t + k];
      this->Corner[3 * number[t] + k] = vertexNumber[this->Corner[3 * t + k]];
      this->Twin[3 * number[t] + k] = 3 * number[twin / 3] + twin % 3;
    }
    this->Entity[number[t]] = this->Entity[t];
  }
  for (std::size_t v = 0; v < this->V.size(); ++v)
  {
    if (vertexNumber[v] >= 0)
    {
      const Index out = this->Out[v];
      this->V[vertexNumber[v]] = this->V[v];
      this->Out[vertexNumber[v]] = 3 * number[out / 3] + out % 3;
    }
  }
  this->Corner.resize(3 * count);
  this->Twin.resize(3 * count);
  this->Entity.resize(count);
  this->V.resize(vertices);
  this->Out.resize(vertices);
}

void AdaptiveRemesher::Run(const ProgressCallback& progress)
{
  constexpr int rounds = 8;
  for (int round = 0; round < rounds; ++round)
  {
    this->Surface.Begin(static_cast<double>(round) / rounds);
    this->ProjectAll();
    this->Grade();
    this->SplitLong(1.36);
    this->CollapseShort(0.74);
    this->FlipToValence();
    this->Smooth(0.9);
    this->FlipToDelaunay();
    this->Smooth(0.9);
    this->Unfold(3);
    Report(progress, 0.75 * (round + 1) / rounds);
  }
  this->Surface.Begin(1.0);
  this->ProjectAll();
  this->Grade();
  for (int round = 0; round < 4; ++round)
  {
    this->FlipToDelaunay();
    this->Smooth(1.0);
    Report(progress, 0.75 + 0.15 * (round + 1) / 4);
  }
  this->FlipToDelaunay();
  this->Grade();
  this->Unfold(6);
  this->Mend(28.0, 8);
  this->ProjectAll();
  this->Grade();
  Report(progress, 1.0);
}
}
