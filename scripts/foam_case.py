"""Reads meshes and fields of OpenFOAM's text files, as far as the project's own cases need it."""
import glob
import os
import re

import numpy

WORD = re.compile(rb"[\w.:\-\"]+")


def body_of(path):
    """What follows the head of a file."""
    with open(path, "rb") as file:
        text = file.read()
    text = re.sub(rb"/\*.*?\*/", b"", text, flags=re.S)
    text = re.sub(rb"//[^\n]*", b"", text)
    return text[text.index(b"}") + 1:] if b"FoamFile" in text else text


def numbers_of(text):
    return numpy.array(re.sub(rb"[()]", b" ", text).split(), float)


def list_of(text, columns):
    """The first list 'N ( ... )' of a text."""
    found = re.search(rb"(\d+)\s*\(", text)
    count = int(found.group(1))
    if columns == 1:
        end = text.index(b")", found.end())
        values = numpy.array(text[found.end():end].split(), float)
    else:
        end = text.find(b"\n)", found.end())
        values = numbers_of(text[found.end():end if end >= 0 else len(text)]).reshape(-1, columns)
    assert len(values) == count, (len(values), count)
    return values


class Mesh:
    """Points, faces and patches of a polyMesh; points of another time where there are some."""

    def __init__(self, case):
        folder = os.path.join(case, "constant", "polyMesh")
        self.points = list_of(body_of(os.path.join(folder, "points")), 3)
        text = body_of(os.path.join(folder, "faces"))
        self.faces = [numpy.array(face.split(), int) for face in re.findall(rb"\d+\(([^)]*)\)", text)]
        self.owner = list_of(body_of(os.path.join(folder, "owner")), 1).astype(int)
        self.neighbour = list_of(body_of(os.path.join(folder, "neighbour")), 1).astype(int)
        self.patches = {}
        for name, inside in re.findall(rb"(\w[\w.\-]*)\s*\{([^}]*)\}", body_of(os.path.join(folder, "boundary"))):
            count = int(re.search(rb"nFaces\s+(\d+)", inside).group(1))
            first = int(re.search(rb"startFace\s+(\d+)", inside).group(1))
            self.patches[name.decode()] = range(first, first + count)

    def move(self, case, time):
        """Takes over the points of a time, if it has some."""
        path = os.path.join(case, time, "polyMesh", "points")
        if os.path.exists(path):
            self.points = list_of(body_of(path), 3)

    def centres(self, patch):
        return numpy.array([self.points[self.faces[f]].mean(axis=0) for f in self.patches[patch]])

    def areas(self, patch):
        """Vectors that look out of the mesh."""
        result = []
        for f in self.patches[patch]:
            corners = self.points[self.faces[f]]
            middle = corners.mean(axis=0)
            result.append(0.5 * numpy.cross(corners - middle, numpy.roll(corners, -1, axis=0) - middle).sum(axis=0))
        return numpy.array(result)

    def volume(self):
        sums = 0.0
        middle = self.points.mean(axis=0)
        for patch in self.patches:
            for f in self.patches[patch]:
                corners = self.points[self.faces[f]] - middle
                centre = corners.mean(axis=0)
                sums += numpy.cross(corners, numpy.roll(corners, -1, axis=0)).sum(axis=0).dot(centre) / 6.0
        return sums

    def cell_centres(self):
        """Means of the faces' middles."""
        cells = max(self.owner.max(), self.neighbour.max()) + 1
        middles = numpy.array([self.points[face].mean(axis=0) for face in self.faces])
        sums = numpy.zeros((cells, 3))
        counts = numpy.zeros(cells)
        for cell, at in ((self.owner, middles), (self.neighbour, middles[:len(self.neighbour)])):
            numpy.add.at(sums, cell, at)
            numpy.add.at(counts, cell, 1.0)
        return sums / counts[:, None]


def internal_field(case, time, name, columns):
    text = body_of(os.path.join(case, time, name))
    return list_of(text[text.index(b"internalField"):], columns)


def patch_field(case, time, name, patch, columns):
    text = body_of(os.path.join(case, time, name))
    text = text[text.index(b"boundaryField"):]
    found = re.search(rb"\b" + patch.encode() + rb"\s*\{", text)
    return list_of(text[text.index(b"value", found.end()):], columns)


def series(case, name):
    """Times and values that a function object wrote at every step. Of several starts, also from one time, the last one counts."""
    files = glob.glob(os.path.join(glob.escape(case), "postProcessing", name, "*", "surfaceFieldValue*.dat"))
    rows = {}
    for path in sorted(files, key=os.path.getmtime):
        with open(path, encoding="utf-8") as file:
            for line in file:
                if not line.startswith("#"):
                    words = line.split()
                    rows[float(words[0])] = float(words[1])
    times = numpy.array(sorted(rows))
    return times, numpy.array([rows[time] for time in times])


def times_of(case):
    """Directories of results, in order."""
    found = [name for name in os.listdir(case) if re.fullmatch(r"[\d.]+(e-?\d+)?", name)]
    return sorted((name for name in found if float(name) > 0), key=float)
