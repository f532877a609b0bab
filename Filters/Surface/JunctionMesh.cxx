#include "JunctionMesh.h"

#include "ParallelFor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>
#include <unordered_map>

namespace coronary
{
namespace
{
using Key = std::uint64_t;

/// Grids of more nodes are not tried.
constexpr std::int64_t MostNodes = 100'000'000;
/// Nor, when so many coarser grids gave nothing, of more than these: what three do not resolve is
/// rarely resolved by the others, and they cost most of the time.
constexpr int CheapAttempts = 3;
constexpr std::int64_t MostNodesLater = 600'000;

/// One attempt with one grid.
class Attempt
{
public:
  Attempt(const SweptLumen& lumen, int junction, double cell, double shift, std::int64_t mostNodes)
    : Lumen(lumen)
    , J(lumen.Junctions()[junction])
    , Number(junction)
    , Cell(cell)
    , Shift(shift)
    , Most(mostNodes)
  {
  }

  bool Run()
  {
    if (!this->Sample())
    {
      return false;
    }
    this->March();
    this->PutOnWall();
    this->Cut();
    return this->FindLoops();
  }

  JunctionMesh mesh;

private:
  /// Arc length beyond the cut of the arm on which the sample lies; far below 0 for none.
  double Beyond(const SweptLumen::Sample& sample, int& arm) const
  {
    double most = -1e9;
    for (std::size_t i = 0; i < this->J.arms.size(); ++i)
    {
      const SweptLumen::Arm& a = this->J.arms[i];
      const SweptLumen::Span& span = this->Lumen.Spans()[a.span];
      if (span.vessel != sample.vessel)
      {
        continue;
      }
      const double beyond = a.atStart ? sample.s - a.cut : a.cut - sample.s;
      if (beyond > most)
      {
        most = beyond;
        arm = static_cast<int>(i);
      }
    }
    return most;
  }

  double Value(const Vector3& x) const
  {
    SweptLumen::Sample sample;
    this->Lumen.EvaluateJunctionAt(x, this->Number, sample);
    int arm = -1;
    double value = std::max(sample.distance, this->Beyond(sample, arm) - 2.5 * this->Cell);
    if (std::abs(value) < 1e-9)
    {
      value = 1e-9;
    }
    return value;
  }

  std::int64_t Node(int i, int j, int k) const
  {
    return i +
      static_cast<std::int64_t>(this->Size[0]) * (j + static_cast<std::int64_t>(this->Size[1]) * k);
  }

  Vector3 At(int i, int j, int k) const { return this->Low + this->Cell * Vector3(i, j, k); }

