#!/usr/bin/env python3
"""From the images of a simulated CT scanner to Table 1: a fixed matrix, a row for each of its images.

Anatomy x scan x kernel x noise x phase. Each anatomy is scanned once by each scanner (Testing/Validation/scans), at rest and in
systole; kernels and noise levels are made from the same views. Each series goes through `coronary-pipeline run` with nothing
given by hand, and `evaluate`. Tables in Markdown on standard output. Every finished series is kept under --output: started
again, it goes on where it was; what another program or other settings made is made anew.
"""
import argparse
import csv
import glob
import json
import os
import shutil
import statistics
import sys
import time

import kept_results
from kept_results import Failed, digest, finished, kept

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SCANNERS = os.path.join(ROOT, "Testing", "Validation", "scans")
# One heart, so that rows differ in what their axes say alone: options of `coronary-pipeline phantom`.
HEART = ["--seed", "711"]
ANATOMIES = {"healthy": [], **{name: ["--disease", name]
                               for name in ("stenosed", "calcified", "stented", "occluded", "anomalous")}}
# Scanner file, and what `run` is told of its temporal window in ms.
SCANS = {"dual-66": 66, "single-140": 140, "single-140-misfit": 140}
PHASES = {"systole": 0.35, "rest": 0.75}
KERNELS = ["soft", "sharp"]
NOISES = [20, 40, 60]  # HU
GRID = ["--spacing", "0.5"]
RUN = ["--partial", "--motion", "tracked"]  # a lost tree is a row, not an end
# Of a run what its confidences are judged by.
KEPT = ["report.json", "motion/centerline*"]
# Wide vessels, since the quick scanner is coarse.
QUICK = {"HEART": HEART + ["--calibre", "1.4"], "ANATOMIES": {"healthy": []}, "SCANS": {"quick": 66}, "KERNELS": ["sharp"],
         "NOISES": [30], "GRID": ["--spacing", "0.8", "--surface-spacing", "0.8"],
         "RUN": RUN + ["--edges", "0.5", "1.5"]}

LOST_BELOW = 0.5    # share of a branch that is found
FOUND_WITHIN = 1.5  # mm from an axis, beside how far the scan shifts the heart
CONFIDENT = 0.5     # from this confidence on a false branch counts
AXES = ["anatomy", "scan", "phase", "kernel", "noise"]
MEASURES = [("found_0.5", "found", "%.3f"), ("centerline_mean", "centerline, mm", "%.2f"), ("ASSD", "ASSD, mm", "%.2f"),
            ("HD95", "HD95, mm", "%.2f"), ("HD", "HD, mm", "%.1f"), ("MSD", "MSD, mm", "%.2f"), ("lost_branches", "lost branches", "%.0f"),
            ("false_length", "false, mm", "%.0f"), ("wrong", "false, confident", "%.0f"), ("warnings", "warnings", "%.0f")]


class Series:
    """One combination of all axes but the phase."""

    def __init__(self, anatomy, scan, kernel, noise):
        self.anatomy, self.scan, self.kernel, self.noise = anatomy, scan, kernel, noise

    def __str__(self):
        return "%s, %s, %s, %d HU" % (self.anatomy, self.scan, self.kernel, self.noise)

    @property
    def image(self):
        return "%s-%d" % (self.kernel, self.noise)


