#!/usr/bin/env pvpython
"""What of a true tree a result has, and what of the result is no artery. JSON on standard output.

Usage: compare-trees.py RESULT.vtp TRUTH.vtp TOLERANCE

Of the truth what is 0.5 mm in radius or more counts; it is found where the result's axis is within TOLERANCE mm, and a branch
is lost of which less than half is found. A branch of the result is wrong when more than half of it is further than TOLERANCE,
and than the lumen's radius, from any true axis; its confidence is the mean of Confidence x BridgeConfidence.
"""
import json
import sys

from vtkmodules.vtkCommonCore import mutable
from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

LEAST_RADIUS = 0.5  # mm


def read(path):
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    if reader.GetErrorCode() or not reader.GetOutput().GetNumberOfCells():
        raise RuntimeError("'%s' has no lines" % path)
    return reader.GetOutput()


def values(data, name):
    array = data.GetPointData().GetArray(name)
    return [array.GetValue(n) for n in range(data.GetNumberOfPoints())] if array else [1.0] * data.GetNumberOfPoints()


def branches(data):
    """Label and points of each, these as (id, length that belongs to it in mm)."""
    labels = data.GetCellData().GetAbstractArray("SegmentLabel")
    for cell in range(data.GetNumberOfCells()):
        ids = data.GetCell(cell).GetPointIds()
        ids = [ids.GetId(n) for n in range(ids.GetNumberOfIds())]
        steps = [sum((a - b) ** 2 for a, b in zip(data.GetPoint(p), data.GetPoint(q))) ** 0.5 for p, q in zip(ids, ids[1:])]
        shares = [0.5 * (before + after) for before, after in zip([0.0] + steps, steps + [0.0])]
        yield labels.GetValue(cell) if labels else "", list(zip(ids, shares))


def distances(data, other):
    """Of the points of one from the lines of another."""
    locator = vtkStaticCellLocator()
    locator.SetDataSet(other)
    locator.BuildLocator()
    result = []
    for n in range(data.GetNumberOfPoints()):
        nearest, cell, sub, squared = [0.0, 0.0, 0.0], mutable(0), mutable(0), mutable(0.0)
        locator.FindClosestPoint(data.GetPoint(n), nearest, cell, sub, squared)
        result.append(float(squared) ** 0.5)
    return result


def compare(result, truth, tolerance):
    radius = values(truth, "MaximumInscribedSphereRadius")
    off = distances(truth, result)
    length = found = 0.0
    lost = []
    for label, points in branches(truth):
        points = [(p, share) for p, share in points if radius[p] >= LEAST_RADIUS]
        own = sum(share for _, share in points)
        have = sum(share for p, share in points if off[p] <= tolerance)
        length, found = length + own, found + have
        if own > 0.0 and have < 0.5 * own:
            lost.append({"label": label, "length": own})

    radius = values(result, "MaximumInscribedSphereRadius")
    confidence = [a * b for a, b in zip(values(result, "Confidence"), values(result, "BridgeConfidence"))]
    off = distances(result, truth)
    wrong = []
    for label, points in branches(result):
        own = sum(share for _, share in points)
        far = sum(share for p, share in points if off[p] > max(tolerance, radius[p]))
        if own > 0.0 and far > 0.5 * own:
            wrong.append({"label": label, "length": own,
                          "confidence": sum(share * confidence[p] for p, share in points) / own})
    return {"length": length, "found": found / length, "lost": lost, "wrong": wrong}


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    try:
        print(json.dumps(compare(read(sys.argv[1]), read(sys.argv[2]), float(sys.argv[3]))))
    except RuntimeError as error:
        sys.exit("compare-trees: %s" % error)
