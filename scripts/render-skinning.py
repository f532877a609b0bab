#!/usr/bin/env pvpython
"""A picture of the skeleton and the weights that `coronary-pipeline run --until weights` wrote.

  xvfb-run -a pvpython scripts/render-skinning.py demo-output/run --output demo-output/pictures

skinning.png  bones in the surface; the weights of two neighbouring bones beside a bifurcation
"""
import argparse
import os

from vtkmodules.vtkCommonCore import vtkIntArray, vtkLookupTable
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkFiltersCore import vtkGlyph3D, vtkTubeFilter
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

import pictures

BONES = ((0.85, 0.15, 0.15), (0.15, 0.35, 0.85))
JOINT = (0.1, 0.1, 0.1)
WALL = (0.93, 0.88, 0.70)


def add_bones(panel, skeleton, radius):
    """Bones in two colours in turn, joints as balls."""
    table = vtkLookupTable()
    table.SetNumberOfTableValues(2)
    table.SetRange(0, 1)
    for i, color in enumerate(BONES):
        table.SetTableValue(i, *color)
    turn = vtkIntArray()
    turn.SetName("Turn")
    for i in range(skeleton.GetNumberOfCells()):
        turn.InsertNextValue(i % 2)
    lines = vtkPolyData()
    lines.ShallowCopy(skeleton)
    lines.GetCellData().SetScalars(turn)
    tubes = vtkTubeFilter()
    tubes.SetInputData(lines)
    tubes.SetRadius(radius)
    tubes.SetNumberOfSides(12)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(tubes.GetOutputPort())
    mapper.SetScalarModeToUseCellData()
    mapper.SetLookupTable(table)
    mapper.UseLookupTableScalarRangeOn()
    actor = vtkActor()
    actor.SetMapper(mapper)
    panel.AddActor(actor)
    ball = vtkSphereSource()
    ball.SetRadius(1.7 * radius)
    glyphs = vtkGlyph3D()
    glyphs.SetInputData(skeleton)
    glyphs.SetSourceConnection(ball.GetOutputPort())
    glyphs.ScalingOff()
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(glyphs.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*JOINT)
    panel.AddActor(actor)


def add_weight(panel, wall, bone):
    """The wall in the colours of one bone's weight."""
    indices = wall.GetPointData().GetArray("BoneIndices")
    weights = wall.GetPointData().GetArray("BoneWeightsCompact")
    values = weights.NewInstance()
    values.SetName("Weight")
    for i in range(wall.GetNumberOfPoints()):
        row = zip(indices.GetTuple(i), weights.GetTuple(i))
        values.InsertNextTuple1(sum(w for b, w in row if int(b) == bone))
    mesh = vtkPolyData()
    mesh.ShallowCopy(wall)
    mesh.GetPointData().SetScalars(values)
    table = vtkLookupTable()
    table.SetNumberOfTableValues(21)
    table.SetRange(0.0, 1.0)
    for i in range(21):
        t = i / 20.0
        table.SetTableValue(i, *[(1.0 - t) * a + t * b for a, b in zip(WALL, BONES[0])])
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(mesh)
    mapper.SetLookupTable(table)
    mapper.UseLookupTableScalarRangeOn()
    mapper.InterpolateScalarsBeforeMappingOn()
    actor = vtkActor()
    actor.SetMapper(mapper)
    panel.AddActor(actor)


def neighbours(skeleton):
    """Two bones of one branch that follow a bifurcation, and the joint between them."""
    ends = [[skeleton.GetCell(i).GetPointId(k) for k in (0, 1)]
            for i in range(skeleton.GetNumberOfCells())]
    radius = skeleton.GetPointData().GetArray("MaximumInscribedSphereRadius")
    starts = [first for first, _ in ends]
    best = None
    for i, (first, second) in enumerate(ends):
        next_ones = [j for j, (other, _) in enumerate(ends) if other == second]
        if starts.count(first) > 1 and len(next_ones) == 1:
            size = radius.GetTuple1(second)
            if best is None or size > best[0]:
                best = (size, i, next_ones[0], second)
    if best is None:
        pictures.fail("no bifurcation in the skeleton")
    return best[1:]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("input", help="folder of coronary-pipeline run")
    parser.add_argument("--output", required=True, help="folder for the picture")
    arguments = parser.parse_args()
    os.makedirs(arguments.output, exist_ok=True)
    skeleton = pictures.read_poly(os.path.join(arguments.input, "skeleton.vtp"))
    surface = pictures.read_poly(os.path.join(arguments.input, "surface.vtp"))
    path = os.path.join(arguments.input, "weights.vtu")
    if not os.path.isfile(path):
        pictures.fail("missing file: " + path)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    shell = vtkDataSetSurfaceFilter()
    shell.SetInputConnection(reader.GetOutputPort())
    shell.Update()
    wall = shell.GetOutput()

    window, base = pictures.new_window()
    width, height = pictures.SIZE
    tall = height - 60
    pictures.add_text(base, "%d bones, %d points" % (
        skeleton.GetNumberOfCells(), reader.GetOutput().GetNumberOfPoints()),
        20, height - 42, 26, bold=True)
    panel = pictures.add_panel(window, 2, 2, width / 2 - 2, tall)
    pictures.add_surface(panel, surface, color=WALL, opacity=0.3)
    add_bones(panel, skeleton, 0.25)
    bounds = surface.GetBounds()
    center = [(bounds[2 * i] + bounds[2 * i + 1]) / 2.0 for i in range(3)]
    pictures.look_at(panel, center, (0.5, -0.8, 0.35), (0.0, 0.0, 1.0),
                     0.36 * surface.GetLength())
    first, second, joint = neighbours(skeleton)
    names = skeleton.GetFieldData().GetAbstractArray("BoneName")
    where = skeleton.GetPoint(joint)
    size = skeleton.GetPointData().GetArray("MaximumInscribedSphereRadius").GetTuple1(joint)
    for i, bone in enumerate((first, second)):
        panel = pictures.add_panel(window, width / 2 + 2, (1 - i) * tall / 2 + 2, width - 2,
                                   (2 - i) * tall / 2 - 2)
        pictures.add_text(panel, "weight of " + names.GetValue(bone), 16, 16)
        add_weight(panel, wall, bone)
        pictures.look_at(panel, where, (0.5, -0.8, 0.35), (0.0, 0.0, 1.0), 7.0 * size)
    pictures.save(window, arguments.output, "skinning.png")


if __name__ == "__main__":
    main()
