/**
 * @file RecordedEvent.h
 * @brief What a trainee does beside driving: one table for scripts, the window and recordings.
 */
#ifndef DynamicCoronary_RecordedEvent_h
#define DynamicCoronary_RecordedEvent_h

#include <array>
#include <cstdint>

namespace coronary
{
struct RecordedEvent
{
  enum Kind : std::uint8_t
  {
    HeartRate = 1,    ///< value: beats a minute
    FrameRate = 2,    ///< frames a second of the X-ray images: 7.5, 15 or 30
    FieldOfView = 3,  ///< mm of the detector that are used, across
    Exchange = 4,     ///< number of the balloon that is taken, as BalloonOf
    ExchangeWire = 5, ///< number of the wire that is taken, as WireOf
    Breaths = 6,      ///< a minute; 0: the breath is held where it is
    TakeWire = 7,     ///< the hand goes to this wire: 0 the first, 1 the second
    Flush = 8,        ///< mL of saline pushed through the guide catheter; negative: drawn back
    Incident =
      9, ///< number of the scenario's event that happens now, from 1 on; 0: nitrates are given
    ShutterSides = 10, ///< share of the X-ray image that the left and the right shutter cover each
    ShutterEnds = 11   ///< likewise the upper and the lower one
  };
  std::uint8_t kind = 0;
  double value = 0.0;
};

/// How an event is written down.
struct EventMember
{
  RecordedEvent::Kind kind;
  const char* name; ///< member of a script's piece
  double least;
  double most;
  bool whole; ///< it is a number of something
};

/// Those of a piece happen in this order: a wire is taken before what is on it is exchanged.
constexpr std::array<EventMember, 11> EventMembers{ {
  { RecordedEvent::HeartRate, "heart_rate_bpm", 0.0, 240.0, false },
  { RecordedEvent::TakeWire, "take_wire", 0.0, 1.0, true },
  { RecordedEvent::Exchange, "exchange", 0.0, 100.0, true },
  { RecordedEvent::ExchangeWire, "exchange_wire", 0.0, 100.0, true },
  { RecordedEvent::Breaths, "breaths_per_min", 0.0, 60.0, false },
  { RecordedEvent::Flush, "flush_mL", -50.0, 50.0, false },
  { RecordedEvent::Incident, "event", 0.0, 100.0, true },
  { RecordedEvent::FrameRate, "frame_rate_hz", 7.5, 30.0, false },
  { RecordedEvent::FieldOfView, "field_of_view_mm", 80.0, 400.0, false },
  { RecordedEvent::ShutterSides, "shutter_sides", 0.0, 0.45, false },
  { RecordedEvent::ShutterEnds, "shutter_ends", 0.0, 0.45, false },
} };
}

#endif
