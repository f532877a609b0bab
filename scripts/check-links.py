#!/usr/bin/env python3
"""Whether relative links and pictures of all Markdown pages exist, with their anchors; pages that nothing links to;
pictures that no page shows; and whether CITATION.cff has what it needs. Exit code 1 when something is missing.
"""
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SKIPPED = {"build", "demo-output", "validation-output", ".git"}


def files_of_project():
    """Files that git knows, or all of a source archive."""
    try:
        names = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True,
                               capture_output=True, text=True).stdout.split("\n")
    except (OSError, subprocess.CalledProcessError):
        names = []
        for folder, folders, files in os.walk(ROOT):
            folders[:] = [name for name in folders if name not in SKIPPED]
            names += [os.path.relpath(os.path.join(folder, name), ROOT) for name in files]
    return sorted({name for name in names if name and os.path.exists(os.path.join(ROOT, name))})


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def without_code(text):
    """A page without code blocks and code in lines."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    return re.sub(r"`[^`\n]*`", "", text)


def anchors(text):
    """Anchors of the headings, as GitHub makes them."""
    found, counts = set(), {}
    for heading in re.findall(r"^#{1,6} +(.*?)\s*$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), re.M):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").replace("*", "")
        anchor = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        count = counts.get(anchor, 0)
        counts[anchor] = count + 1
        found.add("%s-%d" % (anchor, count) if count else anchor)
    return found


def check_links(pages, complaints):
    """Files and folders that the pages link to."""
    linked = set()
    for page in pages:
        for target in re.findall(r"\]\(([^)\s]+)\)", without_code(read(page))):
            if re.match(r"[a-z][a-z0-9+.-]*:", target):
                continue
            path, _, anchor = target.partition("#")
            path = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
            if not os.path.exists(os.path.join(ROOT, path)):
                complaints.append("%s: %s is not there" % (page, target))
                continue
            linked.add(path)
            if anchor and path.endswith(".md") and anchor not in anchors(read(path)):
                complaints.append("%s: %s has no such heading" % (page, target))
    return linked


def check_citation(complaints):
    """The keys that Citation File Format 1.2.0 demands, and the version of the build."""
    path = "CITATION.cff"
    if not os.path.exists(os.path.join(ROOT, path)):
        complaints.append("%s is not there" % path)
        return
    text = read(path)
    entries = dict(re.findall(r"^([a-z-]+): *(.*)$", text, re.M))
    for key in ("cff-version", "message", "title", "authors", "version", "license", "date-released"):
        if key not in entries:
            complaints.append("%s: no %s" % (path, key))
    if entries.get("cff-version") != "1.2.0":
        complaints.append("%s: cff-version is not 1.2.0" % path)
    if not re.fullmatch(r"\"?\d{4}-\d\d-\d\d\"?", entries.get("date-released", "")):
        complaints.append("%s: date-released is no date" % path)
    if not re.search(r"^authors:\n  - (name|family-names|given-names): \S", text, re.M):
        complaints.append("%s: authors is no list of names" % path)
    for number, line in enumerate(text.splitlines(), 1):
        if "\t" in line or not re.match(r"( *- )? *[\w-]+:( |$)|  +\S|#|\s*$|---$", line):
            complaints.append("%s:%d: no YAML of this form: %s" % (path, number, line))
    released = re.search(r"^## \[(\d+\.\d+\.\d+)\]", read("CHANGELOG.md"), re.M)
    if not released or released.group(1) != entries.get("version", "").strip('"'):
        complaints.append("%s: version %s is not the newest of CHANGELOG.md" % (path, entries.get("version")))


def main():
    files = files_of_project()
    pages = [name for name in files if name.endswith(".md")]
    complaints = []
    linked = check_links(pages, complaints)
    for name in files:
        if name.startswith("docs/") and name not in linked and name != "docs/README.md":
            complaints.append("%s: no page links to it" % name)
    check_citation(complaints)
    print("\n".join(complaints) if complaints else "ok: links of %d pages" % len(pages))
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
