#!/usr/bin/env pvpython
"""Pictures of meshes that move with their bones.

  xvfb-run -a -s "-screen 0 1600x1000x24 -noreset" pvpython scripts/render-deformation.py PLUGIN.so --output FOLDER

deformation.png  a straight tube: bent by both blends, twisted, stretched without and with kept volume, narrowed
pose.png         a coronary tree at rest, and after two successive edits by hand

The tube's weights are made here, by the distance from its joints. The tree is tetrahedra with biharmonic weights: of the
phantom, or of a closed surface that is given. docs/pictures/pose.png: --surface F.obj, which coronary-pipeline convert makes
of the Visible Human's F_coronary_arteries.vtp.
"""
import argparse
import math
import os

import numpy
from vtkmodules.util import numpy_support
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

import pictures

BONE = 5.0


def poly_data(points, lines=(), polys=()):
    data = vtkPolyData()
    made = vtkPoints()
    made.SetData(numpy_support.numpy_to_vtk(numpy.asarray(points, dtype=float), deep=True))
    data.SetPoints(made)
    for cells, give in ((lines, data.SetLines), (polys, data.SetPolys)):
        array = vtkCellArray()
        for cell in cells:
            array.InsertNextCell(len(cell))
            for corner in cell:
                array.InsertCellPoint(int(corner))
        give(array)
    return data


def add(attributes, name, values):
    array = numpy_support.numpy_to_vtk(numpy.ascontiguousarray(values), deep=True)
    array.SetName(name)
    attributes.AddArray(array)


def set_weights(mesh, indices, weights):
    add(mesh.GetPointData(), "BoneIndices", indices.astype(numpy.int32))
    add(mesh.GetPointData(), "BoneWeightsCompact", weights.astype(numpy.float32))


