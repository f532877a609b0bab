#include "ScannerReconstruction.h"

#include "Numbers.h"
#include "ScannerKernels.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr int FrequencySteps = 1024;
constexpr int BlockRows = 4; ///< of pixels that share a pass over the views

/// Values between samples at equal steps from 0 to 1, by the polynomial through all five.
double Quartic(const double (&samples)[5], double at)
{
  double sum = 0.0;
  for (int i = 0; i < 5; ++i)
  {
    double part = samples[i];
    for (int j = 0; j < 5; ++j)
    {
      part *= j == i ? 1.0 : (4.0 * at - j) / (i - j);
    }
    sum += part;
  }
  return sum;
}
}

KernelChoice<ScannerKernels>& ScannerKernelChoice()
{
#if defined(DYNAMICCORONARY_WIDE_KERNELS)
  static KernelChoice<ScannerKernels> choice(ScannerKernelsBaseline, &ScannerKernelsAvx2);
#else
  static KernelChoice<ScannerKernels> choice(ScannerKernelsBaseline);
#endif
  return choice;
}

HalfScanReconstruction::HalfScanReconstruction(
  const ScannerSettings& settings, ReconstructionKernel kernel)
  : Settings(settings)
  , HalfFan(0.5 * ((settings.HalfScanViews() - 1) * settings.ViewAngle() - Pi))
  , Kernel(settings.channels)
{
  // Fourier integral of the windowed ramp, straight between samples, over [0, Nyquist]; exact for
  // those pieces, so that far values of the kernel do not come out of cancellation.
  const double pitch = settings.ColumnPitch();
  const double step = 0.5 / pitch / FrequencySteps;
  std::vector<double> ramp(FrequencySteps + 1);
  for (int k = 0; k <= FrequencySteps; ++k)
  {
    ramp[k] = k * step * Window(kernel, static_cast<double>(k) / FrequencySteps);
  }
  for (int n = 0; n < settings.channels; ++n)
  {
    double sum = 0.0;
    if (n == 0)
    {
      for (int k = 0; k < FrequencySteps; ++k)
      {
        sum += 0.5 * (ramp[k] + ramp[k + 1]) * step;
      }
    }
    else
    {
      const double omega = 2.0 * Pi * n * pitch;
      sum = ramp[FrequencySteps] * std::sin(omega * FrequencySteps * step) / omega;
      for (int k = 0; k < FrequencySteps; ++k)
      {
        sum += (ramp[k + 1] - ramp[k]) / step *
          (std::cos(omega * (k + 1) * step) - std::cos(omega * k * step)) / (omega * omega);
      }
    }
    const double angle = n * pitch;
    const double fan = n == 0 ? 1.0 : angle / std::sin(angle);
    // Twice the integral for negative frequencies; once the pitch for the sum over columns.
    this->Kernel[n] = static_cast<float>(2.0 * sum * fan * fan * pitch);
  }
}

double HalfScanReconstruction::Window(ReconstructionKernel kernel, double frequency)
{
  switch (kernel)
  {
    case ReconstructionKernel::Soft:
      return Quartic({ 1.0, 0.82, 0.46, 0.16, 0.0 }, frequency);
    case ReconstructionKernel::Standard:
      return Quartic({ 1.0, 0.93, 0.74, 0.44, 0.05 }, frequency);
    case ReconstructionKernel::Sharp:
      break;
  }
  return Quartic({ 1.0, 1.05, 1.17, 1.22, 0.92 }, frequency);
}

double HalfScanReconstruction::Weight(int view, double column) const
{
  const double beta = view * this->Settings.ViewAngle();
  const double gamma = this->Settings.ColumnAngle(column);
  const double whole = Pi + 2.0 * this->HalfFan;
  const auto ramp = [](double way, double width)
  {
    const double sine = std::sin(0.25 * Pi * way / width);
    return sine * sine;
  };
  if (beta < 2.0 * (this->HalfFan - gamma))
  {
    return ramp(beta, this->HalfFan - gamma);
  }
  if (beta > Pi - 2.0 * gamma)
  {
    return ramp(whole - beta, this->HalfFan + gamma);
  }
  return 1.0;
}

