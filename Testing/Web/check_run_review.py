"""The review of a run: check_run_review.py PIPELINE FOLDER

Makes a folder as run leaves it, of a tube whose places and values are known, with a bridged gap, a narrowing and calcium; lets the program draw it,
looks at the pixels of the pictures, and uses the page in Chromium as a reader does. Screenshots stay in the folder. Without Chromium
only the pictures are looked at.
"""
import array
import json
import math
import os
import re
import shutil
import subprocess
import sys
import time

import chromium

HOSTILE = "D1</script><script>alert(1)</script>"
STATE = "document.getElementById('stage').dataset"
SIZE, SPACING = 72, 0.8  # voxels, mm
LOW = -0.5 * (SIZE - 1) * SPACING
LUMEN, FAT, RADIUS = 400, -80, 2.0
LENGTH, FORK = 40.0, 20.0  # mm of the trunk along x, and where the side branch leaves it along z
LEFT, PER_MM, FIRST, ROWS = 52, 6, 24, 97  # of a straightened view: see docs/evaluation.md
MIDDLE = FIRST + ROWS // 2
ORANGE, CYAN, RED, YELLOW, HATCH = (255, 150, 20), (80, 215, 255), (255, 96, 96), (255, 236, 90), (46, 50, 74)


def check(condition, what):
    """Ends the test with a sentence."""
    if not condition:
        sys.exit("FAILED: " + what)


def write_image(path, value, kind="SHORT"):
    """A MetaImage of 16 or 8 bits of a function of the place."""
    voxels = array.array("h" if kind == "SHORT" else "B", (int(value(LOW + SPACING * i, LOW + SPACING * j, LOW + SPACING * k))
                               for k in range(SIZE) for j in range(SIZE) for i in range(SIZE)))
    if sys.byteorder == "big":
        voxels.byteswap()
    header = ("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
              "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = %g %g %g\nElementSpacing = %g %g %g\nDimSize = %d %d %d\n"
              "ElementType = MET_%s\nElementDataFile = LOCAL\n" % (LOW, LOW, LOW, SPACING, SPACING, SPACING, SIZE, SIZE, SIZE, kind))
    with open(path, "wb") as file:
        file.write(header.encode() + voxels.tobytes())


def tube(x, y, z):
    """The trunk from x = -20 to 20, its side branch up to z = 15; a chamber below."""
    trunk = math.hypot(y, z) if abs(x) <= 20 else 99
    side = math.hypot(x, y) if 0 <= z <= 15 else 99
    return LUMEN if min(trunk, side) < RADIUS or z < -14 else FAT


def chalk(x, y, z):
    """Beside the trunk, 28 to 32 mm from its beginning: object 7."""
    return 7 if 8 <= x <= 12 and 1.5 <= y <= 4 and abs(z) <= 1.2 else 0


def numbers(name, kind, values, components=1):
    return '<DataArray type="%s" Name="%s" NumberOfComponents="%d" format="ascii">%s</DataArray>' % (
        kind, name, components, " ".join(str(value) for value in values))


