"""Runs inside the ParaView window, called by the play-back: a vessel is looked along, a branch deleted in the panel, kept, undone."""
import os
import sys

from paraview import simple

sys.path.insert(0, os.environ["DYNAMICCORONARY_TEST_SCRIPTS"])
from coronary_testing import CENTERLINES, require
from window_testing import FOLDER, checker, photograph, picture

seen = {}


def make():
    """The phantom's images at three phases, with plaques, and its tree."""
    phantom = simple.CoronaryPhantom(registrationName="Phantom", Spacing=[1.6, 1.6, 1.6], TemporalWindow=0.0, Phases=[0.05, 0.35, 0.75],
                                     Diseases="stenosed")
    seen["tree"] = simple.CoronaryTreeTopology(registrationName="Tree", Input=simple.OutputPort(phantom, CENTERLINES))
    simple.GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
    simple.GetAnimationScene().AnimationTime = 0.35
    simple.SetActiveSource(seen["tree"])


def choose():
    simple.SetActiveSource(seen["tree"])


def lines(source):
    """{name: branches} of a named tree."""
    import coronary_views
    names = coronary_views.fetched(source).GetCellData().GetAbstractArray("SegmentLabel")
    found = [names.GetValue(n) for n in range(names.GetNumberOfValues())]
    return {name: found.count(name) for name in found}


def views_of(kind):
    return [view for view in simple.GetViews() if view.GetXMLName() == kind]


def look(step):
    if step == "looked":
        cycle = simple.FindSource("Over the cycle")
        require(cycle is not None, "there is no Over the cycle")
        tables, charts = views_of("SpreadSheetView"), views_of("XYChartView")
        require(len(tables) == 1 and len(charts) == 1, "views: %s" % [view.GetXMLName() for view in simple.GetViews()])
        shown = [view for view in simple.GetRenderViews() if any(
            getattr(one, "Visibility", 0) and getattr(one, "Input", None) is not None and
            one.SMProxy.GetProperty("Input").GetProxy(0) == cycle.SMProxy for one in view.Representations)]
        require(len(shown) == 1, "%d views show the map" % len(shown))
        picture("hand_map", shown[0], 0.1)
        rows = cycle.GetDataInformation(2).GetNumberOfRows()
        os.write(1, ("%d lesions\n" % rows).encode())
        require(rows > 0, "the table of lesions is empty")
        photograph("looked")
        return
    edits = simple.GetActiveSource()
    require(edits.GetXMLName() == "VesselEdits", "%s is active" % edits.GetXMLName())
    now = lines(edits)
    os.write(1, ("%s: %s, edits %s\n" % (step, now, list(edits.Edits))).encode())
    if step == "begun":
        seen["whole"] = now
        require(now.get("D1", 0) > 0, "the tree has no D1: %s" % now)
    elif step == "deleted":
        require(edits.Edit == "Delete" and "D1" not in now, "D1 is there: %s" % now)
    elif step == "kept":
        require(edits.Edit == "None" and len(edits.Edits) == 1 and "D1" not in now, "kept: %s, %s" % (list(edits.Edits), now))
    elif step == "undone":
        require(now == seen["whole"] and not list(edits.Edits), "undone: %s" % now)
    photograph(step)


check = checker(look)
