#include "SessionWorld.h"

#include "ParallelFor.h"
#include "Recording.h"
#include "SessionImager.h"
#include "VesselLesions.h"
#include "VesselModel.h"

namespace coronary
{
SessionWorld LoadWorld(const Scenario& scenario, bool background, const WorldProgress& progress)
{
  const auto step = [&progress](const char* what)
  {
    const ProgressCallback report = [&progress, what](double fraction)
    { return progress(what, fraction); };
    if (!report(0.0))
    {
      throw Cancelled();
    }
    return report;
  };
  SessionWorld world;
  world.scenario = scenario;
  std::vector<std::string> notes;
  const auto loadPatient = [&](const WallTopology& topology)
  {
    const SessionBackground made = LoadBackground(scenario, topology, step("patient"));
    notes = made.notes;
    world.background = MakeProjector(made.volume, scenario.imaging);
  };
  // A CT lies where it lies: what is wrong with it is told before the vessels are made, which takes longer.
  const bool hasImages = !scenario.imaging.background.empty();
  if (background && hasImages)
  {
    loadPatient({});
  }
  VesselModel model = LoadVessels(scenario.vessels, step("vessels"));
  world.wall = scenario.lesions.empty()
    ? model.wall
    : std::make_shared<NarrowedWallMotion>(model.wall, scenario.lesions);
  world.motion = model.motion;
  world.notes = model.notes;
  world.heart = model.heart;
  world.foreignMotion = model.foreignMotion;
  world.wallHash = WallHash(*world.wall);
  const WallTopology& topology = world.wall->Topology();
  world.scenario.imaging.pose = StartPose(topology, scenario.imaging);
  if (background && !hasImages)
  {
    loadPatient(topology);
  }
  world.notes.insert(world.notes.end(), notes.begin(), notes.end());
  return world;
}
}