  /// @return false when the grid would be too large
  bool Sample()
  {
    Vector3 low = Vector3::Constant(1e300);
    Vector3 high = Vector3::Constant(-1e300);
    for (const SweptLumen::Range& range : this->J.ranges)
    {
      const VesselAxis& axis = *this->Lumen.Vessels()[range.vessel].axis;
      for (int i = range.firstPiece; i <= range.lastPiece + 1; ++i)
      {
        const VesselAxis::Station& station = axis.AllStations()[i];
        double r = station.radius;
        if (!axis.IsRound())
        {
          for (int a = 0; a < 16; ++a)
          {
            r = std::max(r, axis.WallRadius(station.s, a * 0.39269908169872414));
          }
        }
        low = low.cwiseMin(Vector3(station.point.array() - r));
        high = high.cwiseMax(Vector3(station.point.array() + r));
      }
    }
    this->Low = low.array() - (3.0 + this->Shift) * this->Cell;
    for (int a = 0; a < 3; ++a)
    {
      this->Size[a] = static_cast<int>(std::ceil((high[a] - this->Low[a]) / this->Cell)) + 4;
    }
    const std::int64_t nodes =
      static_cast<std::int64_t>(this->Size[0]) * this->Size[1] * this->Size[2];
    if (nodes > this->Most)
    {
      return false;
    }
    constexpr float unknown = 1e30F;
    constexpr float wanted = 2e30F;
    this->Values.assign(nodes, unknown);
    // Blocks of cells; those that the wall cannot reach are not looked into.
    constexpr int block = 4;
    const std::array<int, 3> blocks{ (this->Size[0] + block - 2) / block,
      (this->Size[1] + block - 2) / block, (this->Size[2] + block - 2) / block };
    std::vector<char> reached(static_cast<std::size_t>(blocks[0]) * blocks[1] * blocks[2]);
    const auto cornerOf = [&](std::int64_t n)
    {
      return std::array<int, 3>{ static_cast<int>(n % blocks[0]) * block,
        static_cast<int>(n / blocks[0] % blocks[1]) * block,
        static_cast<int>(n / blocks[0] / blocks[1]) * block };
    };
    ParallelFor(static_cast<std::int64_t>(reached.size()), 256,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          const std::array<int, 3> at = cornerOf(n);
          const Vector3 centre =
            this->At(at[0], at[1], at[2]) + Vector3::Constant(0.5 * block * this->Cell);
          const double reach = 1.35 * 0.5 * block * this->Cell * std::sqrt(3.0);
          reached[n] = std::abs(this->Value(centre)) > reach ? 0 : 1;
        }
      });
    std::vector<std::array<int, 3>> known; // nodes of these, each once
    for (std::size_t n = 0; n < reached.size(); ++n)
    {
      if (reached[n] == 0)
      {
        continue;
      }
      const auto [i, j, k] = cornerOf(static_cast<std::int64_t>(n));
      const int top[3] = { std::min(i + block, this->Size[0] - 1),
        std::min(j + block, this->Size[1] - 1), std::min(k + block, this->Size[2] - 1) };
      for (int c = k; c <= top[2]; ++c)
      {
        for (int b = j; b <= top[1]; ++b)
        {
          for (int a = i; a <= top[0]; ++a)
          {
            float& value = this->Values[this->Node(a, b, c)];
            if (value == unknown)
            {
              value = wanted;
              known.push_back({ a, b, c });
            }
            if (a < top[0] && b < top[1] && c < top[2])
            {
              this->Cells.push_back({ a, b, c });
            }
          }
        }
      }
    }
    ParallelFor(static_cast<std::int64_t>(known.size()), 1024,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          const auto [a, b, c] = known[n];
          this->Values[this->Node(a, b, c)] = static_cast<float>(this->Value(this->At(a, b, c)));
        }
      });
    return true;
  }

  std::int64_t EdgePoint(const std::array<int, 3>& p, const std::array<int, 3>& q)
  {
    // The lower end and the direction name the edge.
    const bool swap = q[0] < p[0] || q[1] < p[1] || q[2] < p[2];
    const auto& low = swap ? q : p;
    const auto& high = swap ? p : q;
    const int way = (high[0] - low[0]) + 2 * (high[1] - low[1]) + 4 * (high[2] - low[2]);
    const auto code = static_cast<Key>(way);
    const Key key = static_cast<Key>(this->Node(low[0], low[1], low[2])) * 8 + code;
    const auto found = this->Edges.find(key);
    if (found != this->Edges.end())
    {
      return found->second;
    }
    const double a = this->Values[this->Node(low[0], low[1], low[2])];
    const double b = this->Values[this->Node(high[0], high[1], high[2])];
    const double t = std::clamp(a / (a - b), 0.1, 0.9);
    const std::int64_t number = static_cast<std::int64_t>(this->mesh.points.size());
    this->mesh.points.push_back(
      (1.0 - t) * this->At(low[0], low[1], low[2]) + t * this->At(high[0], high[1], high[2]));
    this->Edges.emplace(key, number);
    return number;
  }

  /// Six tetrahedra around each cell's diagonal (Kuhn's subdivision).
  void March()
  {
    constexpr int order[6][3] = { { 0, 1, 2 }, { 1, 2, 0 }, { 2, 0, 1 }, { 0, 2, 1 }, { 2, 1, 0 },
      { 1, 0, 2 } };
    for (const std::array<int, 3>& cell : this->Cells)
    {
      for (int o = 0; o < 6; ++o)
      {
        std::array<int, 3> corner[4];
        corner[0] = cell;
        for (int c = 0; c < 3; ++c)
        {
          corner[c + 1] = corner[c];
          ++corner[c + 1][order[o][c]];
        }
        if (o >= 3)
        {
          std::swap(corner[2], corner[3]); // odd: make it right-handed
        }
        int inside[4];
        int outside[4];
        int in = 0;
        int out = 0;
        for (int c = 0; c < 4; ++c)
        {
          const double value = this->Values[this->Node(corner[c][0], corner[c][1], corner[c][2])];
          if (value < 0.0)
          {
            inside[in++] = c;
          }
          else
          {
            outside[out++] = c;
          }
        }
        const auto edge = [&](int p, int q) { return this->EdgePoint(corner[p], corner[q]); };
        // The three others of a corner so that (corner, a, b, c) is right-handed.
        constexpr int others[4][3] = { { 1, 2, 3 }, { 0, 3, 2 }, { 0, 1, 3 }, { 0, 2, 1 } };
        if (in == 1)
        {
          const int* n = others[inside[0]];
          this->Add(edge(inside[0], n[0]), edge(inside[0], n[1]), edge(inside[0], n[2]));
        }
        else if (out == 1)
        {
          const int* n = others[outside[0]];
          this->Add(edge(outside[0], n[0]), edge(outside[0], n[2]), edge(outside[0], n[1]));
        }
        else if (in == 2)
        {
          const int i = inside[0];
          const int j = inside[1];
          // (i, j, k, l) right-handed.
          const int* n = others[i];
          const int at = n[0] == j ? 0 : n[1] == j ? 1 : 2;
          const int k = n[(at + 1) % 3];
          const int l = n[(at + 2) % 3];
          const std::int64_t ik = edge(i, k);
          const std::int64_t il = edge(i, l);
          const std::int64_t jl = edge(j, l);
          const std::int64_t jk = edge(j, k);
          this->Add(ik, il, jl);
          this->Add(ik, jl, jk);
        }
      }
    }
  }

  void Add(std::int64_t a, std::int64_t b, std::int64_t c)
  {
    this->mesh.triangles.push_back({ a, b, c });
  }

  void PutOnWall()
  {
    const std::size_t n = this->mesh.points.size();
    this->Past.resize(n);
    this->Arm.assign(n, -1);
    ParallelFor(static_cast<std::int64_t>(n), 512,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t p = first; p < last; ++p)
        {
          Vector3 x = this->mesh.points[p];
          SweptLumen::Sample sample;
          for (int iteration = 0; iteration < 4; ++iteration)
          {
            this->Lumen.EvaluateJunctionAt(x, this->Number, sample);
            const double square = sample.gradient.squaredNorm();
            if (iteration == 3 || square < 1e-2 || std::abs(sample.distance) > 1.5 * this->Cell)
            {
              break;
            }
            const Vector3 move = -sample.distance / square * sample.gradient;
            x += move * std::min(1.0, 0.5 * this->Cell / std::max(1e-12, move.norm()));
          }
          int arm = -1;
          const double past = this->Beyond(sample, arm);
          // What closes the grid behind the cut is dropped anyway, and stays where it is.
          if (past < 2.0 * this->Cell)
          {
            this->mesh.points[p] = x;
          }
          this->Past[p] = past;
          this->Arm[p] = arm;
          if (std::abs(past) < 0.2 * this->Cell)
          {
            this->Past[p] = 0.0;
          }
        }
      });
  }

  std::int64_t CutPoint(std::int64_t a, std::int64_t b)
  {
    const Key key = (static_cast<Key>(std::min(a, b)) << 32) | static_cast<Key>(std::max(a, b));
    const auto found = this->Crossings.find(key);
    if (found != this->Crossings.end())
    {
      return found->second;
    }
    const double t = this->Past[a] / (this->Past[a] - this->Past[b]);
    const std::int64_t number = static_cast<std::int64_t>(this->mesh.points.size());
    this->mesh.points.push_back((1.0 - t) * this->mesh.points[a] + t * this->mesh.points[b]);
    this->Past.push_back(0.0);
    this->Arm.push_back(this->Past[a] > 0.0 ? this->Arm[a] : this->Arm[b]);
    this->Crossings.emplace(key, number);
    return number;
  }

  void Cut()
  {
    std::vector<Triangle> kept;
    const std::vector<Triangle> all = std::move(this->mesh.triangles);
    for (const Triangle& t : all)
    {
      int positive = 0;
      int negative = 0;
      for (const std::int64_t p : t)
      {
        positive += this->Past[p] > 0.0 ? 1 : 0;
        negative += this->Past[p] < 0.0 ? 1 : 0;
      }
      if (positive == 0)
      {
        kept.push_back(t);
        continue;
      }
      if (negative == 0)
      {
        continue;
      }
      // The part before the plane as a polygon, fanned from its first corner.
      std::vector<std::int64_t> polygon;
      for (int c = 0; c < 3; ++c)
      {
        const std::int64_t a = t[c];
        const std::int64_t b = t[(c + 1) % 3];
        if (this->Past[a] <= 0.0)
        {
          polygon.push_back(a);
        }
        if ((this->Past[a] < 0.0 && this->Past[b] > 0.0) ||
          (this->Past[a] > 0.0 && this->Past[b] < 0.0))
        {
          polygon.push_back(this->CutPoint(a, b));
        }
      }
      for (std::size_t i = 2; i < polygon.size(); ++i)
      {
        kept.push_back({ polygon[0], polygon[i - 1], polygon[i] });
      }
    }
    this->mesh.triangles = std::move(kept);
  }

  /// The open edges as one loop an arm; and the rest a sphere with that many holes.
  bool FindLoops()
  {
    // Only what the triangles use.
    std::vector<std::int64_t> number(this->mesh.points.size(), -1);
    std::vector<Vector3> points;
    std::vector<int> arm;
    for (Triangle& t : this->mesh.triangles)
    {
      for (std::int64_t& p : t)
      {
        if (number[p] < 0)
        {
          number[p] = static_cast<std::int64_t>(points.size());
          points.push_back(this->mesh.points[p]);
          arm.push_back(this->Arm[p]);
        }
        p = number[p];
      }
    }
    this->mesh.points = std::move(points);
    std::unordered_map<Key, std::int64_t> edges;
    edges.reserve(3 * this->mesh.triangles.size());
    const auto key = [](std::int64_t a, std::int64_t b)
    { return (static_cast<Key>(a) << 32) | static_cast<Key>(b); };
    for (const Triangle& t : this->mesh.triangles)
    {
      for (int c = 0; c < 3; ++c)
      {
        if (!edges.emplace(key(t[c], t[(c + 1) % 3]), 0).second)
        {
          return false;
        }
      }
    }
    std::unordered_map<std::int64_t, std::int64_t> next; // against the triangles' direction
    std::int64_t open = 0;
    std::vector<std::int64_t> starts;
    for (const Triangle& t : this->mesh.triangles)
    {
      for (int c = 0; c < 3; ++c)
      {
        const std::int64_t a = t[c];
        const std::int64_t b = t[(c + 1) % 3];
        if (edges.count(key(b, a)) == 0)
        {
          ++open;
          starts.push_back(b);
          if (!next.emplace(b, a).second)
          {
            return false;
          }
        }
      }
    }
    this->mesh.loops.assign(this->J.arms.size(), {});
    std::unordered_map<std::int64_t, char> done;
    std::size_t loops = 0;
    for (const std::int64_t start : starts)
    {
      if (done.count(start) != 0)
      {
        continue;
      }
      std::vector<std::int64_t> loop;
      for (std::int64_t p = start; done.count(p) == 0; p = next[p])
      {
        done[p] = 1;
        loop.push_back(p);
        if (next.count(p) == 0)
        {
          return false;
        }
      }
      const int a = arm[start];
      if (a < 0 || !this->mesh.loops[a].empty() || loop.size() < 3)
      {
        return false;
      }
      ++loops;
      // Around the tangent, in the sense of rising angles.
      const SweptLumen::Arm& of = this->J.arms[a];
      const VesselAxis::Station station =
        this->Lumen.Vessels()[this->Lumen.Spans()[of.span].vessel].axis->At(of.cut);
      double turn = 0.0;
      for (std::size_t i = 0; i < loop.size(); ++i)
      {
        const Vector3 p = this->mesh.points[loop[i]] - station.point;
        const Vector3 q = this->mesh.points[loop[(i + 1) % loop.size()]] - station.point;
        turn += p.cross(q).dot(station.tangent);
      }
      if (turn < 0.0)
      {
        std::reverse(loop.begin(), loop.end());
      }
      this->mesh.loops[a] = loop;
    }
    const std::int64_t v = static_cast<std::int64_t>(this->mesh.points.size());
    const std::int64_t f = static_cast<std::int64_t>(this->mesh.triangles.size());
    const std::int64_t e = (3 * f + open) / 2;
    return loops == this->J.arms.size() && v - e + f == 2 - static_cast<std::int64_t>(loops);
  }

  const SweptLumen& Lumen;
  const SweptLumen::Junction& J;
  int Number;
  double Cell;
  double Shift;
  std::int64_t Most; ///< nodes of the grid
  Vector3 Low = Vector3::Zero();
  std::array<int, 3> Size{ 0, 0, 0 };
  std::vector<float> Values;
  std::vector<std::array<int, 3>> Cells;
  std::unordered_map<Key, std::int64_t> Edges;
  std::unordered_map<Key, std::int64_t> Crossings;
  std::vector<double> Past;
  std::vector<int> Arm;
};
}

