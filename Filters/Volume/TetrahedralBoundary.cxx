#include "TetrahedralBoundary.h"

#include <algorithm>
#include <tuple>

namespace coronary
{
std::vector<std::pair<Triangle, std::int64_t>> BoundaryFaces(
  const std::vector<Tetrahedron>& tetrahedra)
{
  struct Face
  {
    Triangle sorted;
    Triangle face;
    std::int64_t cell;
  };
  std::vector<Face> faces;
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
    [](const Face& a, const Face& b)
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
  return boundary;
}
}
