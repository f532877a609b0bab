#!/usr/bin/env pvpython
"""Picture of the trees that `coronary-pipeline run` found, or of any centerlines in a surface.

  xvfb-run -a pvpython scripts/render-centerline.py demo-output/run --output demo-output/pictures
  ... [--truth demo-output/phantom/truth/surface_12.vtp]
  ... centerline.vtp --truth surface.vtp [--reference other-centerline.vtp] --output folder

centerline.png  the branches, coloured by radius, with their bifurcations, from three sides; inside of
                the surface and beside the other centerlines (white) when they are given
"""
import argparse
import importlib.util
import os

from vtkmodules.vtkCommonCore import vtkLookupTable
from vtkmodules.vtkFiltersCore import vtkTubeFilter
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

here = os.path.dirname(os.path.abspath(__file__))
spec = importlib.util.spec_from_file_location(
    "render_segmentation", os.path.join(here, "render-segmentation.py"))
views = importlib.util.module_from_spec(spec)
spec.loader.exec_module(views)
common = views.common

RADIUS = "MaximumInscribedSphereRadius"
SURFACE = (0.62, 0.70, 0.82)
REFERENCE = (1.0, 1.0, 1.0)
FORK = (1.0, 0.88, 0.35)


def tubes(lines, radius):
    tube = vtkTubeFilter()
    tube.SetInputData(lines)
    tube.SetRadius(radius)
    tube.SetNumberOfSides(12)
    tube.Update()
    return tube.GetOutput()


def radius_colors(low, high):
    table = vtkLookupTable()
    table.SetHueRange(0.62, 0.0)
    table.SetRange(low, high)
    table.Build()
    return table


def bifurcations(lines):
    """Points where more than one line begins."""
    starts = {}
    for cell in range(lines.GetNumberOfCells()):
        ids = lines.GetCell(cell).GetPointIds()
        if ids.GetNumberOfIds() > 1:
            starts[ids.GetId(0)] = starts.get(ids.GetId(0), 0) + 1
    return [lines.GetPoint(point) for point, count in sorted(starts.items()) if count > 1]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("input", help="folder that coronary-pipeline run wrote, or a .vtp")
    parser.add_argument("--output", required=True, help="folder for the picture")
    parser.add_argument("--truth", help="surface around the lines, .vtp")
    parser.add_argument("--reference", help="centerlines to compare with, .vtp")
    arguments = parser.parse_args()
    path = arguments.input
    if os.path.isdir(path):
        path = os.path.join(path, "centerline.vtp")
    lines = common.read_poly(path)
    radii = lines.GetPointData().GetArray(RADIUS)
    if lines.GetNumberOfCells() == 0 or radii is None:
        common.fail("%s has no centerlines with radii (%s)" % (path, RADIUS))
    lines.GetPointData().SetActiveScalars(RADIUS)
    low, high = radii.GetRange()
    bounds = lines.GetBounds()
    center = [0.5 * (bounds[2 * a] + bounds[2 * a + 1]) for a in range(3)]
    size = max(bounds[2 * a + 1] - bounds[2 * a] for a in range(3))
    width = 0.005 * size
    forks = bifurcations(lines)
    window, made = views.panels("Centerlines: %d branches, %d bifurcations; radius %.2f (blue) to %.2f mm (red)"
                                % (lines.GetNumberOfCells(), len(forks), low, high))
    surface = common.read_poly(arguments.truth) if arguments.truth else None
    reference = common.read_poly(arguments.reference) if arguments.reference else None
    for panel, (_, eye, up) in zip(made, views.VIEWS):
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(tubes(lines, width))
        mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectColorArray(RADIUS)
        mapper.SetLookupTable(radius_colors(low, high))
        mapper.SetScalarRange(low, high)
        actor = vtkActor()
        actor.SetMapper(mapper)
        panel.AddActor(actor)
        for fork in forks:
            ball = vtkSphereSource()
            ball.SetCenter(fork)
            ball.SetRadius(2.0 * width)
            ball.SetThetaResolution(24)
            ball.SetPhiResolution(24)
            ball.Update()
            common.add_surface(panel, ball.GetOutput(), color=FORK)
        if reference:
            common.add_surface(panel, tubes(reference, 0.5 * width), color=REFERENCE)
        if surface:
            common.add_surface(panel, surface, color=SURFACE, opacity=0.25)
        common.look_at(panel, center, eye, up, 0.95 * size)
    os.makedirs(arguments.output, exist_ok=True)
    common.save(window, arguments.output, "centerline.png")


if __name__ == "__main__":
    main()
