/**
 * @file DriveScript.h
 * @brief Driving that is written down: pieces of even motion, one after the other.
 */
#ifndef DynamicCoronary_DriveScript_h
#define DynamicCoronary_DriveScript_h

#include "Intervention.h"

#include <string>
#include <vector>

namespace coronary
{
/// Even motion for some seconds; changes are against the end of the piece before.
struct DrivePiece
{
  double seconds = 0.0;         ///< 0: at once
  double wireAdvance = 0.0;     ///< mm
  double wireTurn = 0.0;        ///< radians
  double catheterAdvance = 0.0; ///< mm
  double catheterTurn = 0.0;    ///< radians
  bool setsHeartRate = false;   ///< when the piece begins
  double heartRate = 0.0;       ///< beats a minute
};

class DriveScript
{
public:
  DriveScript() = default;
  explicit DriveScript(std::vector<DrivePiece> pieces);

  double Duration() const { return this->Total; } ///< s

  /// Where the hands are, `seconds` after the start; after the end they rest.
  DriveInput At(double seconds) const;

  /// Heart rates that are set at or after `from` and before `to`, s.
  std::vector<double> HeartRates(double from, double to) const;

private:
  struct Start
  {
    double time;
    DriveInput input;
  };

  std::vector<DrivePiece> Pieces;
  std::vector<Start> Starts; ///< one more than pieces
  double Total = 0.0;
};

///@{
/// @throws std::runtime_error naming the file: not there, no JSON; std::invalid_argument naming file, piece and member
DriveScript DriveScriptFromText(const std::string& text, const std::string& origin);
DriveScript ReadDriveScript(const std::string& path);
///@}
}

#endif
