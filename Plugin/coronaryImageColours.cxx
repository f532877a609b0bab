#include "coronaryImageColours.h"

#include <vtkCallbackCommand.h>
#include <vtkNew.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMProxyManager.h>
#include <vtkSMSettings.h>

#include <array>
#include <cstring>

namespace
{
/// ParaView has settings for the colours of an array, none for its opacities.
void SetOpacities(vtkObject*, unsigned long, void*, void* data)
{
  using Information = vtkSMProxyManager::RegisteredProxyInformation;
  const auto* made = static_cast<const Information*>(data);
  if (made->Type != Information::PROXY || made->Proxy == nullptr ||
    std::strcmp(made->GroupName, "piecewise_functions") != 0 ||
    std::strcmp(made->ProxyName, "HU.PiecewiseFunction") != 0 ||
    !made->Proxy->GetProperty("Points")->IsValueDefault())
  {
    return;
  }
  constexpr std::array<double, 8> points{ -150.0, 0.0, 0.5, 0.0, 650.0, 1.0, 0.5, 0.0 };
  vtkSMPropertyHelper(made->Proxy, "Points").Set(points.data(), points.size());
  vtkSMPropertyHelper(made->Proxy, "ScalarRangeInitialized").Set(1);
  made->Proxy->UpdateVTKObjects();
}
}

void coronaryShowImagesInGrey()
{
  // Below the user's settings and those of the site.
  constexpr double priority = 0.5;
  // The window of Build from 4D CT: level 250, width 800.
  vtkSMSettings::GetInstance()->AddCollectionFromString(
    R"({
  "array_lookup_tables": { "HU": { "PVLookupTable": {
    "RGBPoints": [-150.0, 0.0, 0.0, 0.0, 650.0, 1.0, 1.0, 1.0],
    "ColorSpace": "RGB", "AutomaticRescaleRangeMode": "Never", "ScalarRangeInitialized": 1 } } }
})",
    priority);
  // A server has none.
  if (vtkSMProxyManager::IsInitialized())
  {
    vtkNew<vtkCallbackCommand> made;
    made->SetCallback(&SetOpacities);
    vtkSMProxyManager::GetProxyManager()->AddObserver(vtkCommand::RegisterEvent, made);
  }
}
