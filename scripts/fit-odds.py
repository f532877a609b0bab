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
NO_SIGN = "distance"  # mm, of placements: the last column
PLACED = 1.0  # mm
THRESHOLDS = {"placements": [0.5, 0.7, PLACED, 1.4, 2.0]}
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
    # What is known of the signs without images: of 13 phantoms and 54 scanned series, before there were others. Signs of the images are
    # small numbers with large weights. No heart that is fitted to has a wrong ostium, few have a vein: the limits alone tell.
    "placements": {"unclear": (-2.4, 10.0), "seldom": (-5.42, 10.0), "swept": (-1.29, 10.0), "unseen": (-1.72, 10.0),
                   "(intercept)": (6.02, 10.0), "(signs)": (0.0, 0.04), "doubtful": (0.0, 1e9), "vein": (0.0, 1e9)},
}
# Where one of these signs is above its limit, no more is said than a coin's throw, whatever the weights: as BranchPlacement.cxx does.
LIMITED = {"placements": {"unseen": 0.5, "seldom": 0.5, "beside": 0.7, "strays": 0.7, "doubtful": 0.3, "vein": 0.05}}
# All of their signs speak against: a weight that would be positive is 0.
AGAINST = {"placements"}


def limited(kind, names, signs, chance):
    over = np.zeros(np.shape(chance), bool)
    for name, limit in LIMITED.get(kind, {}).items():
        over |= signs[..., names.index(name)] > limit
    return np.where(over, np.minimum(chance, 0.5), chance)


def signs_of(head, row):
    return row[FIRST_SIGN:len(head) - (head[-1] == NO_SIGN)]


def fit(kind, names, signs, truth, distance):
    """Weights and, last, the intercept, which is penalised only where it is known before.

    Few branches are not in their places, but how far off all are is known: weights are those of the odds to be within any of
    THRESHOLDS, each with an intercept of its own.
    """
    before = dict(BEFORE[kind])
    limits = THRESHOLDS.get(kind, [None])
    data = np.vstack([np.column_stack([signs, np.repeat(np.eye(len(limits))[[n]], len(signs), axis=0)]) for n in range(len(limits))])
    right = np.concatenate([truth if limit is None else (distance <= limit).astype(float) for limit in limits])
    while True:
        usual = before.get("(signs)", (0.0, 1.0))
        intercepts = [before.get("(intercept)", (0.0, 0.0)) if limit in (None, PLACED) else (0.0, 0.0) for limit in limits]
        known = np.array([before.get(name, usual) for name in names] + intercepts)
        weights = regression(known, data, right, 1.0 / len(limits))
        wrong = [name for name, weight in zip(names, weights) if weight > 1e-6]
        if kind not in AGAINST or not wrong:
            own = limits.index(PLACED) if PLACED in limits else 0
            return np.append(weights[:len(names)], weights[len(names) + own])
        before.update({name: (0.0, 1e9) for name in wrong})


def regression(known, data, truth, share):
    """@param known  weights and their penalties @param share  what a row counts"""
    weights, penalty = known.T.copy()
    for _ in range(500):
        chance = 1.0 / (1.0 + np.exp(-data @ weights))
        gradient = share * data.T @ (chance - truth) + penalty * (weights - known[:, 0])
        hessian = share * (data * (chance * (1.0 - chance))[:, None]).T @ data + np.diag(penalty)
        step = np.linalg.solve(hessian + 1e-9 * np.eye(len(weights)), gradient)
        weights -= step / max(1.0, np.abs(step).max())  # farther than 1 Newton's step may miss
        if np.abs(step).max() < 1e-8:
            break
    return weights


def fit_one(name, values, said, truth):
    """Prints one sign's weight, the others held: their odds are those of the tables, which the program said with this weight at 0."""
    said = np.clip(said, 1e-6, 1.0 - 1e-6)
    others = np.log(said / (1.0 - said))
    weight = 0.0
    for _ in range(100):
        chance = 1.0 / (1.0 + np.exp(-others - weight * values))
        step = (values @ (truth - chance) - weight) / (values * values @ (chance * (1.0 - chance)) + 1.0)
        weight += step
        if abs(step) < 1e-8:
            break
    print(f"{name:20s} {weight:6.2f}")
    for low in np.arange(0.0, 1.0, 0.1):
        inside = (values > 0) & (chance >= low) & (chance < low + 0.1)
        if inside.any():
            print(f"said {low:.1f} to {low + 0.1:.1f}: {inside.sum()}, mean {chance[inside].mean():.2f}, "
                  f"before {said[inside].mean():.2f}, true {truth[inside].mean():.2f}")


def say(kind, weights, source, target):
    """Writes a table with what the weights say in its column of probabilities."""
    with open(source, newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    for row in rows:
        signs = np.array(signs_of(head, row), float)
        chance = 1.0 / (1.0 + np.exp(-float(np.append(signs, 1.0) @ weights)))
        row[4] = f"{limited(kind, signs_of(head, head), signs, chance):.4f}"
    with open(target, "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([head, *rows])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=sorted(BEFORE))
    parser.add_argument("tables", nargs="+", metavar="table")
    parser.add_argument("--wrong", action="store_true", help="list what is told wrongly")
    parser.add_argument("--only", metavar="SIGN", help="fit the weight of one sign that has none yet; the others stay as they are")
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
    signs = np.array([signs_of(head, row) for row in rows], float)
    names = signs_of(head, head)
    artery = np.array([float(row[2]) > 0.5 for row in rows])
    what = {"links": "links", "tips": "vessels that go on", "branches": "veins", "placements": "in their places"}[arguments.kind]
    truth = (~artery if arguments.kind == "branches" else artery).astype(float)
    distance = np.array([float(row[-1]) if head[-1] == NO_SIGN else np.nan for row in rows])
    if arguments.only:
        if arguments.only not in names:
            sys.exit(f"there is no sign '{arguments.only}'; there are {', '.join(names)}")
        fit_one(arguments.only, signs[:, names.index(arguments.only)], np.array([float(row[4]) for row in rows]), truth)
        return
    hearts = [row[0] + row[1] for row in rows]
    fold = {heart: n % FOLDS for n, heart in enumerate(dict.fromkeys(hearts))}
    folds = np.array([fold[heart] for heart in hearts])
    data = np.column_stack([signs, np.ones(len(rows))])
    odds = np.zeros(len(rows))
    for n in range(min(FOLDS, len(fold))):
        odds[folds == n] = data[folds == n] @ fit(
            arguments.kind, names, signs[folds != n], truth[folds != n], distance[folds != n])
    print(f"{len(rows)} rows of {len(fold)} hearts, {int(truth.sum())} of them {what}")
    weights = fit(arguments.kind, names, signs, truth, distance)
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
