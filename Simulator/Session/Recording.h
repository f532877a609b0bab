/**
 * @file Recording.h
 * @brief What happened in a session, tick by tick, in a .pcirec file.
 *
 * Tick t is the t-th step of an Intervention, counted from 0: an input of tick t is what step t gets, an event of
 * tick t comes before step t, a hash of tick t is that of the state after t steps.
 */

/**
 * @page recordings Bytes of recordings (.pcirec)
 *
 * Numbers are little-endian. Ticks are steps counted from 0: an input of tick t goes into step t,
 * an event of tick t comes before it, everything else of tick t is of the state after t steps.
 *
 * - 8 bytes: `PCIREC`, 0, 2 (the version)
 * - 4 bytes: length of the header, at most 16 MiB
 * - the header, JSON: `schema` 1, `build`, `scenario` (complete, with the instruments' values),
 *   `scenario_hash`, `mesh_hash` (FNV-1a of the wall at three phases), `seed`, `tick_hz`, `axes`,
 *   `start_utc`; hashes and seed as 16 hexadecimal digits
 * - blocks: length of the packed bytes (4), of the unpacked ones (4, at most 1 MiB), then items,
 *   packed by zlib (RFC 1950), whose check sum tells damage
 *
 * A block ends with each state hash, or after 64 KiB. An item is its type (1), the length of its
 * payload (4), the ticks since the item before in the file (8), and the payload:
 *
 * - 1 input: mask of the numbers that changed (2 bytes), then for each of them, in the order of
 *   the header's `axes`, 8 bytes: wire position and angle, catheter position and angle, syringe
 *   (mL), C-arm primary and secondary angle (rad), source to detector (mm), table x, y, z (mm),
 *   all doubles; pedals (bits: 1 fluoroscopy, 2 cine, 4 mask), a whole number; inflation (atm) and
 *   balloon position (mm), doubles, which older recordings do not have. Written are the
 *   number's 64 bits less those before, modulo 2^64. A tick without change has none; before the
 *   first all are 0, source to detector 1100
 * - 2 force: four single-precision numbers: proximal force (N), proximal torque (N mm), tip force
 *   (N), greatest contact force (N); every 40 ticks
 * - 3 event: kind (1 byte), double. Kind 1: heart rate, beats a minute; 2: frames a second of
 *   fluoroscopy; 3: field of view, mm; 4: number of the balloon that is taken, 0 the scenario's
 *   first; 5: that of the wire, likewise; 6: breaths a minute, 0: the breath is held; 7: which of
 *   two wires the hand is on from now on, 0 or 1; 8: mL of saline through the guide, negative:
 *   drawn back; 9: number of the scenario's event, 0: nitrates; 10: share of the image that the left
 *   and the right shutter cover each; 11: the upper and the lower one
 * - 4 state hash: 8 bytes, FNV-1a of the instruments' state, and of contrast medium and exposures
 *   once there have been any; every 1000 ticks and at the end
 * - 5 image hash: 8 bytes, FNV-1a of an X-ray image's size and pixels; written with `--xray`
 * - 6 annotation: UTF-8 text: messages of the simulation
 * - 7 end: seven counts of 8 bytes: ticks, then items of the types 1 to 6
 *
 * Unknown types are skipped and counted, bytes at the end of a known payload ignored. No length in
 * a file makes the reader take more memory than the file has bytes, and a block. Version 1 is not
 * read any more.
 */
#ifndef DynamicCoronary_Recording_h
#define DynamicCoronary_Recording_h

#include "Fnv1a.h"
#include "RecordedEvent.h"
#include "SessionInput.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
class WallMotion;

/// 16 digits, as hashes are written.
std::string Hexadecimal(std::uint64_t value);

enum class RecordType : std::uint8_t
{
  Input = 1,
  Force = 2,
  Event = 3,
  StateHash = 4,
  ImageHash = 5,
  Annotation = 6,
  End = 7
};

/// In front of a recording.
struct RecordingHeader
{
  std::string build;          ///< program and its version
  std::string scenario;       ///< JSON of Scenario, complete
  std::uint64_t meshHash = 0; ///< WallHash of the wall
  std::uint64_t seed = 0;
  double tickRate = 0.0; ///< Hz
  std::string started;   ///< UTC, ISO 8601; may be empty
};

struct RecordedForces
{
  float proximalForce = 0.0F;  ///< N
  float proximalTorque = 0.0F; ///< N mm
  float tipForce = 0.0F;       ///< N
  float maximumForce = 0.0F;   ///< N
};

