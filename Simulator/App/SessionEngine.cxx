#include "SessionEngine.h"

#include "UtcTime.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
using Clock = std::chrono::steady_clock;

constexpr std::uint64_t ForceInterval = 40;  // ticks between recorded forces: 50 Hz at 2 kHz
constexpr std::uint64_t CommandInterval = 2; // ticks between forces for the hands: 1 kHz at 2 kHz
constexpr std::size_t MostMessages = 1000;   // that nobody has taken
constexpr double CatchUp =
  0.05; // s that a busy machine may hold the physics up without losing time

double SecondsSince(Clock::time_point start)
{
  return std::chrono::duration<double>(Clock::now() - start).count();
}
}

SessionEngine::SessionEngine(
  const SessionWorld& world, std::shared_ptr<DeviceMux> mux, EngineOptions options)
  : Options(std::move(options))
  , TickRate(world.scenario.settings.tickRate)
  , Mux(std::move(mux))
  , Session(world.wall, world.scenario)
  , Imager(world.wall->Topology(), world.scenario, world.background, true)
  , TicksPerScene(std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(std::lround(this->TickRate / this->Options.sceneRate))))
{
  if (!this->Options.clock)
  {
    this->Options.clock = [start = Clock::now()] { return SecondsSince(start); };
  }
  this->Input = this->Session.StartInput();
  if (!this->Options.replay.empty())
  {
    this->Replay = std::make_unique<RecordingReplay>(RecordingReader(this->Options.replay));
  }
  else if (!this->Mux)
  {
    throw std::invalid_argument("A session needs devices, or a recording to replay.");
  }
  if (!this->Options.record.empty())
  {
    this->Recorder = std::make_unique<RecordingWriter>(this->Options.record,
      HeaderOf(
        world.scenario, world.wallHash, "coronary-simulator " DYNAMICCORONARY_VERSION, UtcTime()));
  }
  this->Imager.Aim(this->Session.Pose(), this->Session.FieldOfView());
}

SessionEngine::~SessionEngine()
{
  this->Join();
}

void SessionEngine::Start()
{
  this->Physics = std::thread([this] { this->RunPhysics(); });
  this->Images = std::thread([this] { this->RunImages(); });
}

void SessionEngine::Join()
{
  this->Quit = true;
  this->ExposedCondition.notify_all();
  for (std::thread* thread : { &this->Physics, &this->Images })
  {
    if (thread->joinable())
    {
      thread->join();
    }
  }
}

void SessionEngine::Stop()
{
  this->Join();
  // Whatever happens now, it is over with the recording: without Finish() it leaves no file.
  const std::unique_ptr<RecordingWriter> recorder = std::move(this->Recorder);
  if (!this->Failure.empty())
  {
    throw std::runtime_error(this->Failure);
  }
  if (recorder)
  {
    if (this->TickNumber % RecordedHashInterval != 0)
    {
      recorder->StateHash(this->TickNumber, this->Session.StateHash());
    }
    recorder->Finish(this->TickNumber);
  }
}

void SessionEngine::Post(const RecordedEvent& event)
{
  const std::lock_guard<std::mutex> lock(this->EventMutex);
  this->Posted.push_back(event);
}

bool SessionEngine::LatestScene(SessionSnapshot& snapshot)
{
  const std::lock_guard<std::mutex> lock(this->Scene.mutex);
  const bool fresh = std::exchange(this->Scene.fresh, false);
  if (fresh)
  {
    std::swap(snapshot, this->Scene.waiting);
  }
  return fresh;
}

bool SessionEngine::LatestImage(ShownImage& image)
{
  const std::lock_guard<std::mutex> lock(this->Image.mutex);
  const bool fresh = std::exchange(this->Image.fresh, false);
  if (fresh)
  {
    std::swap(image, this->Image.waiting);
  }
  return fresh;
}

std::vector<std::string> SessionEngine::TakeMessages()
{
  const std::lock_guard<std::mutex> lock(this->MessageMutex);
  return std::exchange(this->Messages, {});
}

EngineRates SessionEngine::Rates() const
{
  return { this->RateOfTicks, this->Load, this->RateOfImages, this->ImageTime, this->LateImages,
    this->Lost };
}

bool SessionEngine::CineFrame(std::size_t run, std::size_t frame, GreyImage& image,
  std::size_t& runs, std::size_t& frames) const
{
  const std::lock_guard<std::mutex> lock(this->ImagerMutex);
  const auto& stored = this->Imager.Images().Runs();
  runs = stored.size();
  frames = run < runs ? stored[run].frames.size() : 0;
  if (frame >= frames)
  {
    return false;
  }
  image = stored[run].frames[frame];
  return true;
}

void SessionEngine::Say(std::uint64_t tick, const std::string& text)
{
  char time[32];
  std::snprintf(time, sizeof(time), "%.1f s: ", static_cast<double>(tick) / this->TickRate);
  const std::lock_guard<std::mutex> lock(this->MessageMutex);
  if (this->Messages.size() < MostMessages)
  {
    this->Messages.push_back(time + text);
  }
}

