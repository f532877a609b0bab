#!/usr/bin/env pvpython
"""Pictures of a case of OpenFOAM that `coronary-pipeline sequence --formats openfoam` wrote.

  xvfb-run -a -s "-screen 0 1600x1000x24 -noreset" pvpython scripts/render-flow.py CASE --output FOLDER

flow-mesh.png   left: cells that a plane along the vessel at the inlet cuts; right: the inlet's faces
flow-wall.png   of a case that was solved: wall shear at the last time, or its mean over the last cycle where there is one
flow-speed.png  of a case that was solved: speed at the last time, on a section along the tree
"""
import argparse
import os

import numpy
import pictures
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkPlane
from vtkmodules.vtkFiltersCore import vtkCutter
from vtkmodules.vtkFiltersExtraction import vtkExtractGeometry
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter
from vtkmodules.vtkIOGeometry import vtkOpenFOAMReader
from vtkmodules.vtkRenderingAnnotation import vtkScalarBarActor
from vtkmodules.vtkRenderingCore import vtkActor, vtkDataSetMapper, vtkRenderer
import vtkmodules.vtkRenderingFreeType  # noqa: F401
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401

DENSITY = 1060.0


def read(case):
    """Internal mesh and patches by name, at the last time."""
    reader = vtkOpenFOAMReader()
    reader.SetFileName(os.path.join(case, "case.foam"))
    reader.UpdateInformation()
    reader.EnableAllPatchArrays()
    reader.EnableAllCellArrays()
    reader.CreateCellToPointOff()
    times = [reader.GetTimeValues().GetValue(n) for n in range(reader.GetTimeValues().GetNumberOfValues())]
    reader.UpdateTimeStep(times[-1] if times else 0.0)
    blocks = {}
    walk = reader.GetOutput().NewIterator()
    while not walk.IsDoneWithTraversal():
        name = walk.GetCurrentMetaData().Get(reader.GetOutput().NAME())
        blocks[name] = walk.GetCurrentDataObject()
        walk.GoToNextItem()
    return blocks, times


def actor_of(data, color=(0.85, 0.87, 0.9), edges=True, array=None, limits=None):
    mapper = vtkDataSetMapper()
    mapper.SetInputData(data)
    mapper.ScalarVisibilityOff()
    if array:
        mapper.ScalarVisibilityOn()
        mapper.SetScalarModeToUseCellFieldData()
        mapper.SelectColorArray(array)
        mapper.SetScalarRange(*limits)
        mapper.GetLookupTable().SetHueRange(0.67, 0.0)
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*color)
    actor.GetProperty().SetEdgeVisibility(edges)
    actor.GetProperty().SetLighting(array is None and not edges)
    return actor, mapper


def picture(path, views, bar=None):
    """views: (actors, focus, direction, up, half height)."""
    renderers = []
    for k, (actors, focus, direction, up, size) in enumerate(views):
        renderer = vtkRenderer()
        renderer.SetBackground(1, 1, 1)
        renderer.SetViewport(k / len(views), 0, (k + 1) / len(views), 1)
        for actor in actors:
            renderer.AddActor(actor)
        if bar:
            renderer.AddActor2D(bar)
        camera = renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetFocalPoint(*focus)
        camera.SetPosition(*(numpy.array(focus) + 100 * size * numpy.array(direction)))
        camera.SetViewUp(*up)
        camera.SetParallelScale(size)
        renderer.ResetCameraClippingRange()
        renderers.append(renderer)
    pictures.save(pictures.off_screen((1500, 750), renderers), path)


def frame_of(patch):
    """Centre, outward normal, a direction across, radius."""
    points = vtk_to_numpy(patch.GetPoints().GetData()).astype(float)
    centre = points.mean(axis=0)
    normal = numpy.linalg.svd(points - centre)[2][2]
    across = numpy.linalg.svd(points - centre)[2][0]
    return centre, normal, across, numpy.linalg.norm(points - centre, axis=1).max()


