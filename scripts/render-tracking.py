#!/usr/bin/env pvpython
"""A picture of a tree's motion.

  xvfb-run -a -s "-screen 0 1600x1000x24 -noreset" pvpython scripts/render-motion.py PLUGIN.so --output FOLDER

motion.png  left: centerlines at eight moments of a cycle, coloured by branch; right: where every few points go, as tubes
            coloured by speed, with red spheres where they are at 75 %. The phantom's tree, every other of the paper's phases known.
"""
import argparse
import os

from paraview import servermanager, simple
from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

MOMENTS = 100
EVERY = 9

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("plugin")
parser.add_argument("--output", default=".")
arguments = parser.parse_args()
simple.LoadPlugin(arguments.plugin, remote=False, ns=vars(simple))
os.makedirs(arguments.output, exist_ok=True)

even = [-0.05 + 1.11 * k / 19.0 for k in range(0, 20, 2)]
phantom = simple.CoronaryPhantom(CenterlineSpacing=1.0, Phases=even)
regularized = simple.MotionRegularizer(Motion=simple.OutputPort(phantom, 1))
moment = simple.CardiacPhaseInterpolator(regularized)


def at(time):
    moment.UpdatePipeline(time)
    data = servermanager.Fetch(moment)
    copy = vtkPolyData()
    copy.DeepCopy(data)
    return copy


def shown(data, view):
    producer = simple.TrivialProducer()
    producer.GetClientSideObject().SetOutput(data)
    return simple.Show(producer, view), producer


def new_view():
    view = simple.CreateRenderView()
    view.ViewSize = [800, 900]
    view.UseColorPaletteForBackground = 0
    view.Background = [1.0, 1.0, 1.0]
    view.OrientationAxesVisibility = 0
    return view


def camera(view):
    bounds = at(0.75).GetBounds()
    centre = [0.5 * (low + high) for low, high in zip(bounds[::2], bounds[1::2])]
    view.CameraFocalPoint = centre
    view.CameraPosition = [centre[0] + 60.0, centre[1] - 330.0, centre[2] + 50.0]
    view.CameraViewUp = [0.0, 0.0, 1.0]
    view.CameraViewAngle = 24.0


first = new_view()
for step in range(8):
    display, _ = shown(at(step / 8.0), first)
    simple.ColorBy(display, ("CELLS", "GroupIds"))
    display.SetScalarBarVisibility(first, False)
    display.LineWidth = 3.0
    display.Opacity = 1.0 if step == 0 else 0.45
branches = simple.GetColorTransferFunction("GroupIds")
branches.ApplyPreset("Rainbow Uniform", True)
branches.RescaleTransferFunction(*at(0.0).GetCellData().GetArray("GroupIds").GetRange())
camera(first)

second = new_view()
points, lines, speed = vtkPoints(), vtkCellArray(), vtkDoubleArray()
speed.SetName("Speed")
poses = [at(step / MOMENTS) for step in range(MOMENTS + 1)]
for point in range(0, poses[0].GetNumberOfPoints(), EVERY):
    lines.InsertNextCell(MOMENTS + 1)
    for pose in poses:
        lines.InsertCellPoint(points.InsertNextPoint(pose.GetPoint(point)))
        velocity = pose.GetPointData().GetArray("Velocity").GetTuple3(point)
        speed.InsertNextValue(sum(v * v for v in velocity) ** 0.5)
paths = vtkPolyData()
paths.SetPoints(points)
paths.SetLines(lines)
paths.GetPointData().AddArray(speed)
path_producer = simple.TrivialProducer()
path_producer.GetClientSideObject().SetOutput(paths)
tubes = simple.Tube(path_producer, Radius=0.3)
tubes.Vectors = [None, ""]
display = simple.Show(tubes, second)
simple.ColorBy(display, ("POINTS", "Speed"))
transfer = simple.GetColorTransferFunction("Speed")
transfer.ApplyPreset("Viridis (matplotlib)", True)
transfer.RescaleTransferFunction(0.0, 120.0)
display.Opacity = 0.7
display.SetScalarBarVisibility(second, True)
bar = simple.GetScalarBar(transfer, second)
bar.TitleColor = bar.LabelColor = [0.0, 0.0, 0.0]
bar.Title, bar.ComponentTitle = "Speed, mm/s", ""
bar.RangeLabelFormat = "%.0f"
rest = at(0.75)
spheres = vtkPoints()
vertices = vtkCellArray()
for point in range(0, rest.GetNumberOfPoints(), EVERY):
    vertices.InsertNextCell(1)
    vertices.InsertCellPoint(spheres.InsertNextPoint(rest.GetPoint(point)))
