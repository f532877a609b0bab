"""Reference phase and vesselness as a user sets them up: arrays, time, state, trace, picture."""
import os
import sys

from paraview import servermanager, simple

from coronary_testing import (IMAGE, content, fetch, find, load_plugin, quick_phantom, require,
                              require_picture, require_states_restore, require_trace_repeats)

plugin, folder = sys.argv[1:3]


def make_pipeline():
    """Phantom, its phase at 0.75, and a vesselness that differs from the default in every way."""
    phantom = quick_phantom(registrationName="Phantom")
    phantom.AutomaticGrid = 0
    phantom.Origin = [-40.0, -40.0, -60.0]
    phantom.Dimensions = [40, 41, 42]
    phase = simple.ReferencePhase(simple.OutputPort(phantom, IMAGE), registrationName="Phase")
    phase.Automatic = 0
    phase.Time = 0.75
    vesselness = simple.FrangiVesselness(phase, registrationName="Vesselness")
    vesselness.SigmaMin = 0.8
    vesselness.SigmaMax = 2.0
    vesselness.NumberOfScales = 3
    vesselness.ScaleSpacing = "Logarithmic"
    vesselness.Alpha = 0.4
    vesselness.Beta = 0.6
    vesselness.GenerateScale = 1
    vesselness.GenerateDirection = 1
    vesselness.UseRegion = 1
    vesselness.Region = [2, 35, 3, 36, 4, 38]
    return phantom, phase, vesselness


def response():
    vesselness = find("Vesselness")
    require(list(vesselness.Region) == [2, 35, 3, 36, 4, 38], "the region")
    require(vesselness.ScaleSpacing == "Logarithmic", "the spacing of the scales")
    return content(fetch(vesselness, 0, 0.35))


def arrays_and_time():
    phantom, phase, vesselness = make_pipeline()
    data = fetch(vesselness, 0, 0.35)
    points = data.GetPointData()
    names = sorted(points.GetArrayName(n) for n in range(points.GetNumberOfArrays()))
    require(names == ["VesselDirection", "VesselScale", "Vesselness"], "arrays %s" % names)
    require(points.GetScalars().GetName() == "Vesselness", "the active scalars")
    response = points.GetArray("Vesselness").GetRange()
    require(response[0] == 0.0 and 0.2 < response[1] <= 1.0, "range %s" % (response,))
    vesselness.UpdatePropertyInformation()
    used = vesselness.GetProperty("UsedC").GetElement(0)
    require(used > 0.0, "no C was measured")
    require(data.GetFieldData().GetArray("VesselnessC").GetValue(0) == used, "the C in field data")
    phase.UpdatePropertyInformation()
    pinned = phase.GetProperty("UsedTime").GetElement(0)
    require(abs(pinned - 0.75) < 0.03, "the phase is %g" % pinned)
    require(data.GetFieldData().GetArray("PhaseTime").GetValue(0) == pinned, "PhaseTime")

    # The image moves with the time, the vesselness stays.
    require(content(fetch(vesselness, 0, 0.1)) == content(data), "the vesselness follows the time")
    require(content(fetch(phantom, IMAGE, 0.1)) != content(fetch(phantom, IMAGE, 0.35)),
            "the phantom stands still")
    # The stored value is as good as the measured one.
    vesselness.AutomaticC = 0
    vesselness.C = used
    require(content(fetch(vesselness, 0, 0.35)) == content(data), "C given and measured differ")

    mask = simple.FrangiVesselness(phase, Mask=vesselness)
    mask.MaskArrayName = "Vesselness"
    mask.SigmaMin = 0.8
    require(mask.Mask is not None, "the mask is not connected")
    inside = fetch(mask, 0, 0.35).GetPointData().GetScalars()
    outside = [n for n in range(0, inside.GetNumberOfTuples(), 5)
               if points.GetArray("Vesselness").GetValue(n) == 0.0]
    require(outside and all(inside.GetValue(n) == 0.0 for n in outside), "the mask has no effect")
    require(inside.GetRange()[1] > 0.0, "the mask removes all")
    unmasked = simple.FrangiVesselness(phase)
    require(unmasked.Mask is None, "a mask was connected by accident")


def without_reference_phase():
    """On the series itself the filter has the series' time steps, and one C."""
    simple.ResetSession()
    phantom, phase, vesselness = make_pipeline()
    vesselness.Input = simple.OutputPort(phantom, IMAGE)
    simple.Delete(phase)
    values = []
    for time in (0.35, 0.75, 0.35):
        data = fetch(vesselness, 0, time)
        require(data.GetFieldData().GetArray("PhaseTime").GetValue(0) == time, "PhaseTime")
        values.append(data.GetFieldData().GetArray("VesselnessC").GetValue(0))
    require(len(set(values)) == 1, "C changes with the time: %s" % values)


def round_trips():
    simple.ResetSession()
    vesselness = make_pipeline()[2]
    view = simple.CreateRenderView()
    simple.Show(vesselness, view)
    require_states_restore(response, os.path.join(folder, "vesselness.pvsm"))


def trace_repeats():
    def build():
        phantom = simple.CoronaryPhantom(registrationName="Source", Dimensions=[30, 30, 30],
                                         AutomaticGrid=0, Spacing=[2.0, 2.0, 2.0],
                                         Origin=[-30.0, -30.0, -50.0])
        phase = simple.ReferencePhase(phantom, registrationName="Pinned", Automatic=0)
        simple.FrangiVesselness(phase, registrationName="Traced", Method="Jerman", SigmaMin=1.0)

    def traced():
        require(find("Traced").Method == "Jerman", "the method")
        return content(fetch(find("Traced"), 0, 0.35))

    require_trace_repeats(build, traced)


def picture():
    simple.ResetSession()
    vesselness = make_pipeline()[2]
    vesselness.UpdatePipeline()
    view = simple.CreateRenderView()
    view.ViewSize = [600, 600]
    shown = simple.Show(vesselness, view)
    require(shown.Representation == "Slice", "it is shown as %s" % shown.Representation)
    simple.ColorBy(shown, ("POINTS", "Vesselness"))
    view.ResetCamera()
    path = os.path.join(folder, "vesselness.png")
    simple.SaveScreenshot(path, view)
    require_picture(path, 0.02)


load_plugin(plugin)
trace_repeats()
simple.ResetSession()
arrays_and_time()
without_reference_phase()
round_trips()
picture()
require(servermanager.ActiveConnection is not None, "the session is gone")
