#include "coronaryImageColours.h"

#include "vtkSMSettings.h"

void coronaryShowImagesInGrey()
{
  // Below the user's settings and those of the site.
  constexpr double priority = 0.5;
  // The window of Build from 4D CT: level 250, width 800.
  vtkSMSettings::GetInstance()->AddCollectionFromString(
    R"({
  "array_lookup_tables": { "HU": { "PVLookupTable": {
    "RGBPoints": [-150.0, 0.0, 0.0, 0.0, 650.0, 1.0, 1.0, 1.0],
    "ColorSpace": "RGB", "AutomaticRescaleRangeMode": "Never", "ScalarRangeInitialized": 1 } } },
  "array_piecewise_functions": { "HU": { "PiecewiseFunction": {
    "Points": [-150.0, 0.0, 0.5, 0.0, 650.0, 1.0, 0.5, 0.0], "ScalarRangeInitialized": 1 } } }
})",
    priority);
}
