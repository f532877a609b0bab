"""A run with a lost vessel is corrected by hand, as a user does. Usage: TestEditing.py PROGRAM [--keep DIR]

An occlusion hides an artery of the phantom from its mouth on, and what lies behind it fills so late that the run does not
find it. It is drawn by five clicks, each a little beside the axis, and held against the truth before and after; then all
other edits, their undoing to the bit, and what is said of those that can not be applied.
"""
import hashlib
import json
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time

from vtp_reader import read_vtp

PROGRAM = os.path.abspath(sys.argv[1])
KEEP = os.path.abspath(sys.argv[3]) if sys.argv[2:3] == ["--keep"] else None
NEAR = 1.5        # mm to a true point that is found
CLICK = 0.7       # mm that a click is beside the axis
CLICKS = 5
LOST = {"name": "OM1", "id": 12}
STAGE = ["mask.mha", "ostia.vtp", "centerline.vtp", "bifurcations.vtp", "centerline_lines.vtp", "lesions.csv", "status.csv"]
failures = []


def check(condition, text):
    """Notes what does not hold."""
    if not condition:
        failures.append(text)
        print("FAILED:", text)


def run(*arguments, code=0, says=(), cwd=None):
    """Runs the program; a failure has to be one line with all of `says` in it, beside warnings."""
    done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=600, check=False, cwd=cwd)
    check(done.returncode == code, f"{arguments}: exit code {done.returncode}: {done.stderr}")
    if code:
        errors = [line for line in done.stderr.splitlines() if not line.startswith("Warning: ")]
        check(len(errors) == 1 and all(part in errors[0] for part in says), f"not {says}: {done.stderr}")
    return done.stdout


def edit(*arguments, **expected):
    """From another folder than the run was made in, whose input was given by a relative path."""
    return run("edit", os.path.abspath("run"), *arguments, "--quiet", cwd="/", **expected)


def text(point):
    return ",".join(f"{value:.4f}" for value in point)


def course(path, segment):
    """Points of a segment of a tree, from its beginning on, and all points."""
    arrays, cells = read_vtp(path)
    points, ids = arrays["Points"], arrays["SegmentIds"]
    own = [cell for cell in cells if sum(ids[p] == segment for p in cell) > len(cell) / 2]
    return ([points[p] for p in max(own, key=len)] if own else []), points


def found(truth, points):
    """Share of the true points with a point of the model near."""
    return sum(min(math.dist(place, point) for point in points) <= NEAR for place in truth) / len(truth)


def digest(names=STAGE):
    """Of files of the run."""
    return {name: hashlib.sha256(open(f"run/{name}", "rb").read()).hexdigest() if os.path.exists(f"run/{name}") else None
            for name in names}


def report():
    with open("run/report.json", encoding="utf-8") as file:
        return json.load(file)


def segments():
    """Lengths of the run's segments by id, by points."""
    arrays, _ = read_vtp("run/centerline.vtp")
    return {segment: arrays["SegmentIds"].count(segment) for segment in set(arrays["SegmentIds"])}


def repair():
    """The scripted case: the lost vessel is drawn, and measured."""
    with open("lost.json", "w", encoding="utf-8") as file:
        json.dump({"lesions": [{"kind": "occlusion", "vessel": LOST["name"], "fraction": 0.22, "length_mm": 14,
                                "fill": 0.45}]}, file)
    run("phantom", "--seed", "7", "--fractions", "0.75", "--spacing", "0.5", "--disease", "lost.json", "--quiet",
        "--output", "phantom")
    run("run", "phantom/series.json", "--until", "centerline", "--edges", "0.8", "1.6", "--quiet",
        "--output", "run")
    lost, truth = course("phantom/truth/centerline_00.vtp", LOST["id"])
    before = read_vtp("run/centerline.vtp")[0]["Points"]
    draw = random.Random(1)
    clicks = []
    for k in range(CLICKS):
        at = lost[round((len(lost) - 1) * (0.02 + 0.96 * k / (CLICKS - 1)))]
        way = [draw.gauss(0.0, 1.0) for _ in range(3)]
        size = math.hypot(*way)
        clicks.append([a + CLICK * w / size for a, w in zip(at, way)])
    start = time.monotonic()
    edit("add-branch", "--points", *map(text, clicks), "--name", LOST["name"])
    seconds = time.monotonic() - start
    arrays = read_vtp("run/centerline.vtp")[0]
    after = arrays["Points"]
    numbers = {"lost vessel, before": found(lost, before), "lost vessel, after": found(lost, after),
               "whole tree, before": found(truth, before), "whole tree, after": found(truth, after)}
    drawn = [point for point, number in zip(after, arrays["EditNumber"]) if number == 1]
    away = [min(math.dist(point, place) for place in truth) for point in drawn]
    print(f"{CLICKS} clicks {CLICK} mm beside the axis, {seconds:.1f} s until the new centerline; "
          + ", ".join(f"{name} {100 * share:.0f} %" for name, share in numbers.items())
          + f"; drawn points {sum(away) / len(away):.2f} mm from the true axis in the mean, {max(away):.2f} mm at most")
    check(numbers["lost vessel, before"] < 0.4, "the vessel was not lost")
    check(numbers["lost vessel, after"] > 0.95, "the vessel was not drawn")
    check(numbers["whole tree, after"] >= numbers["whole tree, before"], "the tree is worse than before")
    check(sum(away) / len(away) < 0.6, "what was drawn is beside the vessel")
    told = report()
    check(told["edits"] == json.load(open("run/edits.json", encoding="utf-8"))["edits"], "the report has other edits")
    note = told["centerline"]["edits"][0]
    check(note["number"] == 1 and LOST["name"] in note["what"] and 0 < note["seen"] <= 1, f"note {note}")
    check(any(b == 1 for b, n in zip(arrays["Bridged"], arrays["EditNumber"]) if n == 1), "nothing is told as unseen")
    return lost, clicks


