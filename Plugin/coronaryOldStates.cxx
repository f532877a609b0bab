#include "coronaryOldStates.h"

#include "coronaryVersion1.h"

#include <vtkObjectFactory.h>
#include <vtkPVXMLElement.h>
#include <vtkSMStateLoader.h>
#include <vtkSmartPointer.h>
#include <vtkVersion.h>

#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace
{
using coronaryVersion1::GoneProperty;
using coronaryVersion1::MergedProxy;
using coronaryVersion1::MergedSwitch;
using coronaryVersion1::RenamedProperty;

bool Is(vtkPVXMLElement* element, const char* name)
{
  return element->GetName() != nullptr && std::strcmp(element->GetName(), name) == 0;
}

/// All nested elements of a name, at any depth.
void ForEach(
  vtkPVXMLElement* root, const char* name, const std::function<void(vtkPVXMLElement*)>& visit)
{
  for (unsigned int i = 0; i < root->GetNumberOfNestedElements(); ++i)
  {
    vtkPVXMLElement* element = root->GetNestedElement(i);
    if (Is(element, name))
    {
      visit(element);
    }
    ForEach(element, name, visit);
  }
}

vtkPVXMLElement* PropertyOf(vtkPVXMLElement* proxy, const char* name)
{
  for (unsigned int i = 0; i < proxy->GetNumberOfNestedElements(); ++i)
  {
    vtkPVXMLElement* element = proxy->GetNestedElement(i);
    if (Is(element, "Property") && std::strcmp(element->GetAttributeOrEmpty("name"), name) == 0)
    {
      return element;
    }
  }
  return nullptr;
}

/// The first value of a property, empty when there is none.
std::string ValueOf(vtkPVXMLElement* property)
{
  vtkPVXMLElement* element = property->FindNestedElementByName("Element");
  return element != nullptr ? element->GetAttributeOrEmpty("value") : "";
}

/// As numbers where both are numbers.
bool IsSame(const std::string& a, const std::string& b)
{
  char* endA = nullptr;
  char* endB = nullptr;
  const double numberA = std::strtod(a.c_str(), &endA);
  const double numberB = std::strtod(b.c_str(), &endB);
  const bool numbers = !a.empty() && !b.empty() && *endA == '\0' && *endB == '\0';
  return numbers ? numberA == numberB : a == b;
}

/// Brings the state of one run of ParaView up to date, and says what is lost.
class Update
{
public:
  explicit Update(vtkPVXMLElement* state)
    : State(state)
  {
    ForEach(state, "Item",
      [this](vtkPVXMLElement* item)
      { this->Names[item->GetAttributeOrEmpty("id")] = item->GetAttributeOrEmpty("name"); });
  }

  void Run()
  {
    std::vector<vtkPVXMLElement*> proxies;
    ForEach(this->State, "Proxy",
      [&](vtkPVXMLElement* element)
      {
        if (element->GetAttribute("type") != nullptr)
        {
          proxies.push_back(element);
        }
      });
    for (vtkPVXMLElement* proxy : proxies)
    {
      this->Properties(proxy);
      this->Switches(proxy);
      this->Successor(proxy);
      Rename(proxy);
    }
  }

  /// Empty when nothing is lost.
  std::string Message() const
  {
    if (this->Lost.empty())
    {
      return {};
    }
    std::string message =
      "The state is of DynamicCoronary 1. What it sets and this version does not have:";
    for (const std::string& line : this->Lost)
    {
      message += "\n  " + line;
    }
    return message;
  }

private:
  void Say(vtkPVXMLElement* proxy, const std::string& what)
  {
    const auto name = this->Names.find(proxy->GetAttributeOrEmpty("id"));
    const std::string type = proxy->GetAttributeOrEmpty("type");
    this->Lost.push_back(
      (name != this->Names.end() ? name->second + " (" + type + ")" : type) + ": " + what);
  }

  void Properties(vtkPVXMLElement* proxy)
  {
    for (const GoneProperty& gone : coronaryVersion1::GoneProperties)
    {
      vtkPVXMLElement* property = std::strcmp(proxy->GetAttributeOrEmpty("type"), gone.Proxy) == 0
        ? PropertyOf(proxy, gone.Property)
        : nullptr;
      if (property != nullptr && !IsSame(ValueOf(property), gone.Default))
      {
        this->Say(proxy,
          std::string(gone.Property) + " = " + ValueOf(property) +
            " has no effect: " + gone.Instead);
      }
    }
  }

  void Switches(vtkPVXMLElement* proxy)
  {
    for (const MergedSwitch& merged : coronaryVersion1::MergedSwitches)
    {
      vtkPVXMLElement* property = std::strcmp(proxy->GetAttributeOrEmpty("type"), merged.Proxy) == 0
        ? PropertyOf(proxy, merged.Switch)
        : nullptr;
      vtkPVXMLElement* value = property != nullptr ? PropertyOf(proxy, merged.Property) : nullptr;
      vtkPVXMLElement* element =
        value != nullptr ? value->FindNestedElementByName("Element") : nullptr;
      if (element != nullptr && IsSame(ValueOf(property), merged.Automatic))
      {
        element->SetAttribute("value", merged.Value);
      }
    }
  }

  /// After the successor has been found: its properties are meant.
  static void Rename(vtkPVXMLElement* proxy)
  {
    for (const RenamedProperty& renamed : coronaryVersion1::RenamedProperties)
    {
      vtkPVXMLElement* property =
        std::strcmp(proxy->GetAttributeOrEmpty("type"), renamed.Proxy) == 0
        ? PropertyOf(proxy, renamed.Property)
        : nullptr;
      if (property != nullptr)
      {
        property->SetAttribute("name", renamed.Name);
      }
    }
  }

  void Successor(vtkPVXMLElement* proxy)
  {
    for (const MergedProxy& merged : coronaryVersion1::MergedProxies)
    {
      if (std::strcmp(proxy->GetAttributeOrEmpty("type"), merged.Proxy) != 0)
      {
        continue;
      }
      this->Say(proxy, merged.Instead);
      proxy->SetAttribute("type", merged.Successor);
      vtkPVXMLElement* property =
        merged.Property != nullptr ? PropertyOf(proxy, merged.Property) : nullptr;
      if (property != nullptr)
      {
        property->SetAttribute("name", merged.SuccessorProperty);
      }
      this->ShiftPorts(proxy->GetAttributeOrEmpty("id"), merged.FirstPort);
      return;
    }
  }

  /// What uses an output of the proxy uses that of its successor.
  void ShiftPorts(const std::string& id, int first)
  {
    ForEach(this->State, "Proxy",
      [&](vtkPVXMLElement* use)
      {
        int port = 0;
        if (id == use->GetAttributeOrEmpty("value") &&
          use->GetScalarAttribute("output_port", &port))
        {
          use->SetAttribute("output_port", std::to_string(port + first).c_str());
        }
      });
  }

  vtkPVXMLElement* State;
  std::map<std::string, std::string> Names;
  std::vector<std::string> Lost;
};
}

