"""From the CT to named centerlines, as a user sets the filters up: output, picture."""
import os
import sys

from paraview import servermanager, simple

from coronary_testing import (CENTERLINES, FORKS, LINES, TREE, centerline_pipeline, fetch,
                              load_plugin, require, require_picture)

plugin, folder = sys.argv[1:3]


def names_of(data):
    array = data.GetCellData().GetAbstractArray("SegmentLabel")
    return {array.GetValue(n) for n in range(array.GetNumberOfValues())}


def outputs(phantom, centerline, topology):
    require(centerline.CTArray == "HU", "the array of the CT: %s" % centerline.CTArray)
    tree = fetch(topology, 0, 0.75)
    require({"LM", "pLAD", "mLAD", "dLAD", "pLCx", "pRCA", "mRCA", "dRCA", "D1", "OM1"} <=
            names_of(tree), "names: %s" % sorted(names_of(tree)))
    radius = tree.GetPointData().GetArray("MaximumInscribedSphereRadius").GetRange()
    require(0.1 < radius[0] < 1.0 and 1.5 < radius[1] < 4.0, "radii %s" % (radius,))
    fields = tree.GetFieldData()
    status = fields.GetArray("SeedStatus")
    require(status.GetNumberOfTuples() == 2 and status.GetRange() == (0.0, 0.0), "seeds")
    require(fetch(centerline, FORKS, 0.75).GetNumberOfPoints() >= 10, "bifurcations")

    # VMTK's form comes out of both filters, and goes into the topology.
    require(fetch(centerline, LINES, 0.75).GetNumberOfCells() > 10, "VMTK's lines")
    again = simple.CoronaryTreeTopology(simple.OutputPort(topology, 3))
    require(names_of(fetch(again, 0, 0.75)) == names_of(tree), "names of VMTK's lines")
    skeleton = os.path.join(folder, "tree.tgf")
    simple.SaveData(skeleton, proxy=topology)
    read = simple.OpenDataFile(skeleton)
    require(fetch(read, 0, 0.0).GetNumberOfPoints() == tree.GetNumberOfPoints(), "the skeleton")

    truth = simple.ReferencePhase(simple.OutputPort(phantom, CENTERLINES))
    truth.Automatic = 0
    truth.Time = 0.75
    metrics = simple.CenterlineMetrics(
        Result=simple.OutputPort(topology, 0), Reference=truth)
    metrics.MinimumRadius = 0.75
    table = fetch(metrics, 0, 0.75)
    overlap = table.GetColumnByName("OV")
    total = overlap.GetValue(overlap.GetNumberOfTuples() - 1)
    require(total > 0.9, "the overlap with the truth is %g" % total)


def picture(topology):
    view = simple.CreateRenderView()
    view.ViewSize = [600, 600]
    shown = simple.Show(topology, view)
    simple.ColorBy(shown, ("POINTS", "MaximumInscribedSphereRadius"))
    view.ResetCamera()
    path = os.path.join(folder, "centerline.png")
    simple.SaveScreenshot(path, view)
    require_picture(path, 0.005)


load_plugin(plugin)
pipeline = centerline_pipeline()
outputs(*pipeline)
picture(pipeline[2])
require(servermanager.ActiveConnection is not None, "the session is gone")
