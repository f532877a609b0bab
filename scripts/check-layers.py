#!/usr/bin/env python3
"""Whether each folder includes headers only of those that it may use.

What a folder of a VTK module may use, vtk.module says (DEPENDS, PRIVATE_DEPENDS); for the others the table below does. Exit
code 1 when an include is against it.
"""
import collections
import glob
import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FILTERS = "Filters/*"
USES = {
    "Formats": [FILTERS],
    "Readers": ["Formats"],
    "Writers": ["Formats"],
    "Filters/Centerline": ["Formats"],  # edits by hand are a file
    "Filters/Flow": ["Filters/Common", "Filters/Volume", "Filters/Skinning"],  # no module: algorithms only
    "Filters/Motion": ["Filters/Centerline"],  # the names say where the heart is
    "Filters/Skinning": ["Formats"],  # a cache of weights is a file
    "Applications/Common": [FILTERS, "Formats"],
    "Applications/coronary-pipeline": [FILTERS, "Formats", "Readers", "Writers", "Applications/Common"],
    "Applications/coronary-posing": [FILTERS, "Applications/Common"],
    "Simulator/Vessels": [FILTERS, "Formats", "Applications/Common"],
    "Simulator/Physics": [FILTERS, "Simulator/Vessels"],
    "Simulator/Contrast": [FILTERS, "Simulator/Vessels"],
    "Simulator/Fluoroscopy": [FILTERS, "Formats"],
    "Simulator/Hands": [FILTERS, "Formats", "Applications/Common", "Simulator/Physics"],
    "Simulator/Session": [FILTERS, "Formats", "Applications/Common", "Simulator/Vessels", "Simulator/Physics", "Simulator/Contrast",
                          "Simulator/Fluoroscopy", "Simulator/Hands"],
    "Simulator/Console": [FILTERS, "Formats", "Applications/Common", "Simulator/Vessels", "Simulator/Physics", "Simulator/Contrast",
                          "Simulator/Fluoroscopy", "Simulator/Hands", "Simulator/Session"],
    "Simulator/Window": [FILTERS, "Formats", "Applications/Common", "Simulator/Vessels", "Simulator/Physics", "Simulator/Contrast",
                         "Simulator/Fluoroscopy", "Simulator/Hands", "Simulator/Session", "Simulator/Console"],
    "Simulator/main.cxx": [FILTERS, "Formats", "Applications/Common", "Simulator/*"],
}


def folder_of(path):
    """The part of the project that a file is of: two names deep, but for Formats, Readers and Writers."""
    parts = path.split("/")
    return "/".join(parts[:2]) if parts[0] in ("Filters", "Applications", "Simulator") else parts[0]


def modules():
    """{folder: folders that its vtk.module names}."""
    names = {}
    texts = {}
    for path in glob.glob(os.path.join(ROOT, "Filters", "*", "vtk.module")) + [
            os.path.join(ROOT, name, "vtk.module") for name in ("Readers", "Writers")]:
        folder = os.path.relpath(os.path.dirname(path), ROOT)
        with open(path, encoding="utf-8") as file:
            texts[folder] = re.findall(r"DynamicCoronary::\w+", file.read())
        names[texts[folder][0]] = folder
    return {folder: [names[name] for name in found[1:]] for folder, found in texts.items()}


def main():
    sources = [os.path.relpath(path, ROOT) for top in ("Filters", "Formats", "Readers", "Writers", "Applications", "Simulator")
               for ending in ("h", "cxx") for path in glob.glob(os.path.join(ROOT, top, "**", "*." + ending), recursive=True)]
    where = collections.defaultdict(set)
    for path in sources:
        where[os.path.basename(path)].add(folder_of(path))
    allowed = modules()
    for folder, more in USES.items():
        allowed[folder] = allowed.get(folder, []) + more
    complaints = []
    for path in sorted(sources):
        folder = folder_of(path)
        with open(os.path.join(ROOT, path), encoding="utf-8") as file:
            includes = re.findall(r'^#include "([^"]+)"', file.read(), re.M)
        for include in includes:
            for other in where.get(os.path.basename(include), {folder}):
                uses = allowed.get(folder, [])
                may = other == folder or other in uses or other.split("/")[0] + "/*" in uses
                if not may and folder not in where[os.path.basename(include)]:
                    complaints.append("%s includes %s of %s" % (path, include, other))
    print("\n".join(complaints) if complaints else "ok: %d files include no header of a layer above" % len(sources))
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
