// Loads a patient's result, the folder of a 'coronary-pipeline run', and moves its tree through the heart cycle.
// Usage: consume-run RUN
#include <DynamicCoronary/VesselModel.h>

// Headers of this project, whose names ours have as well: each finds its own.
#include "Device.h"
#include <Geometry.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <vector>

using coronary::Vector3;

namespace
{
constexpr int Phases = 20;

/// Greatest distance from where the points were, mm.
double Farthest(const std::vector<Vector3>& from, const std::vector<Vector3>& to)
{
  double farthest = 0.0;
  for (std::size_t n = 0; n < from.size(); ++n)
  {
    farthest = std::max(farthest, (to[n] - from[n]).norm());
  }
  return farthest;
}
}

int main(int argc, char** argv)
{
  if (argc != 2)
  {
    std::cerr << "Usage: consume-run RUN\n";
    return EXIT_FAILURE;
  }
  try
  {
    coronary::VesselSource source;
    source.kind = coronary::VesselSource::Kind::Run;
    source.path = argv[1];
    const coronary::VesselModel model = coronary::LoadVessels(source);
    const coronary::WallTopology& topology = model.wall->Topology();
    std::cout << topology.points << " points, " << topology.triangles.size() << " triangles, "
              << topology.axis.size() << " branches; motion: " << model.motion << '\n';

    if (!model.heart)
    {
      std::cerr << "the names do not say where the heart is\n";
      return EXIT_FAILURE;
    }
    std::cout << "heart: " << model.heart->length << " mm from the groove to the apex\n";

    std::vector<Vector3> startWall;
    std::vector<Vector3> startAxis;
    model.wall->Positions(0.0, startWall);
    model.wall->AxisPositions(0.0, startAxis);
    std::vector<Vector3> wall;
    std::vector<Vector3> axis;
    double moved = 0.0;
    for (int n = 1; n < Phases; ++n)
    {
      const double phase = static_cast<double>(n) / Phases; // fraction of the R-R interval
      model.wall->Positions(phase, wall);
      model.wall->AxisPositions(phase, axis);
      const double wallMoved = Farthest(startWall, wall);
      moved = std::max(moved, wallMoved);
      std::cout << "phase " << phase << ": the wall has moved by up to " << wallMoved
                << " mm, the centerlines by " << Farthest(startAxis, axis) << " mm\n";
    }
    // A cycle later everything is where it was.
    model.wall->Positions(1.0, wall);
    const bool periodic = Farthest(startWall, wall) < 1e-6;
    const bool ownHeaders = ShopGeometry().width == 2.5 && ShopDevice().number == 7;
    return moved > 1.0 && periodic && ownHeaders ? EXIT_SUCCESS : EXIT_FAILURE;
  }
  catch (const std::exception& error)
  {
    std::cerr << error.what() << '\n';
    return EXIT_FAILURE;
  }
}
