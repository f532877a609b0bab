#include "ImageScan.h"

#include "AtomicFile.h"
#include "MetaImageWriter.h"
#include "ScannerOptions.h"
#include "StagedFolder.h"
#include "TextFile.h"

#include <cstdio>
#include <filesystem>

namespace coronary
{
namespace
{
constexpr const char* ScanName = "scan.json";
constexpr const char* PartsName = "scan-parts";
}

std::string GivenOptions(const CLI::App& app)
{
  std::string text = "version " DYNAMICCORONARY_VERSION "\n";
  for (const CLI::Option* option : app.get_options())
  {
    const std::string name = option->get_name();
    if (name == "--output" || name == "--threads" || name == "--quiet" || name == "--compress" ||
      name == "--no-truth" || option->empty())
    {
      continue;
    }
    text += name;
    for (const std::string& value : option->results())
    {
      text += " " + value;
      if (std::filesystem::is_regular_file(value))
      {
        text += "\n" + ReadTextFile(value, "an option's file") + "\n";
      }
    }
    text += "\n";
  }
  return text;
}

std::string PhaseText(double fraction)
{
  char text[32];
  std::snprintf(text, sizeof(text), "%.1f %% R-R", 100.0 * fraction);
  return text;
}

ImageScan::ImageScan(const ScannedAnatomy& anatomy, const ScannerSettings& settings,
  const ImageGrid& grid, const std::vector<double>& phases,
  const std::vector<ScanVariant>& variants)
  : Settings(settings)
  , Grid(grid)
  , Phases(phases)
  , Variants(variants)
  , Scanner(anatomy, settings, grid, phases, variants)
{
}

void ImageScan::Scan(
  const std::string& output, const std::string& given, bool quiet, const ProgressCallback& progress)
{
  const std::string where = output + "/" + PartsName;
  this->Parts = std::make_unique<ScanFolder>(where, given + DescribeScanner(this->Settings));
  if (this->Parts->Found() > 0 && !quiet)
  {
    std::printf(
      "%s: %d parts of this scan were made before\n", where.c_str(), this->Parts->Found());
  }
  this->Scanner.Scan(*this->Parts, progress);
}

void ImageScan::WriteImages(StagedFolder& folder, std::size_t phase, const std::string& name,
  bool compress, const ProgressCallback& progress) const
{
  const std::array<int, 6>& e = this->Grid.extent;
  std::vector<std::int16_t> values(
    static_cast<std::size_t>(e[1] - e[0] + 1) * (e[3] - e[2] + 1) * (e[5] - e[4] + 1));
  const std::size_t count = this->Variants.size();
  for (std::size_t v = 0; v < count; ++v)
  {
    const auto report = [&, v](double done)
    { return !progress || progress((static_cast<double>(v) + done) / static_cast<double>(count)); };
    this->Scanner.Image(phase, v, *this->Parts, values.data(),
      [&](double fraction) { return report(0.5 * fraction); });
    const std::string in = count > 1 ? VariantName(this->Variants[v]) + "/" : "";
    WriteMetaImage(folder.Add(in + name), this->Grid, values.data(), compress,
      [&](double fraction) { return report(0.5 + 0.5 * fraction); });
  }
}

void ImageScan::WriteDescriptions(StagedFolder& folder, const SeriesDescription& series) const
{
  WriteFileAtomically(folder.Add(ScanName),
    DescribeScan(this->Settings, this->Scanner, this->Phases, this->Variants));
  if (this->Variants.size() < 2)
  {
    WriteSeriesDescription(folder.Add(SeriesName), series);
    return;
  }
  for (const ScanVariant& variant : this->Variants)
  {
    SeriesDescription one = series;
    for (SeriesDescription::Phase& phase : one.phases)
    {
      for (std::string* truth : { &phase.surface, &phase.centerline })
      {
        *truth = truth->empty() ? "" : "../" + *truth;
      }
    }
    WriteSeriesDescription(folder.Add(VariantName(variant) + "/" + SeriesName), one);
  }
}

void ImageScan::Done()
{
  if (this->Parts)
  {
    this->Parts->Remove();
  }
}
}
