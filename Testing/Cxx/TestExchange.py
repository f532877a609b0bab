"""What other programs read and write, against parsers of their own. Usage: TestExchange.py PROGRAM"""
import gzip
import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

from vtp_reader import read_vtp

PROGRAM = sys.argv[1]
failures = []


def check(condition, text):
    """Notes what does not hold."""
    if not condition:
        failures.append(text)
        print("FAILED:", text)


def run(*arguments, code=0, says=""):
    """Runs the program; a failure has to be one line with `says` in it, beside warnings."""
    done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=120)
    check(done.returncode == code, f"{arguments}: exit code {done.returncode}: {done.stderr}")
    if code:
        errors = [line for line in done.stderr.splitlines() if not line.startswith("Warning: ")]
        check(len(errors) == 1 and says in errors[0], f"not '{says}': {done.stderr}")
    return done.stdout


def read_obj(path):
    """Vertices, triangles and comments of a .obj file."""
    vertices, triangles, comments = [], [], []
    with open(path, encoding="utf-8") as file:
        for line in file:
            words = line.split()
            if words[0] == "v":
                vertices.append(tuple(map(float, words[1:])))
            elif words[0] == "f":
                triangles.append(tuple(int(w) - 1 for w in words[1:]))
            else:
                comments.append(line)
    return vertices, triangles, comments


def volume_of(vertices, triangles):
    """Positive when the triangles look outwards."""
    total = 0.0
    for a, b, c in triangles:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = vertices[a], vertices[b], vertices[c]
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6.0


SIZE, SPACING, RADIUS = 32, 0.5, 2.5
CENTER = 0.5 * SPACING * (SIZE - 1)


def tube(i, j, k):
    """Whether a voxel is in a tube along z, closed at both ends."""
    return math.hypot(i * SPACING - CENTER, j * SPACING - CENTER) <= RADIUS and 3 < k < SIZE - 4


def grid(value):
    """All voxels, i fastest."""
    return [value(i, j, k) for k in range(SIZE) for j in range(SIZE) for i in range(SIZE)]


def write_mask(path, space="left-posterior-superior", shift=0.0):
    """A .seg.nrrd as Slicer has it: the tube in the first layer, something else in the second."""
    sign = -1 if space.startswith("right") else 1
    pairs = [v for inside in grid(tube) for v in (1 if inside else 0, 0)]
    pairs[1] = 1
    full = f"0 {SIZE - 1} 0 {SIZE - 1} 0 {SIZE - 1}"
    header = (
        f"NRRD0004\n# as 3D Slicer\ntype: unsigned char\ndimension: 4\nspace: {space}\n"
        f"sizes: 2 {SIZE} {SIZE} {SIZE}\nspace directions: none ({sign * SPACING},0,0) (0,{sign * SPACING},0) (0,0,{SPACING})\n"
        "kinds: list domain domain domain\nencoding: gzip\n"
        f"space origin: ({shift},0,0)\n")
    for n, name in enumerate(("Vessel", "Rest")):
        header += (f"Segment{n}_ID:=Segment_{n + 1}\nSegment{n}_Name:={name}\nSegment{n}_LabelValue:=1\n"
                   f"Segment{n}_Layer:={n}\nSegment{n}_Extent:={full}\n")
    with open(path, "wb") as file:
        file.write(header.encode() + b"\n" + gzip.compress(bytes(pairs), mtime=0))


def write_image(path, vessel=400, tissue=40):
    """The tube in CT, as MetaImage."""
    values = grid(lambda i, j, k: vessel if tube(i, j, k) else tissue)
    header = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
              f"TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nElementSpacing = {SPACING} {SPACING} {SPACING}\n"
              f"DimSize = {SIZE} {SIZE} {SIZE}\nElementType = MET_SHORT\nElementDataFile = LOCAL\n")
    with open(path, "wb") as file:
        file.write(header.encode() + struct.pack(f"<{len(values)}h", *values))


