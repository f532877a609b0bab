"""The review page in Chromium: check_review.py PIPELINE FOLDER

Makes a small evaluation of two cases, opens its page, uses it as a reviewer does and looks at the pixels. Screenshots stay
in the folder. Exit 125, which CTest takes as skipped, where there is no Chromium.
"""
import csv
import json
import os
import subprocess
import sys
import time

import chromium

HOSTILE = "</script><script>alert(1)</script> & \"one\""
COARSE = ("--truth-only", "--phases", "3", "--quiet", "--surface-spacing", "1.5", "--centerline-spacing", "3")
STATE = "document.getElementById('stage').dataset"


def check(condition, what):
    """Ends the test with a sentence."""
    if not condition:
        sys.exit("FAILED: " + what)


def make_page(pipeline):
    """Two hearts that differ, and one that is its own truth."""
    def run(*arguments):
        subprocess.run([pipeline, *arguments], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=240)

    for seed in ("5", "6"):
        run("phantom", "--seed", seed, *COARSE, "--output", "truth" + seed)
    run("evaluate", "--result", "truth6", "--truth", "truth5", "--name", HOSTILE, "--result", "truth5", "--truth", "truth5",
        "--name", "itself", "--no-pictures", "--quiet", "--error-bound", "0.1", "--output", "evaluation")


def red(pixel):
    return pixel[0] > 90 and pixel[0] > 1.8 * pixel[1] and pixel[0] > 1.8 * pixel[2]


def green(pixel):
    return pixel[1] > 60 and pixel[1] > 1.3 * pixel[0] and pixel[1] > 1.2 * pixel[2]


def orange(pixel):
    return pixel[0] > 130 and pixel[0] > 1.25 * pixel[1] > 1.25 * pixel[2]


def blue(pixel):
    return pixel[2] > 90 and pixel[2] > 1.3 * pixel[0]


class Reviewer:
    """Looks at the page and uses it."""

    def __init__(self, page):
        self.page = page

    def state(self, name):
        return self.page.evaluate("%s.%s" % (STATE, name))

    def ready(self):
        self.page.wait("document.getElementById('stage') && %s.state && %s.state !== 'reading'" % (STATE, STATE))
        check(self.state("state") == "ready", "the shapes are not there: " + self.text("#trouble"))
        self.page.wait("Number(%s.drawn) > 0" % STATE)

    def text(self, selector):
        return self.page.evaluate("document.querySelector(%s).textContent" % json.dumps(selector))

    def after(self, act):
        """Waits until something was drawn after an act and the fine picture is there."""
        before = int(self.state("drawn"))
        act()
        self.page.wait("Number(%s.drawn) > %d" % (STATE, before))
        drawn = None
        while drawn != self.state("drawn"):
            drawn = self.state("drawn")
            time.sleep(0.25)

    def press(self, key):
        self.after(lambda: self.page.press(key))

    def canvas(self):
        """Left, top, width and height of the canvas in the window, which is at the page's beginning."""
        self.page.evaluate("scrollTo(0, 0)")
        return self.page.evaluate("(() => { const box = document.getElementById('canvas').getBoundingClientRect();"
                                  " return [box.x, box.y, box.width, box.height]; })()")

    def picture(self):
        """The canvas at a third of its size, without what stands before it, as rows."""
        self.canvas()
        self.page.evaluate("document.head.append(Object.assign(document.createElement('style'),"
                           " { id: 'bare', textContent: '.stage > :not(canvas) { visibility: hidden }' }))")
        png = self.page.screenshot(selector="#canvas", scale=0.34)
        self.page.evaluate("document.getElementById('bare').remove()")
        return chromium.pixels(png)

    def count(self, *kinds):
        pixels = [pixel for row in self.picture() for pixel in row]
        return [sum(map(kind, pixels)) for kind in kinds]


