"""Compare Series: a model over the truth, and its distance from it, for series of surfaces in ParaView.

As a macro (Macros, Import new macro): select both series in the pipeline browser, the model first, and run it.
From Python: `import compare_series; compare_series.compare(model, truth)`.

Makes a layout of two views from the front that move together: the model (red) over the truth (green), and
the model coloured by its distance from the truth; both with the phase that is shown. Needs the DynamicCoronary
plugin.
"""
from paraview import servermanager, simple

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
    if not hasattr(simple, "MeshDistanceMetrics"):
        raise RuntimeError("The DynamicCoronary plugin is not loaded (Tools, Manage Plugins).")
    if not greatest > 0.0:
        raise ValueError("greatest must be above 0")
    layout = simple.CreateLayout("Model and truth")
    overlay = simple.CreateView("RenderView")
    simple.AssignViewToLayout(overlay, layout, 0)
    coloured = simple.CreateView("RenderView")
    simple.AssignViewToLayout(coloured, layout, layout.SplitHorizontal(0, 0.5) + 1)
    if size:
        layout.SetSize(*size)

    # Times of both series are those of the animation, whatever was opened first.
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    time = scene.AnimationTime

    for source, colour in ((model, RED), (truth, GREEN)):
        shown = simple.Show(source, overlay, "GeometryRepresentation")
        shown.ColorArrayName = [None, ""]
        shown.AmbientColor = shown.DiffuseColor = colour

    distance = simple.MeshDistanceMetrics(registrationName="Distance", Result=model,
                                          Reference=truth)
    distance.UpdatePipeline(time)
    shown = simple.Show(simple.OutputPort(distance, 0), coloured, "GeometryRepresentation")
    simple.ColorBy(shown, ("POINTS", DISTANCE))
    transfer = simple.GetColorTransferFunction(DISTANCE)
    transfer.ApplyPreset("Cool to Warm", True)
    transfer.RescaleTransferFunction(-greatest, greatest)
    transfer.AutomaticRescaleRangeMode = "Never"
    shown.SetScalarBarVisibility(coloured, True)
    bar = simple.GetScalarBar(transfer, coloured)
    bar.Title = "distance (mm), negative: inside"
    bar.ComponentTitle = ""
    bar.TitleColor = bar.LabelColor = [0.0, 0.0, 0.0]
    bar.AutomaticLabelFormat = 0
    bar.LabelFormat = bar.RangeLabelFormat = "%-#.2f"
    bar.Orientation = "Horizontal"
    bar.WindowLocation = "Lower Center"
    bar.ScalarBarLength = 0.5

    for view in (overlay, coloured):
        phase = simple.AnnotateTimeFilter(model, registrationName="Phase",
                                          Format="{time:.3f} of the R-R interval")
        label = simple.Show(phase, view)
        label.Color = [0.0, 0.0, 0.0]
        label.WindowLocation = "Upper Left Corner"
        look_from_the_front(view)
    simple.AddCameraLink(overlay, coloured, "Model and truth")
    simple.SetActiveView(overlay)
    simple.Render(overlay)
    simple.Render(coloured)
    return {"distance": distance, "views": (overlay, coloured), "layout": layout}


def look_from_the_front(view):
    """LPS: the viewer stands before the patient, who stands upright."""
    view.UseColorPaletteForBackground = 0
    view.Background = [1.0, 1.0, 1.0]
    view.OrientationAxesLabelColor = [0.0, 0.0, 0.0]
    view.CameraParallelProjection = 1
    view.CameraPosition = [0.0, -1.0, 0.0]
    view.CameraFocalPoint = [0.0, 0.0, 0.0]
    view.CameraViewUp = [0.0, 0.0, 1.0]
    simple.ResetCamera(view)
    # The sphere around the tree fits; the tree is flatter.
    view.CameraParallelScale *= 0.8


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
