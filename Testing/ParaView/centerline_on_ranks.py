"""The filters from the image to named centerlines give on two ranks what they give on one."""
import sys

from paraview import simple

from coronary_testing import (CENTERLINES, FORKS, LINES, TREE, centerline_pipeline,
                              compare_with_one_rank, digest, fetch, fetch_whole, load_plugin,
                              require, require_ranks)

plugin, folder, ranks = sys.argv[1], sys.argv[2], int(sys.argv[3])


load_plugin(plugin)
require_ranks(ranks)
phantom, centerline, topology = centerline_pipeline()
truth = simple.ReferencePhase(simple.OutputPort(phantom, CENTERLINES), Automatic=0, Time=0.75)
metrics = simple.CenterlineMetrics(Result=simple.OutputPort(topology, 0), Reference=truth)
found = []
for name, source, port in (("tree", centerline, TREE), ("lines", centerline, LINES),
                           ("bifurcations", centerline, FORKS), ("names", topology, 0),
                           ("VMTK's lines", topology, 3)):
    found += [name] + digest(fetch_whole(source, port, 0.75))
table = fetch(metrics, 0, 0.75)
overlap = table.GetColumnByName("OV")
require(overlap is not None and overlap.GetNumberOfTuples() > 0, "no overlap")
found += ["overlap %r" % overlap.GetValue(n) for n in range(overlap.GetNumberOfTuples())]

compare_with_one_rank(folder, ranks, found)
