#include "TriangleIntersections.h"

#include "ParallelFor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>

namespace coronary
{
namespace
{
/// A sum of doubles without rounding: Shewchuk, "Adaptive precision floating-point arithmetic and
/// fast robust geometric predicates", Discrete Comput. Geom. 18, 1997, theorem 10.
class ExactSum
{
public:
  void Add(double x)
  {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < this->Count; ++i)
    {
      const double sum = x + this->Terms[i];
      const double virtualTerm = sum - x;
      const double error = (x - (sum - virtualTerm)) + (this->Terms[i] - virtualTerm);
      if (error != 0.0)
      {
        this->Terms[kept++] = error;
      }
      x = sum;
    }
    if (x != 0.0)
    {
      this->Terms[kept++] = x;
    }
    this->Count = kept;
  }

  void AddProduct(double x, double y)
  {
    const double product = x * y;
    this->Add(std::fma(x, y, -product));
    this->Add(product);
  }

  void AddProduct(double x, double y, double z)
  {
    const double product = x * y;
    this->AddProduct(std::fma(x, y, -product), z);
    this->AddProduct(product, z);
  }

  /// Has the sum's sign.
  double Sign() const { return this->Count == 0 ? 0.0 : this->Terms[this->Count - 1]; }

private:
  std::array<double, 128> Terms{}; // no sum here has more than 96
  std::size_t Count = 0;
};

void AddDeterminant(
  ExactSum& sum, double sign, const Vector3& a, const Vector3& b, const Vector3& c)
{
  for (int i = 0; i < 3; ++i)
  {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    sum.AddProduct(sign * a[i], b[j], c[k]);
    sum.AddProduct(-sign * a[i], b[k], c[j]);
  }
}

/// Has the sign of a tetrahedron's volume; 0 exactly when it is flat.
double Orientation(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d)
{
  const Vector3 u = a - d;
  const Vector3 v = b - d;
  const Vector3 w = c - d;
  const double value = u.dot(v.cross(w));
  // Shewchuk's first bound for this determinant: its permanent times the rounding unit.
  const Vector3 x = u.cwiseAbs();
  const Vector3 y = v.cwiseAbs();
  const Vector3 z = w.cwiseAbs();
  const double size = x[0] * (y[1] * z[2] + y[2] * z[1]) + x[1] * (y[2] * z[0] + y[0] * z[2]) +
    x[2] * (y[0] * z[1] + y[1] * z[0]);
  if (std::abs(value) > 1e-15 * size)
  {
    return value;
  }
  ExactSum sum;
  AddDeterminant(sum, 1.0, a, b, c);
  AddDeterminant(sum, -1.0, d, b, c);
  AddDeterminant(sum, -1.0, a, d, c);
  AddDeterminant(sum, -1.0, a, b, d);
  return sum.Sign();
}

/// The same of a triangle seen along an axis, with the other two being i and j.
double Turn(const Vector3& a, const Vector3& b, const Vector3& c, int i, int j)
{
  const double one = (b[i] - a[i]) * (c[j] - a[j]);
  const double other = (b[j] - a[j]) * (c[i] - a[i]);
  if (std::abs(one - other) > 4e-16 * (std::abs(one) + std::abs(other)))
  {
    return one - other;
  }
  ExactSum sum;
  sum.AddProduct(b[i], c[j]);
  sum.AddProduct(-b[i], a[j]);
  sum.AddProduct(-a[i], c[j]);
  sum.AddProduct(-b[j], c[i]);
  sum.AddProduct(b[j], a[i]);
  sum.AddProduct(a[j], c[i]);
  return sum.Sign();
}

/// Do two segments in one plane (seen along its widest axis) cross each other?
bool SegmentsMeet(
  const Vector3& p, const Vector3& q, const Vector3& r, const Vector3& s, int i, int j)
{
  const double a = Turn(p, q, r, i, j);
  const double b = Turn(p, q, s, i, j);
  const double c = Turn(r, s, p, i, j);
  const double d = Turn(r, s, q, i, j);
  return ((a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0)) &&
    ((c > 0.0 && d < 0.0) || (c < 0.0 && d > 0.0));
}

bool SegmentMeetsTriangle(
  const Vector3& p, const Vector3& q, const Vector3& a, const Vector3& b, const Vector3& c)
{
  const double s = Orientation(a, b, c, p);
  const double t = Orientation(a, b, c, q);
  if ((s > 0.0 && t > 0.0) || (s < 0.0 && t < 0.0))
  {
    return false;
  }
  if (s == 0.0 && t == 0.0)
  {
    const Vector3 normal = (b - a).cross(c - a).cwiseAbs();
    int widest = 0;
    normal.maxCoeff(&widest);
    const int i = (widest + 1) % 3;
    const int j = (widest + 2) % 3;
    if (SegmentsMeet(p, q, a, b, i, j) || SegmentsMeet(p, q, b, c, i, j) ||
      SegmentsMeet(p, q, c, a, i, j))
    {
      return true;
    }
    const double x = Turn(a, b, p, i, j);
    const double y = Turn(b, c, p, i, j);
    const double z = Turn(c, a, p, i, j);
    return (x > 0.0 && y > 0.0 && z > 0.0) || (x < 0.0 && y < 0.0 && z < 0.0);
  }
  const double x = Orientation(p, q, a, b);
  const double y = Orientation(p, q, b, c);
  const double z = Orientation(p, q, c, a);
  return (x >= 0.0 && y >= 0.0 && z >= 0.0) || (x <= 0.0 && y <= 0.0 && z <= 0.0);
}

bool Intersect(const std::vector<Vector3>& points, const Triangle& s, const Triangle& t)
{
  int shared = 0;
  int atS[3];
  int atT[3];
  for (int i = 0; i < 3; ++i)
  {
    for (int j = 0; j < 3; ++j)
    {
      if (s[i] == t[j])
      {
        atS[shared] = i;
        atT[shared] = j;
        ++shared;
        break;
      }
    }
  }
  const auto at = [&](const Triangle& triangle, int corner) -> const Vector3&
  { return points[triangle[corner % 3]]; };
  if (shared == 3)
  {
    return true;
  }
  if (shared == 2)
  {
    const Vector3& p = at(s, atS[0]);
    const Vector3& q = at(s, atS[1]);
    const Vector3& a = at(s, 3 - atS[0] - atS[1]);
    const Vector3& b = at(t, 3 - atT[0] - atT[1]);
    return Orientation(p, q, a, b) == 0.0 && (q - p).cross(a - p).dot((q - p).cross(b - p)) > 0.0;
  }
  if (shared == 1)
  {
    return SegmentMeetsTriangle(
             at(s, atS[0] + 1), at(s, atS[0] + 2), at(t, 0), at(t, 1), at(t, 2)) ||
      SegmentMeetsTriangle(at(t, atT[0] + 1), at(t, atT[0] + 2), at(s, 0), at(s, 1), at(s, 2));
  }
  for (int i = 0; i < 3; ++i)
  {
    if (SegmentMeetsTriangle(at(s, i), at(s, i + 1), at(t, 0), at(t, 1), at(t, 2)) ||
      SegmentMeetsTriangle(at(t, i), at(t, i + 1), at(s, 0), at(s, 1), at(s, 2)))
    {
      return true;
    }
  }
  return false;
}
}

