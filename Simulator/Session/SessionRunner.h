/**
 * @file SessionRunner.h
 * @brief A session from its first tick to its last: hands and events in, recording and reports out. In a window or without.
 */
#ifndef DynamicCoronary_SessionRunner_h
#define DynamicCoronary_SessionRunner_h

#include "DriveScript.h"
#include "Recording.h"
#include "TrainingSession.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
/// Where the hands' movements come from.
class TickSource
{
public:
  virtual ~TickSource() = default;

  /**
   * What step `tick` gets; asked for 0, 1, 2, ...
   * @param input   as at the tick before
   * @param events  those before the step are added
   * @return false: it is over
   */
  virtual bool At(std::uint64_t tick, SessionInput& input, std::vector<RecordedEvent>& events) = 0;

  /// Whether the state after so many steps is known. @param hash  that it has to have
  virtual bool ExpectedHash(std::uint64_t /*tick*/, std::uint64_t& /*hash*/) { return false; }
};

/// Goes through a recording.
class ReplaySource : public TickSource
{
public:
  /// @throws as RecordingReader
  explicit ReplaySource(const std::string& path)
    : Replay(RecordingReader(path))
  {
  }

  const RecordingReader& Reader() const { return this->Replay.Reader(); }
  bool At(std::uint64_t tick, SessionInput& input, std::vector<RecordedEvent>& events) override;
  bool ExpectedHash(std::uint64_t tick, std::uint64_t& hash) override;

private:
  RecordingReplay Replay;
  std::vector<RecordedEvent> Recorded;
};

/// Goes through a script.
class ScriptSource : public TickSource
{
public:
  /// @param start  before the first piece  @param endless  the hands rest when the script is over, and time goes on
  ScriptSource(DriveScript script, const SessionInput& start, double tickRate, bool endless);

  bool At(std::uint64_t tick, SessionInput& input, std::vector<RecordedEvent>& events) override;

private:
  DriveScript Script;
  SessionInput Start;
  double Rate;
  bool Endless;
};

/// The state held against a recording.
struct HashComparison
{
  std::uint64_t compared = 0;
  std::uint64_t equal = 0;
  std::uint64_t firstDifference = 0; ///< tick; 0: none
};

/**
 * Deterministic, on one thread, without a clock: whoever drives it says how many ticks are due. Post() is for one other thread;
 * nobody waits for anybody.
 */
class SessionRunner
{
public:
  /// @param patient  as TrainingSession's; a recording says whether there was one  @throws as TrainingSession
  SessionRunner(std::shared_ptr<WallMotion> wall, const Scenario& scenario, std::uint64_t wallHash,
    std::unique_ptr<TickSource> source, std::shared_ptr<const VolumeProjector> patient = nullptr);

  ///@{
  /// Set before the first tick; may be empty.
  std::function<void(const SessionReport&)> afterTick; ///< what is recorded of the tick is recorded
  std::function<void(std::uint64_t tick, const std::string& text)> say; ///< what the session says
  ///@}
  std::uint64_t maximumTicks = 0; ///< 0: as many as the source has

  /// Before the first tick. @param build  program and version  @throws as RecordingWriter
  void Record(const std::string& path, const std::string& build, const std::string& started);
  /// Null: nothing is recorded.
  RecordingWriter* Recording() { return this->Writer.get(); }

  /// Steps of 1 / tickRate. @return false: the source is over
  bool Run(std::int64_t ticks);

  /// Comes before the next tick, whatever the source; of each kind the last one. A replay that is changed like this is not
  /// compared any more.
  void Post(const RecordedEvent& event);

  /// The last hash and the end of the recording. @throws as RecordingWriter
  void FinishRecording();
  /// Leaves no file.
  void DropRecording() { this->Writer.reset(); }

  const TrainingSession& Session() const { return this->Training; }
  std::uint64_t Tick() const { return this->Number; } ///< steps done
  std::uint64_t StateHash();                          ///< of now; made once a tick
  const HashComparison& Compared() const { return this->Comparison; }
  std::uint64_t UnknownEvents() const { return this->Unknown; }

private:
  static constexpr std::size_t EventKinds = RecordedEvent::Incident + 1; // the last kind

  bool Step();
  void TakePosted();
  void Say(const std::string& text);

  TrainingSession Training;
  Scenario Setting;
  std::uint64_t WallHash;
  std::unique_ptr<TickSource> Source;
  std::unique_ptr<RecordingWriter> Writer;
  SessionInput Input;
  std::vector<RecordedEvent> Events;
  std::array<std::atomic<double>, EventKinds> Posted; ///< by kind; not a number: none
  std::uint64_t Number = 0;
  std::uint64_t Unknown = 0;
  bool Changed = false; ///< by what was posted
  HashComparison Comparison;
  std::uint64_t Hash = 0;
  std::uint64_t HashedTick = ~std::uint64_t{ 0 };
};
}

#endif
