"""What the scripts of the menu Dynamic Coronary share: views, colours, legends, notes."""
import functools
import sys

from paraview import servermanager, simple
from paraview.modules.vtkRemotingViews import vtkPVOpenGLInformation

WALL = [0.80, 0.16, 0.16]
LINE = [1.0, 0.85, 0.2]
BLACK = [0.0, 0.0, 0.0]
WHITE = [1.0, 1.0, 1.0]
# One after the other, for neighbours that can be told apart.
SEGMENTS = [[0.84, 0.15, 0.16], [0.12, 0.47, 0.71], [0.17, 0.63, 0.17], [1.00, 0.50, 0.05], [0.58, 0.40, 0.74],
            [0.55, 0.34, 0.29], [0.89, 0.47, 0.76], [0.50, 0.50, 0.50], [0.74, 0.74, 0.13], [0.09, 0.75, 0.81]]
PHASE = "{time:.0f} % R-R"
RADIUS = "MaximumInscribedSphereRadius"
# Of the names beside a tree: points of the font, and pixels a letter and a line of it take.
NAME_SIZE, LETTER, LINE_HEIGHT = 15, 10.0, 18.0
SMALL_VIEW = 300  # height of the view of the names in a window of usual size, pixels


def require_plugin():
    """Raises RuntimeError without the plugin."""
    if not hasattr(simple, "CoronaryPhantom"):
        raise RuntimeError("The DynamicCoronary plugin is not loaded: see docs/paraview.md, The plugin.")


def new_layout(name, size=None):
    """A layout, and its first view; an empty one that is there is taken. `size` in pixels of all views together,
    None: as large as the window."""
    view = simple.GetActiveView()
    layout = simple.GetLayout(view) if view and view.GetXMLName() == "RenderView" else None
    if layout and not layout.GetSplitDirection(0) and not list(view.Representations):
        simple.RenameLayout(name, layout)
    else:
        layout = simple.CreateLayout(name)
        view = simple.CreateView("RenderView")
        simple.AssignViewToLayout(view, layout, 0)
    if size:
        layout.SetSize(*size)
    return layout, view


def split(layout, cell, share, downwards=False):
    """Another view at the right of the cell of a layout, or below; gives the view and the number of its cell.

    The cell becomes the one of number 2 * cell + 1.
    """
    cut = layout.SplitVertical if downwards else layout.SplitHorizontal
    second = cut(cell, share) + 1
    view = simple.CreateView("RenderView")
    simple.AssignViewToLayout(view, layout, second)
    return view, second


def look_along(view, direction, up, box, zoom=1.25):
    """White, parallel rays along `direction` (LPS, length 1); the sphere around `box` (bounds) fills the view, or
    `zoom` times more."""
    centre = [0.5 * (low + high) for low, high in zip(box[::2], box[1::2])]
    radius = 0.5 * sum((high - low) ** 2 for low, high in zip(box[::2], box[1::2])) ** 0.5
    view.UseColorPaletteForBackground = 0
    view.Background = WHITE
    if drawn_by_software():
        view.UseFXAA = 0  # more than half of the time of a frame
    view.OrientationAxesLabelColor = BLACK
    view.CameraParallelProjection = 1
    view.CameraFocalPoint = centre
    view.CameraPosition = [middle - 4.0 * radius * part for middle, part in zip(centre, direction)]
    view.CameraViewUp = up
    view.CameraParallelScale = radius / zoom


@functools.lru_cache(maxsize=None)
def drawn_by_software():
    """Whether the client has no graphics card to draw with."""
    information = vtkPVOpenGLInformation()
    servermanager.ActiveConnection.Session.GatherInformation(servermanager.vtkPVSession.CLIENT, information, 0)
    return any(name in information.GetRenderer().lower() for name in ("llvmpipe", "softpipe", "swrast", "swr"))


def look_from_the_front(view, box, zoom=1.25):
    """LPS: the viewer stands before the patient, who stands upright."""
    look_along(view, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], box, zoom)


