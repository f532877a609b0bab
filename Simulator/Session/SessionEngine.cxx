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

constexpr std::uint64_t CommandInterval = 2; // ticks between forces for the hands: 1 kHz at 2 kHz
constexpr double CatchUp =
  0.05; // s that a busy machine may hold the physics up without losing time

double SecondsSince(Clock::time_point start)
{
  return std::chrono::duration<double>(Clock::now() - start).count();
}
}

/// Those of the mux, and what a script chooses.
class SessionEngine::HandsSource : public TickSource
{
public:
  HandsSource(std::shared_ptr<DeviceMux> mux, DriveScript script, double tickRate)
    : Mux(std::move(mux))
    , Script(std::move(script))
    , Rate(tickRate)
  {
  }

  bool At(std::uint64_t /*tick*/, SessionInput& input, std::vector<RecordedEvent>& events) override
  {
    this->Read(&events);
    input = this->Raw;
    AxisPlaces places = PlacesOf(this->Raw);
    for (std::size_t axis = 0; axis < HandAxes; ++axis)
    {
      places[axis] -= this->Ignored[axis];
    }
    SetPlaces(input, places);
    return true;
  }

  /// What hands do now is not made up for afterwards; but C-arm and table are where they are.
  void Ignore()
  {
    const AxisPlaces before = PlacesOf(this->Raw);
    this->Read(nullptr);
    const AxisPlaces now = PlacesOf(this->Raw);
    for (std::size_t axis = 0; axis < HandAxes; ++axis)
    {
      this->Ignored[axis] += HandAxisTable[axis].group == ViewAxes ? 0.0 : now[axis] - before[axis];
    }
  }

private:
  void Read(std::vector<RecordedEvent>* events)
  {
    const double begin = static_cast<double>(this->Tick) / this->Rate;
    this->Raw = this->Mux->Next(this->Tick, 1.0 / this->Rate);
    ++this->Tick;
    const double end = static_cast<double>(this->Tick) / this->Rate;
    const std::vector<RecordedEvent> chosen = this->Script.Events(begin, end);
    this->Waiting.insert(this->Waiting.end(), chosen.begin(), chosen.end());
    if (events)
    {
      events->insert(events->end(), this->Waiting.begin(), this->Waiting.end());
      this->Waiting.clear();
    }
  }

  std::shared_ptr<DeviceMux> Mux;
  DriveScript Script;
  double Rate;
  SessionInput Raw;
  AxisPlaces Ignored{};               ///< what hands moved while time stood still
  std::vector<RecordedEvent> Waiting; ///< set while time stood still
  std::uint64_t Tick = 0;             ///< of the mux, which goes on
};

std::unique_ptr<TickSource> SessionEngine::MakeSource()
{
  if (!this->Options.replay.empty())
  {
    auto replay = std::make_unique<ReplaySource>(this->Options.replay);
    this->Recorded = &replay->Reader();
    return replay;
  }
  if (!this->Mux)
  {
    throw std::invalid_argument("A session needs devices, or a recording to replay.");
  }
  auto hands = std::make_unique<HandsSource>(this->Mux, this->Options.script, this->TickRate);
  this->Hands = hands.get();
  return hands;
}

SessionEngine::SessionEngine(
  const SessionWorld& world, std::shared_ptr<DeviceMux> mux, EngineOptions options)
  : Options(std::move(options))
  , TickRate(world.scenario.settings.tickRate)
  , Mux(std::move(mux))
  , Runner(world.wall, world.scenario, world.wallHash, this->MakeSource(), world.measured)
  , Imager(world.wall->Topology(), world.scenario, world.background, true, world.moving)
  , Runs(world.scenario, "coronary-simulator " DYNAMICCORONARY_VERSION)
  , TicksPerScene(std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(std::lround(this->TickRate / this->Options.sceneRate))))
{
  if (!this->Options.clock)
  {
    this->Options.clock = [start = Clock::now()] { return SecondsSince(start); };
  }
  this->Runner.say = [this](std::uint64_t tick, const std::string& text) { this->Say(tick, text); };
  this->Runner.afterTick = [this](const SessionReport& report) { this->AfterTick(report); };
  if (!this->Options.record.empty())
  {
    this->Runner.Record(
      this->Options.record, "coronary-simulator " DYNAMICCORONARY_VERSION, UtcTime());
  }
  this->Imager.Aim(this->Runner.Session().Pose(), this->Runner.Session().FieldOfView());
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
  if (!this->Failure.empty())
  {
    this->Runner.DropRecording();
    throw std::runtime_error(this->Failure);
  }
  this->Runner.FinishRecording();
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
  std::vector<std::string> taken;
  for (std::string message; this->Messages.Pop(message);)
  {
    taken.push_back(std::move(message));
  }
  return taken;
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
  const std::deque<XrayAngiogram>& stored = this->Runs.Runs();
  runs = stored.size();
  frames = run < runs ? stored[run].frames.size() : 0;
  if (frame >= frames)
  {
    return false;
  }
  image = { stored[run].columns, stored[run].rows, stored[run].frames[frame].pixels };
  return true;
}

