#include "Detector.h"

#include "CounterRandom.h"
#include "DetectorKernels.h"
#include "FastMath.h"
#include "KernelChoice.h"
#include "Require.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr RequireOf RequireDetector{ "detector" };

std::vector<float> OpenShares(int count, double before, double after, double transmission)
{
  std::vector<float> shares(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
  {
    // Partly covered pixels at the edges.
    const double open = std::clamp(i + 1.0 - before * count, 0.0, 1.0) *
      std::clamp(count * (1.0 - after) - i, 0.0, 1.0);
    shares[static_cast<std::size_t>(i)] =
      static_cast<float>(transmission + (1.0 - transmission) * open);
  }
  return shares;
}

/// x with P(normal < x) = p, by bisection: only for tables.
double NormalQuantile(double p)
{
  double low = -10.0;
  double high = 10.0;
  for (int k = 0; k < 60; ++k)
  {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Equally probable values of a distribution near to the normal one, of variance 1/2: two make a deviate.
class NormalTable
{
public:
  static constexpr int Bits = 11;
  static constexpr int Count = 1 << Bits;

  NormalTable()
  {
    double square = 0.0;
    std::array<double, Count> quantiles{};
    for (int i = 0; i < Count / 2; ++i)
    {
      const double quantile = NormalQuantile((i + 0.5) / Count);
      quantiles[static_cast<std::size_t>(i)] = quantile;
      quantiles[static_cast<std::size_t>(Count - 1 - i)] = -quantile;
      square += 2.0 * quantile * quantile;
    }
    const double scale = std::sqrt(0.5 * Count / square);
    for (std::size_t i = 0; i < Count; ++i)
    {
      this->Values[i] = static_cast<float>(scale * quantiles[i]);
    }
  }

  float operator()(std::uint64_t bits) const
  {
    return this->Values[bits >> (64 - Bits)] + this->Values[(bits >> (64 - 2 * Bits)) % Count];
  }

private:
  std::array<float, Count> Values{};
};

/// Poisson numbers of means 0, 1/4, 2/4 ... by Walker's alias method: one look-up each.
/// Source: Walker, "An efficient method for generating discrete random variables", ACM TOMS 3 (1977) 253.
class PoissonTable
{
public:
  PoissonTable()
  {
    for (int row = 0; row < RowCount; ++row)
    {
      this->MakeRow(row);
    }
  }

  /// Of mean row / PoissonTablesPerUnit; uses the upper 31 bits.
  int operator()(int row, std::uint64_t bits) const
  {
    const auto slot = static_cast<std::uint32_t>(bits >> 57);
    const auto fraction = static_cast<std::uint32_t>(bits >> 33) & 0xffffffU;
    const std::uint32_t entry = this->Entries[static_cast<std::size_t>(row) * SlotCount + slot];
    return static_cast<int>(fraction < (entry >> 8) ? slot : entry & 0xffU);
  }

private:
  static constexpr int RowCount = static_cast<int>(MaximumTabledMean * PoissonTablesPerUnit);
  static constexpr int SlotCount = 128; ///< numbers from 0 to 127: 128 photons of 32 never come

  /// Probabilities of a mean, times SlotCount.
  static std::array<double, SlotCount> Heights(double mean)
  {
    std::array<double, SlotCount> heights{};
    double probability = std::exp(-mean);
    for (int n = 0; n < SlotCount; ++n)
    {
      heights[static_cast<std::size_t>(n)] = probability * SlotCount;
      probability *= mean / (n + 1);
    }
    return heights;
  }

  void MakeRow(int row)
  {
    std::array<double, SlotCount> heights =
      Heights(static_cast<double>(row) / PoissonTablesPerUnit);
    std::vector<std::size_t> low;
    std::vector<std::size_t> high;
    for (std::size_t n = 0; n < SlotCount; ++n)
    {
      (heights[n] < 1.0 ? low : high).push_back(n);
    }
    std::uint32_t* entries = this->Entries.data() + static_cast<std::size_t>(row) * SlotCount;
    while (!low.empty())
    {
      const std::size_t n = low.back();
      low.pop_back();
      if (high.empty())
      {
        entries[n] = Entry(1.0, n);
        continue;
      }
      const std::size_t donor = high.back();
      entries[n] = Entry(heights[n], donor);
      heights[donor] -= 1.0 - heights[n];
      if (heights[donor] < 1.0)
      {
        high.pop_back();
        low.push_back(donor);
      }
    }
    for (const std::size_t n : high)
    {
      entries[n] = Entry(1.0, n);
    }
  }

  static std::uint32_t Entry(double share, std::size_t alias)
  {
    const double limited = std::clamp(share, 0.0, 1.0) * 0xffffff;
    return (static_cast<std::uint32_t>(std::lround(limited)) << 8) |
      static_cast<std::uint32_t>(alias);
  }

  std::array<std::uint32_t, static_cast<std::size_t>(RowCount) * SlotCount> Entries{};
};

struct NoiseTables
{
  PoissonTable poisson;
  NormalTable normal;
};

const NoiseTables& Tables()
{
  static const std::unique_ptr<const NoiseTables> tables = std::make_unique<NoiseTables>();
  return *tables;
}

/// The sum of two Poisson numbers is one of the sum of their means. `table` and `fewOrDeviation` as from the kernel.
inline float PhotonsOf(const NoiseTables& tables, float mean, std::uint64_t bits,
  std::int32_t table, float fewOrDeviation)
{
  return table >= 0 ? static_cast<float>(tables.poisson(table, bits)) + fewOrDeviation
                    : mean + fewOrDeviation * tables.normal(bits);
}

void RequireSameSize(const LineIntegrals& first, const LineIntegrals* other)
{
  if (other &&
    (other->columns != first.columns || other->rows != first.rows ||
      other->values.size() != first.values.size()))
  {
    throw std::invalid_argument("detector: layers are " + std::to_string(first.columns) + " x " +
      std::to_string(first.rows) + " and " + std::to_string(other->columns) + " x " +
      std::to_string(other->rows) + " pixels; they have to be of one size");
  }
}

void RequireImage(const LineIntegrals& image)
{
  if (image.columns < 1 || image.rows < 1 || image.columns > 8192 || image.rows > 8192 ||
    image.values.size() !=
      static_cast<std::size_t>(image.columns) * static_cast<std::size_t>(image.rows))
  {
    throw std::invalid_argument("detector: a layer of " + std::to_string(image.columns) + " x " +
      std::to_string(image.rows) + " pixels with " + std::to_string(image.values.size()) +
      " values; it has to be 1 to 8192 each way, and full");
  }
}
}

KernelChoice<DetectorKernels>& DetectorKernelChoice()
{
#if defined(DYNAMICCORONARY_WIDE_KERNELS)
  static KernelChoice<DetectorKernels> choice(DetectorKernelsBaseline, &DetectorKernelsAvx2);
#else
  static KernelChoice<DetectorKernels> choice(DetectorKernelsBaseline);
#endif
  return choice;
}

float PoissonPhotons(float mean, std::uint64_t bits)
{
  std::int32_t table = 0;
  float fewOrDeviation = 0.0F;
  DetectorKernelChoice().Get().photons(&mean, &bits, 1, &table, &fewOrDeviation);
  return PhotonsOf(Tables(), mean, bits, table, fewOrDeviation);
}

float FastExp(float x)
{
  return fastmath::Exp(x);
}

float FastLog(float x)
{
  return fastmath::Log(x);
}

void DetectorSettings::Validate() const
{
  // What is not finite fails every comparison.
  RequireDetector(this->glareFraction >= 0.0 && this->glareFraction <= 0.5, "share of glare",
    this->glareFraction, "0 to 0.5");
  RequireDetector(this->glareSigma >= 4.0 && this->glareSigma <= 200.0, "width of glare",
    this->glareSigma, "4 to 200 pixels");
  RequireDetector(
    this->blurSigma >= 0.0 && this->blurSigma <= 3.0, "blur", this->blurSigma, "0 to 3 pixels");
  RequireDetector(this->fluoroscopyLag >= 0.0 && this->fluoroscopyLag <= 0.95, "lag in fluoroscopy",
    this->fluoroscopyLag, "0 to 0.95");
  RequireDetector(
    this->cineLag >= 0.0 && this->cineLag <= 0.95, "lag in cine", this->cineLag, "0 to 0.95");
  const auto shutter = [](const char* name, double value)
  { RequireDetector(value >= 0.0 && value <= 0.45, name, value, "0 to 0.45 of the image"); };
  shutter("left shutter", this->shutters.left);
  shutter("right shutter", this->shutters.right);
  shutter("top shutter", this->shutters.top);
  shutter("bottom shutter", this->shutters.bottom);
  RequireDetector(this->shutters.transmission >= 0.0 && this->shutters.transmission <= 1.0,
    "transmission of the shutters", this->shutters.transmission, "0 to 1");
}

Detector::Detector(const DetectorSettings& settings, std::uint64_t seed)
  : Settings_(settings)
  , Seed(seed)
{
  this->SetSettings(settings);
}

void Detector::SetSettings(const DetectorSettings& settings)
{
  settings.Validate();
  this->Settings_ = settings;
  this->BlurKernel = GaussianHalf(settings.blurSigma);
  if (this->Columns_ > 0)
  {
    this->Prepare();
  }
}

void Detector::Resize(int columns, int rows)
{
  this->Columns_ = columns;
  this->Rows_ = rows;
  this->Filled = false;
  const std::size_t pixels = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  this->Transmission.assign(pixels, 0.0F);
  this->Blurred.assign(pixels, 0.0F);
  this->Signal_.assign(pixels, 0.0F);
  this->Scratch.assign(static_cast<std::size_t>(columns), 0.0F);
  this->Bits.assign(static_cast<std::size_t>(columns), 0);
  this->TableOf.assign(static_cast<std::size_t>(columns), 0);
  this->Prepare();
}

void Detector::Prepare()
{
  const Collimation& shutters = this->Settings_.shutters;
  this->ShutterColumns =
    OpenShares(this->Columns_, shutters.left, shutters.right, shutters.transmission);
  this->ShutterRows = OpenShares(this->Rows_, shutters.top, shutters.bottom, shutters.transmission);

  this->Veil.Prepare(this->Columns_, this->Rows_, this->Settings_.glareSigma);
}

const std::vector<float>& Detector::Expose(const LineIntegrals& first, const LineIntegrals* second,
  const LineIntegrals* third, double photons, std::uint64_t frame, double lag)
{
  RequireImage(first);
  RequireSameSize(first, second);
  RequireSameSize(first, third);
  RequireDetector(photons > 0.0 && photons <= 1e7, "photons a pixel", photons, "above 0, to 1e7");
  RequireDetector(lag >= 0.0 && lag < 1.0, "lag", lag, "0 to below 1");
  if (first.columns != this->Columns_ || first.rows != this->Rows_)
  {
    this->Resize(first.columns, first.rows);
  }
  this->Transmit(first, second, third);
  if (this->Settings_.glareFraction > 0.0)
  {
    this->Veil.Blur(this->Transmission.data());
  }
  // Seeds that are near to each other shall not share frames.
  const std::uint64_t key = MixBits(MixBits(this->Seed) + frame);
  for (int row = 0; row < this->Rows_; ++row)
  {
    this->DetectRow(row, static_cast<float>(photons), key);
  }
  this->BlurAcrossRows(static_cast<float>(this->Filled ? lag : 0.0));
  this->Filled = true;
  return this->Signal_;
}

void Detector::Transmit(
  const LineIntegrals& first, const LineIntegrals* second, const LineIntegrals* third)
{
  const DetectorKernels& loops = DetectorKernelChoice().Get();
  const auto width = static_cast<std::size_t>(this->Columns_);
  for (std::size_t row = 0; row < static_cast<std::size_t>(this->Rows_); ++row)
  {
    const std::size_t begin = row * width;
    loops.transmit(first.values.data() + begin, second ? second->values.data() + begin : nullptr,
      third ? third->values.data() + begin : nullptr, this->ShutterColumns.data(),
      this->ShutterRows[row], this->Columns_, this->Transmission.data() + begin);
  }
}

void Detector::DetectRow(int row, float photons, std::uint64_t key)
{
  const std::size_t begin = static_cast<std::size_t>(row) * this->Columns_;
  const auto glare = static_cast<float>(this->Settings_.glareFraction);
  if (glare > 0.0F)
  {
    this->Veil.Row(row, this->Scratch.data());
  }
  float* detected = this->Transmission.data() + begin;
  DetectorKernelChoice().Get().mix(detected, this->Scratch.data(), photons * (1.0F - glare),
    photons * glare, this->Columns_, detected);
  if (this->Settings_.noise)
  {
    this->AddNoise(detected, key + begin);
  }
  BlurMirroredRow(
    detected, this->Columns_, this->BlurKernel, this->Padded, this->Blurred.data() + begin);
}

/// @param first  counter of the row's first pixel
void Detector::AddNoise(float* row, std::uint64_t first)
{
  const NoiseTables& tables = Tables();
  const auto width = static_cast<std::size_t>(this->Columns_);
  for (std::size_t i = 0; i < width; ++i)
  {
    this->Bits[i] = MixBits(first + i);
  }
  DetectorKernelChoice().Get().photons(
    row, this->Bits.data(), this->Columns_, this->TableOf.data(), this->Scratch.data());
  for (std::size_t i = 0; i < width; ++i)
  {
    row[i] = PhotonsOf(tables, row[i], this->Bits[i], this->TableOf[i], this->Scratch[i]);
  }
}

void Detector::BlurAcrossRows(float lag)
{
  const DetectorKernels& loops = DetectorKernelChoice().Get();
  const int radius = static_cast<int>(this->BlurKernel.size()) - 1;
  std::vector<const float*> around(2 * this->BlurKernel.size() - 1);
  for (int row = 0; row < this->Rows_; ++row)
  {
    PointToMirroredRows(this->Blurred.data(), this->Columns_, this->Rows_, row, around);
    float* held = this->Signal_.data() + static_cast<std::size_t>(row) * this->Columns_;
    loops.blurAcross(
      around.data(), this->BlurKernel.data(), radius, this->Columns_, this->Scratch.data());
    loops.lag(this->Scratch.data(), lag, this->Columns_, held);
  }
}
}
