#!/usr/bin/env python3
"""Motion by B-spline registration (elastix) beside ours, on the same images of phantoms, against their truth.

elastix registers the reference phase of each series to every other one, with one published kind of parameters for all
(Testing/Validation/peers/cardiac-ct-bspline.txt); its displacement carries our model and the true one from the reference
phase to the others. `coronary-pipeline evaluate` measures all models. Tables in Markdown on standard output.
ITK's objectness and connected threshold, from the true ostia, are measured beside our model of the reference phase.
Finished parts are kept under --output: started again, it goes on where it was.
"""
import argparse
import json
import os
import shutil
import subprocess
import sys

import kept_results
from kept_results import Failed, digest, kept

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PEERS = os.path.join(ROOT, "Testing", "Validation", "peers")
PARAMETERS = os.path.join(PEERS, "cardiac-ct-bspline.txt")
SIX = ["--fractions=0,0.15,0.3,0.45,0.6,0.75", "--spacing", "0.6"]
FOUR = ["--fractions=0,0.2,0.4,0.75", "--spacing", "0.6"]
SCANNED = ["--fractions=0.35,0.75", "--spacing", "0.6", "--scanner", os.path.join(PEERS, "dual-coarse.json")]
# Name, options of `coronary-pipeline phantom`.
CASES = [
    ("healthy 101", ["--seed", "101"] + SIX),
    ("healthy 102", ["--seed", "102"] + FOUR),
    ("healthy 103", ["--seed", "103"] + FOUR),
    ("stenosed 104", ["--seed", "104", "--stenoses", "4", "--stenosis-degree", "0.7"] + FOUR),
    ("scanned 105", ["--seed", "105"] + SCANNED),
]
QUICK_CASES = [("quick 101", ["--seed", "101", "--fractions=0.35,0.75", "--spacing", "0.9"])]
QUICK_PARAMETERS = {"MaximumNumberOfIterations": "60", "NumberOfSpatialSamples": "1000"}
MODELS = ["ours", "elastix, our model", "elastix, true model", "not moved, true model"]
MEASURES = ["centerline_mean", "centerline_p95", "MSD", "HD95", "HD"]


def say(text):
    sys.stderr.write(text + "\n")


def needed(name):
    path = shutil.which(name)
    if not path:
        raise Failed("%s is missing; this validation compares with it (scripts/install-dependencies.sh --nightly)" % name)
    return path


def parameters(quick):
    with open(PARAMETERS, encoding="utf-8") as file:
        lines = file.read().splitlines()
    if quick:
        lines = ["(%s %s)" % (line[1:].split()[0], QUICK_PARAMETERS[line[1:].split()[0]])
                 if line[1:].split(" ")[0] in QUICK_PARAMETERS else line for line in lines]
    return "\n".join(lines) + "\n"


