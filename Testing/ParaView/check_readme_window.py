"""Runs inside the ParaView window, which was started as README says, called by the play-back: the plugin is there, and a
series that is opened is grey, its times and cycle length in the panel."""
import os
import sys

from paraview import simple

sys.path.insert(0, os.environ["DYNAMICCORONARY_TEST_SCRIPTS"])
from coronary_testing import pixels, require, write_series
from window_testing import FOLDER, checker, near, photograph, picture

FRACTIONS = [0.1, 0.4, 0.75]


def open_series():
    """As File > Open does, which asks nothing when one reader alone takes a file."""
    simple.ResetSession()
    path = os.path.join(FOLDER, "series.json")
    write_series(path, FRACTIONS, 850)
    simple.SetActiveSource(simple.OpenDataFile(path))


def require_grey(view):
    """On black no pixel has a colour, and there are many greys."""
    view.UseColorPaletteForBackground = 0
    view.Background = [0.0, 0.0, 0.0]
    view.OrientationAxesVisibility = 0
    colours = pixels(picture("readme_series", view, 0.05))
    reds, greens, blues = colours[0::3], colours[1::3], colours[2::3]
    require(reds == greens == blues, "the image is not grey")
    require(len(set(reds)) > 5, "the image shows nothing: %s" % set(reds))


def look(step):
    if step == "menu":
        view = simple.GetActiveView()
        picture("readme_menu", view, 0.02)
        require(simple.GetSources(), "the example made nothing")
        return
    source = simple.GetActiveSource()
    source.UpdatePropertyInformation()
    require(near(list(source.TimestepValues), FRACTIONS, 1e-9), "times %s" % list(source.TimestepValues))
    require(abs(source.UsedCycleLength - 0.85) < 1e-9, "cycle length %s" % source.UsedCycleLength)
    view = simple.GetActiveView()
    shown = simple.GetDisplayProperties(source, view)
    require(shown.Representation == "Slice" and shown.ColorArrayName[1] == "HU",
            "shown as %s of %s" % (shown.Representation, shown.ColorArrayName[1]))
    table = simple.GetColorTransferFunction("HU")
    points = list(table.RGBPoints)
    require(points[0] == -150.0 and points[-4] == 650.0, "the window is %s" % points)
    require_grey(view)


check = checker(look)