def check_tables(page, table):
    """Numbers as they are in table1.json, to the digits shown."""
    def rows(selector):
        return page.evaluate("[...document.querySelectorAll(%s)].map((row) => [...row.children].map((cell) => cell.textContent))"
                             % json.dumps(selector))

    def number(value):
        return "–" if value is None else "%.3f" % value

    keys = [key for key in table["mean"] if any(phase[key] is not None for case in table["cases"] for phase in case["phases"])]
    headings = page.evaluate("[...document.querySelectorAll('#part-a thead tr:last-child th:not(.paper)')]"
                             ".map((one) => one.firstChild.textContent)")
    check(headings[3:] == keys, "the columns of Part A are %s, not %s" % (headings[3:], keys))
    shown, case = rows("#part-a tbody tr"), table["cases"][0]
    check(len(shown) == len(case["phases"]), "Part A has not a row a phase")
    for row, phase in zip(shown, case["phases"]):
        check(row[:2] == [str(phase["phase"]), "%.1f" % (100 * phase["fraction"])], "a wrong phase: %s" % row)
        check(row[3:3 + len(keys)] == [number(phase[key]) for key in keys], "wrong numbers: %s" % row)
    check(rows("#part-a tfoot tr")[0][1:1 + len(keys)] == [number(case["interpolated_mean"][key]) for key in keys],
          "wrong means of Part A")
    for row, case in zip(rows("#part-b tbody:not(.paper) tr"), table["cases"]):
        check(row[0] == case["name"], "Part B calls a case '%s'" % row[0])
        check([cell.split(" ")[0] for cell in row[1:]] == [number(case["interpolated_mean"][key]) for key in keys],
              "wrong numbers in Part B: %s" % row)
    paper = rows("#part-b tbody.paper tr")
    check(len(paper) == 6 and "4.96 ± 1.78" in paper[-1], "the paper's Part B is not there")


def check_branches(page):
    """Numbers as they are in branches.csv, over the phases, to the digits shown; the worst branch first."""
    with open("evaluation/branches.csv", encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["case"] == HOSTILE]
    shown = page.evaluate("[...document.querySelectorAll('#branches tbody tr')].map((row) => [row.dataset.branch,"
                          " ...[...row.children].map((cell) => cell.textContent)])")
    check(sorted((row[0] for row in shown), key=int) == sorted({row["group"] for row in rows}, key=int), "the branches are %s" % shown)
    furthest = []
    for group, label, length, covered, least, mean, greatest, worst in shown:
        own = [row for row in rows if row["group"] == group]
        values = {key: [float(row[key]) for row in own] for key in ("length_mm", "covered", "mean_mm", "HD_mm")}
        check(label == own[0]["label"], "a branch is called '%s'" % label)
        for text, value, digits in ((length, sum(values["length_mm"]) / len(own), 1), (covered, 100 * sum(values["covered"]) / len(own), 0),
                                    (least, 100 * min(values["covered"]), 0), (mean, sum(values["mean_mm"]) / len(own), 2),
                                    (greatest, max(values["HD_mm"]), 2)):
            check(abs(float(text) - value) < 0.6 * 0.1 ** digits, "%s says %s, not %g" % (label, text, value))
        phase = values["HD_mm"].index(max(values["HD_mm"]))
        check(worst.split(" ")[0] == own[phase]["phase"], "%s is worst in %s, not %s" % (label, worst, own[phase]["phase"]))
        furthest.append((min(0.5, min(values["covered"])), -max(values["HD_mm"])))
    check(furthest == sorted(furthest), "the worst branch is not the first")


def check_glance(user, table):
    """What the page opens with, and a branch that is chosen."""
    page, phases = user.page, table["cases"][0]["phases"]
    worst = max(range(len(phases)), key=lambda k: phases[k]["HD"])
    check(user.state("mode") == "model-distance" and user.state("phase") == str(worst), "it opens with %s in phase %s" % (
        user.state("mode"), user.state("phase")))
    check("HD %.2f mm" % phases[worst]["HD"] in user.text("#verdict"), "at a glance: " + user.text("#verdict"))
    check(page.evaluate("[...document.querySelectorAll('#glance-findings li')].map((one) => one.textContent)")
          == table["cases"][0]["findings"], "what is lost is not told")
    at_first = user.picture()
    user.after(lambda: page.click("#branches tbody tr:nth-child(2)"))
    chosen = page.evaluate("(() => { const row = document.querySelector('#branches tr[aria-current]');"
                           " return [...row.children].map((one) => one.textContent); })()")
    check(user.state("phase") == chosen[-1].split(" ")[0], "the branch is shown in phase " + user.state("phase"))
    check(chosen[0] in user.text("#readout"), "the branch is not read: " + user.text("#readout"))
    check(page.evaluate("!document.getElementById('mark').hidden") and user.picture() != at_first, "the branch is not shown")
    user.after(lambda: page.click("#farthest"))
    check(page.evaluate("document.querySelector('#branches tr[aria-current]') === null"), "the branch stays chosen")
    user.press("r")


