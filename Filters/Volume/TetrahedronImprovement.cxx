#include "TetrahedronImprovement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace coronary
{
namespace
{
constexpr double gain = 1e-5; // a change must be worth it, or passes would not end

class Improver
{
public:
  Improver(std::vector<Vector3>& points, std::vector<Tetrahedron>& tetrahedra,
    std::vector<char>& fixed, const std::vector<std::pair<std::int64_t, std::int64_t>>& edges,
    const ImprovementSettings& settings)
    : Points(points)
    , Cells(tetrahedra)
    , Fixed(fixed)
    , Settings(settings)
    , Alive(tetrahedra.size(), 1)
    , Around(points.size())
    , Kept(points.size())
  {
    for (std::size_t i = 0; i < tetrahedra.size(); ++i)
    {
      for (const std::int64_t point : tetrahedra[i])
      {
        this->Around[point].push_back(static_cast<std::int64_t>(i));
      }
    }
    for (const auto& [a, b] : edges)
    {
      this->Kept[a].push_back(b);
      this->Kept[b].push_back(a);
    }
  }

  ImprovementCounts Run(const ProgressCallback& progress)
  {
    for (int pass = 0; pass < this->Settings.passes; ++pass)
    {
      std::vector<std::pair<double, std::int64_t>> bad;
      for (std::size_t i = 0; i < this->Cells.size(); ++i)
      {
        if (this->Alive[i] != 0)
        {
          const double quality = this->Quality(this->Cells[i]);
          if (quality < this->Settings.wantedSine)
          {
            bad.emplace_back(quality, static_cast<std::int64_t>(i));
          }
        }
      }
      std::sort(bad.begin(), bad.end());
      std::int64_t changes = 0;
      for (std::size_t i = 0; i < bad.size(); ++i)
      {
        if (i % 256 == 0)
        {
          Report(progress,
            (pass + static_cast<double>(i) / static_cast<double>(bad.size())) /
              this->Settings.passes);
        }
        // What is worked on may have been replaced by something good.
        if (this->Alive[bad[i].second] != 0 &&
          this->Quality(this->Cells[bad[i].second]) < this->Settings.wantedSine &&
          this->Treat(bad[i].second, pass))
        {
          ++changes;
        }
      }
      if (changes == 0)
      {
        break;
      }
    }
    std::size_t kept = 0;
    for (std::size_t i = 0; i < this->Cells.size(); ++i)
    {
      if (this->Alive[i] != 0)
      {
        this->Cells[kept++] = this->Cells[i];
      }
    }
    this->Cells.resize(kept);
    return this->Counts;
  }

private:
  using Ids = std::vector<std::int64_t>;

  double Quality(std::int64_t a, std::int64_t b, std::int64_t c, std::int64_t d) const
  {
    const double sine =
      MinimumDihedralSine(this->Points[a], this->Points[b], this->Points[c], this->Points[d]);
    if (this->Settings.minimumVolume > 0.0 && sine > 0.0)
    {
      const double volume =
        TetrahedronVolume(this->Points[a], this->Points[b], this->Points[c], this->Points[d]);
      return sine * std::min(1.0, volume / (2.0 * this->Settings.minimumVolume));
    }
    return sine;
  }

  double Quality(const Tetrahedron& t) const { return this->Quality(t[0], t[1], t[2], t[3]); }

  double Worst(const Ids& cells) const
  {
    double worst = 1.0;
    for (const std::int64_t cell : cells)
    {
      worst = std::min(worst, this->Quality(this->Cells[cell]));
    }
    return worst;
  }

  static bool Has(const Tetrahedron& t, std::int64_t point)
  {
    return t[0] == point || t[1] == point || t[2] == point || t[3] == point;
  }

  bool IsKept(std::int64_t a, std::int64_t b) const
  {
    const Ids& others = this->Kept[a];
    return std::find(others.begin(), others.end(), b) != others.end();
  }

  void Remove(std::int64_t cell)
  {
    this->Alive[cell] = 0;
    for (const std::int64_t point : this->Cells[cell])
    {
      Ids& cells = this->Around[point];
      cells.erase(std::find(cells.begin(), cells.end(), cell));
    }
  }

  void Add(const Tetrahedron& t)
  {
    const auto cell = static_cast<std::int64_t>(this->Cells.size());
    this->Cells.push_back(t);
    this->Alive.push_back(1);
    for (const std::int64_t point : t)
    {
      this->Around[point].push_back(cell);
    }
  }

  void Replace(const Ids& old, const std::vector<Tetrahedron>& fresh)
  {
    for (const std::int64_t cell : Ids(old))
    {
      this->Remove(cell);
    }
    for (const Tetrahedron& t : fresh)
    {
      this->Add(t);
    }
  }

  /// The same tetrahedron, written with a and b in front.
  static Tetrahedron FromEdge(const Tetrahedron& t, std::int64_t a, std::int64_t b)
  {
    static constexpr int even[12][4] = { { 0, 1, 2, 3 }, { 0, 2, 3, 1 }, { 0, 3, 1, 2 },
      { 1, 0, 3, 2 }, { 1, 2, 0, 3 }, { 1, 3, 2, 0 }, { 2, 0, 1, 3 }, { 2, 1, 3, 0 },
      { 2, 3, 0, 1 }, { 3, 0, 2, 1 }, { 3, 1, 0, 2 }, { 3, 2, 1, 0 } };
    for (const auto& order : even)
    {
      if (t[order[0]] == a && t[order[1]] == b)
      {
        return { t[order[0]], t[order[1]], t[order[2]], t[order[3]] };
      }
    }
    return t;
  }

  std::int64_t Across(std::int64_t cell, std::int64_t a, std::int64_t b, std::int64_t c) const
  {
    for (const std::int64_t other : this->Around[a])
    {
      if (other != cell && Has(this->Cells[other], b) && Has(this->Cells[other], c))
      {
        return other;
      }
    }
    return -1;
  }

  bool Treat(std::int64_t cell, int pass)
  {
    const Tetrahedron t = this->Cells[cell];
    for (int i = 0; i < 4; ++i)
    {
      for (int j = i + 1; j < 4; ++j)
      {
        if (this->RemoveEdge(t[i], t[j]))
        {
          return true;
        }
      }
    }
    for (int i = 0; i < 4; ++i)
    {
      if (this->FlipFace(cell, i))
      {
        return true;
      }
    }
    bool moved = false;
    for (const std::int64_t point : t)
    {
      moved = this->Move(point) || moved;
    }
    if (moved)
    {
      return true;
    }
    for (const std::int64_t point : t)
    {
      if (this->Fixed[point] == 0)
      {
        for (const std::int64_t target : t)
        {
          if (target != point && this->Contract(point, target))
          {
            return true;
          }
        }
      }
    }
    return pass > 0 && this->Insert(cell);
  }

  bool RemoveEdge(std::int64_t a, std::int64_t b)
  {
    constexpr std::size_t maximumRing = 10;
    if (this->IsKept(a, b))
    {
      return false;
    }
    Ids cells;
    std::vector<std::pair<std::int64_t, std::int64_t>> sides;
    for (const std::int64_t cell : this->Around[a])
    {
      if (Has(this->Cells[cell], b))
      {
        const Tetrahedron t = FromEdge(this->Cells[cell], a, b);
        cells.push_back(cell);
        sides.emplace_back(t[2], t[3]);
      }
    }
    const std::size_t n = cells.size();
    if (n < 3 || n > maximumRing)
    {
      return false;
    }
    Ids ring{ sides[0].first };
    std::int64_t next = sides[0].second;
    while (ring.size() < n && next != ring[0])
    {
      ring.push_back(next);
      const auto side =
        std::find_if(sides.begin(), sides.end(), [next](const auto& s) { return s.first == next; });
      if (side == sides.end())
      {
        return false; // an edge of the boundary
      }
      next = side->second;
    }
    if (ring.size() != n || next != ring[0])
    {
      return false;
    }
    const double worst = this->Worst(cells);
    std::array<std::array<double, maximumRing>, maximumRing> best{};
    std::array<std::array<std::size_t, maximumRing>, maximumRing> choice{};
    for (std::size_t length = 1; length < n; ++length)
    {
      for (std::size_t i = 0; i + length < n; ++i)
      {
        const std::size_t j = i + length;
        best[i][j] = length == 1 ? 1.0 : -1.0;
        for (std::size_t k = i + 1; k < j; ++k)
        {
          double value = std::min(best[i][k], best[k][j]);
          if (value > std::max(best[i][j], worst))
          {
            value = std::min(value, this->Quality(ring[i], ring[k], ring[j], b));
            value = std::min(value, this->Quality(ring[i], ring[j], ring[k], a));
            if (value > best[i][j])
            {
              best[i][j] = value;
              choice[i][j] = k;
            }
          }
        }
      }
    }
    if (!(best[0][n - 1] > worst + gain))
    {
      return false;
    }
    std::vector<Tetrahedron> fresh;
    std::vector<std::pair<std::size_t, std::size_t>> parts{ { 0, n - 1 } };
    while (!parts.empty())
    {
      const auto [i, j] = parts.back();
      parts.pop_back();
      if (j - i < 2)
      {
        continue;
      }
      const std::size_t k = choice[i][j];
      fresh.push_back({ ring[i], ring[k], ring[j], b });
      fresh.push_back({ ring[i], ring[j], ring[k], a });
      parts.emplace_back(i, k);
      parts.emplace_back(k, j);
    }
    this->Replace(cells, fresh);
    ++this->Counts.edgeRemovals;
    return true;
  }

  bool FlipFace(std::int64_t cell, int corner)
  {
    const Tetrahedron& t = this->Cells[cell];
    const std::int64_t d = t[corner];
    // b, c, e: the face opposite of d, so that (d, b, c, e) is the tetrahedron.
    const Tetrahedron from = FromEdge(t, d, t[(corner + 1) % 4]);
    const std::int64_t p = from[1];
    const std::int64_t q = from[2];
    const std::int64_t r = from[3];
    const std::int64_t other = this->Across(cell, p, q, r);
    if (other < 0)
    {
      return false;
    }
    std::int64_t e = -1;
    for (const std::int64_t point : this->Cells[other])
    {
      if (point != p && point != q && point != r)
      {
        e = point;
      }
    }
    const double worst = this->Worst({ cell, other });
    const std::array<Tetrahedron, 3> fresh{ Tetrahedron{ d, p, q, e }, Tetrahedron{ d, q, r, e },
      Tetrahedron{ d, r, p, e } };
    for (const Tetrahedron& f : fresh)
    {
      if (!(this->Quality(f) > worst + gain))
      {
        return false;
      }
    }
    this->Replace({ cell, other }, { fresh.begin(), fresh.end() });
    ++this->Counts.faceFlips;
    return true;
  }

  bool Move(std::int64_t point)
  {
    if (this->Fixed[point] != 0)
    {
      return false;
    }
    const Ids& cells = this->Around[point];
    bool moved = false;
    for (int round = 0; round < 4; ++round)
    {
      const Vector3 start = this->Points[point];
      double worst = 1.0;
      std::int64_t worstCell = -1;
      Vector3 centre = Vector3::Zero();
      double size = 0.0;
      for (const std::int64_t cell : cells)
      {
        const double quality = this->Quality(this->Cells[cell]);
        if (quality < worst)
        {
          worst = quality;
          worstCell = cell;
        }
        for (const std::int64_t other : this->Cells[cell])
        {
          centre += this->Points[other] / (4.0 * static_cast<double>(cells.size()));
          size += (this->Points[other] - start).norm() / (3.0 * static_cast<double>(cells.size()));
        }
      }
      if (worstCell < 0)
      {
        return moved;
      }
      Vector3 slope;
      const double step = 1e-5 * size;
      for (int axis = 0; axis < 3; ++axis)
      {
        this->Points[point][axis] = start[axis] + step;
        const double high = this->Quality(this->Cells[worstCell]);
        this->Points[point][axis] = start[axis] - step;
        const double low = this->Quality(this->Cells[worstCell]);
        this->Points[point][axis] = start[axis];
        slope[axis] = (high - low) / (2.0 * step);
      }
      const double steepness = slope.norm();
      bool better = false;
      const auto attempt = [&](const Vector3& place)
      {
        this->Points[point] = place;
        if (this->Worst(cells) > worst + gain)
        {
          better = true;
          return true;
        }
        this->Points[point] = start;
        return false;
      };
      if (steepness > 0.0)
      {
        for (double length = 0.4; length > 0.01 && !better; length *= 0.5)
        {
          attempt(start + slope * (length * size / steepness));
        }
      }
      for (double share = 1.0; share > 0.2 && !better; share *= 0.5)
      {
        attempt(start + share * (centre - start));
      }
      if (!better)
      {
        break;
      }
      moved = true;
      ++this->Counts.moves;
    }
    return moved;
  }

  bool Contract(std::int64_t point, std::int64_t target)
  {
    const Ids cells = this->Around[point];
    const double worst = this->Worst(cells);
    std::vector<Tetrahedron> fresh;
    for (const std::int64_t cell : cells)
    {
      Tetrahedron t = this->Cells[cell];
      if (Has(t, target))
      {
        continue;
      }
      *std::find(t.begin(), t.end(), point) = target;
      if (!(this->Quality(t) > worst + gain))
      {
        return false;
      }
      fresh.push_back(t);
    }
    this->Replace(cells, fresh);
    ++this->Counts.contractions;
    return true;
  }

  /// A new point in the tetrahedron or in one beside it: a flat one at the wall needs one further in.
  bool Insert(std::int64_t cell)
  {
    const Tetrahedron t = this->Cells[cell];
    if (this->Insert(cell, { cell }))
    {
      return true;
    }
    for (int i = 0; i < 4; ++i)
    {
      const std::int64_t other = this->Across(cell, t[(i + 1) % 4], t[(i + 2) % 4], t[(i + 3) % 4]);
      if (other >= 0 && this->Insert(cell, { other, cell }))
      {
        return true;
      }
    }
    return false;
  }

  /// A new point in the first one's middle, in a cavity around all that is star-shaped from it.
  bool Insert(std::int64_t cell, const Ids& seeds)
  {
    constexpr std::size_t maximumCavity = 40;
    const Tetrahedron t = this->Cells[cell];
    const auto point = static_cast<std::int64_t>(this->Points.size());
    const Tetrahedron& first = this->Cells[seeds[0]];
    const Vector3 place = (this->Points[first[0]] + this->Points[first[1]] +
                            this->Points[first[2]] + this->Points[first[3]]) /
      4.0;
    this->Points.push_back(place);
    const double wanted = this->Quality(t) + gain;
    std::set<std::int64_t> cavity(seeds.begin(), seeds.end());
    std::vector<std::array<std::int64_t, 3>> shell;
    for (bool grown = true; grown;)
    {
      grown = false;
      shell.clear();
      for (const std::int64_t member : std::set<std::int64_t>(cavity))
      {
        const Tetrahedron& m = this->Cells[member];
        // Faces that look outwards.
        const std::array<std::array<std::int64_t, 3>, 4> faces{ { { m[1], m[2], m[3] },
          { m[0], m[3], m[2] }, { m[0], m[1], m[3] }, { m[0], m[2], m[1] } } };
        for (const auto& face : faces)
        {
          const std::int64_t other = this->Across(member, face[0], face[1], face[2]);
          if (other >= 0 && cavity.count(other) != 0)
          {
            continue;
          }
          // Seen from the point inside, an outward face turns the other way.
          const double quality = this->Quality(face[0], face[2], face[1], point);
          const bool good =
            quality > this->Settings.wantedSine || (quality > 2.0 * wanted && quality > 0.1);
          if (!good && other >= 0 && cavity.size() < maximumCavity)
          {
            cavity.insert(other);
            grown = true;
          }
          else if (good || quality > wanted)
          {
            shell.push_back(face);
          }
          else
          {
            this->Points.pop_back();
            return false;
          }
        }
        if (grown)
        {
          break;
        }
      }
    }
    const Ids cells(cavity.begin(), cavity.end());
    // Nothing may be swallowed: no point, and no edge that must stay.
    std::set<std::pair<std::int64_t, std::int64_t>> shellEdges;
    std::set<std::int64_t> shellPoints;
    for (const auto& face : shell)
    {
      for (int i = 0; i < 3; ++i)
      {
        shellPoints.insert(face[i]);
        shellEdges.insert(std::minmax(face[i], face[(i + 1) % 3]));
      }
    }
    bool whole = this->Worst(cells) + gain > 0.0;
    for (const std::int64_t member : cells)
    {
      const Tetrahedron& m = this->Cells[member];
      for (int i = 0; i < 4 && whole; ++i)
      {
        whole = shellPoints.count(m[i]) != 0;
        for (int j = i + 1; j < 4 && whole; ++j)
        {
          whole = !this->IsKept(m[i], m[j]) || shellEdges.count(std::minmax(m[i], m[j])) != 0;
        }
      }
    }
    if (!whole)
    {
      this->Points.pop_back();
      return false;
    }
    this->Fixed.push_back(0);
    this->Around.emplace_back();
    this->Kept.emplace_back();
    std::vector<Tetrahedron> fresh;
    fresh.reserve(shell.size());
    for (const auto& face : shell)
    {
      fresh.push_back({ face[0], face[2], face[1], point });
    }
    this->Replace(cells, fresh);
    ++this->Counts.insertions;
    this->Move(point);
    return true;
  }

  std::vector<Vector3>& Points;
  std::vector<Tetrahedron>& Cells;
  std::vector<char>& Fixed;
  const ImprovementSettings& Settings;
  std::vector<char> Alive;
  std::vector<Ids> Around; ///< per point: the tetrahedra that have it
  std::vector<Ids> Kept;   ///< per point: the other ends of edges that must stay
  ImprovementCounts Counts;
};
}

ImprovementCounts ImproveTetrahedra(std::vector<Vector3>& points,
  std::vector<Tetrahedron>& tetrahedra, std::vector<char>& fixed,
  const std::vector<std::pair<std::int64_t, std::int64_t>>& edges,
  const ImprovementSettings& settings, const ProgressCallback& progress)
{
  Improver improver(points, tetrahedra, fixed, edges, settings);
  return improver.Run(progress);
}
}
