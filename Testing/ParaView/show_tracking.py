"""A tree tracked through a series, as a user sets the filters up: output, picture."""
import os
import sys

from paraview import servermanager, simple

from coronary_testing import (CENTERLINES, TRACKED_LINES, TRACKED_SKELETON, fetch, load_plugin,
                              require, require_different_pictures, require_picture,
                              tracking_pipeline)

plugin, folder = sys.argv[1:3]
TRACKED = [0.05, 0.2, 0.35, 0.75]


def distance(one, two):
    """Mean over the points of two data sets that have the same ones."""
    require(one.GetNumberOfPoints() == two.GetNumberOfPoints() > 100, "the points")
    apart = (sum((a - b) ** 2 for a, b in zip(one.GetPoint(n), two.GetPoint(n))) ** 0.5
             for n in range(one.GetNumberOfPoints()))
    return sum(apart) / one.GetNumberOfPoints()


def outputs(phantom, tracker, regularized, moment):
    simple.GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
    tracker.UpdatePipelineInformation()
    require(list(tracker.TimestepValues) == TRACKED, "steps: %s" % list(tracker.TimestepValues))
    for time in TRACKED:
        truth = fetch(phantom, CENTERLINES, time)
        for source in (tracker, regularized):
            off = distance(fetch(source, 0, time), truth)
            require(off < 1.0, "at %g %s is off by %g mm" % (time, source.GetXMLName(), off))
    between = distance(fetch(moment, 0, 0.28), fetch(phantom, CENTERLINES, 0.28))
    require(between < 2.0, "between the phases it is off by %g mm" % between)
    data = fetch(tracker, TRACKED_LINES, 0.35)
    points = data.GetPointData()
    for name in ("TrackingConfidence", "TrackingStatus", "CalibreFactor", "Displacement"):
        require(points.GetArray(name) is not None, "no array %s" % name)
    confidence = points.GetArray("TrackingConfidence").GetRange()
    require(0.0 <= confidence[0] < confidence[1] <= 1.0, "confidence %s" % (confidence,))
    require(data.GetCellData().GetArray("AxialStrain") is not None, "no strain")
    require(data.GetFieldData().GetArray("TrackedShare").GetNumberOfTuples() == 4, "the shares")
    bones = fetch(tracker, TRACKED_SKELETON, 0.35)
    require(bones.GetCellData().GetArray("BoneId") is not None, "the skeleton")


def lines_of_every_phase(phantom, tracker):
    """Instead of images."""
    tracker.Series = simple.OutputPort(phantom, CENTERLINES)
    off = distance(fetch(tracker, TRACKED_LINES, 0.2), fetch(phantom, CENTERLINES, 0.2))
    require(off < 1.5, "with lines it is off by %g mm" % off)


def pictures(tracker):
    view = simple.CreateRenderView()
    view.ViewSize = [600, 600]
    lines = simple.Show(simple.OutputPort(tracker, TRACKED_LINES), view)
    lines.LineWidth = 4.0
    simple.ColorBy(lines, ("POINTS", "TrackingConfidence"))
    saved = []
    for time in (0.75, 0.35):
        view.ViewTime = time
        view.CameraPosition, view.CameraFocalPoint = [20.0, -330.0, -20.0], [20.0, 0.0, -40.0]
        view.CameraViewUp = [0.0, 0.0, 1.0]
        saved.append(os.path.join(folder, "tracking-%g.png" % time))
        simple.SaveScreenshot(saved[-1], view)
        require_picture(saved[-1], 0.002)
    require_different_pictures(*saved, share=0.002)


load_plugin(plugin)
pipeline = tracking_pipeline()
outputs(*pipeline)
pictures(pipeline[1])
lines_of_every_phase(*pipeline[:2])
require(servermanager.ActiveConnection is not None, "the session is gone")
