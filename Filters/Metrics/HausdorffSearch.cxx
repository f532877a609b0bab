#include "HausdorffSearch.h"

#include "PartialProgress.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr std::size_t PiecesAtOnce = 8192;

/// Squared distance of two segments. Source: Ericson, Real-Time Collision Detection, 2005, 5.1.9.
double SegmentDistance2(const Vector3& p1, const Vector3& q1, const Vector3& p2, const Vector3& q2)
{
  const Vector3 d1 = q1 - p1;
  const Vector3 d2 = q2 - p2;
  const Vector3 r = p1 - p2;
  const double a = d1.squaredNorm();
  const double e = d2.squaredNorm();
  const double f = d2.dot(r);
  double s = 0.0;
  double t = 0.0;
  if (a > 0.0 || e > 0.0)
  {
    if (!(a > 0.0))
    {
      t = std::clamp(f / e, 0.0, 1.0);
    }
    else
    {
      const double c = d1.dot(r);
      if (!(e > 0.0))
      {
        s = std::clamp(-c / a, 0.0, 1.0);
      }
      else
      {
        const double b = d1.dot(d2);
        const double denominator = a * e - b * b;
        s = denominator > 0.0 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
        t = (b * s + f) / e;
        if (t < 0.0)
        {
          t = 0.0;
          s = std::clamp(-c / a, 0.0, 1.0);
        }
        else if (t > 1.0)
        {
          t = 1.0;
          s = std::clamp((b - c) / a, 0.0, 1.0);
        }
      }
    }
  }
  return (p1 + s * d1 - p2 - t * d2).squaredNorm();
}
}

/**
 * The corners' nearest triangles share a corner, or two of them an edge. Then the piece can be mapped
 * onto these triangles, affinely on each of its parts: edges of the piece cross shared edges, and, of
 * three triangles, a point of the piece goes to the shared corner. No point of the piece is further
 * from the surface than the mapping moves one of these points or a corner.
 */
double HausdorffSearch::FanBound(const Piece& piece) const
{
  const std::vector<Vector3>& points = this->To.surface.points;
  const auto shared = [&](std::int32_t s, std::int32_t t, std::array<std::int32_t, 3>& common)
  {
    int count = 0;
    for (const std::int32_t p : this->To.surface.triangles[s])
    {
      const SideTriangle& other = this->To.surface.triangles[t];
      if (std::find(other.begin(), other.end(), p) != other.end())
      {
        common[count++] = p;
      }
    }
    return count;
  };
  const double corners = std::max({ piece.distance[0], piece.distance[1], piece.distance[2] });
  double squared = 0.0;
  std::array<std::int32_t, 3> common{};
  std::int32_t centre = -1;
  const bool three = piece.nearest[0] != piece.nearest[1] && piece.nearest[1] != piece.nearest[2] &&
    piece.nearest[2] != piece.nearest[0];
  if (three)
  {
    const int count = shared(piece.nearest[0], piece.nearest[1], common);
    const SideTriangle& third = this->To.surface.triangles[piece.nearest[2]];
    for (int i = 0; i < count && centre < 0; ++i)
    {
      centre = std::find(third.begin(), third.end(), common[i]) != third.end() ? common[i] : -1;
    }
    if (centre < 0)
    {
      return std::numeric_limits<double>::infinity();
    }
    squared = NearestOnTriangle(points[centre], piece.corner[0], piece.corner[1], piece.corner[2])
                .squaredDistance;
  }
  for (int i = 0; i < 3; ++i)
  {
    const int j = (i + 1) % 3;
    if (piece.nearest[i] == piece.nearest[j])
    {
      continue;
    }
    const int count = shared(piece.nearest[i], piece.nearest[j], common);
    if (count == 0)
    {
      return std::numeric_limits<double>::infinity();
    }
    std::int32_t p = common[0];
    std::int32_t q = common[count > 1 ? 1 : 0];
    if (three && count != 2)
    {
      p = q = centre;
    }
    squared =
      std::max(squared, SegmentDistance2(piece.corner[i], piece.corner[j], points[p], points[q]));
  }
  return std::max(corners, std::sqrt(squared));
}

