#!/usr/bin/env python3
"""A picture of a review page, as Chromium shows it: of an evaluation as it opens, the phase with the greatest Hausdorff distance, of a run its first vessel.

  python3 scripts/render-review.py EVALUATION/review.html OUTPUT.png
  python3 scripts/render-review.py RUN/review/review.html OUTPUT.png
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "Testing", "Web"))
sys.dont_write_bytecode = True
import chromium  # noqa: E402

SIZE = (1360, 880)
STATE = "document.getElementById('stage').dataset"
DATA = "JSON.parse(document.getElementById('data').textContent)"
page_file, output = sys.argv[1:3]
program = chromium.find()
if program is None:
    sys.exit("render-review: Chromium is missing")
with chromium.Browser(program, *SIZE) as page:
    page.open("file://" + os.path.abspath(page_file))
    page.wait("document.getElementById('stage') && Number(%s.drawn) > 0" % STATE)
    compared = page.evaluate(DATA + ".cases[0].shapes.truth !== null")
    page.click("#labels")
    if not compared:
        page.click("#vessels tbody tr")
    drawn = -1
    while drawn != page.evaluate(STATE + ".drawn"):
        drawn = page.evaluate(STATE + ".drawn")
        page.evaluate("new Promise((done) => setTimeout(done, 1000))")
    if compared:
        page.evaluate("scrollTo(0, 0)")
    else:
        page.evaluate("document.getElementById('vessel-views').scrollIntoView()")
        page.wait("[...document.querySelectorAll('#views article:first-child img')].every((one) => one.naturalWidth > 0)")
    page.screenshot(output)
print(output)
