"""Skeleton, weights, pose and moved mesh as a user sets them up: state, trace, picture, undo of moves."""
import os
import sys

from paraview import servermanager, simple, smstate, smtrace

from coronary_testing import (content, fetch, load_plugin, require, require_picture,
                              skinning_pipeline, write_skeleton)

plugin, folder = sys.argv[1:3]
TIME = 0.0


def cells(data):
    """Cell data too: what a pose adds to its bones, and the mesh to its tetrahedra."""
    attributes = data.GetCellData()
    arrays = {}
    for index in range(attributes.GetNumberOfArrays()):
        array = attributes.GetArray(index)
        if array:
            arrays[array.GetName()] = bytes(memoryview(array))
    return arrays


def everything():
    found = []
    for name in ("Skeleton", "Weights", "Pose", "Moved"):
        source = simple.FindSource(name)
        require(source is not None, "there is no " + name)
        data = fetch(source, 0, TIME)
        require(data.GetNumberOfPoints() > 5, name + " is empty")
        found.append((name, content(data), cells(data)))
    return found


def check(expected, where):
    weights, pose, moved = (simple.FindSource(name) for name in ("Weights", "Pose", "Moved"))
    for one, two in zip(expected, everything()):
        require(one == two, "%s: other %s" % (where, one[0]))
    require((weights.Influences, weights.AllWeights, weights.Neighbourhood) == (4, 1, 2.0),
            where + ": settings of the weights")
    require(len(pose.Edits) == 20 and pose.MovesWithIt == "The Bone Turns", where + ": the edits")
    require((pose.MoveTheChosenJoint, pose.ChosenJoint) == (1, 4), where + ": the chosen joint")
    require(moved.Blend == "Dual Quaternion" and moved.VolumeConservation == 0.5 and
            moved.InvertedTetrahedra == "Report", where + ": settings of the deformation")


def outputs(skeleton_file):
    weights, pose, moved = skinning_pipeline(skeleton_file)
    rest, data = fetch(weights, 0, TIME), fetch(moved, 0, TIME)
    require(rest.GetNumberOfPoints() == 7 * 7 * 23, "%d points" % rest.GetNumberOfPoints())
    require(rest.GetPointData().GetArray("BoneIndices").GetNumberOfComponents() == 4, "bones")
    require(rest.GetPointData().GetArray("BoneWeights").GetNumberOfComponents() == 5, "dense")
    require(rest.GetFieldData().GetArray("WeightsConverged").GetValue(0) == 1, "not converged")
    displacement = data.GetPointData().GetArray("Displacement")
    require(displacement.GetMaxNorm() > 3.0, "nothing moves")
    require(data.GetCellData().GetArray("VolumeRatio") is not None, "tetrahedra are not checked")

    # Where the handle begins: at the joints, before the chosen one is moved.
    pose.UpdatePropertyInformation()
    joints = pose.GetProperty("JointPlaces")
    require(joints.GetNumberOfElements() == 18, "%d places" % joints.GetNumberOfElements())
    # The move as an edit gives the same pose.
    edit = pose.GetProperty("MoveAsEdit")
    row = [edit.GetElement(n) for n in range(edit.GetNumberOfElements())]
    require(len(row) == 10 and row[0] == 4, "the move as an edit: %s" % row)
    before = fetch(pose, 0, TIME)
    pose.Edits = list(pose.Edits) + row
    pose.MoveTheChosenJoint = 0
    after = fetch(pose, 0, TIME)
    for joint in range(6):
        step = max(abs(a - b) for a, b in zip(before.GetPoint(joint), after.GetPoint(joint)))
        require(step < 1e-9, "joint %d is %g mm away" % (joint, step))

    view = simple.CreateRenderView()
    view.ViewSize = [600, 700]
    for source, color in ((weights, [0.7, 0.7, 0.7]), (moved, [0.8, 0.2, 0.2])):
        shown = simple.Show(source, view)
        shown.SetRepresentationType("Surface With Edges")
        simple.ColorBy(shown, None)
        shown.DiffuseColor = color
        shown.Opacity = 0.5
    simple.Show(pose, view).LineWidth = 4.0
    view.CameraPosition = [10, -70, 10]
    view.CameraFocalPoint = [0, 0, 0]
    view.CameraViewUp = [0, 0, 1]
    path = os.path.join(folder, "skinning.png")
    simple.SaveScreenshot(path, view)
    require_picture(path)


def round_trips(skeleton_file):
    simple.ResetSession()
    moved = skinning_pipeline(skeleton_file)[2]
    view = simple.CreateRenderView()
    simple.Show(moved, view)
    expected = everything()
    state = os.path.join(folder, "skinning.pvsm")
    simple.SaveState(state)
    script = smstate.get_state()

    simple.ResetSession()
    simple.LoadState(state)
    check(expected, "state file")
    simple.ResetSession()
    exec(compile(script, "state", "exec"), {"__name__": "state"})
    check(expected, "Python state")


def trace_repeats(skeleton_file):
    simple.ResetSession()
    smtrace.start_trace(preamble="")
    skinning_pipeline(skeleton_file)
    trace = smtrace.stop_trace()
    expected = everything()
    simple.ResetSession()
    exec(compile(trace, "trace", "exec"), {"__name__": "trace"})
    check(expected, "trace")


load_plugin(plugin)
path = write_skeleton(folder)
# First: a trace started after pictures were saved stays empty.
trace_repeats(path)
simple.ResetSession()
outputs(path)
round_trips(path)
require(servermanager.ActiveConnection is not None, "the session is gone")
