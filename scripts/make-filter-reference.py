#!/usr/bin/env python3
"""Writes docs/reference/: a page for every filter, reader and writer, out of its header and its ParaView proxy, and those
of code_tables.py: keys of JSON files and other tables of the sources.

Usage: make-filter-reference.py [--check]
  --check  write nothing; exit code 1 when a page is not what headers and XML say, or when these leave
           something out. scripts/check-sources.sh asks for that.

From the header: purpose, ports, arrays, time, failure, sources, setters with their meaning, an example in Python. From
ServerManagerXML/: labels, Python names, defaults, ranges. Mend these, never the pages.
"""
import glob
import os
import re
import sys
import xml.etree.ElementTree as ElementTree
from collections import namedtuple

import code_tables

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
OUTPUT = "docs/reference"
# In the order of the road; what is not named here comes after it.
STAGES = [("Filters/Phantom", "Phantom"), ("Readers", "Readers"), ("Filters/Common", "Phases"),
          ("Filters/Vesselness", "Vesselness and segmentation"), ("Filters/Centerline", "Centerlines"),
          ("Filters/Surface", "Surface"), ("Filters/Volume", "Volume"), ("Filters/Skinning", "Skeleton and weights"),
          ("Filters/Motion", "Motion"), ("Filters/Metrics", "Metrics"), ("Writers", "Writers")]
INHERITED = ("SetInputArrayToProcess",)
EXAMPLE_BEGINS = ["from paraview.simple import *", ""]
TIMES = ("TimestepValues", "TimeRange")
UNIT = re.compile(
    r"(?<![\w`'])(mm\^3|mm\^2|mm/s|1/mm|mm|HU per cm|HU|ms|[Ss]econds|s|degrees|radians|MPa|percent|voxels"
    r"|fractions? of (?:the )?(?:R-R|cardiac|cycle)|R-R fractions?)(?![\w^`])")
UNIT_NAMES = {"seconds": "s", "Seconds": "s", "percent": "%"}
TYPE = re.compile(r"(?:un)?(?:signed )?(?:int|double|float|string|char|short|vtkIdType|all int)\b")

# sections: {title: [lines]}, "" is the text before the first one
Header = namedtuple("Header", "name folder brief sections related members initial enumerators")
# A group of setters with one docstring
Member = namedtuple("Member", "text setters")
Property = namedtuple("Property", "element label python command default allowed meaning visibility")
Proxy = namedtuple("Proxy", "group label python menu inputs outputs properties file")


def words(text):
    """The text on one line."""
    return " ".join((text or "").split())


def spaced(text):
    """With an empty line between a list and the paragraphs around it, as Markdown wants it."""
    text = re.sub(r"(?m)^([-\d ] .*)\n(?=[A-Z])", r"\1\n\n", text)
    return re.sub(r"(?m)^([^-\s|].*)\n(?=- )", r"\1\n\n", text)


def python_name(label):
    """What paraview.make_name_valid makes of a label."""
    name = re.sub(r"\W", "", label, flags=re.ASCII)
    return name if name[:1].isalpha() else "a" + name


# ---- Headers ------------------------------------------------------------------------------------------


def comment_text(comment):
    """The lines of a documentation comment without its stars, strokes and empty ends."""
    lines = []
    for line in comment.splitlines():
        line = re.sub(r"^\s*(/\*\*<?|\*/|\*(?!/)|///<?)? ?", "", line.rstrip())
        lines.append(line.replace("*/", "").rstrip())
    return "\n".join(lines).strip("\n")


def parse_sections(comment):
    """Brief, sections and related names of a class comment."""
    brief, related, sections, title = "", "", {"": []}, ""
    lines = comment_text(comment).splitlines()
    index = 0
    while index < len(lines):
        line = lines[index]
        tag = re.match(r"@(class|brief|sa|par)\s+(.*)", line)
        if not tag:
            sections[title].append(line)
        elif tag.group(1) == "par":
            title = tag.group(2).strip().rstrip(":")
            sections[title] = []
        elif tag.group(1) in ("brief", "sa"):
            text = tag.group(2)
            while index + 1 < len(lines) and lines[index + 1].strip() and not lines[index + 1].startswith("@"):
                index += 1
                text += " " + lines[index].strip()
            if tag.group(1) == "brief":
                brief = words(text)
            else:
                related = words(text)
        index += 1
    return brief, {key: "\n".join(value).strip("\n") for key, value in sections.items()}, related


