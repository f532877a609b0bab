"""What the scripts share that draw pictures: data, actors, panels, files."""
import math
import os
import sys

# VTK's own Python modules come with ParaView; plain VTK has the same.
from vtkmodules.vtkCommonCore import vtkLookupTable, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkFiltersCore import vtkPolyDataNormals, vtkTubeFilter
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOImage import vtkMetaImageReader, vtkPNGWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkActor2D,
    vtkCoordinate,
    vtkPolyDataMapper,
    vtkPolyDataMapper2D,
    vtkRenderWindow,
    vtkRenderer,
    vtkTextActor,
    vtkWindowToImageFilter,
)
import vtkmodules.vtkRenderingFreeType  # noqa: F401
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401

SIZE = (1600, 1000)  # pixels
BACKGROUND = (0.06, 0.07, 0.09)
PANEL = (0.0, 0.0, 0.0)
TEXT = (0.92, 0.93, 0.95)
FAINT = (0.55, 0.58, 0.63)
VIEWS = (  # name, where the eye is, up
    ("from the front", (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    ("from the left", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ("from the feet", (0.0, 0.0, -1.0), (0.0, -1.0, 0.0)),
)
TITLE = 60  # pixels
TOWARDS_VIEWER = (0.50, -0.80, 0.33)  # from the front, the left and a little above

# A hue for each great artery, shades for its branches; the first name that fits decides.
LEFT = (
    (("LM",), ((0.93, 0.90, 0.82),)),
    (("LCx", "OM", "L-P"),
     ((0.25, 0.66, 0.52), (0.48, 0.80, 0.50), (0.18, 0.52, 0.50), (0.66, 0.87, 0.60))),
    (("",), ((0.95, 0.68, 0.25), (0.98, 0.82, 0.42), (0.86, 0.54, 0.20), (0.99, 0.89, 0.60))),
)
RIGHT = (
    (("",), ((0.85, 0.30, 0.26), (0.94, 0.50, 0.36), (0.72, 0.22, 0.30), (0.97, 0.66, 0.50))),
)


def fail(message):
    sys.exit(os.path.splitext(os.path.basename(sys.argv[0]))[0] + ": " + message)


class Volume:
    """A MetaImage with its place in the world, which VTK's reader leaves out."""

    def __init__(self, path):
        header = {}
        with open(path, "rb") as stream:
            for line in stream:
                key, _, value = line.decode("latin-1").partition("=")
                header[key.strip()] = value.strip()
                if key.strip() == "ElementDataFile":
                    break
        reader = vtkMetaImageReader()
        reader.SetFileName(path)
        reader.Update()
        self.image = reader.GetOutput()
        if self.image.GetNumberOfPoints() == 0:
            fail("no voxels in " + path)
        self.image.SetOrigin(0.0, 0.0, 0.0)
        cosines = [float(x) for x in header.get("TransformMatrix", "1 0 0 0 1 0 0 0 1").split()]
        # The file lists the world direction of i, then of j, then of k.
        self.axes = [cosines[0:3], cosines[3:6], cosines[6:9]]
        self.origin = [float(x) for x in header.get("Offset", "0 0 0").split()]

    def to_local(self, vector):
        return [sum(a * v for a, v in zip(axis, vector)) for axis in self.axes]

    def matrix(self):
        """From the image's own axes (mm) to the world."""
        matrix = vtkMatrix4x4()
        for column in range(3):
            for row in range(3):
                matrix.SetElement(row, column, self.axes[column][row])
        for row in range(3):
            matrix.SetElement(row, 3, self.origin[row])
        return matrix

    def world_bounds(self):
        size = [n - 1 for n in self.image.GetDimensions()]
        spacing = self.image.GetSpacing()
        corners = []
        for corner in range(8):
            local = [spacing[a] * size[a] * ((corner >> a) & 1) for a in range(3)]
            corners.append([self.origin[r] + sum(self.axes[a][r] * local[a] for a in range(3))
                            for r in range(3)])
        return [(min(c[r] for c in corners), max(c[r] for c in corners)) for r in range(3)]


def matplotlib_preset(name):
    """Name of a colour map in ParaView: from version 6 on it has no addition."""
    from paraview import simple
    return name if simple.GetParaViewVersion().major >= 6 else name + " (matplotlib)"


def read_poly(path):
    if not os.path.isfile(path):
        fail("missing file: " + path)
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def branches(tree):
    """(group id, whether it is a right coronary's, label, point ids) of each branch."""
    data = tree.GetCellData()
    groups, trees = data.GetArray("GroupIds"), data.GetArray("TreeIds")
    labels = data.GetAbstractArray("SegmentLabel")
    result = []
    for cell in range(tree.GetNumberOfCells()):
        ids = tree.GetCell(cell).GetPointIds()
        result.append((
            int(groups.GetTuple1(cell)) if groups else cell,
            bool(trees and trees.GetTuple1(cell) == 1),
            labels.GetVariantValue(cell).ToString() if labels else "",
            [ids.GetId(i) for i in range(ids.GetNumberOfIds())]))
    return result


def branch_colors(tree):
    found = branches(tree)
    count = max(branch[0] for branch in found) + 1
    table = vtkLookupTable()
    table.SetNumberOfTableValues(count)
    table.SetTableRange(-0.5, count - 0.5)
    used = {}
    for group, right, label, _ in found:
        for names, shades in RIGHT if right else LEFT:
            if any(name in label for name in names):
                number = used.setdefault(shades, {}).setdefault(label, len(used[shades]))
                table.SetTableValue(group, *shades[number % len(shades)], 1.0)
                break
    return table


def fetch(source, port=0, time=None):
    """A copy of what an output of ParaView has, in this process."""
    from paraview import servermanager, simple
    tap = servermanager.filters.ReductionFilter(Input=simple.OutputPort(source, port))
    tap.UpdatePipeline(time)
    data = tap.GetClientSideObject().GetOutputDataObject(0)
    copy = data.NewInstance()
    copy.ShallowCopy(data)
    return copy


def off_screen(size, renderers, samples=8):
    """A window of so many pixels without a screen."""
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(*size)
    window.SetMultiSamples(samples)
    for renderer in renderers:
        window.AddRenderer(renderer)
    return window


def new_renderer(background=BACKGROUND):
    renderer = vtkRenderer()
    renderer.SetBackground(*background)
    return renderer


def new_window():
    """One of SIZE, and the renderer behind its panels."""
    base = new_renderer()
    return off_screen(SIZE, [base], 0), base


def add_panel(window, x0, y0, x1, y1, background=PANEL):
    """Corners in pixels from the lower left."""
    panel = new_renderer(background)
    panel.SetViewport(x0 / SIZE[0], y0 / SIZE[1], x1 / SIZE[0], y1 / SIZE[1])
    panel.GetActiveCamera().ParallelProjectionOn()
    panel.UseFXAAOn()
    window.AddRenderer(panel)
    return panel


def add_text(renderer, text, x, y, size=22, color=TEXT, bold=False, align="left"):
    actor = vtkTextActor()
    actor.SetInput(text)
    style = actor.GetTextProperty()
    style.SetFontFamilyToArial()
    style.SetFontSize(size)
    style.SetColor(*color)
    style.SetBold(bold)
    style.ShadowOn()
    style.SetShadowOffset(1, -1)
    {"left": style.SetJustificationToLeft, "right": style.SetJustificationToRight,
     "center": style.SetJustificationToCentered}[align]()
    actor.SetPosition(x, y)
    renderer.AddViewProp(actor)


def add_scale_bar(panel, width, height, length=20.0):
    """In a parallel projection; call it when the camera is set."""
    pixels = length * height / (2.0 * panel.GetActiveCamera().GetParallelScale())
    right, bottom = width - 24, 24
    points = vtkPoints()
    points.InsertNextPoint(right - pixels, bottom, 0)
    points.InsertNextPoint(right, bottom, 0)
    lines = vtkCellArray()
    lines.InsertNextCell(2)
    lines.InsertCellPoint(0)
    lines.InsertCellPoint(1)
    bar = vtkPolyData()
    bar.SetPoints(points)
    bar.SetLines(lines)
    mapper = vtkPolyDataMapper2D()
    mapper.SetInputData(bar)
    coordinate = vtkCoordinate()
    coordinate.SetCoordinateSystemToViewport()
    mapper.SetTransformCoordinate(coordinate)
    actor = vtkActor2D()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*TEXT)
    actor.GetProperty().SetLineWidth(3)
    panel.AddViewProp(actor)
    add_text(panel, "%.0f mm" % length, right, bottom + 8, 16, TEXT, align="right")


def add_plain(panel, mesh, color, opacity=1.0):
    """In one colour, as its normals have it."""
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(mesh)
    mapper.ScalarVisibilityOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*color)
    actor.GetProperty().SetOpacity(opacity)
    panel.AddActor(actor)
    return actor


def add_surface(panel, mesh, table=None, color=(1, 1, 1), opacity=1.0):
    normals = vtkPolyDataNormals()
    normals.SetInputData(mesh)
    normals.SplittingOff()
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    if table is not None and mesh.GetPointData().HasArray("GroupIds"):
        mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectColorArray("GroupIds")
        mapper.SetLookupTable(table)
        mapper.UseLookupTableScalarRangeOn()
        # Ids are no quantity: a colour between two ids means nothing.
        mapper.InterpolateScalarsBeforeMappingOff()
    else:
        mapper.ScalarVisibilityOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.SetColor(*color)
    look.SetOpacity(opacity)
    look.SetAmbient(0.18)
    look.SetDiffuse(0.82)
    look.SetSpecular(0.25)
    look.SetSpecularPower(25)
    panel.AddActor(actor)
    return actor


def ball(center, radius):
    maker = vtkSphereSource()
    maker.SetCenter(center)
    maker.SetRadius(radius)
    maker.SetThetaResolution(24)
    maker.SetPhiResolution(24)
    maker.Update()
    return maker.GetOutput()


def polyline(places):
    points, lines = vtkPoints(), vtkCellArray()
    lines.InsertNextCell(len(places))
    for place in places:
        lines.InsertCellPoint(points.InsertNextPoint(place))
    data = vtkPolyData()
    data.SetPoints(points)
    data.SetLines(lines)
    return data


def tube(tree, radius=None, sides=16):
    """A surface around a line, with the line's radii or a given one."""
    maker = vtkTubeFilter()
    maker.SetInputData(tree)
    maker.SetNumberOfSides(sides)
    maker.CappingOn()
    if radius is None:
        tree.GetPointData().SetActiveScalars("MaximumInscribedSphereRadius")
        maker.SetVaryRadiusToVaryRadiusByAbsoluteScalar()
    else:
        maker.SetRadius(radius)
    maker.Update()
    return maker.GetOutput()


def look_at_phantom(panel, scale):
    """The phantom's arteries from the front, the left and a little above; the scale is half the height, mm."""
    camera = panel.GetActiveCamera()
    camera.SetFocalPoint(0, 0, -45)
    camera.SetPosition(*[f + 300.0 * v for f, v in zip((0, 0, -45), TOWARDS_VIEWER)])
    camera.SetViewUp(0, 0, 1)
    camera.ParallelProjectionOn()
    panel.ResetCamera()
    camera.SetParallelScale(scale)
    panel.ResetCameraClippingRange(-400, 400, -400, 400, -400, 400)


def look_at(panel, center, direction, up, scale):
    camera = panel.GetActiveCamera()
    camera.SetFocalPoint(*center)
    camera.SetPosition(*[c + 400.0 * d for c, d in zip(center, unit(direction))])
    camera.SetViewUp(*up)
    camera.SetParallelScale(scale)
    panel.ResetCameraClippingRange()


def save(window, *path):
    """The window as a PNG; its path may come in parts."""
    window.Render()
    grabber = vtkWindowToImageFilter()
    grabber.SetInput(window)
    grabber.ReadFrontBufferOff()
    grabber.Update()
    path = os.path.join(*path)
    writer = vtkPNGWriter()
    writer.SetFileName(path)
    writer.SetInputConnection(grabber.GetOutputPort())
    writer.Write()
    print(path)


def panels(text):
    """A window with a title and a panel for each view."""
    window, base = new_window()
    width, height = SIZE
    add_text(base, text, 20, height - 42, 26, bold=True)
    made = []
    for n, (name, _, _) in enumerate(VIEWS):
        panel = add_panel(window, n * width / 3.0 + 2, 0, (n + 1) * width / 3.0 - 2, height - TITLE)
        add_text(panel, name, 16, 16)
        made.append(panel)
    return window, made


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def unit(a):
    length = math.sqrt(dot(a, a))
    return tuple(x / length for x in a)