class Peers:
    def __init__(self, options):
        self.options = options
        self.program = os.path.join(options.build, "bin", "coronary-pipeline")
        if not os.access(self.program, os.X_OK):
            raise Failed("no %s: build it first (cmake --preset paraview -D DYNAMICCORONARY_NIGHTLY_TESTS=ON, cmake --build --preset paraview)" % self.program)
        self.elastix, self.transformix, self.pvpython = needed("elastix"), needed("transformix"), needed("pvpython")
        self.parameters = parameters(options.quick)
        self.itk = os.path.join(options.build, "bin", "itk-segmentation")
        self.version = kept_results.digest_of_program(self.program, options.build)
        self.threads = str(options.threads or os.cpu_count())

    def pipeline(self, folder, *words):
        return kept_results.run([self.program, *words, "--quiet", "--threads", self.threads],
                                os.path.join(folder, words[0] + ".log"))

    def points(self, *words, log=None):
        kept_results.run([self.pvpython, os.path.join(ROOT, "scripts", "vtp-points.py"), *words], log)

    def case(self, name, phantom):
        base = os.path.join(self.options.output, "peers", name.replace(" ", "-"))
        scanner = phantom[phantom.index("--scanner") + 1] if "--scanner" in phantom else None
        key = digest(self.version, phantom, kept_results.digest_of_files([scanner] if scanner else []))

        say("%s: images" % name)
        series = os.path.join(base, "phantom")
        kept(series, key, lambda folder: self.pipeline(folder, "phantom", *phantom, "--output", folder))

        say("%s: our model" % name)
        ours = os.path.join(base, "ours")
        whole = kept(ours, key, lambda folder: self.ours(series, folder))
        reference, phases = whole["reference"], whole["phases"]
        others = [phase for phase in range(phases) if phase != reference]

        cost = {"seconds": 0.0, "cpu_seconds": 0.0, "peak_mb": 0.0}
        for phase in others:
            say("%s: elastix, phase %d" % (name, phase))
            usage = kept(os.path.join(base, "elastix", "%02d" % phase), digest(key, reference, self.parameters, self.threads),
                         lambda folder, phase=phase: self.register(series, reference, phase, folder))
            cost = {"seconds": cost["seconds"] + usage["seconds"], "cpu_seconds": cost["cpu_seconds"] + usage["cpu_seconds"],
                    "peak_mb": max(cost["peak_mb"], usage["peak_mb"])}

        say("%s: carried models, measures" % name)
        measured = kept(os.path.join(base, "measured"), digest(key, reference, self.parameters),
                        lambda folder: self.measure(base, reference, phases, folder))
        rest = None
        if os.access(self.itk, os.X_OK):
            say("%s: ITK" % name)
            rest = kept(os.path.join(base, "itk"), digest(key, reference, kept_results.digest_of_files([self.itk])),
                        lambda folder: self.segment(base, reference, folder))
        return {"name": name, "whole": whole, "elastix": cost, "measured": measured, "others": others, "rest": rest}

    def ours(self, series, folder):
        result = os.path.join(folder, "run")
        words, note = ["run", os.path.join(series, "series.json"), "--output", result], ""
        try:
            usage = self.pipeline(folder, *words)
        except Failed as failure:
            if "--partial" not in str(failure):
                raise
            # One tree alone is a result, too: it is said with the tables.
            note = str(failure)
            usage = self.pipeline(folder, *words, "--partial")
        with open(os.path.join(result, "report.json"), encoding="utf-8") as file:
            report = json.load(file)
        with open(os.path.join(series, "series.json"), encoding="utf-8") as file:
            fractions = [phase["fraction"] for phase in json.load(file)["phases"]]
        motion = next(stage for stage in report["stages"] if stage["name"] == "motion")
        return {"note": note, "reference": report["phase"], "phases": len(fractions), "fractions": fractions, "whole": usage,
                "motion": {"seconds": motion["seconds"], "cpu_seconds": motion["cpu_seconds"]}}

    def register(self, series, reference, phase, folder):
        file = os.path.join(folder, "parameters.txt")
        with open(file, "w", encoding="utf-8") as text:
            text.write(self.parameters)
        image = os.path.join(series, "phase_%02d.mha")
        return kept_results.run([self.elastix, "-f", image % reference, "-m", image % phase, "-p", file, "-out", folder,
                                 "-threads", self.threads], os.path.join(folder, "log"))

    def segment(self, base, reference, folder):
        """ITK's mask of the reference phase; its wall and ours against the true one."""
        truth, mask = os.path.join(base, "phantom", "truth"), os.path.join(folder, "mask.mha")
        line, lines = os.path.join(truth, "centerline_%02d.vtp" % reference), os.path.join(folder, "lines.txt")
        places = []
        for what, option in (("roots", "--ostium"), ("tips", "--tip")):
            told = os.path.join(folder, what + ".txt")
            self.points(what, line, log=told)
            with open(told, encoding="utf-8") as file:
                places += [word for place in file for word in [option, *place.split()]]
        usage = kept_results.run([self.itk, os.path.join(base, "phantom", "phase_%02d.mha" % reference), mask, "--threads",
                                  self.threads, "--lines", lines, *places], os.path.join(folder, "log"))
        wall = os.path.join(folder, "wall.vtp")
        kept_results.run([self.program, "convert", mask, wall], os.path.join(folder, "log"))
        ours = os.path.join(base, "ours", "run")
        with open(os.path.join(ours, "report.json"), encoding="utf-8") as file:
            stages = {stage["name"]: stage for stage in json.load(file)["stages"]}
        until = [stages[name] for name in ("vesselness", "segmentation", "centerline", "surface")]
        axes = {"ours": os.path.join(ours, "motion", "centerline_%02d.vtp" % reference), "ITK": lines}
        walls = {"ours": os.path.join(ours, "motion", "surface_%02d.vtp" % reference), "ITK": wall}
        return {"ITK": usage, "ours": {"seconds": sum(stage["seconds"] for stage in until),
                                       "cpu_seconds": sum(stage["cpu_seconds"] for stage in until),
                                       "peak_mb": until[-1]["peak_memory_mb"]},
                "lines": {name: self.overlap(path, line, os.path.join(folder, "overlap.json")) for name, path in axes.items()},
                "distances": {name: self.distances(path, os.path.join(truth, "surface_%02d.vtp" % reference))
                              for name, path in walls.items()}}

    def overlap(self, lines, truth, told):
        self.points("overlap", lines, truth, log=told)
        with open(told, encoding="utf-8") as file:
            return json.load(file)

    def distances(self, wall, truth):
        told = subprocess.run([self.program, "metrics", wall, truth, "--json", "--error-bound", "0.01"], capture_output=True,
                              stdin=subprocess.DEVNULL, text=True, check=False)
        if told.returncode:
            raise Failed(told.stderr.strip())
        return {key: json.loads(told.stdout)[key] for key in ("MSD", "MSD_BA", "HD95", "HD")}

    def measure(self, base, reference, phases, folder):
        """Part A of Table 1 for each model."""
        truth, run = os.path.join(base, "phantom"), os.path.join(base, "ours", "run")
        self.carry(base, os.path.join(run, "motion"), reference, phases, os.path.join(folder, "our-model"))
        self.carry(base, os.path.join(truth, "truth"), reference, phases, os.path.join(folder, "true-model"))
        self.list_series(base, [os.path.join(truth, "truth", "%%s_%02d.vtp" % reference)] * phases,
                         os.path.join(folder, "still"))
        words = []
        for model, result in zip(MODELS, [run] + [os.path.join(folder, name) for name in ("our-model", "true-model", "still")]):
            words += ["--result", result, "--truth", truth, "--name", model]
        evaluation = os.path.join(folder, "evaluation")
        self.pipeline(folder, "evaluate", *words, "--interpolated", "none", "--no-pictures", "--error-bound", "0.01",
                      "--output", evaluation)
        with open(os.path.join(evaluation, "table1.json"), encoding="utf-8") as file:
            return {case["name"]: case["phases"] for case in json.load(file)["cases"]}

    def carry(self, base, source, reference, phases, folder):
        """Surface and centerline of the reference phase where elastix says that they are in the others."""
        os.makedirs(folder)
        files = []
        for phase in range(phases):
            for what in ("surface", "centerline"):
                original = os.path.join(source, "%s_%02d.vtp" % (what, reference))
                moved = os.path.join(folder, "%s_%02d.vtp" % (what, phase))
                if phase == reference:
                    shutil.copyfile(original, moved)
                    continue
                work = os.path.join(folder, "points")
                os.makedirs(work, exist_ok=True)
                points = os.path.join(work, "points.txt")
                self.points("write", original, points)
                kept_results.run([self.transformix, "-def", points, "-out", work, "-tp", os.path.join(
                    base, "elastix", "%02d" % phase, "TransformParameters.0.txt")], os.path.join(work, "log"))
                self.points("move", original, os.path.join(work, "outputpoints.txt"), moved)
            files.append(os.path.join(folder, "%%s_%02d.vtp" % phase))
        shutil.rmtree(os.path.join(folder, "points"), ignore_errors=True)
        self.list_series(base, files, folder)

    def list_series(self, base, files, folder):
        """surface.pvd and centerline.pvd; `files` have %s where these words go."""
        os.makedirs(folder, exist_ok=True)
        with open(os.path.join(base, "phantom", "series.json"), encoding="utf-8") as file:
            fractions = [phase["fraction"] for phase in json.load(file)["phases"]]
        for what in ("surface", "centerline"):
            with open(os.path.join(folder, what + ".pvd"), "w", encoding="utf-8") as file:
                file.write('<VTKFile type="Collection" version="0.1"><Collection>\n')
                for fraction, path in zip(fractions, files):
                    file.write('<DataSet timestep="%r" file="%s"/>\n' % (fraction, os.path.relpath(path % what, folder)))
                file.write("</Collection></VTKFile>\n")


