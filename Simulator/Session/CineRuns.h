/**
 * @file CineRuns.h
 * @brief The cine runs of a session: their images as they were shown, and how each was made.
 */
#ifndef DynamicCoronary_CineRuns_h
#define DynamicCoronary_CineRuns_h

#include "Detector.h"
#include "FluoroscopyImager.h"
#include "Scenario.h"
#include "TrainingSession.h"
#include "XrayAngiogram.h"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>

namespace coronary
{
/// Used by one thread.
class CineRuns
{
public:
  static constexpr std::size_t DefaultMemory = std::size_t(256) << 20;

  /// @param program  and version, for the files  @param memory  bytes of frames; at least one is kept
  CineRuns(const Scenario& scenario, std::string program, std::size_t memory = DefaultMemory);

  /// An exposure and its image, of every kind: fluoroscopy ends a run.
  void Add(const SessionSnapshot& moment, const GreyImage& image, ImageMode mode);

  /// In the order of exposure. The oldest frames are dropped first, and runs without frames.
  const std::deque<XrayAngiogram>& Runs() const { return this->Runs_; }
  std::size_t Bytes() const { return this->Stored; }

  /**
   * Runs that nothing is added to any more; they are not kept.
   * @param all  the last one, too: what is added to it later is another part of it
   */
  std::deque<XrayAngiogram> Take(bool all);

private:
  void Begin(const SessionSnapshot& moment, const GreyImage& image, bool subtracted);
  void KeepWithinMemory();

  Scenario Scenario_;
  Collimation LastShutters;
  std::string Program;
  std::size_t Memory;
  std::uint64_t Study;
  bool StudyIsKnown = false;
  std::deque<XrayAngiogram> Runs_;
  bool Open = false; ///< the last one is added to
  std::int64_t LastRun = 0;
  int LastPart = 0;
  double LastPhase = 0.0;
  double LastDose = 0.0; ///< Gy cm^2
  std::size_t Stored = 0;
};

/// cine_01.dcm, or cine_01_2.dcm for the second part of a run.
std::string NameOfCineFile(const XrayAngiogram& run);
}

#endif
