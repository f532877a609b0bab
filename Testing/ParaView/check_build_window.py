"""Runs inside the ParaView window, called by the play-back: Build from 4D CT shows its stages while the window lives, is cancelled, goes
on, plays; a fault is one message."""
import json
import os
import subprocess
import sys
import time

from paraview import simple

sys.path.insert(0, os.environ["DYNAMICCORONARY_TEST_SCRIPTS"])
from coronary_testing import require
from window_testing import FOLDER, Player, checker, live, photograph, picture

RUN = os.path.join(FOLDER, "run")
# Coarse, and from a seed: quick.
OPTIONS = "--edges 0.5 2.0 --seed 4.2 -3.6 -1.9 --least-branch 20"
# Longest time for which the window did not answer while the program worked, s: it opens what stages made.
PATIENCE = 15.0

seen = {}


def make():
    series = os.path.join(FOLDER, "series")
    subprocess.run([os.environ["DYNAMICCORONARY_PIPELINE"], "phantom", "--fractions=0,0.2,0.4,0.6,0.8", "--spacing", "1.2", "--no-truth",
                    "--quiet", "--output", series], check=True, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    simple.SetActiveSource(simple.GatedImageReader(registrationName="Series", FileNames=[os.path.join(series, "series.json")]))


def programs():
    """Children of this process that are coronary-pipeline."""
    found = []
    for number in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open("/proc/%s/stat" % number, encoding="utf-8") as file:
                name, rest = file.read().split("(", 1)[1].rsplit(")", 1)
        except OSError:
            continue
        if name.startswith("coronary-pipel") and rest.split()[1] == str(os.getpid()) and rest.split()[0] != "Z":
            found.append(number)
    return found


def watch():
    seen["player"] = Player(3)


def files():
    """Of the run's folder; and of those the ones that its report names."""
    there = {os.path.relpath(os.path.join(path, name), RUN) for path, _, names in os.walk(RUN) for name in names}
    with open(os.path.join(RUN, "report.json"), encoding="utf-8") as file:
        text = file.read()
    return there, {name for name in there if json.dumps(name)[1:-1] in text or name == "report.json"}


def look(step):
    if step == "stages":
        begun = time.monotonic()
        longest, turns = live(300.0, lambda: simple.FindSource("Named trees"))
        seconds = time.monotonic() - begun
        os.write(1, ("%d turns of the window in %.1f s, the longest %.2f s\n" % (turns, seconds, longest)).encode())
        require(simple.FindSource("Named trees") and simple.FindSource("Ostia"), "no stage has appeared")
        require(turns > 4 * seconds and longest < PATIENCE, "the window did not live")
        require(programs(), "the program has ended, so nothing can be cancelled")
        picture("build_stages", simple.GetActiveView(), 0.002)
    elif step == "cancelled":
        live(30.0, lambda: not programs())
        live(0.5)
        require(not programs(), "the program goes on")
        there, told = files()
        require(there == told and "centerline.vtp" in there, "half a file? there are %s, the report names %s" % (there, told))
        require(not simple.FindSource("Wall"), "there is a wall")
    elif step == "built":
        live(300.0, lambda: simple.FindSource("Wall in the slice"))
        live(600.0, lambda: not list(filter(None, [view.UseCache for view in simple.GetRenderViews()])))
        for name in ("Named trees", "Surface", "Beating surface", "Moving mesh", "Wall"):
            require(simple.FindSource(name), "there is no %s" % name)
        require(len([name for name, _ in simple.GetSources() if name == "Named trees"]) == 1, "trees twice")
        require(simple.GetAnimationScene().Loop == 1, "no loop")
        picture("build_model", simple.GetActiveView(), 0.005)
    elif step == "played":
        seen["player"].require_played(20, 0.5)
    elif step == "fault":
        require(not programs(), "a program runs")
    photograph(step)


# How the window lives from the start on is looked at.
check = checker(look, settle=0.0)