std::vector<std::pair<std::int64_t, std::int64_t>> FindSelfIntersections(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles, std::size_t limit)
{
  std::vector<std::pair<std::int64_t, std::int64_t>> result;
  const std::size_t n = triangles.size();
  if (n < 2)
  {
    return result;
  }
  // Boxes in a grid of about two triangles' size.
  std::vector<Eigen::AlignedBox3d> boxes(n);
  double size = 0.0;
  Eigen::AlignedBox3d all;
  for (std::size_t i = 0; i < n; ++i)
  {
    for (const std::int64_t p : triangles[i])
    {
      boxes[i].extend(points[p]);
    }
    size += boxes[i].diagonal().maxCoeff() / static_cast<double>(n);
    all.extend(boxes[i]);
  }
  const double cell = std::max({ 2.0 * size, all.diagonal().maxCoeff() / 1e6, 1e-300 });
  const auto index = [&](const Vector3& p, int axis)
  { return static_cast<std::int64_t>(std::floor((p[axis] - all.min()[axis]) / cell)); };
  const auto key = [](std::int64_t x, std::int64_t y, std::int64_t z)
  {
    return (static_cast<std::uint64_t>(x) << 42) | (static_cast<std::uint64_t>(y) << 21) |
      static_cast<std::uint64_t>(z);
  };
  std::vector<std::pair<std::uint64_t, std::int64_t>> entries;
  entries.reserve(4 * n);
  for (std::size_t i = 0; i < n; ++i)
  {
    const Vector3 low = boxes[i].min();
    const Vector3 high = boxes[i].max();
    for (std::int64_t x = index(low, 0); x <= index(high, 0); ++x)
    {
      for (std::int64_t y = index(low, 1); y <= index(high, 1); ++y)
      {
        for (std::int64_t z = index(low, 2); z <= index(high, 2); ++z)
        {
          entries.emplace_back(key(x, y, z), static_cast<std::int64_t>(i));
        }
      }
    }
  }
  std::sort(entries.begin(), entries.end());
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < entries.size(); ++i)
  {
    if (i == 0 || entries[i].first != entries[i - 1].first)
    {
      starts.push_back(i);
    }
  }
  starts.push_back(entries.size());
  std::mutex mutex;
  ParallelFor(static_cast<std::int64_t>(starts.size()) - 1, 256,
    [&](std::int64_t first, std::int64_t last)
    {
      std::vector<std::pair<std::int64_t, std::int64_t>> own;
      for (std::int64_t c = first; c < last; ++c)
      {
        // By cells, so that it does not depend on threads what is found.
        const std::size_t most =
          limit > 0 ? own.size() + limit : std::numeric_limits<std::size_t>::max();
        for (std::size_t i = starts[c]; i < starts[c + 1]; ++i)
        {
          for (std::size_t j = i + 1; j < starts[c + 1] && own.size() < most; ++j)
          {
            const std::int64_t s = entries[i].second;
            const std::int64_t t = entries[j].second;
            if (!boxes[s].intersects(boxes[t]))
            {
              continue;
            }
            // A pair in several cells is looked at in that of its common lower corner.
            const Vector3 corner = boxes[s].min().cwiseMax(boxes[t].min());
            if (key(index(corner, 0), index(corner, 1), index(corner, 2)) == entries[i].first &&
              Intersect(points, triangles[s], triangles[t]))
            {
              own.emplace_back(s, t);
            }
          }
        }
      }
      if (!own.empty())
      {
        const std::lock_guard<std::mutex> lock(mutex);
        result.insert(result.end(), own.begin(), own.end());
      }
    });
  std::sort(result.begin(), result.end());
  return result;
}
}
