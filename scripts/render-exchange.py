#!/usr/bin/env pvpython
"""The surface of a segmentation of 3D Slicer with markup curves over it.

  xvfb-run -a pvpython scripts/render-exchange.py PLUGIN.so MASK.seg.nrrd CURVES.mrk.json OUTPUT.png
"""
import json
import sys

from paraview import simple
from vtkmodules.vtkRenderingCore import vtkBillboardTextActor3D

import pictures

SIZE = (1400, 1000)


def main(plugin, mask, markups, output):
    simple.LoadPlugin(plugin, ns=vars(simple))
    reader = simple.SegmentationReader(FileNames=[mask])
    contour = simple.Contour(Input=reader, ContourBy=["POINTS", "VesselMask"], Isosurfaces=[0.5])
    renderer = pictures.new_renderer()
    pictures.add_plain(renderer, pictures.fetch(contour), (0.85, 0.35, 0.30), 0.45)
    with open(markups, encoding="utf-8") as file:
        curves = json.load(file)["markups"]
    for curve in curves:
        places = [point["position"] for point in curve["controlPoints"]]
        pictures.add_plain(renderer, pictures.tube(pictures.polyline(places), 0.35, 12), (0.95, 0.85, 0.25))
        label = vtkBillboardTextActor3D()
        label.SetInput(curve["name"])
        label.SetPosition(places[len(places) // 2])
        label.GetTextProperty().SetFontSize(20)
        renderer.AddActor(label)
    window = pictures.off_screen(SIZE, [renderer])
    camera = renderer.GetActiveCamera()
    camera.SetFocalPoint(0, 0, 0)
    camera.SetPosition(*pictures.TOWARDS_VIEWER)
    camera.SetViewUp(0, 0, 1)
    renderer.ResetCamera()
    camera.Zoom(1.3)
    pictures.save(window, output)
    print("%d curves" % len(curves))


if __name__ == "__main__":
    main(*sys.argv[1:])