def write_tree(path, marked):
    """One point a mm; the trunk is two branches, the side branch leaves between them."""
    trunk = [(-20.0 + k, 0.0, 0.0) for k in range(41)]
    side = [(0.0, 0.0, 1.0 + k) for k in range(14)]
    points = trunk + side
    lines = [list(range(21)), list(range(20, 41)), [20] + list(range(41, 55))]
    offsets = [sum(len(one) for one in lines[:k + 1]) for k in range(3)]
    arrays = [numbers("MaximumInscribedSphereRadius", "Float64", [RADIUS] * len(points))]
    if marked:
        gap = [1 if 6 <= k <= 10 else 0 for k in range(41)] + [0] * 14  # 14 to 10 mm before the middle
        arrays += [numbers("Bridged", "UInt8", gap), numbers("BridgeConfidence", "Float64", [0.4 if one else 1.0 for one in gap]),
                   numbers("RadiusInterpolated", "UInt8", [0] * 28 + [1] * 4 + [0] * 23),
                   numbers("StenosisDegree", "Float64", [0.62 if k == 34 else 0.3 if k in (33, 35) else 0.0 for k in range(55)]),
                   numbers("ReferenceRadius", "Float64", [2.1] * len(points)),
                   numbers("CalciumLabel", "Int32", [1 if 28 <= k < 32 else 0 for k in range(55)])]
    names = "".join("%s 0 " % " ".join(str(c) for c in name.encode()) for name in ("pRCA", "mRCA", HOSTILE))
    with open(path, "w", encoding="utf-8") as file:
        file.write(
            '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData>'
            '<Piece NumberOfPoints="%d" NumberOfVerts="0" NumberOfLines="3" NumberOfStrips="0" NumberOfPolys="0">' % len(points) +
            "<PointData>" + "".join(arrays) + "</PointData><CellData>" + numbers("GroupIds", "Int32", (0, 1, 2)) +
            numbers("ParentGroupIds", "Int32", (-1, 0, 0)) + numbers("TreeIds", "Int32", (1, 1, 1)) +
            '<Array type="String" Name="SegmentLabel" NumberOfTuples="3" format="ascii">%s</Array>' % names + "</CellData><Points>" +
            numbers("Points", "Float64", [c for point in points for c in point], 3) + "</Points><Lines>" +
            numbers("connectivity", "Int64", [k for line in lines for k in line]) + numbers("offsets", "Int64", offsets) +
            "</Lines></Piece></PolyData></VTKFile>\n")


def make_run(folder, marked):
    """As run leaves it after the centerlines."""
    os.makedirs(folder, exist_ok=True)
    write_tree(os.path.join(folder, "centerline.vtp"), marked)
    centerline = {"trees": [{"name": "RCA", "status": 0, "message": "reached"}]}
    stages = [{"name": "centerline", "state": "finished", "seconds": 1.5, "warnings": []}]
    if marked:
        stages[0]["warnings"] = ["no artery in the <b>LAD's</b> distal territory"]
        centerline["bridges"] = [{"vessel": "pRCA", "from": [-14, 0, 0], "to": [-10, 0, 0], "length_mm": 4.0, "confidence": 0.4, "kind": "stenosis"}]
        centerline["lesions"] = [{"vessel": "mRCA", "position": [14, 0, 0], "abscissa_start_mm": 33.0, "length_mm": 2.0, "population_diameter_mm": None,
                                  "diameter_stenosis_percent": 61.7, "range_percent": [50.2, 70.4], "kind": "soft", "confidence": 0.8, "bridged": False}]
        centerline["calcium"] = {"objects": [{"label": 7, "vessel": "mRCA", "position": [10, 2.5, 0], "volume_mm3": 24.04}], "score": 30.5,
                                 "score_remark": "on an image with contrast", "file": "calcium.mha",
                                 "radius_interpolated": [{"vessel": "mRCA", "from": [8, 0, 0], "to": [12, 0, 0], "length_mm": 4.0}]}
        write_image(os.path.join(folder, "calcium.mha"), chalk, "UCHAR")
    report = {"phase": 0, "time": 0.75, "image": "image.mha", "settings": {"input": ["image.mha"], "fractions": [], "series": ""},
              "stages": stages, "stopped": {"stage": "surface", "reason": "it was not wanted"} if marked else None, "centerline": centerline}
    with open(os.path.join(folder, "report.json"), "w", encoding="utf-8") as file:
        json.dump(report, file)


def pixels(path):
    with open(path, "rb") as file:
        return chromium.pixels(file.read())


def like(pixel, colour, tolerance=60):
    return max(abs(a - b) for a, b in zip(pixel, colour)) < tolerance


def column_of(arc):
    """Of a straightened view without a lead-in, at so many mm."""
    return LEFT + round(PER_MM * arc)


