#include "TetrahedralBoundary.h"

#include <algorithm>
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
  struct Side
  {
    Triangle sorted;
    Triangle face;
    std::int64_t cell;
  };
  std::vector<Side> faces;
  faces.reserve(4 * tetrahedra.size());
  for (std::size_t i = 0; i < tetrahedra.size(); ++i)
  {
    const Tetrahedron& t = tetrahedra[i];
    for (const Triangle& face : { Triangle{ t[1], t[2], t[3] }, Triangle{ t[0], t[3], t[2] },
           Triangle{ t[0], t[1], t[3] }, Triangle{ t[0], t[2], t[1] } })
    {
      Triangle sorted = face;
      std::sort(sorted.begin(), sorted.end());
      faces.push_back({ sorted, face, static_cast<std::int64_t>(i) });
    }
  }
  std::sort(faces.begin(), faces.end(),
    [](const Side& a, const Side& b)
    { return std::tie(a.sorted, a.cell) < std::tie(b.sorted, b.cell); });
  std::vector<std::pair<Triangle, std::int64_t>> boundary;
  for (std::size_t i = 0; i < faces.size(); ++i)
  {
    const bool before = i > 0 && faces[i - 1].sorted == faces[i].sorted;
    const bool after = i + 1 < faces.size() && faces[i + 1].sorted == faces[i].sorted;
    if (!before && !after)
    {
      boundary.emplace_back(faces[i].face, faces[i].cell);
    }
  }
  std::sort(boundary.begin(), boundary.end(),
    [](const auto& a, const auto& b)
    { return std::tie(a.second, a.first) < std::tie(b.second, b.first); });
  return AlongNeighbours(boundary);
}
}