places = vtkPolyData()
places.SetPoints(spheres)
places.SetVerts(vertices)
display, _ = shown(places, second)
display.SetRepresentationType("Points")
display.RenderPointsAsSpheres = 1
display.PointSize = 9.0
display.DiffuseColor = display.AmbientColor = [0.85, 0.1, 0.1]
display, _ = shown(rest, second)
display.DiffuseColor = display.AmbientColor = [0.5, 0.5, 0.5]
display.LineWidth = 2.0
camera(second)

layout = simple.CreateLayout()
for view in (first, second):
    simple.AssignViewToLayout(view=view, layout=layout)
path = os.path.join(arguments.output, "motion.png")
simple.SaveScreenshot(path, layout, ImageResolution=[1600, 900])
print("wrote", path)
"""Pictures of a tracked coronary tree: centerlines over time by branch, trajectories, meshes.

Usage: pvpython scripts/render-motion.py RUN [--output DIR]
RUN is the folder of `coronary-pipeline run --until motion`.
"""

import argparse
import json
import os
import sys

from vtkmodules.vtkCommonCore import vtkLookupTable, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkTubeFilter
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkFiltersCore import vtkGlyph3D
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader
from vtkmodules.vtkRenderingCore import (vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow,
                                         vtkTextActor, vtkWindowToImageFilter)
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401, the renderer's implementation
import vtkmodules.vtkRenderingFreeType  # noqa: F401


def read(path):
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def series(run, name):
    """Times and data of one series."""
    path = os.path.join(run, "motion", name)
    with open(path, encoding="utf-8") as file:
        files = json.load(file)["files"]
    return [(one["time"], read(os.path.join(run, "motion", one["name"]))) for one in files]


def tubes(data, radius):
    filter_ = vtkTubeFilter()
    filter_.SetInputData(data)
    filter_.SetRadius(radius)
    filter_.SetNumberOfSides(10)
    filter_.CappingOn()
    filter_.Update()
    return filter_.GetOutput()


def actor(data, color=None, opacity=1.0, array=None, table=None):
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(data)
    mapper.ScalarVisibilityOff()
    if array is not None:
        mapper.ScalarVisibilityOn()
        mapper.SetScalarModeToUseCellFieldData()
        mapper.SelectColorArray(array)
        mapper.SetLookupTable(table)
        mapper.UseLookupTableScalarRangeOn()
    result = vtkActor()
    result.SetMapper(mapper)
    if color is not None:
        result.GetProperty().SetColor(*color)
    result.GetProperty().SetOpacity(opacity)
    return result


