#include "SessionWorld.h"

#include "Interruption.h"
#include "ProgressDisplay.h"
#include "Recording.h"
#include "SessionImager.h"
#include "vtkMessageTrap.h"
#include "vtkVesselModel.h"

namespace coronary
{
SessionWorld LoadWorld(const Scenario& scenario, bool background, ProgressDisplay& progress)
{
  const auto report = [&progress](double fraction)
  {
    progress.Update(fraction);
    return Interruption() == 0;
  };
  SessionWorld world;
  world.scenario = scenario;
  int step = 0;
  const auto loadPatient = [&](const WallTopology& topology)
  {
    progress.BeginStep(step++, "patient");
    world.background = MakeProjector(LoadBackground(scenario, topology, report), scenario.imaging);
    ThrowIfInterrupted();
  };
  // A CT lies where it lies: what is wrong with it is told before the vessels are made, which takes longer.
  const bool hasImages = !scenario.imaging.background.empty();
  if (background && hasImages)
  {
    loadPatient({});
  }
  vtkMessageTrap messages;
  progress.BeginStep(step++, "vessels");
  VesselModel model = LoadVessels(scenario.vessels, messages, report);
  ThrowIfInterrupted();
  messages.ForgetWarnings();
  world.wall = model.wall;
  world.motion = model.motion;
  world.notes = model.notes;
  world.foreignMotion = model.foreignMotion;
  world.wallHash = WallHash(*world.wall);
  const WallTopology& topology = world.wall->Topology();
  world.scenario.imaging.pose = StartPose(topology, scenario.imaging);
  if (background && !hasImages)
  {
    loadPatient(topology);
  }
  return world;
}
}
