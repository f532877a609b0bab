"""Every proxy with other settings than its own, through a state file, a Python state and a trace; outputs too."""
import os
import sys

from paraview import make_name_valid, simple
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

from coronary_testing import (all_proxies, digest, fetch, find, load_plugin, require, require_states_restore,
                              require_trace_repeats, stand_ins, write_dicom, write_tree)

plugin, folder, xml_folder = sys.argv[1:4]
# What a value by rule would make senseless: axes that are no rotation, times that do not increase.
IMAGES = [os.path.join(folder, "phase_%d.mha" % n) for n in range(2)]
SENSIBLE = {("CoronaryPhantomSource", "Direction"): [0, 1, 0, 1, 0, 0, 0, 0, -1],
            ("CoronaryPhantomSource", "Phases"): [0.1, 0.3, 0.75],
            ("CoronaryCardiacPhaseInterpolator", "OfferedRange"): [0.1, 1.1],
            ("CoronaryGatedImageReader", "FileNames"): IMAGES,
            ("CoronaryGatedImageReader", "PhaseFractions"): [0.1, 0.6],
            ("CoronarySegmentationReader", "FileNames"): IMAGES,
            ("CoronarySegmentationReader", "PhaseFractions"): [0.1, 0.6],
            ("CoronaryTGFReader", "FileName"): os.path.join(folder, "tree.tgf")}
# A file, a folder or an array of the input each has to be there.
LEFT = ("FileListDomain", "ArrayListDomain", "ExtentDomain")


def write_images():
    """Two phases of a small image."""
    for phase, path in enumerate(IMAGES):
        with open(path, "wb") as file:
            file.write(b"ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementSpacing = 1 2 3\n"
                       b"ElementType = MET_UCHAR\nBinaryData = True\nElementDataFile = LOCAL\n")
            file.write(bytes(range(phase, 24 + phase)))


def other_number(value, low, high, step):
    """Another number than the default one, within the domain."""
    if high is not None:
        return value + step * (high - value) if value + step * (high - value) != value else low
    return value + step * (abs(value) + 1.0)


def other_value(proxy, element):
    """Another value than the default one, as Python takes it; None where there is none by rule."""
    domains = {child.tag: child for child in element if child.tag.endswith("Domain")}
    key = (proxy, element.get("name"))
    if key in SENSIBLE:
        return SENSIBLE[key]
    if any(tag in domains for tag in LEFT):
        return None
    defaults = [] if element.get("default_values") in (None, "none") else element.get("default_values").split()
    if element.tag == "StringVectorProperty":
        return "Other" + "".join(defaults)
    if "EnumerationDomain" in domains:
        entries = [entry.attrib for entry in domains["EnumerationDomain"]]
        return next(entry["text"] for entry in entries if entry["value"] != defaults[0])
    if "BooleanDomain" in domains:
        return 1 - int(defaults[0])
    numbers = [float(value) for value in defaults] or \
        [0.25 * (n + 1) for n in range(int(element.get("number_of_elements_per_command", "1")))]
    if defaults:
        limits = next(iter(domains.values()))
        low, high = (float(limits.get(end)) if limits.get(end) else None for end in ("min", "max"))
        numbers = [other_number(number, low, high, 0.02) for number in numbers]
    if element.tag in ("IntVectorProperty", "IdTypeVectorProperty"):
        numbers = [int(number) + (int(number) == float(default)) for number, default
                   in zip(numbers, defaults)]
    return numbers if len(numbers) > 1 or not defaults else numbers[0]


def settings(element):
    """Names in Python and values, other than the default ones, of all that the panel shows."""
    values = {}
    for child in element:
        if child.tag.endswith("VectorProperty") and not child.get("information_only"):
            value = other_value(element.get("name"), child)
            if value is not None:
                values[make_name_valid(child.get("label"))] = value
    return values


def make_all():
    """One of each proxy, with all inputs; nothing of it is executed."""
    sources = stand_ins()
    for element in all_proxies(xml_folder):
        label = make_name_valid(element.get("label"))
        inputs = {make_name_valid(port.get("label")): sources[port.find("DataTypeDomain/DataType").get("value")]
                  for port in element.findall("InputProperty")}
        getattr(simple, label)(registrationName=element.get("name"), **inputs, **settings(element))


def read_all():
    """All settings and inputs of the proxies of make_all."""
    found = {}
    for element in all_proxies(xml_folder):
        proxy = find(element.get("name"))
        for name in settings(element):
            value = getattr(proxy, name)
            found[element.get("name"), name] = list(value) if hasattr(value, "__len__") and \
                not isinstance(value, str) else value
        for port in element.findall("InputProperty"):
            source = getattr(proxy, make_name_valid(port.get("label")))
            found[element.get("name"), port.get("name")] = [
                name for (name, _), one in simple.GetSources().items() if one.SMProxy == source.SMProxy]
    return found


