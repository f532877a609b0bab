"""Runs inside the ParaView window, called by the play-back: a joint is chosen, dragged, kept, undone."""
import os
import sys

from paraview import simple

sys.path.insert(0, os.environ["DYNAMICCORONARY_TEST_SCRIPTS"])
from coronary_testing import content, fetch, require, require_different_pictures, skinning_pipeline, write_skeleton
from window_testing import FOLDER, checker, near, photograph, picture

# The chosen joint at rest, in the middle of the view; half the height of what the view shows, mm; the
# share of the view's width by which the handle is dragged.
JOINT = (0.0, 0.0, 10.0)
SCALE = 20.0
DRAG = 0.08


def make():
    pose, moved = skinning_pipeline(write_skeleton(FOLDER), ChosenJoint=0)[1:]
    moved.InvertedTetrahedra = "Repair"
    view = simple.GetActiveViewOrCreate("RenderView")
    shown = simple.Show(moved, view)
    shown.SetRepresentationType("Wireframe")
    simple.Show(pose, view).LineWidth = 4.0
    simple.SetActiveSource(pose)
    simple.Render(view)


def aim(joint=4):
    """A joint into the middle of the view. Later: the first picture resets the camera."""
    view = simple.GetActiveView()
    place = joints_and_mesh()[0][joint]
    view.CameraParallelProjection = 1
    view.CameraParallelScale = SCALE
    view.CameraFocalPoint = place
    view.CameraPosition = [place[0], place[1] - 100.0, place[2]]
    view.CameraViewUp = [0.0, 0.0, 1.0]
    simple.Render(view)


def joints_and_mesh():
    pose = fetch(simple.FindSource("Pose"), 0, 0.0)
    moved = fetch(simple.FindSource("Moved"), 0, 0.0)
    largest = moved.GetPointData().GetArray("Displacement").GetMaxNorm()
    return [pose.GetPoint(n) for n in range(6)], largest, content(moved)["points"]


seen = {}


def dragged(view):
    """Millimetres that the play-back drags the handle to the right."""
    width, height = view.ViewSize
    return DRAG * 2.0 * SCALE * width / height


def look(step):
    pose = simple.FindSource("Pose")
    view = simple.GetActiveView()
    joints, largest, points = joints_and_mesh()
    edits = list(pose.Edits)
    state = "edits %s, move %s of joint %d to %s; joints %s; the mesh moves by %g" % (
        edits, pose.MoveTheChosenJoint, pose.ChosenJoint, list(pose.JointPosition), joints, largest)
    os.write(1, (step + ": " + state + "\n").encode())
    if step == "chosen":
        require(pose.ChosenJoint == 4 and not pose.MoveTheChosenJoint, state)
        # The handle went to the joint by itself.
        require(near(pose.JointPosition, JOINT, 1e-9), "the handle is elsewhere: " + state)
        require(largest < 1e-5, state)
    elif step == "dragged":
        require(pose.MoveTheChosenJoint == 1, "dragging moves nothing: " + state)
        moved = [a - b for a, b in zip(pose.JointPosition, JOINT)]
        require(abs(moved[0] - dragged(view)) < 0.5 and near(moved[1:], (0, 0), 0.5), state)
        require(near(joints[4], pose.JointPosition, 1e-9) and largest > 4.0, state)
        require(near(joints[3], (0, 0, 5), 1e-9), "another joint has moved: " + state)
    elif step == "kept":
        require(len(edits) == 10 and edits[0] == 4 and not pose.MoveTheChosenJoint, state)
        require(abs(edits[5] - dragged(view)) < 0.5, state)
    elif step == "unkept":
        require(not edits and pose.MoveTheChosenJoint == 1, state)
    elif step == "undragged":
        require(not edits and not pose.MoveTheChosenJoint and largest < 1e-5, state)
    elif step == "bent":
        # The other bone turns with its handle, and keeps its length.
        require(pose.ChosenJoint == 5 and pose.MoveTheChosenJoint == 1 and
                pose.MovesWithIt == "The Bone Turns", state)
        before = seen["kept"][0]
        require(not near(joints[5], before[5], 1.0), "the bone did not turn: " + state)
        lengths = [sum((a - b) ** 2 for a, b in zip(one[5], one[3])) for one in (joints, before)]
        require(abs(lengths[0] - lengths[1]) < 1e-6, "the bone's length: " + state)
    elif step == "reset":
        require(not pose.MoveTheChosenJoint and points == seen["kept"][2], state)
    other = {"kept": "dragged", "unkept": "dragged", "undragged": "chosen"}.get(step)
    if other:
        require(all(near(a, b, 1e-9) for a, b in zip(joints, seen[other][0])),
                "the joints are not those when " + other + ": " + state)
    seen[step] = (joints, largest, points)
    shown = picture("pose_" + step, view, 0.005)
    if step == "dragged":
        require_different_pictures(os.path.join(FOLDER, "pose_chosen.png"), shown, 0.002)


check = checker(look)
