#!/usr/bin/env python3
"""Weights of odds: logistic regression of artery or not on the signs of branches, links or tips; of placed or not for branches at
phases.

Reads tables of `validate-disease --branches FILE` (the odds of a vein, VeinRejection.cxx), `--links FILE` (the odds that
a link is right, VesselLinking.cxx), `--tips FILE` (the odds that a vessel goes on, VesselTips.cxx), or
of `validate-placement` (that a branch is where it is said to be, BranchPlacement.cxx). Prints the weights, and how well weights tell that were fitted without the heart that
they judge (eight folds). What is artery only in part, and what lies behind a link, is left out. The penalty is half the
squared weights, or half the squared difference from what is known before.
"""
import argparse
import csv
import sys

import numpy as np

FIRST_SIGN = 8  # condition, seed, artery, used, probability, x, y, z
FOLDS = 8
# Weight that is known before, and how well (the penalty on half its squared error); all others: 0, 1. For veins: `through` is the
# logarithm of a ratio of likelihoods itself, and brightness is measured in its own errors. The shapes of veins are from hearts
# whose vein ran through arteries, as veins seem to in images that blur their walls, and so is how often one is followed:
# the phantom's vein hardly touches an artery any more.
# For links: hardly any phantom has bone in the way.
BEFORE = {
    "branches": {"through": (1.2, 30.0), "darker": (1.0, 30.0), "brighter": (0.8, 1.0), "taper": (2.8, 1.0),
                 "strong_taper": (1.4, 1.0), "no_taper": (0.9, 1.0), "blunt_goes_on": (3.0, 1.0), "blunt_cut": (3.0, 1.0),
                 "blunt": (4.1, 1.0), "backwards": (1.2, 1.0), "short": (2.2, 1.0), "thinner": (0.5, 1.0),
                 "beside_unclear": (0.8, 1.0), "(intercept)": (-4.7, 4.0)},
    "links": {"outgrows": (-8.0, 1.0), "abrupt": (1.5, 1.0), "brighter": (-6.0, 1.0)},
    "tips": {},
    "placements": {},
}
# Where one of these signs is above the limit, no more is said than a coin's throw, whatever the weights: as BranchPlacement.cxx does.
LIMITED = {"placements": (("unseen", "seldom"), 0.5)}


def limited(kind, names, signs, chance):
    if kind not in LIMITED:
        return chance
    doubtful, limit = LIMITED[kind]
    over = (signs[..., [names.index(name) for name in doubtful]] > limit).any(axis=-1)
    return np.where(over, np.minimum(chance, 0.5), chance)


def fit(before, names, signs, truth):
    """Weights and, last, the intercept, which is penalised only where it is known before."""
    data = np.column_stack([signs, np.ones(len(signs))])
    known = np.array([before.get(name, (0.0, 1.0)) for name in names] + [before.get("(intercept)", (0.0, 0.0))])
    weights, penalty = known.T.copy()
    for _ in range(100):
        chance = 1.0 / (1.0 + np.exp(-data @ weights))
        gradient = data.T @ (chance - truth) + penalty * (weights - known[:, 0])
        hessian = (data * (chance * (1.0 - chance))[:, None]).T @ data + np.diag(penalty)
        step = np.linalg.solve(hessian + 1e-9 * np.eye(len(weights)), gradient)
        weights -= step
        if np.abs(step).max() < 1e-8:
            break
    return weights


def say(kind, weights, source, target):
    """Writes a table with what the weights say in its column of probabilities."""
    with open(source, newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    for row in rows:
        signs = np.array(row[FIRST_SIGN:], float)
        chance = 1.0 / (1.0 + np.exp(-float(np.append(signs, 1.0) @ weights)))
        row[4] = f"{limited(kind, head[FIRST_SIGN:], signs, chance):.4f}"
    with open(target, "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([head, *rows])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=sorted(BEFORE))
    parser.add_argument("tables", nargs="+", metavar="table")
    parser.add_argument("--wrong", action="store_true", help="list what is told wrongly")
    parser.add_argument("--say", nargs=2, action="append", default=[], metavar=("TABLE", "RESULT"),
                        help="a table that is not fitted to, and where it goes with what the weights say; may be repeated")
    arguments = parser.parse_args()
    rows = []
    for name in arguments.tables:
        with open(name, newline="", encoding="utf-8") as file:
            head, *body = csv.reader(file)
            rows += body
    rows = [row for row in rows if row[3] == "1" and not 0.25 <= float(row[2]) <= 0.75]
    if not rows:
        sys.exit("nothing to fit in " + ", ".join(arguments.tables))
    signs = np.array([row[FIRST_SIGN:] for row in rows], float)
    before = BEFORE[arguments.kind]
    names = head[FIRST_SIGN:]
    artery = np.array([float(row[2]) > 0.5 for row in rows])
    what = {"links": "links", "tips": "vessels that go on", "branches": "veins", "placements": "in their places"}[arguments.kind]
    truth = (~artery if arguments.kind == "branches" else artery).astype(float)
    hearts = [row[0] + row[1] for row in rows]
    fold = {heart: n % FOLDS for n, heart in enumerate(dict.fromkeys(hearts))}
    folds = np.array([fold[heart] for heart in hearts])
    data = np.column_stack([signs, np.ones(len(rows))])
    odds = np.zeros(len(rows))
    for n in range(min(FOLDS, len(fold))):
        odds[folds == n] = data[folds == n] @ fit(before, names, signs[folds != n], truth[folds != n])
    print(f"{len(rows)} rows of {len(fold)} hearts, {int(truth.sum())} of them {what}")
    weights = fit(before, names, signs, truth)
    for source, target in arguments.say:
        say(arguments.kind, weights, source, target)
    for name, weight in zip(names + ["(intercept)"], weights):
        print(f"{name:20s} {weight:6.2f}")
    used = np.array([float(row[4]) for row in rows])
    chance = limited(arguments.kind, names, signs, 1.0 / (1.0 + np.exp(-odds)))
    for how, said in (("as it was", used), ("fitted without their heart", chance)):
        missed = int((truth * (said < 0.5)).sum())
        print(f"{how}: {missed} {what} missed, {int(((1 - truth) * (said >= 0.5)).sum())} that are none")
    error = 0.0
    for low in np.arange(0.0, 1.0, 0.1):
        inside = (chance >= low) & (chance < low + 0.1)
        if inside.any():
            error += abs(chance[inside].sum() - truth[inside].sum()) / len(rows)
            print(f"said {low:.1f} to {low + 0.1:.1f}: {inside.sum()}, mean {chance[inside].mean():.2f}, "
                  f"true {truth[inside].mean():.2f}")
    print(f"expected calibration error {error:.3f}")
    if arguments.wrong:
        for row, odd, right in zip(rows, odds, truth):
            if (odd >= 0.0) != bool(right):
                print(f"{odd:5.1f}", *row[:FIRST_SIGN])


if __name__ == "__main__":
    main()
