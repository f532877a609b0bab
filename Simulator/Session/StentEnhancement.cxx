#include "StentEnhancement.h"

#include "BroadBlur.h"
#include "XrayAngiogram.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

namespace coronary
{
namespace
{
using Place = std::complex<double>; // column and row

constexpr std::size_t LeastFrames = 8;
constexpr double LeastDistance = 6.0; // pixels between markers
constexpr double Foreshortened = 0.1;
constexpr double Around = 3.0;  // sides of the square in distances of the markers
constexpr double Broad = 0.06;  // sides: standard deviation beyond which brightness is evened out
constexpr double Tails = 0.005; // of the pixels, that become black, white

struct Marked
{
  const XrayAngiogram::Frame* frame = nullptr;
  Place first;
  Place between; ///< from the first to the second one
};

std::vector<Marked> MarkedFrames(const XrayAngiogram& run)
{
  std::vector<Marked> marked;
  for (const XrayAngiogram::Frame& frame : run.frames)
  {
    const auto inside = [&](const std::array<double, 2>& place)
    {
      return place[0] >= run.shutterLeft && place[0] <= run.columns - 1 - run.shutterRight &&
        place[1] >= run.shutterTop && place[1] <= run.rows - 1 - run.shutterBottom;
    };
    if (frame.markers.size() == 2 && inside(frame.markers[0]) && inside(frame.markers[1]))
    {
      const Place first(frame.markers[0][0], frame.markers[0][1]);
      const Place second(frame.markers[1][0], frame.markers[1][1]);
      marked.push_back({ &frame, first, second - first });
    }
  }
  return marked;
}

/// Bilinear; at the borders the nearest pixel.
double ValueAt(const XrayAngiogram& run, const XrayAngiogram::Frame& frame, const Place& place)
{
  const double x = std::clamp(place.real(), 0.0, run.columns - 1.0);
  const double y = std::clamp(place.imag(), 0.0, run.rows - 1.0);
  const int column = std::min(static_cast<int>(x), run.columns - 2);
  const int row = std::min(static_cast<int>(y), run.rows - 2);
  const double u = x - column;
  const double v = y - row;
  const std::uint8_t* at = &frame.pixels[static_cast<std::size_t>(row) * run.columns + column];
  return (1.0 - v) * ((1.0 - u) * at[0] + u * at[1]) +
    v * ((1.0 - u) * at[run.columns] + u * at[run.columns + 1]);
}

/// Takes away what is broader than a stent.
void Flatten(std::vector<float>& values, int size)
{
  BroadBlur broad;
  broad.Prepare(size, size, std::max(4.0, Broad * size));
  broad.Blur(values.data());
  std::vector<float> row(static_cast<std::size_t>(size));
  for (int y = 0; y < size; ++y)
  {
    broad.Row(y, row.data());
    for (int x = 0; x < size; ++x)
    {
      values[static_cast<std::size_t>(y) * size + x] -= row[x];
    }
  }
}

GreyImage Stretched(const std::vector<float>& values, int size)
{
  std::vector<float> sorted = values;
  const auto tail = static_cast<std::ptrdiff_t>(Tails * static_cast<double>(sorted.size()));
  std::nth_element(sorted.begin(), sorted.begin() + tail, sorted.end());
  const float black = sorted[tail];
  std::nth_element(sorted.begin(), sorted.end() - 1 - tail, sorted.end());
  const float white = std::max(*(sorted.end() - 1 - tail), black + 1.0F);
  GreyImage image{ size, size, {} };
  for (const float value : values)
  {
    image.values.push_back(static_cast<std::uint8_t>(
      std::lround(255.0F * std::clamp((value - black) / (white - black), 0.0F, 1.0F))));
  }
  return image;
}
}

EnhancedStent EnhanceStent(const XrayAngiogram& run, int size)
{
  EnhancedStent enhanced;
  std::vector<Marked> marked = MarkedFrames(run);
  if (marked.size() < LeastFrames || run.columns < 2 || run.rows < 2 || size < 1)
  {
    return enhanced;
  }
  const auto median = marked.begin() + static_cast<std::ptrdiff_t>(marked.size() / 2);
  std::nth_element(marked.begin(), median, marked.end(),
    [](const Marked& a, const Marked& b) { return std::abs(a.between) < std::abs(b.between); });
  const Marked reference = *median;
  const double distance = std::abs(reference.between);
  marked.erase(std::remove_if(marked.begin(), marked.end(),
                 [&](const Marked& one)
                 { return std::abs(std::abs(one.between) / distance - 1.0) > Foreshortened; }),
    marked.end());
  if (marked.size() < LeastFrames || distance < LeastDistance)
  {
    return enhanced;
  }
  enhanced.frames = static_cast<int>(marked.size());
  enhanced.scale = Around * distance / size;
  const Place middle = reference.first + 0.5 * reference.between;
  std::vector<float>& mean = enhanced.mean;
  for (int row = 0; row < size; ++row)
  {
    for (int column = 0; column < size; ++column)
    {
      const Place place =
        middle + enhanced.scale * Place(column + 0.5 - 0.5 * size, row + 0.5 - 0.5 * size);
      const Place along = (place - reference.first) / reference.between;
      double sum = 0.0;
      for (const Marked& one : marked)
      {
        sum += ValueAt(run, *one.frame, one.first + along * one.between);
      }
      mean.push_back(static_cast<float>(sum / static_cast<double>(marked.size())));
    }
  }
  std::vector<float> even = mean;
  Flatten(even, size);
  enhanced.image = Stretched(even, size);
  return enhanced;
}
}
