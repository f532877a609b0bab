#include "BackgroundVolume.h"

#include "GatedSeries.h"
#include "VolumeFile.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr int MinimumVoxels = 16;      ///< along each axis
constexpr double MinimumLength = 50.0; ///< mm
constexpr double MostSpacing = 10.0;   ///< mm
constexpr double MinimumTissue = 0.02; ///< share of voxels between -200 and 300 HU
constexpr double MinimumAir =
  0.005; ///< share of voxels below -500 HU: lungs or what is around the patient
constexpr double MostOutside = 0.02; ///< share of voxels above 4000, which no scanner's HU are

[[noreturn]] void Refuse(const std::string& path, const std::string& why)
{
  throw std::runtime_error("'" + path + "' can not be a background: " + why);
}

GatedSeries Open(
  const std::string& path, const BackgroundOptions& options, const ProgressCallback& progress)
{
  std::error_code error;
  if (!std::filesystem::exists(path, error))
  {
    throw std::runtime_error("'" + path + "' is not there");
  }
  const bool described = options.time && std::filesystem::path(path).extension() == ".json";
  if (!std::filesystem::is_directory(path, error) && !IsVolumeFileName(path) && !described)
  {
    Refuse(path,
      "it is no .mha, .mhd, .nrrd, .nhdr, .nii or .nii.gz file, and no folder of DICOM files");
  }
  return GatedSeries({ path }, {}, [&progress] { Report(progress, 0.0); });
}

std::array<std::int64_t, 3> Size(const ImageGrid& grid)
{
  std::array<std::int64_t, 3> size{};
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    size[axis] = std::int64_t(grid.extent[2 * axis + 1]) - grid.extent[2 * axis] + 1;
  }
  return size;
}

/// What the header alone says.
void RequireCt(const VolumeInfo& info, const std::string& path)
{
  if (!info.modality.empty() && info.modality != "CT")
  {
    Refuse(path, "its modality is " + info.modality + ", and only CT has Hounsfield units");
  }
  const std::array<std::int64_t, 3> size = Size(info.grid);
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    const double spacing = info.grid.spacing[static_cast<Eigen::Index>(axis)];
    if (size[axis] < MinimumVoxels || static_cast<double>(size[axis]) * spacing < MinimumLength)
    {
      Refuse(path,
        "it has " + std::to_string(size[axis]) + " voxels of " + std::to_string(spacing) +
          " mm along axis " + std::to_string(axis) + "; 16 voxels and 50 mm are the least");
    }
    if (spacing > MostSpacing)
    {
      Refuse(path, "its voxels are " + std::to_string(spacing) + " mm apart; 10 mm are the most");
    }
  }
  if (size[0] > MostBackgroundVoxels / size[1] / size[2])
  {
    Refuse(path,
      "it has " + std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " +
        std::to_string(size[2]) + " voxels; " + std::to_string(MostBackgroundVoxels) +
        " are the most");
  }
}

std::string Percent(double share)
{
  return std::to_string(static_cast<int>(std::lround(1000.0 * share)) / 10) + "." +
    std::to_string(static_cast<int>(std::lround(1000.0 * share)) % 10) + " %";
}

/// Shares of the values that there are in a chest.
class HounsfieldCheck
{
public:
  void Add(float value)
  {
    ++this->Count;
    this->Unnumbered += std::isfinite(value) ? 0 : 1;
    this->Air += value < -500.0F ? 1 : 0;
    this->Tissue += value > -200.0F && value < 300.0F ? 1 : 0;
    this->Beyond += value > 4000.0F ? 1 : 0;
    this->Minimum = std::min(this->Minimum, value);
    this->Most = std::max(this->Most, value);
  }

  void Require(const std::string& path) const
  {
    if (this->Unnumbered > 0)
    {
      Refuse(path, std::to_string(this->Unnumbered) + " of its values are no numbers");
    }
    const std::string range = "its values, " + std::to_string(std::lround(this->Minimum)) + " to " +
      std::to_string(std::lround(this->Most)) + ", are no Hounsfield units: ";
    if (this->Share(this->Air) < MinimumAir)
    {
      Refuse(
        path, range + Percent(this->Share(this->Air)) + " are those of air or lung, below -500");
    }
    if (this->Share(this->Tissue) < MinimumTissue)
    {
      Refuse(path,
        range + Percent(this->Share(this->Tissue)) + " are those of soft tissue, -200 to 300");
    }
    if (this->Share(this->Beyond) > MostOutside)
    {
      Refuse(path, range + Percent(this->Share(this->Beyond)) + " are above 4000");
    }
  }

private:
  double Share(std::int64_t part) const
  {
    return static_cast<double>(part) / static_cast<double>(this->Count);
  }

  std::int64_t Count = 0;
  std::int64_t Unnumbered = 0;
  std::int64_t Air = 0;
  std::int64_t Tissue = 0;
  std::int64_t Beyond = 0;
  float Minimum = std::numeric_limits<float>::infinity();
  float Most = -std::numeric_limits<float>::infinity();
};

/// A few slices at a time in single precision, so that values beyond short are seen.
void ReadValues(
  VolumeSource& source, int phase, HounsfieldVolume& volume, const ProgressCallback& progress)
{
  const std::array<std::int64_t, 3> size = Size(volume.grid);
  const std::int64_t slice = size[0] * size[1];
  constexpr std::int64_t step = 16;
  std::vector<float> values(static_cast<std::size_t>(slice * std::min(step, size[2])));
  HounsfieldCheck check;
  std::int16_t* out = volume.values.data();
  for (std::int64_t first = 0; first < size[2]; first += step)
  {
    Report(progress, static_cast<double>(first) / static_cast<double>(size[2]));
    const std::int64_t last = std::min(first + step, size[2]);
    std::array<int, 6> extent = volume.grid.extent;
    extent[4] = static_cast<int>(first);
    extent[5] = static_cast<int>(last - 1);
    source.Read(phase, extent, values.data());
    for (std::int64_t i = 0; i < slice * (last - first); ++i)
    {
      const float value = values[static_cast<std::size_t>(i)];
      check.Add(value);
      const float limited = value > -1024.0F ? std::min(value, 3071.0F) : -1024.0F;
      *out++ = static_cast<std::int16_t>(std::lround(limited));
    }
  }
  Report(progress, 1.0);
  check.Require(source.Info().path);
}
}

HounsfieldVolume ReadBackgroundVolume(
  const std::string& path, const BackgroundOptions& options, const ProgressCallback& progress)
{
  if (!(options.offset.cwiseAbs().maxCoeff() <= 1e5) || !options.offset.allFinite())
  {
    throw std::invalid_argument("background: the offset has to be finite, at most 1e5 mm");
  }
  const GatedSeries series = Open(path, options, progress);
  const int phase = options.time ? series.NearestPhase(*options.time) : 0;
  VolumeSource& source = series.Source(phase);
  RequireCt(source.Info(), path);
  if (series.NumberOfPhases() != 1 && !options.time)
  {
    Refuse(path,
      "it has " + std::to_string(series.NumberOfPhases()) + " phases, and one volume is needed");
  }
  HounsfieldVolume volume;
  volume.grid = source.Info().grid;
  volume.values.resize(static_cast<std::size_t>(volume.View().NumberOfVoxels()));
  ReadValues(source, series.IndexInSource(phase), volume, progress);
  volume.grid.origin += options.offset;
  return volume;
}
}
