"""Dynamic Coronary: correct a named tree by hand, with points that are picked in the view.

From the menu: *Correct the Tree* puts Vessel Edits behind the selected tree; an edit is made of the filter's settings, kept,
undone, saved. From Python: `import correct_tree; edits = correct_tree.start(tree)`, then the settings of the filter and
`correct_tree.keep(edits)`. See docs/editing.md. Needs the DynamicCoronary plugin.
"""
import json
import os

from paraview import simple

import coronary_views as views

EDITS_FILE = "edits.json"


def start(tree=None):
    """Vessel Edits behind a named tree, None: the selected source; with the CT and the vesselness that it was made of."""
    views.require_plugin()
    tree = tree or simple.GetActiveSource()
    if tree is None or views.is_image(tree) or "SegmentIds" not in tree.CellData.keys():
        raise RuntimeError("Select a named tree first: 5 Named trees, or the centerline.vtp of a run.")
    image, vesselness = scene_of(tree)
    given = {}
    if image is not None:
        given["CTImage"] = image
        if vesselness is not None:
            given["Vesselness"] = vesselness
    else:
        print("Dynamic Coronary: there is no CT image of this tree: vessels are drawn straight, with a radius.")
    folder = folder_of(tree)
    path = os.path.join(folder, EDITS_FILE) if folder else ""
    edits = simple.VesselEdits(Input=tree, registrationName="Corrected tree", **given)
    if os.path.exists(path):
        print("Dynamic Coronary: the edits of '%s' are in this tree already; those made here come behind them." % path)
    edits.UpdatePipeline()
    view = simple.GetActiveView()
    if view and view.GetXMLName() == "RenderView":
        shown = simple.Show(edits, view, "GeometryRepresentation")
        simple.Hide(tree, view)
        shown.LineWidth = 3.0
        views.name_segments(edits, shown, view)
    simple.SetActiveSource(edits)
    return edits


def upstream_of(source):
    """The proxies that a source is made of, itself first, along the first inputs."""
    proxy = views.proxy_of(source)
    found = [proxy]
    while getattr(proxy, "Input", None) is not None:
        proxy = views.proxy_of(proxy.Input)
        found.append(proxy)
    return found


def folder_of(tree):
    """The folder of the run that a tree was read from; empty: it was made here."""
    first = upstream_of(tree)[-1]
    names = getattr(first, "FileName", None) or getattr(first, "FileNames", None) or []
    name = names if isinstance(names, str) else (list(names) or [""])[0]
    folder = os.path.dirname(os.path.abspath(name)) if name else ""
    return folder if os.path.exists(os.path.join(folder, "report.json")) else ""


def scene_of(tree):
    """The image and the vesselness that a tree was made of, or None."""
    for proxy in upstream_of(tree):
        if proxy.GetXMLName() == "FastMarchingCenterline" and proxy.CTImage is not None:
            return proxy.CTImage, proxy.Input
    series = [source for source in simple.GetSources().values() if views.is_series(source)]
    folder = folder_of(tree)
    if not series or not folder:
        return None, None
    data = views.fetched(tree).GetFieldData().GetArray("PhaseTime")
    image = simple.ReferencePhase(series[0], registrationName="Reference phase of the tree", Automatic=int(data is None),
                                  Time=data.GetTuple1(0) if data else 0.75)
    path = os.path.join(folder, "vesselness.mha")
    if not os.path.exists(path):
        return image, None
    return image, simple.GatedImageReader(FileNames=[path], registrationName="Vesselness of the tree")


def chosen(edits=None):
    """The Vessel Edits that is meant."""
    edits = edits or simple.GetActiveSource()
    if edits is None or edits.GetXMLName() != "VesselEdits":
        raise RuntimeError("Select Vessel Edits first (the menu's Correct the Tree makes one).")
    return edits


def clear(edits):
    """The settings of the next edit."""
    edits.Edit, edits.EditPoints, edits.VesselName, edits.NewName = "None", [], "", ""
    edits.Radius, edits.Reach = 0.0, 0.0


def keep(edits=None):
    """The edit that the settings make goes into the list; they are free for the next one."""
    edits = chosen(edits)
    if edits.Edit == "None":
        raise RuntimeError("There is no edit to keep: choose one, put its points, Apply.")
    edits.UpdatePipeline()
    if edits.GetDataInformation(0).GetNumberOfPoints() == 0:
        raise RuntimeError("The edit can not be applied: the message before this one says why.")
    edits.SMProxy.UpdatePropertyInformation()
    edits.Edits = list(edits.Edits) + [edits.GetPropertyValue("CurrentEdit")]
    clear(edits)
    refresh(edits)


def undo(edits=None):
    """The edit that is not kept yet is dropped, or the last one of the list."""
    edits = chosen(edits)
    if edits.Edit != "None":
        clear(edits)
    elif len(edits.Edits):
        edits.Edits = list(edits.Edits)[:-1]
    else:
        raise RuntimeError("There is no edit to undo.")
    refresh(edits)


def save(edits=None, path=""):
    """All edits as a file: `path`, else edits.json of the run that the tree is from."""
    edits = chosen(edits)
    folder = folder_of(edits)
    if not path and not folder:
        raise RuntimeError("The tree is of no run: say where, correct_tree.save(path='RUN/edits.json').")
    edits.SMProxy.UpdatePropertyInformation()
    text = edits.GetPropertyValue("EditsText")
    if not text:
        raise RuntimeError("The edits can not be written: the message before this one says why.")
    whole = json.loads(text)
    if folder:
        # What the tree of a run was made with comes first.
        with open(os.path.join(folder, "report.json"), encoding="utf-8") as file:
            whole["edits"] = json.load(file).get("edits", []) + whole["edits"]
    path = path or os.path.join(folder, EDITS_FILE)
    with open(path, "w", encoding="utf-8") as file:
        json.dump(whole, file, indent=1)
    print("Dynamic Coronary: '%s'; coronary-pipeline edit %s apply makes the run anew." % (path, os.path.dirname(path)))
    return path


def refresh(edits):
    """Computes and draws."""
    edits.UpdatePipeline()
    if simple.GetActiveView():
        simple.Render()
