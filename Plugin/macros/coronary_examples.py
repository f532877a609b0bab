"""The examples of the menu Dynamic Coronary, of sources of the plugin only: they need no files.

From Python: `import coronary_examples; coronary_examples.posing()`. As a state: `paraview --state Plugin/states/posing.py`.
Each function makes a layout of its own and returns its sources by name, with "layout" and "views"; `size` is that of
all views together in pixels, None: as large as the window. RuntimeError without the DynamicCoronary plugin.
"""
from paraview import simple

import coronary_views as views

IMAGE, LINES, SURFACE = 0, 1, 2
REST = 0.75  # the phase in which the model is made, R-R fraction
SYSTOLE = 0.35
HOUNSFIELD = (-150.0, 650.0)
# A tree of short bones that are the same at every phase, and a mesh that is quick to make.
COARSE = {"Seed": 1, "CenterlineSpacing": 4.0}


def start(source, time):
    """The animation with the time steps there are, at the one of a source next to `time`, which is returned."""
    views.ready_to_play()
    scene = simple.GetAnimationScene()
    scene.AnimationTime = min(views.times_of(source), key=lambda step: abs(step - time))
    return scene.AnimationTime


def finish(made, layout, shown, active):
    simple.SetActiveView(shown[0])
    simple.SetActiveSource(active)
    for view in shown:
        simple.Render(view)
    made.update(layout=layout, views=shown)
    return made


def phantom(size=None):
    """The phantom's true lumen in front of its beating CT, and an axial slice with the lumen's rim."""
    views.require_plugin()
    layout, front = views.new_layout("Phantom", size)
    axial, _ = views.split(layout, 0, 0.55)
    source = simple.CoronaryPhantom(registrationName="Coronary Phantom", Seed=1, Spacing=[0.8, 0.8, 0.8],
                                    SurfaceSpacing=0.8)
    steps = views.ready_to_play()
    source.UpdatePipeline(*steps[:1])
    box = list(source.GetDataInformation(SURFACE).GetBounds())
    centre = [0.5 * (low + high) for low, high in zip(box[::2], box[1::2])]

    lumen = simple.OutputPort(source, SURFACE)
    views.plain(simple.Show(lumen, front, "GeometryRepresentation"), views.WALL)
    cut, height = views.axial_slice(simple.OutputPort(source, IMAGE), centre, "Axial slice")
    rim = views.rim_in_slice(lumen, centre, height, "Lumen in the slice")
    views.look_along(front, [0.2516, 0.8555, -0.4529], [0.0, 0.0, 1.0], box, 1.3)
    views.look_from_the_feet(axial, box)
    for view in (front, axial):
        image = views.show_slice(cut, view, "HU", *HOUNSFIELD)
    image.SetScalarBarVisibility(axial, True)
    views.legend(axial, "HU", "CT (HU)", 0)
    ring = simple.Show(rim, axial, "GeometryRepresentation")
    views.plain(ring, views.WALL)
    ring.LineWidth = 2.5
    views.note_phase((front, axial), cut)  # of the source it would be the whole image
    views.note(front, "Phantom 1: the true lumen, and its CT", "What is shown")
    for _ in views.frames((front, axial), steps):
        pass
    return finish({"phantom": source, "slice": cut, "rim": rim}, layout, (front, axial), source)


def overlay_review(size=None):
    """A model over the truth, and its distance: two phantoms, one of which has less lateral waves."""
    views.require_plugin()
    import compare_series
    truth = simple.CoronaryPhantom(registrationName="Truth", Seed=1, SurfaceSpacing=0.6)
    model = simple.CoronaryPhantom(registrationName="Model (less tortuous)", Seed=1, SurfaceSpacing=0.6,
                                   Tortuosity=0.7)
    start(truth, REST)
    made = compare_series.compare(simple.OutputPort(model, SURFACE), simple.OutputPort(truth, SURFACE),
                                  greatest=0.5, size=size)
    views.note(made["views"][0], "model red, truth green", "What is shown")
    made.update(model=model, truth=truth)
    return finish(made, made["layout"], made["views"], made["distance"])


def bound_mesh():
    """Tetrahedra that hang on a skeleton, of the phantom at rest."""
    # A source of its own: what moves asks the other one for other times.
    still = simple.CoronaryPhantom(registrationName="Phantom at rest", **COARSE)
    lines = simple.ReferencePhase(simple.OutputPort(still, LINES), registrationName="Centerlines at rest",
                                  Automatic=0, Time=REST)
    rest = simple.CenterlineSkeleton(lines, registrationName="Skeleton at rest", EveryStepIsABone=1)
    surface = simple.FrenetSweepSurface(lines, registrationName="Surface", MinimumEdgeLength=0.5,
                                        MaximumEdgeLength=2.0, EdgeLengthPerRadius=0.7)
    mesh = simple.TetrahedralMesher(simple.OutputPort(surface, 0), registrationName="Tetrahedra",
                                    Skeleton=rest, LeaveOutPointsOutside=1)
    weights = simple.BiharmonicSkinWeights(simple.OutputPort(mesh, 0), registrationName="Skin weights",
                                           Skeleton=rest)
    weights.UpdatePipeline(REST)
    return {"rest": rest, "surface": surface, "mesh": mesh, "weights": weights}


