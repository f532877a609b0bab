"""Look Along the Vessel: one vessel of a tree as the image has it, across it, and its diameter over the heart cycle.

From the menu (Dynamic Coronary, Look Along the Vessel): select an image or a gated series and a tree of centerlines in the
pipeline browser, or have the result of Build from 4D CT there. From Python: `import look_along_vessel;
look_along_vessel.look(image, tree, vessel="LAD")`.

Makes a layout: the tree with the sheet and the cross-section, the flat reformat, the flat cross-section, a chart of the
diameter, its map of place and phase where there are several phases, and the table of lesions. Another vessel is the property Vessel, another place Position of "Along the vessel". Needs the
DynamicCoronary plugin.
"""
from paraview import servermanager, simple

import coronary_views as views

# Lines on grey pictures; the review page has the same.
OUTLINES = (("Axis", [0.60, 0.62, 0.66]), ("Lumen", [0.31, 0.84, 1.00]), ("Edge", [0.95, 0.95, 0.95]),
            ("Outer Boundary", [0.77, 0.55, 1.00]), ("Place", [1.00, 0.38, 0.38]))
MAP_ASPECT = 0.35  # height over width of the map
HOUNSFIELD = (-150.0, 650.0)
REFORMAT, SECTION, IN_PLACE = range(3)
PROFILE, MAP, LESIONS, TREE = range(4)
SUMMARY = {"Least": [0.12, 0.47, 0.71], "Median": [0.10, 0.10, 0.10], "Greatest": [0.84, 0.15, 0.16],
           "Healthy": [0.17, 0.63, 0.17]}


def look(image, tree, vessel="", wall=None, size=None):
    """Builds the filters and the layout.

    image    CT in HU, one phase or a gated series, or the output port of one
    tree     named centerlines, still or moving: tracked, regularised or interpolated
    vessel   LAD, LCx, RCA or a segment's name; empty: the longest
    wall     surface that is shown around the tree; None: none
    size     width and height of all views together, pixels; None: as large as the window

    Returns a dictionary with `reformat` (CurvedReformat), `cycle` (LumenCycle), `views` (place, reformat, section,
    chart), `map` (None for a tree that stands still), `lesions` and `layout`. Raises RuntimeError without the plugin, or when the tree does not have the vessel.
    """
    views.require_plugin()
    times = views.times_of(image)
    reformat = simple.CurvedReformat(registrationName="Along the vessel", Input=image, Centerlines=tree, Vessel=vessel)
    series = len(times) > 1 and len(views.times_of(tree)) > 1
    cycle = simple.LumenCycle(registrationName="Over the cycle", Input=tree, Vessel=vessel)
    if series and _knows_blur(tree):
        cycle.Image = image
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    reformat.UpdatePipeline(scene.AnimationTime)
    if reformat.GetDataInformation(REFORMAT).GetNumberOfPoints() == 0:
        simple.Delete(cycle)
        simple.Delete(reformat)
        raise RuntimeError("there is nothing to see along the vessel: see the output messages.")

    layout, place = views.new_layout("Along the vessel", size)
    flat, cell = views.split(layout, 0, 0.4)
    section, cell = views.split(layout, cell, 0.35, downwards=True)
    chart = simple.CreateView("XYChartView")
    cell = layout.SplitHorizontal(cell, 0.3) + 1
    simple.AssignViewToLayout(chart, layout, cell)
    cycle.UpdatePipeline(scene.AnimationTime)
    phases = cycle.GetDataInformation(MAP).GetBounds()[2:4]
    moving = phases[0] < phases[1]
    sheet = None
    if moving:
        sheet, cell = views.split(layout, cell, 0.5, downwards=True)
    table = simple.CreateView("SpreadSheetView")
    simple.AssignViewToLayout(table, layout, layout.SplitVertical(1, 0.75) + 1)  # below the tree
    if size:
        layout.SetSize(*size)

    array = _image_array(reformat)
    window = HOUNSFIELD if array == "HU" else reformat.GetDataInformation(REFORMAT).GetPointDataInformation() \
        .GetArrayInformation(array).GetComponentRange(0)
    for view, port in ((place, IN_PLACE), (flat, REFORMAT), (section, SECTION)):
        show_port(reformat, port, view, array, window)
    lines = simple.Show(tree, place, "GeometryRepresentation")
    views.plain(lines, views.LINE)
    lines.LineWidth = 2.0
    if wall is not None:
        views.plain(simple.Show(wall, place, "GeometryRepresentation"), views.WALL, 0.25)
    views.look_from_the_front(place, reformat.GetDataInformation(IN_PLACE).GetBounds())
    for view, port in ((flat, REFORMAT), (section, SECTION)):
        views.look_along(view, [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], reformat.GetDataInformation(port).GetBounds(), 1.0)
        view.Background = views.BLACK
        view.OrientationAxesVisibility = 0
        view.InteractionMode = "2D"
    _fit(flat, reformat.GetDataInformation(REFORMAT).GetBounds())
    _fit(section, reformat.GetDataInformation(SECTION).GetBounds())
    if len(times) > 1:
        views.note_phase((place,), image)
    chart_profile(cycle, chart)
    if moving:
        show_map(cycle, sheet)
    simple.Show(simple.OutputPort(cycle, LESIONS), table, "SpreadSheetRepresentation")
    simple.SetActiveSource(reformat)
    simple.SetActiveView(place)
    simple.RenderAllViews()
    return {"reformat": reformat, "cycle": cycle, "views": (place, flat, section, chart), "map": sheet, "lesions": table,
            "layout": layout}


