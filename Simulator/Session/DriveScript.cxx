#include "DriveScript.h"

#include "JsonFields.h"

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
constexpr double GreatestTurn = 1e7; // degrees
constexpr double GreatestHeartRate = 240.0;
}

DriveScript::DriveScript(std::vector<DrivePiece> pieces)
  : Pieces(std::move(pieces))
{
  Start start{ 0.0, {} };
  this->Starts.push_back(start);
  for (const DrivePiece& piece : this->Pieces)
  {
    start.time += piece.seconds;
    start.input.wirePosition += piece.wireAdvance;
    start.input.wireAngle += piece.wireTurn;
    start.input.catheterPosition += piece.catheterAdvance;
    start.input.catheterAngle += piece.catheterTurn;
    this->Starts.push_back(start);
  }
  this->Total = start.time;
}

DriveInput DriveScript::At(double seconds) const
{
  if (this->Starts.empty())
  {
    return {};
  }
  const auto after = std::upper_bound(this->Starts.begin(), this->Starts.end(), seconds,
    [](double time, const Start& start) { return time < start.time; });
  if (after == this->Starts.begin() || after == this->Starts.end())
  {
    return after == this->Starts.begin() ? DriveInput{} : this->Starts.back().input;
  }
  const auto n = static_cast<std::size_t>(after - this->Starts.begin() - 1);
  const DrivePiece& piece = this->Pieces[n];
  const double share = (seconds - this->Starts[n].time) / piece.seconds;
  DriveInput input = this->Starts[n].input;
  input.wirePosition += share * piece.wireAdvance;
  input.wireAngle += share * piece.wireTurn;
  input.catheterPosition += share * piece.catheterAdvance;
  input.catheterAngle += share * piece.catheterTurn;
  return input;
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
  const nlohmann::json json = ParseJson(text, origin);
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
    DrivePiece piece;
    piece.seconds = member.Number("seconds", 0.0, LongestPiece);
    piece.wireAdvance = member.Number("wire_mm", -FurthestAdvance, FurthestAdvance, 0.0);
    piece.wireTurn = Degree * member.Number("wire_deg", -GreatestTurn, GreatestTurn, 0.0);
    piece.catheterAdvance = member.Number("catheter_mm", -FurthestAdvance, FurthestAdvance, 0.0);
    piece.catheterTurn = Degree * member.Number("catheter_deg", -GreatestTurn, GreatestTurn, 0.0);
    piece.setsHeartRate = member.Has("heart_rate_bpm");
    piece.heartRate = member.Number("heart_rate_bpm", 0.0, GreatestHeartRate, 0.0);
    member.Done();
    pieces.push_back(piece);
  }
  fields.Done();
  return DriveScript(std::move(pieces));
}

DriveScript ReadDriveScript(const std::string& path)
{
  return DriveScriptFromText(ReadTextFile(path), "'" + path + "'");
}
}
