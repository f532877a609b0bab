"""Pages of docs/reference/ that are made from tables in the sources: keys of JSON files with their ranges and defaults,
parameters of the population's motion, the simulator's axes and keys, bytes of recordings and of the device protocol.
scripts/make-filter-reference.py writes them."""
import os
import re
import struct
import zlib
from collections import namedtuple

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# function: names the beginning of its body; headers: where the structs are whose members it fills
Group = namedtuple("Group", "title text source functions headers")
SCENARIO = "Simulator/Session/Scenario.cxx"
GROUPS = [
    Group("Scanner", "A file of `--scanner` ([page](../scanner.md#presets-and-files)). Defaults: without a `preset`.",
          "Filters/Phantom/ScannerSettings.cxx", ["AllScannerNumbers()"],
          [("Filters/Phantom/ScannerSettings.h", "ScannerSettings")]),
    Group("Lesion of a phantom", "A lesion of a `--disease` file ([page](../phantom.md#disease)). Defaults are those of a "
          "plaque; other kinds have their own.", "Filters/Phantom/PhantomDisease.cxx", ["AllLesionNumbers()"],
          [("Filters/Phantom/PhantomDisease.h", "PhantomLesion")]),
    Group("Scenario: settings", "Member `settings` of a [scenario](../simulator-files.md#scenarios).", SCENARIO,
          ["NumbersOf(InterventionSettings& s)", "InterventionSettings SettingsOf("],
          [("Simulator/Physics/Intervention.h", "InterventionSettings")]),
    Group("Scenario: phantom", "Member `vessels.phantom` of a scenario; also `dominance` (right, left, balanced), and "
          "`ramus`, `chronic_occlusion` (true, false).", SCENARIO,
          ["NumbersOf(PhantomSettings& s)", "PhantomSettings PhantomOf("],
          [("Filters/Phantom/CoronaryPhantom.h", "PhantomSettings")]),
    Group("Scenario: contraction", "Member `vessels.motion` with the model `contraction`; also `twist_deg` (-28 to 28, "
          "default 5.7), `base_mm` and `apex_mm`.", SCENARIO, ["NumbersOf(ContractionSettings& s)"],
          [("Simulator/Vessels/ContractionMotion.h", "ContractionSettings")]),
    Group("Scenario: contrast", "Member `contrast` of a scenario; also `guide_lumen` (true, false).", SCENARIO,
          ["NumbersOf(ContrastSettings& s)", "ContrastSettings ContrastOf("],
          [("Simulator/Contrast/ContrastModel.h", "ContrastSettings"),
           ("Simulator/Contrast/CoronaryFlow.h", "CoronaryFlowSettings"),
           ("Simulator/Contrast/ContrastTracers.h", "ContrastTracerSettings"),
           ("Simulator/Contrast/AorticContrast.h", "AorticFlowSettings")]),
    Group("Scenario: breathing", "Member `imaging.breathing` of a scenario.", SCENARIO,
          ["NumbersOf(BreathingSettings& s)"], [("Simulator/Fluoroscopy/Breathing.h", "BreathingSettings")]),
    Group("Scenario: imaging", "Numbers of the member `imaging` of a scenario; also `exposure_control` and "
          "`heart_shadow_moves` (true, false); angles, places and rates are in "
          "[its text](../simulator-files.md#imaging-and-contrast-medium).", SCENARIO, ["ImagingSettings ImagingOf("],
          [("Simulator/Session/Scenario.h", "ImagingSettings"), ("Simulator/Fluoroscopy/CArm.h", "CArmPose")]),
]
NUMBER = r"-?[\d.]+(?:e-?\d+)?"


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def body(text, begin):
    """The function that begins with these words, up to the brace in the first column."""
    start = text.index(begin)
    return text[start:re.compile(r"\n\}(?: \})?;?\n").search(text, start).start()]


def members(path, struct_name):
    """{member: (default, meaning)} of a struct, by the comment behind a member or above it."""
    found, above = {}, []
    for line in re.sub(r"\n\s+(?=-?[\d.]+;)", " ", body(read(path), "struct %s\n" % struct_name)).splitlines():
        comment = re.match(r"\s*///(?!<)\s?(.*)", line)
        member = re.match(r"\s*[\w:]+ (\w+)(?: = ([^;]*)|\{[^}]*\})?;(?:\s*///< ?(.*))?$", line)
        if comment:
            above.append(comment.group(1))
        elif member:
            found[member.group(1)] = (member.group(2) or "", member.group(3) or " ".join(above))
            above = []
        elif re.match(r"\s*///< ", line) and found:
            last = list(found)[-1]
            found[last] = (found[last][0], found[last][1] + " " + line.split("///< ")[1])
        elif not line.strip() or "//" in line:
            above = []
    return found


