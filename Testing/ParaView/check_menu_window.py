"""Runs inside the ParaView window, called by the play-back: what the state and the menu's examples show."""
import os
import sys

from paraview import simple

sys.path.insert(0, os.environ["DYNAMICCORONARY_TEST_SCRIPTS"])
from coronary_testing import require
from window_testing import checker, photograph, picture

# Views with something in it, and what moves or was moved: source, array.
EXPECTED = {
    "phantom": (2, None),
    "overlay_review": (2, ("Distance", "SurfaceDistance")),
    "posing": (1, ("Wall", "Displacement")),
    "cfd_export": (2, ("Wall", "Displacement")),
}


def look(step):
    count, moved = EXPECTED[step]
    views = [view for view in simple.GetRenderViews() if any(
        getattr(shown, "Visibility", 0) for shown in view.Representations)]
    require(len(views) == count, "%d views show something, not %d" % (len(views), count))
    for number, view in enumerate(views):
        picture("menu_%s_%d" % (step, number), view, 0.02)
    if moved:
        array = simple.FindSource(moved[0]).PointData[moved[1]]
        require(array.GetRange(-1)[1] > 0.5 if array.GetNumberOfComponents() > 1
                else array.GetRange()[1] > 0.1, "%s of %s is %s" % (*moved[::-1], array.GetRange()))
    photograph(step)


def clear():
    simple.ResetSession()


check = checker(look)
