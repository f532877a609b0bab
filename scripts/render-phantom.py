#!/usr/bin/env pvpython
"""Pictures of a series that `coronary-pipeline phantom` wrote.

  xvfb-run -a pvpython scripts/render-phantom.py demo-output/phantom --output demo-output/pictures

tree.png           lumen and great cardiac vein at two phases, one colour a branch
slices.png         axial, coronal and sagittal slices at the same phases, truth outlined
rendering.png      volume rendering, and a maximum intensity projection of a slab
contact-sheet.png  one axial slice over all phases
"""
import argparse
import json
import math
import os
import sys

from vtkmodules.vtkCommonCore import vtkLogger, vtkLookupTable
from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction, vtkPlane
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkCommonTransforms import vtkMatrixToLinearTransform
from vtkmodules.vtkFiltersCore import vtkCutter
from vtkmodules.vtkFiltersGeneral import vtkTransformPolyDataFilter
from vtkmodules.vtkImagingCore import vtkImageMapToColors, vtkImageReslice
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkBillboardTextActor3D,
    vtkColorTransferFunction,
    vtkImageActor,
    vtkPolyDataMapper,
    vtkVolume,
    vtkVolumeProperty,
)
from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkSmartVolumeMapper

from pictures import (
    BACKGROUND,
    FAINT,
    SIZE,
    TEXT,
    Volume,
    add_panel,
    add_scale_bar,
    add_surface,
    add_text,
    branch_colors,
    branches,
    cross,
    dot,
    fail,
    look_at,
    new_window,
    read_poly,
    save,
    tube,
    unit,
)

TRUTH = (1.0, 0.78, 0.15)
VEIN = (0.36, 0.50, 0.78)
WINDOW = (-150.0, 650.0)  # HU

# ---------------------------------------------------------------------------------------- input

class Phase:
    def __init__(self, folder, entry):
        truth = entry.get("truth", {})
        self.fraction = float(entry["fraction"])
        self.image = os.path.join(folder, entry["image"])
        self.surface = os.path.join(folder, truth["surface"])
        self.centerline = os.path.join(folder, truth["centerline"])
        vein = truth.get("vein", truth["surface"].replace("surface", "vein"))
        self.vein = os.path.join(folder, vein)

    def label(self):
        return "%.0f %% of R-R" % (100.0 * self.fraction)


# -------------------------------------------------------------------------------------- drawing

# --------------------------------------------------------------------------------------- slices

# Radiological convention in LPS: the patient's right on the left, anterior or superior on top.
PLANES = {
    "axial": ((1, 0, 0), (0, -1, 0), 2, "z"),
    "coronal": ((1, 0, 0), (0, 0, 1), 1, "y"),
    "sagittal": ((0, 1, 0), (0, 0, 1), 0, "x"),
}


class Slice:
    """A plane through the world, with its pixel grid."""

    def __init__(self, volume, plane, position):
        self.u, self.v, self.axis, self.letter = PLANES[plane]
        self.name, self.position = plane, position
        bounds = volume.world_bounds()
        self.center = [0.5 * sum(b) for b in bounds]
        self.center[self.axis] = position
        self.half = [0.5 * sum(abs(e) * (b[1] - b[0]) for e, b in zip(axis, bounds))
                     for axis in (self.u, self.v)]

    def cut_image(self, volume, thickness=0.0):
        normal = cross(self.u, self.v)
        start = volume.to_local([c - o for c, o in zip(self.center, volume.origin)])
        matrix = vtkMatrix4x4()
        for column, axis in enumerate((self.u, self.v, normal)):
            for row, value in enumerate(volume.to_local(axis)):
                matrix.SetElement(row, column, value)
        for row in range(3):
            matrix.SetElement(row, 3, start[row])
        step = min(volume.image.GetSpacing())
        counts = [int(h / step) for h in self.half]
        cut = vtkImageReslice()
        cut.SetInputData(volume.image)
        cut.SetResliceAxes(matrix)
        cut.SetOutputDimensionality(2)
        cut.SetInterpolationModeToLinear()
        cut.SetOutputSpacing(step, step, step)
        cut.SetOutputOrigin(-counts[0] * step, -counts[1] * step, 0.0)
        cut.SetOutputExtent(0, 2 * counts[0], 0, 2 * counts[1], 0, 0)
        cut.SetBackgroundLevel(-1024)
        if thickness > 0.0:
            cut.SetSlabModeToMax()
            cut.SetSlabNumberOfSlices(max(1, int(thickness / step)))
        cut.Update()
        return cut.GetOutput()

    def cut_surface(self, mesh):
        plane = vtkPlane()
        plane.SetOrigin(*self.center)
        plane.SetNormal(*cross(self.u, self.v))
        cutter = vtkCutter()
        cutter.SetInputData(mesh)
        cutter.SetCutFunction(plane)
        matrix = vtkMatrix4x4()
        for row, axis in enumerate((self.u, self.v, cross(self.u, self.v))):
            for column in range(3):
                matrix.SetElement(row, column, axis[column])
            matrix.SetElement(row, 3, -dot(axis, self.center))
        place = vtkMatrixToLinearTransform()
        place.SetInput(matrix)
        mover = vtkTransformPolyDataFilter()
        mover.SetInputConnection(cutter.GetOutputPort())
        mover.SetTransform(place)
        mover.Update()
        return mover.GetOutput()