def setters_of(code):
    """Names and arguments of what a declaration sets: ("SetAlpha", "double")."""
    found = []
    for macro in re.finditer(r"vtkSet(\w*?)Macro\(\s*(\w+)(?:\s*,\s*([^;]*?))?\)\s*;", code):
        kind, name, rest = macro.groups()
        parts = [part.strip() for part in (rest or "").split(",")]
        if "String" in kind or "FilePath" in kind:
            arguments = "const char*"
        elif kind.startswith("Vector"):
            count = int(kind[6:] or parts[1])
            arguments = "%s[%d]" % (parts[0], count)
        else:
            arguments = parts[0]
        found.append(("Set" + name, arguments))
    for function in re.finditer(r"\bvoid ((?:Set|Add|Remove|Clear)\w+)\(([^)]*)\)", code):
        name, arguments = function.groups()
        if name.startswith("Set") and re.search(r"Set\w+To[A-Z]\w*$", name) and not arguments:
            continue  # SetMethodToFrangi: another way to say SetMethod
        found.append((name, ", ".join(re.sub(r"\s*=.*", "", part).strip() for part in arguments.split(","))))
    for function in re.finditer(r"\b(vtk\w+\*|double|int|bool|vtkIdType) (Get\w+)\(\)", code):
        found.append((function.group(2), None))
    for macro in re.finditer(r"vtkGet(?!CharFrom)\w*Macro\(\s*(\w+)", code):
        if "vtkSet" not in code:
            found.append(("Get" + macro.group(1), None))
    unique = []
    for entry in found:
        if entry[0] not in [name for name, _ in unique]:
            unique.append(entry)
    return unique


def public_part(text, name):
    """The public declarations of a class, and all of its text."""
    start = re.search(r"class \w+_EXPORT %s\b[^{;]*\{" % name, text).end()
    body = text[start:text.index("\n};", start)]
    parts = re.split(r"^(public|protected|private):$", body, flags=re.M)
    return "\n".join(parts[index + 1] for index in range(1, len(parts) - 1, 2) if parts[index] == "public"), body


def parse_members(public):
    """Groups of setters with their docstrings."""
    members = []
    comment = r"(?:^[ \t]*/\*\*(?:.|\n)*?\*/\n|(?:^[ \t]*///(?!@).*\n)+)"
    group = re.compile(r"^[ \t]*///@\{\n((?:.|\n)*?)^[ \t]*///@\}|(%s)((?:^.*\S.*\n)*)" % comment, re.M)
    for match in group.finditer(public + "\n"):
        inner = match.group(1)
        if inner is not None:
            texts = [comment_text(text.group(0)) for text in re.finditer(comment, inner, re.M)]
            code = re.sub(comment, "", inner, flags=re.M)
            members.append(Member(words(texts[0]) if texts else "", setters_of(code)))
        else:
            members.append(Member(words(comment_text(match.group(2))), setters_of(match.group(3))))
    return [member for member in members if member.setters]


def parse_header(path):
    """The class of a header, or None for one without @class."""
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        text = file.read()
    comment = re.match(r"/\*\*(?:.|\n)*?\*/", text)
    if not comment or "@class" not in comment.group(0):
        return None
    name = os.path.basename(path)[:-2]
    brief, sections, related = parse_sections(comment.group(0))
    public, body = public_part(text, name)
    initial = dict(re.findall(r"^  [\w:]+ (\w+) = ([^;{]+);", body, re.M))
    enumerators = dict(re.findall(r"^    (\w+) = (\d+)", body, re.M))
    return Header(name, os.path.dirname(path), brief, sections, related, parse_members(public), initial, enumerators)


# ---- Proxies ------------------------------------------------------------------------------------------


def number(text):
    """A number as people write it: 67108864, 1e-06."""
    try:
        return "%.9g" % float(text)
    except (TypeError, ValueError):
        return text


