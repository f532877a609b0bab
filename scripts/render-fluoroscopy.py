#!/usr/bin/env pvpython
"""X-ray frames of a session of the simulator side by side.

  coronary-simulator --headless --scenario phantom-lca --script Testing/Data/Driving/lca-angiogram.json --xray --output A
  pvpython scripts/render-fluoroscopy.py A --seconds 0.35 0.7 1.0 1.6 3.9 4.6 5.4 6.4 --output lca-angiogram.png

Each panel is the frame exposed last at or before its time. Needs no display.
"""
import argparse
import csv
import os

import numpy
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOImage import vtkPNGReader, vtkPNGWriter

GAP = 6  # pixels

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("session", help="folder that --xray --output wrote")
parser.add_argument("--seconds", type=float, nargs="+", required=True)
parser.add_argument("--columns", type=int, default=4)
parser.add_argument("--shrink", type=int, default=1, help="means of blocks of so many pixels")
parser.add_argument("--crop", type=int, nargs=3, metavar=("LEFT", "TOP", "SIZE"), help="a square of the frame, pixels")
parser.add_argument("--output", required=True)
arguments = parser.parse_args()

with open(os.path.join(arguments.session, "frames.csv"), newline="") as table:
    frames = [(float(row["seconds"]), row["file"]) for row in csv.DictReader(table)]
if not frames:
    raise SystemExit("'%s' has no X-ray frames." % arguments.session)


def picture(seconds):
    name = [file for time, file in frames if time <= seconds + 1e-9][-1:] or [frames[0][1]]
    reader = vtkPNGReader()
    reader.SetFileName(os.path.join(arguments.session, name[0]))
    reader.Update()
    image = reader.GetOutput()
    columns, rows, _ = image.GetDimensions()
    grey = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(rows, columns).astype(float)
    if arguments.crop:
        left, top, size = arguments.crop
        grey = grey[rows - top - size : rows - top, left : left + size]
        rows, columns = grey.shape
    n = arguments.shrink
    grey = grey[: rows // n * n, : columns // n * n]
    return grey.reshape(rows // n, n, columns // n, n).mean(axis=(1, 3))


panels = [picture(seconds) for seconds in arguments.seconds]
height, width = panels[0].shape
columns = min(arguments.columns, len(panels))
rows = -(-len(panels) // columns)
sheet = numpy.full((rows * (height + GAP) - GAP, columns * (width + GAP) - GAP), 255.0)
for place, panel in enumerate(panels):
    row, column = divmod(place, columns)
    bottom = (rows - 1 - row) * (height + GAP)  # VTK's rows go up
    left = column * (width + GAP)
    sheet[bottom : bottom + height, left : left + width] = panel
output = vtkImageData()
output.SetDimensions(sheet.shape[1], sheet.shape[0], 1)
values = numpy.ascontiguousarray(sheet.round().astype(numpy.uint8))
output.GetPointData().SetScalars(numpy_to_vtk(values.ravel(), deep=True))
writer = vtkPNGWriter()
writer.SetFileName(arguments.output)
writer.SetInputData(output)
writer.Write()
