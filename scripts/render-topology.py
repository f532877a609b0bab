#!/usr/bin/env pvpython
"""The named coronary trees of three phantoms, right, left and balanced dominance.

  xvfb-run -a pvpython scripts/render-topology.py PLUGIN.so OUTPUT.png
"""
import sys

from paraview import servermanager, simple
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkTubeFilter
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkBillboardTextActor3D,
    vtkPolyDataMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkTextActor,
    vtkWindowToImageFilter,
)
import vtkmodules.vtkRenderingFreeType  # noqa: F401
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401

SIZE = (2100, 900)
VIEW = (0.50, -0.80, 0.33)  # from the front, the left and a little above
COLOURS = [(0.90, 0.30, 0.25), (0.95, 0.65, 0.20), (0.95, 0.90, 0.35), (0.45, 0.80, 0.40),
           (0.30, 0.70, 0.90), (0.45, 0.50, 0.95), (0.80, 0.45, 0.90), (0.95, 0.55, 0.70),
           (0.60, 0.85, 0.75), (0.75, 0.70, 0.60)]


def fetch(source, port):
    tap = servermanager.filters.ReductionFilter(Input=simple.OutputPort(source, port))
    tap.UpdatePipeline()
    return tap.GetClientSideObject().GetOutputDataObject(0)


def add(renderer, source, colour):
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(source.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(colour)
    actor.GetProperty().SetSpecular(0.3)
    renderer.AddActor(actor)


def panel(dominance, viewport, seed):
    phantom = simple.CoronaryPhantom(Seed=seed, Dominance=dominance, RamusIntermedius=1)
    topology = simple.CoronaryTreeTopology(Input=simple.OutputPort(phantom, 1))
    tree, bifurcations = fetch(topology, 0), fetch(topology, 1)
    found = tree.GetFieldData().GetAbstractArray("Dominance").GetValue(0)
    if found != dominance.lower():
        sys.exit("FAILED: %s dominance was taken for %s" % (dominance, found))
    renderer = vtkRenderer()
    renderer.SetViewport(viewport)
    renderer.SetBackground(0.06, 0.07, 0.09)
    ids = tree.GetCellData().GetArray("SegmentIds")
    names = tree.GetCellData().GetAbstractArray("SegmentLabel")
    lengths = tree.GetCellData().GetArray("Length")
    longest = {}
    for cell in range(tree.GetNumberOfCells()):
        points, lines = vtkPoints(), vtkCellArray()
        line = tree.GetCell(cell).GetPointIds()
        lines.InsertNextCell(line.GetNumberOfIds())
        for i in range(line.GetNumberOfIds()):
            lines.InsertCellPoint(points.InsertNextPoint(tree.GetPoint(line.GetId(i))))
        one = vtkPolyData()
        one.SetPoints(points)
        one.SetLines(lines)
        tube = vtkTubeFilter()
        tube.SetInputData(one)
        tube.SetRadius(1.1)
        tube.SetNumberOfSides(12)
        add(renderer, tube, COLOURS[int(ids.GetValue(cell)) % len(COLOURS)])
        name = names.GetValue(cell)
        if name not in longest or lengths.GetValue(cell) > longest[name][0]:
            longest[name] = (lengths.GetValue(cell), points.GetPoint(line.GetNumberOfIds() // 2))
    for i in range(bifurcations.GetNumberOfPoints()):
        ball = vtkSphereSource()
        ball.SetCenter(bifurcations.GetPoint(i))
        ball.SetRadius(1.6)
        add(renderer, ball, (0.95, 0.95, 0.95))
    for name, (_, place) in longest.items():
        # Towards the viewer, so that no vessel hides a name; with parallel rays it stays in place.
        place = [place[i] + 150.0 * VIEW[i] for i in range(3)]
        text = vtkBillboardTextActor3D()
        text.SetInput(name)
        text.SetPosition(place)
        text.SetDisplayOffset(9, 6)
        text.GetTextProperty().SetFontSize(20)
        text.GetTextProperty().SetColor(1, 1, 1)
        renderer.AddActor(text)
    title = vtkTextActor()
    title.SetInput("%s dominance" % dominance)
    title.SetPosition(20, SIZE[1] - 50)
    title.GetTextProperty().SetFontSize(28)
    renderer.AddActor(title)
    camera = renderer.GetActiveCamera()
    camera.SetFocalPoint(0, 0, -45)
    camera.SetPosition(300 * VIEW[0], 300 * VIEW[1], -45 + 300 * VIEW[2])
    camera.SetViewUp(0, 0, 1)
    camera.ParallelProjectionOn()
    renderer.ResetCamera()
    camera.SetParallelScale(80.0)
    renderer.ResetCameraClippingRange(-400, 400, -400, 400, -400, 400)
    return renderer


simple.LoadPlugin(sys.argv[1], remote=False, ns=vars(simple))
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(*SIZE)
window.SetMultiSamples(8)
for column, kind in enumerate(("Right", "Left", "Balanced")):
    window.AddRenderer(panel(kind, (column / 3.0, 0.0, (column + 1) / 3.0, 1.0), 5 + column))
window.Render()
grab = vtkWindowToImageFilter()
grab.SetInput(window)
writer = vtkPNGWriter()
writer.SetInputConnection(grab.GetOutputPort())
writer.SetFileName(sys.argv[2])
writer.Write()
