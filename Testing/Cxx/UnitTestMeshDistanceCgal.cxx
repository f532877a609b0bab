// The Hausdorff distance beside CGAL's, on pairs of random surfaces.

#include "CgalMeshDistance.h"
#include "SurfaceTestMeshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace coronary;

TEST(MeshDistance, AgreesWithCgal)
{
  constexpr double bound = 1e-3;
  for (unsigned int seed = 1; seed <= 50; ++seed)
  {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    SurfaceMesh meshes[2];
    for (SurfaceMesh& mesh : meshes)
    {
      // Spheres, tubes and sheets that are bent and moved.
      switch (random() % 3)
      {
        case 0:
          mesh = Sphere(3.0, 2 + static_cast<int>(random() % 3));
          break;
        case 1:
          mesh = Tube(1.0, -4.0, 4.0, 8 + static_cast<int>(random() % 9),
            5 + static_cast<int>(random() % 20), false);
          break;
        default:
          mesh = Sheet(-3, 3, -3, 3, 2 + static_cast<int>(random() % 20),
            2 + static_cast<int>(random() % 20), [](double x, double y) { return 0.3 * x * y; });
      }
      const Vector3 shift(0.5 * uniform(random), 0.5 * uniform(random), 0.5 * uniform(random));
      const Vector3 wave(uniform(random), uniform(random), uniform(random));
      const Vector3 height(0.5 * uniform(random), 0.5 * uniform(random), 0.5 * uniform(random));
      for (Vector3& p : mesh.points)
      {
        p += shift + std::sin(2.0 * wave.dot(p)) * height;
      }
    }
    MeshDistanceSettings settings;
    settings.errorBound = bound;
    settings.areaMeasures = seed % 2 == 0;
    settings.pointMeasures = seed % 3 != 0;
    const MeshDistance ours = CompareSurfaces(meshes[0], meshes[1], settings);
    EXPECT_LE(ours.hausdorffError, bound);
    EXPECT_NEAR(
      ours.ab.hausdorff, CgalOneSidedHausdorffDistance(meshes[0], meshes[1], bound), bound)
      << seed;
    EXPECT_NEAR(
      ours.ba.hausdorff, CgalOneSidedHausdorffDistance(meshes[1], meshes[0], bound), bound)
      << seed;
    EXPECT_NEAR(ours.hausdorff, CgalHausdorffDistance(meshes[0], meshes[1], bound), bound) << seed;
  }
}
