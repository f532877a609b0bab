"""Dynamic Coronary: build from 4D CT. The beating coronary arteries of a gated series, stage by stage, as filters in ParaView.

From Python: `import build_from_4d_ct; build_from_4d_ct.build(source)`; or as a macro: select the image series in the
pipeline browser first; with an empty pipeline browser a small phantom is made.

The stages and their settings are those of `coronary-pipeline run`, and give the same points. ParaView does not answer
meanwhile: the menu's entry leaves the work to that program (build_by_program). Needs the DynamicCoronary plugin.
"""
import os

from paraview import print_error, simple

import coronary_views as views

# What is wider than so many times the largest radius of a vessel is none, as in `coronary-pipeline run`.
WIDEST_VESSEL = 2.0
MOTIONS = ("automatic", "tracked", "population", "none")
MODES = {"linear": "Linear", "cubic": "Periodic Cubic", "low-noise": "Low Noise"}
# Quick to compute, all stages together.
EXAMPLE = {"Seed": 1, "Spacing": [0.8, 0.8, 0.8], "Phases": [0.0, 0.15, 0.35, 0.5, 0.75]}
HOUNSFIELD = (-150.0, 650.0)
# Fewer do not show how a heart moves between them; phases nearer than that are one (fraction of R-R). As in `coronary-pipeline run`.
LEAST_PHASES, SAME_PHASE = 4, 0.02
USUAL_PHASE = 0.75


def build(source=None, *, time=None, scales=(0.5, 2.5), c=100.0, seed=(), largest_radius=4.5, window=(),
          beyond_mask=False, least_branch=0.0, centerline_steps=5000000, labels=True,
          edges=(0.15, 0.7), open_ends=False, leave_bones_outside=False, temporal_window_ms=66.0,
          tracked="all", interpolation="cubic", limits=True, motion="automatic", heart_rate=0.0, motion_amplitude=1.0,
          show=True, size=None):
    """Assembles the pipeline and computes it.

    source        image series, or the output port of one; None: the selected one. Of fewer than four phases the motion of a population, bent to them
    time          reference phase as a fraction of the R-R interval; None: the quietest one
    scales, c     vesselness: least and greatest scale in mm, and Frangi's c; c 0: from the image
    seed          x, y, z of each seed one after the other, mm, LPS; none: the ostia are looked for
    window        HU of tissue and of blood; none: from the image
    show, size    makes a layout of three views, of so many pixels together
    heart_rate    of a population's motion, beats a minute; 0: that of the data
    The others are the settings of `coronary-pipeline run` of the same names (`--help`).

    Returns the stages by short names ("reference" ... "wall"), with "layout" and "views" when shown. Raises
    RuntimeError with one sentence when a stage finds nothing; the stages before it stay.
    """
    views.require_plugin()
    source = selected_series() if source is None else source
    if motion not in MOTIONS:
        raise RuntimeError("motion is %r; it has to be one of %s." % (motion, ", ".join(MOTIONS)))
    times = views.times_of(source)
    made = {"source": source}

    def add(key, proxy, fault="is empty", port=0):
        proxy.UpdatePipeline(*times[:1])
        if proxy.GetDataInformation(port).GetNumberOfPoints() == 0:
            raise RuntimeError('"%s" %s.' % (views.name_of(proxy), fault))
        made[key] = proxy
        return simple.OutputPort(proxy, port)

    automatic = time is None and len(times) > 1
    if time is None:
        time = times[0] if times else 0.0
    reference = add("reference", simple.ReferencePhase(
        source, registrationName="1 Reference phase", Automatic=int(automatic), Time=time))
    vesselness = add("vesselness", simple.FrangiVesselness(
        reference, registrationName="2 Vesselness", SigmaMin=scales[0], SigmaMax=scales[1],
        AutomaticC=int(not c > 0.0), C=c if c > 0.0 else 1.0))
    segmentation = simple.VesselSegmentation(
        reference, registrationName="3 Segmentation and ostia", Vesselness=vesselness,
        SeedPoints=list(seed), MaximumRadius=largest_radius)
    if window:
        segmentation.AutomaticWindow = 0
        segmentation.TissueValue, segmentation.BloodValue = window
    ostia = add("segmentation", segmentation, "found no ostium: give seeds", 1)
    centerline = simple.FastMarchingCenterline(
        vesselness, registrationName="4 Centerlines", Seeds=ostia, CTImage=reference,
        MinimumBranchLength=least_branch, StepLimit=centerline_steps)
    if not beyond_mask:
        centerline.Mask = simple.OutputPort(segmentation, 0)
    lines = add("centerline", centerline, "found no vessel at the seeds: look at the vesselness there")
    tree = add("tree", simple.CoronaryTreeTopology(
        lines, registrationName="5 Named trees", Roots=ostia, LabelSegments=int(labels)))
    require_vessels(made["tree"], largest_radius)
    surface = add("surface", simple.FrenetSweepSurface(
        tree, registrationName="6 Surface", MinimumEdgeLength=edges[0], MaximumEdgeLength=edges[1],
        Capping=int(not open_ends)))
    skeleton = add("skeleton", simple.CenterlineSkeleton(tree, registrationName="7 Skeleton"))
    mesh = add("mesh", simple.TetrahedralMesher(
        surface, registrationName="8 Tetrahedra", Skeleton=skeleton, LeaveOutPointsOutside=1,
        MinimumVolume=0.0))
    weights = add("weights", simple.BiharmonicSkinWeights(
        mesh, registrationName="9 Skin weights", Skeleton=skeleton,
        LeaveBonesOutside=int(leave_bones_outside)))
    kind = kind_of_motion(times, motion, tracked, labels)
    if kind == "none":
        made["lines"] = made["tree"]
        wall = weights
    else:
        if kind == "tracked" or len(times) > 1:
            tracker = simple.CenterlineTracker(
                source, registrationName="10 Tracker", Centerlines=tree, Skeleton=skeleton,
                TrackedPhases=tracked.capitalize())
            # The unit in its label is a part of its name in Python.
            tracker.SetPropertyWithName("TemporalWindow", temporal_window_ms / 1000.0)
            add("tracker", tracker)
        if kind == "tracked":
            movers = limited(add, made["tracker"], tree, skeleton) if limits else (
                simple.OutputPort(made["tracker"], 0), simple.OutputPort(made["tracker"], 1))
        else:
            population = simple.PopulationMotion(
                Centerlines=tree, Skeleton=skeleton, HeartRate=heart_rate, Amplitude=motion_amplitude,
                registrationName="10 Motion of a population")
            if len(times) < 2 and not any(times):
                # What does not tell its phase is taken for mid-diastole, as most scans are.
                population.AutomaticReference, population.ReferenceTime = 0, time or USUAL_PHASE
            if "tracker" in made:
                population.Tracked = simple.OutputPort(made["tracker"], 0)
            movers = add("population", population), simple.OutputPort(population, 1)
            times = views.times_of(population)
        moments = {"Mode": MODES[interpolation], "TimeSteps": "List", "ListedSteps": times}
        add("lines", simple.CardiacPhaseInterpolator(
            movers[0], registrationName="11 Centerlines in time", **moments))
        poses = add("poses", simple.CardiacPhaseInterpolator(
            movers[1], registrationName="11 Skeleton in time", **moments))
        moved = add("moved", simple.SkinDeformation(
            weights, registrationName="12 Deformation", SkeletonAtRest=skeleton,
            PosedSkeleton=poses, DoublePrecision=1))
        wall = moved
    boundary = add("boundary", simple.ExtractSurface(wall, registrationName="13 Boundary"))
    add("wall", views.smooth(boundary, "14 Wall"))
    if show:
        made["layout"], made["views"] = show_model(made, times, size)
        for _ in made["frames"]:
            pass
    return made