def look_from_the_feet(view, box, zoom=1.25):
    """An axial slice as radiologists have it: on black, from the feet, the patient's right is at the left."""
    look_along(view, [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], box, zoom)
    view.Background = BLACK
    view.OrientationAxesVisibility = 0


def plain(shown, colour, opacity=1.0):
    """One colour instead of an array's."""
    shown.ColorArrayName = ["POINTS", ""]
    shown.AmbientColor = shown.DiffuseColor = colour
    shown.Opacity = opacity


def is_paraview(major, minor):
    """Whether it is this version or a later one."""
    version = simple.GetParaViewVersion()
    return (version.major, version.minor) >= (major, minor)


def colour_by(shown, view, array, title, low, high, preset="Plasma (matplotlib)", where="POINTS"):
    """Colours of a point array from `low` to `high`, with a legend below."""
    simple.ColorBy(shown, (where, array))
    transfer = simple.GetColorTransferFunction(array)
    # ParaView 6 calls matplotlib's by their own names.
    transfer.ApplyPreset(preset.split(" (")[0] if is_paraview(6, 0) else preset, True)
    transfer.RescaleTransferFunction(low, high)
    transfer.AutomaticRescaleRangeMode = "Never"
    shown.SetScalarBarVisibility(view, True)
    return legend(view, array, title, 2 if high < 5.0 else 1)


def smooth(surface, name):
    """A surface with normals for smooth shading; sharp edges stay."""
    normals = simple.SurfaceNormals if is_paraview(6, 0) else simple.GenerateSurfaceNormals
    return normals(surface, registrationName=name, FeatureAngle=60.0)


def ink(view):
    """Black on white, white on black."""
    return WHITE if list(view.Background) == BLACK else BLACK


def legend(view, array, title, digits):
    """The bar of an array's colours, below in a view; numbers with so many digits behind the point."""
    bar = simple.GetScalarBar(simple.GetColorTransferFunction(array), view)
    bar.Title = title
    bar.ComponentTitle = ""
    bar.TitleColor = bar.LabelColor = ink(view)
    bar.AutomaticLabelFormat = 0
    # From 6.1 on as of C++'s std::format, before as of printf.
    form = "{:.%df}" if is_paraview(6, 1) else "%%-.%df"
    bar.LabelFormat = bar.RangeLabelFormat = form % digits
    bar.Orientation = "Horizontal"
    bar.WindowLocation = "Lower Center"
    bar.ScalarBarLength = 0.5
    return bar


def grey_slice(shown, array, low, high):
    """Grey values of an image between `low` and `high`, and no legend."""
    simple.ColorBy(shown, ("POINTS", array))
    transfer = simple.GetColorTransferFunction(array)
    transfer.ApplyPreset("Grayscale", True)
    transfer.RescaleTransferFunction(low, high)
    transfer.AutomaticRescaleRangeMode = "Never"


def axial_slice(source, place, name):
    """The plane of voxels next to a place, and its height in mm. Of each phase no more than that is read or computed.

    The planes of an oblique image are not axial: that is cut at the place.
    """
    port = source.Port if is_port(source) else 0
    whole = list(proxy_of(source).GetDataInformation(port).GetExtent())
    plane = simple.ExtractSubset(source, registrationName=name)
    heights = []
    for number in whole[4:]:
        plane.VOI = whole[:4] + [number, number]
        plane.UpdatePipeline()
        low, high = plane.GetDataInformation().GetBounds()[4:]
        if high - low > 1e-3:
            simple.Delete(plane)
            cut = simple.Slice(source, registrationName=name, SliceType="Plane", Triangulatetheslice=0)
            cut.SliceType.Origin, cut.SliceType.Normal = place, [0.0, 0.0, 1.0]
            return cut, place[2]
        heights.append(low)
    steps = whole[5] - whole[4]
    step = (heights[1] - heights[0]) / steps if steps else 1.0
    number = min(max(round((place[2] - heights[0]) / step), 0), steps)
    plane.VOI = whole[:4] + [whole[4] + number] * 2
    return plane, heights[0] + number * step


