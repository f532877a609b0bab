"""What the window *Build from 4D CT* asks of Python: what is to be done, and to show what was made.

The window (Plugin/coronaryBuild.cxx) runs the programs and calls these functions with one text; their answers are files
plan.json in a folder that it names, since the call has no other. Of one build at a time.
"""
import json
import os
import shlex

from paraview import print_error, servermanager, simple

import build_from_4d_ct
import coronary_views as views

# A series of few phases is moved at more moments than it has.
FEW_PHASES, MOMENTS = 10, 20
# Of the stages of the program: what is opened of each, the name, the reader, the file, and whether it is shown.
OPENED = {
    "vesselness": [("Vesselness", "GatedImageReader", "vesselness.mha", False)],
    "segmentation": [("Mask", "SegmentationReader", "mask.mha", False), ("Ostia", "XMLPolyDataReader", "ostia.vtp", True)],
    "centerline": [("Named trees", "XMLPolyDataReader", "centerline.vtp", True)],
    "surface": [("Surface", "XMLPolyDataReader", "surface.vtp", True)],
    "volume": [("Tetrahedra", "XMLUnstructuredGridReader", "volume.vtu", False)],
    "weights": [("Skin weights", "XMLUnstructuredGridReader", "weights.vtu", False)],
    "motion": [("Skeleton in time", "PVDReader", os.path.join("motion", "skeleton.pvd"), False),
               ("Moving mesh", "PVDReader", os.path.join("motion", "volume.pvd"), False)],
}

_now = {}


def _answer(answer):
    with open(os.path.join(_now["temporary"], "plan.json"), "w", encoding="utf-8") as file:
        json.dump(answer, file)


def plan(wish):
    """`wish`: folder, options and temporary folder, as JSON. Answers with the steps, or an error."""
    _now.clear()
    _now.update(json.loads(wish))
    try:
        _answer({"steps": _steps()})
    except (RuntimeError, ValueError) as error:
        _answer({"error": str(error)})


def _steps():
    views.require_plugin()
    if servermanager.ActiveConnection.IsRemote():
        raise RuntimeError("The images are on a server, and the program would run here: build_from_4d_ct.build() in Python "
                           "makes the same on the server.")
    _now["folder"] = os.path.abspath(os.path.expanduser(_now["folder"])) if _now["folder"] else os.path.join(
        _now["temporary"], "run")
    if os.path.isdir(_now["folder"]) and os.listdir(_now["folder"]) and not os.path.isfile(
            os.path.join(_now["folder"], "report.json")):
        raise RuntimeError("'%s' has other files: choose an empty folder, or one of an unfinished run." % _now["folder"])
    steps = []
    if not simple.GetSources():
        _now["series"] = os.path.join(_now["temporary"], "phantom", "series.json")
        example = build_from_4d_ct.EXAMPLE
        steps.append({"words": "Makes a phantom:", "arguments": [
            "phantom", "--seed", str(example["Seed"]), "--no-truth", "--spacing", str(example["Spacing"][0]),
            "--fractions=" + ",".join(map(str, example["Phases"])), "--output", os.path.dirname(_now["series"])]})
        images, times = [_now["series"]], example["Phases"]
    else:
        source = _now["series"] = build_from_4d_ct.selected_series()
        times = views.times_of(source)
        if views.proxy_of(source).GetXMLName() == "CoronaryGatedImageReader":
            images = _of_reader(views.proxy_of(source))
        else:
            images = [os.path.join(_now["temporary"], "series", "series.json")]
            steps.append({"words": "Writes the images.", "function": "save_phase", "turns": max(1, len(times))})
    moments = []
    if 1 < len(times) < FEW_PHASES:
        moments = ["--moments=" + ",".join("%.10g" % time for time in sorted(
            set(times) | {number / MOMENTS for number in range(MOMENTS)}))]
    steps.append({"words": "Builds:", "arguments": ["run", *images, *moments, "--output", _now["folder"], "--resume",
                                                    *shlex.split(_now["options"])]})
    steps.append({"words": "Shows the model.", "function": "show"})
    return steps


