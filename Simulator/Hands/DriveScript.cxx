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
constexpr double FurthestOfOld = 1e6;    // mm, degrees, mL

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

DrivePiece PieceOf(JsonFields& member, PiecesOf form)
{
  DrivePiece piece;
  piece.seconds = member.Number("seconds", 0.0, LongestPiece);
  for (std::size_t axis = 0; axis < HandAxes; ++axis)
  {
    const HandAxis& one = HandAxisTable[axis];
    const bool isSyringe = one.kind == AxisKind::Syringe;
    const bool isOld = form == PiecesOf::OldDevice;
    const double most = isOld ? FurthestOfOld : one.scriptMost;
    piece.change[axis] = one.scriptUnit *
      member.Number(isSyringe && isOld ? "syringe_mL" : one.scripted,
        isSyringe && !isOld ? 0.0 : -most, most, 0.0);
  }
  const bool hasPedals = member.Has("pedals");
  piece.setsPedals = hasPedals || form == PiecesOf::OldDevice;
  piece.pedals = hasPedals ? PedalsOf(member) : 0U;
  for (const EventMember& event : EventMembers)
  {
    if (member.Has(event.name))
    {
      piece.events.push_back({ event.kind,
        event.whole
          ? static_cast<double>(member.Whole(event.name, static_cast<std::int64_t>(event.least),
              static_cast<std::int64_t>(event.most), 0))
          : member.Number(event.name, event.least, event.most) });
    }
  }
  member.Done();
  return piece;
}

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

AxisPlaces DriveScript::Moved() const
{
  return this->Starts.empty() ? AxisPlaces{} : this->Starts.back().moved;
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

std::vector<RecordedEvent> DriveScript::Events(double from, double to) const
{
  std::vector<RecordedEvent> events;
  const auto first = std::lower_bound(this->Starts.begin(), this->Starts.end(), from,
    [](const Start& start, double time) { return start.time < time; });
  for (auto n = static_cast<std::size_t>(first - this->Starts.begin());
       n < this->Pieces.size() && this->Starts[n].time < to; ++n)
  {
    const std::vector<RecordedEvent>& own = this->Pieces[n].events;
    events.insert(events.end(), own.begin(), own.end());
  }
  return events;
}

DriveScript DriveScriptOf(JsonFields& fields, PiecesOf form)
{
  std::vector<DrivePiece> pieces;
  for (const nlohmann::json& entry : fields.List("pieces"))
  {
    if (pieces.size() == MostPieces)
    {
      fields.Refuse("has more than " + std::to_string(MostPieces) + " pieces");
    }
    JsonFields member(entry, fields.Where() + ", piece " + std::to_string(pieces.size() + 1));
    pieces.push_back(PieceOf(member, form));
  }
  return DriveScript(std::move(pieces));
}

DriveScript DriveScriptFromText(const std::string& text, const std::string& origin)
{
  const nlohmann::json json = ParseBoundedJson(text, origin);
  JsonFields fields(json, origin);
  fields.RequireFormat("dynamiccoronary script", "script of driving");
  fields.Text("description", "");
  DriveScript script = DriveScriptOf(fields);
  if (fields.Has("device"))
  {
    fields.Object("device"); // is the emulated device's
  }
  fields.Done();
  return script;
}

DriveScript ReadDriveScript(const std::string& path)
{
  return DriveScriptFromText(ReadTextFile(path, "a script"), "'" + path + "'");
}
}