def show_slice(cut, view, array, low, high):
    """A slice of an image in grey; as a picture, which is drawn faster than as many squares, where it lies along x and y."""
    image = fetched(cut)
    if image.IsA("vtkImageData") and image.GetDirectionMatrix().IsIdentity():
        shown = simple.Show(cut, view, "UniformGridRepresentation")
        shown.SetRepresentationType("Slice")
    else:
        shown = simple.Show(cut, view, "GeometryRepresentation")
    grey_slice(shown, array, low, high)
    shown.SetScalarBarVisibility(view, False)
    return shown


def rim_in_slice(surface, place, height, name):
    """Where a surface meets the slice at that height."""
    rim = simple.Slice(surface, registrationName=name, SliceType="Plane", Triangulatetheslice=0)
    rim.SliceType.Origin, rim.SliceType.Normal = [place[0], place[1], height], [0.0, 0.0, 1.0]
    return rim


def ready_to_play():
    """The animation has the time steps of the data, stands at the first and loops; each frame is computed once.

    Returns the steps."""
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.Loop = 1
    simple.GetSettingsProxy("GeneralSettings").CacheGeometryForAnimation = 1
    steps = scene.TimeKeeper.TimestepValues
    steps = list(steps) if hasattr(steps, "__len__") else [steps]
    if steps:
        scene.AnimationTime = steps[0]
    return steps


def frames(shown, steps):
    """Computes what views show at each step, one a turn, and keeps it: to play is to draw, then.

    Ends when another frame is asked for meanwhile: playing keeps frames, too.
    """
    scene = simple.GetAnimationScene()
    animation, now, asked = scene.SMProxy.GetClientSideObject(), scene.AnimationTime, []

    def update(time):
        for view in shown:
            view.UseCache, view.CacheKey, view.ViewTime = 1, time, time
            view.Update()

    # Before ParaView's own observer, which lets the window live, and this go on, within a frame.
    observer = animation.AddObserver("AnimationCueTickEvent", lambda *_: asked.append(True), 100.0)
    try:
        for number, time in enumerate(steps):
            if asked:
                return
            update(time)
            yield number + 1
    finally:
        if not sys.is_finalizing():
            animation.RemoveObserver(observer)
            if not asked:
                update(now)
                for view in shown:
                    view.UseCache = 0
            else:
                for view in shown:
                    view.ViewTime = scene.AnimationTime


def note(view, words, name, place="Upper Right Corner", size=16):
    """A line of text in a view."""
    text = simple.Text(registrationName=name, Text=words)
    shown = simple.Show(text, view)
    shown.Color = ink(view)
    shown.FontSize = size
    shown.WindowLocation = place
    return text


def note_phase(views, source, name="Phase"):
    """The phase that is shown, in per cent of the R-R interval, in each view."""
    phase = simple.AnnotateTimeFilter(source, registrationName=name, Format=PHASE, Scale=100.0)
    for view in views:
        label = simple.Show(phase, view)
        label.Color = ink(view)
        label.FontSize = 18
        label.WindowLocation = "Upper Left Corner"
    return phase


def fetched(source):
    """The data of a source's first output, on the client, also of another server's. Not at a certain time."""
    source.UpdatePipeline()
    return servermanager.Fetch(source)


def is_port(source):
    """Whether this is one output port of a source."""
    return source.__class__.__name__ == "OutputPort"


def proxy_of(source):
    """The source itself, of a source or one of its output ports."""
    return source.Proxy if is_port(source) else source


def name_of(source):
    """What the pipeline browser calls a source."""
    for (name, _), known in simple.GetSources().items():
        if known == proxy_of(source):
            return name
    return proxy_of(source).GetXMLLabel()


def times_of(source):
    """The time steps of a source, increasing; none of a still one."""
    proxy = proxy_of(source)
    proxy.UpdatePipelineInformation()
    steps = getattr(proxy, "TimestepValues", None)
    if steps is None:
        return []
    return sorted(steps) if hasattr(steps, "__len__") else [float(steps)]


