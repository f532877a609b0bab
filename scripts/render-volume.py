#!/usr/bin/env pvpython
"""Cuts through the tetrahedra of a phantom's vessels, at a bifurcation, a cap and a stenosis, and a
foreign surface before and after cleaning.

  xvfb-run -a pvpython scripts/render-volume.py PLUGIN.so OUTPUT_FOLDER [SURFACE X Y Z SIZE]

SURFACE is a .stl or .vtp, X Y Z and SIZE what the picture of it shows, in mm.
"""
import math
import os
import sys

from paraview import servermanager, simple
from vtkmodules.vtkCommonDataModel import vtkBox, vtkImplicitBoolean, vtkPlane
from vtkmodules.vtkFiltersCore import vtkFeatureEdges, vtkThreshold, vtkTubeFilter
from vtkmodules.vtkFiltersExtraction import vtkExtractGeometry
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter
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

SIZE = (800, 800)  # of a panel
WALL = (0.62, 0.70, 0.80)
CUT = (0.93, 0.88, 0.70)
NEW = (0.95, 0.60, 0.25)


def fetch(source, port=0):
    tap = servermanager.filters.ReductionFilter(Input=simple.OutputPort(source, port))
    tap.UpdatePipeline()
    return tap.GetClientSideObject().GetOutputDataObject(0)


