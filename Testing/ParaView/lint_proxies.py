"""Every proxy of the plugin: documentation, help pages, menu, icons, labels, domains, groups, decorators, ports."""
import base64
import glob
import html
import os
import re
import sqlite3
import sys
import zlib
import xml.etree.ElementTree as ElementTree

from paraview import make_name_valid, servermanager, simple

from coronary_testing import load_plugin

plugin, folder, resources = sys.argv[1:4]
help_file = sys.argv[4] if len(sys.argv) > 4 else ""
complaints = []
MENU_GROUPS = ("sources", "filters", "writers")
# What the help of a number has to have a word of: its unit, or what it is a number of.
UNITS = re.compile(r"mm|HU|MPa|second|degree|fraction|share|factor|relative|ratio|radi[ui]|time|part|voxel|standard "
                   r"dev|weight|power|unit|confidence|0 to 1|0 is|0:|per |cycle|axes|curvature|speed|%|length|LPS",
                   re.IGNORECASE)
# Proxies with more settings than this need groups.
UNGROUPED = 6


def lint_default(where, prop, domain):
    # Not prop.IsInDomains(): ParaView 5.11 takes the greatest value for the smallest.
    if not hasattr(domain, "GetMinimum"):
        return
    for index in range(prop.GetNumberOfElements()):
        value = prop.GetElement(index)
        if ((domain.GetMinimumExists(index) and value < domain.GetMinimum(index)) or
                (domain.GetMaximumExists(index) and value > domain.GetMaximum(index))):
            complaints.append("%s: the default %s is outside its domain" % (where, value))


def lint_property(name, key, prop):
    where = "%s, property %s" % (name, key)
    visibility = prop.GetPanelVisibility()
    if visibility not in ("default", "advanced", "never"):
        complaints.append("%s: panel_visibility '%s'" % (where, visibility))
    if prop.GetInformationOnly():
        return
    documentation = prop.GetDocumentation()
    text = (documentation.GetDescription() or "").strip() if documentation else ""
    if visibility != "never" and len(text) < 10:
        complaints.append("%s: no documentation" % where)
    domains = prop.NewDomainIterator()
    domains.Begin()
    if prop.IsA("vtkSMVectorProperty") and not prop.IsA("vtkSMStringVectorProperty"):
        if domains.IsAtEnd():
            complaints.append("%s: no domain" % where)
        else:
            lint_default(where, prop, domains.GetDomain())


def decorators(setting):
    """Names of the properties on which it depends whether a setting is shown."""
    return [d.get("property") for d in setting.iter("PropertyWidgetDecorator") if d.get("property")]


def lint_setting(where, setting, settings):
    """A property that the panel shows, from its XML."""
    advanced = setting.get("panel_visibility") == "advanced"
    name = setting.get("name")
    domains = {child.tag for child in setting if child.tag.endswith("Domain")}
    text = " ".join((setting.findtext("Documentation") or "").split()) + setting.get("label")
    if setting.tag == "DoubleVectorProperty" and not UNITS.search(text):
        complaints.append("%s: the help tells no unit" % where)
    if name.endswith("ArrayName") and "ArrayListDomain" not in domains and not advanced:
        complaints.append("%s: the name of an array is advanced, or chosen from the input's" % where)
    if setting.get("number_of_elements_per_command") == "3" and setting.get("panel_widget") != "CoronarySeedPoints":
        complaints.append("%s: points are picked with the widget CoronarySeedPoints" % where)
    if "Automatic" + name in settings and "Automatic" + name not in decorators(setting):
        complaints.append("%s: to be shown when Automatic%s is off" % (where, name))
    for other in decorators(setting):
        if other not in settings:
            complaints.append("%s: its decorator asks for %s, which is not there" % (where, other))


def lint_input(where, port):
    if port.find("Hints/SelectionInput") is not None:
        complaints.append("%s: SelectionInput shows a copied selection, not a choice of sources" % where)
    if port.find("Hints/Optional") is not None and (
            port.get("panel_widget") != "input_selector" or port.get("null_on_empty") != "1"):
        complaints.append("%s: an optional input is chosen in the panel, and can be none" % where)


