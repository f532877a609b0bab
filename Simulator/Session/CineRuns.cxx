#include "CineRuns.h"

#include "Fnv1a.h"
#include "Numbers.h"
#include "SessionImager.h"

#include <cmath>
#include <cstdio>
#include <utility>

namespace coronary
{
CineRuns::CineRuns(const Scenario& scenario, std::string program, std::size_t memory)
  : Scenario_(scenario)
  , Program(std::move(program))
  , Memory(memory)
{
  const std::string text = ScenarioText(scenario);
  this->Study = Fnv1a(text.data(), text.size());
}

void CineRuns::Add(const SessionSnapshot& moment, const GreyImage& image, ImageMode mode)
{
  const double dose = moment.metrics.doseAreaProduct - this->LastDose;
  this->LastDose = moment.metrics.doseAreaProduct;
  if (!moment.exposure.cine)
  {
    this->Open = false;
    return;
  }
  const bool subtracted = mode != ImageMode::Plain;
  const XrayAngiogram* last = this->Open ? &this->Runs_.back() : nullptr;
  // A file has images of one size and kind.
  const bool goesOn = last && moment.exposure.run == this->LastRun &&
    moment.fieldOfView == last->width && last->columns == image.columns &&
    last->rows == image.rows && last->subtracted == subtracted &&
    last->sourceToDetector == moment.pose.sourceToDetector && this->LastShutters == moment.shutters;
  if (!goesOn)
  {
    this->Begin(moment, image, subtracted);
  }
  XrayAngiogram& run = this->Runs_.back();
  XrayAngiogram::Frame frame;
  frame.pixels = image.values;
  frame.primary = moment.pose.primary / Degree;
  frame.secondary = moment.pose.secondary / Degree;
  frame.isocentre = moment.pose.isocentre;
  frame.seconds = moment.seconds;
  frame.afterRWave = goesOn && moment.report.phase < this->LastPhase;
  this->LastPhase = moment.report.phase;
  const CArmGeometry geometry =
    GeometryOfHeart(moment, { run.columns, run.rows, run.width, run.height });
  for (const Vector3& marker : BalloonMarkers(moment, this->Scenario_))
  {
    const Vector3 place = geometry.Project(marker);
    frame.markers.push_back({ place.x(), place.y() });
  }
  run.areaDose += dose;
  run.contrast = moment.contrast.injected;
  run.frames.push_back(std::move(frame));
  this->Stored += image.values.size();
  this->KeepWithinMemory();
}

void CineRuns::Begin(const SessionSnapshot& moment, const GreyImage& image, bool subtracted)
{
  if (!this->StudyIsKnown)
  {
    // Sessions of one scenario differ by what was done in them.
    const std::uint64_t first = SessionImager::HashOf(image) ^ moment.tick;
    this->Study = Fnv1a(&first, sizeof(first), this->Study);
    this->StudyIsKnown = true;
  }
  XrayAngiogram run;
  run.patient = this->Scenario_.name;
  run.view = ViewName(moment.pose);
  run.program = this->Program;
  run.study = this->Study;
  run.run = static_cast<int>(moment.exposure.run);
  run.part = moment.exposure.run == this->LastRun ? this->LastPart + 1 : 1;
  run.columns = image.columns;
  run.rows = image.rows;
  run.width = moment.fieldOfView;
  run.height = moment.fieldOfView * image.rows / image.columns;
  run.frameRate = moment.exposure.frameRate;
  run.sourceToDetector = moment.pose.sourceToDetector;
  run.sourceToIsocentre = moment.pose.sourceToIsocentre;
  run.subtracted = subtracted;
  const auto covered = [](double share, int whole)
  { return static_cast<int>(std::lround(share * whole)); };
  run.shutterLeft = covered(moment.shutters.left, run.columns);
  run.shutterRight = covered(moment.shutters.right, run.columns);
  run.shutterTop = covered(moment.shutters.top, run.rows);
  run.shutterBottom = covered(moment.shutters.bottom, run.rows);
  this->LastShutters = moment.shutters;
  run.iodine = this->Scenario_.imaging.iodine;
  this->LastRun = moment.exposure.run;
  this->LastPart = run.part;
  this->Runs_.push_back(std::move(run));
  this->Open = true;
}

/// The newest frame stays.
void CineRuns::KeepWithinMemory()
{
  while (this->Stored > this->Memory)
  {
    XrayAngiogram& oldest = this->Runs_.front();
    if (this->Runs_.size() == 1 && oldest.frames.size() == 1)
    {
      return;
    }
    this->Stored -= oldest.frames.front().pixels.size();
    oldest.frames.erase(oldest.frames.begin());
    ++oldest.dropped;
    if (oldest.frames.empty())
    {
      this->Runs_.pop_front();
    }
  }
}

std::deque<XrayAngiogram> CineRuns::Take(bool all)
{
  std::deque<XrayAngiogram> taken = std::move(this->Runs_);
  this->Runs_.clear();
  this->Stored = 0;
  if (this->Open && !all)
  {
    this->Stored = taken.back().Bytes();
    this->Runs_.push_back(std::move(taken.back()));
    taken.pop_back();
  }
  this->Open = this->Open && !all;
  return taken;
}

std::string NameOfCineFile(const XrayAngiogram& run)
{
  char name[48];
  std::snprintf(
    name, sizeof(name), run.part > 1 ? "cine_%02d_%d.dcm" : "cine_%02d.dcm", run.run, run.part);
  return name;
}
}
