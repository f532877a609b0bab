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
constexpr std::size_t MostPieces = 100000;
constexpr double LongestPiece = 36000.0; // s
constexpr double MaximumHeartRate = 240.0;

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
  for (std::size_t axis = 0; axis < HandAxes; ++axis)
  {
    const HandAxis& one = HandAxisTable[axis];
    const double least = one.kind == AxisKind::Syringe ? 0.0 : -one.scriptMost;
    piece.change[axis] = one.scriptUnit * member.Number(one.scripted, least, one.scriptMost, 0.0);
  }
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
void Move(AxisPlaces& places, const AxisPlaces& change, double share)
{
  for (std::size_t axis = 0; axis < HandAxes; ++axis)
  {
    places[axis] += share * change[axis];
  }
}
}

DriveScript::DriveScript(std::vector<DrivePiece> pieces)
  : Pieces(std::move(pieces))
{
  Start start;
  for (const DrivePiece& piece : this->Pieces)
  {
    start.pedals = piece.setsPedals ? piece.pedals : start.pedals;
    this->Starts.push_back(start);
    start.time += piece.seconds;
    Move(start.moved, piece.change, 1.0);
  }
  start.pedals = 0;
  this->Starts.push_back(start);
  this->Total = start.time;
}

std::uint64_t DriveScript::Ticks(double tickRate) const
{
  return static_cast<std::uint64_t>(std::ceil(this->Total * tickRate));
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
  AxisPlaces moved = this->Starts[n].moved;
  if (n < this->Pieces.size())
  {
    Move(moved, this->Pieces[n].change, (seconds - this->Starts[n].time) / this->Pieces[n].seconds);
  }
  AxisPlaces places = PlacesOf(start);
  Move(places, moved, 1.0);
  SessionInput input = start;
  SetPlaces(input, places);
  input.pedals |= this->Starts[n].pedals;
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
