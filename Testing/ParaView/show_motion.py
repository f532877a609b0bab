"""The tree's motion, regularised and at any moment, as a user sets the filters up: output, state, trace, picture."""
import os
import sys

from paraview import servermanager, simple

from coronary_testing import (CENTERLINES, content, fetch, find, load_plugin, require,
                              require_different_pictures, require_picture,
                              require_states_restore, require_trace_repeats)

plugin, folder = sys.argv[1:3]


def motion_pipeline():
    # Settings with the creation: a trace of a script records no others.
    phantom = simple.CoronaryPhantom(registrationName="Phantom", CenterlineSpacing=2.0)
    regularized = simple.MotionRegularizer(
        Motion=simple.OutputPort(phantom, CENTERLINES), registrationName="Regularized",
        MaximumBending=50.0)
    moment = simple.CardiacPhaseInterpolator(
        regularized, registrationName="Moment", Mode="Periodic Cubic", Ellipses=1)
    return phantom, regularized, moment


def moved():
    require(find("Regularized").MaximumBending == 50.0, "the limit")
    return content(fetch(find("Moment"), 0, 0.41))


def outputs():
    phantom, regularized, moment = motion_pipeline()
    moment.UpdatePipelineInformation()
    require(len(moment.TimestepValues) == 20, "steps: %s" % list(moment.TimestepValues))
    offered = moment.SMProxy.GetProperty("TimeRange")
    offered = [offered.GetElement(0), offered.GetElement(1)]
    require(abs(offered[0] + 0.05) < 1e-9 and abs(offered[1] - 1.06) < 1e-9,
            "range: %s" % offered)
    require(len(regularized.TimestepValues) == 20, "steps of the regularizer")
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    for time in (0.123, 0.4, 2.4, -0.6):
        data = fetch(moment, 0, time)
        points = data.GetPointData()
        for name in ("Velocity", "CalibreFactor", "AreaStrain", "EllipseMajor", "EllipseMinor",
                     "MaximumInscribedSphereRadius"):
            require(points.GetArray(name) is not None, "no array %s" % name)
        strain = points.GetArray("AreaStrain").GetRange()
        require(-0.05 <= strain[0] and strain[1] <= 0.05, "area strain %s" % (strain,))
        truth = fetch(phantom, CENTERLINES, time % 1.0)
        worst = max(abs(a - b) for n in range(truth.GetNumberOfPoints())
                    for a, b in zip(truth.GetPoint(n), data.GetPoint(n)))
        require(worst < 0.3, "at %g the tree is off by %g mm" % (time, worst))
    fields = fetch(regularized, 0, 0.3).GetFieldData()
    for name in ("TemporalEnergy", "SpatialEnergy", "TotalEnergy", "MotionObjective"):
        require(fields.GetArray(name).GetNumberOfTuples() == 2, name)
    require(fetch(regularized, 0, 0.3).GetCellData().GetArray("AxialStress") is not None, "stress")
    moment.Mode = "Low Noise"
    fit = fetch(moment, 0, 0.3).GetFieldData().GetArray("LowNoiseFit")
    require(fit.GetNumberOfTuples() == 4 and fit.GetValue(0) >= 1, "the fit")
    moment.TimeSteps = "List"
    moment.ListedSteps = [0.1, 0.3, 0.7]
    moment.UpdatePipelineInformation()
    require(list(moment.TimestepValues) == [0.1, 0.3, 0.7], "list: %s" % list(moment.TimestepValues))


def round_trips():
    simple.ResetSession()
    moment = motion_pipeline()[2]
    view = simple.CreateRenderView()
    view.ViewSize = [600, 600]
    shown = simple.Show(moment, view)
    simple.ColorBy(shown, ("POINTS", "Velocity", "Magnitude"))
    pictures = []
    for time in (0.0, 0.33):
        view.ViewTime = time
        view.CameraPosition, view.CameraFocalPoint = [20.0, -330.0, -20.0], [20.0, 0.0, -40.0]
        view.CameraViewUp = [0.0, 0.0, 1.0]
        pictures.append(os.path.join(folder, "motion-%g.png" % time))
        simple.SaveScreenshot(pictures[-1], view)
        require_picture(pictures[-1], 0.002)
    require_different_pictures(*pictures, share=0.002)
    require_states_restore(moved, os.path.join(folder, "motion.pvsm"))


load_plugin(plugin)
require_trace_repeats(motion_pipeline, moved)
simple.ResetSession()
outputs()
round_trips()
require(servermanager.ActiveConnection is not None, "the session is gone")