def show_port(reformat, port, view, array, window):
    """One of the filter's outputs, the picture grey, the outlines in their colours."""
    shown = simple.Show(simple.OutputPort(reformat, port), view, "GeometryRepresentation")
    views.grey_slice(shown, array, *window)
    transfer = simple.GetColorTransferFunction(array)
    transfer.NanColor = [0.2, 0.2, 0.3]
    shown.SetScalarBarVisibility(view, False)
    shown.LineWidth = 2.0
    shown.BlockSelectors = ["/Root"]
    shown.BlockColors = [part for name, colour in OUTLINES for part in ["/Root/" + name.replace(" ", "")] + [str(one) for one in colour]]
    return shown


def chart_profile(cycle, view):
    """The diameter along the vessel: every phase pale, and least, median, greatest and healthy over them."""
    shown = simple.Show(simple.OutputPort(cycle, PROFILE), view, "XYChartRepresentation")
    shown.UseIndexForXAxis = 0
    shown.XArrayName = "Position"
    columns = _columns(cycle)
    phases = [name for name in columns if name.endswith(" %") or name == "Diameter"]
    wanted = phases + [name for name in SUMMARY if name in columns]
    shown.SeriesVisibility = wanted
    colours, thickness, labels = [], [], []
    for name in wanted:
        colours += [name] + [str(part) for part in SUMMARY.get(name, [0.72, 0.74, 0.78])]
        thickness += [name, "2" if name in SUMMARY else "1"]
        labels += [name, name]
    shown.SeriesColor, shown.SeriesLineThickness, shown.SeriesLabel = colours, thickness, labels
    view.LeftAxisTitle = "diameter (mm)"
    view.BottomAxisTitle = "mm from the ostium"
    view.ShowLegend = 1 if len(wanted) <= 12 else 0
    return shown


