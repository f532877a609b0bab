// A balloon in a straight vessel, for UnitTestBalloon and UnitTestStent.
#ifndef BalloonTestBench_h
#define BalloonTestBench_h

#include "BalloonOnWire.h"
#include "InstrumentCatalogue.h"
#include "Scenario.h"
#include "WallMotions.h"

#include <cstdio>
#include <memory>
#include <string>

namespace coronary
{
/// A straight vessel along z without a surface; a point each half millimetre.
inline WallTopology Tube(
  double reference, double degree, double from, double to, double calcium = 0.0)
{
  WallTopology tube;
  tube.axis.resize(1);
  tube.axisRadius.resize(1);
  tube.axisReference.resize(1);
  tube.axisCalcium.resize(1);
  tube.parent = { -1 };
  tube.groupName = { "LAD" };
  for (int k = 0; k <= 160; ++k)
  {
    const double z = 0.5 * k;
    const double open = z > from && z < to ? 1.0 - degree : 1.0;
    tube.axis[0].emplace_back(0.0, 0.0, z);
    tube.axisRadius[0].push_back(open * reference);
    tube.axisReference[0].push_back(reference);
    tube.axisCalcium[0].push_back(open < 1.0 ? calcium : 0.0);
  }
  return tube;
}

/// A balloon with its middle at 40 mm of a tube.
struct Bench
{
  Bench(const std::string& name, const WallTopology& tube, const DilationSettings& settings = {})
    : Bench(BuiltInCatalogue().Balloon(name).balloon, tube, settings)
  {
  }
  Bench(
    const BalloonCatheter& balloon, const WallTopology& tube, const DilationSettings& settings = {})
    : Balloon(balloon)
    , Wall(tube, {}, tube.axis[0], settings)
    , Way(WayThrough(tube, 0))
    , Sleeve(this->Balloon, BuiltInCatalogue().Catheter("EBU3.5-6F").catheter, 0.0)
  {
  }
  const BalloonReport& Hold(
    double pressure, double seconds, double place = 40.0, double step = 0.05)
  {
    for (int k = 0; k < seconds / step; ++k)
    {
      this->Sleeve.Inflate(step, pressure, place, 3.0, this->Way, this->Wall);
    }
    return this->Sleeve.Report();
  }
  BalloonCatheter Balloon;
  DilatableWall Wall;
  VesselWay Way;
  BalloonOnWire Sleeve;
};

/// As a session's vessels are made.
inline std::shared_ptr<WallMotion> LesionedPhantom()
{
  static const std::shared_ptr<WallMotion> wall = []
  {
    const Scenario scenario = LoadScenario("lad-lesion");
    return std::make_shared<NarrowedWallMotion>(
      MakePhantomWallMotion(scenario.vessels.phantom, scenario.vessels.phantom.surfaceSpacing, 40),
      scenario.lesions);
  }();
  return wall;
}

/// A line of validate-simulator.sh's table.
inline void Print(const char* what, double target, double measured)
{
  std::printf("| %s | %.6g | %.6g | %.2g %% | |\n", what, target, measured,
    target != 0.0 ? 100.0 * (measured / target - 1.0) : 100.0 * measured);
}
}

#endif
