"""The macro that builds the whole pipeline gives what `coronary-pipeline run` gives; what it makes is shown; its errors."""
import json
import os
import subprocess
import sys

from paraview import simple

from coronary_testing import content, fetch, load_plugin, require, require_picture

plugin, folder, pipeline = sys.argv[1:4]
# In the left main artery at the phase that is the quietest of the three.
SEED = [4.2, -3.6, -1.9]
LEAST_BRANCH = 20.0
EDGES = [0.5, 2.0]


def program(*arguments):
    subprocess.run([pipeline, *arguments, "--quiet"], check=True, stderr=subprocess.DEVNULL)


def make_run():
    """A small series, and what `run` makes of it: series.json and the folder."""
    series, result = os.path.join(folder, "series"), os.path.join(folder, "result")
    program("phantom", "--fractions=0,0.35,0.75", "--spacing", "1.2", "--no-truth", "--output", series)
    run_it(result, "--motion", "tracked")
    return os.path.join(series, "series.json"), result


def run_it(result, *motion):
    program("run", os.path.join(folder, "series", "series.json"), "--output", result, "--resume", "--edges", *map(str, EDGES),
            "--seed", *map(str, SEED), "--least-branch", str(LEAST_BRANCH), *motion)


def require_same(source, path, time):
    data = content(fetch(source, 0, time))["points"]
    file = content(fetch(simple.OpenDataFile(path), 0, 0.0))["points"]
    require(len(data) > 100 and data == file, "%s differs at %s" % (os.path.basename(path), time))


def require_the_run(made, result):
    with open(os.path.join(result, "report.json")) as file:
        report = json.load(file)
    reference = fetch(made["reference"], 0, 0.0).GetFieldData().GetArray("PhaseTime").GetTuple1(0)
    require(reference == report["time"], "the reference phase is %g" % reference)
    require_same(made["tree"], os.path.join(result, "centerline.vtp"), 0.0)
    require_same(made["surface"], os.path.join(result, "surface.vtp"), 0.0)
    require_same(made["mesh"], os.path.join(result, "volume.vtu"), 0.0)
    for number, time in enumerate(report["motion"]["times"]):
        require_same(made["lines"], os.path.join(result, "motion", "centerline_%02d.vtp" % number), time)
        require_same(made["moved"], os.path.join(result, "motion", "volume_%02d.vtu" % number), time)


def require_named():
    names = [name for name, _ in simple.GetSources()]
    for name in ("1 Reference phase", "5 Named trees", "9 Skin weights", "14 Wall"):
        require(name in names, "there is no %s in %s" % (name, names))


def require_shown(made):
    times = list(simple.GetAnimationScene().TimeKeeper.TimestepValues)
    require(set(made["source"].TimestepValues) <= set(times) and
            set(made["lines"].TimestepValues) <= set(times), "the animation has the times %s" % times)
    for number, view in enumerate(made["views"]):
        picture = os.path.join(folder, "view_%d.png" % number)
        simple.SaveScreenshot(picture, view)
        require_picture(picture, 0.02)


def require_names_apart(made):
    """Of the main vessels, from the front, in a view of 300 pixels: at the first time step."""
    view = made["views"][2]
    millimetres = 2.0 * view.CameraParallelScale / 300.0
    places = {name: place for name, (_, place) in made["names"].items()}
    require({"LAD", "LCx"} <= {name[1:] for name in places}, "the names are %s" % sorted(places))
    main = [name for name in places if name[1:] in ("LAD", "LCx", "RCA")]
    for n, one in enumerate(main):
        for other in main[:n]:
            across, _, up = (abs(a - b) / millimetres for a, b in zip(places[one], places[other]))
            require(across > 36.0 or up > 14.0, "%s lies on %s: %.0f and %.0f pixels" % (one, other, across, up))


def fails(work, words):
    try:
        work()
    except RuntimeError as error:
        require(words in str(error), "the error says: %s" % error)
    else:
        require(False, "no error about " + words)


load_plugin(plugin)
import build_from_4d_ct as macro  # out of the plugin

require("Plugin/macros" not in getattr(macro, "__file__", ""), "the module is not the plugin's")
series, result = make_run()
wrong = simple.Sphere()
fails(macro.selected_series, "Select the image series")
simple.Delete(wrong)
source = simple.OpenDataFile(series)
simple.SetActiveSource(None)
require(macro.selected_series() == source, "the only series is not taken")
made = macro.build(source, seed=SEED, least_branch=LEAST_BRANCH, edges=EDGES, motion="tracked", size=(1000, 600))
require_the_run(made, result)
require_shown(made)
require_names_apart(made)
require_named()
fails(lambda: macro.require_vessels(made["tree"], 0.1), "more than twice the largest one")
fails(lambda: macro.build(source, motion="some"), "motion is 'some'")
# Three phases are too few: a population's motion, bent to them.
run_it(result)
made = macro.build(source, seed=SEED, least_branch=LEAST_BRANCH, edges=EDGES, show=False)
require_the_run(made, result)
simple.ResetSession()
opened = macro.open_result(result, series, size=(1000, 600))
require("motion not of this patient" in simple.FindSource("Motion").Text, "the view does not say whose motion it is")
require_shown(opened)
fails(lambda: macro.open_result(folder, series), "centerline.vtp' is missing")
print("done")