def show_map(cycle, view):
    """The diameter by its place (to the right) and phase (upwards), which is stretched to fill the view."""
    shown = simple.Show(simple.OutputPort(cycle, MAP), view, "GeometryRepresentation")
    diameter = cycle.GetDataInformation(MAP).GetPointDataInformation().GetArrayInformation("Diameter").GetComponentRange(0)
    views.colour_by(shown, view, "Diameter", "Diameter (mm)", *diameter)
    box = cycle.GetDataInformation(MAP).GetBounds()
    stretch = MAP_ASPECT * (box[1] - box[0]) / max(box[3] - box[2], 1e-6)
    shown.Scale = [1.0, stretch, 1.0]
    box = (box[0], box[1], stretch * box[2], stretch * box[3], 0.0, 0.0)
    views.look_along(view, [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], box, 1.0)
    view.OrientationAxesVisibility = 0
    view.InteractionMode = "2D"
    bar = simple.GetScalarBar(simple.GetColorTransferFunction("Diameter"), view)
    bar.Orientation, bar.WindowLocation, bar.Position, bar.ScalarBarLength = "Vertical", "Any Location", [0.82, 0.15], 0.6
    bar.ScalarBarThickness = 8
    grid = view.AxesGrid
    grid.AxesToLabel = 3  # below and at the left
    grid.Visibility, grid.DataScale = 1, [1.0, stretch, 1.0]
    grid.XTitle, grid.YTitle, grid.ZTitle = "mm from the ostium", "% of R-R", ""
    for name in ("XTitleColor", "YTitleColor", "XLabelColor", "YLabelColor", "GridColor"):
        setattr(grid, name, views.BLACK)
    _fit(view, box)
    view.CameraParallelScale *= 1.8  # room for titles, and at the right for the legend
    view.CameraFocalPoint = [view.CameraFocalPoint[0] + 0.1 * (box[1] - box[0]), *view.CameraFocalPoint[1:]]
    view.CameraPosition = [view.CameraFocalPoint[0], *view.CameraPosition[1:]]
    return shown


def _fit(view, box):
    """A flat picture fills its view in the direction that needs it."""
    width, height = list(view.ViewSize)
    aspect = width / max(height, 1)
    view.CameraParallelScale = 0.55 * max(box[3] - box[2], (box[1] - box[0]) / max(aspect, 0.1))


def _image_array(reformat):
    """The name of the values: what is neither place nor distance."""
    arrays = reformat.GetDataInformation(REFORMAT).GetPointDataInformation()
    names = [arrays.GetArrayInformation(n).GetName() for n in range(arrays.GetNumberOfArrays())]
    return next(name for name in names if name not in ("WorldPosition", "Abscissas"))


def _knows_blur(tree):
    """Whether the tree was found in an image, which says how blurred it is; else its radii are taken."""
    source, port = views.proxy_of(tree), tree.Port if views.is_port(tree) else 0
    source.UpdatePipeline()
    return source.GetDataInformation(port).GetFieldDataInformation().GetArrayInformation("ImageBlur") is not None


def _columns(cycle):
    cycle.UpdatePipeline()
    rows = cycle.GetDataInformation(PROFILE).GetRowDataInformation()
    return [rows.GetArrayInformation(n).GetName() for n in range(rows.GetNumberOfArrays())]


def _is_tree(source):
    """Lines with branches."""
    port = source.Port if views.is_port(source) else 0
    source = views.proxy_of(source)
    source.UpdatePipeline()
    information = source.GetDataInformation(port)
    return information is not None and information.GetCellDataInformation().GetArrayInformation("ParentGroupIds") is not None


def selected():
    """Image and tree: those that are selected, else the last ones of the pipeline browser; and the wall of Build from 4D CT.

    Raises RuntimeError when there is none.
    """
    model = servermanager.ProxyManager().GetSelectionModel("ActiveSources")
    chosen = [servermanager._getPyProxy(model.GetSelectedProxy(n)) for n in range(model.GetNumberOfSelectedProxies())]
    everything = [source for _, source in sorted(simple.GetSources().items(), key=lambda item: int(item[0][1]))]
    image = next((one for one in chosen if views.is_image(one)), None) or _first_series(everything)
    tree = next((one for one in chosen if not views.is_image(one) and _is_tree(one)), None) or _last_tree(everything)
    if image is None or tree is None:
        raise RuntimeError("Select an image and a tree of centerlines in the pipeline browser.")
    wall = next((one for one in everything if views.name_of(one) in ("14 Wall", "Wall")), None)
    return image, tree, wall


def _first_series(sources):
    return next((one for one in sources if views.is_series(one)), None) \
        or next((one for one in sources if views.is_image(one)), None)


def _last_tree(sources):
    """Moving ones before still ones: they go with the images."""
    trees = [one for one in sources if not views.is_image(one) and _is_tree(one)]
    moving = [one for one in trees if len(views.times_of(one)) > 1]
    return (moving or trees or [None])[-1]


def look_at_selected():
    """What the menu calls."""
    image, tree, wall = selected()
    return look(image, tree, wall=wall)


if __name__ in ("__main__", "__vtkconsole__"):
    look_at_selected()
