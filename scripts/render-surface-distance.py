#!/usr/bin/env pvpython
"""A surface against a reference, coloured by the signed distance, with the places of the Hausdorff distance.

The reference is a phantom's surface, the result the surface with other lateral waves.

  xvfb-run -a pvpython scripts/render-surface-distance.py PLUGIN.so OUTPUT.png
"""
import sys

from paraview import servermanager, simple
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingAnnotation import vtkScalarBarActor
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkColorTransferFunction,
    vtkPolyDataMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkTextActor,
    vtkWindowToImageFilter,
)
import vtkmodules.vtkRenderingFreeType  # noqa: F401
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401

SIZE = (1500, 900)
VIEW = (0.50, -0.80, 0.33)  # from the front, the left and a little above
TIME, SURFACE, SEED = 0.75, 2, 7
RANGE = 0.5  # mm


def fetch(source, port):
    tap = servermanager.filters.ReductionFilter(Input=simple.OutputPort(source, port))
    tap.UpdatePipeline(TIME)
    return tap.GetClientSideObject().GetOutputDataObject(0)


simple.LoadPlugin(sys.argv[1], remote=False, ns=vars(simple))
truth = simple.CoronaryPhantom(Seed=SEED, SurfaceSpacing=0.4)
other = simple.CoronaryPhantom(Seed=SEED, SurfaceSpacing=0.4, Tortuosity=0.6)
metrics = simple.MeshDistanceMetrics(Result=simple.OutputPort(other, SURFACE),
                                     Reference=simple.OutputPort(truth, SURFACE))
surface = fetch(metrics, 0)
surface.GetPointData().SetActiveScalars("SurfaceDistance")
field = surface.GetFieldData()

renderer = vtkRenderer()
renderer.SetBackground(0.06, 0.07, 0.09)
colours = vtkColorTransferFunction()
for value, colour in ((-RANGE, (0.15, 0.35, 0.95)), (-0.1 * RANGE, (0.75, 0.80, 0.90)),
                      (0.0, (0.92, 0.92, 0.90)), (0.1 * RANGE, (0.92, 0.80, 0.75)),
                      (RANGE, (0.90, 0.15, 0.12))):
    colours.AddRGBPoint(value, *colour)
mapper = vtkPolyDataMapper()
mapper.SetInputData(surface)
mapper.SetLookupTable(colours)
mapper.SetScalarRange(-RANGE, RANGE)
actor = vtkActor()
actor.SetMapper(mapper)
renderer.AddActor(actor)
places = field.GetArray("HausdorffPoints")
for index, colour in ((0, (0.95, 0.85, 0.25)), (2, (0.40, 0.95, 0.45))):
    ball = vtkSphereSource()
    ball.SetCenter(places.GetTuple3(index))
    ball.SetRadius(1.6)
    ball.SetThetaResolution(24)
    ball.SetPhiResolution(24)
    ball_mapper = vtkPolyDataMapper()
    ball_mapper.SetInputConnection(ball.GetOutputPort())
    ball_actor = vtkActor()
    ball_actor.SetMapper(ball_mapper)
    ball_actor.GetProperty().SetColor(*colour)
    renderer.AddActor(ball_actor)
bar = vtkScalarBarActor()
bar.SetLookupTable(colours)
bar.SetTitle("mm")
bar.SetNumberOfLabels(5)
bar.SetLabelFormat("%.1f")
bar.SetPosition(0.92, 0.12)
bar.SetWidth(0.06)
bar.SetHeight(0.76)
renderer.AddActor(bar)
title = vtkTextActor()
title.SetInput("   ".join("%s %.3f" % (name, field.GetArray(name).GetValue(0))
                          for name in ("HD", "HD95", "MSD", "MSD_area", "RMS")) + "  mm")
title.SetPosition(20, 20)
title.GetTextProperty().SetFontSize(26)
renderer.AddActor(title)
camera = renderer.GetActiveCamera()
camera.SetFocalPoint(0, 0, -45)
camera.SetPosition(300 * VIEW[0], 300 * VIEW[1], -45 + 300 * VIEW[2])
camera.SetViewUp(0, 0, 1)
camera.ParallelProjectionOn()
renderer.ResetCamera()
camera.SetParallelScale(65.0)
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(*SIZE)
window.SetMultiSamples(8)
window.AddRenderer(renderer)
renderer.ResetCameraClippingRange(-400, 400, -400, 400, -400, 400)
window.Render()
grab = vtkWindowToImageFilter()
grab.SetInput(window)
writer = vtkPNGWriter()
writer.SetInputConnection(grab.GetOutputPort())
writer.SetFileName(sys.argv[2])
writer.Write()