def require_settings():
    """That the values are those which were given, and not the default ones."""
    count = 0
    found = read_all()
    for element in all_proxies(xml_folder):
        for name, value in settings(element).items():
            there = found[element.get("name"), name]
            require(there == value or there == [value] or
                    all(abs(a - b) < 1e-12 for a, b in zip(there, value)),
                    "%s.%s is %s, not %s" % (element.get("name"), name, there, value))
            count += 1
    print("%d settings of %d proxies" % (count, len(list(all_proxies(xml_folder)))), flush=True)


def make_wall():
    """What the other tests have no round trip of: readers, topology, sweep, cleaner, mesher, metrics."""
    # Settings with the creation: a trace of a script records no others.
    tree = simple.TGFSkeletonReader(registrationName="Tree", FileName=os.path.join(folder, "tree.tgf"),
                                    Radius=1.5)
    truth = simple.TGFSkeletonReader(registrationName="Truth", Radius=1.4,
                                     FileName=os.path.join(folder, "truth.tgf"))
    simple.CoronaryTreeTopology(tree, registrationName="Names", PruneRatio=2.0, LabelSegments=0)
    wall = simple.FrenetSweepSurface(tree, registrationName="Wall", MinimumEdgeLength=0.6,
                                     MaximumEdgeLength=1.0, Blending=0.4, PatchSamples=12)
    simple.SurfaceCleaner(wall, registrationName="Clean", MinimumAngle=5.0, JoinDistance=0.5)
    bones = simple.CenterlineSkeleton(tree, registrationName="Bones", LengthPerRadius=2.5,
                                      MinimumLength=2.0)
    simple.TetrahedralMesher(wall, Skeleton=bones, registrationName="Mesh", RadiusEdgeRatio=1.6,
                             MinimumDihedralAngle=12.0)
    simple.CenterlineMetrics(Result=tree, Reference=truth, registrationName="Agreement",
                             RelevantRadius=0.5, DetectedShare=0.7)
    simple.GatedImageReader(registrationName="Images", CycleLength=0.9, PhaseFractions=[0.1, 0.6],
                            FileNames=IMAGES)
    simple.GatedImageReader(registrationName="Folder", FileNames=[os.path.join(folder, "dicom")],
                            SeriesInstanceUID="1.2.3")


def leaves(data):
    """The data sets of composite data, or the one that it is."""
    if not data.IsA("vtkMultiBlockDataSet"):
        return [data]
    blocks = [data.GetBlock(n) for n in range(data.GetNumberOfBlocks())]
    return [leaf for block in blocks if block for leaf in leaves(block)]


def outputs():
    """A digest of each output of make_wall."""
    found = []
    for name, ports in (("Names", (0, 3)), ("Wall", (0, 1, 2)), ("Clean", (0,)), ("Bones", (0,)),
                        ("Mesh", (0, 1, 2)), ("Agreement", (1, 3))):
        for port in ports:
            data = fetch(find(name), port, 0.0)
            require(data.GetNumberOfPoints() > 2, "%s, port %d is empty" % (name, port))
            found.append((name, port, [digest(leaf) for leaf in leaves(data)]))
    images = find("Images")
    images.UpdatePipelineInformation()
    require(list(images.TimestepValues) == [0.1, 0.6], "times of the images")
    for time in images.TimestepValues:
        scalars = fetch(images, 0, time).GetPointData().GetScalars()
        found.append(("Images", time, bytes(memoryview(scalars))))
    require(found[-1][2] != found[-2][2], "the phases are the same")
    found.append(("Folder", 0, bytes(memoryview(fetch(find("Folder"), 0, 0.0).GetPointData().GetScalars()))))
    opened = simple.OpenDataFile(os.path.join(folder, "dicom"))
    require(opened.GetXMLName() == "CoronaryGatedImageReader", "a folder opens with %s" % opened.GetXMLName())
    require(fetch(opened, 0, 0.0).GetDimensions() == (2, 2, 2), "the folder of DICOM files")
    simple.Delete(opened)
    return found


def require_times():
    """Who has times that its input has not says them."""
    for (name, _), source in simple.GetSources().items():
        algorithm = source.GetClientSideObject()
        if not algorithm or "coronary" not in algorithm.GetClassName().lower() + source.GetXMLName().lower():
            continue
        source.UpdatePipelineInformation()
        said = hasattr(source, "TimestepValues")
        before = any(
            algorithm.GetInputInformation(port, n).Has(Pipeline.TIME_STEPS())
            for port in range(algorithm.GetNumberOfInputPorts())
            for n in range(algorithm.GetNumberOfInputConnections(port)))
        for port in range(algorithm.GetNumberOfOutputPorts()):
            has = algorithm.GetOutputInformation(port).Has(Pipeline.TIME_STEPS())
            require(said or before or not has, "%s has times and no TimestepValues" % name)


load_plugin(plugin)
write_tree(os.path.join(folder, "tree.tgf"), 8.0)
write_tree(os.path.join(folder, "truth.tgf"), 8.5)
write_images()
write_dicom(folder)
require_trace_repeats(make_wall, outputs)
simple.ResetSession()
make_wall()
require_times()
require_states_restore(outputs, os.path.join(folder, "wall.pvsm"))
require_trace_repeats(make_all, read_all)
simple.ResetSession()
make_all()
require_settings()
require_states_restore(read_all, os.path.join(folder, "all.pvsm"))