def kind_of_motion(times, wanted, tracked, labels):
    """One of MOTIONS but "automatic", by the phases that there are and what was asked for; says why, when it is none."""
    phases = []
    for time in times:
        if all(min(abs(time - one) % 1.0, -abs(time - one) % 1.0) >= SAME_PHASE for one in phases):
            phases.append(time)
    enough = len(times) >= (3 if tracked == "even" else 2)
    if wanted == "tracked" or (wanted == "automatic" and enough and len(phases) >= LEAST_PHASES):
        if not enough:
            print("Dynamic Coronary: too few phases to track, so this is a model at rest.")
        return "tracked" if enough else "none"
    if wanted != "none" and not labels:
        print("Dynamic Coronary: the motion of a population needs a tree with names, so this is a model at rest.")
        return "none"
    return "none" if wanted == "none" else "population"


def limited(add, tracker, tree, skeleton):
    """The tracked lines and skeleton within the limits of motion."""
    # Acceleration counts as with 20 phases.
    weight = 0.005 * min(1.0, len(tracker.TimestepValues) / 20.0) ** 4
    return (add("limits", simple.MotionRegularizer(
        Motion=simple.OutputPort(tracker, 0), Rest=tree, TemporalWeight=weight,
        registrationName="10 Motion of the lines within limits")),
            add("pose_limits", simple.MotionRegularizer(
                Motion=simple.OutputPort(tracker, 1), Rest=skeleton, TemporalWeight=weight,
                registrationName="10 Motion of the skeleton within limits")))


def require_vessels(tree, largest_radius):
    """A tree that runs into a chamber has no wall that could be swept in finite time."""
    widest = tree.PointData[views.RADIUS].GetRange()[1]
    if widest > WIDEST_VESSEL * largest_radius:
        raise RuntimeError(
            '"%s" has a radius of %.1f mm, more than twice the largest one of a vessel (%g mm): the tree runs '
            "into a chamber or a great vessel; give seeds, a window, larger scales or another largest_radius."
            % (views.name_of(tree), widest, largest_radius))


def greatest_displacement(lines, times):
    """Of moving lines, mm."""
    def at(time):
        lines.UpdatePipeline(time)
        return lines.PointData["Displacement"].GetRange(-1)[1]
    return max(at(time) for time in reversed(times))  # the first last: what is looked at next is of that


