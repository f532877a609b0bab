#!/usr/bin/python3
"""Flow in tubes meshed, moved and written as vessels are, solved by OpenFOAM, beside closed forms.

Usage: scripts/validate-flow.py [--build build/paraview] [--output build/validate-flow] [--fine] [--only steady|womersley|moving|pulsing]

  steady    Poiseuille: wall shear and loss of pressure of a developed flow, within 2 %
  womersley flow that swings by half its mean: wall shear and gradient of pressure, in size and phase, within 2 %
  moving    the same tube swaying: its wall shear as that of the tube at rest, within 1 %
  pulsing   a tube without inflow that widens and narrows: what leaves it is what its volume loses, within 0.1 %

Closed forms are those of a circle of the area that the faceted sections have. Exit code 1 when one is beyond its limit, 77 when
OpenFOAM is not installed. It takes some minutes of one core; --fine takes edges of 0.3 radii instead of 0.4.
"""
import argparse
import json
import os
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import numpy  # noqa: E402

import foam_case  # noqa: E402

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def solve(arguments, kind, *options):
    case = os.path.join(arguments.output, kind)
    shutil.rmtree(case, ignore_errors=True)
    made = subprocess.run([os.path.join(arguments.build, "bin", "flow-tube"), "--kind", kind, "--output", case,
                           "--edge", "0.3" if arguments.fine else "0.4", *options], check=True, stdout=subprocess.PIPE)
    subprocess.run(["sh", os.path.join(case, "Allrun")], check=True)
    return case, json.loads(made.stdout)


def slab(centres, length, low, high):
    return (centres[:, 2] > low * length) & (centres[:, 2] < high * length)


def shear(case, time, mesh, low, high, length, centres):
    """Mean size of the wall shear (over density) between two parts of the tube, of places at rest."""
    here = slab(centres, length, low, high)
    sizes = numpy.linalg.norm(mesh.areas("wall"), axis=1)[here]
    values = numpy.linalg.norm(foam_case.patch_field(case, time, "wallShearStress", "wall", 3), axis=1)[here]
    return (values * sizes).sum() / sizes.sum()


def poiseuille(arguments, result):
    case, tube = solve(arguments, "steady", "--length", "20", "--layers", "5")
    mesh = foam_case.Mesh(case)
    time = foam_case.times_of(case)[-1]
    length = tube["length"]
    area = mesh.volume() / length
    radius = numpy.sqrt(area / numpy.pi)
    speed = tube["flow"] / area
    wall = shear(case, time, mesh, 0.6, 0.9, length, mesh.centres("wall"))
    cells = mesh.cell_centres()
    here = slab(cells, length, 0.6, 0.9)
    slope = -numpy.polyfit(cells[here, 2], foam_case.internal_field(case, time, "p", 1)[here], 1)[0]
    result("steady: wall shear against 4 nu U / R", wall / (4.0 * tube["nu"] * speed / radius) - 1.0, 0.02)
    result("steady: loss of pressure against 8 nu U / R^2", slope / (8.0 * tube["nu"] * speed / radius**2) - 1.0, 0.02)


def bessel(order, z):
    """J0 or J1 of a complex number of a few units, by its series."""
    term = (0.5 * z) ** order
    total = term
    for k in range(1, 40):
        term = -term * (0.5 * z) ** 2 / (k * (k + order))
        total = total + term
    return total