bool SessionEngine::CineRun(std::size_t run, XrayAngiogram& whole) const
{
  const std::lock_guard<std::mutex> lock(this->ImagerMutex);
  if (run >= this->Runs.Runs().size())
  {
    return false;
  }
  whole = this->Runs.Runs()[run];
  return true;
}

void SessionEngine::Say(std::uint64_t tick, const std::string& text)
{
  char time[32];
  std::snprintf(time, sizeof(time), "%.1f s: ", static_cast<double>(tick) / this->TickRate);
  this->Messages.Push(time + text);
}

void SessionEngine::Fail(const std::string& why)
{
  {
    const std::lock_guard<std::mutex> lock(this->FailureMutex);
    this->Failure = this->Failure.empty() ? why : this->Failure; // the first is the cause
  }
  this->Over = true;
}

void SessionEngine::AfterTick(const SessionReport& report)
{
  const std::uint64_t tick = this->Runner.Tick();
  this->HashesCompared = this->Runner.Compared().compared;
  this->HashesEqual = this->Runner.Compared().equal;
  const TickReport& forces = report.tick;
  // Hands feel only what is sound.
  if (this->Mux && tick % CommandInterval == 0 && std::isfinite(forces.proximalForce) &&
    std::isfinite(forces.proximalTorque))
  {
    ForceFrame felt;
    felt.tick = tick;
    felt.wireForce = -forces.proximalForce;
    felt.wireTorque = -forces.proximalTorque;
    this->Mux->Command(felt);
    this->Mux->Heartbeat(tick);
  }
  if (report.exposed)
  {
    this->PublishExposure();
  }
  if (tick % this->TicksPerScene == 0)
  {
    this->PublishScene();
  }
}

/// The recording has nothing more to say.
void SessionEngine::EndReplay()
{
  if (this->Recorded && this->Recorded->HowEnded() != RecordingReader::Ending::Complete)
  {
    this->Say(this->Runner.Tick(), this->Recorded->EndingText() + ".");
  }
  this->PublishScene();
  this->Over = true;
}

void SessionEngine::PublishScene()
{
  this->Aim.Write({ this->Runner.Session().Pose(), this->Runner.Session().FieldOfView() });
  this->Runner.Session().SnapshotOfScene(this->Options.wallPoints, this->SceneBuffer);
  const std::unique_lock<std::mutex> lock(this->Scene.mutex, std::try_to_lock);
  if (lock)
  {
    std::swap(this->SceneBuffer, this->Scene.waiting);
    this->Scene.fresh = true;
  }
}

void SessionEngine::PublishExposure()
{
  this->Runner.Session().SnapshotOfImage(this->ExposureBuffer);
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
  for (auto n = std::lround((this->Options.clock() - start) * this->TickRate); n > 0 && this->Hands;
       --n)
  {
    this->Hands->Ignore();
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
        ticksBefore = this->Runner.Tick();
        worked = 0.0;
        second = time();
        continue;
      }
      const std::int64_t due = clock.Due(now - pausedFor);
      const double before = time();
      if (!this->Runner.Run(due))
      {
        this->EndReplay();
        return;
      }
      worked += time() - before;
      const double interval = time() - second;
      if (interval >= 1.0)
      {
        this->RateOfTicks = static_cast<double>(this->Runner.Tick() - ticksBefore) / interval;
        this->Load = worked / interval;
        this->Lost = clock.LostSeconds();
        ticksBefore = this->Runner.Tick();
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
        this->Runs.Add(moment, this->ImageBuffer.image, static_cast<ImageMode>(mode));
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
