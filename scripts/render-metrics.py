#!/usr/bin/env pvpython
"""Centerlines against a reference: what is found, missed and false.

The reference is a phantom's tree, the result the tree with less lateral waves.

  xvfb-run -a pvpython scripts/render-metrics.py PLUGIN.so OUTPUT.png
"""
import sys

from paraview import servermanager, simple
from vtkmodules.vtkCommonCore import vtkLookupTable
from vtkmodules.vtkFiltersCore import vtkTubeFilter
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (
    vtkActor,
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
COLOURS = {0: (0.5, 0.5, 0.5), 1: (0.35, 0.80, 0.40), 2: (0.90, 0.25, 0.20), 3: (0.95, 0.85, 0.25)}


def fetch(source, port):
    tap = servermanager.filters.ReductionFilter(Input=simple.OutputPort(source, port))
    tap.UpdatePipeline()
    return tap.GetClientSideObject().GetOutputDataObject(0)


simple.LoadPlugin(sys.argv[1], remote=False, ns=vars(simple))
truth = simple.CoronaryPhantom(Seed=7)
other = simple.CoronaryPhantom(Seed=7, Tortuosity=0.3)
metrics = simple.CenterlineMetrics(Result=simple.OutputPort(other, 1),
                                   Reference=simple.OutputPort(truth, 1))
table, lines = servermanager.Fetch(simple.OutputPort(metrics, 0)), fetch(metrics, 1)
last = table.GetNumberOfRows() - 1
numbers = ["%s %.3f" % (name, table.GetColumnByName(name).GetValue(last))
           for name in ("OV", "OF", "OT", "AD", "AI", "AT")]

colours = vtkLookupTable()
colours.SetNumberOfTableValues(4)
colours.SetTableRange(0, 3)
for value, colour in COLOURS.items():
    colours.SetTableValue(value, *colour)
lines.GetPointData().SetActiveScalars("CenterlineMatch")
tube = vtkTubeFilter()
tube.SetInputData(lines)
tube.SetRadius(0.6)
tube.SetNumberOfSides(12)
mapper = vtkPolyDataMapper()
mapper.SetInputConnection(tube.GetOutputPort())
mapper.SetLookupTable(colours)
mapper.SetScalarRange(0, 3)
actor = vtkActor()
actor.SetMapper(mapper)
renderer = vtkRenderer()
renderer.SetBackground(0.06, 0.07, 0.09)
renderer.AddActor(actor)
title = vtkTextActor()
title.SetInput("   ".join(numbers))
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
