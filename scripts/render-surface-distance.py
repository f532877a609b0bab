#!/usr/bin/env pvpython
"""A surface against a reference, coloured by the signed distance, with the places of the Hausdorff distance.

The reference is a phantom's surface, the result the surface with other lateral waves.

  xvfb-run -a pvpython scripts/render-surface-distance.py PLUGIN.so OUTPUT.png
"""
import sys

from paraview import servermanager, simple
from vtkmodules.vtkRenderingAnnotation import vtkScalarBarActor
from vtkmodules.vtkRenderingCore import vtkActor, vtkColorTransferFunction, vtkPolyDataMapper

import pictures

SIZE = (1500, 900)
TIME, SURFACE, SEED = 0.75, 2, 7
RANGE = 0.5  # mm

simple.LoadPlugin(sys.argv[1], remote=False, ns=vars(simple))
truth = simple.CoronaryPhantom(Seed=SEED, SurfaceSpacing=0.4)
other = simple.CoronaryPhantom(Seed=SEED, SurfaceSpacing=0.4, Tortuosity=0.6)
metrics = simple.MeshDistanceMetrics(Result=simple.OutputPort(other, SURFACE),
                                     Reference=simple.OutputPort(truth, SURFACE))
surface = pictures.fetch(metrics, 0, TIME)
surface.GetPointData().SetActiveScalars("SurfaceDistance")
field = surface.GetFieldData()

renderer = pictures.new_renderer()
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
    pictures.add_plain(renderer, pictures.ball(places.GetTuple3(index), 1.6), colour)
bar = vtkScalarBarActor()
bar.SetLookupTable(colours)
bar.SetTitle("mm")
bar.SetNumberOfLabels(5)
bar.SetLabelFormat("%.1f")
bar.SetPosition(0.92, 0.12)
bar.SetWidth(0.06)
bar.SetHeight(0.76)
renderer.AddActor(bar)
numbers = "   ".join("%s %.3f" % (name, field.GetArray(name).GetValue(0))
                     for name in ("HD", "HD95", "MSD", "MSD_area", "RMS"))
pictures.add_text(renderer, numbers + "  mm", 20, 20, 26)
pictures.look_at_phantom(renderer, 65.0)
pictures.save(pictures.off_screen(SIZE, [renderer]), sys.argv[2])
