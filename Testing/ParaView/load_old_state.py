"""A state of version 1 loads, and one message says what it sets and this version does not have."""
import glob
import os
import re
import sys
import xml.etree.ElementTree as ElementTree

from paraview import simple
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

from coronary_testing import fetch, find, load_plugin, require, write_dicom

plugin, folder, source = sys.argv[1:4]
HEAD = "The state is of DynamicCoronary 1."
# Names in the pipeline browser, and what is said of each; what has its usual value is not told.
TOLD = {"Heart (CoronaryPhantomSource)": ("VeinHU = 200 has no effect: coronary-pipeline phantom has the option",),
        "Lines (FastMarchingCenterline)": ("RefineLumen = 0 has no effect: the lumen is always refined",
                                           "RadiusArrayName = Calibre has no effect: names of arrays are fixed"),
        "Branches (CoronaryBranchMetrics)": ("Spacing = 0.5 has no effect: it is 0.25 mm",
                                             "the proxy is part of Centerline Metrics now"),
        "Lines of VMTK (CoronaryCenterlineConversion)": ("the proxy is part of Coronary Tree Topology now",),
        "Folder (CoronaryGatedDICOMFolder)": ("the proxy is part of Gated Image Reader now",)}


def messages_of(action):
    """What ParaView says meanwhile."""
    before, window = vtkOutputWindow.GetInstance(), vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(window)
    action()
    vtkOutputWindow.SetInstance(before)
    return window.GetOutput()


def require_message(text):
    require(text.count(HEAD) == 1, "no message, or several: %s" % text)
    require("rror" not in text, "an error: %s" % text)
    lines = [line.strip() for line in text[text.index(HEAD):].splitlines()[1:] if line.startswith("  ")]
    expected = [(name, what) for name, told in TOLD.items() for what in told]
    for name, what in expected:
        require(any(line.startswith(name + ": " + what) for line in lines), "not told: %s, %s in\n%s" % (name, what, text))
    require(len(lines) == len(expected), "other lines:\n%s" % text)


def require_pipeline():
    """What the state set is there, in today's proxies and properties."""
    require(find("Heart").Seed == 3, "the seed")
    lines = find("Lines")
    require(lines.SpeedThreshold == 0.0 and lines.IntensityThreshold == 80.0, "the thresholds")
    require(find("Distance").EndLength == 0.0, "ends")
    branches = find("Branches")
    require(branches.GetXMLName() == "CoronaryCenterlineMetrics" and branches.Tolerance == 1.5, "the branches")
    require(branches.MinimumLength == 4.0, "the property that was LeastLength")
    require(find("Still branches").Input.Port == 3 and find("Still lines").Input.Port == 3, "the outputs")
    require(fetch(find("Still branches"), 0, 0.0).GetCellData().HasArray("BranchMatch"), "no branches")
    require(fetch(find("Still lines"), 0, 0.0).GetCellData().HasArray("TractIds"), "no lines of VMTK")
    require(list(find("Folder").FileNames) == [os.path.join(folder, "dicom")], "the folder")
    require(fetch(find("Folder"), 0, 0.0).GetDimensions() == (2, 2, 2), "the images")


def require_true_table():
    """The table names what is gone, and nothing that is there."""
    with open(os.path.join(source, "Plugin", "coronaryVersion1.h")) as file:
        text = file.read()
    rows = re.findall(r'\{\s*"(\w+)",\s*"(\w+)",\s*"([^"]*)",\s*("|FixedName|PhantomOption)', text)
    renamed = re.findall(r'\{\s*"(\w+)",\s*"(\w+)",\s*"(\w+)"\s*\}', text)
    there = {}
    for path in glob.glob(os.path.join(source, "ServerManagerXML", "*.xml")):
        for proxy in ElementTree.parse(path).getroot().iter():
            if proxy.tag in ("SourceProxy", "WriterProxy"):
                there[proxy.get("name")] = {child.get("name") for child in proxy}
    require(len(rows) > 100, "%d rows" % len(rows))
    for name, gone, value, _ in rows:
        # Rows of switches have the property that is left in fourth place.
        require(gone not in there.get(name, ()), "%s.%s is there" % (name, gone))
    require(renamed, "no renamed properties")
    for name, old, new in renamed:
        require(new in there[name] and old not in there[name], "%s.%s is not %s" % (name, old, new))


def require_python_error():
    """A script of version 1 stops where it sets what is gone, and says what."""
    try:
        find("Lines").RefineLumen = 0
    except AttributeError as error:
        require("RefineLumen" in str(error), "the error is '%s'" % error)
    else:
        require(False, "a property that is gone was set")
    require(not hasattr(simple, "BranchMetrics"), "a proxy that is gone")


load_plugin(plugin)
write_dicom(folder)
with open(os.path.join(os.path.dirname(__file__), "version1.pvsm")) as file:
    text = file.read().replace("@FOLDER@", folder)
state = os.path.join(folder, "version1.pvsm")
with open(state, "w") as file:
    file.write(text)
require_true_table()
require_message(messages_of(lambda: simple.LoadState(state)))
require_pipeline()
require_python_error()
# Saved again it is a state of today.
again = os.path.join(folder, "again.pvsm")
simple.SaveState(again)
simple.ResetSession()
require(HEAD not in messages_of(lambda: simple.LoadState(again)), "a message of a state of today")
require_pipeline()
