// Tetrahedral meshes: closed forms, the skeleton inside, refusals with their places, and workers that
// crash, hang, leave or talk nonsense.
#include "TetrahedralMesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <numeric>
#include <set>
#include <string>

#include <sys/stat.h>
#include <unistd.h>

namespace UnitTestTetrahedralMesh
{
using coronary::MakeTetrahedralMesh;
using coronary::SurfaceError;
using coronary::TetrahedralBackend;
using coronary::TetrahedralMesh;
using coronary::TetrahedralMeshInput;
using coronary::TetrahedralMeshSettings;
using coronary::Triangle;
using coronary::Vector3;

namespace
{
constexpr double degree = M_PI / 180.0;

/// A box from the origin, n squares along each edge, each cut in two.
TetrahedralMeshInput Box(const Vector3& size, int n, const Vector3& origin = Vector3::Zero())
{
  TetrahedralMeshInput box;
  std::map<std::array<int, 3>, std::int64_t> known;
  const auto point = [&](const std::array<int, 3>& p)
  {
    const auto [found, isNew] = known.try_emplace(p, static_cast<std::int64_t>(box.points.size()));
    if (isNew)
    {
      box.points.emplace_back(
        origin + size.cwiseProduct(Vector3(p[0], p[1], p[2]) / static_cast<double>(n)));
    }
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis)
  {
    for (const int side : { 0, n })
    {
      for (int i = 0; i < n; ++i)
      {
        for (int j = 0; j < n; ++j)
        {
          const auto at = [&](int di, int dj)
          {
            std::array<int, 3> p{};
            p[axis] = side;
            p[(axis + 1) % 3] = i + di;
            p[(axis + 2) % 3] = j + dj;
            return point(p);
          };
          Triangle s{ at(0, 0), at(1, 0), at(1, 1) };
          Triangle t{ at(0, 0), at(1, 1), at(0, 1) };
          if (side == 0)
          {
            std::swap(s[1], s[2]);
            std::swap(t[1], t[2]);
          }
          box.triangles.push_back(s);
          box.triangles.push_back(t);
        }
      }
    }
  }
  return box;
}

/// A sphere from a cube's surface.
TetrahedralMeshInput Sphere(double radius, int n, const Vector3& centre = Vector3::Zero())
{
  TetrahedralMeshInput sphere = Box(Vector3::Constant(2.0), n, Vector3::Constant(-1.0));
  for (Vector3& p : sphere.points)
  {
    p = centre +
      radius *
        Vector3(std::tan(p[0] * M_PI / 4), std::tan(p[1] * M_PI / 4), std::tan(p[2] * M_PI / 4))
          .normalized();
  }
  return sphere;
}

/// A tube along z with flat caps, the polygon of n corners; its centerline from cap to cap.
TetrahedralMeshInput Tube(double radius, double length, int n, int bones)
{
  TetrahedralMeshInput tube;
  const double step = 2.0 * M_PI * radius / n;
  const int rows = static_cast<int>(std::lround(length / step));
  for (int i = 0; i <= rows; ++i)
  {
    for (int j = 0; j < n; ++j)
    {
      const double angle = 2.0 * M_PI * (j + 0.5 * (i % 2)) / n;
      tube.points.emplace_back(
        radius * std::cos(angle), radius * std::sin(angle), length * i / rows);
    }
  }
  const auto at = [n](int i, int j) -> std::int64_t { return i * n + (j + n) % n; };
  for (int i = 0; i < rows; ++i)
  {
    for (int j = 0; j < n; ++j)
    {
      if (i % 2 == 0)
      {
        tube.triangles.push_back({ at(i, j), at(i, j + 1), at(i + 1, j) });
        tube.triangles.push_back({ at(i, j + 1), at(i + 1, j + 1), at(i + 1, j) });
      }
      else
      {
        tube.triangles.push_back({ at(i, j), at(i, j + 1), at(i + 1, j + 1) });
        tube.triangles.push_back({ at(i, j), at(i + 1, j + 1), at(i + 1, j) });
      }
    }
  }
  // Caps: rings of fewer and fewer corners would be finer; a fan around the centre does for a test.
  for (const int row : { 0, rows })
  {
    const auto ring = static_cast<std::int64_t>(tube.points.size());
    for (int j = 0; j < n; ++j)
    {
      const Vector3 rim = tube.points[at(row, j)];
      tube.points.emplace_back(0.5 * rim[0], 0.5 * rim[1], rim[2]);
    }
    const auto centre = static_cast<std::int64_t>(tube.points.size());
    tube.points.emplace_back(0.1 * radius, 0.0, length * row / rows);
    const auto add = [&](std::int64_t a, std::int64_t b, std::int64_t c) {
      tube.triangles.push_back(row == 0 ? Triangle{ a, c, b } : Triangle{ a, b, c });
    };
    for (int j = 0; j < n; ++j)
    {
      const std::int64_t k = (j + 1) % n;
      add(at(row, j), at(row, j + 1), ring + j);
      add(at(row, j + 1), ring + k, ring + j);
      add(ring + j, ring + k, centre);
    }
  }
  for (int i = 0; i <= bones; ++i)
  {
    tube.skeletonPoints.emplace_back(0.0, 0.0, length * i / bones);
    tube.skeletonRadius.push_back(radius);
    if (i > 0)
    {
      tube.skeletonEdges.emplace_back(i - 1, i);
    }
  }
  return tube;
}

double EnclosedVolume(const TetrahedralMeshInput& surface)
{
  double volume = 0.0;
  for (const Triangle& t : surface.triangles)
  {
    volume += surface.points[t[0]].cross(surface.points[t[1]]).dot(surface.points[t[2]]) / 6.0;
  }
  return volume;
}

double Sum(const std::vector<double>& values)
{
  return std::accumulate(values.begin(), values.end(), 0.0);
}

void ExpectGoodShapes(const TetrahedralMesh& mesh)
{
  ASSERT_FALSE(mesh.tetrahedra.empty());
  std::size_t poor = 0;
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i)
  {
    EXPECT_GT(mesh.volume[i], 1e-7);
    EXPECT_GE(mesh.minimumDihedral[i], 5.0 * degree);
    poor += mesh.minimumDihedral[i] < 15.0 * degree ? 1 : 0;
  }
  EXPECT_LE(static_cast<double>(poor), 0.01 * static_cast<double>(mesh.tetrahedra.size()));
}

/// Every skeleton point is a vertex at its own place, every edge a chain of edges from end to end.
void ExpectSkeletonInside(const TetrahedralMesh& mesh, const TetrahedralMeshInput& input)
{
  std::map<std::int64_t, std::int64_t> vertex;
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
  {
    if (mesh.skeletonPoint[i] >= 0)
    {
      vertex[mesh.skeletonPoint[i]] = static_cast<std::int64_t>(i);
      EXPECT_EQ(mesh.points[i], input.skeletonPoints[mesh.skeletonPoint[i]]);
    }
  }
  EXPECT_EQ(vertex.size(), input.skeletonPoints.size());
  std::set<std::pair<std::int64_t, std::int64_t>> edges;
  for (const auto& t : mesh.tetrahedra)
  {
    for (int i = 0; i < 4; ++i)
    {
      for (int j = 0; j < 4; ++j)
      {
        edges.emplace(t[i], t[j]);
      }
    }
  }
  std::vector<double> length(input.skeletonEdges.size(), 0.0);
  for (const TetrahedralMesh::Edge& edge : mesh.skeletonEdges)
  {
    EXPECT_EQ(edges.count({ edge.from, edge.to }), 1U);
    length[edge.skeletonEdge] += (mesh.points[edge.to] - mesh.points[edge.from]).norm();
  }
  for (std::size_t e = 0; e < length.size(); ++e)
  {
    const auto& [a, b] = input.skeletonEdges[e];
    EXPECT_NEAR(length[e], (input.skeletonPoints[b] - input.skeletonPoints[a]).norm(), 1e-9);
  }
}

std::string RefusalOf(
  const TetrahedralMeshInput& input, const TetrahedralMeshSettings& settings = {})
{
  try
  {
    MakeTetrahedralMesh(input, settings);
  }
  catch (const std::exception& error)
  {
    return error.what();
  }
  return "";
}

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

class TetGen : public testing::Test
{
protected:
  void SetUp() override
  {
    if (!coronary::HasTetrahedralBackend(TetrahedralBackend::TetGen))
    {
      GTEST_SKIP() << "built without TetGen";
    }
  }
};

class Cgal : public testing::Test
{
protected:
  void SetUp() override
  {
    if (!coronary::HasTetrahedralBackend(TetrahedralBackend::Cgal))
    {
      GTEST_SKIP() << "built without CGAL";
    }
    this->Settings.backend = TetrahedralBackend::Cgal;
  }

