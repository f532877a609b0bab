"""Compare Series: a model over the truth, and its distance from it, for series of surfaces in ParaView.

As a macro (Macros, Import new macro): select both series in the pipeline browser, the model first, and run it.
From Python: `import compare_series; compare_series.compare(model, truth)`.

Makes a layout of two views from the front that move together: the model (red) over the truth (green), and
the model coloured by its distance from the truth; both with the phase that is shown. Needs the DynamicCoronary
plugin.
"""
from paraview import servermanager, simple

import coronary_views as views

RED = [0.84, 0.15, 0.16]
GREEN = [0.24, 0.70, 0.31]
DISTANCE = "SurfaceDistance"


def compare(model, truth, greatest=0.5, size=None):
    """Builds the layout.

    model, truth   sources of surfaces, or output ports of such; time series or not
    greatest       distance at the end of the colours, mm, above 0
    size           width and height of both views together, pixels; None: as large as the window

    Returns a dictionary with `distance` (the MeshDistanceMetrics filter), `views` (overlay, distance)
    and `layout`. Raises RuntimeError without the plugin, ValueError for a distance that is not positive.
    """
    views.require_plugin()
    if not greatest > 0.0:
        raise ValueError("greatest must be above 0")
    layout, overlay = views.new_layout("Model and truth", size)
    coloured, _ = views.split(layout, 0, 0.5)

    # Times of both series are those of the animation, whatever was opened first.
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    time = scene.AnimationTime

    for source, colour in ((model, RED), (truth, GREEN)):
        views.plain(simple.Show(source, overlay, "GeometryRepresentation"), colour)

    distance = simple.MeshDistanceMetrics(registrationName="Distance", Result=model,
                                          Reference=truth)
    distance.UpdatePipeline(time)
    shown = simple.Show(simple.OutputPort(distance, 0), coloured, "GeometryRepresentation")
    views.colour_by(shown, coloured, DISTANCE, "distance (mm), negative: inside", -greatest, greatest,
                    "Cool to Warm")
    box = distance.GetDataInformation(0).GetBounds()
    for view in (overlay, coloured):
        views.look_from_the_front(view, box)
    views.note_phase((overlay, coloured), model)
    simple.AddCameraLink(overlay, coloured, "Model and truth")
    simple.SetActiveView(overlay)
    simple.Render(overlay)
    simple.Render(coloured)
    return {"distance": distance, "views": (overlay, coloured), "layout": layout}


def selected_series():
    """The two sources that are selected in the pipeline browser, in the order of the selection; else
    the only two that there are. Raises RuntimeError for anything else."""
    selection = servermanager.ProxyManager().GetSelectionModel("ActiveSources")
    chosen = []
    if selection:
        for index in range(selection.GetNumberOfSelectedProxies()):
            chosen.append(servermanager._getPyProxy(selection.GetSelectedProxy(index)))
    if len(chosen) != 2:
        chosen = [source for key, source in sorted(simple.GetSources().items(), key=_number)]
    if len(chosen) != 2:
        raise RuntimeError("Select two series in the pipeline browser: the model and the truth.")
    # By their names where these say it, whatever was clicked first.
    if "truth" in _name(chosen[0]) and "truth" not in _name(chosen[1]):
        chosen.reverse()
    return chosen


def _number(item):
    return int(item[0][1])


def _name(source):
    proxy = getattr(source, "Proxy", None) if source.__class__.__name__ == "OutputPort" else source
    for (name, number), known in simple.GetSources().items():
        if known == proxy or known == source:
            return name.lower()
    return ""


if __name__ in ("__main__", "__vtkconsole__"):
    compare(*selected_series())
