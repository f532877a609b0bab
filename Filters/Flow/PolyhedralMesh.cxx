#include "PolyhedralMesh.h"

#include "Require.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <tuple>

namespace coronary
{
namespace
{
constexpr double SevereAngle = 70.0 * M_PI / 180.0;
constexpr double MaximumSoundSkewness = 4.0;
constexpr std::size_t MostCorners = 4;

/// A face between or on cells, to be sorted.
struct KnownFace
{
  std::array<std::int64_t, MostCorners> sorted; ///< -1 behind the last
  std::int64_t cell = -1;                       ///< -1: it is a boundary face
  std::int64_t index = 0;                       ///< of the cell's faces, or of the boundary
};

std::array<std::int64_t, MostCorners> KeyOf(
  const std::vector<std::int64_t>& corners, std::int64_t points)
{
  Require(corners.size() == 3 || corners.size() == MostCorners,
    "a face has neither three nor four corners");
  std::array<std::int64_t, MostCorners> key{ -1, -1, -1, -1 };
  std::copy(corners.begin(), corners.end(), key.begin());
  std::sort(key.begin(), key.end(), std::greater<>());
  Require(
    key[corners.size() - 1] >= 0 && key[0] < points, "a face has a point that does not exist");
  return key;
}

std::string PlaceOf(std::int64_t cell)
{
  return "cell " + std::to_string(cell);
}

struct InnerFace
{
  std::int64_t owner;
  std::int64_t neighbour;
  std::int64_t index; ///< of the owner's faces
};

struct FaceGeometry
{
  Vector3 centre;
  Vector3 area;
};

/// As finite-volume solvers reckon: triangles around the mean of the corners.
FaceGeometry GeometryOf(
  const PolyhedralMesh& mesh, std::int64_t face, const std::vector<Vector3>& points)
{
  const auto begin = static_cast<std::size_t>(mesh.faceOffset[face]);
  const auto end = static_cast<std::size_t>(mesh.faceOffset[face + 1]);
  const auto corner = [&](std::size_t k) -> const Vector3& { return points[mesh.corners[k]]; };
  if (end - begin == 3)
  {
    const Vector3& a = corner(begin);
    const Vector3& b = corner(begin + 1);
    const Vector3& c = corner(begin + 2);
    return { (a + b + c) / 3.0, 0.5 * (b - a).cross(c - a) };
  }
  Vector3 mean = Vector3::Zero();
  for (std::size_t k = begin; k < end; ++k)
  {
    mean += corner(k);
  }
  mean /= static_cast<double>(end - begin);
  Vector3 area = Vector3::Zero();
  Vector3 moment = Vector3::Zero();
  double sizes = 0.0;
  for (std::size_t k = begin; k < end; ++k)
  {
    const Vector3& a = corner(k);
    const Vector3& b = corner(k + 1 < end ? k + 1 : begin);
    const Vector3 part = 0.5 * (b - a).cross(mean - a);
    area += part;
    sizes += part.norm();
    moment += part.norm() * (a + b + mean) / 3.0;
  }
  return { sizes > 0.0 ? Vector3(moment / sizes) : mean, area };
}

std::vector<FaceGeometry> GeometryOfAll(
  const PolyhedralMesh& mesh, const std::vector<Vector3>& points)
{
  Require(static_cast<std::int64_t>(points.size()) == mesh.points,
    "there is another number of points than the mesh has");
  std::vector<FaceGeometry> faces;
  faces.reserve(mesh.owner.size());
  for (std::int64_t f = 0; f < mesh.NumberOfFaces(); ++f)
  {
    faces.push_back(GeometryOf(mesh, f, points));
    Require(faces.back().area.allFinite() && faces.back().centre.allFinite(),
      "a position of the mesh is not finite");
  }
  return faces;
}

template <typename Visit>
void ForBothSides(const PolyhedralMesh& mesh, const Visit& visit)
{
  for (std::int64_t f = 0; f < mesh.NumberOfFaces(); ++f)
  {
    visit(f, mesh.owner[f], 1.0);
    if (f < mesh.NumberOfInnerFaces())
    {
      visit(f, mesh.neighbour[f], -1.0);
    }
  }
}

struct CellGeometry
{
  std::vector<double> volume;
  std::vector<Vector3> centre;
};

CellGeometry CellsOf(const PolyhedralMesh& mesh, const std::vector<FaceGeometry>& faces)
{
  const auto count = static_cast<std::size_t>(mesh.cells);
  CellGeometry cells{ std::vector<double>(count, 0.0),
    std::vector<Vector3>(count, Vector3::Zero()) };
  std::vector<Vector3> middle(count, Vector3::Zero());
  std::vector<double> facesOf(count, 0.0);
  ForBothSides(mesh,
    [&](std::int64_t f, std::int64_t cell, double)
    {
      middle[cell] += faces[f].centre;
      facesOf[cell] += 1.0;
    });
  for (std::size_t c = 0; c < count; ++c)
  {
    middle[c] /= facesOf[c];
  }
  ForBothSides(mesh,
    [&](std::int64_t f, std::int64_t cell, double sense)
    {
      const double pyramid = sense * faces[f].area.dot(faces[f].centre - middle[cell]) / 3.0;
      cells.volume[cell] += pyramid;
      cells.centre[cell] += pyramid * (0.75 * faces[f].centre + 0.25 * middle[cell]);
    });
  for (std::size_t c = 0; c < count; ++c)
  {
    cells.centre[c] =
      std::abs(cells.volume[c]) > 0.0 ? Vector3(cells.centre[c] / cells.volume[c]) : middle[c];
  }
  return cells;
}

/// Signed volumes that are exact polynomials of the corners: the sum over the triangles around the corners' mean.
double SweptShare(const PolyhedralMesh& mesh, std::int64_t face, const std::vector<Vector3>& points)
{
  const auto begin = static_cast<std::size_t>(mesh.faceOffset[face]);
  const auto end = static_cast<std::size_t>(mesh.faceOffset[face + 1]);
  const auto corner = [&](std::size_t k) -> const Vector3& { return points[mesh.corners[k]]; };
  if (end - begin == 3)
  {
    return corner(begin).dot(corner(begin + 1).cross(corner(begin + 2))) / 6.0;
  }
  Vector3 mean = Vector3::Zero();
  for (std::size_t k = begin; k < end; ++k)
  {
    mean += corner(k);
  }
  mean /= static_cast<double>(end - begin);
  double sum = 0.0;
  for (std::size_t k = begin; k < end; ++k)
  {
    sum += mean.dot(corner(k).cross(corner(k + 1 < end ? k + 1 : begin)));
  }
  return sum / 6.0;
}
}

PolyhedralMesh MakePolyhedralMesh(std::int64_t points, const std::vector<CellFaces>& cells,
  const std::vector<BoundaryFace>& boundary, const std::vector<std::string>& patches)
{
  std::vector<KnownFace> known;
  for (std::size_t c = 0; c < cells.size(); ++c)
  {
    for (std::size_t k = 0; k < cells[c].size(); ++k)
    {
      known.push_back(
        { KeyOf(cells[c][k], points), static_cast<std::int64_t>(c), static_cast<std::int64_t>(k) });
    }
  }
  for (std::size_t b = 0; b < boundary.size(); ++b)
  {
    Require(boundary[b].patch >= 0 && boundary[b].patch < static_cast<int>(patches.size()),
      "a boundary face is of a patch that does not exist");
    known.push_back({ KeyOf(boundary[b].corners, points), -1, static_cast<std::int64_t>(b) });
  }
  std::sort(known.begin(), known.end(),
    [](const KnownFace& a, const KnownFace& b)
    { return std::tie(a.sorted, a.cell, a.index) < std::tie(b.sorted, b.cell, b.index); });

  std::vector<InnerFace> inner;
  std::vector<std::vector<InnerFace>> outer(patches.size());
  for (std::size_t k = 0; k < known.size(); k += 2)
  {
    const KnownFace& first = known[k];
    const bool pair = k + 1 < known.size() && known[k + 1].sorted == first.sorted;
    Require(pair,
      first.cell < 0 ? "a boundary face is of no cell"
                     : "a face of " + PlaceOf(first.cell) + " is of no other cell and of no patch");
    const KnownFace& second = known[k + 1];
    Require(second.cell >= 0, "a boundary face is there twice");
    Require(k + 2 >= known.size() || known[k + 2].sorted != first.sorted,
      "a face of " + PlaceOf(second.cell) + " is of three cells, or on a patch and between two");
    if (first.cell < 0)
    {
      outer[boundary[first.index].patch].push_back({ second.cell, -1, second.index });
    }
    else
    {
      Require(first.cell != second.cell, PlaceOf(first.cell) + " has a face twice");
      inner.push_back({ first.cell, second.cell, first.index });
    }
  }
  const auto byCells = [](const InnerFace& a, const InnerFace& b)
  { return std::tie(a.owner, a.neighbour, a.index) < std::tie(b.owner, b.neighbour, b.index); };
  std::sort(inner.begin(), inner.end(), byCells);

  PolyhedralMesh mesh;
  mesh.points = points;
  mesh.cells = static_cast<std::int64_t>(cells.size());
  mesh.faceOffset.push_back(0);
  const auto add = [&](const InnerFace& face)
  {
    const std::vector<std::int64_t>& corners = cells[face.owner][face.index];
    mesh.corners.insert(mesh.corners.end(), corners.begin(), corners.end());
    mesh.faceOffset.push_back(static_cast<std::int64_t>(mesh.corners.size()));
    mesh.owner.push_back(face.owner);
  };
  for (const InnerFace& face : inner)
  {
    add(face);
    mesh.neighbour.push_back(face.neighbour);
  }
  for (std::size_t p = 0; p < patches.size(); ++p)
  {
    std::sort(outer[p].begin(), outer[p].end(), byCells);
    mesh.patches.push_back(
      { patches[p], mesh.NumberOfFaces(), static_cast<std::int64_t>(outer[p].size()) });
    for (const InnerFace& face : outer[p])
    {
      add(face);
    }
  }
  return mesh;
}

bool PolyhedralQuality::IsSound() const
{
  return this->notPositive == 0 && this->wrongPyramids == 0 &&
    this->maximumNonOrthogonality < 0.5 * M_PI && this->maximumSkewness <= MaximumSoundSkewness;
}

PolyhedralQuality MeasurePolyhedra(const PolyhedralMesh& mesh, const std::vector<Vector3>& points)
{
  const std::vector<FaceGeometry> faces = GeometryOfAll(mesh, points);
  const CellGeometry cells = CellsOf(mesh, faces);
  PolyhedralQuality quality;
  quality.minimumVolume = std::numeric_limits<double>::infinity();
  for (std::int64_t c = 0; c < mesh.cells; ++c)
  {
    quality.totalVolume += cells.volume[c];
    quality.notPositive += cells.volume[c] > 0.0 ? 0 : 1;
    if (cells.volume[c] < quality.minimumVolume)
    {
      quality.minimumVolume = cells.volume[c];
      quality.minimumVolumeAt = c;
    }
  }
  std::vector<Vector3> sum(static_cast<std::size_t>(mesh.cells), Vector3::Zero());
  std::vector<double> sizes(static_cast<std::size_t>(mesh.cells), 0.0);
  ForBothSides(mesh,
    [&](std::int64_t f, std::int64_t cell, double sense)
    {
      sum[cell] += sense * faces[f].area;
      sizes[cell] += faces[f].area.norm();
      quality.wrongPyramids +=
        sense * faces[f].area.dot(faces[f].centre - cells.centre[cell]) > 0.0 ? 0 : 1;
    });
  for (std::int64_t c = 0; c < mesh.cells; ++c)
  {
    quality.maximumOpenness = std::max(quality.maximumOpenness, sum[c].norm() / sizes[c]);
  }
  double cosines = 0.0;
  for (std::int64_t f = 0; f < mesh.NumberOfFaces(); ++f)
  {
    const bool isInner = f < mesh.NumberOfInnerFaces();
    const Vector3& from = cells.centre[mesh.owner[f]];
    const FaceGeometry& face = faces[f];
    const Vector3 unit = face.area.normalized();
    // Beyond a patch there is no cell: the line is the normal to the patch.
    const Vector3 line = isInner ? Vector3(cells.centre[mesh.neighbour[f]] - from)
                                 : Vector3(unit * unit.dot(face.centre - from));
    if (isInner)
    {
      const double angle = std::acos(std::clamp(unit.dot(line) / line.norm(), -1.0, 1.0));
      cosines += std::cos(angle);
      quality.severeNonOrthogonality += angle > SevereAngle ? 1 : 0;
      if (angle > quality.maximumNonOrthogonality)
      {
        quality.maximumNonOrthogonality = angle;
        quality.maximumNonOrthogonalityAt = f;
      }
    }
    // How far from the face's centre the line goes through it, over the face's size in that direction.
    const Vector3 toCentre = face.centre - from;
    const double along = unit.dot(line);
    const Vector3 off = toCentre - (unit.dot(toCentre) / (along != 0.0 ? along : 1e-300)) * line;
    const Vector3 direction = off / std::max(off.norm(), 1e-300);
    double size = (isInner ? 0.2 : 0.4) * line.norm();
    for (std::int64_t k = mesh.faceOffset[f]; k < mesh.faceOffset[f + 1]; ++k)
    {
      size = std::max(size, std::abs(direction.dot(points[mesh.corners[k]] - face.centre)));
    }
    const double skewness = off.norm() / size;
    if (skewness > quality.maximumSkewness)
    {
      quality.maximumSkewness = skewness;
      quality.maximumSkewnessAt = f;
    }
  }
  quality.meanNonOrthogonality = mesh.NumberOfInnerFaces() > 0
    ? std::acos(std::clamp(cosines / static_cast<double>(mesh.NumberOfInnerFaces()), -1.0, 1.0))
    : 0.0;
  return quality;
}

std::vector<double> PolyhedraVolumes(const PolyhedralMesh& mesh, const std::vector<Vector3>& points)
{
  Require(static_cast<std::int64_t>(points.size()) == mesh.points,
    "there is another number of points than the mesh has");
  std::vector<double> volume(static_cast<std::size_t>(mesh.cells), 0.0);
  for (std::int64_t f = 0; f < mesh.NumberOfFaces(); ++f)
  {
    const double share = SweptShare(mesh, f, points);
    volume[mesh.owner[f]] += share;
    if (f < mesh.NumberOfInnerFaces())
    {
      volume[mesh.neighbour[f]] -= share;
    }
  }
  return volume;
}

double LeastVolumeRatioBetween(
  const PolyhedralMesh& mesh, const std::vector<Vector3>& from, const std::vector<Vector3>& to)
{
  Require(from.size() == to.size(), "a mesh has another number of points later on");
  std::array<std::vector<double>, 4> at;
  // Far from the origin the shares of the faces would cancel.
  const Vector3 origin = std::accumulate(from.begin(), from.end(), Vector3(Vector3::Zero())) /
    static_cast<double>(from.size());
  std::vector<Vector3> points(from.size());
  for (int k = 0; k < 4; ++k)
  {
    for (std::size_t n = 0; n < from.size(); ++n)
    {
      points[n] = from[n] + (k / 3.0) * (to[n] - from[n]) - origin;
    }
    at[static_cast<std::size_t>(k)] = PolyhedraVolumes(mesh, points);
  }
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < at[0].size(); ++c)
  {
    const double v0 = at[0][c];
    const double v3 = at[3][c];
    // Values at thirds to Bernstein coefficients.
    const double b1 = (-5.0 * v0 + 18.0 * at[1][c] - 9.0 * at[2][c] + 2.0 * v3) / 6.0;
    const double b2 = (2.0 * v0 - 9.0 * at[1][c] + 18.0 * at[2][c] - 5.0 * v3) / 6.0;
    least = std::min(least, std::min({ v0, b1, b2, v3 }) / std::abs(v0));
  }
  return least;
}
}
