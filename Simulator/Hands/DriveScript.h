/**
 * @file DriveScript.h
 * @brief Driving that is written down: pieces of even motion, one after the other.
 */
#ifndef DynamicCoronary_DriveScript_h
#define DynamicCoronary_DriveScript_h

#include "HandAxes.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
class JsonFields;

/// Even motion for some seconds; changes are against the end of the piece before.
struct DrivePiece
{
  double seconds = 0.0;       ///< 0: at once
  AxisPlaces change{};        ///< units of HandAxisTable
  bool setsPedals = false;    ///< when the piece begins
  std::uint32_t pedals = 0;   ///< bits of Pedal; until they are set again
  bool setsHeartRate = false; ///< when the piece begins
  double heartRate = 0.0;     ///< beats a minute
  bool exchanges = false;     ///< when the piece begins
  double exchange = 0.0;      ///< number of the balloon that is taken
  bool exchangesWire = false; ///< when the piece begins
  double wire = 0.0;          ///< number of the wire that is taken
  bool takesWire = false;     ///< when the piece begins, before it exchanges
  double hand = 0.0;          ///< number of the wire that the hand is on: 0 the first, 1 the second
  bool setsBreaths = false;   ///< when the piece begins
  double breaths = 0.0;       ///< a minute; 0: the breath is held
  bool flushes = false;       ///< when the piece begins
  double flush = 0.0;         ///< mL of saline through the guide catheter; negative: drawn back
  bool callsIncident = false; ///< when the piece begins
  double incident = 0.0;      ///< number of the scenario's event; 0: nitrates
};

class DriveScript
{
public:
  DriveScript() = default;
  explicit DriveScript(std::vector<DrivePiece> pieces);

  double Duration() const { return this->Total; } ///< s
  AxisPlaces Moved() const;                       ///< from its start to its end
  std::uint64_t Ticks(double tickRate) const;     ///< after which it is over

  /// Where hands, feet and C-arm are, `seconds` after the start; after the end they rest, off the pedals.
  /// @param start  where they are before
  SessionInput At(double seconds, const SessionInput& start = {}) const;

  /// Heart rates that are set at or after `from` and before `to`, s.
  std::vector<double> HeartRates(double from, double to) const;
  /// Likewise numbers of the balloons that are taken.
  std::vector<double> Exchanges(double from, double to) const;
  std::vector<double> WireExchanges(double from, double to) const; ///< likewise of the wires
  std::vector<double> WiresTaken(double from, double to) const; ///< likewise of the wires in hand
  /// Likewise breaths a minute.
  std::vector<double> BreathRates(double from, double to) const;
  std::vector<double> Flushes(double from, double to) const; ///< likewise mL of saline
  std::vector<double> Incidents(
    double from, double to) const; ///< likewise numbers of events; 0: nitrates

private:
  std::vector<double> Chosen(
    double from, double to, bool DrivePiece::*chooses, double DrivePiece::*value) const;

  struct Start
  {
    double time = 0.0;
    AxisPlaces moved{};       ///< by all pieces before
    std::uint32_t pedals = 0; ///< of this one
  };

  std::vector<DrivePiece> Pieces;
  std::vector<Start> Starts; ///< one more than pieces
  double Total = 0.0;
};

/// Where a script has its pieces.
enum class PiecesOf
{
  Script,
  OldDevice ///< device scenarios, once a format of their own: 'syringe_mL', pedals held during their piece only
};

/// @throws std::invalid_argument naming file, piece and member
DriveScript DriveScriptOf(JsonFields& fields, PiecesOf form = PiecesOf::Script);

///@{
/// @throws std::runtime_error naming the file: not there, no JSON; std::invalid_argument naming file, piece and member
DriveScript DriveScriptFromText(const std::string& text, const std::string& origin);
DriveScript ReadDriveScript(const std::string& path);
///@}
}

#endif