double HausdorffSearch::UpperBound(const Piece& piece, std::int32_t extra, double enough) const
{
  const std::array<double, 3> edge = { (piece.corner[1] - piece.corner[2]).norm(),
    (piece.corner[2] - piece.corner[0]).norm(), (piece.corner[0] - piece.corner[1]).norm() };
  double upper = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i)
  {
    upper = std::min(upper, piece.distance[i] + std::max(edge[(i + 1) % 3], edge[(i + 2) % 3]));
  }
  const auto tryOne = [&](std::int32_t triangle)
  {
    double maximum = 0.0;
    for (int k = 0; k < 3 && maximum < upper; ++k)
    {
      maximum = std::max(maximum,
        piece.nearest[k] == triangle
          ? piece.distance[k]
          : std::sqrt(this->To.tree.NearestOn(triangle, piece.corner[k]).squaredDistance));
    }
    upper = std::min(upper, maximum);
  };
  for (int i = 0; i < 3 && upper > enough; ++i)
  {
    if (std::find(piece.nearest.begin(), piece.nearest.begin() + i, piece.nearest[i]) ==
      piece.nearest.begin() + i)
    {
      tryOne(piece.nearest[i]);
    }
  }
  if (upper > enough && extra >= 0)
  {
    tryOne(extra);
  }
  if (upper > enough)
  {
    upper = std::min(upper, this->FanBound(piece));
  }
  return upper;
}

HausdorffSearch::Piece HausdorffSearch::PieceOf(std::int64_t i) const
{
  const ComparedSide& side = this->From;
  Piece piece;
  for (int k = 0; k < 3; ++k)
  {
    const std::int32_t point = side.surface.triangles[i][k];
    piece.corner[k] = side.surface.points[point];
    piece.distance[k] = side.distance[point];
    piece.nearest[k] = static_cast<std::int32_t>(side.nearest[point].triangle);
  }
  piece.triangle = static_cast<std::int32_t>(i);
  return piece;
}

void HausdorffSearch::OfferKnown(const std::vector<DistancePart>& parts)
{
  const ComparedSide& side = this->From;
  const std::int64_t count = side.Triangles();
  for (std::int64_t i = 0; i < count; ++i)
  {
    for (const std::int32_t point : side.surface.triangles[i])
    {
      this->Offer(side.groupOf[i], side.distance[point], side.surface.points[point],
        static_cast<std::int32_t>(i));
    }
  }
  for (const DistancePart& part : parts)
  {
    const Vector3 at = (side.Corner(part.triangle, 0) + side.Corner(part.triangle, 1) +
                         side.Corner(part.triangle, 2)) /
      3.0;
    if (side.centroidNearest[part.triangle] >= 0 && part.cell == 0)
    {
      this->Offer(side.groupOf[part.triangle], part.centroid, at, part.triangle);
    }
  }
}

std::vector<HausdorffSearch::Piece> HausdorffSearch::Correct(std::vector<double>& upper)
{
  const ComparedSide& side = this->From;
  const std::int64_t count = side.Triangles();
  std::vector<std::int32_t> left;
  for (std::int64_t i = 0; i < count; ++i)
  {
    if (upper[i] > this->Best[side.groupOf[i]].distance + this->Settings.errorBound)
    {
      left.push_back(static_cast<std::int32_t>(i));
    }
  }
  std::vector<Piece> corrected(left.size());
  ParallelFor(static_cast<std::int64_t>(left.size()), 64,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        Piece piece = this->PieceOf(left[n]);
        for (int k = 0; k < 3; ++k)
        {
          const TriangleBvh::Nearest nearest = this->To.tree.Closest(
            piece.corner[k], std::numeric_limits<double>::infinity(), piece.nearest[k]);
          piece.distance[k] = nearest.distance;
          piece.nearest[k] = static_cast<std::int32_t>(nearest.triangle);
        }
        piece.upper = this->UpperBound(
          piece, -1, this->Best[side.groupOf[left[n]]].distance + this->Settings.errorBound);
        upper[left[n]] = std::min(upper[left[n]], piece.upper);
        piece.upper = upper[left[n]];
        corrected[n] = piece;
      }
    });
  for (const Piece& piece : corrected)
  {
    for (int k = 0; k < 3; ++k)
    {
      this->Offer(side.groupOf[piece.triangle], piece.distance[k], piece.corner[k], piece.triangle);
    }
  }
  return corrected;
}

std::vector<HausdorffSearch::Piece> HausdorffSearch::Select(
  const std::vector<double>& upper, const std::vector<Piece>& corrected)
{
  const ComparedSide& side = this->From;
  const std::int64_t count = side.Triangles();
  std::vector<Piece> pieces;
  std::size_t next = 0;
  for (std::int64_t i = 0; i < count; ++i)
  {
    const std::int32_t group = side.groupOf[i];
    while (next < corrected.size() && corrected[next].triangle < i)
    {
      ++next;
    }
    if (upper[i] > this->Best[group].distance + this->Settings.errorBound)
    {
      const bool known = next < corrected.size() && corrected[next].triangle == i;
      pieces.push_back(known ? corrected[next] : this->PieceOf(i));
      pieces.back().upper = upper[i];
    }
    else
    {
      this->Discarded[group] = std::max(this->Discarded[group], upper[i]);
    }
  }
  return pieces;
}