  TetrahedralMeshSettings Settings;
};

/// A folder with a shell script in the place of TetGen's worker.
class Impostor
{
public:
  explicit Impostor(const std::string& script)
  {
    char name[] = "/tmp/impostorXXXXXX";
    this->Folder = ::mkdtemp(name);
    const std::string file = this->Folder + "/coronary-tetgen-worker";
    std::ofstream(file) << "#!/bin/sh\n" << script << "\n";
    ::chmod(file.c_str(), 0755);
  }
  ~Impostor()
  {
    ::unlink((this->Folder + "/coronary-tetgen-worker").c_str());
    ::rmdir(this->Folder.c_str());
  }
  Impostor(const Impostor&) = delete;
  Impostor& operator=(const Impostor&) = delete;

  TetrahedralMeshSettings Settings(double timeLimit = 60.0) const
  {
    TetrahedralMeshSettings settings;
    settings.workerFolder = this->Folder;
    settings.timeLimit = timeLimit;
    return settings;
  }

private:
  std::string Folder;
};
}

TEST(TetrahedronQuality, OfTheRegularOne)
{
  const Vector3 a(1, 1, 1);
  const Vector3 b(1, -1, -1);
  const Vector3 c(-1, 1, -1);
  const Vector3 d(-1, -1, 1);
  const double sign = coronary::TetrahedronVolume(a, b, c, d) > 0.0 ? 1.0 : -1.0;
  EXPECT_NEAR(sign * coronary::TetrahedronVolume(a, b, c, d), 8.0 / 3.0, 1e-12);
  const Vector3& p = sign > 0.0 ? c : d;
  const Vector3& q = sign > 0.0 ? d : c;
  EXPECT_NEAR(coronary::MinimumDihedralAngle(a, b, p, q), std::acos(1.0 / 3.0), 1e-12);
  EXPECT_NEAR(coronary::MinimumDihedralSine(a, b, p, q), std::sin(std::acos(1.0 / 3.0)), 1e-12);
  EXPECT_NEAR(coronary::RadiusEdgeRatio(a, b, p, q), std::sqrt(6.0) / 4.0, 1e-12);
  EXPECT_EQ(coronary::MinimumDihedralAngle(a, b, q, p), 0.0);
  EXPECT_LT(coronary::MinimumDihedralSine(a, b, q, p), 0.0);
}