def tube(bones, radius):
    """Triangles around a straight chain along x, in stripes, with weights and the chain."""
    around, steps = 48, 40 * bones
    points, polys, stripe = [], [], []
    for k in range(steps + 1):
        for n in range(around):
            angle = 2.0 * math.pi * n / around
            points.append((BONE * bones * k / steps, radius * math.cos(angle), radius * math.sin(angle)))
            stripe.append(float((n // 6 + k // 20) % 2))
            if k > 0:
                a, b = (k - 1) * around + n, (k - 1) * around + (n + 1) % around
                polys += [(a, b + around, b), (a, a + around, b + around)]
    mesh = poly_data(points, polys=polys)
    add(mesh.GetPointData(), "Stripe", numpy.array(stripe))
    at = numpy.array(points)[:, 0] / BONE
    own = numpy.clip(numpy.floor(at), 0, bones - 1)
    t = at - own
    other = numpy.where(t < 0.5, own - 1, own + 1)
    there = (other >= 0) & (other < bones)
    # Half at the joint, nothing at the middle of the bone.
    share = numpy.where(there, numpy.abs(t - 0.5), 0.0)
    set_weights(mesh, numpy.stack([own, numpy.where(there, other, -1)], 1),
                numpy.stack([1.0 - share, share], 1))
    joints = [(BONE * n, 0.0, 0.0) for n in range(bones + 1)]
    return mesh, poly_data(joints, lines=[(n, n + 1) for n in range(bones)])


def posed(skeleton, joints, twist=None, calibre=None):
    pose = vtkPolyData()
    pose.ShallowCopy(skeleton)
    made = vtkPoints()
    made.SetData(numpy_support.numpy_to_vtk(numpy.asarray(joints, dtype=float), deep=True))
    pose.SetPoints(made)
    if twist is not None:
        add(pose.GetCellData(), "BoneTwist", numpy.asarray(twist, dtype=float))
    if calibre is not None:
        add(pose.GetPointData(), "CalibreFactor", numpy.asarray(calibre, dtype=float))
    return pose


def producer(simple, data):
    source = simple.TrivialProducer()
    source.GetClientSideObject().SetOutput(data)
    return source


def deformed(simple, mesh, rest, pose, **settings):
    skin = simple.SkinDeformation(Mesh=producer(simple, mesh), SkeletonAtRest=producer(simple, rest),
                                  PosedSkeleton=producer(simple, pose), ComputeNormals=1, **settings)
    return pictures.fetch(skin)


def chain_poses(rest):
    joints = numpy.array([rest.GetPoint(n) for n in range(rest.GetNumberOfPoints())])
    x = joints[:, 0]
    half = joints.copy()  # a sharp bend in the middle
    middle = len(joints) // 2
    far = x > x[middle]
    half[far] = joints[middle] + numpy.outer(x[far] - x[middle],
                                             [math.cos(1.9), 0.0, math.sin(1.9)])
    radius = x[-1] / 2.5
    arc = numpy.stack([radius * numpy.sin(x / radius), 0 * x, radius * (1 - numpy.cos(x / radius))], 1)
    bones = len(joints) - 1
    calibre = numpy.ones(len(joints))
    calibre[bones // 2] = 0.35
    long = joints * 1.4
    return {
        "at rest": (joints, {}, {}),
        "bent, 2.5 rad": (arc, {}, {}),
        "bent at a joint, linear": (half, {}, {}),
        "the same, dual quaternions": (half, {}, {"Blend": "Dual Quaternion"}),
        "twisted, 1 rad a bone": (joints, {"twist": numpy.ones(bones)}, {}),
        "stretched by 1.4": (long, {}, {}),
        "the same, volume kept": (long, {}, {"VolumeConservation": 1.0}),
        "a stenosis of 65 %": (joints, {"calibre": calibre}, {}),
    }


def panel(simple, layout_view, title):
    text = simple.Text(Text=title)
    shown = simple.Show(text, layout_view)
    shown.WindowLocation = "Upper Center"
    shown.Color = (0.0, 0.0, 0.0)
    shown.FontSize = 20
    layout_view.OrientationAxesVisibility = 0
    layout_view.UseColorPaletteForBackground = 0
    layout_view.Background = (1.0, 1.0, 1.0)


def view(simple, size):
    made = simple.CreateView("RenderView")
    made.ViewSize = size
    return made


def show_bones(simple, where, data, radius):
    line = simple.Tube(Input=producer(simple, data), Radius=radius, NumberofSides=12)
    shown = simple.Show(line, where)
    shown.ColorArrayName = ["POINTS", ""]
    shown.DiffuseColor = (0.75, 0.05, 0.05)
    shown.AmbientColor = (0.75, 0.05, 0.05)


def join(files, columns, name):
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkIOImage import vtkPNGReader, vtkPNGWriter
    pictures = []
    for file in files:
        reader = vtkPNGReader()
        reader.SetFileName(file)
        reader.Update()
        image = reader.GetOutput()
        pixels = numpy_support.vtk_to_numpy(image.GetPointData().GetScalars())
        width, height = image.GetDimensions()[:2]
        pictures.append(pixels.reshape(height, width, -1)[:, :, :3].copy())
        os.remove(file)
    rows = [numpy.hstack(pictures[n:n + columns]) for n in range(0, len(pictures), columns)]
    whole = numpy.ascontiguousarray(numpy.vstack(rows[::-1]))  # rows of images count from below
    image = vtkImageData()
    image.SetDimensions(whole.shape[1], whole.shape[0], 1)
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(whole.reshape(-1, 3), deep=True))
    writer = vtkPNGWriter()
    writer.SetInputData(image)
    writer.SetFileName(name)
    writer.Write()


def draw_tubes(simple, folder):
    bones = 8
    mesh, rest = tube(bones, 2.5)
    files = []
    for number, (title, (joints, extra, settings)) in enumerate(chain_poses(rest).items()):
        pose = posed(rest, joints, **extra)
        moved = deformed(simple, mesh, rest, pose, **settings)
        where = view(simple, [500, 300])
        panel(simple, where, title)
        shown = simple.Show(producer(simple, moved), where)
        simple.ColorBy(shown, ("POINTS", "Stripe"))
        table = simple.GetColorTransferFunction("Stripe")
        table.RGBPoints = [0.0, 0.86, 0.55, 0.45, 1.0, 0.97, 0.90, 0.82]
        shown.Opacity = 0.75
        shown.SetScalarBarVisibility(where, False)
        show_bones(simple, where, pose, 0.25)
        centre = numpy.array(moved.GetCenter())
        where.CameraFocalPoint = centre
        where.CameraPosition = centre + numpy.array([0.0, -100.0, 18.0])
        where.CameraViewUp = (0.0, 0.0, 1.0)
        where.CameraParallelProjection = 1
        where.CameraParallelScale = 19.5
        files.append(os.path.join(folder, f"tube{number}.png"))
        simple.SaveScreenshot(files[-1], where)
    join(files, 4, os.path.join(folder, "deformation.png"))


def highest_points(surface):
    """Of each connected part, as a data set of points."""
    from vtkmodules.vtkFiltersCore import vtkPolyDataConnectivityFilter
    parts = vtkPolyDataConnectivityFilter()
    parts.SetInputData(surface)
    parts.SetExtractionModeToAllRegions()
    parts.ColorRegionsOn()
    parts.Update()
    output = parts.GetOutput()
    region = numpy_support.vtk_to_numpy(output.GetPointData().GetArray("RegionId"))
    points = numpy_support.vtk_to_numpy(output.GetPoints().GetData())
    tops = vtkPoints()
    for number in range(parts.GetNumberOfExtractedRegions()):
        part = points[region == number]
        tops.InsertNextPoint(part[part[:, 2].argmax()].astype(float))
    seeds = vtkPolyData()
    seeds.SetPoints(tops)
    return seeds


def posable(simple, name):
    """The skeleton, and tetrahedra with weights, of a closed surface or of the phantom."""
    if name is None:
        tree = simple.OutputPort(simple.CoronaryPhantom(), 1)
        surface = simple.FrenetSweepSurface(tree)
    else:
        opened = pictures.fetch(simple.OpenDataFile(name))
        surface = simple.SurfaceCleaner(Surface=producer(simple, opened))
        lines = simple.FastMarchingCenterline(Input=surface,
                                              Seeds=producer(simple, highest_points(opened)))
        tree = simple.CoronaryTreeTopology(Input=simple.OutputPort(lines, 0))
    skeleton = simple.CenterlineSkeleton(Centerlines=tree)
    tetrahedra = simple.TetrahedralMesher(Surface=surface, Skeleton=skeleton,
                                          LeaveOutPointsOutside=1, Repair=1)
    weights = simple.BiharmonicSkinWeights(Mesh=tetrahedra, Skeleton=skeleton)
    return pictures.fetch(skeleton), pictures.fetch(weights)


def subtree(skeleton, joint):
    cells = numpy_support.vtk_to_numpy(skeleton.GetLines().GetConnectivityArray()).reshape(-1, 2)
    found = [joint]
    for at in found:
        found += [second for first, second in cells if first == at]
    return found


def draw_tree(simple, folder, surface):
    rest, mesh = posable(simple, surface)
    sizes = [len(subtree(rest, n)) for n in range(rest.GetNumberOfPoints())]
    # Two joints in the middle of the largest tree, one far beyond the other.
    largest = max(range(len(sizes)), key=lambda n: sizes[n])
    beyond = subtree(rest, largest)
    first = min(beyond, key=lambda n: abs(sizes[n] - 0.55 * sizes[largest]))
    second = min(subtree(rest, first)[3:], key=lambda n: abs(sizes[n] - 0.35 * sizes[first]))
    edits = [[first, 0, 0, 0, 50, 0, 0, 0, 1, 0], [second, 40, 0, 35, 0, 0, 0, -3, 0.4, 15]]
    files = []
    for number in range(3):
        pose = simple.SkeletonPose(Skeleton=producer(simple, rest))
        pose.Edits = [value for edit in edits[:number] for value in edit]
        skeleton = pictures.fetch(pose)
        moved = deformed(simple, mesh, rest, skeleton, Blend="Dual Quaternion")
        where = view(simple, [660, 700])
        panel(simple, where, ("at rest", f"joint {first} turned by 50 degrees",
                              f"then joint {second} turned, moved, twisted, narrowed")[number])
        shown = simple.Show(producer(simple, moved), where)
        if number == 0:
            shown.ColorArrayName = ["POINTS", ""]
            shown.DiffuseColor = (0.85, 0.55, 0.48)
        else:
            simple.ColorBy(shown, ("POINTS", "Displacement", "Magnitude"))
            table = simple.GetColorTransferFunction("Displacement")
            table.RescaleTransferFunction(0.0, 60.0)
            shown.SetScalarBarVisibility(where, number == 2)
            if number == 2:
                bar = simple.GetScalarBar(table, where)
                bar.Title, bar.ComponentTitle = "Displacement, mm", ""
                bar.TitleColor = bar.LabelColor = (0.0, 0.0, 0.0)
                bar.WindowLocation = "Lower Right Corner"
        shown.Opacity = 0.7
        show_bones(simple, where, skeleton, 0.35)
        if number == 0:
            box = mesh.GetBounds()
        centre = numpy.array([0.5 * (box[2 * n] + box[2 * n + 1]) for n in range(3)])
        where.CameraFocalPoint = centre
        where.CameraPosition = centre + numpy.array([60.0, -300.0, 40.0])
        where.CameraViewUp = (0.0, 0.0, 1.0)
        where.CameraParallelProjection = 1
        where.CameraParallelScale = 75.0
        files.append(os.path.join(folder, f"tree{number}.png"))
        simple.SaveScreenshot(files[-1], where)
    join(files, 3, os.path.join(folder, "pose.png"))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plugin")
    parser.add_argument("--output", required=True)
    parser.add_argument("--surface", help="closed surface of coronary arteries that is posed, "
                                          ".obj, .stl or .vtp (default: the phantom's)")
    arguments = parser.parse_args()
    os.makedirs(arguments.output, exist_ok=True)
    from paraview import simple
    simple._DisableFirstRenderCameraReset()
    simple.LoadPlugin(arguments.plugin, ns=simple.__dict__)
    draw_tubes(simple, arguments.output)
    draw_tree(simple, arguments.output, arguments.surface)


if __name__ == "__main__":
    main()
