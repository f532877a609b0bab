"""Runs inside the ParaView window, called by the play-back of scripts/render-paraview.sh: keeps pictures of the window."""
import os
import struct
import sys

import numpy
from paraview import simple
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOImage import vtkPNGWriter

sys.path.insert(0, os.environ["TESTING"])
from window_testing import live

# Steps of grey values, a divisor of 255: the noise of a CT makes large files.
LEVEL = 15


def grab(name):
    """The screen as the X server has it in its file, of which Xvfb's -fbdir says where it is, as paraview-NAME.png."""
    with open(os.path.join(os.environ["SCREEN"], "Xvfb_screen0"), "rb") as file:
        data = file.read()
    # An X window dump: its header says how long it is, and that four bytes make a pixel.
    header = struct.unpack(">25I", data[:100])
    width, height, stride, colours = header[4], header[5], header[12], header[19]
    begin = header[0] + 12 * colours
    rows = numpy.frombuffer(data, numpy.uint8, height * stride, begin).reshape(height, stride)
    pixels = rows[::-1, : 4 * width].reshape(-1, 4)[:, 2::-1]
    pixels = pixels // LEVEL * LEVEL
    image = vtkImageData()
    image.SetDimensions(width, height, 1)
    image.GetPointData().SetScalars(numpy_to_vtk(numpy.ascontiguousarray(pixels), deep=True))
    writer = vtkPNGWriter()
    writer.SetCompressionLevel(9)
    writer.SetFileName(os.path.join(os.environ["PICTURES"], "paraview-%s.png" % name))
    writer.SetInputData(image)
    writer.Write()


def clear():
    simple.ResetSession()


def open_series():
    """The series to build from, applied; without one, nothing: the menu makes a phantom."""
    if os.environ.get("SERIES"):
        source = simple.OpenDataFile(os.environ["SERIES"])
        simple.SetActiveSource(source)


def wait():
    """Until the model is built and its frames are ready."""
    live(3600.0, lambda: simple.FindSource("Wall in the slice"))
    live(60.0, lambda: any(view.UseCache for view in simple.GetRenderViews()))
    live(3600.0, lambda: not any(view.UseCache for view in simple.GetRenderViews()))
    live(2.0)