TEST(TetrahedronQuality, OfACornerAndOfASliver)
{
  const Vector3 o(0, 0, 0);
  EXPECT_NEAR(
    coronary::MinimumDihedralAngle(o, Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, 1)),
    std::acos(1.0 / std::sqrt(3.0)), 1e-12);
  // Height h over a right angle: the angle at the long edge is atan(h sqrt 2).
  EXPECT_NEAR(
    coronary::MinimumDihedralAngle(o, Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, 0.01)),
    std::atan(0.01 * std::sqrt(2.0)), 1e-12);
}

TEST_F(TetGen, FillsABox)
{
  const TetrahedralMeshInput box = Box(Vector3(3.0, 2.0, 1.5), 6);
  const TetrahedralMesh mesh = MakeTetrahedralMesh(box);
  EXPECT_NEAR(Sum(mesh.volume), 9.0, 1e-9);
  ExpectGoodShapes(mesh);
  EXPECT_EQ(mesh.boundary.size(), box.triangles.size());
  EXPECT_TRUE(mesh.warnings.empty());
  EXPECT_EQ(mesh.tries, 1);
  for (std::size_t i = 0; i < mesh.boundary.size(); ++i)
  {
    Triangle source = box.triangles[mesh.boundaryCell[i]];
    Triangle found;
    for (int k = 0; k < 3; ++k)
    {
      found[k] = mesh.surfacePoint[mesh.boundary[i][k]];
      EXPECT_EQ(mesh.points[mesh.boundary[i][k]], box.points[found[k]]);
    }
    // The same corners in the same sense.
    std::rotate(source.begin(), std::find(source.begin(), source.end(), found[0]), source.end());
    EXPECT_EQ(source, found);
  }
}

TEST_F(TetGen, FillsASphereFarFromTheOrigin)
{
  const Vector3 far(-12345.0, 5000.0, 80000.0);
  const TetrahedralMeshInput sphere = Sphere(2.0, 14, far);
  const TetrahedralMesh mesh = MakeTetrahedralMesh(sphere);
  EXPECT_NEAR(Sum(mesh.volume), EnclosedVolume(Sphere(2.0, 14)), 1e-6);
  EXPECT_NEAR(Sum(mesh.volume), 4.0 / 3.0 * M_PI * 8.0, 0.02 * 33.5);
  ExpectGoodShapes(mesh);
}

