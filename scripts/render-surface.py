#!/usr/bin/env pvpython
"""Pictures of the surface that `coronary-pipeline run --until surface` wrote.

  xvfb-run -a pvpython scripts/render-surface.py demo-output/run --output demo-output/pictures
  ... [--truth demo-output/phantom/truth/surface_12.vtp] [--plugin DynamicCoronaryPlugin.so]

surface.png        the arteries from three sides, each segment in its colour; over the true surface
                   (white) when it is given
surface_mesh.png   the triangles near: a bifurcation, a cap, a stenosis, two vessels that pass each
                   other at 0.5 mm. The last two are swept for the picture by the plugin's filter
"""
import argparse
import glob
import math
import os

from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkLookupTable, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

import pictures

RADIUS = "MaximumInscribedSphereRadius"
TRUE = (1.0, 1.0, 1.0)
WALL = (0.86, 0.45, 0.40)
CAP = (0.96, 0.84, 0.45)
EDGE = (0.12, 0.10, 0.12)


def add_triangles(panel, mesh):
    """Wall and caps with their edges."""
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(mesh)
    mapper.SetScalarModeToUseCellFieldData()
    mapper.SelectColorArray("CellEntityIds")
    table = vtkLookupTable()
    table.SetNumberOfTableValues(2)
    table.SetTableRange(0.5, 2.5)
    table.SetTableValue(0, *WALL, 1.0)
    table.SetTableValue(1, *CAP, 1.0)
    mapper.SetLookupTable(table)
    mapper.UseLookupTableScalarRangeOn()
    actor = vtkActor()
    actor.SetMapper(mapper)
    style = actor.GetProperty()
    style.SetInterpolationToFlat()
    style.EdgeVisibilityOn()
    style.SetEdgeColor(*EDGE)
    style.SetLineWidth(1.0)
    panel.AddActor(actor)


def bifurcation(surface, forks):
    """Place and radius of the widest fork but the first."""
    radii = forks.GetPointData().GetArray("ParentRadius")
    order = sorted(range(forks.GetNumberOfPoints()), key=lambda n: -radii.GetTuple1(n))
    if not order:
        pictures.fail("the trees have no bifurcation")
    chosen = order[min(1, len(order) - 1)]
    return forks.GetPoint(chosen), radii.GetTuple1(chosen)


def lines(courses):
    """A tree of lines: (points, radii) of each."""
    tree = vtkPolyData()
    points, cells, radii = vtkPoints(), vtkCellArray(), vtkDoubleArray()
    radii.SetName(RADIUS)
    for course, widths in courses:
        cells.InsertNextCell(len(course))
        for point, width in zip(course, widths):
            cells.InsertCellPoint(points.InsertNextPoint(point))
            radii.InsertNextValue(width)
    tree.SetPoints(points)
    tree.SetLines(cells)
    tree.GetPointData().AddArray(radii)
    return tree


def swept(plugin, tree):
    from paraview import servermanager, simple
    simple.LoadPlugin(plugin, ns=simple.__dict__)
    source = simple.TrivialProducer()
    source.GetClientSideObject().SetOutput(tree)
    sweep = simple.FrenetSweepSurface(Input=source)
    sweep.UpdatePipeline()
    return servermanager.Fetch(sweep)


def stenosis():
    steps = [0.25 * n for n in range(81)]
    return lines([([(s, 0.6 * math.sin(0.25 * s), 0.0) for s in steps],
                   [1.5 - 1.0 * math.exp(-((s - 10.0) / 1.6) ** 2) for s in steps])])


def passing():
    """Walls 0.5 mm apart."""
    steps = [0.25 * n - 10.0 for n in range(81)]
    return lines([([(s, 0.0, 0.0) for s in steps], [1.5] * 81),
                  ([(0.5 * s, 0.87 * s, 3.0) for s in steps], [1.0] * 81)])


