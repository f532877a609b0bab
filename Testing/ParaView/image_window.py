"""CT is shown within the cardiac window from the first Show on, whatever values it has, and in the user's afterwards."""
import os
import struct
import sys

from paraview import simple

from coronary_testing import IMAGE, load_plugin, quick_phantom, require

plugin, folder = sys.argv[1:3]
load_plugin(plugin)
os.chdir(folder)


def write_image(name, low, high):
    """Air to contrast medium, beyond the window on both sides."""
    with open(name, "wb") as file:
        file.write(b"ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementSpacing = 1 2 3\n"
                   b"ElementType = MET_SHORT\nBinaryData = True\nElementDataFile = LOCAL\n")
        file.write(struct.pack("<24h", *(low + n * (high - low) // 23 for n in range(24))))


def window():
    """First and last value of the colour map of HU, and of its opacities."""
    colours = simple.GetColorTransferFunction("HU").RGBPoints
    opacities = simple.GetOpacityTransferFunction("HU").Points
    return [colours[0], colours[-4], opacities[0], opacities[-4]]


def show(source):
    """The representation of a source in the view, drawn as a slice."""
    shown = simple.Show(source, view)
    simple.Render(view)
    require(shown.Representation == "Slice", "shown as %s" % shown.Representation)
    require(list(shown.ColorArrayName) == ["POINTS", "HU"], "coloured by %s" % shown.ColorArrayName)
    return shown


write_image("first.mha", -1005, 1400)
write_image("second.mha", -2000, 3000)
view = simple.CreateView("RenderView", ViewSize=[100, 100])
first = simple.GatedImageReader(FileNames=["first.mha"])
shown = show(first)
require(window() == [-150, 650] * 2, "the first Show leaves %s" % window())

# The user's own window is kept, too; and rescaling by hand does what it says.
simple.GetColorTransferFunction("HU").RescaleTransferFunction(-100, 400)
show(simple.GatedImageReader(FileNames=["second.mha"]))
require(window()[:2] == [-100, 400], "a second image leaves %s" % window())
shown.RescaleTransferFunctionToDataRange(False, True)
require(window()[:2] == [-1005, 1400], "rescaling by hand leaves %s" % window())

# All that an image can be shown as; a volume takes long to draw without a graphics card.
for kind in ("Volume", "Surface", "Outline", "Slice"):
    shown.SetRepresentationType(kind)
    if kind != "Volume":
        simple.Render(view)
    require(shown.Representation == kind, "%s instead of %s" % (shown.Representation, kind))

# The phantom's CT.
simple.ResetSession()
view = simple.CreateView("RenderView", ViewSize=[100, 100])
show(simple.OutputPort(quick_phantom(), IMAGE))
require(window() == [-150, 650] * 2, "the phantom's image leaves %s" % window())