TEST_F(TetGen, KeepsTheCenterlineOfATube)
{
  const TetrahedralMeshInput tube = Tube(1.5, 20.0, 24, 40);
  const TetrahedralMesh mesh = MakeTetrahedralMesh(tube);
  const double polygon = 0.5 * 24 * 1.5 * 1.5 * std::sin(2.0 * M_PI / 24);
  EXPECT_NEAR(Sum(mesh.volume), EnclosedVolume(tube), 1e-9);
  EXPECT_NEAR(Sum(mesh.volume), polygon * 20.0, 0.01 * polygon * 20.0);
  ExpectGoodShapes(mesh);
  ExpectSkeletonInside(mesh, tube);
}

TEST_F(TetGen, SplitsALongBone)
{
  const TetrahedralMeshInput tube = Tube(1.5, 20.0, 24, 1);
  const TetrahedralMesh mesh = MakeTetrahedralMesh(tube);
  EXPECT_GT(mesh.skeletonEdges.size(), 10U);
  ExpectGoodShapes(mesh);
  ExpectSkeletonInside(mesh, tube);
}

TEST_F(TetGen, MeshesSeveralSurfacesWithTheirNumbers)
{
  TetrahedralMeshInput both = Sphere(2.0, 8);
  const TetrahedralMeshInput other = Sphere(1.0, 6, Vector3(5.0, 0.0, 0.0));
  const auto first = static_cast<std::int64_t>(both.points.size());
  both.points.insert(both.points.end(), other.points.begin(), other.points.end());
  for (const Triangle& t : other.triangles)
  {
    both.triangles.push_back({ t[0] + first, t[1] + first, t[2] + first });
  }
  const TetrahedralMesh mesh = MakeTetrahedralMesh(both);
  double volume[2] = { 0.0, 0.0 };
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i)
  {
    volume[mesh.region[i]] += mesh.volume[i];
  }
  EXPECT_NEAR(volume[0], EnclosedVolume(Sphere(2.0, 8)), 1e-9);
  EXPECT_NEAR(volume[1], EnclosedVolume(Sphere(1.0, 6)), 1e-9);
}

TEST_F(TetGen, RepeatsToTheBitOnAnyNumberOfThreads)
{
  const TetrahedralMeshInput tube = Tube(1.0, 8.0, 20, 10);
  coronary::SetNumberOfThreads(1);
  const TetrahedralMesh one = MakeTetrahedralMesh(tube);
  coronary::SetNumberOfThreads(4);
  const TetrahedralMesh four = MakeTetrahedralMesh(tube);
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(one.points, four.points);
  EXPECT_EQ(one.tetrahedra, four.tetrahedra);
}

TEST_F(TetGen, SizesFollowTheRadius)
{
  const TetrahedralMeshInput tube = Tube(3.0, 10.0, 60, 10);
  TetrahedralMeshSettings settings;
  settings.sizeFactor = 0.15;
  const std::size_t fine = MakeTetrahedralMesh(tube, settings).tetrahedra.size();
  const std::size_t coarse = MakeTetrahedralMesh(tube).tetrahedra.size();
  EXPECT_GT(static_cast<double>(fine), 1.3 * static_cast<double>(coarse));
}

TEST_F(TetGen, TurnsOverWhatIsInsideOut)
{
  TetrahedralMeshInput box = Box(Vector3(3.0, 2.0, 1.5), 4);
  for (Triangle& t : box.triangles)
  {
    std::swap(t[0], t[1]);
  }
  const TetrahedralMesh mesh = MakeTetrahedralMesh(box);
  EXPECT_NEAR(Sum(mesh.volume), 9.0, 1e-9);
  ASSERT_EQ(mesh.warnings.size(), 1U);
  EXPECT_SAYS(mesh.warnings[0], "turned over");
}

TEST_F(TetGen, RepairsASmallSelfIntersection)
{
  TetrahedralMeshInput sphere = Sphere(2.0, 40);
  // One point shifted beyond its neighbours, a little above: its triangles go in and out again.
  std::size_t at = 0;
  for (std::size_t i = 0; i < sphere.points.size(); ++i)
  {
    at = sphere.points[i][0] > sphere.points[at][0] ? i : at;
  }
  sphere.points[at] = 2.001 * (sphere.points[at] + Vector3(0.0, 0.17, 0.03)).normalized();
  sphere.skeletonPoints.emplace_back(0.0, 0.0, 0.0);
  sphere.skeletonRadius.push_back(2.0);
  TetrahedralMeshSettings settings;
  settings.repair = false;
  const std::string refusal = RefusalOf(sphere, settings);
  EXPECT_SAYS(refusal, "the surface cuts itself");
  settings.repair = true;
  settings.repairLimit = 0.1;
  const TetrahedralMesh mesh = MakeTetrahedralMesh(sphere, settings);
  EXPECT_EQ(mesh.tries, 2);
  EXPECT_GT(mesh.repairDisplacement, 0.0);
  EXPECT_LE(mesh.repairDisplacement, 0.1 * 2.0);
  // What needs more than the limit stays an error.
  settings.repairLimit = 0.0001;
  EXPECT_SAYS(RefusalOf(sphere, settings), "the surface cuts itself");
}

