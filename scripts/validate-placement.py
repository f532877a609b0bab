#!/usr/bin/env python3
"""Whether branches of moving trees are where they are said to be as often as is said (`PlacementConfidence`).

Phantoms of many conditions, each a heart of its own, go through `coronary-pipeline phantom` and `run`; `validate-placement`
tells of each branch and tracked phase how likely it was said to be within 1 mm of an artery, and whether it is. The hearts
that the weights of BranchPlacement.cxx are fitted to (--fit) are others than those that judge them. `--tables` judges other
tables of rows instead, those of `validate-scanned.py` for instance. Tables in Markdown on standard output.
"""
import argparse
import csv
import os
import random
import shutil
import subprocess
import sys

import kept_results
from kept_results import Failed, digest, kept

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SOFT = ["--point-spread", "0.64", "0.64", "0.6"]
# Each with options of `phantom`, and the temporal window that `run` is told of.
CONDITIONS = {
    "healthy": ([], 66),
    "140 ms, 40 HU": (["--window", "140", "--noise", "40"], 140),
    "60 HU": (["--noise", "60"], 66),
    "lost": (["--lost", "2", "--lost", "3:0.5", "--lost", "1:0.3"], 66),
    "great motion": (["--window", "140", "--motion-amplitude", "1.3", "--axial-motion-right", "24", "--axial-motion-left", "16"],
                     140),
    "soft kernel": (SOFT, 66),
    "soft kernel, 40 HU": (SOFT + ["--noise", "40"], 66),
    "stenosed": (["--disease", "stenosed"], 66),
    "calcified": (["--disease", "calcified"], 66),
    "stented": (["--disease", "stented"], 66),
    "occluded": (["--disease", "occluded"], 66),
    "bright veins": (["--disease", "bright-veins"], 66),
    "anomalous": (["--disease", "anomalous"], 66),
}
FIRST_SEED = {"fit": 801, "judge": 901}
PHANTOM = ["--spacing", "0.6", "--fractions", "0.05,0.25,0.45,0.6,0.8"]
RUN = ["--partial", "--motion", "tracked", "--edges", "0.5", "1.5"]
KEPT = ["report.json", "motion/centerline*"]
BINS = 10
GROSS = 2.0  # mm: beyond what motion does to an image, what is there is no artery, or another place
LARGEST_ERROR = 0.05  # expected calibration error: asked


def rows_of(options, build, kind):
    """Rows of all conditions' hearts, made where they are not there yet."""
    program = os.path.join(build, "bin", "coronary-pipeline")
    judge = os.path.join(build, "bin", "validate-placement")
    if not os.access(judge, os.X_OK):
        raise Failed("no %s: build it first (cmake --preset paraview -D DYNAMICCORONARY_NIGHTLY_TESTS=ON, cmake --build --preset paraview)" % judge)
    version = "of any program" if options.keep_runs else kept_results.digest_of_program(program, build)
    tables = []
    for number, (condition, (image, window)) in enumerate(CONDITIONS.items()):
        for heart in range(options.hearts):
            seed = str(FIRST_SEED[kind] + heart * len(CONDITIONS) + number)

            def make(folder, seed=seed, image=image, window=window):
                series, run = os.path.join(folder, "series"), os.path.join(folder, "run")
                kept_results.run([program, "phantom", "--seed", seed, *image, *PHANTOM, "--output", series],
                                 os.path.join(folder, "phantom.log"))
                try:
                    kept_results.run([program, "run", os.path.join(series, "series.json"), "--output", run,
                                      "--temporal-window-ms", str(window), *RUN], os.path.join(folder, "run.log"))
                except Failed as failure:
                    shutil.rmtree(series)
                    return {"failure": str(failure)}
                for name in os.listdir(series):
                    if name != "truth" and not options.keep_images:
                        path = os.path.join(series, name)
                        (shutil.rmtree if os.path.isdir(path) else os.remove)(path)
                kept_results.keep_only(run, KEPT)
                return {}

            folder = os.path.join(options.output, "placement", kind, seed)
            result = kept(folder, digest(version, image, window, PHANTOM, RUN), make)
            if "failure" in result:
                print("No model of %s, %s: %s" % (condition, seed, result["failure"]))
                continue
            sys.stderr.write("%s: %s, heart %s\n" % (kind, condition, seed))
            # The weights may be other ones by now: judged anew.
            told = subprocess.run([judge, "--run", os.path.join(folder, "run"), "--truth", os.path.join(folder, "series", "truth"),
                                   "--condition", condition.replace(",", ""), "--seed", seed, "--head"],
                                  capture_output=True, text=True, check=False)
            if told.returncode:
                raise Failed(told.stderr.strip())
            path = os.path.join(folder, "rows.csv")
            with open(path, "w", encoding="utf-8") as file:
                file.write(told.stdout)
            tables.append(path)
    return tables


