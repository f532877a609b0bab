#!/usr/bin/env pvpython
"""Points of a .vtp file as text, and back: what elastix' transformix reads and writes.

Usage: vtp-points.py write FILE.vtp POINTS.txt
       vtp-points.py move FILE.vtp OUTPUTPOINTS.txt MOVED.vtp
       vtp-points.py roots CENTERLINE.vtp        # where its trees begin: x y z, a line each
       vtp-points.py tips CENTERLINE.vtp         # where its branches end
       vtp-points.py overlap LINES TRUTH.vtp     # of a .vtp, or of text with x y z a line: as JSON
"""
import json
import math
import re
import sys

from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkStaticPointLocator
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLPolyDataWriter

OUTPUT_POINT = re.compile(r"OutputPoint = \[ ([^\]]*)\]")


def read(path):
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    if reader.GetErrorCode() or not reader.GetOutput().GetNumberOfPoints():
        raise RuntimeError("'%s' has no points" % path)
    return reader.GetOutput()


def write_points(path, text):
    data = read(path)
    with open(text, "w", encoding="ascii") as file:
        file.write("point\n%d\n" % data.GetNumberOfPoints())
        for n in range(data.GetNumberOfPoints()):
            file.write("%.9g %.9g %.9g\n" % data.GetPoint(n))


def move(path, text, moved):
    data = read(path)
    points = vtkPoints()
    points.SetDataTypeToDouble()
    with open(text, encoding="ascii") as file:
        for line in file:
            points.InsertNextPoint(*(float(word) for word in OUTPUT_POINT.search(line).group(1).split()))
    if points.GetNumberOfPoints() != data.GetNumberOfPoints():
        raise RuntimeError("'%s' has %d points, '%s' %d" % (text, points.GetNumberOfPoints(), path, data.GetNumberOfPoints()))
    data.SetPoints(points)
    writer = vtkXMLPolyDataWriter()
    writer.SetFileName(moved)
    writer.SetInputData(data)
    writer.SetDataModeToBinary()
    if not writer.Write():
        raise RuntimeError("'%s' can not be written" % moved)


def print_roots(path):
    data = read(path)
    parents = data.GetCellData().GetArray("ParentGroupIds")
    for cell in range(data.GetNumberOfCells()):
        if parents.GetValue(cell) < 0:
            print("%.9g %.9g %.9g" % data.GetPoint(data.GetCell(cell).GetPointId(0)))


def print_tips(path):
    data = read(path)
    groups, parents = (data.GetCellData().GetArray(name) for name in ("GroupIds", "ParentGroupIds"))
    with_children = {parents.GetValue(cell) for cell in range(data.GetNumberOfCells())}
    for cell in range(data.GetNumberOfCells()):
        if groups.GetValue(cell) not in with_children:
            ids = data.GetCell(cell).GetPointIds()
            print("%.9g %.9g %.9g" % data.GetPoint(ids.GetId(ids.GetNumberOfIds() - 1)))


def read_places(path):
    if path.endswith(".vtp"):
        return read(path)
    points = vtkPoints()
    points.SetDataTypeToDouble()
    with open(path, encoding="ascii") as file:
        for line in file:
            if line.strip():
                points.InsertNextPoint(*(float(word) for word in line.split()))
    if not points.GetNumberOfPoints():
        raise RuntimeError("'%s' has no points" % path)
    data = vtkPolyData()
    data.SetPoints(points)
    return data


def distances(places, data):
    """From each of the places to the nearest point of the data, mm."""
    locator = vtkStaticPointLocator()
    locator.SetDataSet(data)
    locator.BuildLocator()
    result = []
    for n in range(places.GetNumberOfPoints()):
        place = places.GetPoint(n)
        result.append(math.dist(place, data.GetPoint(locator.FindClosestPoint(place))))
    return result


def print_overlap(lines, truth):
    """`found`: share of the true tree's points with a line within 1.5 mm; `false`: share of the lines' points beyond that
    from the tree; `mean`: distance of those within, mm. Points lie 0.5 mm apart or nearer."""
    model, tree = read_places(lines), read(truth)
    to_model, to_tree = distances(tree, model), distances(model, tree)
    near = [distance for distance in to_tree if distance <= 1.5]
    print(json.dumps({"found": sum(distance <= 1.5 for distance in to_model) / len(to_model),
                      "false": 1.0 - len(near) / len(to_tree), "mean": sum(near) / len(near) if near else None}))


def main(words):
    if len(words) == 3 and words[0] == "write":
        write_points(*words[1:])
    elif len(words) == 4 and words[0] == "move":
        move(*words[1:])
    elif len(words) == 2 and words[0] == "roots":
        print_roots(words[1])
    elif len(words) == 2 and words[0] == "tips":
        print_tips(words[1])
    elif len(words) == 3 and words[0] == "overlap":
        print_overlap(*words[1:])
    else:
        sys.stderr.write(__doc__)
        return 2
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except (OSError, RuntimeError) as error:
        sys.exit("vtp-points: %s" % error)
