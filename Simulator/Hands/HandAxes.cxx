#include "HandAxes.h"

namespace coronary
{
AxisPlaces PlacesOf(const SessionInput& input)
{
  return { input.drive.wirePosition, input.drive.wireAngle, input.drive.catheterPosition,
    input.drive.catheterAngle, input.syringe, input.primary, input.secondary,
    input.sourceToDetector, input.table.x(), input.table.y(), input.table.z(),
    input.drive.inflation, input.drive.balloonPosition };
}

void SetPlaces(SessionInput& input, const AxisPlaces& places)
{
  input.drive = { places[0], places[1], places[2], places[3], places[11], places[12] };
  input.syringe = places[4];
  input.primary = places[5];
  input.secondary = places[6];
  input.sourceToDetector = places[7];
  input.table = { places[8], places[9], places[10] };
}

const char* UnitName(AxisUnit unit)
{
  switch (unit)
  {
    case AxisUnit::Millimetre:
      return "mm";
    case AxisUnit::Radian:
      return "rad";
    case AxisUnit::Millilitre:
      return "mL";
    case AxisUnit::Atmosphere:
      return "atm";
    case AxisUnit::None:
      break;
  }
  return "";
}
}