def lint_panel(name, element):
    """What the panel shows: settings, groups, inputs."""
    settings = {p.get("name"): p for p in element
                if p.tag.endswith("VectorProperty") and p.get("information_only") != "1"}
    grouped = [p.get("name") for g in element.findall("PropertyGroup") for p in g.findall("Property")]
    inputs = {p.get("name"): p for p in element.findall("InputProperty")}
    shown = [p.get("name") for p in element if p.get("information_only") == "1" and p.get("panel_visibility")]
    for key in grouped:
        if key not in settings and key not in inputs and key not in shown or grouped.count(key) > 1:
            complaints.append("%s: the group's %s is not there, or twice" % (name, key))
    if len(settings) > UNGROUPED and element.tag == "SourceProxy":
        loose = [key for key in settings if key.endswith("ArrayName") and key not in grouped
                 and settings[key].find("ArrayListDomain") is None]
        if loose or not grouped:
            complaints.append("%s: %d settings, without a group: %s" % (name, len(settings), loose))
    for key, setting in settings.items():
        if setting.get("panel_visibility") != "never":
            lint_setting("%s, property %s" % (name, key), setting, settings)
    if element.tag == "SourceProxy":
        for key, port in inputs.items():
            lint_input("%s, input %s" % (name, key), port)
    times = {p.get("name") for p in element.iter() if p.get("name") in ("TimestepValues", "TimeRange")}
    if len(times) == 1:
        complaints.append("%s: TimestepValues and TimeRange belong together" % name)
    if inputs and element.tag == "SourceProxy" and element.find("Hints/Visibility") is None:
        complaints.append("%s: no hint whether the output replaces the input in the view" % name)


def lint_icons(elements):
    """Every proxy in a menu has an icon, every icon a proxy."""
    prefix = ":/DynamicCoronary/"
    root = ElementTree.parse(os.path.join(resources, "DynamicCoronary.qrc")).getroot()
    there = {file.text for file in root.iter("file")}
    used = set()
    for name, menu in ((e.get("name"), e.find("Hints/ShowInMenu")) for e in elements):
        icon = (menu.get("icon") or "") if menu is not None else None
        if icon is not None and (not icon.startswith(prefix) or icon[len(prefix):] not in there):
            complaints.append("%s: its icon '%s' is not in the plugin" % (name, icon))
        used.add(icon and icon[len(prefix):])
    for file in there:
        if file not in used or not os.path.exists(os.path.join(resources, file)):
            complaints.append("icon %s: no proxy has it, or there is no such file" % file)


def lint_help(proxies):
    """The compiled help, which the plugin has in it, has a page for every proxy with all that the panel shows."""
    with open(help_file, "rb") as file:
        compiled = base64.b64encode(file.read())
    with open(plugin, "rb") as file:
        # From the middle, where it is not the same in every help file.
        middle = len(compiled) // 2
        if compiled[middle:middle + 400] not in file.read():
            complaints.append("%s is not in the plugin" % help_file)
    pages = {}
    database = sqlite3.connect(help_file)
    for page, data in database.execute("SELECT n.Name, d.Data FROM FileNameTable n, FileDataTable d "
                                       "WHERE n.FileId = d.Id AND d.Data IS NOT NULL"):
        # Four bytes of the length, then zlib.
        pages[page] = html.unescape(zlib.decompress(data[4:]).decode("utf-8", "replace"))
    for group, element in proxies:
        name = element.get("name")
        page = pages.get("%s.%s.html" % (group, name))
        if page is None:
            complaints.append("%s: no page in the help" % name)
            continue
        text = " ".join(re.sub("<[^>]*>", " ", page).split())
        for child in element:
            if child.tag.endswith("VectorProperty") and child.get("information_only") != "1" and \
                    child.get("panel_visibility") != "never":
                described = " ".join(child.findtext("Documentation").split())
                if child.get("label") not in text or described not in text:
                    complaints.append("%s: %s is not on its page of the help" % (name, child.get("name")))
    contents = database.execute("SELECT COUNT(*) FROM ContentsTable").fetchone()[0]
    if contents == 0:
        complaints.append("the help has no table of contents")
    lint_introduction(pages, [element.get("name") for group, element in proxies])