class Matrix:
    def __init__(self, options):
        self.options = options
        self.folder = os.path.join(options.output, "scanned-quick" if options.quick else "scanned")
        self.program = os.path.join(options.build, "bin", "coronary-pipeline")
        if not os.access(self.program, os.X_OK):
            raise Failed("no %s: build it first (cmake --preset paraview -D DYNAMICCORONARY_NIGHTLY_TESTS=ON, cmake --build --preset paraview)" % self.program)
        self.version = kept_results.digest_of_program(self.program, options.build)
        self.images_version = "of any program" if options.keep_images else self.version
        self.threads = str(options.threads or os.cpu_count())

    def pipeline(self, folder, *words):
        return kept_results.run([self.program, *words, "--threads", self.threads],
                                os.path.join(folder, words[0] + ".log"))

    def scanner(self, scan):
        return os.path.join(SCANNERS, scan + ".json")

    def scan_key(self, anatomy, scan):
        return digest(self.images_version, HEART, ANATOMIES[anatomy], kept_results.digest_of_files([self.scanner(scan)]), PHASES, GRID)

    def key(self, series):
        return digest(self.version, self.scan_key(series.anatomy, series.scan), series.image, SCANS[series.scan], RUN,
                      FOUND_WITHIN, CONFIDENT)

    def place(self, series):
        return os.path.join(self.folder, series.anatomy, series.scan, series.image)

    def result(self, series):
        return finished(self.place(series), self.key(series))

    def images(self, wanted):
        """Scans one anatomy with one scanner: a folder with truth and the wanted kernels and noise levels, each in a folder.

        All come from the same views, and a scan that was stopped goes on.
        """
        anatomy, scan = wanted[0].anatomy, wanted[0].scan
        kernels = [kernel for kernel in KERNELS if any(one.kernel == kernel for one in wanted)]
        noises = [noise for noise in NOISES if any(one.noise == noise for one in wanted)]
        folder, key = os.path.join(self.folder, anatomy, scan, "images"), self.scan_key(anatomy, scan)

        def make(partial):
            self.pipeline(partial, "phantom", *HEART, *ANATOMIES[anatomy], "--scanner", self.scanner(scan),
                          "--kernel", ",".join(kernels), "--image-noise", ",".join(str(noise) for noise in noises),
                          "--fractions", ",".join(str(fraction) for fraction in PHASES.values()), *GRID, "--output", partial)
            return [Series(anatomy, scan, kernel, noise).image for kernel in kernels for noise in noises]

        have = finished(folder, key) or []
        if not all(one.image in have for one in wanted):
            shutil.rmtree(folder, ignore_errors=True)
            kept(folder, key, make, goes_on=True)
        return folder

    def measure(self, series, images, folder):
        """Rows of a series, a phase each."""
        image = os.path.join(images, series.image)
        if not os.path.isdir(image):  # a single one lies beside its truth
            image = images
        run = os.path.join(folder, "run")
        try:
            usage = self.pipeline(folder, "run", os.path.join(image, "series.json"), "--output", run,
                                  "--temporal-window-ms", str(SCANS[series.scan]), *RUN)
        except Failed as failure:
            return {"failure": str(failure)}
        with open(os.path.join(run, "report.json"), encoding="utf-8") as file:
            report = json.load(file)
        evaluation = os.path.join(folder, "evaluation")
        tolerance = FOUND_WITHIN + greatest_shift(images)
        self.pipeline(folder, "evaluate", "--result", run, "--truth", os.path.join(images, "truth"), "--interpolated", "none",
                      "--no-pictures", "--error-bound", "0.01", "--found-within", "%g" % tolerance, "--output", evaluation)
        with open(os.path.join(evaluation, "table1.json"), encoding="utf-8") as file:
            case = json.load(file)["cases"][0]
        with open(os.path.join(evaluation, "branches.csv"), encoding="utf-8") as file:
            branches = list(csv.DictReader(file))
        warnings = [warning for stage in report["stages"] for warning in stage["warnings"]]
        rows = []
        for number, name in enumerate(PHASES):
            measures = case["phases"][number]
            lost = [branch for branch in branches if int(branch["phase"]) == number and branch["covered"]
                    and float(branch["covered"]) < LOST_BELOW]
            rows.append({"phase": name, "reference": report["phase"] == number,
                         "lost_branches": [[branch["label"], float(branch["length_mm"])] for branch in lost],
                         "wrong": sum((branch["confidence"] or 0.0) >= CONFIDENT for branch in measures["false_branches"]),
                         "false_branches": measures["false_branches"], "warnings": len(warnings),
                         **{key: measures[key] for key, _, _ in MEASURES if key in measures}})
        # For validate-placement.py --tables.
        kept_results.run([os.path.join(self.options.build, "bin", "validate-placement"), "--run", run, "--truth",
                          os.path.join(images, "truth"), "--condition", "%s %s %s" % (series.anatomy, series.scan, series.image),
                          "--seed", HEART[1], "--shift", "%g" % greatest_shift(images), "--head"],
                         os.path.join(folder, "placement.csv"))
        shutil.rmtree(evaluation)
        kept_results.keep_only(run, KEPT)
        return {"rows": rows, "warnings": warnings, "tolerance": tolerance, **usage}

    def fill(self, chosen):
        """Makes what is not there yet, with one line of progress for each series."""
        missing = [series for series in chosen if self.result(series) is None]
        start, made = time.monotonic(), 0
        for anatomy, scan in dict.fromkeys((series.anatomy, series.scan) for series in missing):
            wanted = [series for series in missing if (series.anatomy, series.scan) == (anatomy, scan)]
            self.say(chosen, len(missing) - made, start, made, "%s, %s: scanning" % (anatomy, scan))
            images = self.images(wanted)
            for series in wanted:
                self.say(chosen, len(missing) - made, start, made, str(series))
                kept(self.place(series), self.key(series), lambda folder, series=series: self.measure(series, images, folder))
                made += 1
            if not self.options.keep_images:
                shutil.rmtree(images)

    @staticmethod
    def say(chosen, missing, start, made, what):
        left = ""
        if made:
            left = ", about %.1f h left" % ((time.monotonic() - start) / made * missing / 3600.0)
        sys.stderr.write("%d of %d done%s; %s\n" % (len(chosen) - missing, len(chosen), left, what))


