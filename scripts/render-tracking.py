#!/usr/bin/env pvpython
"""A picture of what `coronary-pipeline run --until motion` made of a series, as the paper's Fig. 5.

  xvfb-run -a pvpython scripts/render-tracking.py demo-output/run --output demo-output/pictures

tracking.png  centerlines at all moments, coloured by branch; where some points begin and their ways
              through one cycle; the wall at three moments
"""
import argparse
import json
import os

from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkGlyph3D
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

import pictures

START = (0.85, 0.12, 0.12)
WAY = (0.35, 0.6, 0.95)
WALLS = ((0.85, 0.25, 0.22), (0.3, 0.7, 0.35), (0.3, 0.45, 0.9))


def series(run, name):
    """Time and data of every moment."""
    folder = os.path.join(run, "motion")
    path = os.path.join(folder, name)
    if not os.path.isfile(path):
        pictures.fail("missing file: " + path)
    with open(path, encoding="utf-8") as file:
        files = json.load(file)["files"]
    return [(one["time"], pictures.read_poly(os.path.join(folder, one["name"]))) for one in files]


def add_cells(panel, mesh, table):
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(mesh)
    mapper.SetScalarModeToUseCellFieldData()
    mapper.SelectColorArray("GroupIds")
    mapper.SetLookupTable(table)
    mapper.UseLookupTableScalarRangeOn()
    actor = vtkActor()
    actor.SetMapper(mapper)
    panel.AddActor(actor)


def ways(moments, chosen):
    """Closed lines through the places of some points in one cycle."""
    cycle = [data for time, data in moments if time < moments[0][0] + 1.0]
    points, lines = vtkPoints(), vtkCellArray()
    for point in chosen:
        first = points.GetNumberOfPoints()
        lines.InsertNextCell(len(cycle) + 1)
        for n, data in enumerate(cycle):
            points.InsertNextPoint(data.GetPoint(point))
            lines.InsertCellPoint(first + n)
        lines.InsertCellPoint(first)
    result = vtkPolyData()
    result.SetPoints(points)
    result.SetLines(lines)
    return result


def add_balls(panel, data, chosen, radius):
    places = vtkPoints()
    for point in chosen:
        places.InsertNextPoint(data.GetPoint(point))
    cloud = vtkPolyData()
    cloud.SetPoints(places)
    ball = vtkSphereSource()
    ball.SetRadius(radius)
    glyphs = vtkGlyph3D()
    glyphs.SetInputData(cloud)
    glyphs.SetSourceConnection(ball.GetOutputPort())
    glyphs.ScalingOff()
    glyphs.Update()
    pictures.add_surface(panel, glyphs.GetOutput(), color=START)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("input", help="folder of coronary-pipeline run --until motion")
    parser.add_argument("--output", required=True, help="folder for the picture")
    arguments = parser.parse_args()
    os.makedirs(arguments.output, exist_ok=True)
    lines = series(arguments.input, "centerline.vtp.series")
    surfaces = series(arguments.input, "surface.vtp.series")
    if len(lines) < 3:
        pictures.fail("three moments or more are needed")

    window, base = pictures.new_window()
    width, height = pictures.SIZE
    tall = height - 60
    pictures.add_text(base, "Tracked through %d moments of the cycle" % len(lines), 20, height - 42,
                      26, bold=True)
    bounds = surfaces[0][1].GetBounds()
    center = [(bounds[2 * i] + bounds[2 * i + 1]) / 2.0 for i in range(3)]

    def panel(number, title):
        result = pictures.add_panel(window, number * width / 3 + 2, 2,
                                    (number + 1) * width / 3 - 2, tall)
        pictures.add_text(result, title, 16, 16, 18)
        return result

    def look(target):
        pictures.look_at(target, center, (0.5, -0.8, 0.35), (0.0, 0.0, 1.0),
                         0.62 * surfaces[0][1].GetLength())

    start = lines[0][1]
    target = panel(0, "centerlines over time, by branch")
    table = pictures.branch_colors(start)
    for _, data in lines:
        add_cells(target, pictures.tube(data, 0.3), table)
    look(target)

    chosen = range(0, start.GetNumberOfPoints(), max(1, start.GetNumberOfPoints() // 150))
    target = panel(1, "first positions, and their ways")
    pictures.add_surface(target, pictures.tube(start, 0.25), color=(0.7, 0.7, 0.7), opacity=0.6)
    pictures.add_surface(target, pictures.tube(ways(lines, chosen), 0.3), color=WAY, opacity=0.55)
    add_balls(target, start, chosen, 0.9)
    look(target)

    step = len(surfaces) // 3
    picks = [surfaces[0], surfaces[step], surfaces[2 * step]]
    target = panel(2, "wall at " + ", ".join("%.0f" % (100.0 * time) for time, _ in picks) + " %")
    for (_, data), color in zip(picks, WALLS):
        pictures.add_surface(target, data, color=color, opacity=0.8)
    look(target)
    pictures.save(window, arguments.output, "tracking.png")


if __name__ == "__main__":
    main()
