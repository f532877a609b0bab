#!/usr/bin/python3
"""Curves and numbers of two cases of one tree, with walls that move and at rest: scripts/demo-flow.sh.

Usage: scripts/flow-results.py MOVING REST --output DIR

Writes flow.png (inflow, outflows, loss of pressure over time) and motion.txt: time-averaged wall shear (TAWSS), oscillatory
shear index (OSI) and loss of pressure of both, area by area, over the last cycle as far as it was simulated.
"""
import argparse
import os
import re
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import numpy  # noqa: E402

import foam_case  # noqa: E402

DENSITY = 1060.0  # kg/m^3
PASCAL = 133.322387415


def ends(case):
    folder = os.path.join(case, "postProcessing")
    return sorted(name[len("flow_"):] for name in os.listdir(folder) if name.startswith("flow_"))


def losses(case):
    """Times, and from the inlet to each outlet: mmHg."""
    times, inlet = foam_case.series(case, "pressure_inlet")
    return times, {name: DENSITY / PASCAL * (inlet - foam_case.series(case, "pressure_" + name)[1])
                   for name in ends(case) if name != "inlet"}


def shear(case):
    """Of the faces of the wall: TAWSS in Pa and OSI, or None when the last cycle was not reached."""
    time = foam_case.times_of(case)[-1]
    if not os.path.exists(os.path.join(case, time, "wallShearSizeMean")):
        return None
    mean = foam_case.patch_field(case, time, "wallShearStressMean", "wall", 3)
    size = foam_case.patch_field(case, time, "wallShearSizeMean", "wall", 1)
    return DENSITY * size, 0.5 * (1.0 - numpy.linalg.norm(mean, axis=1) / numpy.maximum(size, 1e-300))


def control(case, pattern):
    with open(os.path.join(case, "system", "controlDict"), encoding="utf-8") as file:
        return float(re.search(pattern, file.read(), re.M).group(1))


def unrest(case, begin):
    """Wall shear at the end of the cycle less that at its beginning, over the latter (root mean squares); None: not written."""
    times = foam_case.times_of(case)
    first = min(times, key=lambda time: abs(float(time) - begin))
    if abs(float(first) - begin) > 1e-6 or first == times[-1]:
        return None
    fields = [foam_case.patch_field(case, time, "wallShearStress", "wall", 3) for time in (first, times[-1])]
    return numpy.linalg.norm(fields[1] - fields[0]) / numpy.linalg.norm(fields[0])


def draw(cases, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4))
    for label, case in cases.items():
        style = "-" if label == "moving" else "--"
        for name in ends(case):
            times, flow = foam_case.series(case, "flow_" + name)
            axes[0].plot(times, 1e6 * numpy.abs(flow), style, label="%s, %s" % (name, label), linewidth=1)
        times, loss = losses(case)
        for name, values in loss.items():
            axes[1].plot(times, values, style, label="%s, %s" % (name, label), linewidth=1)
    axes[0].set_ylabel("flow, mL/s")
    axes[1].set_ylabel("pressure lost from the inlet, mmHg")
    for axis in axes:
        axis.set_xlabel("time, s")
    axes[0].legend(fontsize=5)
    figure.tight_layout()
    figure.savefig(path, dpi=150)


def line(name, moving, rest):
    change = 100.0 * (moving / rest - 1.0) if rest else float("nan")
    return "%-42s %12.5g %12.5g %+9.2f %%\n" % (name, moving, rest, change)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("moving")
    parser.add_argument("rest")
    parser.add_argument("--output", required=True)
    arguments = parser.parse_args()
    cases = {"moving": arguments.moving, "rest": arguments.rest}
    os.makedirs(arguments.output, exist_ok=True)
    draw(cases, os.path.join(arguments.output, "flow.png"))
    text = "%-42s %12s %12s %11s\n" % ("", "moving", "at rest", "change")
    loss = {}
    for label, case in cases.items():
        step = control(case, r"^deltaT (\S+);")
        begin = control(case, r"timeStart (\S+);") - 0.5 * step
        times, values = losses(case)
        # The first steps are an impulse.
        late = (times > begin) & (times > min(5.5, len(times) - 0.5) * step)
        loss[label] = {name: value[late].mean() for name, value in values.items()}
        text += "%s: %d steps of %g s, to %g s; the cycle begins at %g s" % (label, len(times), step, times[-1], begin)
        rest = unrest(case, begin)
        text += "\n" if rest is None else ", wall shear is %.2f %% off at its end\n" % (100.0 * rest)
    for name in loss["moving"]:
        text += line("mean loss to %s, mmHg" % name, loss["moving"][name], loss["rest"][name])
    fields = {label: shear(case) for label, case in cases.items()}
    if all(fields.values()):
        for k, name in enumerate(("TAWSS, Pa", "OSI")):
            for what, of in (("median", numpy.median), ("mean", numpy.mean), ("95th percentile", lambda v: numpy.percentile(v, 95))):
                text += line("%s of %s over the wall's faces" % (what, name), of(fields["moving"][k]), of(fields["rest"][k]))
        both = [fields[label][0] for label in ("moving", "rest")]
        text += "correlation of TAWSS, face by face: %.4f\n" % numpy.corrcoef(both[0], both[1])[0, 1]
    else:
        text += "The last cycle was not reached: no means of the wall shear.\n"
    with open(os.path.join(arguments.output, "motion.txt"), "w", encoding="utf-8") as file:
        file.write(text)


if __name__ == "__main__":
    main()
