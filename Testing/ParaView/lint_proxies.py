"""Every proxy of the plugin: documentation, menu, labels, domains, ports."""
import glob
import os
import sys
import xml.etree.ElementTree as ElementTree

from paraview import make_name_valid, servermanager, simple

from coronary_testing import load_plugin

plugin, folder = sys.argv[1:3]
complaints = []
MENU_GROUPS = ("sources", "filters", "writers")


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
files = sorted(glob.glob(os.path.join(folder, "*.xml")))
for path in files:
    for group in ElementTree.parse(path).getroot().findall("ProxyGroup"):
        for element in group:
            label = lint_proxy(group.get("name"), element.get("name"), element)
            if label in labels:
                complaints.append("%s and %s are both '%s' in Python"
                                  % (element.get("name"), labels[label], label))
            labels[label] = element.get("name")
print("%d proxies in %d files: %s" % (len(labels), len(files), ", ".join(sorted(map(str, labels)))))
if complaints or not labels:
    sys.exit("FAILED:\n  " + "\n  ".join(complaints or ["no proxies in " + folder]))