def show_model(made, times, size=None):
    """The beating wall, an axial slice of the images with the wall in it, and the named centerlines."""
    layout, front = views.new_layout("Dynamic Coronary", size)
    axial, cell = views.split(layout, 0, 0.55)
    named, _ = views.split(layout, cell, 0.5, downwards=True)
    moving = "moved" in made
    steps = views.ready_to_play()
    box = list(made["tree"].GetDataInformation(0).GetBounds())

    wall = simple.Show(made["wall"], front, "GeometryRepresentation")
    if moving:
        far = greatest_displacement(made["lines"], times)
        views.colour_by(wall, front, "Displacement", "displacement from the reference phase (mm)",
                        0.0, far or 1.0)
    else:
        views.plain(wall, views.WALL)
    views.look_from_the_front(front, box)

    centre = [0.5 * (low + high) for low, high in zip(box[::2], box[1::2])]
    cut, height = views.axial_slice(made["source"], centre, "Axial slice")
    rim = views.rim_in_slice(made["wall"], centre, height, "Wall in the slice")
    array = views.image_array(made["reference"])
    views.show_slice(cut, axial, array, *views.grey_window(made["reference"], array, HOUNSFIELD))
    shown = simple.Show(rim, axial, "GeometryRepresentation")
    views.plain(shown, views.WALL)
    shown.LineWidth = 2.5
    views.look_from_the_feet(axial, box)

    tree = simple.Show(made["lines"], named, "GeometryRepresentation")
    tree.LineWidth = 4.0
    views.look_from_the_front(named, box)
    made["names"] = views.name_segments(made["lines"], tree, named)

    if times:
        views.note_phase((front, axial, named), made["lines"])
    source = views.fetched(made["lines"]).GetFieldData().GetAbstractArray("MotionSource")
    if source:
        for view in (front, axial, named):
            views.note(view, source.GetValue(0).split(":")[0], "Motion", "Lower Left Corner")
        print("Dynamic Coronary: %s." % source.GetValue(0))
    simple.SetActiveView(front)
    simple.SetActiveSource(made["wall"])
    made["steps"], made["frames"] = len(steps), views.frames((front, axial, named), steps)
    for view in (front, axial, named):
        simple.Render(view)
    return layout, (front, axial, named)


def open_result(folder, series, size=None):
    """Shows the folder of a `coronary-pipeline run` beside its images, as build() shows what it made.

    series   the images: a source, or what *Gated Image Reader* opens
    RuntimeError when one of the files is missing.
    """
    views.require_plugin()
    paths = [os.path.join(folder, "centerline.vtp"), os.path.join(folder, "motion", "centerline.pvd"),
             os.path.join(folder, "motion.pvd")]
    for path in paths + ([series] if isinstance(series, str) else []):
        if not os.path.isfile(path):
            raise RuntimeError("'%s' is missing: a finished run and its images are needed." % path)
    tree = opened_once("Named trees", simple.XMLPolyDataReader, FileName=[paths[0]])
    lines = simple.PVDReader(registrationName="Centerlines in time", FileName=paths[1])
    moved = simple.PVDReader(registrationName="Beating surface", FileName=paths[2])
    source = series
    if isinstance(series, str):
        source = simple.GatedImageReader(registrationName="Images", FileNames=[series])
    wall = views.smooth(moved, "Wall")
    made = {"source": source, "reference": source, "tree": tree, "lines": lines, "moved": moved, "wall": wall}
    for proxy in (views.proxy_of(source), tree, lines, wall):
        proxy.UpdatePipeline()
    made["layout"], made["views"] = show_model(made, views.times_of(lines), size)
    return made


def opened_once(name, reader, **files):
    """A reader of files; the one of that name that reads them already, if there is one."""
    for known in simple.GetSources().values():
        if views.name_of(known) == name and all(
                list(getattr(known, key, [])) == value for key, value in files.items()):
            return known
    return reader(registrationName=name, **files)


def example():
    """A phantom that is small enough to be quick."""
    views.require_plugin()
    print("Dynamic Coronary: nothing to build from in the pipeline browser, so a small phantom is made.")
    return simple.CoronaryPhantom(registrationName="Coronary Phantom (example)", **EXAMPLE)


def selected_series():
    """The image series to build from: the active source; else the only image series that there is; else, with an
    empty pipeline browser, a phantom. Raises RuntimeError when it can not be told."""
    active = simple.GetActiveSource()
    if active and views.is_image(active):
        return active
    series = [source for source in simple.GetSources().values() if views.is_series(source)]
    if len(series) == 1:
        return series[0]
    if not simple.GetSources():
        return example()
    raise RuntimeError("Select the image series (CT over the heart cycle) in the pipeline browser.")


def main():
    """As a macro: one message instead of a Python traceback."""
    try:
        build()
    except RuntimeError as error:
        print_error("Dynamic Coronary: %s" % error)


if __name__ in ("__main__", "__vtkconsole__"):
    main()
