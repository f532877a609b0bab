#!/usr/bin/env pvpython
"""Centerlines against a reference: what is found, missed and false.

The reference is a phantom's tree, the result the tree with less lateral waves.

  xvfb-run -a pvpython scripts/render-metrics.py PLUGIN.so OUTPUT.png
"""
import sys

from paraview import servermanager, simple
from vtkmodules.vtkCommonCore import vtkLookupTable
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

import pictures

SIZE = (1500, 900)
COLOURS = {0: (0.5, 0.5, 0.5), 1: (0.35, 0.80, 0.40), 2: (0.90, 0.25, 0.20), 3: (0.95, 0.85, 0.25)}

simple.LoadPlugin(sys.argv[1], remote=False, ns=vars(simple))
truth = simple.CoronaryPhantom(Seed=7)
other = simple.CoronaryPhantom(Seed=7, Tortuosity=0.3)
metrics = simple.CenterlineMetrics(Result=simple.OutputPort(other, 1),
                                   Reference=simple.OutputPort(truth, 1))
table, lines = servermanager.Fetch(simple.OutputPort(metrics, 0)), pictures.fetch(metrics, 1)
last = table.GetNumberOfRows() - 1
numbers = ["%s %.3f" % (name, table.GetColumnByName(name).GetValue(last))
           for name in ("OV", "OF", "OT", "AD", "AI", "AT")]

colours = vtkLookupTable()
colours.SetNumberOfTableValues(4)
colours.SetTableRange(0, 3)
for value, colour in COLOURS.items():
    colours.SetTableValue(value, *colour)
lines.GetPointData().SetActiveScalars("CenterlineMatch")
mapper = vtkPolyDataMapper()
mapper.SetInputData(pictures.tube(lines, 0.6, 12))
mapper.SetLookupTable(colours)
mapper.SetScalarRange(0, 3)
actor = vtkActor()
actor.SetMapper(mapper)
renderer = pictures.new_renderer()
renderer.AddActor(actor)
pictures.add_text(renderer, "   ".join(numbers), 20, 20, 26)
pictures.look_at_phantom(renderer, 65.0)
pictures.save(pictures.off_screen(SIZE, [renderer]), sys.argv[2])
