#!/usr/bin/env pvpython
"""Pictures of what `coronary-pipeline run` wrote.

  xvfb-run -a pvpython scripts/render-segmentation.py demo-output/run --output demo-output/pictures
  ... [--truth demo-output/phantom/truth/surface_12.vtp]

vesselness.png    vesselness, maximum intensity projections along three axes
segmentation.png  the segmented lumen (red) with aorta and ostia from three sides; over the true
                  surface (green) when it is given
"""
import argparse
import json
import os
import sys

from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
from vtkmodules.vtkCommonTransforms import vtkMatrixToLinearTransform
from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D, vtkWindowedSincPolyDataFilter
from vtkmodules.vtkFiltersGeneral import vtkTransformPolyDataFilter
from vtkmodules.vtkImagingCore import vtkImageConstantPad
from vtkmodules.vtkRenderingCore import vtkColorTransferFunction, vtkVolume, vtkVolumeProperty
from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkSmartVolumeMapper

import pictures

FOUND = (0.90, 0.28, 0.24)
TRUE = (0.35, 0.80, 0.40)
AORTA = (0.55, 0.60, 0.70)
OSTIUM = (1.0, 0.88, 0.35)


def mask_surface(volume):
    pad = vtkImageConstantPad()  # closes what the image's border cuts
    pad.SetInputData(volume.image)
    extent = list(volume.image.GetExtent())
    pad.SetOutputWholeExtent([e + (1 if n % 2 else -1) for n, e in enumerate(extent)])
    pad.SetConstant(0)
    contour = vtkFlyingEdges3D()
    contour.SetInputConnection(pad.GetOutputPort())
    contour.SetValue(0, 0.5)
    smooth = vtkWindowedSincPolyDataFilter()
    smooth.SetInputConnection(contour.GetOutputPort())
    smooth.SetNumberOfIterations(15)
    smooth.SetPassBand(0.1)
    smooth.NormalizeCoordinatesOn()
    transform = vtkMatrixToLinearTransform()
    transform.SetInput(volume.matrix())
    place = vtkTransformPolyDataFilter()
    place.SetInputConnection(smooth.GetOutputPort())
    place.SetTransform(transform)
    place.Update()
    return place.GetOutput()


def picture_segmentation(report, folder, truth, output):
    part = report["segmentation"]
    mask = pictures.Volume(os.path.join(folder, part["file"]))
    surface = mask_surface(mask)
    if surface.GetNumberOfPoints() == 0:
        pictures.fail("the mask is empty")
    seeds = pictures.read_poly(os.path.join(folder, part["seeds_file"]))
    aorta = pictures.read_poly(os.path.join(folder, part["aorta_file"]))
    bounds = surface.GetBounds()
    center = [0.5 * (bounds[2 * a] + bounds[2 * a + 1]) for a in range(3)]
    size = max(bounds[2 * a + 1] - bounds[2 * a] for a in range(3))
    names = ["%s %.2f" % (s["name"], s["confidence"]) for s in part["seeds"]]
    window, made = pictures.panels("Segmentation at %.0f %% of R-R; seeds and their confidence: %s"
                          % (100.0 * report["time"], ", ".join(names)))
    for panel, (_, eye, up) in zip(made, pictures.VIEWS):
        pictures.add_surface(panel, surface, color=FOUND)
        if truth:
            pictures.add_surface(panel, truth, color=TRUE, opacity=0.35)
        if aorta.GetNumberOfPoints() > 1:
            pictures.add_surface(panel, pictures.tube(aorta, 1.0), color=AORTA)
        for p in range(seeds.GetNumberOfPoints()):
            pictures.add_surface(panel, pictures.ball(seeds.GetPoint(p), 2.0), color=OSTIUM)
        pictures.look_at(panel, center, eye, up, 0.95 * size)
    pictures.save(window, output, "segmentation.png")


def picture_vesselness(report, folder, output):
    volume = pictures.Volume(os.path.join(folder, report["vesselness"]["file"]))
    bounds = volume.world_bounds()
    center = [0.5 * (low + high) for low, high in bounds]
    size = max(high - low for low, high in bounds)
    window, made = pictures.panels("Vesselness, maximum along the line of sight (c = %.0f HU)"
                          % report["vesselness"]["c"])
    for panel, (_, eye, up) in zip(made, pictures.VIEWS):
        mapper = vtkSmartVolumeMapper()
        mapper.SetInputData(volume.image)
        mapper.SetBlendModeToMaximumIntensity()
        colors = vtkColorTransferFunction()
        for value, color in ((0.0, (0, 0, 0)), (0.3, (0.5, 0.12, 0.1)), (0.7, (0.98, 0.66, 0.25)),
                             (1.0, (1.0, 1.0, 0.9))):
            colors.AddRGBPoint(value, *color)
        opacity = vtkPiecewiseFunction()
        opacity.AddPoint(0.0, 0.0)
        opacity.AddPoint(0.15, 1.0)
        properties = vtkVolumeProperty()
        properties.SetColor(colors)
        properties.SetScalarOpacity(opacity)
        properties.SetInterpolationTypeToLinear()
        actor = vtkVolume()
        actor.SetMapper(mapper)
        actor.SetProperty(properties)
        actor.SetUserMatrix(volume.matrix())
        panel.AddVolume(actor)
        pictures.look_at(panel, center, eye, up, 0.95 * size)
    pictures.save(window, output, "vesselness.png")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", help="what coronary-pipeline run wrote")
    parser.add_argument("--output", required=True, help="folder for the pictures")
    parser.add_argument("--truth", help="true surface at the same time, .vtp")
    arguments = parser.parse_args()
    try:
        with open(os.path.join(arguments.folder, "report.json"), encoding="utf-8") as stream:
            report = json.load(stream)
    except (OSError, ValueError) as error:
        sys.exit("render-segmentation: %s" % error)
    os.makedirs(arguments.output, exist_ok=True)
    picture_vesselness(report, arguments.folder, arguments.output)
    if "segmentation" in report:
        truth = pictures.read_poly(arguments.truth) if arguments.truth else None
        picture_segmentation(report, arguments.folder, truth, arguments.output)


if __name__ == "__main__":
    main()
