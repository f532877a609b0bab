"""Skeleton, weights, pose and moved mesh as a user sets them up: state, trace, picture, undo of moves."""
import os
import sys

from paraview import servermanager, simple

from coronary_testing import (content, fetch, find, load_plugin, require, require_picture,
                              require_states_restore, require_trace_repeats, skinning_pipeline,
                              write_skeleton)

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
    weights, pose, moved = find("Weights"), find("Pose"), find("Moved")
    require((weights.Influences, weights.AllWeights, weights.Neighbourhood) == (4, 1, 2.0),
            "settings of the weights")
    require(len(pose.Edits) == 20 and pose.MovesWithIt == "The Bone Turns", "the edits")
    require((pose.MoveTheChosenJoint, pose.ChosenJoint) == (1, 4), "the chosen joint")
    require(moved.Blend == "Dual Quaternion" and moved.VolumeConservation == 0.5 and
            moved.InvertedTetrahedra == "Report", "settings of the deformation")
    found = []
    for name in ("Skeleton", "Weights", "Pose", "Moved"):
        data = fetch(find(name), 0, TIME)
        require(data.GetNumberOfPoints() > 5, name + " is empty")
        found.append((name, content(data), cells(data)))
    return found


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
    require_states_restore(everything, os.path.join(folder, "skinning.pvsm"))


load_plugin(plugin)
path = write_skeleton(folder)
require_trace_repeats(lambda: skinning_pipeline(path), everything)
simple.ResetSession()
outputs(path)
round_trips(path)
require(servermanager.ActiveConnection is not None, "the session is gone")