def masks():
    """A mask becomes a surface, in any space, and is refused in one line."""
    write_mask("tube.seg.nrrd")
    run("convert", "tube.seg.nrrd", "tube.obj", "--segment", "Vessel")
    vertices, triangles, comments = read_obj("tube.obj")
    check(any("SPACE=LPS" in c for c in comments), "no SPACE=LPS in the .obj file")
    edges = {}
    for t in triangles:
        for a, b in zip(t, t[1:] + t[:1]):
            edges[(a, b)] = edges.get((a, b), 0) + 1
    check(all(n == 1 and edges.get((b, a)) == 1 for (a, b), n in edges.items()), "the surface is not closed")
    inside = sum(map(bool, grid(tube))) * SPACING ** 3
    check(abs(volume_of(vertices, triangles) / inside - 1) < 0.03, f"volume {volume_of(vertices, triangles)}, {inside}")
    middle = [math.hypot(x - CENTER, y - CENTER) for x, y, z in vertices if abs(z - CENTER) < 3]
    check(abs(sum(middle) / len(middle) - RADIUS) < 0.1, f"radius {sum(middle) / len(middle)}")
    check(max(middle) - min(middle) < SPACING, "steps of voxels are left")
    write_mask("ras.seg.nrrd", "right-anterior-superior")
    run("convert", "ras.seg.nrrd", "ras.obj", "--segment", "Segment_1")
    turned, _, _ = read_obj("ras.obj")
    check(turned == vertices, "RAS and LPS give different surfaces")
    for kind in ("vtp", "vtk", "stl", "ply"):
        run("convert", "tube.seg.nrrd", "tube." + kind, "--segment", "Vessel")
    with open("tube.vtk", "rb") as file:
        check(b"SPACE=LPS" in file.readlines()[1], "no SPACE=LPS in the title of the .vtk file")
    with open("tube.stl", "rb") as file:
        check(b"SPACE=LPS" in file.read(80), "no SPACE=LPS in the header of the .stl file")
    with open("tube.ply", "rb") as file:
        check(b"comment SPACE=LPS\n" in file.read(400), "no comment SPACE=LPS in the .ply file")
    with open("tube.vtp", encoding="utf-8") as file:
        check('Name="SPACE"' in file.read(), "no SPACE in the .vtp file")
    run("convert", "tube.seg.nrrd", "x.vtp", "--segment", "Vein", code=1, says="no segment 'Vein'")
    with open("tube.seg.nrrd", "rb") as file, open("cut.seg.nrrd", "wb") as cut:
        cut.write(file.read()[:-20])
    run("convert", "cut.seg.nrrd", "x.vtp", code=1, says="cut.seg.nrrd")


def runs():
    """A given mask takes the place of the segmentation."""
    write_image("tube.mha")
    seed = ["--seed", str(CENTER), str(CENTER), "3.5"]
    usual = ["--until", "centerline", "--no-labels", "--quiet", "--scales", "1", "2.5", "--largest-radius", "5"]
    run("run", "tube.mha", "--mask", "tube.seg.nrrd", "--mask-segment", "Vessel", *seed, *usual, "--output", "made")
    with open("made/mask.mha", "rb") as file:
        written = file.read()[-SIZE ** 3:]
    check(written == bytes(grid(lambda *v: 1 if tube(*v) else 0)), "mask.mha is not the given mask")
    with open("made/report.json", encoding="utf-8") as file:
        report = json.load(file)["segmentation"]
    check(report["resampled"] is False and report["share_inside_image"] == 1.0, f"report {report}")
    arrays, cells = read_vtp("made/centerline.vtp")
    check(len(cells) >= 1, "no centerline in the mask")
    away = [math.hypot(x - CENTER, y - CENTER) for x, y, z in arrays["Points"] if 4 < z < 11]
    check(max(away, default=9) < 0.5, f"the centerline is {max(away, default=9)} mm off the axis")
    write_mask("far.seg.nrrd", shift=500.0)
    run("run", "tube.mha", "--mask", "far.seg.nrrd", *seed, *usual, "--output", "x", code=1, says="does not overlap")
    phases = [{"fraction": f, "image": "tube.mha"} for f in (0.0, 0.5)]
    phases[1]["mask"] = "tube.seg.nrrd"
    with open("series.json", "w", encoding="utf-8") as file:
        json.dump({"phases": phases}, file)
    run("run", "series.json", "--mask-segment", "Vessel", *seed, *usual, "--output", "series")
    with open("series/report.json", encoding="utf-8") as file:
        report = json.load(file)
    check(report["phase"] == 1, "the phase with the mask is not the reference")
    run("run", "series.json", "--mask", "tube.seg.nrrd", *usual, "--output", "y", code=2, says="--time")
    with open("seeds.mrk.json", "w", encoding="utf-8") as file:
        point = {"label": "A", "position": [-CENTER, -CENTER, 3.5]}
        json.dump({"markups": [{"type": "Fiducial", "coordinateSystem": "RAS", "controlPoints": [point]}]}, file)
    run("run", "tube.mha", "--mask", "tube.seg.nrrd", "--mask-segment", "Vessel", "--seed-file", "seeds.mrk.json",
        *usual, "--output", "seeded")
    first, _ = read_vtp("made/ostia.vtp")[0], 0
    second = read_vtp("seeded/ostia.vtp")[0]
    check(first["Points"] == second["Points"], "seeds of a file are not those of the command line")


