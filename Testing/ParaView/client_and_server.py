"""The stages on a server, driven and drawn by a client: the same as in one process."""
import os
import socket
import subprocess
import sys
import time

from paraview import servermanager, simple

from coronary_testing import IMAGE, SURFACE, digest, load_plugin, require, require_picture

plugin, folder, pvserver = sys.argv[1:4]
# With mpirun a server on two ranks is tried, too: right, but too slow for every day.
mpirun = sys.argv[4:5]
TIME = 0.75
# Until a server has started, seconds.
PATIENCE = 120


def environment():
    """Without what this process's own MPI left there, by which mpirun would take itself for one of its ranks."""
    allowed = ("OMPI_ALLOW", "OMPI_MCA_rmaps", "OMPI_MCA_btl")
    return {name: value for name, value in os.environ.items()
            if not name.startswith(("OMPI_", "PMIX_", "OPAL_", "ORTE_")) or name.startswith(allowed)}


class Server:
    """A server on a free port, and this process as its client."""

    def __init__(self, ranks):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.path = os.path.join(folder, "server-%d.txt" % ranks)
        launcher = mpirun + ["-np", str(ranks)] if ranks > 1 else []
        with open(self.path, "w") as log:
            self.process = subprocess.Popen(launcher + [pvserver, "--server-port=%d" % self.port],
                                            stdout=log, stderr=subprocess.STDOUT, env=environment())

    def said(self):
        with open(self.path) as log:
            return log.read()

    def __enter__(self):
        end = time.time() + PATIENCE
        while "Accepting connection" not in self.said():
            if self.process.poll() is not None or time.time() > end:
                self.process.kill()
                require(False, "the server does not start: " + self.said())
            time.sleep(0.1)
        simple.Connect("127.0.0.1", self.port)
        require(servermanager.ActiveConnection.IsRemote(), "the session is not that of a server")
        # On the server; the client has it already.
        simple.LoadPlugin(plugin, remote=True, ns=vars(simple))
        return self

    def __exit__(self, kind, value, trace):
        # A server ends with its client, when this process does.
        simple.Disconnect()


def pipeline():
    """Phantom, its phase, vesselness, segmentation, centerlines, wall, and how far that is from the truth."""
    phantom = simple.CoronaryPhantom(Spacing=[1.6, 1.6, 1.6], SurfaceSpacing=1.2, CenterlineSpacing=1.0)
    phase, truth = [
        simple.ReferencePhase(simple.OutputPort(phantom, port), Automatic=0, Time=TIME)
        for port in (IMAGE, SURFACE)]
    vesselness = simple.FrangiVesselness(phase, AutomaticC=0, C=100.0, NumberOfScales=2,
                                         SigmaMin=0.8)
    segmentation = simple.VesselSegmentation(phase, Vesselness=vesselness)
    centerline = simple.FastMarchingCenterline(
        vesselness, Seeds=simple.OutputPort(segmentation, 1), CTImage=phase, Mask=segmentation)
    tree = simple.CoronaryTreeTopology(centerline)
    wall = simple.FrenetSweepSurface(tree, MinimumEdgeLength=0.6, MaximumEdgeLength=1.5,
                                     EdgeLengthPerRadius=0.7)
    distance = simple.MeshDistanceMetrics(Result=wall, Reference=truth, ErrorBound=0.05)
    return vesselness, segmentation, centerline, wall, distance


def outputs(name):
    """Digests of what the stages give, numbers of the comparison, and a picture that the server has drawn."""
    stages = pipeline()
    found = []
    for stage in stages[2:4]:
        stage.UpdatePipeline()
        data = servermanager.Fetch(stage)
        require(data.GetNumberOfPoints() > 100, stage.GetXMLName() + " is empty")
        # On its way to the client the active arrays come first.
        found.append((stage.GetXMLName(), *sorted(digest(data))))
    for stage in stages[:2]:
        array = stage.PointData[0]
        found.append((stage.GetXMLName(), array.GetName(), array.GetRange()))
    measures = servermanager.Fetch(stages[4]).GetFieldData()
    numbers = [measures.GetArray(measure).GetValue(0) for measure in ("HD", "MSD", "RMS", "HD95")]
    require(0.0 < numbers[1] < 2.0, "distances: %s" % numbers)
    view = simple.CreateRenderView()
    view.ViewSize = [400, 400]
    # All that is shown is drawn on the server.
    view.RemoteRenderThreshold = 0.0
    shown = simple.Show(stages[4], view)
    simple.ColorBy(shown, ("POINTS", "SurfaceDistance"))
    image = simple.Show(stages[1], view)
    image.SetRepresentationType("Slice")
    view.ResetCamera()
    path = os.path.join(folder, name + ".png")
    simple.SaveScreenshot(path, view)
    require_picture(path, 0.02)
    print(name, numbers, flush=True)
    return found, numbers


load_plugin(plugin)
expected = outputs("one-process")
for ranks in (1, 2) if mpirun else (1,):
    with Server(ranks):
        found = outputs("ranks-%d" % ranks)
        for one, two in zip(expected[0], found[0]):
            require(one == two, "%d ranks: %s, not %s" % (ranks, set(two) - set(one), set(one) - set(two)))
        require(found[1] == expected[1], "%d ranks: %s, not %s" % (ranks, found[1], expected[1]))