def add(renderer, source, colour, edges=True):
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(source.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(colour)
    actor.GetProperty().SetInterpolationToFlat()
    if edges:
        actor.GetProperty().EdgeVisibilityOn()
        actor.GetProperty().SetEdgeColor(0.10, 0.12, 0.16)
    renderer.AddActor(actor)
    return actor


def panel(index, count, title):
    renderer = vtkRenderer()
    renderer.SetViewport(index / count, 0.0, (index + 1) / count, 1.0)
    renderer.SetBackground(1.0, 1.0, 1.0)
    text = vtkTextActor()
    text.SetInput(title)
    text.SetPosition(20, SIZE[1] - 44)
    text.GetTextProperty().SetFontSize(26)
    text.GetTextProperty().SetColor(0.1, 0.1, 0.1)
    renderer.AddActor(text)
    return renderer


def look(renderer, place, direction, size):
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetFocalPoint(place)
    camera.SetPosition([p + 60.0 * size * d for p, d in zip(place, direction)])
    up = (0.0, 0.0, 1.0) if abs(direction[2]) < 0.9 else (0.0, 1.0, 0.0)
    camera.SetViewUp(up)
    camera.SetParallelScale(size)
    camera.SetClippingRange(1.0 * size, 120.0 * size)


def write(renderers, name):
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(8)
    window.SetSize(SIZE[0] * len(renderers), SIZE[1])
    for renderer in renderers:
        window.AddRenderer(renderer)
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    writer = vtkPNGWriter()
    writer.SetInputConnection(grab.GetOutputPort())
    writer.SetFileName(name)
    writer.Write()


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    length = math.sqrt(sum(x * x for x in a))
    return [x / length for x in a]


def places(tree):
    """Where to look: name -> (place, normal of the cut, half the picture's height)."""
    radius = tree.GetPointData().GetArray("MaximumInscribedSphereRadius")
    lines = [[tree.GetCell(c).GetPointId(i) for i in range(tree.GetCell(c).GetNumberOfPoints())]
             for c in range(tree.GetNumberOfCells())]
    starts = {}
    for line in lines:
        starts.setdefault(line[0], []).append(line)
    found = {}
    for line in lines:
        daughters = starts.get(line[-1], [])
        if len(daughters) == 2 and len(line) > 20 and "a bifurcation" not in found:
            place = tree.GetPoint(line[-1])
            ways = [[a - b for a, b in zip(tree.GetPoint(d[min(6, len(d) - 1)]), place)]
                    for d in daughters]
            found["a bifurcation"] = (place, unit(cross(*ways)), 2.5 * radius.GetValue(line[-1]))
    trunk = max(lines, key=lambda line: radius.GetValue(line[0]))
    way = unit([a - b for a, b in zip(tree.GetPoint(trunk[6]), tree.GetPoint(trunk[0]))])
    found["a cap"] = ([p + 1.2 * w for p, w in zip(tree.GetPoint(trunk[0]), way)],
                      unit(cross(way, (0.3, 0.5, 0.8))), 1.6 * radius.GetValue(trunk[0]))
    least = 1.0
    for line in lines:
        for i in range(12, len(line) - 12):
            around = min(radius.GetValue(line[i - 12]), radius.GetValue(line[i + 12]))
            ratio = radius.GetValue(line[i]) / around
            if ratio < least:
                least = ratio
                way = unit([a - b for a, b in zip(tree.GetPoint(line[i + 3]),
                                                  tree.GetPoint(line[i - 3]))])
                found["a stenosis"] = (tree.GetPoint(line[i]), unit(cross(way, (0.3, 0.5, 0.8))),
                                       2.5 * around)
    return found


def cuts(folder):
    phantom = simple.CoronaryPhantom(Seed=3, Stenoses=6)
    mesher = simple.TetrahedralMesher(Surface=simple.OutputPort(phantom, 2),
                                      Skeleton=simple.OutputPort(phantom, 1))
    volume, edges = fetch(mesher, 0), fetch(mesher, 2)
    renderers = []
    wanted = places(fetch(phantom, 1))
    for index, (title, (place, normal, size)) in enumerate(sorted(wanted.items())):
        plane = vtkPlane()
        plane.SetOrigin(place)
        plane.SetNormal(normal)
        box = vtkBox()
        box.SetBounds([p + s * 2.2 * size for p in place for s in (-1, 1)])
        region = vtkImplicitBoolean()
        region.SetOperationTypeToIntersection()
        region.AddFunction(plane)
        region.AddFunction(box)
        extract = vtkExtractGeometry()
        extract.SetInputData(volume)
        extract.SetImplicitFunction(region)
        extract.ExtractBoundaryCellsOn()
        outside = vtkDataSetSurfaceFilter()
        outside.SetInputConnection(extract.GetOutputPort())
        renderer = panel(index, len(wanted), "Cut at " + title)
        add(renderer, outside, CUT)
        near = vtkExtractGeometry()
        near.SetInputData(edges)
        near.SetImplicitFunction(box)
        lines = vtkDataSetSurfaceFilter()
        lines.SetInputConnection(near.GetOutputPort())
        tube = vtkTubeFilter()
        tube.SetInputConnection(lines.GetOutputPort())
        tube.SetRadius(0.02 * size)
        tube.SetNumberOfSides(8)
        add(renderer, tube, (0.85, 0.10, 0.10), edges=False)
        look(renderer, place, normal, size)
        renderers.append(renderer)
    write(renderers, os.path.join(folder, "volume.png"))


def cleaning(folder, name, place, size):
    reader = simple.OpenDataFile(name)
    cleaner = simple.SurfaceCleaner(Surface=reader)
    before, after = fetch(reader), fetch(cleaner)
    for i in range(after.GetFieldData().GetAbstractArray("Repairs").GetNumberOfValues()):
        print(after.GetFieldData().GetAbstractArray("Repairs").GetValue(i))
    renderers = []
    for index, (title, surface) in enumerate((("Before", before), ("After", after))):
        renderer = panel(index, 2, title)
        shown = vtkDataSetSurfaceFilter()
        shown.SetInputData(surface)
        add(renderer, shown, WALL)
        if surface is after:
            # New triangles in another colour.
            fresh = vtkThreshold()
            fresh.SetInputData(surface)
            fresh.SetInputArrayToProcess(0, 0, 0, 1, "SurfaceCellId")
            fresh.SetLowerThreshold(-1.5)
            fresh.SetUpperThreshold(-0.5)
            patches = vtkDataSetSurfaceFilter()
            patches.SetInputConnection(fresh.GetOutputPort())
            mapper = add(renderer, patches, NEW).GetMapper()
            mapper.SetResolveCoincidentTopologyToPolygonOffset()
            mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(-2.0, -2.0)
        rims = vtkFeatureEdges()
        rims.SetInputData(surface)
        rims.FeatureEdgesOff()
        rims.ColoringOff()
        add(renderer, rims, (0.85, 0.10, 0.10), edges=False).GetProperty().SetLineWidth(4)
        look(renderer, place, unit((-0.84, -0.54, 0.25)), size)
        renderers.append(renderer)
    write(renderers, os.path.join(folder, "cleaning.png"))


if len(sys.argv) not in (3, 8):
    sys.exit(__doc__)
simple.LoadPlugin(sys.argv[1], remote=False, ns=vars(simple))
os.makedirs(sys.argv[2], exist_ok=True)
if len(sys.argv) == 8:
    cleaning(sys.argv[2], sys.argv[3], [float(x) for x in sys.argv[4:7]], float(sys.argv[7]))
else:
    cuts(sys.argv[2])