def range_text(element):
    """What a domain allows, as text."""
    for domain in element:
        if domain.tag == "BooleanDomain":
            return "on, off"
        if domain.tag == "EnumerationDomain":
            return ", ".join("%s (%s)" % (entry.get("text"), entry.get("value")) for entry in domain.findall("Entry"))
        if domain.tag in ("DoubleRangeDomain", "IntRangeDomain"):
            least, greatest = domain.get("min"), domain.get("max")
            limits = ["%s to %s" % (number(a), number(b)) for a, b in zip((least or "").split(), (greatest or "").split())]
            if limits:
                return limits[0] if len(set(limits)) == 1 else "; ".join(limits)
            if least:
                return "from %s on" % number(least.split()[0])
            if greatest:
                return "up to %s" % number(greatest.split()[0])
        if domain.tag == "ArrayListDomain":
            return "array of the input"
        if domain.tag == "FileListDomain":
            return "file"
        if domain.tag == "ExtentDomain":
            return "extent of the input"
    return ""


def default_text(element):
    """The default of a property, as text."""
    value = element.get("default_values")
    if value is None or value == "none":
        return ""
    if element.get("default_values_delimiter"):
        # What SetInputArrayToProcess takes: the name of the array is the last of five.
        return "`%s`" % value.split(element.get("default_values_delimiter"))[-1]
    if len(value.split()) > 9:
        return "%d values, %s to %s" % (len(value.split()), number(value.split()[0]), number(value.split()[-1]))
    if element.find("BooleanDomain") is not None:
        return "on" if value == "1" else "off"
    for entry in element.iter("Entry"):
        if entry.get("value") == value:
            return entry.get("text")
    return " ".join(number(part) for part in value.split()) if not value[:1].isalpha() else "`%s`" % value


def parse_property(element):
    """A property of a proxy."""
    label = element.get("label") or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", element.get("name"))
    command = element.get("command") or ""
    if element.get("repeat_command") == "1" or command.startswith("Add"):
        allowed = ", ".join(filter(None, ["list", range_text(element)]))
    else:
        allowed = range_text(element)
    return Property(element, label, python_name(label), command, default_text(element), allowed,
                    words(element.findtext("Documentation")), element.get("panel_visibility", "default"))


def parse_proxies():
    """{class: [proxies]} of all of ServerManagerXML/."""
    proxies = {}
    for path in sorted(glob.glob(os.path.join(ROOT, "ServerManagerXML", "*.xml"))):
        for group in ElementTree.parse(path).getroot().iter("ProxyGroup"):
            for element in group:
                name = element.get("class")
                if not name:
                    continue
                inputs = [entry for entry in element.findall("InputProperty")]
                properties = [parse_property(entry) for entry in element
                              if entry.tag.endswith("VectorProperty") and entry.get("name") not in TIMES
                              and entry.get("command")]
                menu = element.find("Hints/ShowInMenu")
                label = element.get("label") or element.get("name")
                proxies.setdefault(name, []).append(Proxy(
                    group.get("name"), label, python_name(label), menu.get("category") if menu is not None else "",
                    [(entry.get("port_index", "0"), entry.get("label") or entry.get("name")) for entry in inputs],
                    [port.get("name") for port in element.findall("OutputPort")], properties,
                    os.path.basename(path)))
    return proxies


# ---- Arrays -------------------------------------------------------------------------------------------


