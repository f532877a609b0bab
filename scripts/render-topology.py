#!/usr/bin/env pvpython
"""The named coronary trees of three phantoms, right, left and balanced dominance.

  xvfb-run -a pvpython scripts/render-topology.py PLUGIN.so OUTPUT.png
"""
import sys

from paraview import simple
from vtkmodules.vtkRenderingCore import vtkBillboardTextActor3D

import pictures

SIZE = (2100, 900)
COLOURS = [(0.90, 0.30, 0.25), (0.95, 0.65, 0.20), (0.95, 0.90, 0.35), (0.45, 0.80, 0.40),
           (0.30, 0.70, 0.90), (0.45, 0.50, 0.95), (0.80, 0.45, 0.90), (0.95, 0.55, 0.70),
           (0.60, 0.85, 0.75), (0.75, 0.70, 0.60)]


def panel(dominance, viewport, seed):
    phantom = simple.CoronaryPhantom(Seed=seed, Dominance=dominance, RamusIntermedius=1)
    topology = simple.CoronaryTreeTopology(Input=simple.OutputPort(phantom, 1))
    tree, bifurcations = (pictures.fetch(topology, port) for port in (0, 1))
    found = tree.GetFieldData().GetAbstractArray("Dominance").GetValue(0)
    if found != dominance.lower():
        sys.exit("FAILED: %s dominance was taken for %s" % (dominance, found))
    renderer = pictures.new_renderer()
    renderer.SetViewport(viewport)
    ids = tree.GetCellData().GetArray("SegmentIds")
    names = tree.GetCellData().GetAbstractArray("SegmentLabel")
    lengths = tree.GetCellData().GetArray("Length")
    longest = {}
    for cell in range(tree.GetNumberOfCells()):
        line = tree.GetCell(cell).GetPointIds()
        places = [tree.GetPoint(line.GetId(i)) for i in range(line.GetNumberOfIds())]
        pictures.add_plain(renderer, pictures.tube(pictures.polyline(places), 1.1, 12),
                           COLOURS[int(ids.GetValue(cell)) % len(COLOURS)]).GetProperty().SetSpecular(0.3)
        name = names.GetValue(cell)
        if name not in longest or lengths.GetValue(cell) > longest[name][0]:
            longest[name] = (lengths.GetValue(cell), places[len(places) // 2])
    for i in range(bifurcations.GetNumberOfPoints()):
        pictures.add_plain(renderer, pictures.ball(bifurcations.GetPoint(i), 1.6), (0.95, 0.95, 0.95))
    for name, (_, place) in longest.items():
        # Towards the viewer, so that no vessel hides a name; with parallel rays it stays in place.
        place = [place[i] + 150.0 * pictures.TOWARDS_VIEWER[i] for i in range(3)]
        text = vtkBillboardTextActor3D()
        text.SetInput(name)
        text.SetPosition(place)
        text.SetDisplayOffset(9, 6)
        text.GetTextProperty().SetFontSize(20)
        text.GetTextProperty().SetColor(1, 1, 1)
        renderer.AddActor(text)
    pictures.add_text(renderer, "%s dominance" % dominance, 20, SIZE[1] - 50, 28)
    pictures.look_at_phantom(renderer, 80.0)
    return renderer


simple.LoadPlugin(sys.argv[1], remote=False, ns=vars(simple))
pictures.save(pictures.off_screen(SIZE, [
    panel(kind, (column / 3.0, 0.0, (column + 1) / 3.0, 1.0), 5 + column)
    for column, kind in enumerate(("Right", "Left", "Balanced"))]), sys.argv[2])
