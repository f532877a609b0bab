#include "SurfaceCells.h"

#include <cmath>

namespace coronary
{
double MinimumCornerAngle(const Vector3& a, const Vector3& b, const Vector3& c)
{
  const double area = (b - a).cross(c - a).norm();
  return std::min({ std::atan2(area, (b - a).dot(c - a)), std::atan2(area, (c - b).dot(a - b)),
    std::atan2(area, (a - c).dot(b - c)) });
}

void SurfaceCells::Remove(const std::vector<char>& bad)
{
  std::size_t i = 0;
  this->Keep([&](const SurfaceCell&) { return bad[i++] == 0; });
}

std::vector<std::int64_t> SurfaceCells::Neighbours() const
{
  std::vector<std::int64_t> neighbours(3 * this->cells.size(), -1);
  const std::vector<TriangleSide> sides = this->Sides();
  const auto place = [&](const TriangleSide& side)
  {
    const Triangle& t = this->cells[side.triangle].corners;
    for (int i = 0; i < 3; ++i)
    {
      if (std::min(t[i], t[(i + 1) % 3]) == side.low && std::max(t[i], t[(i + 1) % 3]) == side.high)
      {
        return 3 * side.triangle + i;
      }
    }
    return std::int64_t(0);
  };
  ForEdges(sides,
    [&](std::size_t first, std::size_t size)
    {
      if (size == 2)
      {
        neighbours[place(sides[first])] = sides[first + 1].triangle;
        neighbours[place(sides[first + 1])] = sides[first].triangle;
      }
    });
  return neighbours;
}

std::vector<std::int64_t> SurfaceCells::Components(std::int64_t& count) const
{
  const std::vector<std::int64_t> neighbours = this->Neighbours();
  std::vector<std::int64_t> component(this->cells.size(), -1);
  count = 0;
  std::vector<std::int64_t> stack;
  for (std::size_t seed = 0; seed < this->cells.size(); ++seed)
  {
    if (component[seed] >= 0)
    {
      continue;
    }
    component[seed] = count;
    stack.assign(1, static_cast<std::int64_t>(seed));
    while (!stack.empty())
    {
      const std::int64_t cell = stack.back();
      stack.pop_back();
      for (int i = 0; i < 3; ++i)
      {
        const std::int64_t next = neighbours[3 * cell + i];
        if (next >= 0 && component[next] < 0)
        {
          component[next] = count;
          stack.push_back(next);
        }
      }
    }
    ++count;
  }
  return component;
}

std::vector<double> SurfaceCells::MeanEdges() const
{
  std::vector<double> sum(this->points.size(), 0.0);
  std::vector<int> count(this->points.size(), 0);
  for (const SurfaceCell& cell : this->cells)
  {
    for (int i = 0; i < 3; ++i)
    {
      const std::int64_t a = cell.corners[i];
      const std::int64_t b = cell.corners[(i + 1) % 3];
      const double length = (this->At(a) - this->At(b)).norm();
      sum[a] += length;
      sum[b] += length;
      ++count[a];
      ++count[b];
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i)
  {
    sum[i] = count[i] > 0 ? sum[i] / count[i] : 0.0;
  }
  return sum;
}

void SurfaceCells::Append(
  const SurfacePatch& patch, const std::vector<std::int64_t>& rim, int cap, bool band)
{
  std::vector<std::int64_t> number = rim;
  for (std::size_t i = rim.size(); i < patch.points.size(); ++i)
  {
    number.push_back(static_cast<std::int64_t>(this->points.size()));
    this->points.push_back(patch.points[i]);
    this->source.push_back(-1);
  }
  for (const Triangle& t : patch.triangles)
  {
    this->cells.push_back({ { number[t[0]], number[t[1]], number[t[2]] }, -1, cap, band });
  }
}
}
