"""Every proxy made by keywords, in two orders and with different sources active: inputs and settings are the same.

A mistake is one error, however many outputs and times are asked for and shown.
"""
import os
import subprocess
import sys

from paraview import make_name_valid, simple

from coronary_testing import all_proxies, load_plugin, require, stand_ins

plugin, folder, xml_folder, pvpython = sys.argv[1:5]
# More than one output, a stage behind it, several times, pictures.
MISTAKES = {
    "an array that is not there": ("""
phantom = simple.CoronaryPhantom(Spacing=[2, 2, 2])
vessels = simple.VesselSegmentation(Image=phantom["Image"], ImageScalars="Density")
for time in (0.1, 0.5, 0.9):
    vessels.UpdatePipeline(time)
for name in ("Vessel Mask", "Seeds", "Ascending Aorta"):
    simple.Show(vessels[name])
lines = simple.FastMarchingCenterline(Input=phantom["Image"], Seeds=vessels["Seeds"], Mask=vessels["Vessel Mask"])
simple.Show(lines)
for time in (0.1, 0.5):
    simple.GetActiveView().ViewTime = time
    simple.Render()
""", "The image has no point array 'Density'"),
    "a file that is not there": ("""
series = simple.GatedImageReader(FileNames=["nothing.json"])
series.UpdatePipeline(0.1)
series.UpdatePipeline(0.5)
phase = simple.ReferencePhase(Input=series)
simple.Show(series)
simple.Show(phase)
simple.Render()
""", "File 'nothing.json' does not exist"),
    "a setting out of range": ("""
tree = simple.CoronaryPhantom()
wall = simple.FrenetSweepSurface(Input=tree["Centerlines"], MinimumEdgeLength=2, MaximumEdgeLength=1)
wall.UpdatePipeline(0.1)
mesh = simple.TetrahedralMesher(Surface=wall["Surface"])
simple.Show(wall)
simple.Show(mesh["Volume"])
for time in (0.1, 0.2):
    simple.GetActiveView().ViewTime = time
    simple.Render()
""", "MaximumEdgeLength")}


def values_of(proxy, element):
    """Settings and the names of the inputs, as Python gives them."""
    found = {}
    names = {one.SMProxy: name for (name, _), one in simple.GetSources().items()}
    for child in element:
        label = make_name_valid(child.get("label") or "")
        if child.tag == "InputProperty":
            source = getattr(proxy, label)
            found[label] = source and (names[source.SMProxy], source.Port)
        elif child.tag.endswith("VectorProperty") and not child.get("information_only"):
            value = getattr(proxy, label)
            found[label] = str(list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value)
    return found


def made_by_keywords(element, inputs, settings, active, inputs_first):
    """The values of a proxy that is made so, and goes again."""
    simple.SetActiveSource(active)
    keywords = {**inputs, **settings} if inputs_first else {**settings, **inputs}
    proxy = getattr(simple, make_name_valid(element.get("label")))(**keywords)
    found = values_of(proxy, element)
    simple.Delete(proxy)
    return found


def a_setting(element):
    """One property that is no array's, with its own default value."""
    for child in element:
        if child.tag in ("IntVectorProperty", "DoubleVectorProperty") and not child.get("information_only") and \
                len((child.get("default_values") or "none").split()) == 1 and child.get("default_values", "none") != "none" \
                and child.find("EnumerationDomain") is None:
            return {make_name_valid(child.get("label")): float(child.get("default_values")) if
                    child.tag.startswith("Double") else int(child.get("default_values"))}
    return {}


def check_all():
    sources = stand_ins()
    other = simple.Calculator(registrationName="Calculator", Input=sources["vtkImageData"], ResultArrayName="Other",
                              Function="1")
    noise = simple.PassArrays(registrationName="Other arrays", Input=other, PointDataArrays=["Other"])
    for source in list(sources.values()) + [noise]:
        source.UpdatePipeline()
    count = 0
    for element in all_proxies(xml_folder):
        inputs = {make_name_valid(port.get("label")): sources[port.find("DataTypeDomain/DataType").get("value")]
                  for port in element.findall("InputProperty")}
        if element.find("StringVectorProperty/FileListDomain") is not None:
            # A reader, which wants a file: the pages' examples have them.
            continue
        settings = a_setting(element)
        wanted = made_by_keywords(element, inputs, settings, None, True)
        for label, source in inputs.items():
            require(wanted[label] == ({one.SMProxy: name for (name, _), one in simple.GetSources().items()}
                                      [source.SMProxy], 0), "%s.%s is %s" % (element.get("name"), label, wanted[label]))
        for active in (noise, sources["vtkPolyData"], sources["vtkUnstructuredGrid"]):
            for inputs_first in (True, False):
                found = made_by_keywords(element, inputs, settings, active, inputs_first)
                wrong = ["%s: %s, not %s" % (name, found[name], wanted[name]) for name in wanted
                         if found[name] != wanted[name]]
                require(not wrong, "%s, with another source active: %s" % (element.get("name"), "; ".join(wrong)))
        count += 1
    print("%d proxies by keywords" % count, flush=True)


def check_mistakes():
    script = os.path.join(folder, "mistake.py")
    for name, (code, message) in MISTAKES.items():
        with open(script, "w") as file:
            file.write("from paraview import simple\nsimple.LoadPlugin(%r, remote=False, ns=vars(simple))\n" % plugin + code)
        run = subprocess.run([pvpython, script], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, cwd=folder,
                             universal_newlines=True, timeout=300)
        # Not the mark itself, which ends the test.
        errors = [line.split("ERR" + "| ")[1] for line in run.stdout.splitlines() if "ERR" + "| " in line]
        require(len(errors) == 1 and message in errors[0] and "Traceback" not in run.stdout,
                "%s: %d errors: %s" % (name, len(errors), errors))
        print("%s: one error" % name, flush=True)


load_plugin(plugin)
check_all()
check_mistakes()