def check_straightened(folder):
    """The trunk: bright inside, dark beside, its contour where the radius is, and the marks where they belong."""
    rows = pixels(os.path.join(folder, "pictures/01-prca-mrca.png"))
    check(len(rows[0]) == max(300, LEFT + round(PER_MM * LENGTH) + 1 + 14), "the trunk is %d pixels long" % len(rows[0]))
    edge = round(PER_MM * RADIUS)
    for arc in (2, 30, 38):
        column = column_of(arc)
        inside, beside = rows[MIDDLE + 3][column], rows[MIDDLE - 30][column]
        # Black is -150, white twice the lumen: 400 is (400 + 150) / 950.
        check(abs(inside[0] - 255 * 550 / 950) < 12 and inside[0] == inside[2], "the lumen is %s" % (inside,))
        check(beside[0] < 40, "beside the lumen it is %s" % (beside,))
    for arc, colour in ((2, CYAN), (37, CYAN)):
        column = column_of(arc)
        for row in (MIDDLE - edge, MIDDLE + edge):
            check(like(rows[row][column], colour), "the wall at %d mm is %s" % (arc, rows[row][column]))
    # Dashes: some of the gap's columns are orange, some are not; none elsewhere.
    dashes = [any(like(rows[row][column], ORANGE) for row in range(MIDDLE - edge - 1, MIDDLE - edge + 2))
              for column in range(column_of(6), column_of(10) + 1)]
    check(0.25 < sum(dashes) / len(dashes) < 0.9, "%d of %d columns of the gap are orange" % (sum(dashes), len(dashes)))
    elsewhere = sum(like(rows[row][column], ORANGE, 30) for row in range(FIRST, FIRST + 2 * ROWS)
                    for column in range(column_of(12), column_of(40)))
    check(elsewhere == 0, "%d orange pixels where all was seen" % elsewhere)
    profile = range(FIRST + 2 * ROWS + 4 + 53, len(rows))
    reds = [column for row in profile for column in range(len(rows[0])) if like(rows[row][column], RED, 40)]
    check(reds and abs(sum(reds) / len(reds) - column_of(34)) < 12, "the narrowing is not written at 34 mm")
    bar = [column for row in profile for column in range(len(rows[0])) if like(rows[row][column], YELLOW, 40)]
    check(bar and min(bar) >= column_of(27) and max(bar) <= column_of(32), "calcium is not beside 28 to 32 mm")
    # Its outline, in that of the cuts that has it: from 1.5 to 4 mm beside the axis, to half a voxel.
    places = [(row, column) for row in range(FIRST, FIRST + 2 * ROWS + 4) for column in range(len(rows[0])) if like(rows[row][column], YELLOW, 30)]
    columns, aside = [column for _, column in places], [min(abs(row - MIDDLE), abs(row - MIDDLE - ROWS - 4)) for row, _ in places]
    check(places and abs(min(columns) - column_of(28)) <= 4 and abs(max(columns) - column_of(32)) <= 4, "calcium's outline is elsewhere")
    check(abs(min(aside) - 1.5 * PER_MM) <= 4 and abs(max(aside) - 4 * PER_MM) <= 4, "the outline is %d to %d beside" % (min(aside), max(aside)))