TEST_F(Cgal, KeepsTheCenterlineOfATube)
{
  const TetrahedralMeshInput tube = Tube(1.5, 20.0, 24, 20);
  const TetrahedralMesh mesh = MakeTetrahedralMesh(tube, this->Settings);
  EXPECT_EQ(mesh.backend, TetrahedralBackend::Cgal);
  EXPECT_GE(*std::min_element(mesh.minimumDihedral.begin(), mesh.minimumDihedral.end()),
    5.0 * M_PI / 180.0);
  EXPECT_GT(*std::min_element(mesh.volume.begin(), mesh.volume.end()), 1e-7);
  const double volume = 20.0 * 12.0 * 1.5 * 1.5 * std::sin(2.0 * M_PI / 24.0);
  EXPECT_NEAR(std::accumulate(mesh.volume.begin(), mesh.volume.end(), 0.0), volume, 0.02 * volume);
  // Every point of the skeleton, to the last bit, and all of its length.
  std::set<std::int64_t> found;
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
  {
    EXPECT_EQ(mesh.surfacePoint[i], -1);
    if (mesh.skeletonPoint[i] >= 0)
    {
      found.insert(mesh.skeletonPoint[i]);
      EXPECT_EQ(mesh.points[i], tube.skeletonPoints[mesh.skeletonPoint[i]]);
    }
  }
  EXPECT_EQ(found.size(), tube.skeletonPoints.size());
  double length = 0.0;
  for (const TetrahedralMesh::Edge& edge : mesh.skeletonEdges)
  {
    length += (mesh.points[edge.from] - mesh.points[edge.to]).norm();
  }
  EXPECT_NEAR(length, 20.0, 1e-6);
  // Each boundary triangle has the nearest given one: those of the caps are on the caps.
  ASSERT_EQ(mesh.boundary.size(), mesh.boundaryCell.size());
  for (std::size_t i = 0; i < mesh.boundary.size(); ++i)
  {
    const auto height = [](const std::vector<Vector3>& points, const Triangle& t)
    { return (points[t[0]][2] + points[t[1]][2] + points[t[2]][2]) / 3.0; };
    EXPECT_NEAR(height(mesh.points, mesh.boundary[i]),
      height(tube.points, tube.triangles[mesh.boundaryCell[i]]), 0.6);
  }
}

TEST_F(TetGen, PutsEndsThatStickOutOntoTheCap)
{
  TetrahedralMeshInput tube = Tube(1.5, 20.0, 24, 10);
  tube.skeletonPoints.front()[2] = -0.05;
  tube.skeletonPoints.back()[2] = 20.03;
  const TetrahedralMesh mesh = MakeTetrahedralMesh(tube);
  ASSERT_EQ(mesh.warnings.size(), 1U);
  EXPECT_SAYS(mesh.warnings[0], "2 skeleton points beside the surface were put on it");
  EXPECT_SAYS(mesh.warnings[0], "0.05 mm");
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
  {
    if (mesh.skeletonPoint[i] == 0)
    {
      EXPECT_NEAR(mesh.points[i][2], 0.0, 1e-12);
    }
  }
  EXPECT_EQ(std::count(mesh.skeletonPoint.begin(), mesh.skeletonPoint.end(), 0), 1);
}

TEST_F(TetGen, LeavesNoFlatTetrahedraBelowACap)
{
  // An end a little below the cap, over a corner of the cap's triangles and beside one.
  for (const double depth : { 0.016, 0.03, 0.05, 0.1, 0.14 })
  {
    for (const double aside : { 0.15, 0.153, 0.2, 0.4 })
    {
      TetrahedralMeshInput tube = Tube(1.5, 20.0, 24, 10);
      tube.skeletonPoints.front() = Vector3(aside, 0.0, depth);
      const TetrahedralMesh mesh = MakeTetrahedralMesh(tube);
      EXPECT_GE(
        *std::min_element(mesh.minimumDihedral.begin(), mesh.minimumDihedral.end()), 5.0 * degree)
        << "depth " << depth << ", " << aside << " from the middle";
      const auto at = std::find(mesh.skeletonPoint.begin(), mesh.skeletonPoint.end(), 0);
      ASSERT_NE(at, mesh.skeletonPoint.end());
      EXPECT_LE(
        (mesh.points[at - mesh.skeletonPoint.begin()] - tube.skeletonPoints[0]).norm(), 0.15);
    }
  }
}