def lint_introduction(pages, names):
    """The page that leads through the stages names all proxies, and links to pages that are there."""
    page = pages.get("index.html", "")
    links = re.findall(r'href="([^"#]+)"', page)
    for link in links:
        if link not in pages:
            complaints.append("introduction of the help: %s is not there" % link)
    for name in names:
        if not any(link.split(".")[1:2] == [name] for link in links):
            complaints.append("introduction of the help: no link to %s" % name)


def lint_labels(name, proxy):
    python_names = {}
    properties = proxy.NewPropertyIterator()
    properties.Begin()
    while not properties.IsAtEnd():
        key, label = properties.GetKey(), properties.GetPropertyLabel()
        attribute = make_name_valid(label)
        if not attribute or not attribute.isidentifier():
            complaints.append("%s: label '%s' is no Python name" % (name, label))
        elif attribute in python_names:
            complaints.append("%s: %s and %s are both '%s' in Python"
                              % (name, key, python_names[attribute], attribute))
        python_names[attribute] = key
        lint_property(name, key, properties.GetProperty())
        properties.Next()


def lint_proxy(group, name, element):
    proxy = servermanager.ProxyManager().GetPrototypeProxy(group, name)
    if not proxy:
        complaints.append("%s: not in the plugin" % name)
        return None
    documentation = proxy.GetDocumentation()
    for kind, text in (("short help", documentation.GetShortHelp()),
                       ("long help", documentation.GetLongHelp()),
                       ("description", documentation.GetDescription())):
        if len((text or "").strip()) < 10:
            complaints.append("%s: no %s" % (name, kind))
    label = make_name_valid(proxy.GetXMLLabel() or "")
    if not label or not label.isidentifier():
        complaints.append("%s: label '%s' is no Python name" % (name, proxy.GetXMLLabel()))
    if group in MENU_GROUPS:
        hints = proxy.GetHints()
        menu = hints.FindNestedElementByName("ShowInMenu") if hints else None
        factory = hints and (hints.FindNestedElementByName("ReaderFactory") or
                             hints.FindNestedElementByName("WriterFactory"))
        if not factory and (menu is None or menu.GetAttribute("category") != "Dynamic Coronary"):
            complaints.append("%s: neither in the menu Dynamic Coronary nor a reader" % name)
    if element.tag == "SourceProxy":
        instance = servermanager.ProxyManager().NewProxy(group, name)
        instance.UpdateVTKObjects()
        ports = instance.GetNumberOfAlgorithmOutputPorts()
        named = sorted(int(port.get("index")) for port in element.findall("OutputPort")
                       if port.get("name"))
        if named != list(range(ports)):
            complaints.append("%s: %d ports, names for %s" % (name, ports, named))
    lint_labels(name, proxy)
    return label


load_plugin(plugin)
labels = {}
proxies = []
files = sorted(glob.glob(os.path.join(folder, "*.xml")))
for path in files:
    for group in ElementTree.parse(path).getroot().findall("ProxyGroup"):
        for element in group:
            label = lint_proxy(group.get("name"), element.get("name"), element)
            lint_panel(element.get("name"), element)
            proxies.append((group.get("name"), element))
            if label in labels:
                complaints.append("%s and %s are both '%s' in Python"
                                  % (element.get("name"), labels[label], label))
            labels[label] = element.get("name")
lint_icons([element for group, element in proxies])
if help_file:
    lint_help(proxies)
else:
    print("skipped: the pages of the help (this ParaView makes none of a plugin)")
print("%d proxies in %d files: %s" % (len(labels), len(files), ", ".join(sorted(map(str, labels)))))
if complaints or not labels:
    sys.exit("FAILED:\n  " + "\n  ".join(complaints or ["no proxies in " + folder]))