def mean(values):
    return sum(values) / len(values)


def print_tables(cases):
    print("Means over all phases but the reference; mm.\n")
    print("| case | model | centerline, mean | centerline, 95 % | MSD | HD95 | HD |")
    print("|---|---|---|---|---|---|---|")
    for case in cases:
        for model in MODELS:
            phases = [case["measured"][model][phase] for phase in case["others"]]
            print("| %s | %s | %s |" % (case["name"], model, " | ".join(
                "%.2f" % mean([phase[key] for phase in phases]) for key in MEASURES)))
    for case in cases:
        if case["whole"].get("note"):
            print("\n**%s, ours**: run with --partial, since \"%s\"." % (case["name"], case["whole"].get("note")))
    print("\nTime and memory: ours from tree to moved meshes (stage `motion`), and the whole way from the images; elastix all "
          "its registrations.\n")
    print("| case | phases | ours, motion: wall, s | processor, s | ours, whole: wall, s | processor, s | peak, GB "
          "| elastix: wall, s | processor, s | peak, GB |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for case in cases:
        motion, whole, peer = case["whole"]["motion"], case["whole"]["whole"], case["elastix"]
        print("| %s | %d | %.0f | %.0f | %.0f | %.0f | %.2f | %.0f | %.0f | %.2f |" % (
            case["name"], len(case["others"]), motion["seconds"], motion["cpu_seconds"], whole["seconds"], whole["cpu_seconds"],
            whole["peak_mb"] / 1024.0, peer["seconds"], peer["cpu_seconds"], peer["peak_mb"] / 1024.0))

    print("\nThe wall in the reference phase. ITK: objectness (the scales and c of ours), region of at least 0.1 and 200 HU that hangs on "
          "the true ostia; ours from the images alone, stages to `surface`. MSD: from the model to the truth, and back.\n")
    if any(case["rest"] is None for case in cases):
        print("**ITK was not compared**: itk-segmentation was not built (scripts/install-dependencies.sh --nightly).\n")
    print("| case | model | MSD | MSD, back | HD95 | HD | wall, s | processor, s | peak, GB |")
    print("|---|---|---|---|---|---|---|---|---|")
    for case in cases:
        for model in ("ours", "ITK") if case["rest"] else ():
            far, cost = case["rest"]["distances"][model], case["rest"][model]
            print("| %s | %s | %.2f | %.2f | %.2f | %.1f | %.0f | %.0f | %.2f |" % (
                case["name"], model, far["MSD"], far["MSD_BA"], far["HD95"], far["HD"], cost["seconds"], cost["cpu_seconds"],
                cost["peak_mb"] / 1024.0))
    print("\nThe centerline in the reference phase. ITK: fast marching from the true ostia, as fast as objectness is high (at least 0.001), down the "
          "arrival time from the **true tips**; ours from the images alone. Found: share of the true tree within 1.5 mm; false: share of the lines beyond; mean: "
          "distance of the rest.\n")
    print("| case | model | found | false | mean, mm |")
    print("|---|---|---|---|---|")
    for case in cases:
        for model in ("ours", "ITK") if case["rest"] else ():
            line = case["rest"]["lines"][model]
            print("| %s | %s | %.3f | %.3f | %s |" % (
                case["name"], model, line["found"], line["false"], "-" if line["mean"] is None else "%.2f" % line["mean"]))
    print("\n**VMTK was not compared**: Debian 12 has no package of it.")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(ROOT, "build", "paraview"), help="build tree with coronary-pipeline")
    parser.add_argument("--output", default=os.path.join(ROOT, "validation-output"), help="where results and what is kept go")
    parser.add_argument("--only", nargs="+", metavar="TEXT", default=[], help="cases whose name has one of these texts")
    parser.add_argument("--threads", type=int, default=0, help="of ours and of elastix; 0: all cores")
    parser.add_argument("--quick", action="store_true", help="one coarse case, few iterations: whether everything runs")
    options = parser.parse_args()
    cases = [case for case in (QUICK_CASES if options.quick else CASES)
             if not options.only or any(text in case[0] for text in options.only)]
    if not cases:
        parser.error("--only: there are " + ", ".join(name for name, _ in CASES))
    peers = Peers(options)
    print_tables([peers.case(*case) for case in cases])


if __name__ == "__main__":
    kept_results.as_program(main, "validate-peers")
