#!/usr/bin/env pvpython
"""Pictures of sessions of the simulator.

  coronary-simulator --headless --replay a.pcirec --output A --write-wall --output-rate 2
  xvfb-run -a -s "-screen 0 1600x1000x24 -noreset" pvpython scripts/render-simulator.py A B --output FOLDER

simulator.png  one panel a session: the wall at the last moment, the wire and the catheter in it, and where its tip has been over the
               beating heart (dots, from blue at the start to yellow at the end).
"""
import argparse
import csv
import glob
import os

import pictures
from paraview import simple
from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkGlyph3D
from vtkmodules.vtkFiltersSources import vtkSphereSource

WIDTH, HEIGHT = 480, 640  # of a panel

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("sessions", nargs="+")
parser.add_argument("--output", default=".")
parser.add_argument("--name", default="simulator.png")
parser.add_argument("--zoom", type=float, default=1.0)
parser.add_argument("--only-artery", action="store_true", help="aim at the wire, not at the whole tree")
arguments = parser.parse_args()
os.makedirs(arguments.output, exist_ok=True)


def tip_track(folder):
    points, times, vertices = vtkPoints(), vtkDoubleArray(), vtkCellArray()
    times.SetName("seconds")
    with open(os.path.join(folder, "tip.csv"), newline="") as table:
        for row in csv.DictReader(table):
            index = points.InsertNextPoint(*(float(row[name]) for name in ("x_mm", "y_mm", "z_mm")))
            vertices.InsertNextCell(1, [index])
            times.InsertNextValue(float(row["seconds"]))
    track = vtkPolyData()
    track.SetPoints(points)
    track.SetVerts(vertices)
    track.GetPointData().SetScalars(times)
    sphere = vtkSphereSource()
    sphere.SetRadius(0.45)
    balls = vtkGlyph3D()
    balls.SetInputData(track)
    balls.SetSourceConnection(sphere.GetOutputPort())
    balls.ScalingOff()
    balls.SetColorModeToColorByScalar()
    balls.Update()
    return balls.GetOutput()


layout = simple.CreateLayout("sessions")
cell = 0
for place, folder in enumerate(arguments.sessions):
    view = simple.CreateRenderView()
    simple.AssignViewToLayout(view=view, layout=layout, hint=cell)
    left = len(arguments.sessions) - place
    if left > 1:
        cell = layout.SplitHorizontal(cell, 1.0 / left) + 1
    view.Background = [1, 1, 1]
    view.UseColorPaletteForBackground = 0
    view.OrientationAxesVisibility = 0
    wire = sorted(glob.glob(os.path.join(folder, "wire_*.vtp")))[-1]
    wall = sorted(glob.glob(os.path.join(folder, "wall_*.vtp")))[-1]
    surface = simple.XMLPolyDataReader(FileName=[wall])
    shown = simple.Show(surface, view)
    shown.ColorArrayName = ["POINTS", ""]
    shown.DiffuseColor = shown.AmbientColor = [0.85, 0.35, 0.3]
    shown.Opacity = 0.28
    lines = simple.XMLPolyDataReader(FileName=[wire])
    tube = simple.Tube(lines, Radius=0.3)
    drawn = simple.Show(tube, view)
    drawn.ColorArrayName = ["POINTS", ""]
    drawn.DiffuseColor = drawn.AmbientColor = [0.05, 0.05, 0.1]
    balls = simple.TrivialProducer()
    balls.GetClientSideObject().SetOutput(tip_track(folder))
    balls.UpdatePipeline()
    ball = simple.Show(balls, view)
    simple.ColorBy(ball, ("POINTS", "seconds"))
    simple.GetColorTransferFunction("seconds").ApplyPreset(pictures.matplotlib_preset("Plasma"), True)
    ball.SetScalarBarVisibility(view, False)
    bounds = (lines if arguments.only_artery else surface).GetDataInformation().GetBounds()
    middle = [0.5 * (bounds[0] + bounds[1]), 0.5 * (bounds[2] + bounds[3]), 0.5 * (bounds[4] + bounds[5])]
    size = max(bounds[1] - bounds[0], bounds[3] - bounds[2], bounds[5] - bounds[4])
    view.CameraFocalPoint = middle
    view.CameraPosition = [middle[0] + 0.7 * size, middle[1] - 2.2 * size, middle[2] + 0.6 * size]
    view.CameraViewUp = [0, 0, 1]
    view.CameraParallelProjection = 1
    view.CameraParallelScale = 0.8 * size / arguments.zoom
    label = simple.Text(Text=os.path.basename(os.path.normpath(folder)))
    text = simple.Show(label, view)
    text.Color = [0, 0, 0]
    text.FontSize = 14

path = os.path.join(arguments.output, arguments.name)
simple.SaveScreenshot(path, layout, ImageResolution=[WIDTH * len(arguments.sessions), HEIGHT])
print(path)