/// ParaView's loader of states, which looks at them first.
class coronaryStateLoader : public vtkSMStateLoader
{
public:
  static coronaryStateLoader* New();
  vtkTypeMacro(coronaryStateLoader, vtkSMStateLoader);

protected:
  /// Called with the whole state before anything is made of it.
  bool VerifyXMLVersion(vtkPVXMLElement* state) override
  {
    Update update(state);
    update.Run();
    const std::string message = update.Message();
    if (!message.empty())
    {
      vtkWarningMacro(<< message);
    }
    return this->Superclass::VerifyXMLVersion(state);
  }
};
vtkStandardNewMacro(coronaryStateLoader);

namespace
{
VTK_CREATE_CREATE_FUNCTION(coronaryStateLoader);

class Factory : public vtkObjectFactory
{
public:
  static Factory* New();
  vtkTypeMacro(Factory, vtkObjectFactory);
  const char* GetVTKSourceVersion() override { return VTK_SOURCE_VERSION; }
  const char* GetDescription() override { return "States of earlier versions of DynamicCoronary"; }

protected:
  Factory()
  {
    this->RegisterOverride("vtkSMStateLoader", "coronaryStateLoader", this->GetDescription(), 1,
      vtkObjectFactoryCreatecoronaryStateLoader);
  }
};
vtkStandardNewMacro(Factory);

/// Until the plugin is unloaded: its code is gone then.
struct Registration
{
  Registration() { vtkObjectFactory::RegisterFactory(this->Object); }
  ~Registration() { vtkObjectFactory::UnRegisterFactory(this->Object); }
  Registration(const Registration&) = delete;
  Registration& operator=(const Registration&) = delete;

  vtkSmartPointer<Factory> Object = vtkSmartPointer<Factory>::New();
};
}

void coronaryReadOldStates()
{
  static const Registration registration;
}
