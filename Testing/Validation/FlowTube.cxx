/**
 * A straight tube, swept, layered and written as a case for OpenFOAM by the same code as vessels: what
 * scripts/validate-flow.py holds against closed forms. Prints what the script needs to know of the mesh as JSON.
 */
#include "AtomicFile.h"
#include "FoamCase.h"
#include "FoamMesh.h"
#include "LayeredMesh.h"
#include "StagedFolder.h"
#include "SweepSurface.h"

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <exception>
#include <string>

namespace
{
using coronary::Vector3;

struct Tube
{
  double radius = 1.5;  // mm
  double length = 15.0; // mm
  double edge = 0.3;    // in radii
  int layers = 5;
  double thickness = 0.45;
  double reynolds = 50.0;
  std::string kind = "steady";
  std::string output;
  int frames = 40;
  int steps = 200;
  double cycle = 0.5;
};

/// Sway of a rigid tube (turning would give the flow Coriolis forces as large as friction); of a pulsing one the calibre.
/// Velocity is zero at first, as the flow's is.
Vector3 Moved(const Tube& tube, const Vector3& p, double phase)
{
  const double rise = 0.5 * (1.0 - std::cos(2.0 * M_PI * phase));
  if (tube.kind == "pulsing")
  {
    const double factor = 1.0 + 0.05 * rise;
    return { p.x() * factor, p.y() * factor, p.z() };
  }
  return p + Vector3(8.0 * rise, -4.0 * rise, 3.0 * rise);
}

coronary::LayeredMesh MeshOf(const Tube& tube)
{
  constexpr int Steps = 60;
  coronary::VesselTree tree;
  coronary::VesselTree::Branch branch;
  for (int k = 0; k <= Steps; ++k)
  {
    tree.points.emplace_back(0.0, 0.0, tube.length * k / Steps);
    tree.radius.push_back(tube.radius);
    branch.points.push_back(k);
  }
  tree.branches.push_back(branch);
  coronary::SweepSettings sweep;
  sweep.edgeLengthPerRadius = tube.edge;
  sweep.maximumEdgeLength = tube.radius;
  const coronary::SweptSurface surface = coronary::SweepVesselTree(tree, sweep);
  coronary::LayeredMeshSettings settings;
  settings.layers = tube.layers;
  settings.thickness = tube.thickness;
  return coronary::MakeLayeredMesh({ surface.points, surface.triangles, surface.entityId },
    settings, { { 2, "inlet" }, { 3, "outlet" } });
}

void Write(const Tube& tube, const coronary::LayeredMesh& mesh)
{
  coronary::FoamCase flow;
  flow.title = "Tube: " + tube.kind;
  flow.steady = tube.kind == "steady";
  flow.moving = tube.kind == "moving" || tube.kind == "pulsing";
  flow.cycle = tube.cycle;
  flow.stepsPerCycle = tube.steps;
  flow.picturesPerCycle = tube.kind == "womersley" ? 20 : 4;
  flow.cycles = tube.kind == "womersley" ? 3 : 1;
  const double nu = flow.viscosity / flow.density;
  const double speed = tube.reynolds * nu / (2e-3 * tube.radius);
  const double flowRate =
    tube.kind == "pulsing" ? 0.0 : M_PI * 1e-6 * tube.radius * tube.radius * speed;
  flow.inflow = { flowRate };
  if (tube.kind == "womersley")
  {
    flow.inflow.insert(flow.inflow.end(), { 0.5 * flowRate, 0.0 });
  }
  flow.outlets.push_back({ "outlet", 0.0, 0.0, 0.0 });
  coronary::StagedFolder folder(tube.output);
  const auto write = [&](const std::string& name, const std::string& text)
  { coronary::WriteFileAtomically(folder.Add(name), text); };
  for (const auto& [name, text] : coronary::FoamMeshFiles(mesh.cells, mesh.points, "wall"))
  {
    write("constant/polyMesh/" + name, text);
  }
  if (flow.moving)
  {
    for (const auto& [name, text] : coronary::FoamMotionPoints(mesh.cells, mesh.points))
    {
      write("constant/boundaryData/" + name, text);
    }
    for (int k = 0; k <= tube.frames; ++k)
    {
      const double phase = static_cast<double>(k) / tube.frames;
      std::vector<Vector3> moved;
      for (const Vector3& p : mesh.points)
      {
        moved.push_back(Moved(tube, p, phase));
      }
      for (const auto& [name, text] :
        coronary::FoamMotionFrame(mesh.cells, mesh.points, moved, phase * tube.cycle))
      {
        write("constant/boundaryData/" + name, text);
      }
    }
  }
  for (const auto& [name, text] : coronary::FoamCaseFiles(flow))
  {
    write(name, text);
  }
  folder.Commit();
  const coronary::PolyhedralQuality quality = coronary::MeasurePolyhedra(mesh.cells, mesh.points);
  std::printf("{\"prisms\": %zu, \"tetrahedra\": %zu, \"volume\": %.17g, \"flow\": %.17g, \"nu\": "
              "%.17g, \"length\": %.17g, "
              "\"radius\": %.17g, \"cycle\": %.17g, \"nonOrthogonality\": %.6g, \"skewness\": "
              "%.6g, \"sound\": %s}\n",
    mesh.prisms.size(), mesh.tetrahedra.size(), 1e-9 * quality.totalVolume, flowRate, nu,
    1e-3 * tube.length, 1e-3 * tube.radius, tube.cycle,
    quality.maximumNonOrthogonality * 180.0 / M_PI, quality.maximumSkewness,
    quality.IsSound() ? "true" : "false");
}
}

int main(int argc, char** argv)
{
  Tube tube;
  CLI::App app("A tube as a case for OpenFOAM");
  app.add_option("--kind", tube.kind)
    ->check(CLI::IsMember({ "steady", "rest", "moving", "pulsing", "womersley" }));
  app.add_option("--output", tube.output)->required();
  app.add_option("--edge", tube.edge, "Edges of the wall in radii");
  app.add_option("--layers", tube.layers);
  app.add_option("--thickness", tube.thickness);
  app.add_option("--length", tube.length, "mm");
  app.add_option("--reynolds", tube.reynolds);
  app.add_option("--steps", tube.steps);
  app.add_option("--frames", tube.frames);
  CLI11_PARSE(app, argc, argv);
  try
  {
    Write(tube, MeshOf(tube));
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "Error: %s\n", error.what());
    return 1;
  }
  return 0;
}