def truth():
    """Masks of phases are the truth of evaluate."""
    run("convert", "tube.seg.nrrd", "model.vtp", "--segment", "Vessel")
    with open("model.vtp.series", "w", encoding="utf-8") as file:
        json.dump({"file-series-version": "1.0", "files": [{"name": "model.vtp", "time": 0.5}]}, file)
    run("evaluate", "--result", "model.vtp.series", "--truth", "series.json", "--mask-segment", "Vessel", "--no-pictures",
        "--quiet", "--output", "tables")
    with open("tables/table1.json", encoding="utf-8") as file:
        phase = json.load(file)["cases"][0]["phases"][0]
    check(phase["fraction"] == 0.5 and abs(phase["HD"]) < 1e-6, f"not the same surface: {phase}")


def fork():
    """Markups of a Y in RAS: a trunk and two daughters that begin at its end."""
    def curve(name, points, radius):
        return {"type": "Curve", "name": name, "coordinateSystem": "RAS", "coordinateUnits": "mm",
                "controlPoints": [{"label": "", "position": p} for p in points],
                "measurements": [{"name": "Radius", "controlPointValues": [radius] * len(points)}]}
    trunk = [[0.1, 0.2, float(-z)] for z in range(11)]
    left = [[0.1 + 0.7 * n, 0.2, -10.0 - 0.7 * n] for n in range(12)]
    right = [[0.1 - 0.7 * n, 0.2, -10.0 - 0.7 * n] for n in range(12)]
    return {"markups": [curve("LM", trunk, 2.0), curve("LAD", left, 1.5), curve("LCx", right, 1.25)]}


def write_lines(path):
    """The Y as vmtkcenterlines has it: a whole line to each tip, with radii and without ids."""
    trunk, left, right = ([p["position"] for p in m["controlPoints"]] for m in fork()["markups"])
    lines = [trunk + left[1:], trunk + right[1:]]
    points = " ".join(str(v) for line in lines for p in line for v in p)
    radii = " ".join("2" if n < len(trunk) else "1.4" for line in lines for n in range(len(line)))
    count = len(lines[0])
    with open(path, "w", encoding="utf-8") as file:
        file.write(
            f'<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData>'
            f'<Piece NumberOfPoints="{2 * count}" NumberOfLines="2" NumberOfVerts="0" NumberOfStrips="0" NumberOfPolys="0">'
            f'<PointData><DataArray type="Float64" Name="MaximumInscribedSphereRadius" format="ascii">{radii}</DataArray>'
            f'</PointData><Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">{points}</DataArray>'
            f'</Points><Lines><DataArray type="Int64" Name="connectivity" format="ascii">'
            f'{" ".join(map(str, range(2 * count)))}</DataArray><DataArray type="Int64" Name="offsets" format="ascii">'
            f'{count} {2 * count}</DataArray></Lines></Piece></PolyData></VTKFile>\n')