def parse_arrays(title, text):
    """Rows (port, place, array, type and unit) out of the text of a section on ports.

    `A`, `B` (double, mm): both are; `A`, `B` (mm): B is in mm; (double, mm): `A`, `B`: both are;
    `A`, `B` (-1 at a root; all int): both are int.
    """
    single = re.search(r"port (\d)", title)
    port, place, before = single.group(1) if single else "0", "", ""
    rows, waiting = [], []
    pattern = re.compile(
        r"^- (?:port )?(?P<port>\d)\b|(?P<paragraph>\n\n(?=[A-Z]))|(?P<place>[Pp]oint\s+(?:data|array)|[Cc]ell\s+(?:data|array)|[Ff]ield\s+data|Columns)"
        r"|`(?P<name>\w+)`|\((?P<type>[^()]*(?:\([^()]*\)[^()]*)*)\)(?P<colon>:?)|(?P<end>[.;](?=\s|$))", re.M)
    for match in pattern.finditer(spaced(text)):
        if match.group("port"):
            port, place, waiting, before = match.group("port"), "", [], ""
        elif match.group("paragraph"):
            port, place, waiting, before = "all" if re.search(r"^- \d", text, re.M) else port, "", [], ""
        elif match.group("place"):
            word = match.group("place").split()[0].lower()
            place, waiting, before = {"columns": "column"}.get(word, word), [], ""
        elif match.group("name"):
            if place and not match.group("name").endswith("ArrayName"):
                rows.append([port, place, match.group("name"), before])
                waiting.append(rows[-1])
        elif match.group("type"):
            kind = words(match.group("type"))
            everything = re.search(r"[,;]? ?\ball (int|double)$", kind)
            if match.group("colon") and not waiting and TYPE.match(kind):
                before = kind
            elif everything:
                kind = kind[:everything.start()]
                for row in rows:
                    if row[0] == port and row[1] == place and not TYPE.match(row[3]):
                        row[3] = ", ".join(filter(None, [everything.group(1), kind if row in waiting else row[3]]))
            else:
                for row in waiting if TYPE.match(kind) else waiting[-1:]:
                    row[3] = kind if TYPE.match(kind) or not row[3] else row[3] + ", " + kind
            waiting = waiting if not (TYPE.match(kind) or everything or before) else []
        elif match.group("end"):
            waiting = []
            before = "" if match.group("end") == "." else before
    unique = []
    for row in rows:
        if row[:3] not in [other[:3] for other in unique]:
            unique.append(row)
    return unique


# ---- Pages --------------------------------------------------------------------------------------------