def check_origin(page):
    """What the evaluation was made of, and what lies beside it."""
    about = page.evaluate("document.getElementById('about').textContent")
    for text in ("truth6 (model), truth5 (truth)", "at most 0.1 mm too small", "compared as they are", "coronary-pipeline evaluate"):
        check(text in about, "'%s' is not in: %s" % (text, about))
    links = page.evaluate("[...document.querySelectorAll('#about a')].map((one) => one.getAttribute('href'))")
    check({"table1.csv", "table1.tex", "table1.json", "branches.csv", "plots/HD.svg"} <= set(links), "links to %s" % links)
    check(all(os.path.isfile(os.path.join("evaluation", link)) for link in links), "a link leads nowhere: %s" % links)
    check(page.evaluate("document.querySelectorAll('#warnings li').length") > 0, "no warning of phases that nothing says were tracked")


def check_fingers(user):
    """On a telephone: one finger turns, two come nearer, a tap reads, and the page stays where it is."""
    page = user.page
    user.press("1")
    box = user.canvas()
    x, y = box[0] + box[2] / 2, box[1] + box[3] / 2
    page_place = "[scrollY, visualViewport.scale].join()"
    before, view = page.evaluate(page_place), user.state("view")
    user.after(lambda: page.touch(*([(x + 10 * k, y + 5 * k)] for k in range(7))))
    check(user.state("view") != view, "a finger does not turn")
    view, coloured = user.state("view"), sum(user.count(red))
    user.after(lambda: page.touch(*([(x - 40 - 5 * k, y), (x + 40 + 5 * k, y)] for k in range(9))))
    check(user.state("view") == view, "two fingers turn")
    check(sum(user.count(red)) > 1.3 * coloured, "two fingers do not come nearer")
    check(page.evaluate(page_place) == before, "the page moves with the fingers")
    rows = user.picture()
    places = [(column, row) for row, pixels in enumerate(rows) for column, pixel in enumerate(pixels)
              if row > 0.3 * len(rows) and red(pixel)]
    column, row = places[len(places) // 2]
    scale = len(rows[0]) / box[2]
    user.after(lambda: page.touch([(box[0] + (column + 0.5) / scale, box[1] + (row + 0.5) / scale)]))
    check("on the model, phase 0" in user.text("#readout"), "a tap reads: " + user.text("#readout"))


def check_lost_context(user):
    """The graphics driver may take its memory at any time, and give it back."""
    page, picture = user.page, user.picture()
    page.evaluate("window.loss = document.getElementById('canvas').getContext('webgl2').getExtension('WEBGL_lose_context');"
                  " loss.loseContext()")
    page.wait("document.getElementById('canvas').getContext('webgl2').isContextLost()")
    page.press("ArrowRight")
    page.press("ArrowLeft")
    user.after(lambda: page.evaluate("loss.restoreContext()"))
    check(user.picture() == picture, "the picture does not come back with the graphics context")


def check_print(user):
    """The paper has the picture, which is the only image in it, names where they are on the screen, and whole tables."""
    page = user.page
    places = ("(() => { const stage = document.getElementById('stage').getBoundingClientRect();"
              " return [...document.querySelectorAll('#names span, #scale')].map((one) => one.getBoundingClientRect())"
              ".flatMap((one) => [(one.x - stage.x) / stage.width, (one.y - stage.y) / stage.height]); })()")
    on_screen = page.evaluate(places)
    page.dark(True)
    pdf = page.print("review.pdf")
    page.dark(False)
    check(pdf.startswith(b"%PDF") and pdf.count(b"/Subtype /Image") == 1, "the picture is not on the paper")
    check(page.evaluate("document.getElementById('print').naturalWidth === document.getElementById('canvas').width"),
          "the paper has another picture")
    corner = ("(() => { const one = document.createElement('canvas').getContext('2d');"
              " one.drawImage(document.getElementById('print'), 0, 0); return [...one.getImageData(0, 0, 1, 1).data]; })()")
    check(page.evaluate(corner) == [255, 255, 255, 255], "the paper is not white")
    page.media("print")
    on_paper = page.evaluate(places)
    check(len(on_paper) > 10 and max(abs(a - b) for a, b in zip(on_screen, on_paper)) < 0.01, "names stand elsewhere on paper")
    page.resize(718, 1000)
    check(page.evaluate("document.documentElement.scrollWidth") <= 718, "a table is wider than the paper")
    page.media("")


def review(page, url, table):
    user = Reviewer(page)
    began = time.monotonic()
    page.open(url)
    user.ready()
    print("ready after %.2f s" % (time.monotonic() - began))
    check(user.text("#part-a-case") == HOSTILE, "the hostile name is not a text")
    check(page.evaluate("document.scripts.length") == 4, "the hostile name made an element")
    check(page.evaluate("typeof Review + typeof Painter + typeof RED") == "undefined" * 3, "there are globals")
    check_glance(user, table)
    user.after(lambda: page.click("#part-a tbody tr:nth-child(1) td:nth-child(4)"))
    user.press("3")
    page.screenshot("overlay.png")

    reds, greens = user.count(red, green)
    check(reds > 150 and greens > 150, "the overlay has %d red and %d green pixels" % (reds, greens))
    user.press("1")
    reds, greens = user.count(red, green)
    check(reds > 300 and greens == 0, "the model has %d red and %d green pixels" % (reds, greens))
    user.press("2")
    reds, greens = user.count(red, green)
    check(greens > 300 and reds == 0, "the truth has %d red and %d green pixels" % (reds, greens))
    user.press("5")
    user.press("4")
    far = user.count(orange, blue)
    check(sum(far) > 100, "distances have no colours")
    page.screenshot("distance.png")
    user.after(lambda: page.evaluate(
        "(() => { const one = document.getElementById('range'); one.value = 1000; one.dispatchEvent(new Event('change')); })()"))
    check(sum(user.count(orange, blue)) < 0.1 * sum(far), "another range of the colours changes nothing")
    user.after(lambda: page.click("#range-reset"))
    check(abs(sum(user.count(orange, blue)) - sum(far)) < 5, "the range does not come back")

    # Reading a point: one that the picture shows.
    box = user.canvas()
    rows = user.picture()
    y, x = next((y, x) for y, row in enumerate(rows) if y > 0.2 * len(rows) for x, pixel in enumerate(row)
                if orange(pixel) or blue(pixel) and x < 0.8 * len(row))
    user.after(lambda: page.click_at(box[0] + (x + 1) / 0.34, box[1] + (y + 0.5) / 0.34))
    if "mm" not in user.text("#readout").split("surface")[0]:
        user.after(lambda: page.click("#farthest"))
    readout = user.text("#readout")
    check("side the truth" in readout and "phase 0" in readout and "%R-R" in readout, "what is read: " + readout)
    user.after(lambda: page.click("#farthest"))
    greatest = float(user.text("#readout strong").split(" ")[0])
    check(0 < greatest <= table["cases"][0]["phases"][0]["HD"] + 0.01, "the largest distance is %g" % greatest)
    check(page.evaluate("!document.getElementById('mark').hidden"), "the point is not marked")

    # Turning, and back.
    user.press("3")
    at_first, view = user.picture(), user.state("view")
    middle = box[0] + box[2] / 2, box[1] + box[3] / 2
    user.after(lambda: page.drag(middle, (middle[0] + 120, middle[1] + 60)))
    check(user.state("view") != view, "dragging does not turn")
    turned = user.picture()
    different = sum(a != b for one, other in zip(at_first, turned) for a, b in zip(one, other))
    check(different > 500, "turning changes %d pixels" % different)
    user.after(lambda: page.click(".views button:nth-child(4)"))
    check(user.state("view").startswith("LAO 45"), "LAO 45 looks from " + user.state("view"))
    user.press("r")
    check(user.state("view") == view, "reset looks from " + user.state("view"))

    # Phases.
    user.press("ArrowRight")
    check(user.state("phase") == "1", "the arrow key does not go to the next phase")
    user.after(lambda: page.click("#part-a tbody tr:nth-child(3) td:nth-child(4)"))
    check(user.state("phase") == "2" and page.evaluate("document.querySelector('#part-a tr[aria-current]').dataset.phase") == "2",
          "a row of the table does not go to its phase")
    check("Phase 2" in user.text("#caption") and page.evaluate("document.getElementById('phase').value") == "2",
          "the slider is not at the phase")
    check(user.text(".plot .value") == "%.3f" % table["cases"][0]["phases"][2]["HD"], "the plot's cursor is elsewhere")
    user.after(lambda: page.evaluate("(() => { const one = document.getElementById('phase'); one.value = 0;"
                                     " one.dispatchEvent(new Event('input')); })()"))
    check(user.state("phase") == "0", "the slider does not go to a phase")
    page.click("#play")
    page.wait("%s.phase === '1'" % STATE)
    page.wait("%s.phase === '2'" % STATE)
    page.click("#play")
    check(user.state("playing") == "no", "it does not pause")

    # Lines and names.
    user.press("1")
    without = user.picture()
    user.after(lambda: (page.click("#lines"), page.click("#labels")))
    check(user.picture() != without, "there are no centerlines")
    names = page.evaluate("[...document.querySelectorAll('#names span')].map((one) => one.textContent)")
    check(len(names) > 5 and any(name.endswith("LAD") for name in names), "names: %s" % names)
    page.dark(True)
    page.wait("matchMedia('(prefers-color-scheme: dark)').matches")
    user.press("3")
    page.screenshot("dark.png")
    check(sum(user.picture()[0][0]) < 150, "the background is not dark")
    page.dark(False)

    page.click("#all-measures")
    check_tables(page, table)
    check_branches(page)
    check_origin(page)
    keys = page.evaluate("[...document.querySelectorAll('.plot .title')].map((one) => one.textContent.trim().split(' ')[0])")
    check(keys == [key for key, value in table["mean"].items() if value is not None], "plots of %s" % keys)
    check(page.evaluate("[...document.querySelectorAll('.plot .case.here')].every((one) => one.dataset.case === '0')"),
          "the other case is drawn as this one")
    user.after(lambda: page.evaluate("(() => { const one = document.querySelector('.plot'), box = one.getBoundingClientRect();"
                                     " one.dispatchEvent(new MouseEvent('click', { clientX: box.x + 0.5 * box.width, clientY: box.y + 9 })); })()"))
    check(user.state("phase") == "1", "a click in a plot goes to phase " + user.state("phase"))
    page.click("#part-a tbody tr:nth-child(1) td:nth-child(4)")

    # The other case: its own truth.
    page.click("#part-b tbody tr:nth-child(2) th")
    user.ready()
    page.wait("%s.case === '1'" % STATE)
    user.press("4")
    user.press("c")  # without the lines, whose edges are as orange
    check(sum(user.count(orange, blue)) == 0, "a surface is not its own truth")
    check_lost_context(user)
    check_print(user)

    page.resize(390, 844, mobile=True)
    page.wait("innerWidth < 500")
    page.evaluate("scrollTo(0, 0)")
    time.sleep(0.3)
    page.screenshot("narrow.png")
    check(page.evaluate("document.documentElement.scrollWidth") <= 390, "the page is wider than a telephone")
    columns = page.evaluate("[...document.querySelectorAll('th, td, dt, dd, li, p, figcaption')].filter((one) => one.clientHeight >"
                            " 4 * one.clientWidth && one.textContent.trim().length > 3).map((one) => one.textContent)")
    check(not columns, "columns of one letter: %s" % columns)
    check_fingers(user)

    printed = page.evaluate("document.getElementById('print').src")
    check(page.requests == [url, printed], "the network was asked for %s" % [one[:200] for one in page.requests])
    check(not page.complaints, "the browser complains: %s" % page.complaints)


def review_in_old_browser(page, url):
    """Without DecompressionStream: a sentence, and the tables."""
    page.call("Page.addScriptToEvaluateOnNewDocument", source="delete window.DecompressionStream;")
    page.open(url)
    page.wait("document.getElementById('stage') && %s.state === 'trouble'" % STATE)
    check("DecompressionStream" in page.evaluate("document.getElementById('trouble').textContent"), "no sentence")
    check(page.evaluate("document.querySelectorAll('#part-a tbody tr').length") == 3, "no table")
    check(page.evaluate("document.querySelectorAll('.plot').length") == 4, "no plots")


def main():
    pipeline, folder = sys.argv[1:3]
    program = chromium.find()
    if program is None:
        print("skipped: Chromium is missing")
        sys.exit(125)
    os.makedirs(folder, exist_ok=True)
    os.chdir(folder)
    make_page(pipeline)
    with open("evaluation/table1.json", encoding="utf-8") as file:
        table = json.load(file)
    url = "file://" + os.path.abspath("evaluation/review.html")
    with chromium.Browser(program, 1400, 900) as page:
        review(page, url, table)
        review_in_old_browser(page, url)
    print("the review page is as it should be")


if __name__ == "__main__":
    main()