def centerlines():
    """Markups, VMTK's and SimVascular's forms, there and back."""
    with open("fork.mrk.json", "w", encoding="utf-8") as file:
        json.dump(fork(), file)
    run("convert", "fork.mrk.json", "tree.vtp")
    arrays, cells = read_vtp("tree.vtp")
    check(len(cells) == 3 and len(arrays["Points"]) == 33, f"{len(cells)} branches, {len(arrays['Points'])} points")
    check(arrays["Points"][0] == (-0.1, -0.2, 0.0), "RAS was not turned into LPS")
    run("convert", "tree.vtp", "back.mrk.json")
    with open("back.mrk.json", encoding="utf-8") as file:
        back = json.load(file)
    check(back["@schema"].endswith("markups-schema-v1.0.3.json#"), "schema")
    for one, other in zip(fork()["markups"], back["markups"]):
        places = [[-x, -y, z] for x, y, z in (p["position"] for p in one["controlPoints"])]
        check([p["position"] for p in other["controlPoints"]] == places, f"{one['name']} came back elsewhere")
        check(other["name"] == one["name"] and other["coordinateSystem"] == "LPS", "name and system")
        values = {m["name"]: m["controlPointValues"] for m in other["measurements"]}
        # The first point of a daughter is its parent's.
        check(values["Radius"][1:] == one["measurements"][0]["controlPointValues"][1:], "radii")
    run("convert", "tree.vtp", "sv.vtp", "--form", "simvascular", "--simvascular-unit", "cm")
    simvascular(read_vtp("sv.vtp"))
    run("convert", "sv.vtp", "again.vtp", "--simvascular-unit", "cm")
    again, lines = read_vtp("again.vtp")
    check(len(lines) == 3 and abs(max(r for r in again["MaximumInscribedSphereRadius"]) - 2.0) < 1e-12, "radii in mm")
    run("convert", "tree.vtp", "paths", "--form", "svpath")
    names = sorted(os.listdir("paths"))
    check(names == ["LCx.ctgr", "LCx.pth", "LM.ctgr", "LM.pth"], f"paths {names}")
    root = xml.parse("paths/LM.pth").getroot()
    points = [tuple(float(p.get(a)) for a in "xyz") for p in root.iter("pos")]
    check(len(points) == 22 and points[0] == (-0.1, -0.2, 0.0), "path points")
    run("convert", "paths", "lofted.vtp", "--tolerance", "0.01")
    lofted, _ = read_vtp("lofted.vtp")
    check(abs(max(lofted["MaximumInscribedSphereRadius"]) - 2.0) < 0.02, "radii of the contours")
    run("convert", "tree.vtp", "lines.vtp", "--form", "vmtk")
    vmtk, tracts = read_vtp("lines.vtp")
    check(len(tracts) == 4 and list(vmtk["CenterlineIds"]) == [0, 0, 1, 1], "VMTK's tracts")
    write_lines("whole.vtp")
    run("convert", "whole.vtp", "x.vtp", code=1, says="--join")
    run("convert", "whole.vtp", "joined.vtp", "--join")
    check(len(read_vtp("joined.vtp")[1]) == 3, "whole lines of VMTK were not joined to a tree")
    with open("bad.pth", "w", encoding="utf-8") as file:
        file.write('<path id="1"><timestep><path_element><path_points><path_point><pos x="1" y="nan" z="0"/>')
    run("convert", "bad.pth", "x.vtp", code=1, says="y is 'nan'")


def simvascular(data):
    """The rules of SimVascular's own reader of centerlines for 0D and 1D models."""
    arrays, cells = data
    branch, fork_id = arrays["BranchId"], arrays["BifurcationId"]
    check(len(arrays["Points"]) == len(branch), "a place for every point")
    check(all((b == -1) != (f == -1) for b, f in zip(branch, fork_id)), "a point is in a branch or in a bifurcation")
    check(sorted(set(branch)) == [-1, 0, 1, 2] and set(fork_id) == {-1, 0}, "branches 0 to 2, one bifurcation")
    check(arrays["GlobalNodeId"] == list(range(len(branch))), "nodes count from 0 at the inlet")
    flows = {"in": set(), "out": set()}
    for a, b in cells:
        if (branch[a] == -1) != (branch[b] == -1):
            flows["in" if branch[a] != -1 else "out"].add(max(branch[a], branch[b]))
    check(flows == {"in": {0}, "out": {1, 2}}, f"flow through the bifurcation: {flows}")
    for number in range(3):
        own = [n for n, b in enumerate(branch) if b == number]
        path = [arrays["Path"][n] for n in own]
        check(path[0] == 0 and all(a < b for a, b in zip(path, path[1:])), "Path begins at 0 and grows")
        if number:
            before = own[0] - 1
            check(fork_id[before] == 0, "before a branch stands its bifurcation")
        area = [arrays["CenterlineSectionArea"][n] for n in own]
        radius = [arrays["MaximumInscribedSphereRadius"][n] for n in own]
        check(all(abs(s - math.pi * r * r) < 1e-12 for s, r in zip(area, radius)), "area of a circle")
    check(abs(arrays["MaximumInscribedSphereRadius"][0] - 0.2) < 1e-12, "centimetres")
    check(arrays["CenterlineId"][0] == (1, 1) and sum(arrays["CenterlineId"][-1]) == 1, "ways to the outlets")


