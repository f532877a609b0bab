"""What two ranks wrote of vesselness and segmentation is what one wrote, to the last bit."""
import os
import re
import sys

from paraview import simple

from coronary_testing import content, load_plugin, require

plugin, folder = sys.argv[1:3]
load_plugin(plugin)


def read(path):
    reader = simple.OpenDataFile(path)
    reader.UpdatePipeline()
    return reader.GetClientSideObject().GetOutputDataObject(0)


ARRAYS = {"Vesselness", "VesselScale", "VesselDirection"}
for name, wanted, least in (("series", ARRAYS, 0.2), ("phase", ARRAYS, 0.2),
                            ("mask", {"VesselMask"}, 0.9)):
    one, two = (read(os.path.join(folder, "%s_%d.pvti" % (name, ranks))) for ranks in (1, 2))
    require(one.GetNumberOfPoints() == 48 * 45 * 50, name + ": the image is not whole")
    names = set(content(one))
    require(names == wanted, "%s: arrays %s" % (name, names))
    require(content(one) == content(two), name + ": two ranks give other values")
    for field in ("VesselnessC", "PhaseTime"):
        values = [data.GetFieldData().GetArray(field) for data in (one, two)]
        if all(values):
            require(values[0].GetValue(0) == values[1].GetValue(0), "%s: other %s" % (name, field))
    require(one.GetPointData().GetArray(min(wanted)).GetRange()[1] > least, name + ": no vessel")
    with open(os.path.join(folder, name + "_2.pvti")) as header:
        pieces = re.findall(r'<Piece Extent="([^"]*)"', header.read())
    require(len(set(pieces)) == 2, "%s: the image was not split: %s" % (name, pieces))