def gray_table():
    table = vtkLookupTable()
    table.SetTableRange(*WINDOW)
    table.SetSaturationRange(0, 0)
    table.SetHueRange(0, 0)
    table.SetValueRange(0, 1)
    table.SetRampToLinear()
    table.Build()
    return table


def draw_slice(panel, picture, outline, scale, focus=(0.0, 0.0)):
    colors = vtkImageMapToColors()
    colors.SetInputData(picture)
    colors.SetLookupTable(gray_table())
    actor = vtkImageActor()
    actor.GetMapper().SetInputConnection(colors.GetOutputPort())
    panel.AddActor(actor)
    if outline is not None:
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(outline)
        mapper.ScalarVisibilityOff()
        line = vtkActor()
        line.SetMapper(mapper)
        line.SetPosition(0, 0, 1)
        line.GetProperty().SetColor(*TRUTH)
        line.GetProperty().SetLineWidth(1.6)
        line.GetProperty().LightingOff()
        panel.AddActor(line)
    look_at(panel, (focus[0], focus[1], 0.0), (0, 0, 1), (0, 1, 0), scale)


def busiest(tree, axis):
    """Where a plane across `axis` meets most lumen: the sum of the radii of the branches cut."""
    radius = tree.GetPointData().GetArray("MaximumInscribedSphereRadius")
    met = {}
    for group, _, _, ids in branches(tree):
        for point in ids:
            place = round(tree.GetPoint(point)[axis])
            groups = met.setdefault(place, {})
            groups[group] = max(groups.get(group, 0.0), radius.GetTuple1(point))
    return float(max(sorted(met), key=lambda place: sum(met[place].values())))


# ------------------------------------------------------------------------------------- pictures