def wall_of(mesh):
    """The boundary of tetrahedra with smooth shading."""
    boundary = simple.ExtractSurface(mesh, registrationName="Boundary")
    return views.smooth(boundary, "Wall")


def posing(size=None):
    """A tree that is bent by a joint; the handle of the joint is in the left view, its numbers in the panel."""
    views.require_plugin()
    made = bound_mesh()
    joint, place = middle_of_the_longest_vessel(views.fetched(made["rest"]))
    pose = simple.SkeletonPose(
        made["rest"], registrationName="Skeleton Pose", MoveTheChosenJoint=1, ChosenJoint=joint,
        JointPosition=[place[0] + 9.0, place[1] - 5.0, place[2] + 3.0])
    moved = simple.SkinDeformation(made["weights"], registrationName="Posed mesh",
                                   SkeletonAtRest=made["rest"], PosedSkeleton=pose)
    made.update(pose=pose, moved=moved, wall=wall_of(moved))
    layout, front = views.new_layout("Posing", size)
    moved.UpdatePipeline(REST)
    box = list(moved.GetDataInformation(0).GetBounds())
    # Inside the wall where that has not moved.
    before = simple.Show(made["rest"], front, "GeometryRepresentation")
    views.plain(before, [0.6, 0.6, 0.6])
    before.LineWidth = 2.0
    wall = simple.Show(made["wall"], front, "GeometryRepresentation")
    views.colour_by(wall, front, "Displacement", "displacement by the pose (mm)", 0.0, 11.0)
    wall.Opacity = 0.7  # the handle is inside
    views.look_from_the_front(front, box, 1.2)
    views.note(front, "Drag the handle of the joint, Apply; grey: before", "What is shown")
    return finish(made, layout, (front,), pose)


def middle_of_the_longest_vessel(skeleton):
    """Number and place of a joint half way from an ostium to the farthest tip."""
    parents = skeleton.GetPointData().GetArray("ParentJoint")
    paths = []
    for joint in range(skeleton.GetNumberOfPoints()):
        path = [joint]
        while parents.GetTuple1(path[-1]) >= 0:
            path.append(int(parents.GetTuple1(path[-1])))
        paths.append(path)
    longest = max(paths, key=len)
    joint = longest[len(longest) // 2]
    return joint, skeleton.GetPoint(joint)


def widest_fork(skeleton):
    """The place of the widest joint with more than one daughter."""
    parents = skeleton.GetPointData().GetArray("ParentJoint")
    radii = skeleton.GetPointData().GetArray(views.RADIUS)
    mothers = [int(parents.GetTuple1(joint)) for joint in range(skeleton.GetNumberOfPoints())]
    forks = [joint for joint in set(mothers) if joint >= 0 and mothers.count(joint) > 1]
    return skeleton.GetPoint(max(forks, key=radii.GetTuple1))


def cfd_export(size=None):
    """A moving mesh of tetrahedra with named faces, cut open to show its quality."""
    views.require_plugin()
    made = bound_mesh()
    source = simple.CoronaryPhantom(registrationName="Coronary Phantom", **COARSE)
    poses = simple.CenterlineSkeleton(simple.OutputPort(source, LINES), registrationName="Skeleton in time",
                                      EveryStepIsABone=1)
    moved = simple.SkinDeformation(made["weights"], registrationName="Moving mesh",
                                   SkeletonAtRest=made["rest"], PosedSkeleton=poses)
    made.update(phantom=source, poses=poses, moved=moved, wall=wall_of(moved))
    moment = start(source, SYSTOLE)
    moved.UpdatePipeline(moment)
    box = list(moved.GetDataInformation(0).GetBounds())
    layout, front = views.new_layout("CFD export", size)
    inside, _ = views.split(layout, 0, 0.5)
    wall = simple.Show(made["wall"], front, "GeometryRepresentation")
    views.colour_by(wall, front, "Displacement", "displacement from rest (mm)", 0.0, 20.0)
    views.look_from_the_front(front, box, 1.1)
    posed = simple.ReferencePhase(poses, Automatic=0, Time=moment)
    fork = widest_fork(views.fetched(posed))
    simple.Delete(posed)
    cut = simple.Clip(moved, registrationName="Cut open", ClipType="Plane", Crinkleclip=1)
    cut.ClipType.Origin = fork
    cut.ClipType.Normal = [0.0, 1.0, 0.0]
    cut.Invert = 0
    made["cut"] = cut
    shown = simple.Show(cut, inside, "UnstructuredGridRepresentation")
    shown.SetRepresentationType("Surface With Edges")
    views.colour_by(shown, inside, "MinimumDihedralAngle", "least dihedral angle at rest (rad)", 0.0, 1.23,
                    "Viridis (matplotlib)", "CELLS")
    views.look_from_the_front(inside, [side for place in fork for side in (place - 13.0, place + 13.0)])
    views.note_phase((front, inside), source)
    views.note(front, "File > Save Data: mesh sequence", "What to do")
    return finish(made, layout, (front, inside), moved)
