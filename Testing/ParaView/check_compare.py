"""The macro that compares two series, and the state file that is shipped: pictures, times, distances."""
import importlib.util
import os
import runpy
import sys

from paraview import servermanager, simple
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

from coronary_testing import SURFACE, fetch, load_plugin, pixels, require

plugin, folder, macro, state = sys.argv[1:5]
TIMES = (0.1, 0.35, 0.6)
WIDTH = 500


def write_series(name, **settings):
    """A phantom's surface at three times, as NAME.pvd."""
    phantom = simple.CoronaryPhantom(SurfaceSpacing=1.2, **settings)
    entries = []
    for index, time in enumerate(TIMES):
        writer = vtkXMLPolyDataWriter()
        writer.SetFileName(os.path.join(folder, "%s_%02d.vtp" % (name, index)))
        writer.SetDataModeToBinary()
        writer.SetInputDataObject(fetch(phantom, SURFACE, time))
        writer.Write()
        entries.append('<DataSet timestep="%r" file="%s_%02d.vtp"/>' % (time, name, index))
    with open(os.path.join(folder, name + ".pvd"), "w") as file:
        file.write('<VTKFile type="Collection" version="0.1"><Collection>%s</Collection></VTKFile>'
                   % "".join(entries))
    simple.Delete(phantom)


def count(path, choice):
    """Of the pixels above the scalar bar."""
    data = pixels(path)
    return sum(1 for n in range(0, len(data), 3)
               if n // 3 // WIDTH > 100 and choice(data[n], data[n + 1], data[n + 2]))


def is_red(r, g, b):
    return r > 80 and r > 2 * g and r > 2 * b


def is_green(r, g, b):
    return g > 60 and 2 * g > 3 * r and 4 * g > 5 * b


def check_views(views, name):
    """Both colours in the first view, near and far in the second; other times are other pictures."""
    overlay, coloured = views
    pictures = []
    for index, time in enumerate(TIMES[:2]):
        scene = simple.GetAnimationScene()
        scene.AnimationTime = time
        pair = []
        for kind, view in (("overlay", overlay), ("distance", coloured)):
            view.ViewSize = [WIDTH, 400]
            simple.Render(view)
            path = os.path.join(folder, "%s_%s_%d.png" % (name, kind, index))
            simple.SaveScreenshot(path, view)
            pair.append(path)
        require(count(pair[0], is_red) > 300, "no model in " + pair[0])
        require(count(pair[0], is_green) > 300, "no truth in " + pair[0])
        # What is outside is seen, what is inside hardly.
        warm = count(pair[1], lambda r, g, b: r > b + 40 and r > 60)
        pale = count(pair[1], lambda r, g, b: abs(r - b) < 20 and r < 240)
        require(warm > 100 and pale > 500, "%d red, %d pale pixels in %s" % (warm, pale, pair[1]))
        pictures.append(pixels(pair[0]))
    require(pictures[0] != pictures[1], "the views do not follow the time")


def check_distance(distance):
    data = fetch(distance, 0, TIMES[1])
    array = data.GetPointData().GetArray("SurfaceDistance")
    require(array is not None and array.GetNumberOfTuples() == data.GetNumberOfPoints() > 1000,
            "no distances of points")
    low, high = array.GetRange()
    require(low < -0.02 and 0.02 < high < 5.0, "distances from %g to %g" % (low, high))
    require([round(t, 6) for t in distance.TimestepValues] == list(TIMES), "other times")


def open_series():
    model = simple.PVDReader(registrationName="Model", FileName=os.path.join(folder, "motion.pvd"))
    truth = simple.PVDReader(registrationName="Truth", FileName=os.path.join(folder, "surface.pvd"))
    return model, truth


def render_views():
    """Overlay first: it is the one that shows the truth."""
    views = simple.GetRenderViews()
    require(len(views) == 2, "%d views" % len(views))
    truth = simple.FindSource("Truth")

    def shows_truth(view):
        shown = simple.GetDisplayProperties(truth, view)
        return bool(shown and shown.Visibility)

    return sorted(views, key=lambda view: not shows_truth(view))


def as_macro():
    """Selected in the wrong order: the names decide."""
    model, truth = open_series()
    selection = servermanager.ProxyManager().GetSelectionModel("ActiveSources")
    selection.Select(truth.SMProxy, selection.SELECT)
    selection.Select(model.SMProxy, selection.SELECT)
    runpy.run_path(macro, run_name="__main__")
    check_distance(simple.FindSource("Distance"))
    require(simple.FindSource("Distance").Result == model, "model and truth are mixed up")
    check_views(render_views(), "macro")


def as_module():
    spec = importlib.util.spec_from_file_location("compare_series", macro)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    model, truth = open_series()
    made = module.compare(model, truth, greatest=0.5, size=(1000, 400))
    require(made["distance"].Reference == truth, "model and truth are mixed up")
    try:
        module.compare(model, truth, greatest=0.0)
    except ValueError:
        pass
    else:
        require(False, "a distance of nothing was accepted")
    return made


def as_state():
    os.environ["DYNAMICCORONARY_MODEL"] = os.path.join(folder, "motion.pvd")
    os.environ["DYNAMICCORONARY_TRUTH"] = os.path.join(folder, "surface.pvd")
    runpy.run_path(state)
    check_distance(simple.FindSource("Distance"))
    check_views(render_views(), "state")


load_plugin(plugin)
write_series("motion", Seed=1)
write_series("surface", Seed=1, Tortuosity=0.5)
as_macro()
simple.ResetSession()
as_module()
simple.ResetSession()
as_state()
