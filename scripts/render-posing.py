#!/usr/bin/env pvpython
"""What scripts/render-posing.sh needs besides coronary-posing.

  pvpython scripts/render-posing.py moves RUN       two moves of joints for coronary-posing --pose-move, one a line
  pvpython scripts/render-posing.py join OUTPUT PICTURE...  pictures beside each other, without their white margins
"""
import sys

import numpy
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOImage import vtkPNGReader, vtkPNGWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

BONES = 6  # that share a bend, as in coronary-posing
SHARE = 0.55  # of the chord of those bones: how far the joint is moved
MARGIN = 12  # pixels


def longest_paths(skeleton):
    """A path of joints from root to tip a tree, the longest one, the longest tree's first."""
    points = vtk_to_numpy(skeleton.GetPoints().GetData())
    parent = vtk_to_numpy(skeleton.GetPointData().GetArray("ParentJoint"))
    length = numpy.zeros(len(points))
    for joint, before in enumerate(parent):  # a parent stands before its daughters
        if before >= 0:
            length[joint] = length[before] + numpy.linalg.norm(points[joint] - points[before])
    paths = {}
    for tip in numpy.argsort(-length):
        path = [int(tip)]
        while parent[path[-1]] >= 0:
            path.append(int(parent[path[-1]]))
        paths.setdefault(path[-1], path[::-1])
    return points, list(paths.values())


def moves(run):
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(run + "/skeleton.vtp")
    reader.Update()
    points, paths = longest_paths(reader.GetOutput())
    view = numpy.array([-0.4, 1.0, -0.1]) / numpy.linalg.norm([0.4, 1.0, 0.1])  # of the posing window
    middle = points.mean(axis=0)
    for path in (paths + paths)[:2]:
        place = len(path) // 2
        joint, anchor = path[place], path[max(0, place - BONES)]
        chord = points[joint] - points[anchor]
        aside = numpy.cross(view, chord)
        aside /= numpy.linalg.norm(aside)
        if aside.dot(points[joint] - middle) < 0.0:
            aside = -aside  # away from the other vessels
        reach = SHARE * numpy.linalg.norm(chord)
        # On the circle about the anchor, a little inside: lengths are kept.
        goal = 0.95 * numpy.sqrt(1.0 - SHARE**2) * chord + 0.95 * reach * aside
        print("%d:%.2f,%.2f,%.2f" % (joint, *(goal - chord)))


def join(output, names):
    pictures = []
    for name in names:
        reader = vtkPNGReader()
        reader.SetFileName(name)
        reader.Update()
        image = reader.GetOutput()
        width, height, _ = image.GetDimensions()
        pictures.append(vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)[:, :, :3])
    drawn = numpy.any([(picture < 250).any(axis=2) for picture in pictures], axis=0)
    rows, columns = (numpy.flatnonzero(drawn.any(axis=axis)) for axis in (1, 0))
    cut = (
        slice(max(0, rows[0] - MARGIN), rows[-1] + MARGIN),
        slice(max(0, columns[0] - MARGIN), columns[-1] + MARGIN),
    )
    whole = numpy.ascontiguousarray(numpy.concatenate([picture[cut] for picture in pictures], axis=1))
    image = vtkImageData()
    image.SetDimensions(whole.shape[1], whole.shape[0], 1)
    image.GetPointData().SetScalars(numpy_to_vtk(whole.reshape(-1, 3), deep=True))
    writer = vtkPNGWriter()
    writer.SetFileName(output)
    writer.SetInputData(image)
    writer.Write()


if sys.argv[1] == "moves":
    moves(sys.argv[2])
else:
    join(sys.argv[2], sys.argv[3:])