def greatest_shift(images):
    """How far the scan has the heart from where the truth says, mm."""
    with open(glob.glob(os.path.join(images, "**", "scan.json"), recursive=True)[0], encoding="utf-8") as file:
        scan = json.load(file)
    return max(sum(part ** 2 for part in stack["shift"]) ** 0.5 for phase in scan["phases"] for stack in phase["stacks"])


def line(cells):
    print("| %s |" % " | ".join(cells))


def number(row, key):
    """Of a list how many."""
    return len(row[key]) if isinstance(row[key], list) else row[key]


def texts(values):
    return [form % values[key] if values[key] is not None else "" for key, _, form in MEASURES]


def print_tables(chosen, results):
    """A row for each image, then medians by axis."""
    rows = []
    line(AXES + [title for _, title, _ in MEASURES])
    line(["---"] * (len(AXES) + len(MEASURES)))
    missing = 0
    for series in chosen:
        result = results[series]
        names = [series.anatomy, series.scan, "", series.kernel, str(series.noise)]
        if result is None:
            missing += 1
        elif "failure" in result:
            line(names[:2] + ["both"] + names[3:] + ["no model: " + result["failure"]] + [""] * (len(MEASURES) - 1))
        else:
            for row in result["rows"]:
                place = dict(zip(AXES, names), phase=row["phase"])
                rows.append((place, row))
                line([place[axis] + ("*" if axis == "phase" and row["reference"] else "") for axis in AXES] +
                     texts({key: number(row, key) for key, _, _ in MEASURES}))
    print("\n\\*: the phase that the tree was found in. Found: share of the true length (radius 0.5 mm or more) within %g mm, and "
          "what the scan shifts the heart by, of an axis, or the radius. Lost: branches of which less than half is found. False: "
          "length that is no artery, and branches that are none for more than half of their length, of a mean confidence of %g or "
          "more." % (FOUND_WITHIN, CONFIDENT))
    if missing:
        print("\n**%d of %d series are not measured yet.**" % (missing, len(chosen)))
    if not rows:
        return
    print("\nMedians:\n")
    line(["of", "images"] + [title for _, title, _ in MEASURES])
    line(["---"] * (2 + len(MEASURES)))
    for axes in [[axis] for axis in AXES] + [["anatomy", "scan", "kernel"]]:
        groups = {}
        for place, row in rows:
            groups.setdefault(", ".join(place[axis] + (" HU" if axis == "noise" else "") for axis in axes), []).append(row)
        for name, among in groups.items():
            line([name, str(len(among))] + texts({key: median([number(row, key) for row in among]) for key, _, _ in MEASURES}))


def median(values):
    values = [value for value in values if value is not None]
    return statistics.median(values) if values else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(ROOT, "build", "paraview"), help="build tree with coronary-pipeline")
    parser.add_argument("--output", default=os.path.join(ROOT, "validation-output"), help="where results and what is kept go")
    parser.add_argument("--only", nargs="+", metavar="NAME", default=[],
                        help="values of axes, such as `healthy dual-66 soft 20`: of each axis that is named only these")
    parser.add_argument("--table", action="store_true", help="only print what is finished")
    parser.add_argument("--keep-images", action="store_true",
                        help="images stay (23 GB for all), and serve the next program, too: for work on methods")
    parser.add_argument("--threads", type=int, default=0, help="0: all cores")
    parser.add_argument("--quick", action="store_true", help="one series of a coarse scan, always anew: whether everything runs")
    options = parser.parse_args()
    if options.quick:
        globals().update(QUICK)
    axes = [list(ANATOMIES), list(SCANS), KERNELS, [str(noise) for noise in NOISES]]
    unknown = [name for name in options.only if not any(name in axis for axis in axes)]
    if unknown:
        parser.error("--only: '%s' is none of %s" % (unknown[0], ", ".join(sum(axes, []))))
    anatomies, scans, kernels, noises = (
        [value for value in axis if value in options.only or not set(axis) & set(options.only)] for axis in axes)
    chosen = [Series(anatomy, scan, kernel, int(noise)) for anatomy in anatomies for scan in scans for kernel in kernels
              for noise in noises]
    matrix = Matrix(options)
    if options.quick:
        shutil.rmtree(matrix.folder, ignore_errors=True)
    if not options.table:
        matrix.fill(chosen)
    results = {series: matrix.result(series) for series in chosen}
    print_tables(chosen, results)
    # A form that finds nothing has not shown that everything runs.
    if options.quick and not all(result and "rows" in result and min(row["found_0.5"] for row in result["rows"]) > 0.5
                                 for result in results.values()):
        raise Failed("the quick form found less than half of the tree")


if __name__ == "__main__":
    kept_results.as_program(main, "validate-scanned")
