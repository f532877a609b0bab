"""Image, surface and tree together at two phases; the time slider; state files and trace."""
import os
import sys

from paraview import simple

from coronary_testing import (CENTERLINES, IMAGE, PROBE, SURFACE, content, fetch, find,
                              load_plugin, quick_phantom, require, require_different_pictures,
                              require_picture, require_states_restore, require_trace_repeats,
                              show_phantom)

plugin, folder = sys.argv[1:3]


def pictures():
    phantom = simple.CoronaryPhantom(registrationName="Phantom")
    view = simple.CreateRenderView()
    view.ViewSize = [1000, 800]
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    steps = list(scene.TimeKeeper.TimestepValues)
    require(len(steps) == 20, "the time slider has %d steps, not 20" % len(steps))
    require(abs(steps[0] + 0.05) < 1e-12 and abs(steps[-1] - 1.06) < 1e-12,
            "the time slider runs from %g to %g" % (steps[0], steps[-1]))
    require((scene.StartTime, scene.EndTime) == (steps[0], steps[-1]), "the scene's range")

    scene.AnimationTime = 0.0
    show_phantom(phantom, view)
    files = []
    for time in (0.0, 0.35):
        scene.AnimationTime = time
        require(view.ViewTime == time, "the view does not follow the time")
        files.append(os.path.join(folder, "phantom_%02d.png" % round(100 * time)))
        simple.SaveScreenshot(files[-1], view, ImageResolution=[1000, 800])
        require_picture(files[-1])
    require_different_pictures(*files)

    # Step by step, as with the buttons beside the slider.
    scene.GoToFirst()
    times = [view.ViewTime]
    simple.Hide(simple.OutputPort(phantom, IMAGE), view)
    for _ in steps[1:]:
        scene.GoToNext()
        times.append(view.ViewTime)
    require(times == steps, "the buttons step through %s" % times)


def make_special():
    """A phantom that differs from the default in every kind of property."""
    probe = simple.Sphere(registrationName="Points", Radius=30.0)
    phantom = quick_phantom(registrationName="Special")
    phantom.Seed = 5
    phantom.Dominance = "Balanced"
    phantom.Stenoses = 2
    phantom.ChronicOcclusion = 1
    phantom.LostPhases = [0.3, 1.0, 0.35, 0.5]
    phantom.Phases = [0.0, 0.25, 0.35, 0.75]
    phantom.PointSpread = [0.4, 0.4, 0.5]
    phantom.AutomaticGrid = 0
    phantom.Origin = [-40.0, -40.0, -60.0]
    phantom.Dimensions = [30, 31, 32]
    phantom.Direction = [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    phantom.ProbePoints = probe
    return phantom


def special():
    phantom = find("Special")
    phantom.UpdatePipelineInformation()
    require(phantom.Seed == 5 and phantom.Dominance == "Balanced", "settings")
    require(list(phantom.TimestepValues) == [0.0, 0.25, 0.35, 0.75], "phases")
    require(fetch(phantom, PROBE, 0.35).GetNumberOfPoints() > 0, "the probe's input")
    return [content(fetch(phantom, port, 0.35)) for port in (CENTERLINES, SURFACE, IMAGE)]


def round_trips():
    simple.ResetSession()
    phantom = make_special()
    view = simple.CreateRenderView()
    simple.Show(simple.OutputPort(phantom, SURFACE), view)
    require_states_restore(special, os.path.join(folder, "phantom.pvsm"))


def trace_repeats():
    # A script's trace records creations; property changes are recorded by the window's panel.
    require_trace_repeats(lambda: simple.CoronaryPhantom(registrationName="Traced"),
                          lambda: content(fetch(find("Traced"), CENTERLINES, 0.35)))


def scripts_do_not_connect_by_accident():
    simple.ResetSession()
    simple.Sphere()
    phantom = simple.CoronaryPhantom()
    require(phantom.ProbePoints is None, "the active source became the probe")


load_plugin(plugin)
trace_repeats()
simple.ResetSession()
pictures()
round_trips()
scripts_do_not_connect_by_accident()