void SessionEngine::Fail(const std::string& why)
{
  {
    const std::lock_guard<std::mutex> lock(this->MessageMutex);
    this->Failure = this->Failure.empty() ? why : this->Failure; // the first is the cause
  }
  this->Over = true;
}

void SessionEngine::ApplyEvents()
{
  // Whoever posts holds the lock for a moment only; if it is now, the events come a tick later.
  const std::unique_lock<std::mutex> lock(this->EventMutex, std::try_to_lock);
  if (lock && !this->Posted.empty())
  {
    this->Events.insert(this->Events.end(), this->Posted.begin(), this->Posted.end());
    this->Posted.clear();
  }
}

/// Whether the hands may feel what was computed.
bool SessionEngine::Sound() const
{
  const TickReport& report = this->Session.Report().tick;
  return std::isfinite(report.proximalForce) && std::isfinite(report.proximalTorque);
}

void SessionEngine::ReadHands(bool ignored)
{
  const SessionInput before = this->Raw;
  const double begin = static_cast<double>(this->MuxTick) / this->TickRate;
  this->Raw = this->Mux->Next(this->MuxTick, 1.0 / this->TickRate);
  ++this->MuxTick;
  const double end = static_cast<double>(this->MuxTick) / this->TickRate;
  for (const double heartRate : this->Options.script.HeartRates(begin, end))
  {
    this->Events.push_back({ RecordedEvent::HeartRate, heartRate });
  }
  const auto each = [](auto change, SessionInput& to, const SessionInput& a, const SessionInput& b)
  {
    change(to.drive.wirePosition, a.drive.wirePosition, b.drive.wirePosition);
    change(to.drive.wireAngle, a.drive.wireAngle, b.drive.wireAngle);
    change(to.drive.catheterPosition, a.drive.catheterPosition, b.drive.catheterPosition);
    change(to.drive.catheterAngle, a.drive.catheterAngle, b.drive.catheterAngle);
    change(to.syringe, a.syringe, b.syringe);
  };
  if (ignored)
  {
    each([](double& sum, double now, double then) { sum += now - then; }, this->Ignored, this->Raw,
      before);
    return;
  }
  this->Input = this->Raw;
  each([](double& place, double now, double shift) { place = now - shift; }, this->Input, this->Raw,
    this->Ignored);
}

bool SessionEngine::Tick()
{
  if (this->Replay)
  {
    if (!this->Replay->At(this->TickNumber, this->Input, this->Events))
    {
      return false;
    }
  }
  else
  {
    this->ReadHands(false);
    this->ApplyEvents();
  }
  for (const RecordedEvent& event : this->Events)
  {
    this->Session.Apply(event);
    if (this->Recorder)
    {
      this->Recorder->Event(this->TickNumber, event);
    }
  }
  this->Events.clear();
  if (this->Recorder)
  {
    this->Recorder->Input(this->TickNumber, this->Input);
  }
  const SessionReport& report = this->Session.Step(this->Input);
  ++this->TickNumber;
  for (const std::string& text : this->Session.TakeMessages())
  {
    this->Say(this->TickNumber, text);
    if (this->Recorder)
    {
      this->Recorder->Annotation(this->TickNumber, text);
    }
  }
  if (this->Recorder && this->TickNumber % RecordedHashInterval == 0)
  {
    this->Recorder->StateHash(this->TickNumber, this->Session.StateHash());
  }
  std::uint64_t expected = 0;
  if (this->Replay && this->Replay->ExpectedHash(this->TickNumber, expected))
  {
    ++this->HashesCompared;
    this->HashesEqual += expected == this->Session.StateHash() ? 1 : 0;
  }
  const TickReport& forces = report.tick;
  if (this->Recorder && this->TickNumber % ForceInterval == 0)
  {
    this->Recorder->Force(this->TickNumber, ForcesOf(report.tick));
  }
  if (this->Mux && this->TickNumber % CommandInterval == 0 && this->Sound())
  {
    ForceFrame felt;
    felt.tick = this->TickNumber;
    felt.wireForce = -forces.proximalForce;
    felt.wireTorque = -forces.proximalTorque;
    this->Mux->Command(felt);
    this->Mux->Heartbeat(this->TickNumber);
  }
  if (report.exposed)
  {
    this->PublishExposure();
  }
  if (this->TickNumber % this->TicksPerScene == 0)
  {
    this->PublishScene();
  }
  return true;
}

/// The recording has nothing more to say.
void SessionEngine::EndReplay()
{
  const RecordingReader& reader = this->Replay->Reader();
  if (reader.HowEnded() != RecordingReader::Ending::Complete)
  {
    this->Say(this->TickNumber, reader.EndingText() + ".");
  }
  this->PublishScene();
  this->Over = true;
}