JunctionMesh MeshJunction(const SweptLumen& lumen, int junction)
{
  const SweptLumen::Junction& j = lumen.Junctions()[junction];
  double cell = 0.2 * j.minimumRadius;
  for (int attempt = 0; attempt < 6; ++attempt)
  {
    Attempt run(
      lumen, junction, cell, 0.31 * attempt, attempt < CheapAttempts ? MostNodes : MostNodesLater);
    if (run.Run())
    {
      return std::move(run.mesh);
    }
    cell *= 0.8;
  }
  std::ostringstream text;
  text.precision(6);
  text << "SweepVesselTree: the wall cannot be resolved where vessels join at (" << j.centre[0]
       << ", " << j.centre[1] << ", " << j.centre[2] << "), groups";
  for (const SweptLumen::Arm& arm : j.arms)
  {
    text << " " << lumen.GroupAt(lumen.Spans()[arm.span].vessel, arm.cut);
  }
  JunctionFailure failure(text.str());
  failure.centre = j.centre;
  for (const SweptLumen::Arm& arm : j.arms)
  {
    failure.groups.push_back(lumen.GroupAt(lumen.Spans()[arm.span].vessel, arm.cut));
  }
  for (const SweptLumen::Range& range : j.ranges)
  {
    const VesselAxis& axis = *lumen.Vessels()[range.vessel].axis;
    for (const double s : { range.low, range.high })
    {
      failure.reach = std::max(failure.reach, (axis.At(s).point - j.centre).norm());
    }
  }
  // The thinnest branch that ends after the junction.
  double thinnest = std::numeric_limits<double>::max();
  for (const SweptLumen::Arm& arm : j.arms)
  {
    const SweptLumen::Span& span = lumen.Spans()[arm.span];
    const int tip = arm.atStart ? span.endTip : span.startTip;
    if (tip < 0 || lumen.Tips()[tip].inlet)
    {
      continue;
    }
    const double radius = lumen.Vessels()[span.vessel].axis->At(arm.cut).radius;
    if (radius < thinnest)
    {
      thinnest = radius;
      failure.thinnestEnd = lumen.Tips()[tip].point;
    }
  }
  throw failure;
}
}
