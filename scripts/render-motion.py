#!/usr/bin/env pvpython
"""A picture of a tree's motion.

  xvfb-run -a -s "-screen 0 1600x1000x24 -noreset" pvpython scripts/render-motion.py PLUGIN.so --output FOLDER

motion.png  left: centerlines at eight moments of a cycle, coloured by branch; right: where every few points go, as tubes
            coloured by speed, with red spheres where they are at 75 %. The phantom's tree, every other of the paper's phases known.
"""
import argparse
import os

import pictures
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
transfer.ApplyPreset(pictures.matplotlib_preset("Viridis"), True)
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
