#!/usr/bin/env pvpython
"""Pictures of the tetrahedra that `coronary-pipeline run --until volume` wrote.

  xvfb-run -a pvpython scripts/render-volume.py demo-output/run --output demo-output/pictures
  ... [--plugin DynamicCoronaryPlugin.so]

volume.png  tetrahedra behind a cut, and the skeleton among them: at a bifurcation, a cap, a stenosis,
            two vessels that pass each other at 0.5 mm. The last two are made for the picture
"""
import argparse
import importlib
import os

from vtkmodules.vtkCommonDataModel import vtkBox, vtkImplicitBoolean, vtkPlane
from vtkmodules.vtkFiltersCore import vtkTubeFilter
from vtkmodules.vtkFiltersExtraction import vtkExtractGeometry
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

import pictures

surfaces = importlib.import_module("render-surface")

CELLS = (0.93, 0.88, 0.70)
EDGE = (0.12, 0.10, 0.12)
SKELETON = (0.85, 0.10, 0.10)


def filled(plugin, tree):
    """Tetrahedra of a tree's swept surface, and their edges along the tree."""
    from paraview import simple
    simple.LoadPlugin(plugin, ns=simple.__dict__)
    source = simple.TrivialProducer()
    source.GetClientSideObject().SetOutput(tree)
    mesher = simple.TetrahedralMesher(Surface=simple.FrenetSweepSurface(Input=source),
                                      Skeleton=source)
    return [pictures.fetch(mesher, port) for port in (0, 2)]


def add_cut(panel, cut):
    """The tetrahedra on the far side of a plane, whole, and the skeleton near it."""
    (volume, edges), place, normal, size = cut
    plane = vtkPlane()
    plane.SetOrigin(place)
    plane.SetNormal(normal)
    box = vtkBox()
    box.SetBounds([p + s * 3.0 * size for p in place for s in (-1, 1)])
    region = vtkImplicitBoolean()
    region.SetOperationTypeToIntersection()
    region.AddFunction(plane)
    region.AddFunction(box)
    cells = vtkExtractGeometry()
    cells.SetInputData(volume)
    cells.SetImplicitFunction(region)
    cells.ExtractBoundaryCellsOn()
    shell = vtkDataSetSurfaceFilter()
    shell.SetInputConnection(cells.GetOutputPort())
    near = vtkExtractGeometry()
    near.SetInputData(edges)
    near.SetImplicitFunction(box)
    lines = vtkDataSetSurfaceFilter()
    lines.SetInputConnection(near.GetOutputPort())
    tube = vtkTubeFilter()
    tube.SetInputConnection(lines.GetOutputPort())
    tube.SetRadius(0.012 * size)
    tube.SetNumberOfSides(8)
    for source, color in ((shell, CELLS), (tube, SKELETON)):
        mapper = vtkPolyDataMapper()
        mapper.SetInputConnection(source.GetOutputPort())
        mapper.ScalarVisibilityOff()
        actor = vtkActor()
        actor.SetMapper(mapper)
        style = actor.GetProperty()
        style.SetColor(*color)
        style.SetInterpolationToFlat()
        if source is shell:
            style.EdgeVisibilityOn()
            style.SetEdgeColor(*EDGE)
        panel.AddActor(actor)


def across_fork(lines, place):
    """Normal of the plane in which two branches leave a bifurcation."""
    ways = []
    for cell in range(lines.GetNumberOfCells()):
        points = lines.GetCell(cell).GetPoints()
        if max(abs(a - b) for a, b in zip(points.GetPoint(0), place)) < 1e-6:
            later = points.GetPoint(min(6, points.GetNumberOfPoints() - 1))
            ways.append([a - b for a, b in zip(later, place)])
    return pictures.cross(*ways[:2]) if len(ways) > 1 else (0.2, -1.0, 0.25)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("input", help="folder that coronary-pipeline run --until volume wrote")
    parser.add_argument("--output", required=True, help="folder for the picture")
    parser.add_argument("--plugin", help="DynamicCoronaryPlugin.so; default: that of build/paraview")
    arguments = parser.parse_args()
    path = os.path.join(arguments.input, "volume.vtu")
    if not os.path.isfile(path):
        pictures.fail("missing file: " + path)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    tree = (reader.GetOutput(),
            pictures.read_poly(os.path.join(arguments.input, "volume_skeleton.vtp")))
    caps = pictures.read_poly(os.path.join(arguments.input, "caps.vtp"))
    lines = pictures.read_poly(os.path.join(arguments.input, "centerline.vtp"))
    forks = pictures.read_poly(os.path.join(arguments.input, "bifurcations.vtp"))
    if tree[0].GetNumberOfCells() == 0 or caps.GetNumberOfPoints() == 0:
        pictures.fail("%s has no tetrahedra" % arguments.input)
    plugin = arguments.plugin or surfaces.built_plugin()

    place, radius = surfaces.bifurcation(tree[0], forks)
    inlet = caps.GetPoint(0)
    normal = caps.GetPointData().GetArray("CapNormal").GetTuple(0)
    width = caps.GetPointData().GetArray(surfaces.RADIUS).GetTuple1(0)
    # In the plane of the cap, so that the cut goes through it.
    across = pictures.unit(pictures.cross(normal, (0.3, 0.5, 0.8)))
    inside = [p - 1.2 * width * n for p, n in zip(inlet, normal)]
    shots = []
    for name, mesh, where, eye, scale in (
            ("bifurcation", tree, place, across_fork(lines, place), 2.6 * radius),
            ("cap of an inlet", tree, inside, across, 1.8 * width),
            ("stenosis", filled(plugin, surfaces.stenosis()), (10.0, 0.36, 0.0), (0.0, 0.0, 1.0), 2.4),
            ("two vessels at 0.5 mm", filled(plugin, surfaces.passing()), (0.0, 0.0, 1.2),
             (0.87, -0.5, 0.0), 3.0)):
        # Cells with positive function values are left out: the plane's normal looks at the eye.
        shots.append((name, (mesh, where, pictures.unit(eye), scale), where, eye, scale))
    os.makedirs(arguments.output, exist_ok=True)
    window = surfaces.close_ups("Tetrahedra behind a cut: %d in %d points; the skeleton red"
                                % (tree[0].GetNumberOfCells(), tree[0].GetNumberOfPoints()),
                                shots, add_cut)
    pictures.save(window, arguments.output, "volume.png")


if __name__ == "__main__":
    main()
