#!/usr/bin/env pvpython
"""A picture of the vesselness of a phantom: the image, two of the measures, and the scale.

  xvfb-run -a pvpython scripts/render-vesselness.py PLUGIN.so --output docs/pictures/vesselness.png
"""
import argparse
import os

from paraview import simple
from vtkmodules.vtkCommonCore import vtkLookupTable
from vtkmodules.vtkImagingCore import vtkImageMapToColors, vtkImageReslice
from vtkmodules.vtkRenderingAnnotation import vtkScalarBarActor
from vtkmodules.vtkRenderingCore import vtkImageActor, vtkRenderer, vtkTextActor

import pictures

SLAB = 20.0  # mm
PANEL = (620, 560)


def image_of(proxy, name):
    """The image of a proxy, with one of its arrays as the scalars."""
    image = pictures.fetch(proxy)
    image.GetPointData().SetActiveScalars(name)
    return image


def table(low, high, hue, saturation, value):
    colors = vtkLookupTable()
    colors.SetNumberOfTableValues(256)
    colors.SetTableRange(low, high)
    colors.SetHueRange(*hue)
    colors.SetSaturationRange(*saturation)
    colors.SetValueRange(*value)
    colors.Build()
    return colors


def slab(image):
    """Maximum over the axial slab in the middle, seen from the feet."""
    spacing = image.GetSpacing()
    bounds = image.GetBounds()
    cut = vtkImageReslice()
    cut.SetInputData(image)
    cut.SetOutputDimensionality(2)
    cut.SetResliceAxesDirectionCosines(1, 0, 0, 0, -1, 0, 0, 0, -1)
    cut.SetResliceAxesOrigin(*[0.5 * (bounds[2 * a] + bounds[2 * a + 1]) for a in range(3)])
    cut.SetInterpolationModeToLinear()
    cut.SetSlabModeToMax()
    cut.SetSlabNumberOfSlices(max(1, int(SLAB / spacing[2])))
    cut.SetOutputSpacing(0.25, 0.25, spacing[2])
    half = [int(0.5 * (bounds[2 * a + 1] - bounds[2 * a]) / 0.25) for a in range(2)]
    cut.SetOutputOrigin(-half[0] * 0.25, -half[1] * 0.25, 0.0)
    cut.SetOutputExtent(0, 2 * half[0], 0, 2 * half[1], 0, 0)
    cut.SetBackgroundLevel(-1024)
    cut.Update()
    return cut.GetOutput()


def add_panel(window, column, row, image, colors, title, unit):
    renderer = vtkRenderer()
    renderer.SetViewport(0.5 * column, 0.5 * (1 - row), 0.5 * (column + 1), 0.5 * (2 - row))
    renderer.SetBackground(0.04, 0.05, 0.07)
    window.AddRenderer(renderer)
    painted = vtkImageMapToColors()
    painted.SetInputData(image)
    painted.SetLookupTable(colors)
    actor = vtkImageActor()
    actor.GetMapper().SetInputConnection(painted.GetOutputPort())
    renderer.AddActor(actor)
    text = vtkTextActor()
    text.SetInput(title)
    text.GetTextProperty().SetFontSize(22)
    text.GetTextProperty().BoldOn()
    text.SetPosition(14, PANEL[1] - 36)
    renderer.AddViewProp(text)
    bar = vtkScalarBarActor()
    bar.SetLookupTable(colors)
    bar.SetTitle(unit)
    bar.SetNumberOfLabels(5)
    bar.UnconstrainedFontSizeOn()
    bar.GetLabelTextProperty().SetFontSize(15)
    bar.GetTitleTextProperty().SetFontSize(15)
    bar.SetPosition(0.88, 0.05)
    bar.SetWidth(0.10)
    bar.SetHeight(0.45)
    renderer.AddViewProp(bar)
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    renderer.ResetCamera()
    extent = image.GetExtent()
    camera.SetParallelScale(0.5 * (extent[3] - extent[2]) * image.GetSpacing()[1])


def main():
    parser = argparse.ArgumentParser(description="A picture of the vesselness of a phantom.")
    parser.add_argument("plugin", help="DynamicCoronaryPlugin.so")
    parser.add_argument("--output", default="vesselness.png")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    simple.LoadPlugin(os.path.abspath(arguments.plugin), remote=False, ns=vars(simple))

    phantom = simple.CoronaryPhantom(Seed=arguments.seed)
    phantom.Spacing = [0.5, 0.5, 0.5]
    phantom.AutomaticGrid = 0
    phantom.Origin = [-70.0, -60.0, -50.0]
    phantom.Dimensions = [232, 190, 70]
    phase = simple.ReferencePhase(simple.OutputPort(phantom, 0), Automatic=0, Time=0.75)
    phase.UpdatePipeline()
    frangi = simple.FrangiVesselness(phase, GenerateScale=1, AutomaticC=0, C=100.0)
    jerman = simple.FrangiVesselness(phase, Method="Jerman")

    window = pictures.off_screen((2 * PANEL[0], 2 * PANEL[1]), [], 0)
    gray = table(-150.0, 650.0, (0, 0), (0, 0), (0, 1))
    warm = table(0.0, 1.0, (0.0, 0.15), (0.9, 0.35), (0.0, 1.0))
    add_panel(window, 0, 0, slab(image_of(phase, "HU")), gray,
              "CT, maximum of a slab of %.0f mm" % SLAB, "HU")
    add_panel(window, 1, 0, slab(image_of(frangi, "Vesselness")), warm, "Frangi, C = 100 HU", "")
    add_panel(window, 0, 1, slab(image_of(jerman, "Vesselness")), warm, "Jerman, Tau = 0.75", "")
    # Where there is a vessel; elsewhere the scale means nothing.
    image = image_of(frangi, "VesselScale")
    scales, values = (image.GetPointData().GetArray(n) for n in ("VesselScale", "Vesselness"))
    for n in range(scales.GetNumberOfValues()):
        if values.GetValue(n) < 0.15:
            scales.SetValue(n, 0.0)
    rainbow = table(0.4, 2.6, (0.66, 0.0), (0.8, 0.8), (1.0, 1.0))
    rainbow.SetBelowRangeColor(0.04, 0.05, 0.07, 1.0)
    rainbow.UseBelowRangeColorOn()
    add_panel(window, 1, 1, slab(image), rainbow, "Scale of the maximum (Frangi above 0.15)", "mm")
    pictures.save(window, arguments.output)


main()