def check_pictures(pipeline):
    def run(*arguments, code=0):
        done = subprocess.run([pipeline, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=240, text=True, check=False)
        check(done.returncode == code, "%s: exit code %d: %s" % (" ".join(arguments), done.returncode, done.stderr))
        return done

    write_image("image.mha", tube)
    make_run("run", True)
    make_run("bare", False)
    run("review", "run", "--quiet")
    found = sorted(os.listdir("run/review/pictures"))
    side = "02-d1-script-script-alert-1-script"
    wanted = ["01-prca-mrca-curved.png", side + "-curved.png", "01-prca-mrca-slab.png", "01-prca-mrca.png", side + "-slab.png", side + ".png",
              "slabs-axial.png", "slabs-coronal.png", "slabs-sagittal.png"]
    check(found == sorted(wanted), "pictures: %s" % found)
    check_straightened("run/review")
    # Nothing 8 mm around the side branch is outside of the image; 40 mm around the trunk much is.
    def hatched(rows):
        return sum(one == HATCH for row in rows for one in row)

    check(hatched(pixels("run/review/pictures/%s.png" % side)) == 0, "the side branch is hatched")
    run("review", "run", "--half-width", "40", "--output", "wide", "--quiet")
    check(hatched(pixels("wide/pictures/01-prca-mrca.png")) > 5000, "what is outside of the image is not hatched")
    # The same bytes on any number of threads; without marks; elsewhere.
    run("review", "run", "--threads", "1", "--output", "again", "--quiet")
    for name in wanted:
        with open("again/pictures/" + name, "rb") as one, open("run/review/pictures/" + name, "rb") as other:
            check(one.read() == other.read(), name + " depends on the number of threads")
    run("review", "bare", "--output", "bare-review", "--window", "-100", "700", "--quiet")
    check(not any(like(one, ORANGE, 30) for row in pixels("bare-review/pictures/01-prca-mrca.png") for one in row), "marks of nothing")
    # Pictures of an older review go with it; what is not its own stays.
    with open("bare-review/pictures/09-mine.png", "w", encoding="utf-8"):
        pass
    run("review", "bare", "--no-pictures", "--output", "bare-review", "--quiet")
    check(os.listdir("bare-review/pictures") == ["09-mine.png"], "left of an older review: %s" % os.listdir("bare-review/pictures"))
    said = run("review", "run", "--no-pictures", "--output", "tables").stdout
    check(said == "tables: 2 vessels, 0 pictures, review.html\n", "it says: " + said)

    # What can not be.
    os.rename("image.mha", "moved.mha")
    said = run("review", "bare", "--output", "lost", "--quiet").stderr
    check("image.mha' of 'bare' is not there" in said and "--image" in said, "a lost image: " + said)
    run("review", "bare", "--image", "moved.mha", "--output", "moved", "--quiet")
    check(os.path.exists("moved/pictures/01-prca-mrca.png"), "no pictures of the moved image")
    run("review", "bare", "--image", "nowhere.mha", "--output", "none", code=1)
    check(not os.path.exists("none"), "a failed review leaves something")
    run("review", "nowhere", code=1)
    run("review", "bare", "--window", "5", "5", code=2)
    os.rename("moved.mha", "image.mha")
    with open("bare/report.json", "w", encoding="utf-8") as file:
        file.write("[" * 100000)
    said = run("review", "bare", "--output", "none", code=1).stderr
    check(said.count("\n") == 1 and "report.json" in said, "a broken report: " + said)


def data_of(page):
    """What a page was made of."""
    with open(page, encoding="utf-8") as file:
        return json.loads(re.search(r'id="data">(.*?)</script>', file.read(), re.DOTALL).group(1))


def check_moving(pipeline):
    """A run with motion, alone and held against a truth: the phantom's truth serves as both."""
    def run(*arguments):
        subprocess.run([pipeline, *arguments], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=240)

    if not os.path.exists("beat"):
        run("phantom", "--seed", "5", "--truth-only", "--phases", "3", "--quiet", "--surface-spacing", "1.5", "--centerline-spacing", "3",
            "--output", "beat")
    make_run("beat", False)
    shutil.copy("beat/truth/centerline_01.vtp", "beat/centerline.vtp")
    shutil.copytree("beat/truth", "beat/motion", dirs_exist_ok=True)
    with open("beat/report.json", encoding="utf-8") as file:
        report = json.load(file)
    report["time"] = 0.5
    report["stages"][0]["warnings"] = ["something"]
    filled = [{"vessel": "D1", "time": 1.06, "status": "lost", "length_mm": 12.5, "confidence": 0.2, "place": [1.0, 2.0, 3.0]}]
    limits = {"applied": True, "greatest_move_mm": 0.4, "clamped": [{"vessel": "D1", "time": 1.06, "limit": "strain", "points": 2}]}
    report["motion"] = {"tracked_times": [-0.05, 1.06], "tracked_share": [1.0, 0.3], "filled": filled, "limits": limits}
    with open("beat/report.json", "w", encoding="utf-8") as file:
        json.dump(report, file)
    run("review", "beat", "--no-pictures", "--output", "moving", "--quiet")
    data = data_of("moving/review.html")
    case, phases = data["cases"][0], data["table1"]["cases"][0]["phases"]
    check(len(case["shapes"]["model"]["frames"]) == 3 and case["shapes"]["truth"] is None, "the moving model is not there, or a truth is")
    check([(one["interpolated"], one["lost"]) for one in phases] == [(False, False), (True, False), (False, True)],
          "phases: %s" % [(one["interpolated"], one["lost"]) for one in phases])
    check(case["run"]["reference"] == 1 and case["run"]["warnings"] == ["centerline: something"], "the run says: %s" % case["run"]["warnings"])
    check(case["run"]["filled"] == filled and case["run"]["limits"] == limits, "the page does not tell of what was filled or held back")
    # Without images the radii of the moved lines, as long as each vessel is, at each phase.
    cycle = case["run"]["cycle"]
    check(cycle["measured"] is False and len(cycle["times"]) == 3 and len(cycle["vessels"]) == len(case["run"]["vessels"]), "no cycle")
    for one, vessel in zip(cycle["vessels"], case["run"]["vessels"]):
        check([len(row) for row in one["diameter"]] == 3 * [len(vessel["path"])], "%s has other diameters than places" % vessel["name"])
        check(all(0.3 < value < 8 for row in one["diameter"] for value in row), "diameters of %s" % vessel["name"])
    names = [one["name"] for one in case["run"]["vessels"]]
    check(any(name.startswith("LM, pLAD") for name in names) and any(name.startswith("pRCA") for name in names), "vessels: %s" % names)
    run("evaluate", "--result", "beat", "--truth", "beat", "--no-pictures", "--quiet", "--error-bound", "0.1", "--output", "compared")
    case = data_of("compared/review.html")["cases"][0]
    check(case["shapes"]["truth"] is not None and case["run"]["warnings"] == ["centerline: something"] and case["run"]["reference"] == 1,
          "an evaluation's page does not tell what the run says")


def text(page, selector):
    return page.evaluate("document.querySelector(%s).textContent" % json.dumps(selector))


def check_page(page, url):
    page.open(url)
    page.wait("document.getElementById('stage') && %s.state === 'ready' && Number(%s.drawn) > 0" % (STATE, STATE))
    check(page.evaluate("['#modes', '#transport', '#farthest', '.of-measures'].every((one) => document.querySelector(one).hidden)"),
          "parts of a comparison are shown without a truth")
    warnings = page.evaluate("[...document.querySelectorAll('#run-warnings li')].map((one) => one.textContent)")
    check(warnings == ["centerline: no artery in the <b>LAD's</b> distal territory", "the run ended in surface: it was not wanted"],
          "warnings: %s" % warnings)
    vessels = page.evaluate("[...document.querySelectorAll('#vessels tbody tr')].map((row) => [...row.children].map((one) => one.textContent))")
    check(vessels == [["pRCA, mRCA", "40.0", "6.0", "5.0", "62 %"], [HOSTILE, "14.0", "–", "–", "–"]], "vessels: %s" % vessels)
    check(page.evaluate("[...document.querySelectorAll('#run-bridges tbody td')].map((one) => one.textContent)")
          == ["show", "pRCA", "stenosis", "0.40", "4"], "bridges: " + text(page, "#run-bridges"))
    check(page.evaluate("[...document.querySelectorAll('#run-lesions tbody td')].map((one) => one.textContent)")
          == ["show", "mRCA", "soft", "62", "50 to 70", "0.80", "2", "33", "no"], "lesions: " + text(page, "#run-lesions"))
    check(text(page, "#run-calcium tbody") == "show" + "mRCA" + "7" + "24.04", "calcium: " + text(page, "#run-calcium tbody"))
    check("score 30.50; score remark on an image with contrast" in text(page, "#findings"), "the score is not told: " + text(page, "#findings"))
    check(text(page, "#run-hidden tbody") == "showmRCA4", "hidden: " + text(page, "#run-hidden tbody"))
    check("The run says nothing of it." in text(page, "#findings"), "a missing list is not told")
    page.screenshot("run.png")

    # Dashes of the gap in the model: orange there, and gone with a run that bridged nothing.
    def oranges():
        page.evaluate("document.head.append(Object.assign(document.createElement('style'),"
                      " { id: 'bare', textContent: '.stage > :not(canvas) { visibility: hidden }' }))")
        rows = chromium.pixels(page.screenshot(selector="#canvas"))
        page.evaluate("document.getElementById('bare').remove()")
        return sum(one[0] > 190 and 90 < one[1] < 180 and one[2] < 90 for row in rows for one in row)

    dashed = oranges()
    check(dashed > 40, "the model has %d orange pixels" % dashed)

    # A row of the table, a picture and the model show the same place.
    page.click("#run-lesions tbody tr")
    page.wait("document.getElementById('readout').textContent.startsWith('pRCA, mRCA34 mm')")
    cursor = ("(() => { const box = document.querySelector('#views article .view').getBoundingClientRect(),"
              " line = document.querySelector('#views article .cursor.across').getBoundingClientRect();"
              " return (line.x + line.width / 2 - box.x) / box.width; })()")
    width = page.evaluate("document.querySelector('#views article .view img').naturalWidth")
    check(abs(page.evaluate(cursor) * width - column_of(34)) < 2, "the cursor is not at 34 mm")
    page.wait("!document.getElementById('mark').hidden")
    place = page.evaluate("(() => { const one = document.querySelector('#views article .view'); one.scrollIntoView({ block: 'center' });"
                          " const box = one.getBoundingClientRect(); return [box.x, box.y, box.width, box.height]; })()")
    page.click_at(place[0] + place[2] * column_of(12) / width, place[1] + place[3] * 0.2)
    page.wait("document.getElementById('readout').textContent.startsWith('pRCA, mRCA12 mm')")
    check("L -8.0, P 0.0, H 0.0" in text(page, "#readout"), "12 mm along it is at " + text(page, "#readout"))
    check(page.evaluate("document.querySelectorAll('#sheets .cursor:not([hidden])').length") == 3, "the slabs do not show the place")

    # The cross-section at the slider: the same place everywhere, the tree's lumen, and the fat's edge, which is the lumen's in this image.
    slide = ("(() => { const one = document.querySelector('#views article input[type=range]'); one.value = 25;"
             " one.dispatchEvent(new Event('input')); })()")
    page.evaluate(slide)
    page.wait("document.getElementById('readout').textContent.startsWith('pRCA, mRCA25 mm')")
    check(abs(page.evaluate(cursor) * width - column_of(25)) < 2, "the cursor is not at the slider's place")
    check(page.evaluate("document.querySelector('#views article .section circle').getAttribute('r')") == str(int(RADIUS)), "another lumen")
    path = page.evaluate("document.querySelector('#views article .section .outer').getAttribute('d')")
    away = [math.hypot(float(x), float(y)) for x, y in re.findall(r"(-?[0-9.]+) (-?[0-9.]+)", path)]
    check(len(away) > 20 and all(abs(one - RADIUS) < 0.5 for one in away), "the outer boundary is at %s" % away)
    page.wait("document.querySelector('#views article .section img').naturalWidth > 100")
    tile = page.evaluate("(() => { const one = document.querySelector('#views article .section'), img = one.querySelector('img');"
                         " return [parseFloat(img.style.left), parseFloat(img.style.top)]; })()")
    check(tile == [-500.0, -100.0], "the section of 25 mm is at %s" % tile)
    check("There is no motion" in text(page, "#findings"), "a cycle of nothing")
    page.evaluate("document.querySelector('#sheets .view').scrollIntoView({ block: 'center' })")
    page.wait("[...document.querySelectorAll('#sheets .view:first-child img')].every((one) => one.naturalWidth > 100)")
    layer = "getComputedStyle(document.querySelector('.layer')).visibility"
    check(page.evaluate(layer) == "visible", "the marks are not there")
    page.click("#marks")
    check(page.evaluate(layer) == "hidden", "the marks can not be taken off")
    page.click("#marks")

    # Paper has the pictures, and the network was not asked.
    page.screenshot("sheets.png")
    pdf = page.print("run.pdf")
    check(pdf.count(b"/Subtype /Image") >= 8, "the pictures are not on the paper")
    page.resize(390, 844, mobile=True)
    page.wait("innerWidth < 500")
    page.evaluate("document.getElementById('vessel-views').scrollIntoView()")
    time.sleep(0.3)
    page.screenshot("run-narrow.png")
    check(page.evaluate("document.documentElement.scrollWidth") <= 390, "the page is wider than a telephone")
    check(all(one == url or one.startswith("data:") for one in page.requests), "the network was asked")
    check(not page.complaints, "the browser complains: %s" % page.complaints)
    page.resize(1300, 900)
    return dashed


def check_cycle(page, url):
    """Without pictures: curves and maps of what is known, and a click in them that leads to the place."""
    page.open(url)
    page.wait("document.getElementById('stage') && %s.state === 'ready'" % STATE)
    vessels = page.evaluate("document.querySelectorAll('#vessels tbody tr').length")
    check(page.evaluate("document.querySelectorAll('#views .cycle').length") == vessels, "not every vessel has its cycle")
    check(page.evaluate("document.querySelectorAll('#views article:first-child .chart .phase').length") == 3, "not a curve a phase")
    check(page.evaluate("document.querySelectorAll('#views article:first-child .chart .now').length") == 1, "no curve is of the phase that is shown")
    ends = "document.querySelector('#views article:first-child .scale-of-map').textContent"
    diameters = page.evaluate(ends)
    page.evaluate("(() => { const one = document.querySelector('#views article:first-child .cycle select'); one.value = 1;"
                  " one.dispatchEvent(new Event('change')); })()")
    areas = page.evaluate(ends)
    values = [[float(one) for one in re.findall(r"[0-9.]+(?= mm)", said)] for said in (diameters, areas)]
    check(all(abs(math.pi / 4 * d * d - a) < 0.1 + math.pi / 2 * d * 0.06 for d, a in zip(*values)) and len(values[1]) == 2,
          "areas of %s, diameters of %s" % (areas, diameters))
    page.evaluate("(() => { const one = document.querySelector('#views article:first-child .map'), box = one.getBoundingClientRect();"
                  " one.dispatchEvent(new MouseEvent('click', { clientX: box.x + 0.5 * box.width, clientY: box.y + 2 })); })()")
    name = page.evaluate("document.querySelector('#vessels tbody tr').firstChild.textContent")
    page.wait("document.getElementById('readout').textContent.startsWith(%s)" % json.dumps(name))
    check("106 %R-R" in text(page, "#views article:first-child .cycle > .none:last-child"), "the map is not read")


def main():
    pipeline, folder = sys.argv[1:3]
    os.makedirs(folder, exist_ok=True)
    os.chdir(folder)
    check_pictures(pipeline)
    check_moving(pipeline)
    program = chromium.find()
    if program is None:
        print("Chromium is missing: the page was not opened")
        return
    with chromium.Browser(program, 1300, 900) as page:
        check_page(page, "file://" + os.path.abspath("run/review/review.html"))
        page.open("file://" + os.path.abspath("bare-review/review.html"))
        page.wait("document.getElementById('stage') && %s.state === 'ready'" % STATE)
        check("The run says nothing of it." in text(page, "#findings"), "what a run does not know is not told")
        check_cycle(page, "file://" + os.path.abspath("moving/review.html"))
        check(not page.complaints, "the browser complains: %s" % page.complaints)
    print("the review of a run is as it should be")


if __name__ == "__main__":
    main()
