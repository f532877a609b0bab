#include "MovingModel.h"

#include "BoundedJson.h"
#include "SeriesDescription.h"
#include "TextFile.h"

#include <cmath>
#include <filesystem>
#include <stdexcept>

namespace fs = std::filesystem;

namespace coronary
{
namespace
{
/// Lists of surfaces, the likeliest first.
constexpr const char* SurfaceLists[] = { "motion.pvd", "motion/surface.pvd",
  "motion/surface.vtp.series", "motion/mesh_surface.pvd", "surface.pvd", "surface.vtp.series",
  "truth/surface.pvd" };
constexpr const char* CenterlineLists[] = { "motion/centerline.pvd", "motion/centerline.vtp.series",
  "centerline.pvd", "centerline.vtp.series", "truth/centerline.pvd" };

template <std::size_t Count>
std::string FirstThere(const fs::path& folder, const char* const (&names)[Count])
{
  for (const char* name : names)
  {
    std::error_code ignored;
    if (fs::is_regular_file(folder / name, ignored))
    {
      return (folder / name).string();
    }
  }
  return {};
}

std::vector<TimedFile> ReadList(const std::string& list)
{
  std::vector<TimedFile> files = ReadFileSeries(list);
  for (const TimedFile& file : files)
  {
    std::error_code ignored;
    if (!fs::is_regular_file(file.path, ignored))
    {
      throw std::runtime_error(
        "'" + file.path + "' is missing, but '" + list + "' lists it: the folder is incomplete.");
    }
  }
  return files;
}

std::vector<double> NumbersOf(const nlohmann::json& parent, const char* name)
{
  const auto list = parent.find(name);
  if (list == parent.end() || !list->is_array())
  {
    return {};
  }
  std::vector<double> numbers;
  for (const nlohmann::json& value : *list)
  {
    if (!value.is_number())
    {
      return {};
    }
    numbers.push_back(value.get<double>());
  }
  return numbers;
}

/// What the report of `run` says of the motion.
void ReadReport(const std::string& path, MovingModel& model)
{
  const nlohmann::json report =
    ParseBoundedJson(ReadTextFile(path, "the report of a run"), "'" + path + "'");
  const auto motion = report.is_object() ? report.find("motion") : report.end();
  if (!report.is_object() || motion == report.end() || !motion->is_object())
  {
    return;
  }
  model.trackedTimes = NumbersOf(*motion, "tracked_times");
  model.trackedShare = NumbersOf(*motion, "tracked_share");
  model.tracksKnown = !model.trackedTimes.empty();
  if (model.trackedShare.size() != model.trackedTimes.size())
  {
    model.trackedShare.clear();
  }
}
}

MovingModel::Tracking MovingModel::TrackingAt(double time, double tolerance) const
{
  // A phase that more of the tree was lost in was not tracked really.
  constexpr double MinimumShare = 0.5;
  for (std::size_t k = 0; k < this->trackedTimes.size(); ++k)
  {
    if (std::abs(this->trackedTimes[k] - time) <= tolerance)
    {
      return k < this->trackedShare.size() && this->trackedShare[k] < MinimumShare ? Tracking::Lost
                                                                                   : Tracking::Seen;
    }
  }
  return Tracking::None;
}

const TimedFile* MovingModel::At(const std::vector<TimedFile>& files, double time, double tolerance)
{
  const TimedFile* best = nullptr;
  for (const TimedFile& file : files)
  {
    const double away = std::abs(file.time - time);
    if (away <= tolerance && (!best || away < std::abs(best->time - time)))
    {
      best = &file;
    }
  }
  return best;
}

namespace
{
/// The phases of a series.json that have a mask, or the true surface.
void ReadSeries(const std::string& path, MovingModel& model)
{
  const SeriesDescription series = ReadSeriesDescription(path);
  for (const SeriesDescription::Phase& phase : series.phases)
  {
    const std::string& surface = phase.mask.empty() ? phase.surface : phase.mask;
    if (!surface.empty())
    {
      model.surfaces.push_back({ ResolveSeriesPath(path, surface), phase.fraction });
    }
    if (!phase.centerline.empty())
    {
      model.centerlines.push_back({ ResolveSeriesPath(path, phase.centerline), phase.fraction });
    }
  }
  if (model.surfaces.empty())
  {
    throw std::runtime_error(
      "'" + path + "' has no phase with a 'mask' or a true surface: there is nothing to compare.");
  }
}
}

MovingModel FindMovingModel(const std::string& path)
{
  MovingModel model;
  model.path = path;
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored))
  {
    if (fs::path(path).extension() == ".json")
    {
      ReadSeries(path, model);
      return model;
    }
    model.surfaces = ReadList(path);
    return model;
  }
  if (!fs::is_directory(path, ignored))
  {
    throw std::runtime_error("'" + path + "' does not exist.");
  }
  const std::string report = (fs::path(path) / "report.json").string();
  const bool isRun = fs::is_regular_file(report, ignored);
  if (isRun)
  {
    ReadReport(report, model);
  }
  const std::string surfaces = FirstThere(path, SurfaceLists);
  if (surfaces.empty())
  {
    throw std::runtime_error(isRun
        ? "'" + path +
          "' is a run without motion: its surfaces over time are missing. Finish it with 'run "
          "--resume'."
        : "'" + path + "' has no list of surfaces over time: neither motion.pvd nor surface.pvd.");
  }
  model.surfaces = ReadList(surfaces);
  const std::string centerlines = FirstThere(path, CenterlineLists);
  if (!centerlines.empty())
  {
    model.centerlines = ReadList(centerlines);
  }
  return model;
}

bool HasMotion(const std::string& folder)
{
  std::error_code error;
  return fs::is_regular_file(fs::path(folder) / "motion.pvd", error) ||
    fs::is_regular_file(fs::path(folder) / "motion" / "surface.pvd", error);
}

std::string FolderName(const std::string& path)
{
  const fs::path folder = fs::absolute(path).lexically_normal();
  return (folder.filename().empty() ? folder.parent_path() : folder).filename().string();
}
}
