/**
 * @file DriveScript.h
 * @brief Driving that is written down: pieces of even motion, one after the other.
 */
#ifndef DynamicCoronary_DriveScript_h
#define DynamicCoronary_DriveScript_h

#include "HandAxes.h"
#include "RecordedEvent.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
class JsonFields;

/// Even motion for some seconds; changes are against the end of the piece before.
struct DrivePiece
{
  double seconds = 0.0;              ///< 0: at once
  AxisPlaces change{};               ///< units of HandAxisTable
  bool setsPedals = false;           ///< when the piece begins
  std::uint32_t pedals = 0;          ///< bits of Pedal; until they are set again
  std::vector<RecordedEvent> events; ///< when the piece begins
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

  /// Of the pieces that begin at or after `from` and before `to`, s.
  std::vector<RecordedEvent> Events(double from, double to) const;

private:
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