def read(tables):
    rows = []
    for table in tables:
        with open(table, newline="", encoding="utf-8") as file:
            rows += [(row["condition"], row["seed"], float(row["probability"]), row["placed"] == "1", float(row["distance"]))
                     for row in csv.DictReader(file)]
    return rows


def bins_of(rows):
    """Rows in bins of equal count, by what was said."""
    rows = sorted(rows, key=lambda row: row[2])
    return list(filter(None, (rows[len(rows) * n // BINS:len(rows) * (n + 1) // BINS] for n in range(BINS))))


def calibration_error(rows):
    return sum(abs(sum(row[2] for row in part) - sum(row[3] for row in part)) for part in bins_of(rows)) / len(rows)


def by_chance(rows):
    """The error that a perfect forecast of these would have, mean of 200 draws: a few cases never fit exactly."""
    draw = random.Random(1)
    return sum(calibration_error([(*row[:3], draw.random() < row[2]) for row in rows]) for _ in range(200)) / 200.0


def judge_rows(rows):
    """Prints how often what was said came true. Returns whether it is as good as was asked."""
    print("| said, mean | placed | rows |\n|---|---|---|")
    for part in bins_of(rows):
        print("| %.3f | %.3f | %d |" % (sum(row[2] for row in part) / len(part), sum(row[3] for row in part) / len(part), len(part)))
    brier = sum((row[2] - row[3]) ** 2 for row in rows) / len(rows)
    share = sum(row[3] for row in rows) / len(rows)
    error = calibration_error(rows)
    wrong = [row for row in rows if not row[3]]
    sure = [row for row in wrong if row[2] > 0.5]
    gross = [row for row in wrong if row[4] > GROSS]
    print("\n%d branches and phases of %d hearts; placed %.3f. Expected calibration error %.3f (by chance alone %.3f; asked %.2f: %s), "
          "Brier score %.3f (always saying the mean: %.3f). Not placed: %d, of which %d were said with more than 0.5; farther than %g mm: "
          "%d, of which %d.\n"
          % (len(rows), len({row[:2] for row in rows}), share, error, by_chance(rows), LARGEST_ERROR,
             "met" if error <= LARGEST_ERROR else "**missed**", brier, share * (1.0 - share), len(wrong), len(sure), GROSS, len(gross),
             sum(row in gross for row in sure)))
    print("| condition | rows | said, mean | placed | not placed, said above 0.5 |\n|---|---|---|---|---|")
    for condition in dict.fromkeys(row[0] for row in rows):
        own = [row for row in rows if row[0] == condition]
        print("| %s | %d | %.3f | %.3f | %d of %d |" % (
            condition, len(own), sum(row[2] for row in own) / len(own), sum(row[3] for row in own) / len(own),
            sum(row[2] > 0.5 and not row[3] for row in own), sum(not row[3] for row in own)))
    return error <= LARGEST_ERROR


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(ROOT, "build", "paraview"), help="build tree with the programs")
    parser.add_argument("--output", default=os.path.join(ROOT, "validation-output"), help="where runs and rows are kept")
    parser.add_argument("--hearts", type=int, default=2, help="of each condition")
    parser.add_argument("--keep-runs", action="store_true", help="runs serve the next program, too: for work on the weights")
    parser.add_argument("--keep-images", action="store_true", help="images stay, too (150 MB a heart): for work on signs")
    parser.add_argument("--fit", action="store_true", help="the weights from the hearts for that, nothing judged")
    parser.add_argument("--tables", nargs="+", metavar="FILE", help="judge these instead")
    options = parser.parse_args()
    if options.fit:
        tables = rows_of(options, options.build, "fit")
        subprocess.run(["python3", os.path.join(ROOT, "scripts", "fit-odds.py"), "placements", *tables], check=True)
        return
    rows = read(options.tables or rows_of(options, options.build, "judge"))
    if not rows:
        raise Failed("nothing to judge")
    if not judge_rows(rows):
        sys.exit(1)


if __name__ == "__main__":
    kept_results.as_program(main, "validate-placement")
