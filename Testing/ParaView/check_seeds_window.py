"""Runs inside the ParaView window, called by the play-back: seeds are picked on a slice, dragged, undone."""
import os
import sqlite3
import sys

import coronary_views
from paraview import simple

sys.path.insert(0, os.environ["DYNAMICCORONARY_TEST_SCRIPTS"])
from coronary_testing import IMAGE, OSTIA, fetch, require, require_different_pictures
from window_testing import Desktop, FOLDER, checker, near, photograph, picture

# Half the height of what the view shows, mm; the share of the view's width by which the handle is dragged.
SCALE = 25.0
DRAG = 0.1
TIME = 0.75
# A place of the screen that is in the view, pixels. ParaView 6 picks where the pointer is, others where the play-back says that it is.
INSIDE = (751, 460) if coronary_views.is_paraview(6, 0) else (1000, 500)

seen = {}


def make():
    """A slice of the phantom's image through the left ostium, which is in the middle of the view."""
    phantom = simple.CoronaryPhantom(registrationName="Phantom", Spacing=[1.6, 1.6, 1.6])
    phase = simple.ReferencePhase(simple.OutputPort(phantom, IMAGE), registrationName="Phase",
                                  Automatic=0, Time=TIME)
    seen["ostium"] = list(fetch(phantom, OSTIA, TIME).GetPoint(0))
    phase.UpdatePipeline(TIME)
    image = phase.GetDataInformation()
    bounds, extent = image.GetBounds(), image.GetExtent()
    share = (seen["ostium"][2] - bounds[4]) / (bounds[5] - bounds[4])
    view = simple.GetActiveViewOrCreate("RenderView")
    shown = simple.Show(phase, view)
    shown.SetRepresentationType("Slice")
    shown.SliceMode = "XY Plane"
    shown.Slice = round(extent[4] + share * (extent[5] - extent[4]))
    seen["height"] = bounds[4] + shown.Slice / (extent[5] - extent[4]) * (bounds[5] - bounds[4])
    simple.ColorBy(shown, ("POINTS", "HU"))
    simple.GetColorTransferFunction("HU").RescaleTransferFunction(-200.0, 500.0)
    simple.SetActiveSource(phase)
    simple.Render(view)


def aim(x=0.0, y=0.0):
    """The left ostium in the middle of the view, or as far from it as said, in mm."""
    view = simple.GetActiveView()
    centre = [seen["ostium"][0] + x, seen["ostium"][1] + y, seen["ostium"][2]]
    view.CameraParallelProjection = 1
    view.CameraParallelScale = SCALE
    view.CameraFocalPoint = centre
    # From the feet, as radiologists look: the patient's left is on the right.
    view.CameraPosition = [centre[0], centre[1], centre[2] - 100.0]
    view.CameraViewUp = [0.0, -1.0, 0.0]
    simple.Render(view)


def point():
    """The pointer into the view, where a pick wants it; the play-back says where in it the mouse is."""
    seen["desktop"] = Desktop()
    seen["desktop"].point(*INSIDE)
    seen["desktop"].focus()


def press(key):
    seen["desktop"].press(key)


def unapplied():
    """The seeds as the panel has them."""
    seeds = simple.GetActiveSource().SMProxy.GetProperty("SeedPoints")
    return [seeds.GetUncheckedElement(n) for n in range(seeds.GetNumberOfUncheckedElements())]


def mask_voxels():
    mask = fetch(simple.GetActiveSource(), 0, TIME).GetPointData().GetArray("VesselMask")
    return sum(bytes(memoryview(mask)))


def require_help():
    """The help's window has the plugin's pages: its collection, a data base in a temporary file, names them."""
    files = {os.readlink("/proc/self/fd/" + name) for name in os.listdir("/proc/self/fd")
             if os.path.islink("/proc/self/fd/" + name)}
    collections = [path for path in files if path.endswith(".qhc")]
    require(collections, "the help did not open")
    names = [row[0] for row in sqlite3.connect(collections[0]).execute("SELECT Name FROM NamespaceTable")]
    require("dynamiccoronaryplugin.org" in [name.lower() for name in names], "the help has %s" % names)


def look(step):
    view = simple.GetActiveView()
    source = simple.GetActiveSource()
    ostium = seen["ostium"]
    state = "%s, ostium %s" % (source.GetXMLName(), ostium)
    if hasattr(source, "SeedPoints"):
        state += ", seeds %s, of the panel %s" % (list(source.SeedPoints), unapplied())
    os.write(1, (step + ": " + state + "\n").encode())
    width, height = view.ViewSize
    dragged = [ostium[0] + DRAG * 2.0 * SCALE * width / height, ostium[1]]
    if step == "created":
        require(source.GetXMLName() == "VesselSegmentation", state)
        require(source.AutomaticOstia == 1 and not unapplied(), state)
    elif step == "added":
        require(near(unapplied(), view.CameraFocalPoint, 1e-6), state)
        require(not list(source.SeedPoints), "nothing was applied: " + state)
    elif step == "picked":
        # Where the mouse points, on the slice that is seen there.
        require(near(unapplied()[:2], ostium[:2], 0.3), state)
        require(abs(unapplied()[2] - seen["height"]) < 0.1, state)
    elif step == "dragged":
        require(near(unapplied()[:2], dragged, 0.3), state)
    elif step == "applied":
        require(near(list(source.SeedPoints), unapplied(), 1e-9), state)
        require(near(list(source.SeedPoints)[:2], ostium[:2], 0.3), state)
        require(mask_voxels() > 100, "%d voxels" % mask_voxels())
    elif step in ("removed", "undone"):
        require(bool(list(source.SeedPoints)) == (step == "undone"), state)
        require(unapplied() == list(source.SeedPoints), "the panel shows others: " + state)
    elif step == "setting":
        require(source.GenerateProbability == 1 and list(source.SeedPoints), state)
    elif step == "gone":
        require(source is None or source.GetXMLName() != "FrangiVesselness", state)
    elif step == "again":
        require(simple.FindSource("FrangiVesselness1") is not None, state)
    elif step == "help":
        if os.environ["DYNAMICCORONARY_HELP"]:
            require_help()
        else:
            os.write(1, b"skipped: the window of the help (this ParaView makes none of a plugin)\n")
    shown = picture("seeds_" + step, view, 0.005)
    if step == "dragged":
        require_different_pictures(os.path.join(FOLDER, "seeds_picked.png"), shown, 0.0005)


check = checker(look)