def picture_tree(phases, title, folder):
    window, base = new_window()
    window.SetNumberOfLayers(2)
    trees = [read_poly(p.centerline) for p in phases]
    table = branch_colors(trees[0])
    view = unit((0.35, -1.0, 0.25))
    right = unit(cross((0, 0, 1), view))
    above = cross(view, right)
    points = [tree.GetPoint(i) for tree in trees for i in range(tree.GetNumberOfPoints())]
    width, height, top = SIZE[0] // 2, SIZE[1] - 70, SIZE[1] - 70
    center, scale = [0.0] * 3, 0.0
    for axis, pixels in ((right, width), (above, height)):
        along = [dot(axis, p) for p in points]
        middle = 0.5 * (min(along) + max(along))
        center = [c + middle * a for c, a in zip(center, axis)]
        scale = max(scale, 0.5 * (max(along) - min(along)) * height / pixels)
    scale *= 1.10
    for column, (phase, tree) in enumerate(zip(phases, trees)):
        x0 = column * width
        panel = add_panel(window, x0, 0, x0 + width, top, BACKGROUND)
        add_surface(panel, read_poly(phase.surface), table)
        if os.path.isfile(phase.vein):
            add_surface(panel, tube(read_poly(phase.vein)), None, VEIN)
        # Where the axes are at the other phase.
        other = add_surface(panel, tube(trees[1 - column], 0.3), None, FAINT)
        other.GetProperty().LightingOff()
        look_at(panel, center, view, (0, 0, 1), scale)

        # Names on a layer of their own: in front of the vessels, seen by the same camera.
        front = add_panel(window, x0, 0, x0 + width, top)
        front.SetLayer(1)
        front.SetActiveCamera(panel.GetActiveCamera())
        longest = {}
        for _, _, label, ids in branches(tree):
            if len(ids) > len(longest.get(label, ())):
                longest[label] = ids
        for label, ids in longest.items():
            tag = vtkBillboardTextActor3D()
            tag.SetInput(label)
            tag.SetPosition(*tree.GetPoint(ids[len(ids) // 2]))
            tag.SetDisplayOffset(9, 5)
            style = tag.GetTextProperty()
            style.SetFontFamilyToArial()
            style.SetFontSize(15)
            style.SetColor(*TEXT)
            style.ShadowOn()
            style.SetShadowOffset(1, -1)
            front.AddActor(tag)
        add_scale_bar(front, width, height)
        add_text(front, phase.label(), 24, height - 44, 26, bold=True)
        add_text(front, "thin grey lines: axes at " + phases[1 - column].label(),
                 24, height - 72, 17, FAINT)
    add_text(base, title, 24, SIZE[1] - 48, 28, bold=True)
    add_text(base, "lumen by branch, great cardiac vein in blue; seen from the front and left",
             SIZE[0] - 24, SIZE[1] - 44, 18, FAINT, align="right")
    save(window, folder, "tree.png")


def picture_slices(phases, title, folder):
    window, base = new_window()
    tree = read_poly(phases[0].centerline)
    places = {name: busiest(tree, PLANES[name][2]) for name in PLANES}
    gap, top = 8, SIZE[1] - 70
    width, height = (SIZE[0] - 4 * gap) // 3, (top - 2 * gap) // 2
    for row, phase in enumerate(phases):
        volume = Volume(phase.image)
        surface = read_poly(phase.surface)
        for column, name in enumerate(PLANES):
            x0 = gap + column * (width + gap)
            y0 = top - (row + 1) * height - row * gap
            panel = add_panel(window, x0, y0, x0 + width, y0 + height)
            cut = Slice(volume, name, places[name])
            scale = max(cut.half[1], cut.half[0] * height / width) * 0.92
            draw_slice(panel, cut.cut_image(volume), cut.cut_surface(surface), scale)
            add_scale_bar(panel, width, height)
            add_text(panel, phase.label(), 14, height - 34, 22, bold=True)
            add_text(panel, "%s, %s = %.1f mm" % (name, cut.letter, places[name]),
                     14, height - 58, 16, FAINT)
    add_text(base, title, 24, SIZE[1] - 48, 28, bold=True)
    add_text(base, "window %.0f to %.0f HU; yellow: exact lumen" % WINDOW,
             SIZE[0] - 24, SIZE[1] - 44, 18, FAINT, align="right")
    save(window, folder, "slices.png")


def picture_volume(phase, title, folder):
    window, base = new_window()
    volume = Volume(phase.image)
    bounds = volume.world_bounds()
    center = [0.5 * sum(b) for b in bounds]
    gap, top = 8, SIZE[1] - 70
    width, height = (SIZE[0] - 3 * gap) // 2, top - gap

    panel = add_panel(window, gap, gap, gap + width, top, BACKGROUND)
    mapper = vtkSmartVolumeMapper()
    mapper.SetInputData(volume.image)
    mapper.SetBlendModeToComposite()
    mapper.SetRequestedRenderModeToRayCast()
    mapper.SetSampleDistance(0.3)
    # The breastbone stands before the heart; keep what lies around the vessels.
    tree = read_poly(phase.centerline)
    reach = [(float("inf"), -float("inf"))] * 3
    for i in range(tree.GetNumberOfPoints()):
        local = volume.to_local([p - o for p, o in zip(tree.GetPoint(i), volume.origin)])
        reach = [(min(a, x), max(b, x)) for (a, b), x in zip(reach, local)]
    mapper.CroppingOn()
    mapper.SetCroppingRegionFlagsToSubVolume()
    mapper.SetCroppingRegionPlanes(*[x for a, b in reach for x in (a - 1.5, b + 1.5)])
    colors = vtkColorTransferFunction()
    for value, color in ((-200, (0.3, 0.2, 0.1)), (120, (0.55, 0.20, 0.15)),
                         (260, (0.85, 0.45, 0.28)), (400, (0.97, 0.84, 0.62)),
                         (600, (1.0, 0.98, 0.92))):
        colors.AddRGBPoint(value, *color)
    opacity = vtkPiecewiseFunction()
    for value, alpha in ((-1024, 0), (170, 0), (260, 0.25), (340, 0.75), (3000, 0.95)):
        opacity.AddPoint(value, alpha)
    style = vtkVolumeProperty()
    style.SetColor(colors)
    style.SetScalarOpacity(opacity)
    style.SetInterpolationTypeToLinear()
    style.ShadeOn()
    style.SetAmbient(0.25)
    style.SetDiffuse(0.75)
    style.SetSpecular(0.2)
    actor = vtkVolume()
    actor.SetMapper(mapper)
    actor.SetProperty(style)
    actor.SetUserMatrix(volume.matrix())
    panel.AddVolume(actor)
    scale = 0.5 * max(b[1] - b[0] for b in bounds) * 1.08
    look_at(panel, center, (1.0, -1.0, 0.35), (0, 0, 1), scale)
    add_scale_bar(panel, width, height)
    add_text(panel, "volume rendering of the CT", 14, height - 34, 22, bold=True)
    add_text(panel, "seen from the left and front", 14, height - 58, 16, FAINT)

    panel = add_panel(window, 2 * gap + width, gap, 2 * gap + 2 * width, top)
    thickness = 15.0
    cut = Slice(volume, "axial", busiest(tree, 2))
    draw_slice(panel, cut.cut_image(volume, thickness), None,
               max(cut.half[1], cut.half[0] * height / width))
    add_scale_bar(panel, width, height)
    add_text(panel, "maximum intensity, %.0f mm axial slab" % thickness, 14, height - 34, 22,
             bold=True)
    add_text(panel, "around z = %.1f mm" % cut.position, 14, height - 58, 16, FAINT)
    add_text(base, "%s, %s" % (title, phase.label()), 24, SIZE[1] - 48, 28, bold=True)
    save(window, folder, "rendering.png")


def picture_contact_sheet(phases, title, folder):
    window, base = new_window()
    columns = 5
    rows = max(1, math.ceil(len(phases) / columns))
    gap, top = 6, SIZE[1] - 70
    width = (SIZE[0] - (columns + 1) * gap) // columns
    height = (top - (rows + 1) * gap) // rows + gap // rows
    place = busiest(read_poly(phases[0].centerline), 2)
    for index, phase in enumerate(phases):
        volume = Volume(phase.image)
        cut = Slice(volume, "axial", place)
        x0 = gap + (index % columns) * (width + gap)
        y0 = top - (index // columns + 1) * height - (index // columns) * gap
        panel = add_panel(window, x0, y0, x0 + width, y0 + height)
        # The heart fills the panel; the far corners of the slice are lung.
        draw_slice(panel, cut.cut_image(volume), cut.cut_surface(read_poly(phase.surface)),
                   0.92 * cut.half[1])
        if index == 0:
            add_scale_bar(panel, width, height)
        add_text(panel, phase.label(), 10, height - 26, 18, bold=True)
    add_text(base, title, 24, SIZE[1] - 48, 28, bold=True)
    add_text(base, "axial, z = %.1f mm; window %.0f to %.0f HU; yellow: exact lumen"
             % ((place,) + WINDOW), SIZE[0] - 24, SIZE[1] - 44, 18, FAINT, align="right")
    save(window, folder, "contact-sheet.png")


def nearest(phases, fraction):
    """Time is periodic: 1.02 is near 0.02."""
    def distance(phase):
        d = abs(phase.fraction - fraction) % 1.0
        return min(d, 1.0 - d)
    return min(phases, key=distance)


def main():
    parser = argparse.ArgumentParser(description="Pictures of a phantom's series.")
    parser.add_argument("folder", help="what 'coronary-pipeline phantom --output' was given")
    parser.add_argument("--output", default="pictures", help="folder for the PNG files")
    parser.add_argument("--title", default="Coronary phantom")
    arguments = parser.parse_args()

    series = os.path.join(arguments.folder, "series.json")
    if not os.path.isfile(series):
        fail("no series.json in " + arguments.folder)
    with open(series, encoding="utf-8") as stream:
        description = json.load(stream)
    phases = [Phase(arguments.folder, entry) for entry in description["phases"]]
    if not phases:
        fail("series.json lists no phases")
    os.makedirs(arguments.output, exist_ok=True)
    # ParaView's build tells of every cut that it makes.
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_WARNING)

    systole, diastole = nearest(phases, 0.35), nearest(phases, 0.75)
    if systole is diastole:
        systole, diastole = phases[0], phases[-1]
    title = arguments.title
    picture_tree([diastole, systole], title, arguments.output)
    picture_slices([diastole, systole], title, arguments.output)
    picture_volume(diastole, title, arguments.output)
    picture_contact_sheet(phases, title, arguments.output)


if __name__ == "__main__":
    main()
