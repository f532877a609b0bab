"""What two ranks wrote of the vesselness is what one wrote, to the last bit."""
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


for name in ("series", "phase"):
    one, two = (read(os.path.join(folder, "%s_%d.pvti" % (name, ranks))) for ranks in (1, 2))
    require(one.GetNumberOfPoints() == 48 * 45 * 50, name + ": the image is not whole")
    names = set(content(one))
    require(names == {"Vesselness", "VesselScale", "VesselDirection"},
            "%s: arrays %s" % (name, names))
    require(content(one) == content(two), name + ": two ranks give other values")
    for field in ("VesselnessC", "PhaseTime"):
        values = [data.GetFieldData().GetArray(field) for data in (one, two)]
        if all(values):
            require(values[0].GetValue(0) == values[1].GetValue(0), "%s: other %s" % (name, field))
    require(one.GetPointData().GetArray("Vesselness").GetRange()[1] > 0.2, name + ": no vessel")
    with open(os.path.join(folder, name + "_2.pvti")) as header:
        pieces = re.findall(r'<Piece Extent="([^"]*)"', header.read())
    require(len(set(pieces)) == 2, "%s: the image was not split: %s" % (name, pieces))
