"""What the ParaView tests share: the plugin, data, pictures, and the phantom's usual view."""
import glob
import hashlib
import json
import os
import struct
import sys
import xml.etree.ElementTree as ElementTree

from paraview import servermanager, simple, smstate, smtrace
from vtkmodules.vtkIOImage import vtkPNGReader

IMAGE, CENTERLINES, SURFACE, OSTIA, VEIN, PROBE = range(6)
TREE, LINES, FORKS = range(3)
TRACKED_LINES, TRACKED_SKELETON = range(2)


def require(condition, message):
    """Ends the test with a message unless the condition holds."""
    if not condition:
        sys.exit("FAILED: " + message)


def load_plugin(path):
    simple.LoadPlugin(path, remote=False, ns=vars(simple))
    require(hasattr(simple, "CoronaryPhantom"), "the plugin did not load: " + path)


def quick_phantom(**properties):
    """A phantom whose image and surface take little time."""
    phantom = simple.CoronaryPhantom(**properties)
    phantom.Spacing = [1.5, 1.5, 1.5]
    phantom.SurfaceSpacing = 0.8
    return phantom


def centerline_pipeline():
    """Phantom, its phase at 0.75, segmentation, vesselness, centerlines, named trees."""
    phantom = simple.CoronaryPhantom(Spacing=[0.8, 0.8, 0.8], TemporalWindow=0.0)
    phantom.UpdatePipeline(0.75)
    phase = simple.ReferencePhase(simple.OutputPort(phantom, IMAGE), Automatic=0, Time=0.75)
    phase.UpdatePipeline(0.75)
    segmentation = simple.VesselSegmentation(phase)
    segmentation.UpdatePipeline(0.75)
    vesselness = simple.FrangiVesselness(phase, AutomaticC=0, C=100.0)
    vesselness.UpdatePipeline(0.75)
    centerline = simple.FastMarchingCenterline(
        vesselness, Seeds=simple.OutputPort(segmentation, 1), CTImage=phase, Mask=segmentation)
    topology = simple.CoronaryTreeTopology(simple.OutputPort(centerline, TREE))
    return phantom, centerline, topology


def tracking_pipeline():
    """A tree tracked through five coarse phases of a phantom, then regularised, then at any moment."""
    phantom = simple.CoronaryPhantom(Spacing=[1.2, 1.2, 1.2], CenterlineSpacing=2.0,
                                     TemporalWindow=0.0, Phases=[0.05, 0.2, 0.35, 0.5, 0.75])
    lines = simple.ReferencePhase(simple.OutputPort(phantom, CENTERLINES), Automatic=0, Time=0.75)
    skeleton = simple.CenterlineSkeleton(lines)
    tracker = simple.CenterlineTracker(
        simple.OutputPort(phantom, IMAGE), Centerlines=lines, Skeleton=skeleton,
        NodeSpacing=5.0, CaptureRange=14.0, TrackedPhases="List", TrackedTimes=[0.05, 0.2, 0.36, 0.75])
    regularized = simple.MotionRegularizer(
        Motion=simple.OutputPort(tracker, TRACKED_LINES), MaximumBending=50.0)
    moment = simple.CardiacPhaseInterpolator(regularized, Mode="Low Noise", Ellipses=1)
    return phantom, tracker, regularized, moment


def write_skeleton(folder):
    """A chain of four bones of 5 mm along z with a fifth one beside its end, as a .tgf file."""
    joints = [(0, 0, -10), (0, 0, -5), (0, 0, 0), (0, 0, 5), (0, 0, 10), (2, 0, 7)]
    bones = [(1, 2), (2, 3), (3, 4), (4, 5), (4, 6)]
    path = os.path.join(folder, "skeleton.tgf")
    with open(path, "w") as file:
        for number, place in enumerate(joints, 1):
            file.write("%d %g %g %g\n" % (number, *place))
        file.write("#\n")
        for bone in bones:
            file.write("%d %d\n" % bone)
    return path


def write_tree(path, way):
    """A fork of three vessels, a point each millimetre, as a .tgf file."""
    joints = [(0.0, z) for z in range(13)]
    bones = [(n, n + 1) for n in range(1, 13)]
    for side in (way, -way):
        first = len(joints) + 1
        joints += [(side * n / 12.0, 12 + n) for n in range(1, 13)]
        bones += [(13, first)] + [(n, n + 1) for n in range(first, first + 11)]
    with open(path, "w") as file:
        file.writelines("%d %r 0 %r\n" % (n, *joint) for n, joint in enumerate(joints, 1))
        file.write("#\n")
        file.writelines("%d %d\n" % bone for bone in bones)


