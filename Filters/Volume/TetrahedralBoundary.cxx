#include "TetrahedralBoundary.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

namespace coronary
{
namespace
{
using Face = std::pair<Triangle, std::int64_t>;

/// A walk from neighbour to neighbour. Faces in the order of the tetrahedra hardly share points with the one before, and
/// are drawn in twice the time.
std::vector<Face> AlongNeighbours(const std::vector<Face>& faces)
{
  struct Edge
  {
    std::int64_t from;
    std::int64_t to;
    std::size_t face;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * faces.size());
  for (std::size_t n = 0; n < faces.size(); ++n)
  {
    const Triangle& face = faces[n].first;
    for (std::size_t k = 0; k < 3; ++k)
    {
      const auto [from, to] = std::minmax(face[k], face[(k + 1) % 3]);
      edges.push_back({ from, to, n });
    }
  }
  std::sort(edges.begin(), edges.end(),
    [](const Edge& a, const Edge& b)
    { return std::tie(a.from, a.to, a.face) < std::tie(b.from, b.to, b.face); });
  std::vector<std::vector<std::size_t>> neighbours(faces.size());
  for (std::size_t n = 1; n < edges.size(); ++n)
  {
    if (edges[n].from == edges[n - 1].from && edges[n].to == edges[n - 1].to)
    {
      neighbours[edges[n].face].push_back(edges[n - 1].face);
      neighbours[edges[n - 1].face].push_back(edges[n].face);
    }
  }
  std::vector<Face> walk;
  walk.reserve(faces.size());
  std::vector<char> seen(faces.size(), 0);
  std::vector<std::size_t> open;
  for (std::size_t first = 0; first < faces.size(); ++first)
  {
    open.push_back(first);
    while (!open.empty())
    {
      const std::size_t face = open.back();
      open.pop_back();
      if (seen[face] == 0)
      {
        seen[face] = 1;
        walk.push_back(faces[face]);
        open.insert(open.end(), neighbours[face].begin(), neighbours[face].end());
      }
    }
  }
  return walk;
}
}

std::vector<std::pair<Triangle, std::int64_t>> BoundaryFaces(
  const std::vector<Tetrahedron>& tetrahedra)
{
  // Sides by their smallest corner, which few share: to sort all of them takes five times as long.
  struct Side
  {
    std::int64_t middle;
    std::int64_t largest;
    std::int64_t cell;
    Triangle face;
  };
  const auto sidesOf = [](const Tetrahedron& t)
  {
    return std::array<Triangle, 4>{ Triangle{ t[1], t[2], t[3] }, Triangle{ t[0], t[3], t[2] },
      Triangle{ t[0], t[1], t[3] }, Triangle{ t[0], t[2], t[1] } };
  };
  std::vector<std::size_t> ends; // of the sides of each smallest corner
  for (const Tetrahedron& t : tetrahedra)
  {
    for (const Triangle& face : sidesOf(t))
    {
      const auto smallest = static_cast<std::size_t>(*std::min_element(face.begin(), face.end()));
      if (smallest >= ends.size())
      {
        ends.resize(smallest + 1);
      }
      ++ends[smallest];
    }
  }
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<Side> sides(4 * tetrahedra.size());
  std::vector<std::size_t> next{ 0 };
  next.insert(next.end(), ends.begin(), ends.end());
  for (std::size_t i = 0; i < tetrahedra.size(); ++i)
  {
    for (const Triangle& face : sidesOf(tetrahedra[i]))
    {
      Triangle sorted = face;
      std::sort(sorted.begin(), sorted.end());
      sides[next[sorted[0]]++] = { sorted[1], sorted[2], static_cast<std::int64_t>(i), face };
    }
  }
  std::vector<std::pair<Triangle, std::int64_t>> boundary;
  std::size_t first = 0;
  for (const std::size_t end : ends)
  {
    std::sort(sides.begin() + first, sides.begin() + end,
      [](const Side& a, const Side& b)
      { return std::tie(a.middle, a.largest) < std::tie(b.middle, b.largest); });
    const auto same = [&sides](std::size_t a, std::size_t b)
    { return sides[a].middle == sides[b].middle && sides[a].largest == sides[b].largest; };
    for (std::size_t n = first; n < end; ++n)
    {
      if (!(n > first && same(n, n - 1)) && !(n + 1 < end && same(n, n + 1)))
      {
        boundary.emplace_back(sides[n].face, sides[n].cell);
      }
    }
    first = end;
  }
  std::sort(boundary.begin(), boundary.end(),
    [](const auto& a, const auto& b)
    { return std::tie(a.second, a.first) < std::tie(b.second, b.first); });
  return AlongNeighbours(boundary);
}
}