TEST_F(TetGen, LiftsTheWallOffASkeletonThatGrazesIt)
{
  for (const double depth : { 0.016, 0.03, 0.06, 0.15 })
  {
    TetrahedralMeshInput tube = Tube(1.5, 20.0, 24, 20);
    const double angle = M_PI / 24.0;
    const double distance = 1.5 * std::cos(angle) - depth;
    for (const std::size_t point : { 9, 10, 11 })
    {
      tube.skeletonPoints[point] = Vector3(
        distance * std::cos(angle), distance * std::sin(angle), tube.skeletonPoints[point][2]);
    }
    const TetrahedralMesh mesh = MakeTetrahedralMesh(tube);
    EXPECT_GE(
      *std::min_element(mesh.minimumDihedral.begin(), mesh.minimumDihedral.end()), 5.0 * degree)
      << "depth " << depth;
    EXPECT_LE(mesh.tries, depth < 0.02 ? 2 : 1);
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
    {
      // On the caps points are shifted within the plane, to the ends of the skeleton.
      if (mesh.surfacePoint[i] >= 0 && mesh.points[i][2] > 1.0 && mesh.points[i][2] < 19.0)
      {
        EXPECT_LE((mesh.points[i] - tube.points[mesh.surfacePoint[i]]).norm(), 0.015 + 1e-9);
      }
      if (mesh.skeletonPoint[i] >= 0)
      {
        EXPECT_LE((mesh.points[i] - tube.skeletonPoints[mesh.skeletonPoint[i]]).norm(), 0.015);
      }
    }
  }
  // Without the repair the mesh is given all the same, and says where it is flat.
  TetrahedralMeshInput tube = Tube(1.5, 20.0, 24, 20);
  const double angle = M_PI / 24.0;
  for (const std::size_t point : { 9, 10, 11 })
  {
    const double distance = 1.5 * std::cos(angle) - 0.016;
    tube.skeletonPoints[point] = Vector3(
      distance * std::cos(angle), distance * std::sin(angle), tube.skeletonPoints[point][2]);
  }
  TetrahedralMeshSettings settings;
  settings.repair = false;
  const TetrahedralMesh mesh = MakeTetrahedralMesh(tube, settings);
  EXPECT_LT(
    *std::min_element(mesh.minimumDihedral.begin(), mesh.minimumDihedral.end()), 5.0 * degree);
  ASSERT_FALSE(mesh.warnings.empty());
  EXPECT_SAYS(mesh.warnings.back(), "a flat tetrahedron is left at (");
}

TEST_F(TetGen, NamesAFlatTetrahedronThatIsLeft)
{
  // A wedge of 3 degrees: no tetrahedron at its edge can have more.
  TetrahedralMeshInput wedge;
  const double height = std::tan(3.0 * degree);
  wedge.points = { { 0, 0, 0 }, { 1, 0, 0 }, { 1, 0, height }, { 0, 1, 0 }, { 1, 1, 0 },
    { 1, 1, height } };
  wedge.triangles = { { 0, 2, 1 }, { 3, 4, 5 }, { 0, 1, 4 }, { 0, 4, 3 }, { 1, 2, 5 }, { 1, 5, 4 },
    { 0, 3, 5 }, { 0, 5, 2 } };
  std::transform(wedge.triangles.begin(), wedge.triangles.end(), wedge.triangles.begin(),
    [](const Triangle& t) {
      return Triangle{ t[0], t[2], t[1] };
    });
  const TetrahedralMesh mesh = MakeTetrahedralMesh(wedge);
  ASSERT_FALSE(mesh.warnings.empty());
  EXPECT_SAYS(mesh.warnings.back(), "a flat tetrahedron is left at (");
  EXPECT_SAYS(mesh.warnings.back(), "degrees");
  EXPECT_LE(mesh.tries, 2);
}