def save(actors, title, path, size=(1100, 900)):
    renderer = vtkRenderer()
    renderer.SetBackground(1.0, 1.0, 1.0)
    for one in actors:
        renderer.AddActor(one)
    text = vtkTextActor()
    text.SetInput(title)
    text.GetTextProperty().SetColor(0.1, 0.1, 0.1)
    text.GetTextProperty().SetFontSize(20)
    text.SetPosition(16, 16)
    renderer.AddActor(text)
    window = vtkRenderWindow()
    window.OffScreenRenderingOn()
    window.SetMultiSamples(4)
    window.SetSize(*size)
    window.AddRenderer(renderer)
    renderer.GetActiveCamera().SetPosition(0.4, -1.0, 0.25)  # from the front, patient's head up
    renderer.GetActiveCamera().SetFocalPoint(0.0, 0.0, 0.0)
    renderer.GetActiveCamera().SetViewUp(0.0, 0.0, 1.0)
    renderer.ResetCamera()
    renderer.GetActiveCamera().Zoom(1.35)
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    writer = vtkPNGWriter()
    writer.SetFileName(path)
    writer.SetInputConnection(grab.GetOutputPort())
    writer.Write()
    print(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("run", help="folder of `coronary-pipeline run --until motion`")
    parser.add_argument("--output", default=".", help="folder for the pictures")
    arguments = parser.parse_args()
    os.makedirs(arguments.output, exist_ok=True)

    lines = series(arguments.run, "centerline.vtp.series")
    surfaces = series(arguments.run, "surface.vtp.series")
    if len(lines) < 3:
        sys.exit(f"{arguments.run}: a motion of three moments or more is needed")

    # Centerlines at all moments, a colour a branch.
    branches = int(lines[0][1].GetCellData().GetArray("GroupIds").GetRange()[1]) + 1
    table = vtkLookupTable()
    table.SetNumberOfTableValues(branches)
    table.SetTableRange(-0.5, branches - 0.5)
    for n in range(branches):
        hue = vtkLookupTable()
        hue.SetHueRange(0.0, 1.0)
        hue.SetValueRange(0.85, 0.85)
        hue.SetTableRange(0.0, 1.0)
        hue.Build()
        color = [0.0, 0.0, 0.0]
        hue.GetColor((n * 0.381966) % 1.0, color)
        table.SetTableValue(n, *color, 1.0)
    actors = [actor(tubes(data, 0.25), array="GroupIds", table=table) for _, data in lines]
    save(actors, f"Centerlines at {len(lines)} moments, by branch",
         os.path.join(arguments.output, "motion_centerlines.png"))

    # Ways of some points.
    start = lines[0][1]
    ways = vtkPolyData()
    points = vtkPoints()
    cells = vtkCellArray()
    chosen = range(0, start.GetNumberOfPoints(), max(1, start.GetNumberOfPoints() // 120))
    for p in chosen:
        # One cycle only: phases beyond it come back to where they began.
        path = [data.GetPoint(p) for time, data in lines if time < lines[0][0] + 1.0]
        cells.InsertNextCell(len(path) + 1)
        first = points.GetNumberOfPoints()
        for n, place in enumerate(path):
            points.InsertNextPoint(place)
            cells.InsertCellPoint(first + n)
        cells.InsertCellPoint(first)
    ways.SetPoints(points)
    ways.SetLines(cells)
    places = vtkPolyData()
    initial = vtkPoints()
    for p in chosen:
        initial.InsertNextPoint(start.GetPoint(p))
    places.SetPoints(initial)
    ball = vtkSphereSource()
    ball.SetRadius(0.8)
    glyph = vtkGlyph3D()
    glyph.SetInputData(places)
    glyph.SetSourceConnection(ball.GetOutputPort())
    glyph.ScalingOff()
    glyph.Update()
    save([actor(tubes(start, 0.3), (0.6, 0.6, 0.6)), actor(glyph.GetOutput(), (0.85, 0.1, 0.1)),
          actor(tubes(ways, 0.3), (0.1, 0.35, 0.8), 0.45)],
         "Positions at the first moment, and their ways through one cycle",
         os.path.join(arguments.output, "motion_trajectories.png"))

    # The wall at three moments.
    third = max(1, len(surfaces) // 3)
    picks = [surfaces[0], surfaces[third], surfaces[min(2 * third, len(surfaces) - 1)]]
    colors = [(0.85, 0.2, 0.2), (0.2, 0.55, 0.25), (0.2, 0.35, 0.85)]
    save([actor(data, color, 0.75) for (_, data), color in zip(picks, colors)],
         "Wall at " + ", ".join(f"{100.0 * time:.0f} %" for time, _ in picks)
         + " of the R-R interval: red, green, blue",
         os.path.join(arguments.output, "motion_surfaces.png"))


if __name__ == "__main__":
    main()
