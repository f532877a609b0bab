"""Runs inside the ParaView window, called by the play-back: the phantom plays, at once and in a loop, and a click on play that comes
while a frame is computed does not end ParaView."""
import os
import sys

import coronary_views
from paraview import simple

sys.path.insert(0, os.environ["DYNAMICCORONARY_TEST_SCRIPTS"])
from coronary_testing import require
from window_testing import Desktop, Player, checker, live, photograph

# The button in the window's toolbar, pixels of the screen; with Qt 6 the bars are a little narrower.
PLAY = (577, 38) if coronary_views.is_paraview(5, 13) else (593, 42)

seen = {}


def watch(laps):
    seen["player"] = Player(laps)


def click_while_first_frame():
    """The mouse clicks on play when ParaView is within the tick of |<, as it does when that takes long."""
    desktop = Desktop()
    seen["clicks"] = 0

    def click(*_):
        if not seen["clicks"]:
            seen["clicks"] += 1
            desktop.click(*PLAY)

    # Before all others, of ParaView and the plugin.
    seen["scene"] = simple.GetAnimationScene().SMProxy.GetClientSideObject()
    seen["observer"] = seen["scene"].AddObserver("AnimationCueTickEvent", click, 100.0)


def look(step):
    if step == "played":
        seen["player"].require_played(20, 0.5)
    elif step == "clicked":
        live(60.0, lambda: seen["player"].ended)
        seen["scene"].RemoveObserver(seen["observer"])
        require(seen["clicks"] == 1, "%d clicks" % seen["clicks"])
        seen["player"].require_played(20, 0.5)
    photograph(step)


check = checker(look)
