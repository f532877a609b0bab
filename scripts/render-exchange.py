#!/usr/bin/env pvpython
"""The surface of a segmentation of 3D Slicer with markup curves over it.

  xvfb-run -a pvpython scripts/render-exchange.py PLUGIN.so MASK.seg.nrrd CURVES.mrk.json OUTPUT.png
"""
import json
import sys

from paraview import servermanager, simple
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkTubeFilter
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkBillboardTextActor3D,
    vtkPolyDataMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkWindowToImageFilter,
)
import vtkmodules.vtkRenderingFreeType  # noqa: F401
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401

SIZE = (1400, 1000)
VIEW = (0.50, -0.80, 0.33)  # from the front, the left and a little above


def fetch(source):
    """The data of a source, in this process."""
    tap = servermanager.filters.ReductionFilter(Input=source)
    tap.UpdatePipeline()
    return tap.GetClientSideObject().GetOutputDataObject(0)


def add(renderer, data, colour, opacity=1.0):
    """An actor in one colour."""
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(data)
    mapper.ScalarVisibilityOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(colour)
    actor.GetProperty().SetOpacity(opacity)
    renderer.AddActor(actor)


def tube(places):
    """A thin tube along a curve."""
    points, lines = vtkPoints(), vtkCellArray()
    lines.InsertNextCell(len(places))
    for place in places:
        lines.InsertCellPoint(points.InsertNextPoint(place))
    data = vtkPolyData()
    data.SetPoints(points)
    data.SetLines(lines)
    tubes = vtkTubeFilter()
    tubes.SetInputData(data)
    tubes.SetRadius(0.35)
    tubes.SetNumberOfSides(12)
    tubes.Update()
    return tubes.GetOutput()


def main(plugin, mask, markups, output):
    simple.LoadPlugin(plugin, ns=vars(simple))
    reader = simple.SegmentationReader(FileNames=[mask])
    contour = simple.Contour(Input=reader, ContourBy=["POINTS", "VesselMask"], Isosurfaces=[0.5])
    renderer = vtkRenderer()
    renderer.SetBackground(0.06, 0.07, 0.09)
    add(renderer, fetch(contour), (0.85, 0.35, 0.30), 0.45)
    with open(markups, encoding="utf-8") as file:
        curves = json.load(file)["markups"]
    for curve in curves:
        places = [point["position"] for point in curve["controlPoints"]]
        add(renderer, tube(places), (0.95, 0.85, 0.25))
        label = vtkBillboardTextActor3D()
        label.SetInput(curve["name"])
        label.SetPosition(places[len(places) // 2])
        label.GetTextProperty().SetFontSize(20)
        renderer.AddActor(label)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(*SIZE)
    window.SetMultiSamples(8)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.SetFocalPoint(0, 0, 0)
    camera.SetPosition(*VIEW)
    camera.SetViewUp(0, 0, 1)
    renderer.ResetCamera()
    camera.Zoom(1.3)
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    writer = vtkPNGWriter()
    writer.SetInputConnection(grab.GetOutputPort())
    writer.SetFileName(output)
    writer.Write()
    print("%s: %d curves" % (output, len(curves)))


if __name__ == "__main__":
    main(*sys.argv[1:])