class Pages:
    """All pages, and what is wrong with their sources."""

    def __init__(self):
        paths = [path for pattern in ("Filters/*/vtk*.h", "Readers/vtk*.h", "Writers/vtk*.h")
                 for path in sorted(glob.glob(os.path.join(ROOT, pattern)))]
        headers = [parse_header(os.path.relpath(path, ROOT)) for path in paths]
        self.headers = {header.name: header for header in headers if header}
        self.proxies = parse_proxies()
        self.complaints = []
        self.files = {}
        self.arrays = {}
        for name in sorted(self.headers):
            self.files["%s.md" % name] = self.page(self.headers[name])
        self.files["README.md"] = self.index()
        self.files["arrays.md"] = self.array_index()
        self.files.update(code_tables.pages(self.complaints))

    def complain(self, header, text):
        self.complaints.append("%s/%s.h: %s" % (header.folder, header.name, text))

    def prose(self, text, own=""):
        """Text of a docstring as Markdown, with links."""
        def link(match):
            word = match.group(0)
            if word.startswith("`"):
                return word
            if word.startswith("docs/"):
                return "[%s](../%s)" % (word[5:], word[5:])
            if word.startswith("coronary::"):
                return "`%s`" % word
            if word in self.headers and word != own:
                return "[%s](%s.md)" % (word, word)
            return "`%s`" % word
        text = re.sub(r"`[^`]*`|docs/[\w-]+\.md|coronary::\w+|\bvtk[A-Z]\w+", link, text)
        return re.sub(r"<(?=[A-Za-z/])", "&lt;", spaced(text))

    def cell(self, text, own=""):
        return words(self.prose(text, own)).replace("|", "\\|")

    def page(self, header):
        """The page of a class."""
        name, sections = header.name, dict(header.sections)
        proxies = self.proxies.get(name, [])
        lines = ["# %s" % name, "", self.prose(header.brief, name), ""]
        lines += self.where(header, proxies)
        if sections.pop("", ""):
            lines += [self.prose(header.sections[""], name), ""]
        self.require(header)
        shown = set()
        for wanted in ("Input", "Output", "Files"):
            for title in list(sections):
                if title.startswith(wanted):
                    lines += ["## %s" % self.port_title(title), "", self.ports(title, sections[title], proxies, name), ""]
                    shown.add(title)
        lines += self.array_table(header)
        for title in list(sections):
            if title not in shown and not title.startswith(("Time", "Failure", "Source", "Python")):
                lines += ["## %s" % title, "", self.prose(sections[title], name), ""]
        for proxy in proxies:
            lines += self.property_table(header, proxy, len(proxies) > 1)
        lines += self.example(header, proxies)
        lines += self.setters(header)
        for title, heading in (("Time", "Time"), ("Failure", "Errors"), ("Source", "Sources")):
            for key in sections:
                if key.startswith(title):
                    lines += ["## %s" % heading, "", self.prose(sections[key], name), ""]
        if header.related:
            lines += ["See also: " + self.prose(header.related, name) + ".", ""]
        lines += ["*Made from `%s/%s.h`%s by `scripts/make-filter-reference.py`.*" % (
            header.folder, name, "".join(" and `ServerManagerXML/%s`" % file
                                         for file in sorted({proxy.file for proxy in proxies})))]
        return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)) + "\n"

    @staticmethod
    def port_title(title):
        return re.sub(r"^(Input|Output)s?( ports?)?( \d.*)?$", lambda match: match.group(1) + "s"
                      if not match.group(3) else match.group(0), title)

    @staticmethod
    def where(header, proxies):
        """How the class is reached."""
        rows = ["| in | as |", "|---|---|", "| C++ | `#include <DynamicCoronary/%s.h>`, module `%s` |" % (
            header.name, "DynamicCoronary::Coronary" + header.folder.split("/")[-1])]
        rows.append("| [Python](../python.md) | `from dynamiccoronary import %s` |" % header.name)
        for proxy in proxies:
            if proxy.group == "writers":
                rows.append("| ParaView | *%s*: *File > Save Data*; `SaveData` in Python |" % proxy.label)
            else:
                menu = "%s > %s > %s" % (proxy.group.capitalize(), proxy.menu, proxy.label) if proxy.menu else \
                    "File > Open: %s" % proxy.label
                rows.append("| ParaView | *%s*, `%s()` in Python |" % (menu, proxy.python))
        return rows + [""]

    def require(self, header):
        """What no docstring may leave out."""
        titles = " ".join(header.sections)
        writer = header.folder == "Writers"
        for wanted in (("Input",) if writer else ("Output",)) + ("Time", "Failure"):
            if not re.search(r"\b%s" % wanted, titles):
                self.complain(header, "no '@par %s:'" % wanted)
        if not header.brief:
            self.complain(header, "no @brief")
        for member in header.members:
            if len(member.text) < 5 and any(arguments for _, arguments in member.setters):
                self.complain(header, "no docstring for %s" % member.setters[0][0])

    def example(self, header, proxies):
        """Lines of Python as they are typed; the test ReferenceExamples runs them."""
        code = re.search(r"@code\{\.py\}\n(.*?)\n@endcode", header.sections.get("Python", ""), re.S)
        if not proxies:
            return []
        if not code:
            self.complain(header, "no example: '@par Python:' with @code{.py}")
            return []
        lines = ["## In Python", ""]
        file = re.search(r'FileNames?=\[?"([^"]+)"', code.group(1))
        if file:
            lines += ["`%s` is a file of your own." % file.group(1), ""]
        return lines + ["```python"] + EXAMPLE_BEGINS + [code.group(1), "```", ""]

    def ports(self, title, text, proxies, own):
        """The text on ports, with the names that ParaView has for them."""
        names = {}
        for proxy in proxies[:1]:
            if title.startswith("Input"):
                names = dict(proxy.inputs)
            elif title.startswith("Output"):
                names = {str(index): port for index, port in enumerate(proxy.outputs)}
        lead = r"^- (\d)(, (?:optional)|)(?=[,:])"
        text = self.prose(text, own)
        text = re.sub(r"^(\d)(?=[,:])", r"- \1", text)
        return re.sub(lead, lambda match: "- **%s%s**%s" % (
            match.group(1), " (%s)" % names[match.group(1)] if match.group(1) in names else "", match.group(2)),
            text, flags=re.M)

    def array_table(self, header):
        """Arrays in and out."""
        rows = []
        for title, text in header.sections.items():
            if not title.startswith(("Input", "Output")):
                continue
            direction = "in" if title.startswith("Input") else "out"
            for port, place, array, kind in parse_arrays(title, text):
                start = "| %s&nbsp;%s | %s |" % (direction, port, place)
                end = "| %s |" % self.cell(kind, header.name)
                if rows and rows[-1][0] == start and rows[-1][2] == end:
                    rows[-1][1] += ", `%s`" % array
                else:
                    rows.append([start, "`%s`" % array, end])
                self.arrays.setdefault(array, []).append((header.name, direction, place, kind))
        if not rows:
            return []
        return ["### Arrays", "", "| port | on | arrays | type, unit, meaning |", "|---|---|---|---|"] \
            + [" ".join(row) for row in rows] + [""]

    def unit(self, header, prop):
        """The unit that the proxy's or the header's sentence names; pipeline time is in fractions of R-R."""
        if "Enumeration" in "".join(child.tag for child in prop.element) or "on, off" in prop.allowed:
            return ""
        if prop.element.tag.startswith(("Int", "Id")):
            return "voxels" if "voxels" in prop.meaning or prop.label == "Region" else ""
        if not prop.element.tag.startswith("Double"):
            return ""
        unit = self.named_unit(header, prop)
        return "R-R" if not unit and re.search(r"Time|Steps|Range$|^Phases$", prop.label) else unit

    def named_unit(self, header, prop):
        """The unit that a sentence names."""
        for text in (prop.label + ". " + prop.meaning, self.setter_text(header, prop.command)):
            found = []
            for unit in UNIT.findall(text):
                unit = "R-R" if "fraction" in unit else UNIT_NAMES.get(unit, unit)
                if unit not in found:
                    found.append(unit)
            if len(found) == 1:
                return found[0]
            if found:
                return found[0] if text.startswith(prop.label) else ""
        return ""

    @staticmethod
    def setter_text(header, command):
        for member in header.members:
            if command in [name for name, _ in member.setters]:
                return member.text
        return ""

    def property_table(self, header, proxy, named):
        """Properties of a proxy, names of arrays at the end."""
        rows, names = [], []
        for prop in proxy.properties:
            if prop.element.get("information_only") == "1":
                continue
            self.compare_default(header, prop)
            if prop.command not in INHERITED and not self.setter_text(header, prop.command):
                self.complain(header, "no documented %s, which ServerManagerXML/%s calls" % (prop.command, proxy.file))
            label = prop.label + {"advanced": " *(advanced)*", "never": " *(hidden)*"}.get(prop.visibility, "")
            start = "| %s | `%s` | `%s` | %s |" % (label, prop.python, prop.command, self.cell(prop.default))
            meaning = self.cell(prop.meaning, header.name)
            if prop.label.endswith("Array Name"):
                names.append("%s %s |" % (start, meaning))
            else:
                rows.append("%s %s | %s | %s |" % (start, self.cell(prop.allowed), self.unit(header, prop), meaning))
        lines = []
        if rows:
            lines += ["## Properties%s" % (" of %s" % proxy.label if named else ""), "",
                      "| ParaView | Python | C++ | default | range | unit | meaning |",
                      "|---|---|---|---|---|---|---|"] + rows + [""]
        if names:
            lines += ["### Names of arrays", "", "| ParaView | Python | C++ | default | meaning |",
                      "|---|---|---|---|---|"] + names + [""]
        return lines

    def compare_default(self, header, prop):
        """The default in ParaView is the class's."""
        name = re.sub(r"^Set", "", prop.command)
        given, value = prop.element.get("default_values"), header.initial.get(name)
        if given is None or value is None or len(given.split()) != 1:
            return
        value = header.enumerators.get(value, {"true": "1", "false": "0"}.get(value, value.strip('"')))
        if re.fullmatch(r"[-+.\deE]+", value) and number(value) != number(given):
            self.complain(header, "%s is %s here and %s in ServerManagerXML/" % (name, value, given))

    def setters(self, header):
        """Setters and getters in C++, group by group."""
        rows = []
        for member in header.members:
            names = ["`%s(%s)`" % (name, arguments or "") for name, arguments in member.setters]
            rows.append("| %s | %s |" % ("<br>".join(names), self.cell(member.text, header.name)))
        if not rows:
            return []
        return ["## In C++", "", "| functions | meaning |", "|---|---|"] + rows + [""]

    def index(self):
        """The list of all classes."""
        lines = ["# Reference of filters, readers and writers", "",
                 "One page a class, made from its header and its ParaView proxy by `scripts/make-filter-reference.py`:",
                 "ports, arrays, properties with their names in ParaView, Python and C++, time, errors. R-R as a unit is the",
                 "fraction of the R-R interval; a number without a unit is a count, a share or a ratio. What each array is,",
                 "and who makes and takes it: [arrays](arrays.md). Keys of JSON files: [keys](keys.md); device protocol: "
                 "[messages](device-messages.md), [frames](device-frames.md); [recordings](recordings.md); [parameters of the population's motion](population.md); "
                 "[keys of the simulator](hands.md). Coordinates: [coordinates and units]"
                 "(../coordinates-and-units.md). The examples are for `pvpython` and the Python shell of ParaView, with "
                 "[the plugin](../paraview.md#the-plugin).", ""]
        folders = [folder for folder, _ in STAGES]
        folders += sorted({header.folder for header in self.headers.values()} - set(folders))
        for folder in folders:
            members = [header for _, header in sorted(self.headers.items()) if header.folder == folder]
            if not members:
                continue
            lines += ["## %s" % dict(STAGES).get(folder, folder.split("/")[-1]), "",
                      "| class | in ParaView | what |", "|---|---|---|"]
            for header in members:
                labels = ", ".join(proxy.label for proxy in self.proxies.get(header.name, []))
                lines.append("| [%s](%s.md) | %s | %s |" % (header.name, header.name, labels or "C++ only",
                                                           self.cell(header.brief)))
            lines.append("")
        return "\n".join(lines).rstrip() + "\n"

    def array_index(self):
        """Every array with who makes and who takes it."""
        lines = ["# Arrays", "", "Names that the [filters](README.md) give to arrays: who makes and who takes them.",
                 "Types and units as the first of the makers says. Names are properties where the page of the filter says so.",
                 "", "| array | on | type, unit, meaning | made by | taken by |", "|---|---|---|---|---|"]
        for array in sorted(self.arrays, key=str.lower):
            uses = self.arrays[array]
            makers = sorted({name for name, direction, _, _ in uses if direction == "out"})
            takers = sorted({name for name, direction, _, _ in uses if direction == "in"})
            places = sorted({place for _, _, place, _ in uses})
            kinds = [kind for _, direction, _, kind in uses if kind and direction == "out"] + \
                [kind for _, _, _, kind in uses if kind]
            lines.append("| `%s` | %s | %s | %s | %s |" % (
                array, ", ".join(places), self.cell(kinds[0]) if kinds else "",
                *(", ".join("[%s](%s.md)" % (name[3:], name) for name in names) for names in (makers, takers))))
        return "\n".join(lines) + "\n"


def main(arguments):
    if arguments not in ([], ["--check"]):
        sys.stderr.write(__doc__)
        return 2
    pages = Pages()
    folder = os.path.join(ROOT, OUTPUT)
    complaints = list(pages.complaints)
    older = {os.path.basename(path) for path in glob.glob(os.path.join(folder, "*.md"))}
    if arguments:
        for name, text in pages.files.items():
            path = os.path.join(folder, name)
            content = open(path, encoding="utf-8").read() if name in older else None
            if content != text:
                complaints.append("%s/%s is not what headers and XML say" % (OUTPUT, name))
        complaints += ["%s/%s belongs to no class" % (OUTPUT, name) for name in sorted(older - set(pages.files))]
        if any(OUTPUT in text for text in complaints):
            complaints.append("write them anew with scripts/make-filter-reference.py")
    else:
        os.makedirs(folder, exist_ok=True)
        for name, text in pages.files.items():
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(text)
        for name in older - set(pages.files):
            os.remove(os.path.join(folder, name))
    print("\n".join(complaints) if complaints else "ok: %d pages of reference" % len(pages.files))
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