def along_inlet(blocks, reach):
    """A plane along the vessel at the inlet, in which it bends; the plane's normal, the direction into the vessel, the inlet's radius, and a
    place so many radii inside."""
    centre, normal, across, radius = frame_of(blocks["inlet"])
    inwards = normal * numpy.sign((numpy.array(blocks["internalMesh"].GetCenter()) - centre).dot(normal))
    ways = vtk_to_numpy(blocks["wall"].GetPoints().GetData()).astype(float) - centre
    distances = numpy.linalg.norm(ways, axis=1) / radius
    way = ways[(distances > reach) & (distances < 2.0 * reach)].mean(axis=0)
    bend = numpy.cross(inwards, way)
    if numpy.linalg.norm(bend) > 0.05 * numpy.linalg.norm(way):
        across = bend / numpy.linalg.norm(bend)
    plane = vtkPlane()
    plane.SetOrigin(*centre)
    plane.SetNormal(*across)
    return plane, across, inwards, radius, centre + reach * radius * inwards


def draw_mesh(blocks, path):
    plane, across, inwards, radius, middle = along_inlet(blocks, 4.0)
    cut = vtkExtractGeometry()
    cut.SetInputData(blocks["internalMesh"])
    cut.SetImplicitFunction(plane)
    cut.ExtractInsideOn()
    cut.ExtractBoundaryCellsOff()
    surface = vtkDataSetSurfaceFilter()
    surface.SetInputConnection(cut.GetOutputPort())
    surface.Update()
    picture(path, [([actor_of(surface.GetOutput())[0]], middle, across, inwards, 4.2 * radius),
                   ([actor_of(blocks["inlet"])[0]], plane.GetOrigin(), -inwards, across, 1.1 * radius)])


def bar_of(mapper, title):
    bar = vtkScalarBarActor()
    bar.SetLookupTable(mapper.GetLookupTable())
    bar.SetTitle(title)
    bar.SetNumberOfLabels(5)
    bar.SetWidth(0.06)
    bar.SetHeight(0.5)
    for text in (bar.GetTitleTextProperty(), bar.GetLabelTextProperty()):
        text.SetColor(0, 0, 0)
    return bar


def add(data, name, values):
    array = numpy_to_vtk(numpy.ascontiguousarray(values, dtype=float), deep=True)
    array.SetName(name)
    data.GetCellData().AddArray(array)


def whole(data):
    bounds = numpy.array(data.GetBounds()).reshape(3, 2)
    return bounds.mean(axis=1), 0.55 * (bounds[:, 1] - bounds[:, 0]).max()


def draw_wall(blocks, path):
    wall = blocks["wall"]
    mean = wall.GetCellData().GetArray("wallShearSizeMean")
    shear = wall.GetCellData().GetArray("wallShearStress")
    if mean is None and shear is None:
        return
    values = DENSITY * (vtk_to_numpy(mean) if mean else numpy.linalg.norm(vtk_to_numpy(shear), axis=1))
    add(wall, "Pa", values)
    actor, mapper = actor_of(wall, edges=False, array="Pa", limits=(0.0, numpy.percentile(values, 98)))
    centre, size = whole(wall)
    picture(path, [([actor], centre, (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), size)],
            bar_of(mapper, "mean wall shear, Pa" if mean else "wall shear, Pa"))


def draw_speed(blocks, path):
    mesh = blocks["internalMesh"]
    velocity = mesh.GetCellData().GetArray("U")
    if velocity is None or velocity.GetNumberOfTuples() != mesh.GetNumberOfCells():
        return
    add(mesh, "m/s", numpy.linalg.norm(vtk_to_numpy(velocity), axis=1))
    plane, across, inwards, radius, middle = along_inlet(blocks, 6.0)
    cut = vtkCutter()
    cut.SetInputData(mesh)
    cut.SetCutFunction(plane)
    cut.Update()
    section = cut.GetOutput()
    values = vtk_to_numpy(section.GetCellData().GetArray("m/s"))
    if values.max() <= 0.0:
        return
    actor, mapper = actor_of(section, edges=False, array="m/s", limits=(0.0, values.max()))
    picture(path, [([actor], middle, across, inwards, 6.5 * radius)], bar_of(mapper, "speed, m/s"))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("case")
    parser.add_argument("--output", required=True)
    arguments = parser.parse_args()
    os.makedirs(arguments.output, exist_ok=True)
    blocks, _ = read(arguments.case)
    draw_mesh(blocks, os.path.join(arguments.output, "flow-mesh.png"))
    draw_wall(blocks, os.path.join(arguments.output, "flow-wall.png"))
    draw_speed(blocks, os.path.join(arguments.output, "flow-speed.png"))


if __name__ == "__main__":
    main()
