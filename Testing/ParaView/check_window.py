"""Runs inside the ParaView window, called by the play-back: looks at what the user would see."""
import os
import sys

from paraview import simple

sys.path.insert(0, os.environ["DYNAMICCORONARY_TEST_SCRIPTS"])
from coronary_testing import IMAGE, SURFACE, require, require_different_pictures, show_phantom
from window_testing import FOLDER, checker, photograph, picture


def shown_ports(phantom, view):
    return [rep.Input.Port for rep in view.Representations
            if getattr(rep, "Input", None) is not None and rep.Input.SMProxy == phantom.SMProxy
            and rep.Visibility]


def look(step):
    phantom = simple.GetActiveSource()
    view = simple.GetActiveView()
    scene = simple.GetAnimationScene()
    require(phantom is not None and phantom.GetXMLName() == "CoronaryPhantomSource",
            "the menu did not create the phantom")
    if step == "applied":
        require(shown_ports(phantom, view) == [SURFACE], "Apply shows the ports %s"
                % shown_ports(phantom, view))
        require(len(scene.TimeKeeper.TimestepValues) == 20, "the time slider's steps")
    elif step == "all":
        show_phantom(phantom, view)
        simple.Render(view)
        require(sorted(shown_ports(phantom, view))[0] == IMAGE, "the image is not shown")
    else:
        require(view.ViewTime == scene.TimeKeeper.TimestepValues[int(step)],
                "the time is %g" % view.ViewTime)
    picture("window_" + step, view, 0.005)
    if step == "19":
        require_different_pictures(os.path.join(FOLDER, "window_all.png"),
                                   os.path.join(FOLDER, "window_7.png"))


check = checker(look)
