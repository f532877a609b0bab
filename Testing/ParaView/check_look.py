"""The macro that looks along a vessel: its views, the vessel by name, the place, the chart; without a tree one sentence."""
import os
import sys

from paraview import servermanager, simple

from coronary_testing import CENTERLINES, IMAGE, fetch, load_plugin, pixels, require

plugin, folder, macros = sys.argv[1:4]
load_plugin(plugin)
sys.path.insert(0, macros)
import look_along_vessel  # noqa: E402

SIZE = (900, 520)


def block(data, name):
    for n in range(data.GetNumberOfBlocks()):
        if data.GetMetaData(n).Get(data.NAME()) == name:
            return data.GetBlock(n)
    return None


def length(reformat):
    return fetch(reformat, look_along_vessel.REFORMAT, 0.35).GetFieldData().GetArray("VesselLength").GetValue(0)


phantom = simple.CoronaryPhantom(Spacing=[1.0, 1.0, 1.0], TemporalWindow=0.0, Phases=[0.05, 0.35, 0.75])
image, tree = simple.OutputPort(phantom, IMAGE), simple.OutputPort(phantom, CENTERLINES)
try:
    look_along_vessel.selected()
    sys.exit("FAILED: an image alone is enough")
except RuntimeError as error:
    require("a tree of centerlines" in str(error), "without a tree it says: %s" % error)
made = look_along_vessel.look(image, tree, "LAD", size=SIZE)
reformat, cycle, views = made["reformat"], made["cycle"], made["views"]
require(len(views) == 4 and all(view is not None for view in views), "not four views")
lad = length(reformat)
require(80.0 < lad < 300.0, "the LAD is %g mm long" % lad)

# Another place moves the section in the patient, and its pictures.
section = block(fetch(reformat, look_along_vessel.IN_PLACE, 0.35), "Section")
first = section.GetPoint(section.GetNumberOfPoints() // 2)
path = os.path.join(folder, "first.png")
simple.SaveScreenshot(path, views[2], ImageResolution=[200, 200])
before = pixels(path)
require(len(set(before)) > 20, "the section's picture is empty")
reformat.Position = 60.0
simple.Render(views[2])
section = block(fetch(reformat, look_along_vessel.IN_PLACE, 0.35), "Section")
second = section.GetPoint(section.GetNumberOfPoints() // 2)
moved = sum((a - b) ** 2 for a, b in zip(first, second)) ** 0.5
require(10.0 < moved <= 40.5, "the section moved by %g mm along 40 mm of the vessel" % moved)
simple.SaveScreenshot(path, views[2], ImageResolution=[200, 200])
require(pixels(path) != before, "the section's picture did not change")

# The chart's table has the vessel's length, a column a phase, and the phantom's radii.
table = fetch(cycle, look_along_vessel.PROFILE, 0.35)
position = table.GetColumnByName("Position")
# Its distances are those of the first phase: arteries are longer in some phases than in others.
require(abs(position.GetValue(table.GetNumberOfRows() - 1) / lad - 1.0) < 0.15, "the profile has another length")
for name in ("5 %", "35 %", "75 %", "Least", "Median", "Greatest", "Healthy"):
    require(table.GetColumnByName(name) is not None, "the profile has no column " + name)
require(fetch(cycle, look_along_vessel.MAP, 0.35).GetNumberOfPoints() == 3 * table.GetNumberOfRows(), "the map has other points")
require(made["map"] is not None and made["lesions"].GetXMLName() == "SpreadSheetView", "no map or no table of lesions")
path = os.path.join(folder, "map.png")
simple.SaveScreenshot(path, made["map"], ImageResolution=[400, 240])
require(len(set(pixels(path))) > 50, "the map's picture is empty")
simple.SaveScreenshot(os.path.join(folder, "look.png"), made["layout"])

# Another vessel.
reformat.Vessel = "RCA"
reformat.UpdatePipeline(0.35)
require(abs(length(reformat) - lad) > 1.0, "the RCA is as long as the LAD")
