#include "DriveScript.h"

#include "JsonFields.h"
#include "TextFile.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr double Degree = M_PI / 180.0;
constexpr std::size_t MostPieces = 100000;
constexpr double LongestPiece = 36000.0; // s
constexpr double FurthestAdvance =
  1e6; // mm: what is absurd is clamped by the simulation, with a message
constexpr double MaximumTurn = 1e7; // degrees
constexpr double MaximumHeartRate = 240.0;
constexpr double MostContrast = 1000.0;  // mL
constexpr double MaximumAngle = 360.0;   // degrees, of the C-arm
constexpr double FurthestTable = 1000.0; // mm

std::uint32_t PedalsOf(JsonFields& fields)
{
  std::uint32_t pedals = 0;
  for (const nlohmann::json& entry : fields.List("pedals"))
  {
    const std::string name = entry.is_string() ? entry.get<std::string>() : entry.dump();
    if (name == "fluoroscopy")
    {
      pedals |= FluoroscopyPedal;
    }
    else if (name == "cine")
    {
      pedals |= CinePedal;
    }
    else if (name == "mask")
    {
      pedals |= MaskPedal;
    }
    else
    {
      fields.Refuse(
        "has 'pedals' with '" + name.substr(0, 60) + "', which is none of fluoroscopy, cine, mask");
    }
  }
  return pedals;
}

DrivePiece PieceOf(JsonFields& member)
{
  DrivePiece piece;
  piece.seconds = member.Number("seconds", 0.0, LongestPiece);
  const auto advance = [&](const char* name, double most)
  { return member.Number(name, -most, most, 0.0); };
  piece.wireAdvance = advance("wire_mm", FurthestAdvance);
  piece.wireTurn = Degree * advance("wire_deg", MaximumTurn);
  piece.catheterAdvance = advance("catheter_mm", FurthestAdvance);
  piece.catheterTurn = Degree * advance("catheter_deg", MaximumTurn);
  piece.inject = member.Number("inject_mL", 0.0, MostContrast, 0.0);
  piece.primaryTurn = Degree * advance("primary_deg", MaximumAngle);
  piece.secondaryTurn = Degree * advance("secondary_deg", MaximumAngle);
  piece.detectorLift = advance("source_to_detector_mm", FurthestTable);
  piece.tableMove = { advance("table_x_mm", FurthestTable), advance("table_y_mm", FurthestTable),
    advance("table_z_mm", FurthestTable) };
  piece.setsPedals = member.Has("pedals");
  piece.pedals = piece.setsPedals ? PedalsOf(member) : 0U;
  piece.setsHeartRate = member.Has("heart_rate_bpm");
  piece.heartRate = member.Number("heart_rate_bpm", 0.0, MaximumHeartRate, 0.0);
  member.Done();
  return piece;
}
}

namespace
{
void Move(SessionInput& input, const DrivePiece& piece, double share)
{
  input.drive.wirePosition += share * piece.wireAdvance;
  input.drive.wireAngle += share * piece.wireTurn;
  input.drive.catheterPosition += share * piece.catheterAdvance;
  input.drive.catheterAngle += share * piece.catheterTurn;
  input.syringe += share * piece.inject;
  input.primary += share * piece.primaryTurn;
  input.secondary += share * piece.secondaryTurn;
  input.sourceToDetector += share * piece.detectorLift;
  input.table += share * piece.tableMove;
}

SessionInput Nothing()
{
  SessionInput nothing;
  nothing.sourceToDetector = 0.0;
  return nothing;
}

SessionInput Sum(SessionInput start, const SessionInput& moved)
{
  start.drive.wirePosition += moved.drive.wirePosition;
  start.drive.wireAngle += moved.drive.wireAngle;
  start.drive.catheterPosition += moved.drive.catheterPosition;
  start.drive.catheterAngle += moved.drive.catheterAngle;
  start.syringe += moved.syringe;
  start.primary += moved.primary;
  start.secondary += moved.secondary;
  start.sourceToDetector += moved.sourceToDetector;
  start.table += moved.table;
  start.pedals |= moved.pedals;
  return start;
}
}

DriveScript::DriveScript(std::vector<DrivePiece> pieces)
  : Pieces(std::move(pieces))
{
  Start start{ 0.0, Nothing() };
  for (const DrivePiece& piece : this->Pieces)
  {
    start.moved.pedals = piece.setsPedals ? piece.pedals : start.moved.pedals;
    this->Starts.push_back(start);
    start.time += piece.seconds;
    Move(start.moved, piece, 1.0);
  }
  start.moved.pedals = 0;
  this->Starts.push_back(start);
  this->Total = start.time;
}

SessionInput DriveScript::At(double seconds, const SessionInput& start) const
{
  const auto after = std::upper_bound(this->Starts.begin(), this->Starts.end(), seconds,
    [](double time, const Start& piece) { return time < piece.time; });
  if (after == this->Starts.begin())
  {
    return start;
  }
  const auto n = static_cast<std::size_t>(after - this->Starts.begin() - 1);
  SessionInput moved = this->Starts[n].moved;
  if (n < this->Pieces.size())
  {
    Move(moved, this->Pieces[n], (seconds - this->Starts[n].time) / this->Pieces[n].seconds);
  }
  return Sum(start, moved);
}

std::vector<double> DriveScript::HeartRates(double from, double to) const
{
  std::vector<double> rates;
  const auto first = std::lower_bound(this->Starts.begin(), this->Starts.end(), from,
    [](const Start& start, double time) { return start.time < time; });
  for (auto n = static_cast<std::size_t>(first - this->Starts.begin()); n < this->Pieces.size();
       ++n)
  {
    if (this->Starts[n].time >= to)
    {
      break;
    }
    if (this->Pieces[n].setsHeartRate)
    {
      rates.push_back(this->Pieces[n].heartRate);
    }
  }
  return rates;
}

DriveScript DriveScriptFromText(const std::string& text, const std::string& origin)
{
  const nlohmann::json json = ParseBoundedJson(text, origin);
  JsonFields fields(json, origin);
  fields.RequireFormat("dynamiccoronary script", "script of driving");
  fields.Text("description", "");
  std::vector<DrivePiece> pieces;
  for (const nlohmann::json& entry : fields.List("pieces"))
  {
    if (pieces.size() == MostPieces)
    {
      fields.Refuse("has more than " + std::to_string(MostPieces) + " pieces");
    }
    JsonFields member(entry, origin + ", piece " + std::to_string(pieces.size() + 1));
    pieces.push_back(PieceOf(member));
  }
  fields.Done();
  return DriveScript(std::move(pieces));
}

DriveScript ReadDriveScript(const std::string& path)
{
  return DriveScriptFromText(ReadTextFile(path, "a script"), "'" + path + "'");
}
}
