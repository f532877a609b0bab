#include "SessionRunner.h"

#include <cmath>
#include <limits>
#include <utility>

namespace coronary
{
namespace
{
constexpr std::uint64_t ForceInterval = 40; // ticks between recorded forces: 50 Hz at 2 kHz
constexpr double Nothing = std::numeric_limits<double>::quiet_NaN();
}

bool ReplaySource::At(std::uint64_t tick, SessionInput& input, std::vector<RecordedEvent>& events)
{
  const bool goesOn = this->Replay.At(tick, input, this->Recorded);
  events.insert(events.end(), this->Recorded.begin(), this->Recorded.end());
  return goesOn;
}

bool ReplaySource::ExpectedHash(std::uint64_t tick, std::uint64_t& hash)
{
  return this->Replay.ExpectedHash(tick, hash);
}

ScriptSource::ScriptSource(
  DriveScript script, const SessionInput& start, double tickRate, bool endless)
  : Script(std::move(script))
  , Start(start)
  , Rate(tickRate)
  , Endless(endless)
{
}

bool ScriptSource::At(std::uint64_t tick, SessionInput& input, std::vector<RecordedEvent>& events)
{
  // The place at the end of the step, so that a piece is over when its ticks are.
  const double begin = static_cast<double>(tick) / this->Rate;
  const double end = static_cast<double>(tick + 1) / this->Rate;
  input = this->Script.At(end, this->Start);
  const std::vector<RecordedEvent> chosen = this->Script.Events(begin, end);
  events.insert(events.end(), chosen.begin(), chosen.end());
  return this->Endless || tick < this->Script.Ticks(this->Rate);
}

SessionRunner::SessionRunner(std::shared_ptr<WallMotion> wall, const Scenario& scenario,
  std::uint64_t wallHash, std::unique_ptr<TickSource> source,
  std::shared_ptr<const VolumeProjector> patient)
  : Training(std::move(wall), scenario, patient)
  , Setting(scenario)
  , WallHash(wallHash)
  , Source(std::move(source))
  , Input(this->Training.StartInput())
{
  this->Setting.imaging.exposureControl = scenario.imaging.exposureControl && patient;
  for (std::atomic<double>& posted : this->Posted)
  {
    posted = Nothing;
  }
}

void SessionRunner::Record(
  const std::string& path, const std::string& build, const std::string& started)
{
  this->Writer = std::make_unique<RecordingWriter>(
    path, HeaderOf(this->Setting, this->WallHash, build, started));
}

void SessionRunner::Post(const RecordedEvent& event)
{
  if (event.kind < EventKinds)
  {
    this->Posted[event.kind] = event.value;
  }
}

void SessionRunner::TakePosted()
{
  for (std::size_t kind = 0; kind < EventKinds; ++kind)
  {
    const double value = this->Posted[kind].exchange(Nothing);
    if (std::isnan(value))
    {
      continue;
    }
    this->Events.push_back({ static_cast<std::uint8_t>(kind), value });
    if (!std::exchange(this->Changed, true) && this->Comparison.compared > 0)
    {
      this->Say("The replay is changed by hand: it is not compared any more.");
    }
  }
}

void SessionRunner::Say(const std::string& text)
{
  if (this->say)
  {
    this->say(this->Number, text);
  }
  if (this->Writer)
  {
    this->Writer->Annotation(this->Number, text);
  }
}

bool SessionRunner::Run(std::int64_t ticks)
{
  for (std::int64_t n = 0; n < ticks; ++n)
  {
    if (!this->Step())
    {
      return false;
    }
  }
  return true;
}

bool SessionRunner::Step()
{
  this->Events.clear();
  if ((this->maximumTicks > 0 && this->Number >= this->maximumTicks) ||
    !this->Source->At(this->Number, this->Input, this->Events))
  {
    return false;
  }
  this->TakePosted();
  for (const RecordedEvent& event : this->Events)
  {
    this->Unknown += this->Training.Apply(event) ? 0 : 1;
    if (this->Writer)
    {
      this->Writer->Event(this->Number, event);
    }
  }
  if (this->Writer)
  {
    this->Writer->Input(this->Number, this->Input);
  }
  const SessionReport& report = this->Training.Step(this->Input);
  ++this->Number; // what follows is of the state after this many steps
  for (const std::string& text : this->Training.TakeMessages())
  {
    this->Say(text);
  }
  if (this->Writer && this->Number % RecordedHashInterval == 0)
  {
    this->Writer->StateHash(this->Number, this->StateHash());
  }
  if (std::uint64_t wanted = 0; this->Source->ExpectedHash(this->Number, wanted) && !this->Changed)
  {
    const bool same = wanted == this->StateHash();
    ++this->Comparison.compared;
    this->Comparison.equal += same ? 1 : 0;
    if (!same && this->Comparison.firstDifference == 0)
    {
      this->Comparison.firstDifference = this->Number;
    }
  }
  if (this->Writer && this->Number % ForceInterval == 0)
  {
    this->Writer->Force(this->Number, ForcesOf(report.tick));
  }
  if (this->afterTick)
  {
    this->afterTick(report);
  }
  return true;
}

std::uint64_t SessionRunner::StateHash()
{
  if (this->HashedTick != this->Number)
  {
    this->Hash = this->Training.StateHash();
    this->HashedTick = this->Number;
  }
  return this->Hash;
}

void SessionRunner::FinishRecording()
{
  // Whatever happens now, it is over with the recording: without Finish() it leaves no file.
  const std::unique_ptr<RecordingWriter> writer = std::move(this->Writer);
  if (!writer)
  {
    return;
  }
  if (this->Number % RecordedHashInterval != 0)
  {
    writer->StateHash(this->Number, this->StateHash());
  }
  writer->Finish(this->Number);
}
}