void SessionEngine::PublishScene()
{
  this->Aim.Write({ this->Session.Pose(), this->Session.FieldOfView() });
  this->Session.SnapshotOfScene(this->Options.wallPoints, this->SceneBuffer);
  const std::unique_lock<std::mutex> lock(this->Scene.mutex, std::try_to_lock);
  if (lock)
  {
    std::swap(this->SceneBuffer, this->Scene.waiting);
    this->Scene.fresh = true;
  }
}

void SessionEngine::PublishExposure()
{
  this->Session.SnapshotOfImage(this->ExposureBuffer);
  {
    const std::unique_lock<std::mutex> lock(this->Exposed.mutex, std::try_to_lock);
    if (!lock || this->Exposed.fresh)
    {
      ++this->LateImages;
    }
    if (!lock)
    {
      return;
    }
    std::swap(this->ExposureBuffer, this->Exposed.waiting);
    this->Exposed.fresh = true;
  }
  this->ExposedCondition.notify_one();
}

/// Time stands still for a moment. Hands are still read, so that what they do now is not made up for afterwards.
void SessionEngine::Rest()
{
  this->RateOfTicks = 0.0;
  this->Load = 0.0;
  const double start = this->Options.clock();
  std::this_thread::sleep_for(std::chrono::milliseconds(2));
  for (auto n = std::lround((this->Options.clock() - start) * this->TickRate); n > 0 && this->Mux;
       --n)
  {
    this->ReadHands(true);
  }
}

void SessionEngine::RunPhysics()
{
  FixedStepClock clock(this->TickRate, CatchUp);
  const std::function<double()>& time = this->Options.clock;
  double second = time();
  double worked = 0.0;
  std::uint64_t ticksBefore = 0;
  double pausedFor = 0.0;
  try
  {
    while (!this->Quit)
    {
      const double now = time();
      if (this->Paused)
      {
        this->Rest();
        pausedFor += time() - now;
        ticksBefore = this->TickNumber;
        worked = 0.0;
        second = time();
        continue;
      }
      const std::int64_t due = clock.Due(now - pausedFor);
      const double before = time();
      for (std::int64_t n = 0; n < due && !this->Quit; ++n)
      {
        if (!this->Tick())
        {
          this->EndReplay();
          return;
        }
      }
      worked += time() - before;
      const double interval = time() - second;
      if (interval >= 1.0)
      {
        this->RateOfTicks = static_cast<double>(this->TickNumber - ticksBefore) / interval;
        this->Load = worked / interval;
        this->Lost = clock.LostSeconds();
        ticksBefore = this->TickNumber;
        worked = 0.0;
        second = time();
      }
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
  }
  catch (const std::exception& error)
  {
    this->Fail(error.what());
  }
}

void SessionEngine::RunImages()
{
  SessionSnapshot moment;
  Clock::time_point second = Clock::now();
  double worked = 0.0;
  int made = 0;
  int mode = 0;
  try
  {
    while (!this->Quit)
    {
      {
        std::unique_lock<std::mutex> lock(this->Exposed.mutex);
        this->ExposedCondition.wait_for(lock, std::chrono::milliseconds(200),
          [this] { return this->Exposed.fresh || this->Quit; });
        if (std::exchange(this->Exposed.fresh, false))
        {
          std::swap(moment, this->Exposed.waiting);
        }
        else
        {
          moment.tick = 0;
        }
      }
      if (moment.tick > 0)
      {
        const Clock::time_point before = Clock::now();
        const std::lock_guard<std::mutex> lock(this->ImagerMutex);
        if (const int wanted = this->WantedMode; wanted != mode)
        {
          mode = wanted;
          this->Imager.Images().SetMode(static_cast<ImageMode>(mode));
        }
        if (this->MaskWanted.exchange(false))
        {
          this->Imager.Images().TakeMask();
        }
        this->ImageBuffer.image = this->Imager.Expose(moment);
        this->ImageBuffer.number = ++this->ImageNumber;
        this->ImageBuffer.completeness = this->Imager.BackgroundCompleteness();
        std::swap(this->ImageBuffer.moment, moment);
        worked += SecondsSince(before);
        ++made;
        const std::lock_guard<std::mutex> handing(this->Image.mutex);
        std::swap(this->ImageBuffer, this->Image.waiting);
        this->Image.fresh = true;
      }
      else if (View view; this->Aim.Read(view))
      {
        this->Imager.Aim(view.pose, view.fieldOfView);
      }
      const double interval = SecondsSince(second);
      if (interval >= 1.0)
      {
        this->RateOfImages = made / interval;
        this->ImageTime = made > 0 ? 1e3 * worked / made : 0.0;
        made = 0;
        worked = 0.0;
        second = Clock::now();
      }
    }
  }
  catch (const std::exception& error)
  {
    this->Fail(error.what());
  }
}
}
