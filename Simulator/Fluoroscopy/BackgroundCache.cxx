#include "BackgroundCache.h"

#include "Numbers.h"
#include "Require.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <list>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace coronary
{
namespace
{
// Pixels between two looks at whether the geometry is still wanted: a millisecond or so.
constexpr int PixelsOfTile = 1024;

using ImagePointer = std::shared_ptr<const LineIntegrals>;

bool SameView(const CArmGeometry& a, const CArmGeometry& b)
{
  return a.Pose() == b.Pose() && a.Format() == b.Format();
}

std::size_t BytesOf(const LineIntegrals& image)
{
  return image.values.size() * sizeof(float);
}

/// Bands of rows, those in the middle first.
std::vector<PixelRectangle> BandsOf(const DetectorFormat& format, int rows)
{
  std::vector<PixelRectangle> bands;
  for (int row = 0; row < format.rows; row += rows)
  {
    bands.push_back({ 0, row, format.columns, std::min(rows, format.rows - row) });
  }
  const auto fromMiddle = [&](const PixelRectangle& band)
  { return std::abs(2 * band.row + band.rows - format.rows); };
  std::stable_sort(bands.begin(), bands.end(),
    [&](const PixelRectangle& a, const PixelRectangle& b)
    { return fromMiddle(a) < fromMiddle(b); });
  return bands;
}

struct Finished
{
  CArmGeometry geometry;
  ImagePointer image;
};
}

struct BackgroundCache::Implementation
{
  std::shared_ptr<const VolumeProjector> projector;
  BackgroundCacheSettings settings;

  mutable std::mutex mutex; // of all that follows but `generation`
  std::condition_variable wake;
  mutable std::condition_variable done;
  std::optional<CArmGeometry> wanted;
  std::uint64_t begun = 0; // the generation that the worker is at or has been at
  bool quit = false;
  ImagePointer current;
  double completeness = 0.0;
  std::exception_ptr error;
  std::list<Finished> kept; // the last used one first
  BackgroundCacheCounts counts;

  /// Of the wanted geometry; written under the lock.
  std::atomic<std::uint64_t> generation{ 0 };
  std::thread worker;

  bool IsStale(std::uint64_t of) const { return this->generation.load() != of; }
  bool TakeKept(const CArmGeometry& geometry);
  bool Publish(std::uint64_t of, ImagePointer image, double fraction);
  void Keep(const CArmGeometry& geometry, const ImagePointer& image);
  void Finish(std::uint64_t of, const CArmGeometry& geometry, const ImagePointer& image);
  bool Refine(std::uint64_t of, const CArmGeometry& geometry, const PixelRectangle& band,
    LineIntegrals& image) const;
  LineIntegrals Preview(const CArmGeometry& geometry) const;
  bool Make(std::uint64_t of, const CArmGeometry& geometry);
  void Work();
};

/// Under the lock.
bool BackgroundCache::Implementation::TakeKept(const CArmGeometry& geometry)
{
  const auto found = std::find_if(this->kept.begin(), this->kept.end(),
    [&](const Finished& finished) { return SameView(finished.geometry, geometry); });
  if (found == this->kept.end())
  {
    return false;
  }
  this->kept.splice(this->kept.begin(), this->kept, found);
  this->current = found->image;
  this->completeness = 1.0;
  ++this->counts.hits;
  return true;
}

bool BackgroundCache::Implementation::Publish(std::uint64_t of, ImagePointer image, double fraction)
{
  const std::lock_guard<std::mutex> lock(this->mutex);
  const bool stale = this->IsStale(of);
  // Of a geometry that the C-arm has left since it is still nearer than what was there before, unless that is the wanted
  // one's own.
  const bool sameSize =
    image->columns == this->wanted->Format().columns && image->rows == this->wanted->Format().rows;
  if (!stale || (this->completeness == 0.0 && sameSize))
  {
    // What was shown is destroyed without the lock, by the argument's end.
    std::swap(this->current, image);
    this->completeness = stale ? 0.0 : fraction;
  }
  return !stale;
}

/// Under the lock.
void BackgroundCache::Implementation::Keep(const CArmGeometry& geometry, const ImagePointer& image)
{
  const std::size_t bytes = BytesOf(*image);
  if (bytes > this->settings.memory)
  {
    return;
  }
  while (this->counts.bytes + bytes > this->settings.memory)
  {
    this->counts.bytes -= BytesOf(*this->kept.back().image);
    this->kept.pop_back();
  }
  this->kept.push_front({ geometry, image });
  this->counts.bytes += bytes;
}

/// A finished image is kept even if it is not wanted any more.
void BackgroundCache::Implementation::Finish(
  std::uint64_t of, const CArmGeometry& geometry, const ImagePointer& image)
{
  const std::lock_guard<std::mutex> lock(this->mutex);
  ++this->counts.finished;
  const bool known = std::any_of(this->kept.begin(), this->kept.end(),
    [&](const Finished& finished) { return SameView(finished.geometry, geometry); });
  if (!known)
  {
    this->Keep(geometry, image);
  }
  if (!this->IsStale(of))
  {
    this->current = image;
    this->completeness = 1.0;
    this->done.notify_all();
  }
}

/// @return false when the geometry is not wanted any more
bool BackgroundCache::Implementation::Refine(std::uint64_t of, const CArmGeometry& geometry,
  const PixelRectangle& band, LineIntegrals& image) const
{
  const int columns = std::max(8, PixelsOfTile / band.rows / 8 * 8);
  for (int column = 0; column < band.columns; column += columns)
  {
    if (this->IsStale(of))
    {
      return false;
    }
    this->projector->ProjectRectangle(geometry, { column, band.row, columns, band.rows }, image);
  }
  return true;
}

/// Coarse, with the size of the fine image. Always made to its end: while the C-arm moves on with every frame there would
/// else never be one.
LineIntegrals BackgroundCache::Implementation::Preview(const CArmGeometry& geometry) const
{
  const DetectorFormat& format = geometry.Format();
  DetectorFormat coarse = format;
  coarse.columns = std::min(format.columns, this->settings.previewSize);
  coarse.rows = std::min(format.rows, this->settings.previewSize);
  const CArmGeometry coarseGeometry(geometry.Pose(), coarse);
  LineIntegrals image(coarse.columns, coarse.rows);
  this->projector->ProjectRectangle(coarseGeometry, { 0, 0, coarse.columns, coarse.rows }, image);
  return Resampled(image, format.columns, format.rows);
}

/// @return false when the geometry is not wanted any more
bool BackgroundCache::Implementation::Make(std::uint64_t of, const CArmGeometry& geometry)
{
  LineIntegrals image = this->Preview(geometry);
  const DetectorFormat& format = geometry.Format();
  const double rowsOfPreview = std::min(format.rows, this->settings.previewSize);
  const double columnsOfPreview = std::min(format.columns, this->settings.previewSize);
  const double preview =
    std::min(0.99, rowsOfPreview * columnsOfPreview / (double(format.rows) * format.columns));
  int rows = 0;
  for (const PixelRectangle& band : BandsOf(format, this->settings.bandRows))
  {
    const double fraction = std::max(preview, double(rows) / format.rows);
    if (!this->Publish(of, std::make_shared<const LineIntegrals>(image), fraction) ||
      !this->Refine(of, geometry, band, image))
    {
      return false;
    }
    rows += band.rows;
  }
  this->Finish(of, geometry, std::make_shared<const LineIntegrals>(std::move(image)));
  return true;
}

void BackgroundCache::Implementation::Work()
{
  std::unique_lock<std::mutex> lock(this->mutex);
  for (;;)
  {
    this->wake.wait(lock,
      [this] {
        return this->quit || (this->begun != this->generation.load() && this->completeness < 1.0);
      });
    if (this->quit)
    {
      return;
    }
    const std::uint64_t of = this->generation.load();
    const CArmGeometry geometry = *this->wanted;
    this->begun = of;
    lock.unlock();
    bool finished = true;
    std::exception_ptr failure;
    try
    {
      finished = this->Make(of, geometry);
    }
    catch (...)
    {
      failure = std::current_exception();
    }
    lock.lock();
    this->counts.cancelled += finished ? 0 : 1;
    if (failure && !this->IsStale(of))
    {
      this->error = failure;
      this->done.notify_all();
    }
  }
}

BackgroundCache::BackgroundCache(
  std::shared_ptr<const VolumeProjector> projector, const BackgroundCacheSettings& settings)
  : Data(std::make_unique<Implementation>())
{
  constexpr RequireOf require{ "background" };
  require(projector != nullptr, "there is no projector");
  require(settings.previewSize >= 8 && settings.previewSize <= 8192,
    "the preview's size has to be within 8 to 8192");
  require(settings.bandRows >= 8 && settings.bandRows <= 8192,
    "a band's rows have to be within 8 to 8192");
  require(settings.angleStep > 0.0 && settings.angleStep <= 0.1,
    "the step of angles has to be positive, and at most 0.1 radians");
  require(settings.lengthStep > 0.0 && settings.lengthStep <= 10.0,
    "the step of lengths has to be positive, and at most 10 mm");
  this->Data->projector = std::move(projector);
  this->Data->settings = settings;
  if (settings.worker)
  {
    this->Data->worker = std::thread([this] { this->Data->Work(); });
  }
}

BackgroundCache::~BackgroundCache()
{
  {
    const std::lock_guard<std::mutex> lock(this->Data->mutex);
    this->Data->quit = true;
    ++this->Data->generation;
  }
  this->Data->wake.notify_all();
  if (this->Data->worker.joinable())
  {
    this->Data->worker.join();
  }
}

void BackgroundCache::SetGeometry(const CArmGeometry& geometry)
{
  Implementation& data = *this->Data;
  const CArmGeometry rounded = this->Rounded(geometry);
  std::uint64_t generation = 0;
  {
    const std::lock_guard<std::mutex> lock(data.mutex);
    if (data.wanted && SameView(*data.wanted, rounded))
    {
      return;
    }
    if (data.wanted && data.wanted->Format() != rounded.Format())
    {
      data.current.reset();
    }
    generation = ++data.generation;
    data.wanted = rounded;
    data.completeness = 0.0;
    data.error = nullptr;
    ++data.counts.requests;
    if (data.TakeKept(rounded))
    {
      data.done.notify_all();
      return;
    }
  }
  if (data.settings.worker)
  {
    data.wake.notify_one();
    return;
  }
  try
  {
    data.Finish(
      generation, rounded, std::make_shared<const LineIntegrals>(data.projector->Project(rounded)));
  }
  catch (...)
  {
    // The next call tries again.
    const std::lock_guard<std::mutex> lock(data.mutex);
    data.wanted.reset();
    throw;
  }
}

std::shared_ptr<const LineIntegrals> BackgroundCache::Current(double* completeness) const
{
  const std::lock_guard<std::mutex> lock(this->Data->mutex);
  if (completeness != nullptr)
  {
    *completeness = this->Data->completeness;
  }
  return this->Data->current;
}

bool BackgroundCache::Wait(double seconds) const
{
  const Implementation& data = *this->Data;
  std::unique_lock<std::mutex> lock(data.mutex);
  data.done.wait_for(lock, std::chrono::duration<double>(std::clamp(seconds, 0.0, 1e6)),
    [&] { return data.completeness >= 1.0 || data.error; });
  if (data.error)
  {
    std::rethrow_exception(data.error);
  }
  return data.completeness >= 1.0;
}

CArmGeometry BackgroundCache::Rounded(const CArmGeometry& geometry) const
{
  const double angle = this->Data->settings.angleStep;
  const double length = this->Data->settings.lengthStep;
  const auto rounded = [](double value, double step) { return std::round(value / step) * step; };
  CArmPose pose = geometry.Pose();
  pose.primary = std::clamp(rounded(pose.primary, angle), -Pi, Pi);
  pose.secondary = std::clamp(rounded(pose.secondary, angle), -0.5 * Pi, 0.5 * Pi);
  pose.sourceToIsocentre = std::clamp(rounded(pose.sourceToIsocentre, length), 100.0, 5000.0);
  pose.sourceToDetector =
    std::clamp(rounded(pose.sourceToDetector, length), pose.sourceToIsocentre + length, 10000.0);
  for (int k = 0; k < 3; ++k)
  {
    pose.isocentre[k] = rounded(pose.isocentre[k], length);
  }
  return { pose, geometry.Format() };
}

BackgroundCacheCounts BackgroundCache::Counts() const
{
  const std::lock_guard<std::mutex> lock(this->Data->mutex);
  return this->Data->counts;
}
}
