#include "DetectorKernels.h"

#include "FastMath.h"

#include <cmath>

namespace coronary
{
namespace
{
/// Air noise of a CT can make a line integral a little negative; more is taken as this.
constexpr float MinimumIntegral = -1.0F;

template <typename Sum>
void TransmitRow(
  const Sum& sum, const float* columnShutter, float rowShutter, int width, float* result)
{
  for (int i = 0; i < width; ++i)
  {
    const float integral = sum(i);
    // What is no number passes nothing.
    const float x =
      integral >= MinimumIntegral ? -integral : (integral < 0.0F ? -MinimumIntegral : -87.0F);
    result[i] = fastmath::Exp(x) * (columnShutter[i] * rowShutter);
  }
}

void Transmit(const float* first, const float* second, const float* third,
  const float* columnShutter, float rowShutter, int width, float* result)
{
  if (second && third)
  {
    TransmitRow([=](int i) { return first[i] + second[i] + third[i]; }, columnShutter, rowShutter,
      width, result);
  }
  else if (second || third)
  {
    const float* other = second ? second : third;
    TransmitRow(
      [=](int i) { return first[i] + other[i]; }, columnShutter, rowShutter, width, result);
  }
  else
  {
    TransmitRow([=](int i) { return first[i]; }, columnShutter, rowShutter, width, result);
  }
}

void Mix(const float* transmission, const float* veil, float direct, float veiled, int width,
  float* result)
{
  for (int i = 0; i < width; ++i)
  {
    result[i] = direct * transmission[i] + veiled * veil[i];
  }
}

/// Of a mean below 1 / PoissonTablesPerUnit, by inversion: how many partial sums a uniform number reaches.
inline float FewPhotons(float mean, float uniform)
{
  const float none = 1.0F -
    mean *
      (1.0F -
        mean * (0.5F - mean * (1.0F / 6.0F - mean * (1.0F / 24.0F - mean * (1.0F / 120.0F)))));
  const float one = mean * none;
  const float two = one * mean * (1.0F / 2.0F);
  const float three = two * mean * (1.0F / 3.0F);
  const float four = three * mean * (1.0F / 4.0F);
  const float upTo1 = none + one;
  const float upTo2 = upTo1 + two;
  const float upTo3 = upTo2 + three;
  const float upTo4 = upTo3 + four;
  return (uniform >= none ? 1.0F : 0.0F) + (uniform >= upTo1 ? 1.0F : 0.0F) +
    (uniform >= upTo2 ? 1.0F : 0.0F) + (uniform >= upTo3 ? 1.0F : 0.0F) +
    (uniform >= upTo4 ? 1.0F : 0.0F);
}

void Photons(const float* mean, const std::uint64_t* bits, int width, std::int32_t* table,
  float* fewOrDeviation)
{
  for (int i = 0; i < width; ++i)
  {
    const float positive = mean[i] > 0.0F ? mean[i] : 0.0F;
    const bool tabled = positive < MaximumTabledMean;
    const float limited = tabled ? positive : 0.0F;
    const auto row = static_cast<std::int32_t>(limited * PoissonTablesPerUnit);
    const float rest = limited - static_cast<float>(row) / PoissonTablesPerUnit;
    const auto low = static_cast<std::int32_t>((bits[i] & 0xffffffffU) >> 8);
    const float few = FewPhotons(rest, static_cast<float>(low) * 0x1p-24F);
    const float deviation = std::sqrt(positive);
    table[i] = tabled ? row : -1;
    fewOrDeviation[i] = tabled ? few : deviation;
  }
}

void BlurAlong(const float* in, const float* kernel, int radius, int width, float* result)
{
  if (radius == 3)
  {
    // The default's: everything in registers.
    for (int i = 0; i < width; ++i)
    {
      result[i] = ((kernel[0] * in[i] + kernel[1] * (in[i - 1] + in[i + 1])) +
                    kernel[2] * (in[i - 2] + in[i + 2])) +
        kernel[3] * (in[i - 3] + in[i + 3]);
    }
    return;
  }
  for (int i = 0; i < width; ++i)
  {
    result[i] = kernel[0] * in[i];
  }
  for (int r = 1; r <= radius; ++r)
  {
    const float weight = kernel[r];
    for (int i = 0; i < width; ++i)
    {
      result[i] += weight * (in[i - r] + in[i + r]);
    }
  }
}

void BlurAcross(const float* const* rows, const float* kernel, int radius, int width, float* result)
{
  const float* const* middle = rows + radius;
  for (int i = 0; i < width; ++i)
  {
    result[i] = kernel[0] * middle[0][i];
  }
  for (int r = 1; r <= radius; ++r)
  {
    const float weight = kernel[r];
    const float* above = middle[-r];
    const float* below = middle[r];
    for (int i = 0; i < width; ++i)
    {
      result[i] += weight * (above[i] + below[i]);
    }
  }
}

template <int Size>
void AddCellsOf(const float* in, float share, int cells, float* sums)
{
  for (int cell = 0; cell < cells; ++cell)
  {
    float sum = 0.0F;
    for (int i = 0; i < Size; ++i)
    {
      sum += in[cell * Size + i];
    }
    sums[cell] += share * sum;
  }
}

void AddCells(const float* in, int size, float share, int cells, float* sums)
{
  switch (size)
  {
    case 16:
      return AddCellsOf<16>(in, share, cells, sums);
    case 8:
      return AddCellsOf<8>(in, share, cells, sums);
    case 4:
      return AddCellsOf<4>(in, share, cells, sums);
    case 2:
      return AddCellsOf<2>(in, share, cells, sums);
    default:
      return AddCellsOf<1>(in, share, cells, sums);
  }
}

void Lag(const float* fresh, float lag, int width, float* held)
{
  for (int i = 0; i < width; ++i)
  {
    held[i] = fresh[i] + lag * (held[i] - fresh[i]);
  }
}

void Logarithm(
  const float* signal, float minimum, float unattenuated, std::int64_t count, float* result)
{
  for (std::int64_t i = 0; i < count; ++i)
  {
    result[i] = fastmath::Log(signal[i] > minimum ? signal[i] : minimum) - unattenuated;
  }
}

void Grey(const float* values, float scale, float offset, std::int64_t count, std::uint8_t* grey)
{
  for (std::int64_t i = 0; i < count; ++i)
  {
    float value = scale * values[i] + offset + 0.5F;
    value = value > 0.0F ? value : 0.0F;
    value = value < 255.0F ? value : 255.0F;
    grey[i] = static_cast<std::uint8_t>(static_cast<std::int32_t>(value));
  }
}
}

#if defined(__AVX2__)
const DetectorKernels DetectorKernelsAvx2
#else
const DetectorKernels DetectorKernelsBaseline
#endif
  { Transmit, Mix, Photons, BlurAlong, BlurAcross, AddCells, Lag, Logarithm, Grey };
}
