"""A tree corrected by hand in pvpython: Vessel Edits by its settings, kept, undone, saved; what the menu's entries call."""
import json
import math
import os
import sys

from paraview import simple

from coronary_testing import centerline_pipeline, load_plugin, require

plugin, folder = sys.argv[1:3]
os.makedirs(folder, exist_ok=True)
load_plugin(plugin)
import correct_tree  # noqa: E402  comes with the plugin
import coronary_views as views  # noqa: E402


def lengths(source):
    """{name: mm} of a named tree."""
    data = views.fetched(source).GetCellData()
    result = {}
    for n in range(data.GetAbstractArray("SegmentLabel").GetNumberOfValues()):
        name = data.GetAbstractArray("SegmentLabel").GetValue(n)
        result[name] = result.get(name, 0.0) + data.GetArray("Length").GetTuple1(n)
    return result


def places(source, name):
    """Points of the longest branch of a name."""
    data = views.fetched(source)
    cells = [data.GetCell(n) for n in range(data.GetNumberOfCells())
             if data.GetCellData().GetAbstractArray("SegmentLabel").GetValue(n) == name]
    ids = [[cell.GetPointIds().GetId(k) for k in range(cell.GetNumberOfPoints())] for cell in cells]
    return [data.GetPoint(i) for i in max(ids, key=len)]


def points(source):
    data = views.fetched(source)
    return [data.GetPoint(n) for n in range(data.GetNumberOfPoints())]


def refused(work, part):
    try:
        work()
    except RuntimeError as error:
        require(part in str(error), "not '%s': %s" % (part, error))
        return
    require(False, "nothing was refused: " + part)


phantom, centerline, tree = centerline_pipeline()
tree.UpdatePipeline(0.75)
whole = lengths(tree)
lost = "D1" if "D1" in whole else sorted(name for name in whole if name.startswith("OM"))[0]
course = places(tree, lost)

refused(lambda: correct_tree.start(phantom), "Select a named tree")
refused(correct_tree.keep, "Select Vessel Edits")
edits = correct_tree.start(tree)
require(edits.CTImage is not None and edits.Vesselness is not None, "the image of the tree was not found")
require(points(edits) == points(tree), "without edits the tree is another one")

# As a vessel is lost, and found again.
edits.Edit, edits.VesselName = "Delete", lost
correct_tree.keep(edits)
require(edits.Edit == "None" and list(edits.Edits) == ['{"edit":"delete","name":"%s"}' % lost], "kept: %s" % edits.Edits)
without = points(edits)
require(lost not in lengths(edits), "%s is not deleted" % lost)
edits.Edit = "Add Branch"
edits.EditPoints = [*course[0], *course[len(course) // 2], *course[-1]]
edits.VesselName = lost
edits.UpdatePipeline()
require(abs(lengths(edits)[lost] - whole[lost]) < 4.0, "%s: %s instead of %s mm" % (lost, lengths(edits), whole[lost]))
require(edits.PointData["EditNumber"].GetRange()[1] == 2.0, "no EditNumber")
drawn = points(edits)
require(all(min(math.dist(a, b) for b in drawn) < 1.5 for a in course), "the vessel was drawn elsewhere")
correct_tree.keep(edits)
require(len(edits.Edits) == 2 and len(edits.EditPoints) == 0 and points(edits) == drawn, "keeping it changed the tree")
path = correct_tree.save(edits, os.path.join(folder, "edits.json"))
with open(path, encoding="utf-8") as file:
    require([edit["edit"] for edit in json.load(file)["edits"]] == ["delete", "add-branch"], "saved: " + path)

# Back: to the bit.
correct_tree.undo(edits)
require(points(edits) == without, "undone, but another tree")
correct_tree.undo(edits)
require(points(edits) == points(tree), "undone, but not as at first")
refused(lambda: correct_tree.undo(edits), "no edit to undo")
refused(lambda: correct_tree.keep(edits), "no edit to keep")
refused(lambda: correct_tree.save(edits), "of no run")

# The file, in another filter, by keywords; and a mask.
again = simple.VesselEdits(Input=tree, CTImage=edits.CTImage, Vesselness=edits.Vesselness, EditsFile=path)
require(points(again) == drawn, "the file gives another tree")
mask = simple.VesselEdits(Input=centerline.Mask, Edit="Paint", EditPoints=list(course[-1]), Radius=2.0)
mask.UpdatePipeline(0.75)
require(mask.GetDataInformation(0).GetDataSetTypeAsString() == "vtkImageData", "the mask is no image")
require("painted" in views.fetched(mask).GetFieldData().GetAbstractArray("EditNotes").GetValue(0), "nothing is painted")
print("%s of %.0f mm deleted and drawn again" % (lost, whole[lost]))
