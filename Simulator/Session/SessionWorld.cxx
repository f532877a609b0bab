#include "SessionWorld.h"

#include "ParallelFor.h"
#include "Recording.h"
#include "SessionImager.h"
#include "VesselLesions.h"
#include "VesselModel.h"

#include <algorithm>
#include <exception>
#include <optional>

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
  std::optional<SessionBackground> patient;
  const auto loadPatient = [&](const Scenario& wanted, const WallTopology& topology)
  {
    patient = LoadBackground(wanted, topology, step("patient"));
    notes.insert(notes.end(), patient->notes.begin(), patient->notes.end());
    world.background = MakeProjector(patient->volume, wanted.imaging);
  };
  // A CT lies where it lies: what is wrong with it is told before the vessels are made, which takes longer.
  Scenario withThorax = scenario;
  withThorax.imaging.background.clear();
  const bool controlled = scenario.imaging.exposureControl;
  if ((background || controlled) && !scenario.imaging.background.empty())
  {
    try
    {
      loadPatient(scenario, {});
    }
    catch (const Cancelled&)
    {
      throw;
    }
    catch (const std::exception& error)
    {
      // Who asked for vessels and background of one patient can go on with the vessels.
      if (scenario.imaging.backgroundRun.empty())
      {
        throw;
      }
      notes.push_back(std::string(error.what()) + "; a made-up chest stands in for it.");
    }
  }
  VesselModel model = LoadVessels(scenario.vessels, step("vessels"));
  world.wall = scenario.lesions.empty()
    ? model.wall
    : std::make_shared<NarrowedWallMotion>(model.wall, scenario.lesions);
  if (scenario.heartRateOfVessels && model.heartRate > 0.0)
  {
    world.scenario.settings.heartRate = std::min(model.heartRate, 240.0);
  }
  world.scenario.heartRateOfVessels = false; // known now
  world.motion = model.motion;
  world.notes = model.notes;
  world.heart = model.heart;
  world.foreignMotion = model.foreignMotion;
  world.wallHash = WallHash(*world.wall);
  const WallTopology& topology = world.wall->Topology();
  world.scenario.imaging.pose = StartPose(topology, scenario.imaging);
  if (scenario.settings.guideFromArch && !topology.aorta)
  {
    notes.emplace_back(
      "The vessels have no aorta (of a run: aorta_wall.vtp): the guide catheter is "
      "rigid in the ostium.");
  }
  if (controlled)
  {
    world.measured = world.background ? world.background : MeasuredThorax(withThorax, topology);
  }
  if (background && !world.background)
  {
    loadPatient(withThorax, topology);
  }
  if (background)
  {
    world.moving = MovingPartsOf(patient->volume, topology, scenario.imaging);
  }
  else
  {
    world.background.reset();
  }
  world.notes.insert(world.notes.end(), notes.begin(), notes.end());
  return world;
}
}
