"""The filters from the image to named centerlines give on two ranks what they give on one."""
import os
import sys

from paraview import servermanager, simple

from coronary_testing import (CENTERLINES, FORKS, LINES, TREE, centerline_pipeline, digest,
                              fetch, load_plugin, require)

plugin, folder, ranks = sys.argv[1], sys.argv[2], int(sys.argv[3])


load_plugin(plugin)
process = servermanager.vtkProcessModule.GetProcessModule()
require(process.GetNumberOfLocalPartitions() == ranks, "%d ranks, not %d"
        % (process.GetNumberOfLocalPartitions(), ranks))
phantom, centerline, topology = centerline_pipeline()
truth = simple.ReferencePhase(simple.OutputPort(phantom, CENTERLINES), Automatic=0, Time=0.75)
metrics = simple.CenterlineMetrics(Result=simple.OutputPort(topology, 0), Reference=truth)
conversion = simple.CenterlineConversion(simple.OutputPort(centerline, TREE))
found = []
for name, source, port in (("tree", centerline, TREE), ("lines", centerline, LINES),
                           ("bifurcations", centerline, FORKS), ("names", topology, 0),
                           ("conversion", conversion, 0)):
    # Of the first rank, where all of it has to be.
    data = fetch(source, port, 0.75)
    require(data.GetNumberOfPoints() > 0, name + ": nothing")
    everywhere = source.GetDataInformation(port).GetNumberOfPoints()
    require(everywhere == data.GetNumberOfPoints(), "%s: %d points on all ranks, %d on the first"
            % (name, everywhere, data.GetNumberOfPoints()))
    found += [name] + digest(data)
table = fetch(metrics, 0, 0.75)
overlap = table.GetColumnByName("OV")
require(overlap is not None and overlap.GetNumberOfTuples() > 0, "no overlap")
found += ["overlap %r" % overlap.GetValue(n) for n in range(overlap.GetNumberOfTuples())]

os.makedirs(folder, exist_ok=True)
path = os.path.join(folder, "one-rank.txt")
if ranks == 1:
    with open(path, "w") as file:
        file.write("\n".join(found))
else:
    with open(path) as file:
        expected = file.read().split("\n")
    for one, two in zip(expected, found):
        require(one == two, "one rank: %s; %d ranks: %s" % (one, ranks, two))
    require(len(expected) == len(found), "%d lines, not %d" % (len(found), len(expected)))
