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
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkIOGeometry import vtkGLTFReader
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader
from vtkmodules.vtkRenderingCore import (vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow,
                                         vtkTextActor, vtkWindowToImageFilter)
import vtkmodules.vtkRenderingFreeType
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 (registers the factories)

OURS, THEIRS, OTHER = (0.80, 0.16, 0.16), (0.16, 0.45, 0.70), (0.75, 0.75, 0.75)


def written(folder, name):
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(os.path.join(folder, name))
    reader.Update()
    return reader.GetOutput()


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


def show(renderer, data, colour, opacity):
    normals = vtkPolyDataNormals()
    normals.SplittingOff()
    normals.SetInputData(data)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(colour)
    actor.GetProperty().SetOpacity(opacity)
    renderer.AddActor(actor)


def label(renderer, text):
    actor = vtkTextActor()
    actor.SetInput(text)
    actor.GetTextProperty().SetFontSize(22)
    actor.GetTextProperty().SetColor(0.1, 0.1, 0.1)
    actor.SetPosition(14, 12)
    renderer.AddActor(actor)


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
    ours = [written(arguments.sequence, phase["files"]["surface"]) for phase in phases]
    theirs = [from_gltf(path, (phase["time"] - extras["phases"][0]) * extras["cycle_s"]) for phase in phases]

    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(1400, 1200)
    window.SetMultiSamples(8)
    camera = None
    for row, phase in enumerate(phases):
        distance = largest_distance(ours[row], theirs[row])
        print("phase %g: largest distance %.2g mm" % (phase["time"], distance))
        for column, (data, colour, name) in enumerate((
                (ours, OURS, "written surface, %.2f R-R" % phase["time"]),
                (theirs, THEIRS, "mesh_skin.glb, within %.2g mm" % distance))):
            renderer = vtkRenderer()
            renderer.SetViewport(0.5 * column, 0.5 - 0.5 * row, 0.5 * column + 0.5, 1.0 - 0.5 * row)
            renderer.SetBackground(1, 1, 1)
            show(renderer, data[row], colour, 1.0)
            show(renderer, data[1 - row], OTHER, 1.0)
            label(renderer, name)
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
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    writer = vtkPNGWriter()
    os.makedirs(arguments.output, exist_ok=True)
    writer.SetFileName(os.path.join(arguments.output, "gltf.png"))
    writer.SetInputConnection(grab.GetOutputPort())
    writer.Write()


main()
