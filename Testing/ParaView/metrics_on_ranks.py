"""A comparison of surfaces over the cycle, each rank its phases: the table is that of one rank."""
import os
import sys

from paraview import simple
from paraview.vtk.vtkParallelCore import vtkMultiProcessController

from coronary_testing import SURFACE, load_plugin, require

plugin, folder, ranks = sys.argv[1], sys.argv[2], int(sys.argv[3])

# pvbatch --symmetric: this script runs on every rank.
load_plugin(plugin)
controller = vtkMultiProcessController.GetGlobalController()
rank, size = controller.GetLocalProcessId(), controller.GetNumberOfProcesses()
require(size == ranks, "%d ranks, not %d" % (size, ranks))
PHASES = [0.0, 0.25, 0.5, 0.75]
model = simple.CoronaryPhantom(SurfaceSpacing=1.5, Phases=PHASES)
truth = simple.CoronaryPhantom(SurfaceSpacing=1.4, Tortuosity=0.9, Phases=PHASES)
distance = simple.MeshDistanceMetrics(Result=simple.OutputPort(model, SURFACE),
                                      Reference=simple.OutputPort(truth, SURFACE), ErrorBound=0.01)
# The filter itself, without the proxy: a request of this rank alone, for the whole of one phase.
metrics = distance.GetClientSideObject()
lines = []
for number in range(rank, len(PHASES), size):
    metrics.UpdateTimeStep(PHASES[number], 0, 1, 0)
    table = metrics.GetOutputDataObject(2)
    last = table.GetNumberOfRows() - 1
    lines.append("%d %r %r" % (number, table.GetColumnByName("HD").GetValue(last),
                               table.GetColumnByName("MSD").GetValue(last)))
os.makedirs(folder, exist_ok=True)
with open(os.path.join(folder, "of-%d-rank-%d.txt" % (size, rank)), "w") as file:
    file.write("\n".join(lines))
controller.Barrier()
if rank == 0:
    found = []
    for other in range(size):
        with open(os.path.join(folder, "of-%d-rank-%d.txt" % (size, other))) as file:
            found += file.read().split("\n")
    found.sort()
    require(len(found) == len(PHASES), "rows: %s" % found)
    if size == 1:
        require(len({line.split()[1] for line in found}) == len(PHASES), "phases are equal")
    else:
        with open(os.path.join(folder, "of-1-rank-0.txt")) as file:
            require(file.read().split("\n") == found, "not what one rank finds: %s" % found)