void HalfScanReconstruction::Filter(int view, float share, const float* values,
  const std::array<int, 2>& columns, float* result) const
{
  const ScannerSettings& s = this->Settings;
  const int rows = s.rows;
  thread_local std::vector<float> weighted;
  weighted.resize(static_cast<std::size_t>(s.channels) * rows);
  for (int c = 0; c < s.channels; ++c)
  {
    const double weight =
      share * this->Weight(view, c) * s.sourceToAxis * std::cos(s.ColumnAngle(c));
    for (int r = 0; r < rows; ++r)
    {
      const double rise = s.RowHeight(r) / s.sourceToDetector;
      const std::size_t at = static_cast<std::size_t>(c) * rows + r;
      weighted[at] = values[at] * static_cast<float>(weight / std::sqrt(1.0 + rise * rise));
    }
  }
  ScannerKernelChoice().Get().convolve(
    this->Kernel.data(), weighted.data(), s.channels, rows, columns[0], columns[1], result);
}

std::array<int, 2> HalfScanReconstruction::Columns(const Vector3& axis, const ImageGrid& grid) const
{
  const ScannerSettings& s = this->Settings;
  double radius = 0.0;
  for (const int i : { grid.extent[0], grid.extent[1] })
  {
    for (const int j : { grid.extent[2], grid.extent[3] })
    {
      const Vector3 corner = grid.IndexToWorld(i, j, grid.extent[4]) - axis;
      radius = std::max(radius, std::hypot(corner[0], corner[1]));
    }
  }
  const double reach = std::asin(std::min(1.0, radius / s.sourceToAxis)) / s.ColumnPitch();
  const double middle = s.MiddleColumn();
  return { std::clamp(static_cast<int>(middle - reach), 0, s.channels - 1),
    std::clamp(static_cast<int>(middle + reach) + 1, 0, s.channels - 1) };
}

std::vector<double> HalfScanReconstruction::AxisWeights(int view) const
{
  const ScannerSettings& s = this->Settings;
  const double middle = s.MiddleColumn();
  const int before = std::clamp(static_cast<int>(middle), 0, s.channels - 2);
  const double after = middle - before;
  // A slice lies anywhere between two rows.
  constexpr double betweenRows = 2.0 / 3.0;
  std::vector<double> squares(s.channels);
  for (int c = 0; c < s.channels; ++c)
  {
    const double kernel = (1.0 - after) * this->Kernel[std::abs(before - c)] +
      after * this->Kernel[std::abs(before + 1 - c)];
    const double weight =
      s.ViewAngle() / s.sourceToAxis * this->Weight(view, c) * std::cos(s.ColumnAngle(c)) * kernel;
    squares[c] = betweenRows * weight * weight;
  }
  return squares;
}

void HalfScanReconstruction::BackProject(const std::vector<FilteredView>& views,
  const Vector3& axis, const ImageGrid& grid, float* values, const ProgressCallback& progress) const
{
  const ScannerSettings& s = this->Settings;
  const std::array<int, 6>& e = grid.extent;
  const int nx = e[1] - e[0] + 1;
  const int ny = e[3] - e[2] + 1;
  const int nz = e[5] - e[4] + 1;
  const Vector3 corner = grid.IndexToWorld(e[0], e[2], e[4]);
  const ScannerKernels& kernels = ScannerKernelChoice().Get();
  const auto block = [&](std::int64_t first, std::int64_t last)
  {
    std::vector<float> line(s.rows + 1);
    std::fill(values + first * nx * nz, values + last * nx * nz, 0.0f);
    for (const FilteredView& view : views)
    {
      for (std::int64_t j = first; j < last; ++j)
      {
        kernels.backProject(
          { view.values.data(), s.channels, s.rows, s.MiddleColumn(), s.ColumnPitch(),
            { std::cos(view.angle), std::sin(view.angle) }, s.sourceToAxis, corner[0] - axis[0],
            grid.spacing[0], corner[1] + static_cast<double>(j) * grid.spacing[1] - axis[1],
            corner[2] - view.height, grid.spacing[2], s.sourceToDetector / s.rowPitch, nx, nz,
            line.data(), values + j * nx * nz });
      }
    }
    const auto turn = static_cast<float>(s.ViewAngle());
    std::for_each(
      values + first * nx * nz, values + last * nx * nz, [turn](float& value) { value *= turn; });
  };
  ParallelFor(ny, BlockRows, block, progress);
}
}