def is_image(source):
    """Whether the first output of a source, or an output port, is an image."""
    output = proxy_of(source).SMProxy.GetOutputPort(source.Port if is_port(source) else 0)
    if not output.GetDataInformation().GetDataSetTypeAsString().startswith("vtk"):
        proxy_of(source).UpdatePipeline()
    return output.GetDataInformation().GetDataSetTypeAsString() == "vtkImageData"


def is_series(source):
    """Whether a source is an image that changes with time, and not made of another one."""
    return not hasattr(source, "Input") and is_image(source) and len(times_of(source)) > 1


def image_array(source):
    """The scalars of an image."""
    return source.PointData.GetArray(0).GetName()


def grey_window(source, array, usual):
    """`usual`, unless the image can not be CT in Hounsfield units: then its range."""
    low, high = source.PointData[array].GetRange()
    return usual if low < -100.0 and high > usual[1] / 2.0 else (low, high)


def name_places(lines, millimetres):
    """Of each name the line at whose middle it is written, where no other name is, from the front; names without one are left out.

    `millimetres` a pixel. Returns by name the number of the line, and the place.
    """
    labels = lines.GetCellData().GetAbstractArray("SegmentLabel")
    middles = {}
    for cell in range(lines.GetNumberOfCells()):
        points = lines.GetCell(cell).GetPoints()
        middles.setdefault(labels.GetValue(cell), []).append((cell, points.GetPoint(points.GetNumberOfPoints() // 2)))
    places = {}
    high = LINE_HEIGHT * millimetres
    # The trunks first: their ends p, m and d come before the branches of the same length.
    for name in sorted(filter(None, middles), key=lambda name: (name[0] not in "pmdL", name)):
        for cell, place in middles[name]:
            free = all(abs(place[0] - other[0]) > 0.5 * LETTER * (len(name) + len(known)) * millimetres
                       or abs(place[2] - other[2]) > high for known, (_, other) in places.items())
            if free:
                places[name] = cell, place
                break
    return places


def name_segments(source, shown, view):
    """Colours of a named tree's lines by their SCCT segments, and the names beside them.

    `shown` is the representation of `source` in `view`, which looks from the front already. The names are labels of a
    selection: another selection takes their place. Returns them as name_places().
    """
    lines = fetched(source)
    ids = lines.GetCellData().GetArray("SegmentIds")
    segments = sorted({int(ids.GetTuple1(n)) for n in range(ids.GetNumberOfTuples())})
    simple.ColorBy(shown, ("CELLS", "SegmentIds"))
    transfer = simple.GetColorTransferFunction("SegmentIds")
    transfer.InterpretValuesAsCategories = 1
    transfer.AnnotationsInitialized = 1
    transfer.Annotations = [word for number in segments for word in (str(number), str(number))]
    transfer.IndexedColors = [part for n in range(len(segments)) for part in SEGMENTS[n % len(SEGMENTS)]]
    transfer.IndexedOpacities = [1.0] * len(segments)
    shown.SetScalarBarVisibility(view, False)
    # The window gives a view its size later; in a larger one names are farther apart.
    places = name_places(lines, 2.0 * view.CameraParallelScale / max(1, min(view.ViewSize[1], SMALL_VIEW)))
    active = simple.GetActiveSource()
    simple.SetActiveSource(source)
    simple.QuerySelect(QueryString=" | ".join("(id == %d)" % cell for cell, _ in places.values()) or "(id < 0)",
                       FieldType="CELL")
    simple.SetActiveSource(active)
    shown.SelectionOpacity = 0.0
    shown.SelectionCellLabelVisibility = 1
    shown.SelectionCellFieldDataArrayName = "SegmentLabel"
    shown.SelectionCellLabelColor = BLACK
    shown.SelectionCellLabelFontSize = NAME_SIZE
    return places