def write_series(path, fractions, cycle_ms):
    """A small image for each phase, and the .json that makes a series of them."""
    phases = []
    for number, fraction in enumerate(fractions):
        name = "phase_%d.mha" % number
        with open(os.path.join(os.path.dirname(path), name), "wb") as file:
            file.write(b"ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementSpacing = 1 2 3\n"
                       b"ElementType = MET_SHORT\nBinaryData = True\nElementDataFile = LOCAL\n")
            file.write(struct.pack("<24h", *(100 * number + 10 * n for n in range(24))))
        phases.append({"fraction": fraction, "image": name})
    with open(path, "w") as file:
        json.dump({"cycle_ms": cycle_ms, "phases": phases}, file)


def skinning_pipeline(skeleton_file, **pose_settings):
    """A bar of tetrahedra around the skeleton of write_skeleton, posed and moved: four filters."""
    # Settings with the creation: a trace of a script records no others.
    bar = simple.Wavelet(registrationName="Image", WholeExtent=[-3, 3, -3, 3, -11, 11])
    mesh = simple.Tetrahedralize(bar, registrationName="Mesh")
    lines = simple.TGFSkeletonReader(registrationName="Lines", FileName=skeleton_file, Radius=1.5)
    skeleton = simple.CenterlineSkeleton(lines, registrationName="Skeleton", EveryStepIsABone=1,
                                         LengthPerRadius=2.5)
    weights = simple.BiharmonicSkinWeights(mesh, Skeleton=skeleton, registrationName="Weights",
                                           Influences=4, AllWeights=1, Neighbourhood=2.0)
    # Joint, twist, turn, move, calibre, reach.
    pose_settings = pose_settings or dict(
        MoveTheChosenJoint=1, ChosenJoint=4, JointPosition=[1, 2, 9], MovesWithIt="The Bone Turns",
        JointRotation=[0, 10, 0],
        Edits=[1, 0, 0, 20, 0, 0, 0, 0, 1, 0, 2, 30, 0, 0, 0, 0, 0, 1, 0.8, 4])
    pose = simple.SkeletonPose(skeleton, registrationName="Pose", **pose_settings)
    moved = simple.SkinDeformation(weights, SkeletonAtRest=skeleton, PosedSkeleton=pose,
                                   registrationName="Moved", Blend="Dual Quaternion",
                                   VolumeConservation=0.5, InvertedTetrahedra="Report")
    return weights, pose, moved


def fetch(source, port, time):
    """One port's data at a time, on the client; the other ports are not touched."""
    tap = servermanager.filters.ReductionFilter(Input=simple.OutputPort(source, port))
    tap.UpdatePipeline(time)
    data = tap.GetClientSideObject().GetOutputDataObject(0)
    copy = data.NewInstance()
    copy.ShallowCopy(data)
    return copy


def fetch_whole(source, port, time):
    """Data that have to be on the first rank, all of them."""
    data = fetch(source, port, time)
    everywhere = source.GetDataInformation(port).GetNumberOfPoints()
    require(data.GetNumberOfPoints() == everywhere > 0, "%s: %d points on all ranks, %d on the "
            "first" % (source.GetXMLName(), everywhere, data.GetNumberOfPoints()))
    return data


def require_ranks(ranks):
    partitions = servermanager.vtkProcessModule.GetProcessModule().GetNumberOfLocalPartitions()
    require(partitions == ranks, "%d ranks, not %d" % (partitions, ranks))


def compare_with_one_rank(folder, ranks, found):
    """Lines of text that a test on one rank leaves for the same test on more ranks."""
    os.makedirs(folder, exist_ok=True)
    path = os.path.join(folder, "one-rank.txt")
    if ranks == 1:
        with open(path, "w") as file:
            file.write("\n".join(found))
        return
    with open(path) as file:
        expected = file.read().split("\n")
    for one, two in zip(expected, found):
        require(one == two, "one rank: %s; %d ranks: %s" % (one, ranks, two))
    require(len(expected) == len(found), "%d lines, not %d" % (len(found), len(expected)))


