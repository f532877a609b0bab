/**
 * @file SessionEngine.h
 * @brief A session in real time: one thread for the physics, one for the X-ray images.
 */
#ifndef DynamicCoronary_SessionEngine_h
#define DynamicCoronary_SessionEngine_h

#include "CineRuns.h"
#include "DeviceMux.h"
#include "DriveScript.h"
#include "FixedStepClock.h"
#include "RingQueue.h"
#include "SessionImager.h"
#include "SessionRunner.h"
#include "SessionWorld.h"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace coronary
{
struct EngineOptions
{
  std::string record; ///< recording to write; empty: none
  std::string replay; ///< recording that takes the place of all hands; empty: none
  DriveScript script; ///< its heart rates are set; its hands are a ScriptDevice of the mux
  std::vector<std::int64_t> wallPoints; ///< of SessionSnapshot::wall
  double sceneRate = 30.0;              ///< snapshots for the scene a second
  std::function<double()>
    clock; ///< s, never less than before: what the physics keeps up with; empty: real time
};

/// How well real time is kept.
struct EngineRates
{
  double ticks = 0.0;             ///< a second, over the last second
  double load = 0.0;              ///< part of that second that the physics worked
  double images = 0.0;            ///< X-ray images a second, over the last second
  double imageMilliseconds = 0.0; ///< mean time to make one
  std::uint64_t lateImages =
    0;                      ///< exposures that were overtaken by the next one before they were made
  double lostSeconds = 0.0; ///< by which the simulation is behind real time for good
};

/// An X-ray image with what belongs around it.
struct ShownImage
{
  GreyImage image;
  std::uint64_t number = 0;  ///< goes up with every image
  double completeness = 0.0; ///< of the background
  SessionSnapshot moment;    ///< that was exposed; without scene
};

/**
 * The devices' input goes to the session tick by tick, in real time; what it says is kept for whoever draws. All
 * functions are for one thread, that of the window.
 */
class SessionEngine
{
public:
  /// @param mux  its Next(), Command(), Heartbeat() are this engine's until it is destroyed; null with replay
  /// @throws as TrainingSession, RecordingWriter, RecordingReader
  SessionEngine(const SessionWorld& world, std::shared_ptr<DeviceMux> mux, EngineOptions options);
  /// Ends the session; a recording that was not finished by Stop() is thrown away.
  ~SessionEngine();
  SessionEngine(const SessionEngine&) = delete;
  SessionEngine& operator=(const SessionEngine&) = delete;

  void Start();

  /// Ends the session and finishes its recording.
  /// @throws std::runtime_error  the recording could not be written, or the session had failed: no recording is left
  void Stop();

  /// Simulated time stands still.
  void SetPaused(bool paused) { this->Paused = paused; }
  bool IsPaused() const { return this->Paused; }
  bool IsOver() const { return this->Over; } ///< the replay has ended, or the session failed

  /// As SessionRunner::Post.
  void Post(const RecordedEvent& event) { this->Runner.Post(event); }

  ///@{
  /// Of the images; from the next one on.
  void SetImageMode(ImageMode mode) { this->WantedMode = static_cast<int>(mode); }
  void TakeMask() { this->MaskWanted = true; }
  ///@}

  /// @return false: nothing new since the last call
  bool LatestScene(SessionSnapshot& snapshot);
  bool LatestImage(ShownImage& image);

  /// Of the scenario's procedure. After Stop().
  ProcedureScore Score() const { return this->Runner.Session().Score(); }

  /// What the session said since the last call, a sentence each, with its second.
  std::vector<std::string> TakeMessages();

  EngineRates Rates() const;

  /// Cine runs, while nothing is exposed. @return false: no such frame
  bool CineFrame(std::size_t run, std::size_t frame, GreyImage& image, std::size_t& runs,
    std::size_t& frames) const;
  /// All of a run. @return false: no such run
  bool CineRun(std::size_t run, XrayAngiogram& whole) const;

  /// Compared and equal state hashes of a replay.
  std::pair<std::uint64_t, std::uint64_t> ReplayHashes() const
  {
    return { this->HashesCompared, this->HashesEqual };
  }

private:
  /// What one thread hands to another; the lock is held for a swap.
  template <typename T>
  struct Mailbox
  {
    std::mutex mutex;
    T waiting;
    bool fresh = false;
  };

  /// What the C-arm looks at while nothing is exposed.
  struct View
  {
    CArmPose pose;
    double fieldOfView = 0.0;
  };

  void Join();
  void RunPhysics();
  void RunImages();
  void Rest();
  void AfterTick(const SessionReport& report);
  void EndReplay();
  void Say(std::uint64_t tick, const std::string& text);
  void PublishScene();
  void PublishExposure();
  void Fail(const std::string& why);

  class HandsSource;
  std::unique_ptr<TickSource> MakeSource();

  EngineOptions Options;
  double TickRate;
  std::shared_ptr<DeviceMux> Mux;
  HandsSource* Hands = nullptr;              ///< of the runner; null with replay
  const RecordingReader* Recorded = nullptr; ///< likewise, with replay
  SessionRunner Runner;
  SessionImager Imager;
  CineRuns Runs; ///< as the imager, under ImagerMutex
  std::uint64_t TicksPerScene;

  std::thread Physics;
  std::thread Images;
  std::atomic<bool> Quit{ false };
  std::atomic<bool> Paused{ false };
  std::atomic<bool> Over{ false };
  std::atomic<int> WantedMode{ 0 };
  std::atomic<bool> MaskWanted{ false };

  RingQueue<std::string, 1000> Messages; ///< of the physics, that nobody has taken
  std::mutex FailureMutex;
  std::string Failure;

  SessionSnapshot SceneBuffer;
  Mailbox<SessionSnapshot> Scene;
  SessionSnapshot ExposureBuffer;
  Mailbox<SessionSnapshot> Exposed;
  std::condition_variable ExposedCondition;
  TripleBuffer<View> Aim;
  mutable std::mutex ImagerMutex;
  ShownImage ImageBuffer;
  Mailbox<ShownImage> Image;
  std::uint64_t ImageNumber = 0;

  std::atomic<double> RateOfTicks{ 0.0 };
  std::atomic<double> Load{ 0.0 };
  std::atomic<double> RateOfImages{ 0.0 };
  std::atomic<double> ImageTime{ 0.0 };
  std::atomic<std::uint64_t> LateImages{ 0 };
  std::atomic<double> Lost{ 0.0 };
  std::atomic<std::uint64_t> HashesCompared{ 0 };
  std::atomic<std::uint64_t> HashesEqual{ 0 };
};
}

#endif
