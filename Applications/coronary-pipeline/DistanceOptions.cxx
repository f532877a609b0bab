#include "DistanceOptions.h"

#include "OptionChecks.h"

namespace coronary
{
void AddDistanceOptions(CLI::App& app, MeshDistanceSettings& settings)
{
  app
    .add_option("--error-bound", settings.errorBound,
      "What the Hausdorff distance may be too small by, in mm")
    ->check(Within(1e-9, 1e6))
    ->type_name("MM")
    ->capture_default_str();
  app.add_flag("--clip-ends", settings.clipEnds,
    "Leave out caps, and on both surfaces what lies beyond an end of either one");
  app
    .add_option("--end-length", settings.endLength,
      "How far beyond an end something still belongs to it, in mm")
    ->check(Within(1e-9, 1e6))
    ->type_name("MM")
    ->capture_default_str();
}
}