def content(data):
    """Points and all point data of a data set, as something that compares."""
    points = data.GetPoints() if data.IsA("vtkPointSet") else None
    arrays = {"points": bytes(memoryview(points.GetData()))} if points else {}
    attributes = data.GetPointData()
    for index in range(attributes.GetNumberOfArrays()):
        array = attributes.GetArray(index)
        if array:
            arrays[array.GetName()] = bytes(memoryview(array))
    return arrays


def digest(data):
    """Points, lines and all arrays, a line of text each."""
    lines = ["%d points, %d cells" % (data.GetNumberOfPoints(), data.GetNumberOfCells())]

    def add(name, array):
        values = bytes(memoryview(array))
        lines.append("%s %s" % (name, hashlib.sha256(values).hexdigest()))

    add("points", data.GetPoints().GetData())
    # A structured grid has no list of its cells.
    if data.IsA("vtkPolyData") or data.IsA("vtkUnstructuredGrid"):
        cells = data.GetLines() if data.IsA("vtkPolyData") else data.GetCells()
        add("cells", cells.GetConnectivityArray())
    for where, attributes in (("point", data.GetPointData()), ("cell", data.GetCellData())):
        for index in range(attributes.GetNumberOfArrays()):
            array = attributes.GetAbstractArray(index)
            if array.IsA("vtkStringArray"):
                values = [array.GetValue(n) for n in range(array.GetNumberOfValues())]
                lines.append("%s %s %s" % (where, array.GetName(), values))
            else:
                add("%s %s" % (where, array.GetName()), array)
    return lines


def places(data):
    """Where a mesh on whole millimetres was at rest, and how it moved, whatever the order of its points."""
    displacement = data.GetPointData().GetArray("Displacement")
    found = {}
    for n in range(data.GetNumberOfPoints()):
        moved = displacement.GetTuple3(n)
        rest = tuple(round(a - b) + 0.0 for a, b in zip(data.GetPoint(n), moved))
        found[rest] = moved
    return sorted(found.items())


def largest_difference(ones, twos):
    """Between two lists of places, of the movements."""
    return max(abs(a - b) for one, two in zip(ones, twos) for a, b in zip(one[1], two[1]))


def all_proxies(xml_folder):
    """The proxies of sources and filters, as elements of the plugin's XML."""
    for path in sorted(glob.glob(os.path.join(xml_folder, "*.xml"))):
        for group in ElementTree.parse(path).getroot().findall("ProxyGroup"):
            for element in group.findall("SourceProxy"):
                yield element


def stand_ins():
    """A source for each type of input."""
    image = simple.Wavelet(registrationName="Image", WholeExtent=[0, 2, 0, 2, 0, 2])
    lines = simple.Line(registrationName="Lines", Resolution=4)
    mesh = simple.Tetrahedralize(image, registrationName="Tetrahedra")
    return {"vtkImageData": image, "vtkDataObject": image, "vtkPolyData": lines, "vtkPointSet": lines,
            "vtkUnstructuredGrid": mesh}


def find(name):
    """A source by its name, which a state, or a trace, has to have made again."""
    source = simple.FindSource(name)
    require(source is not None, "there is no " + name)
    return source


def require_repeats(output, expected, where):
    print("compared with", where, flush=True)
    require(output() == expected, where + ": other output")


def require_trace_repeats(build, output):
    """What `build` does, traced and run in a new session, gives the same.

    `output` finds sources by name, and returns what is compared. To be called before any picture is saved: a
    trace that is started after that stays empty.
    """
    simple.ResetSession()
    smtrace.start_trace(preamble="")
    build()
    trace = smtrace.stop_trace()
    expected = output()
    simple.ResetSession()
    exec(compile(trace, "trace", "exec"), {"__name__": "trace"})
    require_repeats(output, expected, "the trace")


def require_states_restore(output, state):
    """The present session, from a state file and from a Python script, gives the same `output`."""
    expected = output()
    simple.SaveState(state)
    script = smstate.get_state()
    simple.ResetSession()
    simple.LoadState(state)
    require_repeats(output, expected, "the state file")
    simple.ResetSession()
    exec(compile(script, "state", "exec"), {"__name__": "state"})
    require_repeats(output, expected, "the Python state")


def pixels(path):
    """The colours of a picture, three bytes a pixel."""
    reader = vtkPNGReader()
    reader.SetFileName(path)
    reader.Update()
    scalars = reader.GetOutput().GetPointData().GetScalars()
    require(scalars and scalars.GetNumberOfComponents() == 3, "no colour picture: " + path)
    return bytes(memoryview(scalars))