def built_plugin():
    found = glob.glob(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "build", "paraview", "**",
                                   "DynamicCoronaryPlugin.so"), recursive=True)
    if not found:
        pictures.fail("no plugin in build/paraview; name it with --plugin")
    return found[0]


def close_ups(title, shots, add):
    """A window of four panels; a shot: name, what `add` puts into it, place, eye, scale."""
    window, base = pictures.new_window()
    across, height = pictures.SIZE
    pictures.add_text(base, title, 20, height - 42, 26, bold=True)
    for n, (name, mesh, where, eye, scale) in enumerate(shots):
        left, low = n % 2, 1 - n // 2
        tall = 0.5 * (height - pictures.TITLE)
        panel = pictures.add_panel(window, left * across / 2.0 + 2, low * tall + 2,
                                   (left + 1) * across / 2.0 - 2, (low + 1) * tall - 2)
        add(panel, mesh)
        pictures.add_text(panel, name, 16, 16)
        pictures.look_at(panel, where, eye, (0.0, 0.1, 1.0) if abs(eye[2]) < 0.8 else (0, 1, 0), scale)
    return window


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("input", help="folder that coronary-pipeline run wrote")
    parser.add_argument("--output", required=True, help="folder for the pictures")
    parser.add_argument("--truth", help="true surface, .vtp")
    parser.add_argument("--plugin", help="DynamicCoronaryPlugin.so; default: that of build/paraview")
    arguments = parser.parse_args()
    surface = pictures.read_poly(os.path.join(arguments.input, "surface.vtp"))
    caps = pictures.read_poly(os.path.join(arguments.input, "caps.vtp"))
    forks = pictures.read_poly(os.path.join(arguments.input, "bifurcations.vtp"))
    if surface.GetNumberOfPolys() == 0 or caps.GetNumberOfPoints() == 0:
        pictures.fail("%s has no surface" % arguments.input)
    plugin = arguments.plugin or built_plugin()
    os.makedirs(arguments.output, exist_ok=True)

    bounds = surface.GetBounds()
    center = [0.5 * (bounds[2 * a] + bounds[2 * a + 1]) for a in range(3)]
    size = max(bounds[2 * a + 1] - bounds[2 * a] for a in range(3))
    window, made = pictures.panels("Surface: %d triangles, %d inlets and outlets"
                                   % (surface.GetNumberOfPolys(), caps.GetNumberOfPoints()))
    truth = pictures.read_poly(arguments.truth) if arguments.truth else None
    for panel, (_, eye, up) in zip(made, pictures.VIEWS):
        pictures.add_surface(panel, surface, color=WALL)
        if truth:
            pictures.add_surface(panel, truth, color=TRUE, opacity=0.3)
        pictures.look_at(panel, center, eye, up, 0.95 * size)
    pictures.save(window, arguments.output, "surface.png")

    place, radius = bifurcation(surface, forks)
    inlet = caps.GetPoint(0)
    normal = caps.GetPointData().GetArray("CapNormal").GetTuple(0)
    width = caps.GetPointData().GetArray(RADIUS).GetTuple1(0)
    aside = [normal[0] + 0.6 * normal[1], normal[1] - 0.6 * normal[0], normal[2] + 0.4]
    shots = [
        ("bifurcation", surface, place, (0.2, -1.0, 0.25), 3.2 * radius),
        ("cap of an inlet", surface, inlet, aside, 2.2 * width),
        ("stenosis", swept(plugin, stenosis()), (10.0, 0.36, 0.0), (0.15, -0.2, 1.0), 3.6),
        ("two vessels at 0.5 mm", swept(plugin, passing()), (0.0, 0.0, 1.3), (-0.3, -0.95, 0.05), 3.0),
    ]
    window = close_ups("Triangles: wall red, caps yellow", shots, add_triangles)
    pictures.save(window, arguments.output, "surface_mesh.png")


if __name__ == "__main__":
    main()
