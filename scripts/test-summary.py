#!/usr/bin/python3
"""What ran, what was skipped and why, and how long each label took, of the JUnit file that CTest writes.

Usage: scripts/test-summary.py NAME JUNIT.xml LIST.json
The list is what `ctest --show-only=json-v1` prints: it has the labels.
A test that did a part only and says so in a line that begins with 'skipped: ' is named too. Testing/time-budgets.json has the
seconds that the tests of a label may take one after another; what takes more is said, and fails nothing: machines differ.
"""
import json
import os
import re
import sys
import xml.etree.ElementTree as xml


def reason(output):
    """Why a test says that it was skipped."""
    said = re.findall(r"^skipped: (.*)$", output, re.MULTILINE)
    # GoogleTest: the place, then what was streamed, then the case.
    said += re.findall(r"^\S+:\d+: Skipped\n(.*?)\n+\[  SKIPPED \]", output, re.MULTILINE | re.DOTALL)
    # Of several cases the same is said once.
    return "; ".join(dict.fromkeys(" ".join(text.split()) for text in said)) or "it does not say why"


def labels_of(path):
    """Of each test: nightly, or its kind, which is the first of its labels."""
    labels = {}
    with open(path, encoding="utf-8") as file:
        for test in json.load(file)["tests"]:
            own = [value for item in test["properties"] if item["name"] == "LABELS" for value in item["value"]]
            labels[test["name"]] = "nightly" if "nightly" in own else own[0] if own else "none"
    return labels


def main():
    name, path, tests = sys.argv[1:4]
    labels = labels_of(tests)
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../Testing/time-budgets.json"), encoding="utf-8") as file:
        budgets = json.load(file)
    ran, skipped, partly, seconds = 0, [], [], {}
    for case in xml.parse(path).getroot().iter("testcase"):
        output = case.findtext("system-out") or ""
        if case.get("status") in ("notrun", "disabled"):
            skipped.append((case.get("name"), reason(output)))
            continue
        ran += 1
        if re.search(r"^skipped: ", output, re.MULTILINE):
            partly.append((case.get("name"), reason(output)))
        label = labels[case.get("name")]
        seconds[label] = seconds.get(label, 0.0) + float(case.get("time"))
    print("%s: %d tests ran, %d were skipped%s" % (name, ran, len(skipped), ":" if skipped else ""))
    for test, why in skipped:
        print("   %s: %s" % (test, why))
    for test, why in partly:
        print("   %s, a part of it: %s" % (test, why))
    parts = []
    for label, taken in sorted(seconds.items()):
        budget = budgets.get(label)
        parts.append("%s %.0f%s" % (label, taken, "" if budget is None else " of %d" % budget
                                    + (", OVER ITS BUDGET" if taken > budget else "")))
    print("%s: seconds of tests by label: %s; JUnit: %s" % (name, "; ".join(parts), os.path.relpath(path)))


if __name__ == "__main__":
    main()