def require_picture(path, share=0.05):
    """The picture shows something: more than `share` of its bytes are not the most common one."""
    data = pixels(path)
    background = max(range(256), key=data.count)
    require(data.count(background) < (1.0 - share) * len(data), "the picture is empty: " + path)


def require_different_pictures(first, second, share=0.005):
    a, b = pixels(first), pixels(second)
    require(len(a) == len(b), "pictures of different size: %s, %s" % (first, second))
    changed = sum(x != y for x, y in zip(a, b)) / len(a)
    print("%.1f %% of the picture changed from %s to %s" % (100 * changed, first, second))
    require(changed > share, "the pictures are the same: %s, %s" % (first, second))


def show_phantom(phantom, view):
    """A coronal slice of the image, the surface, and the tree inside it, seen from the front."""
    image = simple.Show(simple.OutputPort(phantom, IMAGE), view)
    image.SetRepresentationType("Slice")
    image.SliceMode = "XZ Plane"
    extent = phantom.GetDataInformation(IMAGE).GetExtent()
    image.Slice = (extent[2] + extent[3]) // 2
    simple.ColorBy(image, ("POINTS", "HU"))
    transfer = simple.GetColorTransferFunction("HU")
    transfer.ApplyPreset("Grayscale", True)
    transfer.RescaleTransferFunction(-200.0, 500.0)
    image.SetScalarBarVisibility(view, False)

    surface = simple.Show(simple.OutputPort(phantom, SURFACE), view)
    surface.DiffuseColor = surface.AmbientColor = [0.80, 0.16, 0.16]
    surface.Opacity = 0.55

    tree = simple.Show(simple.OutputPort(phantom, CENTERLINES), view)
    tree.DiffuseColor = tree.AmbientColor = [1.0, 0.85, 0.2]
    tree.LineWidth = 3.0

    bounds = phantom.GetDataInformation(IMAGE).GetBounds()
    centre = [(low + high) / 2 for low, high in zip(bounds[::2], bounds[1::2])]
    view.CameraFocalPoint = centre
    # LPS: the viewer stands before the patient, who stands upright.
    view.CameraPosition = [centre[0] + 90.0, centre[1] - 380.0, centre[2] + 60.0]
    view.CameraViewUp = [0.0, 0.0, 1.0]
    view.CameraViewAngle = 17.0
    return image, surface, tree


def write_dicom(folder):
    """Two slices of one phase, with no more than a reader needs, in the folder `dicom`."""
    def element(group, number, kind, value):
        value = value if isinstance(value, bytes) else value.encode()
        value += (b"\0" if kind == "UI" else b" ") * (len(value) % 2)
        length = struct.pack("<HI", 0, len(value)) if kind == "OW" else struct.pack("<H", len(value))
        return struct.pack("<HH", group, number) + kind.encode() + length + value

    os.makedirs(os.path.join(folder, "dicom"), exist_ok=True)
    for z in range(2):
        meta = element(2, 0x10, "UI", "1.2.840.10008.1.2.1")
        data = element(8, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.2") + \
            element(8, 0x18, "UI", "1.2.3.%d" % z) + element(8, 0x60, "CS", "CT") + \
            element(0x20, 0x0d, "UI", "1.2") + element(0x20, 0x0e, "UI", "1.2.3") + \
            element(0x20, 0x32, "DS", "0\\0\\%d" % z) + element(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0") + \
            element(0x28, 0x02, "US", struct.pack("<H", 1)) + element(0x28, 0x04, "CS", "MONOCHROME2") + \
            element(0x28, 0x10, "US", struct.pack("<H", 2)) + \
            element(0x28, 0x11, "US", struct.pack("<H", 2)) + element(0x28, 0x30, "DS", "1\\1")
        for number, value in ((0x100, 16), (0x101, 16), (0x102, 15), (0x103, 0)):
            data += element(0x28, number, "US", struct.pack("<H", value))
        data += element(0x28, 0x1052, "DS", "-1024") + element(0x28, 0x1053, "DS", "1") + \
            element(0x7fe0, 0x10, "OW", bytes(8))
        with open(os.path.join(folder, "dicom", "%d.dcm" % z), "wb") as file:
            file.write(bytes(128) + b"DICM" + element(2, 0, "UL", struct.pack("<I", len(meta))) + meta + data)