HausdorffSearch::Cut HausdorffSearch::Quarter(const Piece& piece) const
{
  Cut cut;
  std::array<std::int32_t, 3> near{};
  for (int k = 0; k < 3; ++k)
  {
    cut.middle[k] = 0.5 * (piece.corner[(k + 1) % 3] + piece.corner[(k + 2) % 3]);
    const TriangleBvh::Nearest nearest = this->To.tree.Closest(
      cut.middle[k], std::numeric_limits<double>::infinity(), piece.nearest[(k + 1) % 3]);
    cut.distance[k] = nearest.distance;
    near[k] = static_cast<std::int32_t>(nearest.triangle);
  }
  const double enough =
    this->Best[this->From.groupOf[piece.triangle]].distance + this->Settings.errorBound;
  for (int q = 0; q < 4; ++q)
  {
    Piece& quarter = cut.quarters[q];
    quarter.triangle = piece.triangle;
    for (int k = 0; k < 3; ++k)
    {
      // A corner of the piece stays in the quarter of its number; the last one is in the middle.
      const bool own = k == q;
      const int m = q == 3 ? k : 3 - q - k;
      quarter.corner[k] = own ? piece.corner[k] : cut.middle[m];
      quarter.distance[k] = own ? piece.distance[k] : cut.distance[m];
      quarter.nearest[k] = own ? piece.nearest[k] : near[m];
    }
    quarter.upper = std::min(piece.upper, this->UpperBound(quarter, -1, enough));
  }
  return cut;
}

bool HausdorffSearch::CanBeGreater(const Piece& piece) const
{
  return piece.upper >
    this->Best[this->From.groupOf[piece.triangle]].distance + this->Settings.errorBound;
}

void HausdorffSearch::Discard(const Piece& piece)
{
  double& maximum = this->Discarded[this->From.groupOf[piece.triangle]];
  maximum = std::max(maximum, piece.upper);
}

void HausdorffSearch::Run(const std::vector<DistancePart>& parts, const ProgressCallback& progress)
{
  const ComparedSide& side = this->From;
  const std::int64_t count = side.Triangles();
  this->OfferKnown(parts);
  std::vector<double> upper(count);
  ParallelFor(
    count, ReportingGrain(progress, count, 1024),
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        upper[i] = this->UpperBound(this->PieceOf(i),
          side.centroidNearest.empty() ? -1 : side.centroidNearest[i],
          this->Best[side.groupOf[i]].distance + this->Settings.errorBound);
      }
    },
    progress);
  const std::vector<Piece> corrected =
    this->Settings.pointMeasures ? std::vector<Piece>() : this->Correct(upper);
  std::vector<Piece> pieces = this->Select(upper, corrected);
  std::vector<Cut> cuts;
  std::int64_t done = 0;
  while (!pieces.empty())
  {
    Report(progress, 1.0);
    const std::size_t batch = std::min(PiecesAtOnce, pieces.size());
    const auto begin = pieces.end() - static_cast<std::ptrdiff_t>(batch);
    if (batch < pieces.size())
    {
      // The most promising ones.
      std::nth_element(pieces.begin(), begin, pieces.end(),
        [](const Piece& s, const Piece& t) { return s.upper < t.upper; });
    }
    done += static_cast<std::int64_t>(batch);
    if (done > this->Settings.maximumPieces)
    {
      this->Finished = false;
      for (const Piece& piece : pieces)
      {
        this->Discard(piece);
      }
      return;
    }
    cuts.resize(batch);
    ParallelFor(static_cast<std::int64_t>(batch), 64,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          cuts[n] = this->Quarter(begin[n]);
        }
      });
    for (std::size_t n = 0; n < batch; ++n)
    {
      const std::int32_t triangle = begin[static_cast<std::ptrdiff_t>(n)].triangle;
      for (int k = 0; k < 3; ++k)
      {
        this->Offer(side.groupOf[triangle], cuts[n].distance[k], cuts[n].middle[k], triangle);
      }
    }
    pieces.resize(pieces.size() - batch);
    for (const Cut& cut : cuts)
    {
      for (const Piece& quarter : cut.quarters)
      {
        if (this->CanBeGreater(quarter))
        {
          pieces.push_back(quarter);
        }
        else
        {
          this->Discard(quarter);
        }
      }
    }
  }
}
}