TEST_F(TetGen, RefusesSkeletonPointsOutside)
{
  TetrahedralMeshInput tube = Tube(1.5, 20.0, 24, 10);
  tube.skeletonPoints[4] = Vector3(3.0, 0.0, 8.0);
  const std::string text = RefusalOf(tube);
  EXPECT_SAYS(text, "skeleton point 4 at (3, 0, 8) lies 1.5");
  TetrahedralMeshSettings settings;
  settings.outside = coronary::OutsidePolicy::LeaveOut;
  const TetrahedralMesh mesh = MakeTetrahedralMesh(tube, settings);
  EXPECT_EQ(std::count(mesh.skeletonPoint.begin(), mesh.skeletonPoint.end(), 4), 0);
  EXPECT_EQ(std::count(mesh.skeletonPoint.begin(), mesh.skeletonPoint.end(), 5), 1);
  ASSERT_FALSE(mesh.warnings.empty());
  EXPECT_SAYS(mesh.warnings[0], "1 skeleton points outside");
}

TEST_F(TetGen, RefusesABoneThroughTheWall)
{
  // A bent tube would do; here a bone between two spheres.
  TetrahedralMeshInput both = Sphere(2.0, 8);
  const TetrahedralMeshInput other = Sphere(2.0, 8, Vector3(6.0, 0.0, 0.0));
  const auto first = static_cast<std::int64_t>(both.points.size());
  both.points.insert(both.points.end(), other.points.begin(), other.points.end());
  for (const Triangle& t : other.triangles)
  {
    both.triangles.push_back({ t[0] + first, t[1] + first, t[2] + first });
  }
  both.skeletonPoints = { Vector3(0, 0, 0), Vector3(6, 0, 0) };
  both.skeletonEdges = { { 0, 1 } };
  EXPECT_SAYS(RefusalOf(both), "skeleton edge 0 from point 0 at (0, 0, 0) to point 1 leaves");
}

TEST_F(TetGen, StopsWhenAsked)
{
  int calls = 0;
  EXPECT_THROW(
    MakeTetrahedralMesh(Tube(1.5, 20.0, 40, 10), {}, [&calls](double) { return ++calls < 6; }),
    coronary::Cancelled);
}

TEST(TetrahedralMeshRefuses, SurfacesThatAreNone)
{
  EXPECT_SAYS(RefusalOf({}), "the surface is empty");
  TetrahedralMeshInput open = Box(Vector3(1, 1, 1), 3);
  open.triangles.erase(open.triangles.begin() + 7);
  EXPECT_SAYS(RefusalOf(open), "the surface is open: 3 edges");
  EXPECT_SAYS(RefusalOf(open), " at (");

  TetrahedralMeshInput doubled = Box(Vector3(1, 1, 1), 3);
  const std::vector<Triangle> once = doubled.triangles;
  doubled.triangles.insert(doubled.triangles.end(), once.begin(), once.end());
  EXPECT_SAYS(RefusalOf(doubled), "doubled");
  EXPECT_SAYS(RefusalOf(doubled), "cells 108, 109");

  // Two boxes that share an edge.
  TetrahedralMeshInput touching = Box(Vector3(1, 1, 1), 1);
  const TetrahedralMeshInput second = Box(Vector3(1, 1, 1), 1, Vector3(1, 1, 0));
  const auto first = static_cast<std::int64_t>(touching.points.size());
  touching.points.insert(touching.points.end(), second.points.begin(), second.points.end());
  for (const Triangle& t : second.triangles)
  {
    touching.triangles.push_back({ t[0] + first, t[1] + first, t[2] + first });
  }
  EXPECT_SAYS(RefusalOf(touching), "not a manifold: 1 edges");

  TetrahedralMeshInput flat;
  flat.points = { { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 0.3, 0.3, 0 } };
  flat.triangles = { { 0, 1, 3 }, { 1, 2, 3 }, { 2, 0, 3 }, { 0, 2, 1 } };
  EXPECT_SAYS(RefusalOf(flat), "encloses no volume");

  TetrahedralMeshInput thin = Box(Vector3(1, 1, 1), 2);
  thin.triangles[5][1] = thin.triangles[5][0];
  EXPECT_SAYS(RefusalOf(thin), "without area: cell 5 at");
  TetrahedralMeshInput wrong = Box(Vector3(1, 1, 1), 2);
  wrong.triangles[3][2] = 1000;
  EXPECT_SAYS(RefusalOf(wrong), "cell 3 of the surface has point 1000");
  wrong = Box(Vector3(1, 1, 1), 2);
  wrong.points[4][1] = std::nan("");
  EXPECT_SAYS(RefusalOf(wrong), "point 4 of the surface is not finite");
}