def scenes():
    """A scene for Slicer: files that it names are there, times and nodes belong together."""
    run("slicer", "model.vtp.series", "--image", "tube.mha", "--output", "x", code=1, says="phases of the images")
    with open("model.vtp.series", "w", encoding="utf-8") as file:
        times = [{"name": "model.vtp", "time": 0.0}, {"name": "tube.vtp", "time": 0.5}]
        json.dump({"file-series-version": "1.0", "files": times}, file)
    run("slicer", "model.vtp.series", "--image", "series.json", "--cycle-ms", "800", "--quiet", "--output", "scene")
    scene = xml.parse("scene/scene.mrml").getroot()
    ids = {node.get("id"): node for node in scene}
    check(len(ids) == len(list(scene)), "an ID is there twice")
    for node in scene:
        if node.get("fileName"):
            check(os.path.isfile("scene/" + node.get("fileName")), f"{node.get('fileName')} is missing")
        for reference in filter(None, (node.get("references") or "").split(";")):
            check(reference.split(":")[1] in ids, f"{reference} is not in the scene")
    browser = scene.find("SequenceBrowser")
    check(browser.get("virtualNodePostfixes") == "_0 _1", "two sequences play together")
    inner = xml.parse("scene/wall.seq.mrml").getroot()
    index = inner.find("Sequence")
    items = [item.split(":") for item in index.get("indexValues").split(";")]
    check([float(value) for _, value in items] == [0.0, 400.0] and index.get("indexUnit") == "ms", f"index {items}")
    models = {model.get("id"): model for model in inner.iter("Model")}
    check([i for i, _ in items] == list(models), "items and models")
    for storage in inner.iter("ModelStorage"):
        check(os.path.isfile("scene/" + storage.get("fileName")), f"{storage.get('fileName')} is missing")
    with open("scene/image.seq.nrrd", "rb") as file:
        header, voxels = file.read().split(b"\n\n", 1)
    check(b"axis 3 index values:=0 400" in header and len(voxels) == 2 * 2 * SIZE ** 3, "image sequence")


def whole_scene():
    """Of a moving folder with a mask: the segmentation is the mask, the transforms bring the tree to where it is."""
    run("phantom", "--seed", "5", "--truth-only", "--phases", "3", "--quiet", "--surface-spacing", "1.5", "--centerline-spacing",
        "3", "--output", "moving")
    write_image("moving/mask.mha", 1, 0)
    run("slicer", "moving", "--quiet", "--output", "whole")
    scene = xml.parse("whole/scene.mrml").getroot()
    storage = scene.find("SegmentationStorage")
    segmentation = scene.find("Segmentation")
    check(storage.get("fileName") == "mask.seg.nrrd" and storage.get("id") in segmentation.get("references"), "segmentation")
    run("convert", "moving/mask.mha", "mask.obj")
    run("convert", "whole/mask.seg.nrrd", "segment.obj", "--segment", "Coronary arteries")
    check(read_obj("mask.obj")[:2] == read_obj("segment.obj")[:2], "the segment is the mask")
    inner = xml.parse("whole/transform.seq.mrml").getroot()
    matrices = {node.get("id"): [float(word) for word in node.get("matrixTransformToParent").split()]
                for node in inner.iter("LinearTransform")}
    items = [item.split(":")[0] for item in inner.find("Sequence").get("indexValues").split(";")]
    check(items == list(matrices) and len(items) == 3, f"a transform a moment: {items}")
    names = [storage.get("fileName") for storage in xml.parse("whole/centerlines.seq.mrml").getroot().iter("ModelStorage")]
    trees = [read_vtp("whole/" + name)[0]["Points"] for name in names]
    greatest = 0.0
    for item, tree in zip(items, trees):
        m = matrices[item]
        still = moved = 0.0
        for start, now in zip(trees[0], tree):
            ras = (-start[0], -start[1], start[2])
            there = [sum(m[4 * row + c] * ras[c] for c in range(3)) + m[4 * row + 3] for row in range(3)]
            moved += math.dist((-there[0], -there[1], there[2]), now) ** 2
            still += math.dist(start, now) ** 2
        still, moved = (math.sqrt(total / len(tree)) for total in (still, moved))
        greatest = max(greatest, still)
        check(moved < 1e-6 if tree is trees[0] else moved < 0.5 * still, f"{item}: {moved} mm left of {still} mm")
    check(greatest > 2, "the phantom moves")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        for part in (masks, runs, truth, centerlines, scenes, whole_scene):
            part()
        os.chdir("/")
    print(f"{len(failures)} failures")
    sys.exit(bool(failures))
