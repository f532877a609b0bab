#include "SweptFirstMesh.h"

#include "Numbers.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace coronary
{
namespace
{
/// The first mesh: rings along the spans, junctions between, caps at the ends.
class FirstMesh
{
public:
  FirstMesh(
    const SweptLumen& lumen, const SweepSettings& settings, const std::vector<int>& capEntity)
    : Lumen(lumen)
    , Settings(settings)
    , CapEntity(capEntity)
  {
  }

  std::vector<RemeshVertex> vertices;
  std::vector<Triangle> triangles;
  std::vector<int> entity;

  /// @param reliefs  where the tree is not as it was given
  void Make(const std::vector<SweepRelief>& reliefs, const ProgressCallback& progress)
  {
    const auto& junctions = this->Lumen.Junctions();
    std::vector<JunctionMesh> meshes(junctions.size());
    // What was relieved may fail again: first of all, so that nothing else is done in vain.
    std::vector<std::int64_t> doubtful;
    std::vector<std::int64_t> others;
    for (std::size_t j = 0; j < junctions.size(); ++j)
    {
      const bool relieved = std::any_of(reliefs.begin(), reliefs.end(),
        [&](const SweepRelief& relief)
        { return (relief.centre - junctions[j].centre).norm() < relief.reach; });
      if (!junctions[j].arms.empty())
      {
        (relieved ? doubtful : others).push_back(static_cast<std::int64_t>(j));
      }
    }
    this->MeshJunctions(doubtful, meshes, {});
    this->MeshJunctions(others, meshes, progress);
    std::vector<std::int64_t> offset(junctions.size(), 0);
    for (std::size_t j = 0; j < junctions.size(); ++j)
    {
      offset[j] = static_cast<std::int64_t>(this->vertices.size());
      for (const Vector3& p : meshes[j].points)
      {
        RemeshVertex vertex;
        vertex.position = p;
        vertex.part = -1 - static_cast<std::int32_t>(j);
        this->vertices.push_back(vertex);
      }
      for (const Triangle& t : meshes[j].triangles)
      {
        this->Add(t[0] + offset[j], t[1] + offset[j], t[2] + offset[j], 1);
      }
    }
    const auto loopOf = [&](int junction, int span, bool atStart)
    {
      std::vector<std::int64_t> loop;
      const auto& arms = junctions[junction].arms;
      for (std::size_t a = 0; a < arms.size(); ++a)
      {
        if (arms[a].span == span && arms[a].atStart == atStart)
        {
          loop = meshes[junction].loops[a];
        }
      }
      for (std::int64_t& p : loop)
      {
        p += offset[junction];
      }
      return loop;
    };
    for (std::size_t i = 0; i < this->Lumen.Spans().size(); ++i)
    {
      const SweptLumen::Span& span = this->Lumen.Spans()[i];
      if (span.inner)
      {
        continue;
      }
      const int index = static_cast<int>(i);
      std::vector<std::int64_t> start;
      std::vector<std::int64_t> end;
      if (span.startJunction >= 0)
      {
        start = loopOf(span.startJunction, index, true);
      }
      if (span.endJunction >= 0)
      {
        end = loopOf(span.endJunction, index, false);
      }
      this->Tube(index, start, end);
    }
  }

private:
  /// @throws Unresolved with all that fail; Cancelled
  void MeshJunctions(const std::vector<std::int64_t>& which, std::vector<JunctionMesh>& meshes,
    const ProgressCallback& progress) const
  {
    std::vector<std::unique_ptr<JunctionFailure>> failed(which.size());
    const auto mesh = [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        try
        {
          meshes[which[i]] = MeshJunction(this->Lumen, static_cast<int>(which[i]));
        }
        catch (const JunctionFailure& failure)
        {
          failed[i] = std::make_unique<JunctionFailure>(failure);
        }
      }
    };
    const auto count = static_cast<std::int64_t>(which.size());
    if (count < 2 * NumberOfThreads())
    {
      // Too few for all threads to have some: these share the work on each.
      mesh(0, count);
      Report(progress, 1.0);
    }
    else
    {
      ParallelFor(count, 1, mesh, progress);
    }
    Unresolved unresolved;
    for (const auto& failure : failed)
    {
      if (failure)
      {
        unresolved.places.push_back(*failure);
      }
    }
    if (!unresolved.places.empty())
    {
      throw unresolved;
    }
  }

  void Add(std::int64_t a, std::int64_t b, std::int64_t c, int e)
  {
    this->triangles.push_back({ a, b, c });
    this->entity.push_back(e);
  }

  double SizeAt(const VesselAxis& axis, double s) const
  {
    const VesselAxis::Station station = axis.At(s);
    const double bend = station.curvature.norm();
    const double curvature =
      std::max(1.0 / station.radius, bend / std::max(0.05, 1.0 - bend * station.radius));
    return SweptEdgeLength(this->Settings, curvature, station.radius);
  }

  /// A ring's point moved along the vessel: rings lean like the plane of an end that is near.
  Vector3 Leaning(int index, double s, Vector3 position) const
  {
    const SweptLumen::Span& span = this->Lumen.Spans()[index];
    const VesselAxis& axis = *this->Lumen.Vessels()[span.vessel].axis;
    const VesselAxis::Station station = axis.At(s);
    const Vector3 offset = position - station.point;
    for (const bool atStart : { true, false })
    {
      const int tip = atStart ? span.startTip : span.endTip;
      if (tip < 0)
      {
        continue;
      }
      const SweptLumen::Tip& end = this->Lumen.Tips()[tip];
      const VesselAxis::Station last = axis.At(atStart ? span.from : span.to);
      const Vector3 outward = atStart ? Vector3(-last.tangent) : last.tangent;
      const double cosine = end.normal.dot(outward);
      const double most = end.radius * std::sqrt(std::max(0.0, 1.0 / (cosine * cosine) - 1.0));
      const double reach = std::min(2.0 * most, 0.9 * (span.cutTo - span.cutFrom));
      const double share = 1.0 - std::abs(s - last.s) / std::max(1e-12, reach);
      if (most > 1e-9 * end.radius && share > 0.0)
      {
        const Vector3 across = offset - offset.dot(outward) * outward;
        position -= share * end.normal.dot(across) / cosine * outward;
      }
    }
    return position;
  }

  std::vector<std::int64_t> Ring(int span, double s, int count, double phase, int tip)
  {
    const VesselAxis& axis = *this->Lumen.Vessels()[this->Lumen.Spans()[span].vessel].axis;
    std::vector<std::int64_t> ring;
    for (int i = 0; i < count; ++i)
    {
      RemeshVertex vertex;
      vertex.position = this->Leaning(span, s, axis.WallPoint(s, 2.0 * Pi * (i + phase) / count));
      vertex.part = span;
      vertex.piece = axis.PieceAt(s);
      vertex.patch = tip;
      vertex.rim = tip >= 0;
      ring.push_back(static_cast<std::int64_t>(this->vertices.size()));
      this->vertices.push_back(vertex);
    }
    return ring;
  }

  /// Angles around a station, rising from the first point's on.
  std::vector<double> Angles(
    const VesselAxis::Station& station, const std::vector<std::int64_t>& ring) const
  {
    std::vector<double> angle;
    for (const std::int64_t p : ring)
    {
      const Vector3 offset = this->vertices[p].position - station.point;
      const double a = std::atan2(offset.dot(station.binormal), offset.dot(station.normal));
      angle.push_back(
        angle.empty() ? a : angle.back() + std::remainder(a - angle.back(), 2.0 * Pi));
    }
    return angle;
  }

  /// Triangles between two closed rings, by angle.
  void Zip(const std::vector<std::int64_t>& low, const std::vector<double>& lowAngle,
    const std::vector<std::int64_t>& high, const std::vector<double>& highAngle, int e)
  {
    const std::size_t n = low.size();
    const std::size_t m = high.size();
    // Start where the first point of `low` has its nearest partner.
    std::size_t shift = 0;
    double best = 10.0;
    for (std::size_t k = 0; k < m; ++k)
    {
      const double off = std::abs(std::remainder(highAngle[k] - lowAngle[0], 2.0 * Pi));
      if (off < best)
      {
        best = off;
        shift = k;
      }
    }
    if (n == 0 || m == 0)
    {
      return;
    }
    const double base =
      highAngle[shift] - (lowAngle[0] + std::remainder(highAngle[shift] - lowAngle[0], 2.0 * Pi));
    const auto at = [&](const std::vector<double>& angle, std::size_t i, std::size_t count)
    {
      const std::size_t turns = i / count;
      return angle[i % count] + 2.0 * Pi * static_cast<double>(turns);
    };
    std::size_t i = 0;
    std::size_t j = 0;
    while (i < n || j < m)
    {
      const double nextLow = at(lowAngle, i + 1, n) + at(lowAngle, i, n);
      const double nextHigh =
        at(highAngle, shift + j + 1, m) + at(highAngle, shift + j, m) - 2.0 * base;
      const bool advanceLow = j >= m || (i < n && nextLow <= nextHigh);
      const std::int64_t a = low[i % n];
      const std::int64_t b = high[(shift + j) % m];
      if (advanceLow)
      {
        this->Add(a, low[(i + 1) % n], b, e);
        ++i;
      }
      else
      {
        this->Add(a, high[(shift + j + 1) % m], b, e);
        ++j;
      }
    }
  }

  void Tube(int index, const std::vector<std::int64_t>& start, const std::vector<std::int64_t>& end)
  {
    const SweptLumen::Span& span = this->Lumen.Spans()[index];
    const VesselAxis& axis = *this->Lumen.Vessels()[span.vessel].axis;
    const double from = span.cutFrom;
    const double to = span.cutTo;
    // Ring distances in units of the height of an even triangle.
    constexpr int samples = 400;
    std::vector<double> rows(1, 0.0);
    for (int i = 0; i < samples; ++i)
    {
      const double s = from + (to - from) * (i + 0.5) / samples;
      rows.push_back(rows.back() + (to - from) / samples / (0.866 * this->SizeAt(axis, s)));
    }
    const int count = std::max(1, static_cast<int>(std::lround(rows.back())));
    std::vector<std::int64_t> previous = start;
    VesselAxis::Station previousStation = axis.At(from);
    int around = 0;
    std::size_t row = 0;
    for (int k = 0; k <= count; ++k)
    {
      double s = to;
      if (k < count)
      {
        const double wanted = rows.back() * k / count;
        while (row + 2 < rows.size() && rows[row + 1] < wanted)
        {
          ++row;
        }
        const double part = (wanted - rows[row]) / std::max(1e-12, rows[row + 1] - rows[row]);
        s = from + (to - from) * (static_cast<double>(row) + part) / samples;
      }
      const VesselAxis::Station station = axis.At(s);
      double circumference = 0.0;
      for (int a = 0; a < 32; ++a)
      {
        circumference += 2.0 * Pi / 32.0 * axis.WallRadius(s, 2.0 * Pi * a / 32.0);
      }
      const int ideal =
        std::max(7, static_cast<int>(std::lround(circumference / this->SizeAt(axis, s))));
      if (around == 0 || std::abs(ideal - around) > std::max(1.0, 0.08 * around))
      {
        around = ideal;
      }
      std::vector<std::int64_t> ring;
      if (k == 0)
      {
        ring = span.startTip >= 0 ? this->Ring(index, s, around, 0.0, span.startTip) : start;
      }
      else if (k == count)
      {
        ring = span.endTip >= 0 ? this->Ring(index, s, around, 0.5 * (k % 2), span.endTip) : end;
      }
      else
      {
        ring = this->Ring(index, s, around, 0.5 * (k % 2), -1);
      }
      if (k > 0)
      {
        this->Zip(
          previous, this->Angles(previousStation, previous), ring, this->Angles(station, ring), 1);
      }
      if (k == 0 && span.startTip >= 0)
      {
        this->Cap(ring, station, span.startTip, index, true);
      }
      if (k == count && span.endTip >= 0)
      {
        this->Cap(ring, station, span.endTip, index, false);
      }
      previous = ring;
      previousStation = station;
    }
  }

  /// A flat disc of shrinking rings.
  void Cap(const std::vector<std::int64_t>& rim, const VesselAxis::Station& station, int tip,
    int span, bool atStart)
  {
    const int e = this->CapEntity[tip];
    const std::size_t firstTriangle = this->triangles.size();
    std::vector<std::int64_t> outer = rim;
    const double size = SweptEdgeLength(this->Settings, 1.0 / station.radius, station.radius);
    const double step = 0.866 * size / station.radius;
    const VesselAxis& axis = *this->Lumen.Vessels()[this->Lumen.Spans()[span].vessel].axis;
    int row = 0;
    while (1.0 - (row + 1) * step > 0.7 * step)
    {
      ++row;
      const double share = 1.0 - row * step;
      const int count =
        std::max(5, static_cast<int>(std::lround(static_cast<double>(rim.size()) * share)));
      std::vector<std::int64_t> inner;
      for (int i = 0; i < count; ++i)
      {
        RemeshVertex vertex;
        const Vector3 wall = axis.WallPoint(station.s, 2.0 * Pi * (i + 0.5 * (row % 2)) / count);
        vertex.position = station.point + share * (wall - station.point);
        vertex.part = span;
        vertex.piece = axis.PieceAt(station.s);
        vertex.patch = tip;
        inner.push_back(static_cast<std::int64_t>(this->vertices.size()));
        this->vertices.push_back(vertex);
      }
      this->Zip(outer, this->Angles(station, outer), inner, this->Angles(station, inner), e);
      outer = inner;
    }
    RemeshVertex centre;
    centre.position = station.point;
    centre.part = span;
    centre.piece = axis.PieceAt(station.s);
    centre.patch = tip;
    const std::int64_t c = static_cast<std::int64_t>(this->vertices.size());
    this->vertices.push_back(centre);
    for (std::size_t i = 0; i < outer.size(); ++i)
    {
      this->Add(outer[i], outer[(i + 1) % outer.size()], c, e);
    }
    // Rings that shrink towards the inside turn counter-clockwise about the tangent.
    if (atStart)
    {
      for (std::size_t t = firstTriangle; t < this->triangles.size(); ++t)
      {
        std::swap(this->triangles[t][1], this->triangles[t][2]);
      }
    }
  }

  const SweptLumen& Lumen;
  const SweepSettings& Settings;
  const std::vector<int>& CapEntity;
};
}

double SweptEdgeLength(const SweepSettings& settings, double curvature, double radius)
{
  const double h = settings.minimumEdgeLength +
    (settings.maximumEdgeLength - settings.minimumEdgeLength) *
      std::exp(-settings.curvatureWeight * curvature);
  // Where the wall is more bent than the vessel is thin, its own radius counts.
  const double bend = std::max(1.0 / curvature, settings.sharpestBend * radius);
  return std::min(h, settings.edgeLengthPerRadius * std::min(radius, bend));
}

SweptFirstMesh MakeFirstMesh(const SweptLumen& lumen, const SweepSettings& settings,
  const std::vector<int>& capEntity, const std::vector<SweepRelief>& reliefs,
  const ProgressCallback& progress)
{
  FirstMesh mesh(lumen, settings, capEntity);
  mesh.Make(reliefs, progress);
  return { std::move(mesh.vertices), std::move(mesh.triangles), std::move(mesh.entity) };
}
}
