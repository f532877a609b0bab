"""A tree tracked through a series, as a user sets the filters up: output, state, trace, picture."""
import os
import sys

from paraview import servermanager, simple

from coronary_testing import (CENTERLINES, IMAGE, TRACKED_LINES, TRACKED_SKELETON, content, fetch,
                              find, load_plugin, require, require_different_pictures,
                              require_picture, require_states_restore, require_trace_repeats,
                              tracking_pipeline)

plugin, folder = sys.argv[1:3]
TRACKED = [0.05, 0.2, 0.35, 0.75]


def tracked():
    tracker = find("Tracker")
    require(tracker.TrackedPhases == "List" and len(tracker.TrackedTimes) == 4, "the phases")
    require(tracker.NodeSpacing == 5.0 and tracker.CaptureRange == 14.0, "the settings")
    require(tracker.Centerlines is not None and tracker.Skeleton is not None, "the inputs")
    tracker.UpdatePipelineInformation()
    require(list(tracker.TimestepValues) == TRACKED, "steps: %s" % list(tracker.TimestepValues))
    return [content(fetch(tracker, port, time)) for port in (TRACKED_LINES, TRACKED_SKELETON)
            for time in (0.2, 0.35)] + [content(fetch(find("Moment"), 0, 0.41))]


def distance(one, two):
    """Mean over the points of two data sets that have the same ones."""
    require(one.GetNumberOfPoints() == two.GetNumberOfPoints() > 100, "the points")
    apart = (sum((a - b) ** 2 for a, b in zip(one.GetPoint(n), two.GetPoint(n))) ** 0.5
             for n in range(one.GetNumberOfPoints()))
    return sum(apart) / one.GetNumberOfPoints()


def outputs():
    phantom, tracker, regularized, moment = tracking_pipeline()
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
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

    # Lines of every phase instead of images, and a series that is none: the message names what is wrong.
    tracker.Series = simple.OutputPort(phantom, CENTERLINES)
    off = distance(fetch(tracker, TRACKED_LINES, 0.2), fetch(phantom, CENTERLINES, 0.2))
    require(off < 1.5, "with lines it is off by %g mm" % off)


def pictures():
    simple.ResetSession()
    phantom, tracker, _, _ = tracking_pipeline()
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
    require_states_restore(tracked, os.path.join(folder, "tracking.pvsm"))


load_plugin(plugin)
require_trace_repeats(tracking_pipeline, tracked)
simple.ResetSession()
outputs()
pictures()
require(servermanager.ActiveConnection is not None, "the session is gone")