TEST(TetrahedralMeshRefuses, SurfacesThatCutThemselves)
{
  TetrahedralMeshInput both = Sphere(2.0, 8);
  const TetrahedralMeshInput other = Sphere(2.0, 8, Vector3(2.5, 0.1, 0.2));
  const auto first = static_cast<std::int64_t>(both.points.size());
  both.points.insert(both.points.end(), other.points.begin(), other.points.end());
  for (const Triangle& t : other.triangles)
  {
    both.triangles.push_back({ t[0] + first, t[1] + first, t[2] + first });
  }
  const Impostor none("exit 99"); // never started
  try
  {
    MakeTetrahedralMesh(both, none.Settings());
    FAIL();
  }
  catch (const SurfaceError& error)
  {
    EXPECT_SAYS(std::string(error.what()), "cuts itself");
    EXPECT_GT(error.cells.size(), 10U);
  }
  // One inside of the other.
  both = Sphere(2.0, 8);
  for (const Triangle& t : Sphere(2.0, 8).triangles)
  {
    both.triangles.push_back({ t[0] + first, t[1] + first, t[2] + first });
  }
  for (const Vector3& p : Sphere(0.5, 8).points)
  {
    both.points.push_back(p);
  }
  EXPECT_SAYS(RefusalOf(both, none.Settings()), "lies inside another one");
}

TEST(TetrahedralMeshRefuses, SettingsOutOfRange)
{
  const TetrahedralMeshInput box = Box(Vector3(1, 1, 1), 2);
  TetrahedralMeshSettings settings;
  settings.radiusEdgeRatio = 0.5;
  EXPECT_SAYS(RefusalOf(box, settings), "the radius-edge ratio");
  settings = {};
  settings.minimumDihedral = 1.0;
  EXPECT_SAYS(RefusalOf(box, settings), "the minimum dihedral angle");
  settings = {};
  settings.timeLimit = 0.0;
  EXPECT_SAYS(RefusalOf(box, settings), "the time limit");
  settings = {};
  settings.workerFolder = "/nowhere";
  EXPECT_SAYS(RefusalOf(box, settings), "is there");
  settings.backend = TetrahedralBackend::TetGen;
  EXPECT_SAYS(RefusalOf(box, settings), "coronary-tetgen-worker is not there");
}

TEST_F(TetGen, TooSmallTetrahedraAreNamed)
{
  TetrahedralMeshSettings settings;
  settings.minimumVolume = 100.0;
  EXPECT_SAYS(RefusalOf(Box(Vector3(1, 1, 1), 2), settings), "a tetrahedron at (");
}

TEST(TetrahedralMesherProcess, CrashHangExitAndNonsenseAreMessages)
{
  const TetrahedralMeshInput box = Box(Vector3(1, 1, 1), 2);
  EXPECT_SAYS(RefusalOf(box, Impostor("kill -SEGV $$").Settings()), "crashed (signal 11");
  EXPECT_SAYS(
    RefusalOf(box, Impostor("exit 77").Settings()), "left without an answer (exit code 77)");
  EXPECT_SAYS(
    RefusalOf(box, Impostor("echo on the way; exit 77").Settings()), "it said: on the way");
  EXPECT_SAYS(RefusalOf(box, Impostor("exec sleep 30").Settings(1.0)),
    "was stopped after 1 s, its time limit");
  EXPECT_SAYS(RefusalOf(box, Impostor("echo nonsense >&0").Settings()),
    "gave an answer that can not be read");
  EXPECT_SAYS(RefusalOf(box, Impostor("head -c 100000 /dev/zero >&0").Settings()),
    "gave an answer that can not be read");
  // TetGen's own exit codes, should the library leave by itself.
  EXPECT_SAYS(RefusalOf(box, Impostor("echo 'Facet #5 is bad'; exit 3").Settings()),
    "cut each other; the first is cell 4 at");
}

TEST(TetrahedralMesherMessage, DamagedMessagesAreRefused)
{
  coronary::MesherRequest request;
  request.points = { 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  request.sizes = { 0, 0, 0, 0 };
  request.triangles = { 0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2 };
  const std::string bytes = Encode(request);
  EXPECT_EQ(coronary::DecodeMesherRequest(bytes).triangles, request.triangles);
  for (std::size_t i = 0; i < bytes.size(); ++i)
  {
    EXPECT_THROW(coronary::DecodeMesherRequest(bytes.substr(0, i)), std::runtime_error);
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 16);
    EXPECT_THROW(coronary::DecodeMesherRequest(damaged), std::runtime_error);
  }
  request.triangles[5] = 4;
  EXPECT_THROW(coronary::DecodeMesherRequest(Encode(request)), std::runtime_error);
  EXPECT_THROW(coronary::DecodeMesherAnswer(bytes), std::runtime_error);
}
}