constexpr std::uint64_t RecordedHashInterval = 1000; ///< ticks between state hashes

/**
 * Writes a recording beside its name, flushed with every state hash, so that after a crash all but the last moments
 * are in a file that can be read; Finish() puts it under its name. Without Finish() it is removed.
 * Ticks must not decrease from call to call.
 * All throw std::runtime_error naming the file when it can not be written, std::invalid_argument for ticks that
 * decrease and texts above MostText bytes. Numbers keep their bits, whatever they say.
 */
class RecordingWriter
{
public:
  static constexpr std::size_t MostText = 65536;

  RecordingWriter(const std::string& path, const RecordingHeader& header);
  /// Into a stream, which has to live longer; Finish() flushes it.
  RecordingWriter(std::ostream& stream, const RecordingHeader& header);
  ~RecordingWriter();
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  /// Every tick; written when its bits are others than at the tick before (at first: those of SessionInput()).
  void Input(std::uint64_t tick, const SessionInput& input);
  void Force(std::uint64_t tick, const RecordedForces& forces);
  void Event(std::uint64_t tick, const RecordedEvent& event);
  void StateHash(std::uint64_t tick, std::uint64_t hash);
  void ImageHash(std::uint64_t tick, std::uint64_t hash);
  void Annotation(std::uint64_t tick, const std::string& text);

  /// @param ticks  steps in all
  void Finish(std::uint64_t ticks);

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};

/// One thing that was recorded.
struct RecordedItem
{
  RecordType type = RecordType::End;
  std::uint64_t tick = 0;
  SessionInput input;     ///< of Input
  RecordedForces forces;  ///< of Force
  RecordedEvent event;    ///< of Event
  std::uint64_t hash = 0; ///< of StateHash, ImageHash
  std::string text;       ///< of Annotation
  std::array<std::uint64_t, 8>
    counts{}; ///< of End: ticks at [0], then what was written of each type
};

/**
 * Reads item by item, and holds no more than one block. A file that breaks off, or whose bytes are damaged, is good up
 * to the block before.
 */
class RecordingReader
{
public:
  enum class Ending
  {
    NotYet,   ///< Next() has not come to the end
    Complete, ///< with its end and all that it counts
    Torn,     ///< the file stops too early
    Damaged   ///< a block is not what it should be; all before it was good
  };

  /// @throws std::runtime_error naming the file: not there, no recording, of another version, a broken header
  explicit RecordingReader(const std::string& path);
  /// @param origin  for messages, in quotes
  RecordingReader(std::unique_ptr<std::istream> stream, const std::string& origin);
  ~RecordingReader();
  RecordingReader(RecordingReader&&) noexcept;
  RecordingReader& operator=(RecordingReader&&) noexcept;

  const RecordingHeader& Header() const;

  /// @return false at the end, whichever it is
  bool Next(RecordedItem& item);

  Ending HowEnded() const;
  std::string EndingText() const; ///< for people
  std::uint64_t Unknown() const;  ///< items of unknown type, skipped
  std::uint64_t Bytes() const;    ///< that were good

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};

/// Goes through a recording tick by tick.
class RecordingReplay
{
public:
  explicit RecordingReplay(RecordingReader reader);

  const RecordingReader& Reader() const { return this->Source; }

  /**
   * What step `tick` gets; call it with 0, 1, 2, ...
   * @param events  those before the step; cleared first
   * @return false when the recording has nothing for this tick any more: it has ended
   */
  bool At(std::uint64_t tick, SessionInput& input, std::vector<RecordedEvent>& events);

  /// Whether a hash was recorded of the state after `tick` steps; call it after At(tick - 1).
  bool ExpectedHash(std::uint64_t tick, std::uint64_t& hash);

private:
  /// @param step  with what step `tick` gets; else only what is of the state before it
  void ReadUpTo(std::uint64_t tick, bool step);

  RecordingReader Source;
  RecordedItem Ahead;
  bool HasAhead = false;
  bool Over = false;
  std::uint64_t Ticks = 0; ///< of the end; without one: after the last good item
  SessionInput Current;
  std::vector<RecordedEvent> Pending;
  std::map<std::uint64_t, std::uint64_t> Hashes; ///< that nobody has asked for yet
};

/// FNV-1a over the topology and the points at a few phases: tells models apart.
std::uint64_t WallHash(WallMotion& wall);
}

#endif
