#!/usr/bin/env pvpython
"""Picture of the trees that `coronary-pipeline run` found, or of any centerlines in a surface.

  xvfb-run -a pvpython scripts/render-centerline.py demo-output/run --output demo-output/pictures
  ... [--truth demo-output/phantom/truth/surface_12.vtp]
  ... centerline.vtp --truth surface.vtp [--reference other-centerline.vtp] --output folder

centerline.png  the branches, coloured by radius, with their bifurcations, from three sides; inside of
                the surface and beside the other centerlines (white) when they are given
"""
import argparse
import os

from vtkmodules.vtkCommonCore import vtkLookupTable
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

import pictures

RADIUS = "MaximumInscribedSphereRadius"
SURFACE = (0.62, 0.70, 0.82)
REFERENCE = (1.0, 1.0, 1.0)
FORK = (1.0, 0.88, 0.35)


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
    lines = pictures.read_poly(path)
    radii = lines.GetPointData().GetArray(RADIUS)
    if lines.GetNumberOfCells() == 0 or radii is None:
        pictures.fail("%s has no centerlines with radii (%s)" % (path, RADIUS))
    lines.GetPointData().SetActiveScalars(RADIUS)
    low, high = radii.GetRange()
    bounds = lines.GetBounds()
    center = [0.5 * (bounds[2 * a] + bounds[2 * a + 1]) for a in range(3)]
    size = max(bounds[2 * a + 1] - bounds[2 * a] for a in range(3))
    width = 0.005 * size
    forks = bifurcations(lines)
    window, made = pictures.panels("Centerlines: %d branches, %d bifurcations; radius %.2f (blue) to %.2f mm (red)"
                                   % (lines.GetNumberOfCells(), len(forks), low, high))
    surface = pictures.read_poly(arguments.truth) if arguments.truth else None
    reference = pictures.read_poly(arguments.reference) if arguments.reference else None
    for panel, (_, eye, up) in zip(made, pictures.VIEWS):
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(pictures.tube(lines, width, 12))
        mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectColorArray(RADIUS)
        mapper.SetLookupTable(radius_colors(low, high))
        mapper.SetScalarRange(low, high)
        actor = vtkActor()
        actor.SetMapper(mapper)
        panel.AddActor(actor)
        for fork in forks:
            pictures.add_surface(panel, pictures.ball(fork, 2.0 * width), color=FORK)
        if reference:
            pictures.add_surface(panel, pictures.tube(reference, 0.5 * width, 12), color=REFERENCE)
        if surface:
            pictures.add_surface(panel, surface, color=SURFACE, opacity=0.25)
        pictures.look_at(panel, center, eye, up, 0.95 * size)
    os.makedirs(arguments.output, exist_ok=True)
    pictures.save(window, arguments.output, "centerline.png")


if __name__ == "__main__":
    main()