def womersley(arguments, result):
    # Slow: what enters as a plug is developed soon.
    case, tube = solve(arguments, "womersley", "--length", "20", "--layers", "5", "--steps", "200", "--reynolds", "15")
    mesh = foam_case.Mesh(case)
    length = tube["length"]
    radius = numpy.sqrt(mesh.volume() / length / numpy.pi)
    omega = 2.0 * numpy.pi / tube["cycle"]
    beta = numpy.sqrt(-1j * omega * radius**2 / tube["nu"])
    ratio = bessel(1, beta) / bessel(0, beta)
    gradient = 1j * omega * 0.5 * tube["flow"] / (numpy.pi * radius**2 * (1.0 - 2.0 * ratio / beta))
    exact = {"wall shear": -tube["nu"] * beta / radius * ratio * gradient / (1j * omega), "gradient of pressure": gradient}
    cells = mesh.cell_centres()
    wall = mesh.centres("wall")
    inner = slab(cells, length, 0.6, 0.9)
    swing = {name: 0.0 for name in exact}
    times = foam_case.times_of(case)[-20:]  # the last cycle
    for time in times:
        turn = 2.0 / len(times) * numpy.exp(-1j * omega * float(time))
        swing["wall shear"] += turn * shear(case, time, mesh, 0.6, 0.9, length, wall)
        pressure = foam_case.internal_field(case, time, "p", 1)[inner]
        swing["gradient of pressure"] -= turn * numpy.polyfit(cells[inner, 2], pressure, 1)[0]
    for name, value in exact.items():
        result("womersley: swing of the %s, size and phase" % name, abs(swing[name] / value - 1.0), 0.02)


def moving(arguments, result):
    options = ("--length", "12", "--layers", "4", "--steps", "200", "--frames", "200")
    values = []
    centres = None
    for kind in ("rest", "moving"):
        case, tube = solve(arguments, kind, *options)
        mesh = foam_case.Mesh(case)
        centres = mesh.centres("wall") if centres is None else centres
        times = foam_case.times_of(case)
        own = []
        for time in times[len(times) // 2 - 1:]:
            mesh.move(case, time)
            own.append(shear(case, time, mesh, 0.4, 0.8, tube["length"], centres))
        values.append(numpy.array(own))
        into = -foam_case.series(case, "flow_inlet")[1]
        out = foam_case.series(case, "flow_outlet")[1]
        result(kind + ": what enters leaves", numpy.abs(out - into)[5:].max() / tube["flow"], 0.001)
    result("moving: wall shear against the tube at rest", numpy.abs(values[1] / values[0] - 1.0).max(), 0.01)


def pulsing(arguments, result):
    case, tube = solve(arguments, "pulsing", "--length", "8", "--layers", "3", "--steps", "200", "--frames", "200")
    mesh = foam_case.Mesh(case)
    times, out = foam_case.series(case, "flow_outlet")
    into = foam_case.series(case, "flow_inlet")[1]
    # The volume of all points at each frame, which is a step: sections widen by the same factor, lengths stay.
    step = times[1] - times[0]
    cycle = step * round(0.5 / step)
    factor = 1.0 + 0.05 * 0.5 * (1.0 - numpy.cos(2.0 * numpy.pi * numpy.append(0.0, times) / cycle))
    volume = mesh.volume() * factor**2
    # Of each step, as backward differences of second order.
    change = numpy.diff(volume) / step
    change[1:] = 1.5 * change[1:] - 0.5 * change[:-1].copy()
    error = numpy.abs(out + into + change)[1:]
    result("pulsing: flow out of the ends against the volume swept", error.max() / numpy.abs(change).max(), 0.001)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--build", default=os.path.join(ROOT, "build", "paraview"))
    parser.add_argument("--output", default=os.path.join(ROOT, "build", "validate-flow"))
    parser.add_argument("--fine", action="store_true", help="edges of 0.3 radii")
    checks = {"steady": poiseuille, "womersley": womersley, "moving": moving, "pulsing": pulsing}
    parser.add_argument("--only", choices=checks)
    arguments = parser.parse_args()
    if not shutil.which("simpleFoam"):
        print("OpenFOAM is not installed: scripts/install-dependencies.sh --flow", file=sys.stderr)
        return 77
    os.makedirs(arguments.output, exist_ok=True)
    bad = []

    def result(what, error, limit):
        good = abs(error) <= limit
        print("%-65s %+8.3f %%  (limit %.1f %%)%s" % (what, 100 * error, 100 * limit, "" if good else "  MISSED"), flush=True)
        if not good:
            bad.append(what)

    for name, check in checks.items():
        if arguments.only in (None, name):
            check(arguments, result)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
