#include "DicomSeries.h"

#include "DicomFile.h"
#include "TextWords.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <system_error>

namespace coronary
{
namespace fs = std::filesystem;

namespace
{
// Slices nearer than this are at one position: the numbers in the headers are rounded.
constexpr double PositionTolerance = 0.05;
constexpr std::size_t LongestList = 8;

/// One frame of one file, placed in space and time.
struct Image
{
  const DicomFile* file = nullptr;
  const DicomFrame* frame = nullptr;
  int frameIndex = 0;
  double along = 0.0;    ///< position on the slice normal, mm
  std::size_t slice = 0; ///< rank of that position
  double time = 0.0;     ///< in the unit of the source of times
  double fraction = 0.0; ///< of the R-R interval
};

using Files = std::vector<const DicomFile*>;

std::string Text(double value)
{
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << value;
  return text.str();
}

std::string Text(const Vector3& v)
{
  return "(" + Text(v.x()) + ", " + Text(v.y()) + ", " + Text(v.z()) + ")";
}

std::string Join(const std::vector<std::string>& items)
{
  std::string text;
  for (std::size_t i = 0; i < std::min(items.size(), LongestList); ++i)
  {
    text += (i > 0 ? ", " : "") + items[i];
  }
  return items.size() > LongestList
    ? text + " and " + std::to_string(items.size() - LongestList) + " more"
    : text;
}

std::vector<std::string> ListFiles(const std::string& folder, const Poll& poll)
{
  std::error_code error;
  if (!fs::is_directory(folder, error))
  {
    throw std::runtime_error("Folder '" + folder + "' does not exist.");
  }
  std::vector<std::string> paths;
  fs::recursive_directory_iterator entry(
    folder, fs::directory_options::skip_permission_denied, error);
  const fs::recursive_directory_iterator end;
  while (!error && entry != end)
  {
    if (poll)
    {
      poll();
    }
    std::error_code ignored;
    if (entry->is_regular_file(ignored))
    {
      paths.push_back(entry->path().string());
    }
    entry.increment(error);
  }
  if (error)
  {
    FormatError(folder, "cannot be read: " + error.message());
  }
  // The order of a folder is not the same everywhere.
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::vector<DicomFile> ReadHeaders(const std::vector<std::string>& paths, const Poll& poll)
{
  std::vector<DicomFile> files(paths.size());
  ParallelFor(
    static_cast<std::int64_t>(paths.size()), 4,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        const auto index = static_cast<std::size_t>(i);
        files[index] = ReadDicomHeader(paths[index]);
      }
    },
    [&poll](double)
    {
      if (poll)
      {
        poll();
      }
      return true;
    });
  return files;
}

std::map<std::string, Files> GroupBySeries(const Files& files)
{
  std::map<std::string, Files> series;
  for (const DicomFile* file : files)
  {
    series[file->seriesUid].push_back(file);
  }
  return series;
}

std::string DescribeSeries(const std::map<std::string, Files>& series)
{
  std::vector<std::string> items;
  for (const auto& [uid, files] : series)
  {
    items.push_back(uid + " ('" + files.front()->seriesDescription + "', " +
      files.front()->modality + ", " + std::to_string(files.size()) + " files)");
  }
  return Join(items);
}

[[noreturn]] void FailMixed(
  const std::string& folder, const std::map<std::string, Files>& series, const std::string& why)
{
  if (series.size() == 1)
  {
    FormatError(
      folder, "the images of series " + DescribeSeries(series) + " do not form one volume: " + why);
  }
  FormatError(folder,
    "mixed series: it holds " + std::to_string(series.size()) +
      " series that do not form one dataset (" + why + "): " + DescribeSeries(series) +
      ". Choose one with the property SeriesInstanceUID");
}

// Empty when two files can be slices of one stack, else what differs.
std::string Difference(const DicomFile& a, const DicomFile& b)
{
  constexpr double tolerance = 1e-3;
  if (a.modality != b.modality)
  {
    return "modality " + a.modality + " and " + b.modality;
  }
  // Some anonymisers give every file of a series its own frame of reference.
  if (a.seriesUid != b.seriesUid && a.frameOfReferenceUid != b.frameOfReferenceUid)
  {
    return "different frames of reference";
  }
  if (a.rows != b.rows || a.columns != b.columns)
  {
    return "matrix " + std::to_string(a.columns) + "x" + std::to_string(a.rows) + " and " +
      std::to_string(b.columns) + "x" + std::to_string(b.rows);
  }
  for (const DicomFrame& frame : b.frames)
  {
    const DicomFrame& first = a.frames.front();
    if (std::abs(first.rowSpacing - frame.rowSpacing) > tolerance ||
      std::abs(first.columnSpacing - frame.columnSpacing) > tolerance)
    {
      return "pixel spacing " + Text(first.columnSpacing) + " and " + Text(frame.columnSpacing) +
        " mm";
    }
    if ((first.rowAxis - frame.rowAxis).norm() > tolerance ||
      (first.columnAxis - frame.columnAxis).norm() > tolerance)
    {
      return "different orientations";
    }
  }
  return {};
}

// Sorts by position and fills Image::slice; returns the number of positions.
std::size_t RankPositions(std::vector<Image>& images, const Vector3& normal)
{
  for (Image& image : images)
  {
    image.along = normal.dot(image.frame->position);
  }
  std::stable_sort(
    images.begin(), images.end(), [](const Image& a, const Image& b) { return a.along < b.along; });
  std::size_t slices = 0;
  double start = -std::numeric_limits<double>::infinity();
  for (Image& image : images)
  {
    if (image.along - start > PositionTolerance)
    {
      start = image.along;
      ++slices;
    }
    image.slice = slices - 1;
  }
  return slices;
}

// Copies of one object under another name.
void DropCopies(std::vector<Image>& images, std::vector<std::string>& warnings)
{
  std::map<std::pair<std::string, int>, std::string> seen;
  std::vector<std::string> dropped;
  std::vector<Image> kept;
  for (const Image& image : images)
  {
    const std::string& uid = image.file->instanceUid;
    if (!uid.empty() && !seen.emplace(std::make_pair(uid, image.frameIndex), uid).second)
    {
      dropped.push_back("'" + fs::path(image.file->path).filename().string() + "'");
      continue;
    }
    kept.push_back(image);
  }
  if (!dropped.empty())
  {
    warnings.push_back(std::to_string(dropped.size()) +
      " duplicates (same SOP instance UID as another file) were dropped: " + Join(dropped) + ".");
  }
  images = std::move(kept);
}

enum class TimeSource
{
  TriggerTime,
  NominalPercentage,
  Description,
  Acquisition,
  None
};

const char* NameOf(TimeSource source)
{
  switch (source)
  {
    case TimeSource::TriggerTime:
      return "trigger time";
    case TimeSource::NominalPercentage:
      return "nominal percentage of the cardiac phase";
    case TimeSource::Description:
      return "percentage in the series description";
    case TimeSource::Acquisition:
      return "order of acquisition";
    case TimeSource::None:
      break;
  }
  return "none";
}

std::optional<double> PercentageIn(const std::string& description)
{
  static const std::regex pattern(R"((-?\d{1,3}(?:\.\d{1,3})?)\s*%)");
  std::smatch match;
  if (!std::regex_search(description, match, pattern))
  {
    return std::nullopt;
  }
  return ParseDicomNumber(match[1].str());
}

std::optional<double> TimeOf(const Image& image, TimeSource source)
{
  switch (source)
  {
    case TimeSource::TriggerTime:
      return image.frame->triggerTime;
    case TimeSource::NominalPercentage:
      return image.frame->nominalPercentage;
    case TimeSource::Description:
      return PercentageIn(image.file->seriesDescription);
    default:
      return 0.0;
  }
}

bool SetTimes(std::vector<Image>& images, TimeSource source)
{
  for (Image& image : images)
  {
    const std::optional<double> time = TimeOf(image, source);
    if (!time)
    {
      return false;
    }
    image.time = *time;
  }
  return true;
}

using Stack = std::vector<std::vector<Image>>; ///< [slice][time]

bool SameTime(const Image& a, const Image& b)
{
  return std::abs(a.time - b.time) <= 1e-6 * std::max(1.0, std::abs(a.time));
}

Stack StackOf(const std::vector<Image>& images, std::size_t slices)
{
  Stack stack(slices);
  for (const Image& image : images)
  {
    stack[image.slice].push_back(image);
  }
  for (std::vector<Image>& slice : stack)
  {
    std::stable_sort(slice.begin(), slice.end(),
      [](const Image& a, const Image& b) {
        return SameTime(a, b) ? a.file->acquisitionOrder < b.file->acquisitionOrder
                              : a.time < b.time;
      });
  }
  return stack;
}

std::size_t Collisions(const Stack& stack)
{
  std::size_t count = 0;
  for (const std::vector<Image>& slice : stack)
  {
    for (std::size_t i = 1; i < slice.size(); ++i)
    {
      count += SameTime(slice[i - 1], slice[i]) ? 1 : 0;
    }
  }
  return count;
}

// Every position has the same number of images of one series, at least two, and nothing tells them
// apart. Of two series they would be, say, two reconstructions.
bool OnlyOrderSeparates(const Stack& stack, std::size_t images)
{
  const std::string& series = stack.front().front().file->seriesUid;
  for (const std::vector<Image>& slice : stack)
  {
    for (const Image& image : slice)
    {
      if (image.file->seriesUid != series)
      {
        return false;
      }
    }
  }
  const std::size_t count = stack.front().size();
  const bool equal = std::all_of(stack.begin(), stack.end(),
    [count](const std::vector<Image>& slice) { return slice.size() == count; });
  return equal && count > 1 && Collisions(stack) == images - stack.size();
}

// Chooses what gives the images their times, and fills Image::time.
TimeSource ChooseTimes(std::vector<Image>& images, std::size_t slices)
{
  TimeSource best = TimeSource::None;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  for (const TimeSource source : { TimeSource::TriggerTime, TimeSource::NominalPercentage,
         TimeSource::Description, TimeSource::None })
  {
    if (!SetTimes(images, source))
    {
      continue;
    }
    const std::size_t collisions = Collisions(StackOf(images, slices));
    if (collisions < fewest)
    {
      fewest = collisions;
      best = source;
    }
  }
  SetTimes(images, best);
  Stack stack = StackOf(images, slices);
  if (!OnlyOrderSeparates(stack, images.size()))
  {
    return best;
  }
  for (std::vector<Image>& slice : stack)
  {
    std::stable_sort(slice.begin(), slice.end(),
      [](const Image& a, const Image& b)
      {
        return std::make_pair(a.file->acquisitionOrder, a.frameIndex) <
          std::make_pair(b.file->acquisitionOrder, b.frameIndex);
      });
  }
  images.clear();
  for (std::vector<Image>& slice : stack)
  {
    for (std::size_t i = 0; i < slice.size(); ++i)
    {
      slice[i].time = static_cast<double>(i);
      images.push_back(slice[i]);
    }
  }
  return TimeSource::Acquisition;
}

// Same position and time within a series: one of them is dropped. Across series: nobody can tell
// which is meant.
void DropCollisions(Stack& stack, const std::string& folder,
  const std::map<std::string, Files>& series, std::vector<std::string>& warnings)
{
  std::vector<std::string> dropped;
  for (std::vector<Image>& slice : stack)
  {
    std::vector<Image> kept;
    for (const Image& image : slice)
    {
      if (kept.empty() || !SameTime(kept.back(), image))
      {
        kept.push_back(image);
        continue;
      }
      if (kept.back().file->seriesUid != image.file->seriesUid)
      {
        FailMixed(folder, series, "some have images at the same position and time");
      }
      dropped.push_back("'" + fs::path(image.file->path).filename().string() + "'");
    }
    slice = std::move(kept);
  }
  if (!dropped.empty())
  {
    warnings.push_back(std::to_string(dropped.size()) +
      " duplicates (same position and time as another image) were dropped: " + Join(dropped) + ".");
  }
}

// Series belong together as one slice each, or as one stack each.
void CheckSeriesFit(
  const Stack& stack, const std::string& folder, const std::map<std::string, Files>& series)
{
  if (series.size() == 1)
  {
    return;
  }
  std::map<std::string, std::set<std::size_t>> slicesOf;
  for (const std::vector<Image>& slice : stack)
  {
    for (const Image& image : slice)
    {
      slicesOf[image.file->seriesUid].insert(image.slice);
    }
  }
  bool oneSliceEach = true;
  bool wholeStackEach = true;
  for (const auto& [uid, slices] : slicesOf)
  {
    oneSliceEach = oneSliceEach && slices.size() == 1;
    wholeStackEach = wholeStackEach && slices.size() == stack.size();
  }
  if (!oneSliceEach && !wholeStackEach)
  {
    FailMixed(folder, series, "they cover different positions");
  }
}

// Turns times into fractions of the R-R interval; returns the mean interval in seconds, 0 if unknown.
double SetFractions(Stack& stack, TimeSource source, std::vector<std::string>& warnings)
{
  double sum = 0.0;
  std::size_t count = 0;
  for (const std::vector<Image>& slice : stack)
  {
    for (const Image& image : slice)
    {
      if (image.frame->rrInterval)
      {
        sum += *image.frame->rrInterval;
        ++count;
      }
    }
  }
  double interval = count > 0 ? sum / static_cast<double>(count) : 0.0;
  const auto longest = std::max_element(
    stack.begin(), stack.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
  const std::size_t phases = longest->size();
  if (source == TimeSource::TriggerTime && interval == 0.0)
  {
    if (phases > 1)
    {
      const double step =
        (longest->back().time - longest->front().time) / static_cast<double>(phases - 1);
      interval = step * static_cast<double>(phases);
      warnings.push_back("The headers have no R-R interval; number of phases times mean step = " +
        Text(interval) + " ms is assumed.");
    }
    else if (longest->front().time != 0.0)
    {
      warnings.emplace_back("The headers have no R-R interval; the one phase gets fraction 0.");
    }
  }
  for (std::vector<Image>& slice : stack)
  {
    for (Image& image : slice)
    {
      switch (source)
      {
        case TimeSource::TriggerTime:
        {
          const double own = image.frame->rrInterval.value_or(interval);
          image.fraction = own > 0.0 ? image.time / own : 0.0;
          break;
        }
        case TimeSource::NominalPercentage:
        case TimeSource::Description:
          image.fraction = image.time / 100.0;
          break;
        case TimeSource::Acquisition:
          image.fraction = image.time / static_cast<double>(phases);
          break;
        case TimeSource::None:
          image.fraction = 0.0;
          break;
      }
    }
  }
  if (source == TimeSource::Acquisition)
  {
    warnings.push_back("Nothing in the headers tells the " + std::to_string(phases) +
      " images of a position apart in time; they are taken in order of acquisition, evenly over "
      "the "
      "R-R interval.");
  }
  return interval / 1000.0;
}

// Names the phases that a slice lacks, by the nearest of the fractions of a complete slice.
std::vector<std::size_t> MissingPhases(
  const std::vector<Image>& slice, const std::vector<Image>& complete)
{
  std::set<std::size_t> found;
  for (const Image& image : slice)
  {
    std::size_t nearest = 0;
    for (std::size_t p = 1; p < complete.size(); ++p)
    {
      if (std::abs(complete[p].fraction - image.fraction) <
        std::abs(complete[nearest].fraction - image.fraction))
      {
        nearest = p;
      }
    }
    found.insert(nearest);
  }
  std::vector<std::size_t> missing;
  for (std::size_t p = 0; p < complete.size(); ++p)
  {
    if (found.count(p) == 0)
    {
      missing.push_back(p);
    }
  }
  return missing;
}

void CheckComplete(const Stack& stack, const std::string& folder)
{
  const auto complete = std::max_element(
    stack.begin(), stack.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
  std::vector<std::string> missing;
  for (const std::vector<Image>& slice : stack)
  {
    if (slice.size() == complete->size())
    {
      continue;
    }
    for (const std::size_t phase : MissingPhases(slice, *complete))
    {
      missing.push_back("phase " + std::to_string(phase) + " (fraction " +
        Text((*complete)[phase].fraction) + ") at position " + Text(slice.front().frame->position) +
        " mm");
    }
  }
  if (!missing.empty())
  {
    FormatError(folder, "slices are missing: " + Join(missing));
  }
}

// Says how far the slices are from even spacing, and where the largest gaps are.
std::string UnevenSlices(const Stack& stack, const std::vector<double>& sorted, double mean)
{
  const double median = sorted[sorted.size() / 2];
  double maximum = 0.0;
  std::vector<std::string> gaps;
  for (std::size_t s = 0; s < stack.size(); ++s)
  {
    const double even = stack.front().front().along + mean * static_cast<double>(s);
    maximum = std::max(maximum, std::abs(stack[s].front().along - even));
    const double gap = s > 0 ? stack[s].front().along - stack[s - 1].front().along : 0.0;
    if (gap > 1.5 * median)
    {
      gaps.push_back(Text(gap) + " mm after slice " + std::to_string(s - 1));
    }
  }
  return "The slices are " + Text(sorted.front()) + " to " + Text(sorted.back()) +
    " mm apart; the mean, " + Text(mean) + " mm, is used, which puts slices up to " +
    Text(maximum) + " mm from their true positions." +
    (gaps.empty() ? "" : " Slices seem to be missing: " + Join(gaps) + ".");
}

// The mean distance between the slices; their being uneven is a warning, their being sheared an
// error.
double SliceSpacing(const Stack& stack, const std::string& folder, const Vector3& normal,
  std::vector<std::string>& warnings)
{
  const DicomFile& file = *stack.front().front().file;
  if (stack.size() == 1)
  {
    return file.sliceSpacing > 0.0 ? file.sliceSpacing : 1.0;
  }
  std::vector<double> distances;
  const Vector3 first = stack.front().front().frame->position;
  double sideways = 0.0;
  for (std::size_t s = 1; s < stack.size(); ++s)
  {
    const Image& image = stack[s].front();
    distances.push_back(image.along - stack[s - 1].front().along);
    const Vector3 offset = image.frame->position - first;
    sideways = std::max(sideways, (offset - normal * normal.dot(offset)).norm());
  }
  std::vector<double> sorted = distances;
  std::sort(sorted.begin(), sorted.end());
  const double mean = (stack.back().front().along - stack.front().front().along) /
    static_cast<double>(distances.size());
  if (sorted.front() < 0.99 * mean || sorted.back() > 1.01 * mean)
  {
    warnings.push_back(UnevenSlices(stack, sorted, mean));
  }
  const DicomFrame& frame = *stack.front().front().frame;
  const double pixel = std::min(frame.rowSpacing, frame.columnSpacing);
  if (sideways > pixel)
  {
    FormatError(folder,
      "the slices are shifted sideways by up to " + Text(sideways) +
        " mm (a tilted gantry?), so they form no regular grid");
  }
  if (sideways > 0.1 * pixel)
  {
    warnings.push_back(
      "The slices are shifted sideways by up to " + Text(sideways) + " mm; this is ignored.");
  }
  return mean;
}

std::vector<double> PhaseFractions(
  const Stack& stack, const std::string& folder, std::vector<std::string>& warnings)
{
  const std::size_t phases = stack.front().size();
  std::vector<double> fractions;
  double spread = 0.0;
  for (std::size_t p = 0; p < phases; ++p)
  {
    double sum = 0.0;
    double low = stack.front()[p].fraction;
    double high = low;
    for (const std::vector<Image>& slice : stack)
    {
      sum += slice[p].fraction;
      low = std::min(low, slice[p].fraction);
      high = std::max(high, slice[p].fraction);
    }
    spread = std::max(spread, high - low);
    fractions.push_back(sum / static_cast<double>(stack.size()));
    if (p > 0 && !(fractions[p] > fractions[p - 1]))
    {
      FormatError(folder,
        "the R-R fraction of phase " + std::to_string(p) + " is not greater than the one before");
    }
  }
  const double step =
    phases > 1 ? (fractions.back() - fractions.front()) / static_cast<double>(phases - 1) : 0.1;
  if (spread > 0.5 * step)
  {
    warnings.push_back("The slices of a phase differ by up to " + Text(spread) +
      " of the R-R interval; their mean is used.");
  }
  return fractions;
}

class DicomSeries : public VolumeSource
{
public:
  DicomSeries(const std::string& folder, const std::string& seriesUid, const Poll& poll);

protected:
  void ReadPlane(int phase, int k, Plane& plane, const Poll& poll) override
  {
    poll();
    const Image& image = this->Slices[static_cast<std::size_t>(k)][static_cast<std::size_t>(phase)];
    plane.slope = image.frame->slope;
    plane.intercept = image.frame->intercept;
    DicomPixelReader own; // from any thread
    DicomPixelReader& pixels = HasFileOfItsOwn(image) ? own : this->Pixels;
    plane.type = pixels.Read(*image.file, image.frameIndex, plane.bytes);
  }

  bool HasSeparatePlanes(int phase) const override
  {
    return std::all_of(this->Slices.begin(), this->Slices.end(),
      [phase](const auto& slice)
      { return HasFileOfItsOwn(slice[static_cast<std::size_t>(phase)]); });
  }

  void EndOfVolume() override { this->Pixels.Close(); }

private:
  static bool HasFileOfItsOwn(const Image& image) { return image.file->frames.size() == 1; }
  Files Select(const std::string& folder, const std::string& seriesUid);
  void SetGrid(double sliceSpacing);
  void SetNotes(const std::map<std::string, Files>& series, TimeSource source);

  std::vector<DicomFile> All;
  Stack Slices;
  DicomPixelReader Pixels; ///< of files of several frames
};

Files DicomSeries::Select(const std::string& folder, const std::string& seriesUid)
{
  Files images;
  std::map<std::string, std::size_t> skipped;
  for (const DicomFile& file : this->All)
  {
    if (file.skipReason.empty())
    {
      images.push_back(&file);
    }
    else
    {
      ++skipped[file.skipReason];
    }
  }
  std::string skippedText;
  for (const auto& [reason, count] : skipped)
  {
    skippedText += (skippedText.empty() ? "" : ", ") + std::to_string(count) + " " + reason;
  }
  if (!skippedText.empty())
  {
    this->Header.notes.push_back("Skipped files: " + skippedText + ".");
  }
  if (images.empty())
  {
    FormatError(folder,
      "holds no DICOM images" + (skippedText.empty() ? "" : " (skipped: " + skippedText + ")"));
  }
  if (!seriesUid.empty())
  {
    const std::map<std::string, Files> series = GroupBySeries(images);
    const auto chosen = series.find(seriesUid);
    if (chosen == series.end())
    {
      FormatError(folder,
        "has no series with the SeriesInstanceUID " + seriesUid + "; it holds " +
          DescribeSeries(series));
    }
    images = chosen->second;
  }
  return images;
}

void DicomSeries::SetGrid(double sliceSpacing)
{
  const Image& first = this->Slices.front().front();
  const DicomFrame& frame = *first.frame;
  ImageGrid& grid = this->Header.grid;
  grid.extent = { 0, first.file->columns - 1, 0, first.file->rows - 1, 0,
    static_cast<int>(this->Slices.size()) - 1 };
  grid.origin = frame.position;
  grid.spacing = Vector3(frame.columnSpacing, frame.rowSpacing, sliceSpacing);
  grid.direction.col(0) = frame.rowAxis;
  grid.direction.col(1) = frame.columnAxis;
  grid.direction.col(2) = frame.rowAxis.cross(frame.columnAxis);
  grid.direction = Orthonormalised(grid.direction, first.file->path);
}

void DicomSeries::SetNotes(const std::map<std::string, Files>& series, TimeSource source)
{
  for (const auto& [uid, files] : series)
  {
    this->Header.notes.push_back("Series " + uid + ": '" + files.front()->seriesDescription +
      "', " + files.front()->modality + ", " + std::to_string(files.size()) + " files.");
  }
  if (this->Header.phases > 1)
  {
    this->Header.notes.push_back(std::string("Times from: ") + NameOf(source) + ".");
  }
}

DicomSeries::DicomSeries(const std::string& folder, const std::string& seriesUid, const Poll& poll)
{
  VolumeInfo& info = this->Header;
  info.path = folder;
  info.format = "DICOM";
  this->All = ReadHeaders(ListFiles(folder, poll), poll);
  const Files files = this->Select(folder, seriesUid);
  info.modality = files.front()->modality;
  const std::map<std::string, Files> series = GroupBySeries(files);
  std::vector<Image> images;
  bool oneFrameOfReference = true;
  for (const DicomFile* file : files)
  {
    oneFrameOfReference =
      oneFrameOfReference && file->frameOfReferenceUid == files.front()->frameOfReferenceUid;
    const std::string difference = Difference(*files.front(), *file);
    if (!difference.empty())
    {
      FailMixed(folder, series, difference);
    }
    for (std::size_t f = 0; f < file->frames.size(); ++f)
    {
      Image image;
      image.file = file;
      image.frame = &file->frames[f];
      image.frameIndex = static_cast<int>(f);
      images.push_back(image);
    }
  }
  if (!oneFrameOfReference)
  {
    info.warnings.emplace_back(
      "The files of one series name different frames of reference; this is ignored.");
  }
  const DicomFrame& first = files.front()->frames.front();
  const Vector3 normal = first.rowAxis.cross(first.columnAxis).normalized();
  DropCopies(images, info.warnings);
  const std::size_t slices = RankPositions(images, normal);
  const TimeSource source = ChooseTimes(images, slices);
  this->Slices = StackOf(images, slices);
  DropCollisions(this->Slices, folder, series, info.warnings);
  CheckSeriesFit(this->Slices, folder, series);
  info.cycleSeconds = SetFractions(this->Slices, source, info.warnings);
  CheckComplete(this->Slices, folder);
  info.phases = static_cast<int>(this->Slices.front().size());
  info.fractions = PhaseFractions(this->Slices, folder, info.warnings);
  this->SetGrid(SliceSpacing(this->Slices, folder, normal, info.warnings));

  info.fitsShort = true;
  for (const std::vector<Image>& slice : this->Slices)
  {
    for (const Image& image : slice)
    {
      info.fitsShort = info.fitsShort && image.file->bitsAllocated <= 16 &&
        image.frame->slope == std::rint(image.frame->slope) &&
        image.frame->intercept == std::rint(image.frame->intercept);
    }
  }
  for (int phase = 0; phase < info.phases; ++phase)
  {
    info.phaseNames.push_back(this->Slices.front()[static_cast<std::size_t>(phase)].file->path);
  }
  this->SetNotes(series, source);
}
}

std::unique_ptr<VolumeSource> OpenDicomSeries(
  const std::string& folder, const std::string& seriesInstanceUid, const Poll& poll)
{
  return std::make_unique<DicomSeries>(folder, seriesInstanceUid, poll);
}
}