def shown(number):
    """A number of C++ as a person writes it."""
    words = {"INT32_MAX": "2147483647", "pose.sourceToIsocentre + 50.0": "source_to_isocentre_mm + 50"}
    return "%.15g" % float(number) if re.fullmatch(NUMBER, number) else words[number]


def keys_of(group):
    """(key, low, high, default, meaning) of a group."""
    known = {}
    for path, name in group.headers:
        known.update(members(path, name))
    text = read(group.source)
    for begin in group.functions:
        part = body(text, begin)
        found = re.findall(r'\{\s*"(\w+)",\s*&(?:\w+::|s\.)([\w.]+),\s*(%s),\s*(%s)\s*\}' % (NUMBER, NUMBER), part)
        found += [(key, member, low, high) for key, low, high, member in re.findall(
            r'fields\.(?:Whole|Number)\(\s*"(\w+)",\s*([\w.+ -]+?),\s*([\w.-]+),\s*(?:static_cast<[\w:]+>\()?([\w.]+)\)', part)]
        for key, member, low, high in found:
            default, meaning = known[member.split(".")[-1]]
            # The range is a column of its own.
            meaning = re.sub(r"(?:^|, )-?[\d.,]+ to [\d.,]+$", "", meaning)
            yield key, low, high, default, meaning


def keys_page(complaints):
    """Keys of JSON files."""
    lines = ["# Keys of JSON files", "", "Numbers that files may set, with the unit in their names. Made from the sources "
             "by `scripts/make-filter-reference.py`. A number out of its range, and a key that is not known, is refused "
             "with the file and the place.", ""]
    for group in GROUPS:
        rows = list(keys_of(group))
        if not rows:
            complaints.append("%s: no keys in %s" % (group.source, group.functions))
        lines += ["## %s" % group.title, "", group.text, "", "| key | range | default | meaning |", "|---|---|---|---|"]
        for key, low, high, default, meaning in rows:
            if not meaning:
                complaints.append("%s: the member of '%s' has no comment" % (group.headers[0][0], key))
            lines.append("| `%s` | %s..%s | %s | %s |" % (key, shown(low), shown(high), shown(default) if default else "",
                                                         meaning.replace("|", "\\|")))
        lines.append("")
    return "\n".join(lines)


def cobs(data):
    """Consistent overhead byte stuffing, with the 0 that ends a frame."""
    out = bytearray()
    for index, block in enumerate(bytes(data).split(b"\0")):
        while len(block) >= 254:
            out += b"\xff" + block[:254]
            block = block[254:]
        out += bytes([len(block) + 1]) + block
    return bytes(out) + b"\0"


def frames_page():
    """Examples of the device protocol, encoded here once more."""
    lines = ["# Frames of the device protocol", "", "Examples of the [device protocol](../device-protocol.md), in hexadecimal: "
             "the frame with its CRC, and what goes over the wire. `scripts/make-filter-reference.py` encodes them by itself, "
             "and the test `UnitTestDeviceProtocol` compares them with the program's.", ""]
    examples = [
        ("HELLO, nonce 0x12345678, sequence 0, time 0", 1, 0, 0,
         struct.pack("<4sBBHI16s", b"PCID", 1, 1, 0, 0x12345678, b"DynamicCoronary")),
        ("START, 1000 Hz, watchdog 20 ms, sequence 1, 1 ms later", 4, 1, 1000, struct.pack("<HHI", 1000, 20, 0x12345678)),
        ("STATE of a device with two axes at 1000 and -3 counts, pedal of fluoroscopy, last heard of tick 7, sequence 9, "
         "time 9000 microseconds", 6, 9, 9000, struct.pack("<IHHHBB2i", 7, 1, 0, 0, 2, 0, 1000, -3)),
        ("HEARTBEAT of tick 7, sequence 5, time 5000", 8, 5, 5000, struct.pack("<I", 7)),
        ("FORCE of tick 8, good for 20 ms, -0.5 N on the wire, sequence 6, time 6000", 7, 6, 6000,
         struct.pack("<IHH4f", 8, 20, 0, -0.5, 0, 0, 0))]
    for title, kind, sequence, time, payload in examples:
        frame = struct.pack("<BBHI", kind, 0, sequence, time) + payload
        frame += struct.pack("<I", zlib.crc32(frame))
        lines += ["%s:" % title, "```", "frame: " + frame.hex(" "), "wire:  " + cobs(frame).hex(" "), "```", ""]
    return "\n".join(lines)