def _of_reader(reader):
    """What the program is told of the files that a reader reads."""
    told = list(reader.FileNames)
    if len(reader.PhaseFractions):
        told.append("--fractions=" + ",".join("%.17g" % time for time in reader.PhaseFractions))
    if reader.SeriesInstanceUID:
        told += ["--series", reader.SeriesInstanceUID]
    cycle = reader.SMProxy.GetProperty("CycleLength").GetElement(0)
    return told + ["--cycle-ms", "%.10g" % (1000.0 * cycle)]


def save_phase(turn):
    """Writes the phase of this number of a series that is no file."""
    source = _now["series"]
    port = source if views.is_port(source) else simple.OutputPort(source, 0)
    times = views.times_of(source) or [0.0]
    number, folder = int(turn), os.path.join(_now["temporary"], "series")
    os.makedirs(folder, exist_ok=True)
    port.Proxy.UpdatePipeline(times[number])
    writer = servermanager.writers.XMLImageDataWriter(Input=port, FileName=os.path.join(folder, "%02d.vti" % number))
    writer.DataMode = "Binary"  # appended data does not read with Debian's libexpat1
    writer.UpdatePipeline(times[number])
    if number + 1 == len(times):
        cycle = port.Proxy.GetDataInformation(port.Port).GetFieldDataInformation().GetArrayInformation("CycleLength")
        series = {"phases": [{"fraction": time, "image": "%02d.vti" % n} for n, time in enumerate(times)]}
        if cycle:
            series["cycle_ms"] = 1000.0 * cycle.GetComponentRange(0)[0]
        with open(os.path.join(folder, "series.json"), "w", encoding="utf-8") as file:
            json.dump(series, file)


def opened(stage):
    """Opens what a stage of the program has made."""
    for name, reader, file, shown in OPENED.get(stage, []):
        path = os.path.join(_now["folder"], file)
        if not os.path.isfile(path):
            continue
        files = {"FileNames" if reader in ("GatedImageReader", "SegmentationReader") else "FileName":
                 path if reader == "PVDReader" else [path]}
        source = build_from_4d_ct.opened_once(name, getattr(simple, reader), **files)
        if shown:
            _show(source, name)


def _show(source, name):
    """In a view of the stages."""
    source.UpdatePipeline()
    if source.GetDataInformation(0).GetNumberOfPoints() == 0:
        return
    view = _now.get("view")
    if not view or view not in simple.GetRenderViews():
        _, view = views.new_layout("Stages")
        _now["view"] = view
    shown = simple.Show(source, view, "GeometryRepresentation")
    views.plain(shown, views.WALL)
    shown.LineWidth, shown.PointSize = 4.0, 12.0
    if name == "Surface":
        shown.Opacity = 0.5
    views.look_from_the_front(view, list(source.GetDataInformation(0).GetBounds()), 1.25 if name != "Ostia" else 0.5)
    simple.Render(view)


def show(_):
    """Shows the model, and lets its frames be computed."""
    series = _now["series"]
    try:
        made = build_from_4d_ct.open_result(_now["folder"], series)
    except RuntimeError as error:
        # A run that was asked to end earlier, --until.
        print("Dynamic Coronary: %s" % error)
        return
    _now["frames"] = made["frames"]
    _answer({"steps": [{"words": "Gets the pictures ready.", "function": "frame", "turns": made["steps"] + 1}]})


def frame(_):
    """The next frame, and when there is none the end."""
    next(_now["frames"], None)


def cancelled(_):
    """What was begun is left in order."""
    if "frames" in _now:
        _now["frames"].close()


def failed(reason):
    """One message."""
    print_error("Dynamic Coronary: %s" % reason)
