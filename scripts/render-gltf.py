#!/usr/bin/env pvpython
"""Picture of a glTF export beside the meshes that it stands for, and their distances.

  coronary-pipeline sequence RESULT --phases 20 --formats series,gltf --output OUT
  xvfb-run -a -s "-screen 0 1600x1000x24 -noreset" pvpython scripts/render-gltf.py OUT --output FOLDER

gltf.png  left: the surface that was written at two phases; right: mesh_skin.glb as VTK's glTF reader moves it to the
          same moments. Grey: the other phase.
"""
import argparse
import json
import os

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkCommonTransforms import vtkTransform
from vtkmodules.vtkFiltersCore import vtkAppendPolyData, vtkPolyDataNormals
from vtkmodules.vtkFiltersGeneral import vtkTransformPolyDataFilter
from vtkmodules.vtkIOGeometry import vtkGLTFReader

import pictures

OURS, THEIRS, OTHER = (0.80, 0.16, 0.16), (0.16, 0.45, 0.70), (0.75, 0.75, 0.75)


def from_gltf(path, seconds):
    """The file at a moment, its pieces together, in LPS and mm."""
    reader = vtkGLTFReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    reader.EnableAnimation(0)
    reader.SetApplyDeformationsToGeometry(True)
    reader.UpdateInformation()
    reader.UpdateTimeStep(seconds)
    pieces = vtkAppendPolyData()
    walk = reader.GetOutputDataObject(0).NewIterator()
    while not walk.IsDoneWithTraversal():
        piece = vtkPolyData()
        piece.ShallowCopy(walk.GetCurrentDataObject())
        piece.GetPointData().Initialize()
        pieces.AddInputData(piece)
        walk.GoToNextItem()
    lps = vtkTransform()
    lps.SetMatrix([1000, 0, 0, 0, 0, 0, -1000, 0, 0, 1000, 0, 0, 0, 0, 0, 1])
    back = vtkTransformPolyDataFilter()
    back.SetTransform(lps)
    back.SetInputConnection(pieces.GetOutputPort())
    back.Update()
    return back.GetOutput()


def largest_distance(ours, theirs):
    """mm. Both have the wall's points in the same order, which the caps follow in the file."""
    wall = vtk_to_numpy(ours.GetCellData().GetArray("CellEntityIds")) == 1
    corners = vtk_to_numpy(ours.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    used = numpy.unique(corners[wall])
    points = vtk_to_numpy(ours.GetPoints().GetData())[used]
    found = vtk_to_numpy(theirs.GetPoints().GetData())[:len(used)]
    return numpy.linalg.norm(points - found, axis=1).max()


def show(renderer, data, colour):
    normals = vtkPolyDataNormals()
    normals.SplittingOff()
    normals.SetInputData(data)
    normals.Update()
    pictures.add_plain(renderer, normals.GetOutput(), colour)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sequence", help="folder of coronary-pipeline sequence --formats series,gltf")
    parser.add_argument("--phases", type=int, nargs=2, default=(0, 7), help="numbers of two phases")
    parser.add_argument("--output", required=True)
    arguments = parser.parse_args()
    with open(os.path.join(arguments.sequence, "mesh.json")) as file:
        report = json.load(file)
    path = os.path.join(arguments.sequence, report["files"]["gltf"])
    with open(path, "rb") as file:
        head = file.read(20)
        extras = json.loads(file.read(int.from_bytes(head[12:16], "little")))["scenes"][0]["extras"]
    phases = [report["phases"][number] for number in arguments.phases]
    ours = [pictures.read_poly(os.path.join(arguments.sequence, phase["files"]["surface"])) for phase in phases]
    theirs = [from_gltf(path, (phase["time"] - extras["phases"][0]) * extras["cycle_s"]) for phase in phases]

    window = pictures.off_screen((1400, 1200), [])
    camera = None
    for row, phase in enumerate(phases):
        distance = largest_distance(ours[row], theirs[row])
        print("phase %g: largest distance %.2g mm" % (phase["time"], distance))
        for column, (data, colour, name) in enumerate((
                (ours, OURS, "written surface, %.2f R-R" % phase["time"]),
                (theirs, THEIRS, "mesh_skin.glb, within %.2g mm" % distance))):
            renderer = pictures.new_renderer((1, 1, 1))
            renderer.SetViewport(0.5 * column, 0.5 - 0.5 * row, 0.5 * column + 0.5, 1.0 - 0.5 * row)
            show(renderer, data[row], colour)
            show(renderer, data[1 - row], OTHER)
            pictures.add_text(renderer, name, 14, 12, color=(0.1, 0.1, 0.1))
            window.AddRenderer(renderer)
            if camera is None:
                # LPS: the viewer stands before the patient.
                camera = renderer.GetActiveCamera()
                centre = data[row].GetCenter()
                camera.SetFocalPoint(centre)
                camera.SetPosition(centre[0] + 100, centre[1] - 400, centre[2] + 60)
                camera.SetViewUp(0, 0, 1)
                renderer.ResetCamera()
                camera.Zoom(1.5)
            renderer.SetActiveCamera(camera)
            renderer.ResetCameraClippingRange()
    os.makedirs(arguments.output, exist_ok=True)
    pictures.save(window, arguments.output, "gltf.png")


main()