def population_page(complaints):
    """Parameters of the population's motion, with their sources."""
    text = body(read("Filters/Motion/PopulationMotion.cxx"), "PopulationParameters> Table")
    rows = re.findall(r'\{ "([^"]+)", (%s), (%s), "([^"]*)",\s*((?:"[^"]*"\s*)+)\}' % (NUMBER, NUMBER), text)
    if not rows:
        complaints.append("Filters/Motion/PopulationMotion.cxx: no parameters")
    lines = ["# Parameters of the population's motion", "", "In the order of `PopulationValues`, as [motion](../motion.md#population) "
             "uses them. Several studies: mean weighted by the inverse squares of the deviations. Values marked textbooks, "
             "Rogers, Carlsson, van Dalen and Weissler were not read in the source. Made from "
             "`Filters/Motion/PopulationMotion.cxx` by `scripts/make-filter-reference.py`.", "",
             "| | mean | deviation | unit | from |", "|---|---|---|---|---|"]
    for name, mean, deviation, unit, source in rows:
        source = "".join(re.findall(r'"([^"]*)"', source))
        lines.append("| %s | %s | %s | %s | %s |" % (name, shown(mean), shown(deviation), unit, source))
    return "\n".join(lines) + "\n"


def hands_page(complaints):
    """Axes of hands, with keys, limits and members of scripts."""
    text = body(read("Simulator/Hands/HandAxes.h"), "HandAxisTable{ {").replace("Anywhere", "inf").replace("\n", " ")
    rows = re.findall(r"\{ AxisKind::(\w+), AxisUnit::(\w+), (?:\w+), ([^{}]+?) \}", text)
    if not rows:
        complaints.append("Simulator/Hands/HandAxes.h: no axes")
    lines = ["# Keys and axes of the simulator", "", "What hands move, from `Simulator/Hands/HandAxes.h` by "
             "`scripts/make-filter-reference.py`: keys that move forward and back and their speed, the limits of the place, the "
             "tremble of hardware at rest, and the member of [scripts](../simulator-files.md#scripts-of-driving).", "",
             "| axis | keys | speed, 1/s | limits | tremble | script |", "|---|---|---|---|---|---|"]
    units = {"Millimetre": "mm", "Radian": "rad", "Millilitre": "mL", "Atmosphere": "atm"}
    names = {"next": "page down", "prior": "page up"}
    for kind, unit, rest in rows:
        cells = [cell.strip().strip('"') for cell in rest.split(",")]
        low, high, tremble, _, speed = [re.sub(r"\.0$", "", cell.replace(" * DegreeOfHands", "")) for cell in cells[:5]]
        limits = "" if "inf" in low else "%s..%s%s" % (low, high, " degrees" if "Degree" in cells[0] else "")
        keys = ", ".join("`%s`" % names.get(key, key) for key in cells[-2:])
        lines.append("| %s (%s) | %s | %s | %s | %s | `%s` |" % (
            " ".join(re.findall("[A-Z][a-z]*", kind)).lower(), units[unit], keys, speed, limits, tremble, cells[7]))
    return "\n".join(lines) + "\n"


def comment_pages():
    """Pages that stand in headers, as comments that begin with "@page name Title"."""
    found = {}
    for path in ("Simulator/Hands/Serial/DeviceProtocol.h", "Simulator/Session/Recording.h"):
        for name, title, text in re.findall(r"/\*\*\n \* @page ([\w-]+) ([^\n]*)\n(.*?) \*/", read(path), re.S):
            text = re.sub(r"^ \* ?", "", text, flags=re.M).strip()
            found[name + ".md"] = "# %s\n\n%s\n\n*Made from `%s` by `scripts/make-filter-reference.py`.*\n" % (title, text, path)
    return found


def pages(complaints):
    """{file: text} of all."""
    return {"keys.md": keys_page(complaints), "device-frames.md": frames_page(), "population.md": population_page(complaints),
            "hands.md": hands_page(complaints), **comment_pages()}