def write_edits(edits):
    with open("run/edits.json", "w", encoding="utf-8") as file:
        json.dump({"format": "coronary edits", "version": 1, "edits": edits}, file)


def undo(lost, first):
    """Other edits, by command and by file, and back again: to the bit."""
    states = [digest()]
    check(edit("list").count("\n") == 1, "one edit in the list")
    lad = course("run/centerline.vtp", 7)[0]
    middle = lad[len(lad) // 2]
    edit("move", "--points", text(middle), text([middle[0], middle[1], middle[2] + 1.0]), "--reach", "8")
    states.append(digest())
    edit("paint", "--points", text([middle[0], middle[1] + 2.0, middle[2]]), "--radius", "1.2")
    states.append(digest())
    check(len({state["centerline.vtp"] for state in states}) == 3, "an edit changed nothing")
    with open("run/edits.json", encoding="utf-8") as file:
        edits = json.load(file)["edits"]
    write_edits(edits + [{"edit": "erase", "points": [lad[-5]], "radius": 1.5},
                         {"edit": "cut", "points": [lost[len(lost) // 2]]},
                         {"edit": "rename", "name": LOST["name"], "new_name": "OM3"}, {"edit": "delete", "name": "D1"}])
    before = segments()
    edit("apply")
    after = segments()
    check(9 in before and 9 not in after and LOST["id"] not in after, "what was deleted or renamed is there")
    check(after[21] < before.get(21, 0) + 0.8 * before[LOST["id"]], "nothing was cut")
    check(os.path.exists("run/edited_mask.mha"), "no edited mask")
    check(digest(["mask.mha", "vesselness.mha"]) == first, "stages before were made anew")
    check([note["number"] for note in report()["centerline"]["edits"]] == list(range(1, 8)), "an edit is not told")
    lines = edit("list").splitlines()
    check(len(lines) == 7 and lines[2].startswith("3  paint (") and lines[5] == f"6  rename {LOST['name']} to OM3",
          f"list: {lines}")
    edit("undo")
    check(segments().get(9, 0) > 0.9 * before[9], "a deleted vessel did not come back")
    write_edits(edits)
    edit("apply")
    check(digest() == states[2], "the same edits, but another result")
    for state in (states[1], states[0]):
        edit("undo")
        check(digest() == state, "undone, but not as before")
    check(not os.path.exists("run/edited_mask.mha"), "an edited mask is left")


def refuse(lost):
    """What can not be done says so with the place, and changes nothing."""
    names = STAGE + ["edits.json", "report.json"]
    before = digest(names)
    edit("cut", "--points", "1000,0,0", code=1, says=("dit 2 (cut)", "(1000.0, 0.0, 0.0)", "no vessel of the tree"))
    edit("delete", "--name", "L-PDA", code=1, says=("dit 2 (delete)", "no L-PDA", "pLAD"))
    edit("delete", "--name", "R-PLB9", code=2, says=("'R-PLB9' is no SCCT name",))
    edit("join", "--points", text(lost[0]), code=2, says=("2 points, not 1",))
    edit("cut", "--points", "1,2", code=2, says=("--points: '1,2'",))
    edit("paint", "--points", "1,2,3", code=2, says=("radius",))
    edit("list", "--name", "OM1", code=2, says=("list has no use for --name",))
    edit("glue", code=2, says=("glue",))
    run("edit", "nowhere", "list", code=1, says=("nowhere/report.json",))
    check(digest(names) == before, "a refused edit changed something")
    with open("run/edits.json", encoding="utf-8") as file:
        good = file.read()
    with open("run/edits.json", "w", encoding="utf-8") as file:
        file.write(good.replace('"name"', '"nome"'))
    edit("apply", code=1, says=("run/edits.json", "'nome'"))
    with open("run/edits.json", "w", encoding="utf-8") as file:
        file.write(good)


def main():
    lost, clicks = repair()
    first = digest(["mask.mha", "vesselness.mha"])
    drawn = digest()
    undo(lost, first)
    refuse(lost)
    # A run in this folder knows them.
    run("run", "phantom/series.json", "--until", "centerline", "--edges", "0.8", "1.6", "--quiet",
        "--resume", "--output", "run")
    check(digest() == drawn, "a resumed run lost the edits")
    # From markups of 3D Slicer, beside what the first edit drew: it is there already.
    with open("clicks.mrk.json", "w", encoding="utf-8") as file:
        json.dump({"markups": [{"type": "Fiducial", "coordinateSystem": "LPS",
                                "controlPoints": [{"position": click} for click in clicks]}]}, file)
    edit("add-branch", "--points-file", os.path.abspath("clicks.mrk.json"), code=1, says=("already",))
    # All that comes behind.
    edit("apply", "--until", "surface")
    check(report()["surface"]["triangles"] > 3000 and report()["stages"][-1]["name"] == "surface", "no surface")
    edit("undo", "--until", "centerline")
    check(not os.path.exists("run/edits.json") and not os.path.exists("run/surface.vtp"), "an empty list or an old surface is left")
    edit("undo", code=1, says=("no edit to undo",))


if __name__ == "__main__":
    folder = tempfile.mkdtemp(prefix="coronary-editing-test.")
    os.chdir(folder)
    try:
        main()
    finally:
        os.chdir("/")
        if KEEP:
            shutil.copytree(folder, KEEP, dirs_exist_ok=True)
        shutil.rmtree(folder)
    sys.exit(1 if failures else 0)
