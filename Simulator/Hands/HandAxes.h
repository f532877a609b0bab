/**
 * @file HandAxes.h
 * @brief What hands move: one table for devices, keys, game controllers, scripts and recordings.
 */
#ifndef DynamicCoronary_HandAxes_h
#define DynamicCoronary_HandAxes_h

#include "SessionInput.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace coronary
{
/// Codes of the device protocol.
enum class AxisUnit : std::uint8_t
{
  None = 0,
  Millimetre = 1,
  Radian = 2,
  Millilitre = 3,
  Atmosphere = 4
};

/// Codes of the device protocol; those of HandAxisTable in its order.
enum class AxisKind : std::uint8_t
{
  None = 0,
  WireAdvance = 1,
  WireTurn = 2,
  CatheterAdvance = 3,
  CatheterTurn = 4,
  Syringe = 5,
  Primary = 6,
  Secondary = 7,
  SourceToDetector = 8,
  TableLeft = 9,
  TableBack = 10,
  TableHead = 11,
  Inflation = 12,
  BalloonAdvance = 13
};
constexpr AxisKind LastAxisKind = AxisKind::BalloonAdvance;

/// What one device moves at a time; bits.
enum DeviceAxes : std::uint32_t
{
  WireAxes = 1U,
  CatheterAxes = 2U,
  SyringeAxis = 4U,
  ViewAxes = 8U, ///< C-arm and table
  BalloonAxes = 16U,
  AllAxes = 31U
};

struct HandAxis
{
  AxisKind kind; ///< of devices
  AxisUnit unit; ///< of its place
  DeviceAxes group;
  double low; ///< where it can be
  double high;
  double tremble;       ///< that a hand at rest moves an encoder
  double fastest;       ///< a second: no hand is faster
  double speed;         ///< a second, of a key or a stick at its end
  bool paced;           ///< keys for fine and fast movement count
  const char* recorded; ///< field of a recording
  const char* scripted; ///< member of a script
  double scriptUnit;    ///< of that member
  double scriptMost;    ///< in it
  const char* forward;  ///< keys, in lower case
  const char* back;
};

constexpr double DegreeOfHands = M_PI / 180.0;
constexpr double Anywhere = 1e300;
constexpr std::size_t HandAxes = 13;

constexpr std::array<HandAxis, HandAxes> HandAxisTable{ {
  { AxisKind::WireAdvance, AxisUnit::Millimetre, WireAxes, -Anywhere, Anywhere, 0.2, 2000.0, 10.0,
    true, "wire_position", "wire_mm", 1.0, 1e6, "up", "down" },
  { AxisKind::WireTurn, AxisUnit::Radian, WireAxes, -Anywhere, Anywhere, 0.02, 60.0, 3.14, true,
    "wire_angle", "wire_deg", DegreeOfHands, 1e7, "right", "left" },
  { AxisKind::CatheterAdvance, AxisUnit::Millimetre, CatheterAxes, -Anywhere, Anywhere, 0.2, 2000.0,
    5.0, true, "catheter_position", "catheter_mm", 1.0, 1e6, "w", "s" },
  { AxisKind::CatheterTurn, AxisUnit::Radian, CatheterAxes, -Anywhere, Anywhere, 0.02, 60.0, 1.0,
    true, "catheter_angle", "catheter_deg", DegreeOfHands, 1e7, "d", "a" },
  { AxisKind::Syringe, AxisUnit::Millilitre, SyringeAxis, -Anywhere, Anywhere, 0.05, 100.0, 3.0,
    false, "syringe", "inject_mL", 1.0, 1000.0, "space", "backspace" },
  { AxisKind::Primary, AxisUnit::Radian, ViewAxes, -120.0 * DegreeOfHands, 120.0 * DegreeOfHands,
    0.005, 60.0, 0.35, false, "primary", "primary_deg", DegreeOfHands, 360.0, "l", "j" },
  { AxisKind::Secondary, AxisUnit::Radian, ViewAxes, -55.0 * DegreeOfHands, 55.0 * DegreeOfHands,
    0.005, 60.0, 0.35, false, "secondary", "secondary_deg", DegreeOfHands, 360.0, "i", "k" },
  { AxisKind::SourceToDetector, AxisUnit::Millimetre, ViewAxes, 900.0, 1300.0, 1.0, 2000.0, 50.0,
    false, "source_to_detector", "source_to_detector_mm", 1.0, 1000.0, "o", "u" },
  { AxisKind::TableLeft, AxisUnit::Millimetre, ViewAxes, -200.0, 200.0, 1.0, 2000.0, 40.0, false,
    "table_x", "table_x_mm", 1.0, 1000.0, "h", "z" },
  { AxisKind::TableBack, AxisUnit::Millimetre, ViewAxes, -200.0, 200.0, 1.0, 2000.0, 40.0, false,
    "table_y", "table_y_mm", 1.0, 1000.0, "next", "prior" },
  { AxisKind::TableHead, AxisUnit::Millimetre, ViewAxes, -200.0, 200.0, 1.0, 2000.0, 40.0, false,
    "table_z", "table_z_mm", 1.0, 1000.0, "t", "g" },
  { AxisKind::Inflation, AxisUnit::Atmosphere, BalloonAxes, -0.9, 30.0, 0.05, 200.0, 2.0, false,
    "inflation", "inflate_atm", 1.0, 100.0, "b", "v" },
  { AxisKind::BalloonAdvance, AxisUnit::Millimetre, BalloonAxes, -Anywhere, Anywhere, 0.2, 2000.0,
    10.0, true, "balloon_position", "balloon_mm", 1.0, 1e6, "e", "q" },
} };

/// A place, a speed or a wish for each axis.
using AxisPlaces = std::array<double, HandAxes>;

constexpr std::size_t IndexOf(AxisKind kind)
{
  return static_cast<std::size_t>(kind) - 1; // of the table; none for None
}

/// @return null: no hand's
constexpr const HandAxis* HandAxisOf(AxisKind kind)
{
  const std::size_t index = IndexOf(kind);
  return index < HandAxes ? &HandAxisTable[index] : nullptr;
}

AxisPlaces PlacesOf(const SessionInput& input);
void SetPlaces(SessionInput& input, const AxisPlaces& places);

const char* UnitName(AxisUnit unit);
}

#endif
