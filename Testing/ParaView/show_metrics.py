"""Two surfaces and two trees held against each other as a user does: output, time, picture."""
import os
import sys

from paraview import servermanager, simple

from coronary_testing import (CENTERLINES, SURFACE, fetch, load_plugin, require, require_picture)

plugin, folder = sys.argv[1:3]
TIME = 0.35


def metrics_pipeline():
    """A phantom against one with other radii, by its surface and by its tree."""
    result = simple.CoronaryPhantom(SurfaceSpacing=1.0)
    reference = simple.CoronaryPhantom(SurfaceSpacing=1.1,
                                       Tortuosity=0.9)
    distance = simple.MeshDistanceMetrics(
        Result=simple.OutputPort(result, SURFACE), Reference=simple.OutputPort(reference, SURFACE),
        ErrorBound=0.01, EndLength=2.0)
    branches = simple.CenterlineMetrics(
        Result=simple.OutputPort(result, CENTERLINES),
        Reference=simple.OutputPort(reference, CENTERLINES), MinimumLength=2.0, DetectedShare=0.7)
    return distance, branches


def numbers_of(distance, branches):
    """HD, MSD, RMS, HD95 of the surfaces, BCR, BCS, BCR_bounded, OV of the trees."""
    table = fetch(distance, 2, TIME)
    last = table.GetNumberOfRows() - 1
    numbers = [table.GetColumnByName(name).GetValue(last) for name in ("HD", "MSD", "RMS", "HD95")]
    field = fetch(branches, 2, TIME).GetFieldData()
    return numbers + [field.GetArray(name).GetValue(0)
                      for name in ("BCR", "BCS", "BCR_bounded", "OV")]


def outputs(distance, branches):
    numbers = numbers_of(distance, branches)
    hd, msd, rms, hd95, bcr, bcs, bounded, overlap = numbers
    require(0.0 < msd < rms < hd95 < hd < 5.0, "distances %s" % numbers)
    require(0.5 < bcr < 1.5 and 0.5 < bcs < 1.5, "ratios %s" % numbers)
    require(0.5 < bounded <= 1.0 and 0.5 < overlap <= 1.0, "bounded measures %s" % numbers)
    times = list(distance.TimestepValues)
    require(len(times) == 20, "%d time steps" % len(times))
    require(fetch(distance, 2, TIME).GetNumberOfRows() > 10, "no rows of branches")
    require(fetch(branches, 2, TIME).GetNumberOfRows() > 8, "no branches")
    require(fetch(branches, 0, TIME).GetColumnByName("OV") is not None, "no lines of the reference")
    lines = fetch(branches, 3, TIME)
    require(lines.GetNumberOfCells() > 16 and
            lines.GetCellData().GetArray("Covered") is not None, "no lines")
    # Another phase is another comparison.
    phase = fetch(distance, 2, times[3])
    require(phase.GetColumnByName("HD").GetValue(phase.GetNumberOfRows() - 1) != hd, "no time")


def picture(distance):
    view = simple.CreateRenderView()
    view.ViewSize = [600, 400]
    view.ViewTime = TIME
    shown = simple.Show(distance, view)
    simple.ColorBy(shown, ("POINTS", "SurfaceDistance"))
    view.ResetCamera()
    path = os.path.join(folder, "metrics.png")
    simple.SaveScreenshot(path, view)
    require_picture(path, 0.005)


load_plugin(plugin)
pipeline = metrics_pipeline()
outputs(*pipeline)
picture(pipeline[0])
require(servermanager.ActiveConnection is not None, "the session is gone")
