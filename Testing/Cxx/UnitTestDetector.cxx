// The image chain against closed forms: noise, glare, blur, lag, display, subtraction, runs.
#include "CounterRandom.h"
#include "Detector.h"
#include "DetectorKernels.h"
#include "FluoroscopyImager.h"
#include "Fnv1a.h"
#include "KernelChoice.h"
#include "Refusals.h"
#include "TableRow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

namespace UnitTestDetector
{
using namespace coronary;

namespace
{
struct Moments
{
  double mean = 0.0;
  double variance = 0.0;
};

template <typename Values>
Moments MomentsOf(const Values& values)
{
  Moments moments;
  for (const auto value : values)
  {
    moments.mean += value;
  }
  moments.mean /= static_cast<double>(values.size());
  for (const auto value : values)
  {
    moments.variance += (value - moments.mean) * (value - moments.mean);
  }
  moments.variance /= static_cast<double>(values.size() - 1);
  return moments;
}

LineIntegrals Flat(int columns, int rows, float value)
{
  LineIntegrals image(columns, rows);
  std::fill(image.values.begin(), image.values.end(), value);
  return image;
}

/// Nothing but what a test wants to see.
DetectorSettings Bare()
{
  DetectorSettings settings;
  settings.glareFraction = 0.0;
  settings.blurSigma = 0.0;
  settings.fluoroscopyLag = 0.0;
  settings.cineLag = 0.0;
  settings.noise = false;
  return settings;
}

/// A bright point or block on a dark field, which a detector's exp(-A) makes without further means.
LineIntegrals Block(int size, int first, int last)
{
  LineIntegrals image = Flat(size, size, 60.0F);
  for (int row = first; row <= last; ++row)
  {
    for (int column = first; column <= last; ++column)
    {
      image.values[static_cast<std::size_t>(row) * size + column] = 0.0F;
    }
  }
  return image;
}

struct Spread
{
  double sum = 0.0;
  double centre = 0.0;
  double variance = 0.0; ///< along columns
};

Spread SpreadOf(const std::vector<float>& values, int columns)
{
  Spread spread;
  double square = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i)
  {
    const auto column = static_cast<double>(i % static_cast<std::size_t>(columns));
    spread.sum += values[i];
    spread.centre += values[i] * column;
    square += values[i] * column * column;
  }
  spread.centre /= spread.sum;
  spread.variance = square / spread.sum - spread.centre * spread.centre;
  return spread;
}

Exposure Frame(std::int64_t frame, std::int64_t sequence = 1, double photons = 2000.0)
{
  Exposure exposure;
  exposure.frame = frame;
  exposure.sequence = sequence;
  exposure.photons = photons;
  return exposure;
}
}

TEST(FastMath, exponentialAndLogarithm)
{
  double exponential = 0.0;
  double logarithm = 0.0;
  for (int i = -87000; i <= 87000; i += 7)
  {
    const float x = static_cast<float>(i) / 1000.0F;
    exponential =
      std::max(exponential, std::abs(FastExp(x) / std::exp(static_cast<double>(x)) - 1.0));
  }
  for (double x = 1e-6; x < 1e8; x *= 1.0007)
  {
    const auto single = static_cast<float>(x);
    logarithm =
      std::max(logarithm, std::abs(FastLog(single) - std::log(static_cast<double>(single))));
  }
  Row("exp, -87 to 87: greatest relative error", 0.0, exponential, "3e-7");
  Row("ln, 1e-6 to 1e8: greatest error", 0.0, logarithm, "2e-6");
  EXPECT_LT(exponential, 3e-7);
  EXPECT_LT(logarithm, 2e-6);
}

TEST(Detector, attenuatesLayersTogether)
{
  Detector detector(Bare(), 1);
  const LineIntegrals a = Flat(64, 48, 1.25F);
  const LineIntegrals b = Flat(64, 48, 0.5F);
  const LineIntegrals c = Flat(64, 48, 2.0F);
  const double all = detector.Expose(a, &b, &c, 1000.0, 0, 0.0)[100];
  const double two = detector.Expose(a, nullptr, &c, 1000.0, 0, 0.0)[100];
  const double one = detector.Expose(a, nullptr, nullptr, 1000.0, 0, 0.0)[100];
  Row("1000 photons through A = 1.25 + 0.5 + 2", 1000.0 * std::exp(-3.75), all, "1e-6");
  EXPECT_NEAR(all, 1000.0 * std::exp(-3.75), 1e-6 * all);
  EXPECT_NEAR(two, 1000.0 * std::exp(-3.25), 1e-6 * two);
  EXPECT_NEAR(one, 1000.0 * std::exp(-1.25), 1e-6 * one);
}

TEST(Detector, poissonMeanAndVariance)
{
  // Around the change from tables to the normal distribution as well.
  for (const float mean : { 0.06F, 0.7F, 3.3F, 12.1F, 31.9F, 32.1F, 180.0F, 2000.0F })
  {
    RandomStream random(5, static_cast<std::uint64_t>(1000.0F * mean));
    std::vector<float> photons(400000);
    double third = 0.0;
    for (float& value : photons)
    {
      value = PoissonPhotons(mean, random.Bits());
      third += std::pow(value - mean, 3.0);
    }
    const Moments moments = MomentsOf(photons);
    char name[80];
    std::snprintf(
      name, sizeof(name), "Poisson, mean %g: variance / mean", static_cast<double>(mean));
    Row(name, 1.0, moments.variance / moments.mean, "5 %");
    EXPECT_NEAR(moments.variance / moments.mean, 1.0, 0.05);
    // Five standard errors.
    EXPECT_NEAR(moments.mean, mean, 5.0 * std::sqrt(mean / 400000.0)) << mean;
    if (mean < 32.0F)
    {
      EXPECT_NEAR(third / 400000.0 / mean, 1.0, 0.15) << mean;
      EXPECT_EQ(photons[17], std::floor(photons[17]));
    }
  }
}

TEST(Detector, smallPoissonNumbersHaveTheirFrequencies)
{
  constexpr double mean = 2.4;
  constexpr int count = 1000000;
  RandomStream random(9);
  std::vector<int> seen(200, 0);
  for (int i = 0; i < count; ++i)
  {
    ++seen[static_cast<std::size_t>(PoissonPhotons(static_cast<float>(mean), random.Bits()))];
  }
  double probability = std::exp(-mean);
  double chiSquare = 0.0;
  for (int n = 0; n <= 10; ++n)
  {
    const double expected = count * probability;
    chiSquare += std::pow(seen[static_cast<std::size_t>(n)] - expected, 2.0) / expected;
    probability *= mean / (n + 1);
  }
  // 11 cells: 99.99 % of chi squares of 11 degrees of freedom are below 37.
  Row("Poisson, mean 2.4: chi square of the numbers 0 to 10", 11.0, chiSquare, "below 37");
  EXPECT_LT(chiSquare, 37.0);
}

TEST(Detector, noiseFollowsTheDose)
{
  DetectorSettings settings;
  settings.glareFraction = 0.0;
  Detector detector(settings, 3);
  const LineIntegrals image = Flat(256, 256, 3.5F);
  const Moments once = MomentsOf(detector.Expose(image, nullptr, nullptr, 2000.0, 1, 0.0));
  const Moments twice = MomentsOf(detector.Expose(image, nullptr, nullptr, 4000.0, 2, 0.0));
  const double ratio =
    (std::sqrt(once.variance) / once.mean) / (std::sqrt(twice.variance) / twice.mean);
  Row("dose x 2: relative noise divided by", std::sqrt(2.0), ratio, "5 %");
  EXPECT_NEAR(ratio, std::sqrt(2.0), 0.05 * std::sqrt(2.0));

  settings.blurSigma = 0.0;
  Detector sharp(settings, 3);
  const Moments plain = MomentsOf(sharp.Expose(image, nullptr, nullptr, 2000.0, 1, 0.0));
  Row("whole chain without blur: variance / mean", 1.0, plain.variance / plain.mean, "5 %");
  EXPECT_NEAR(plain.variance / plain.mean, 1.0, 0.05);
  // White noise through a Gaussian keeps the square of its kernel's norm.
  double norm = 0.0;
  double sum = 0.0;
  for (int r = -3; r <= 3; ++r)
  {
    const double weight = std::exp(-0.5 * r * r / 0.49);
    norm += weight * weight;
    sum += weight;
  }
  norm = std::pow(norm / (sum * sum), 2.0);
  Row(
    "blur 0.7 px: variance of the noise that is left", norm, once.variance / plain.variance, "5 %");
  EXPECT_NEAR(once.variance / plain.variance, norm, 0.05 * norm);
}

TEST(Detector, blurKeepsTheSumAndHasItsWidth)
{
  DetectorSettings settings = Bare();
  settings.blurSigma = 0.7;
  Detector detector(settings, 1);
  const Spread spread =
    SpreadOf(detector.Expose(Block(64, 20, 20), nullptr, nullptr, 1e4, 0, 0.0), 64);
  Row("blur of a point: sum", 1e4, spread.sum, "1e-5");
  Row("blur of a point: standard deviation, px", 0.7, std::sqrt(spread.variance), "1 %");
  EXPECT_NEAR(spread.sum, 1e4, 0.1);
  EXPECT_NEAR(spread.centre, 20.0, 1e-3);
  EXPECT_NEAR(std::sqrt(spread.variance), 0.7, 0.007);
  // In a corner what would be lost comes back.
  EXPECT_NEAR(
    SpreadOf(detector.Expose(Block(64, 0, 0), nullptr, nullptr, 1e4, 1, 0.0), 64).sum, 1e4, 0.1);
}

TEST(Detector, glareKeepsTheSumAndHasItsWidth)
{
  for (const int size : { 512, 500, 511 })
  {
    DetectorSettings settings = Bare();
    settings.glareFraction = 0.5;
    Detector veiled(settings, 1);
    Detector sharp(Bare(), 1);
    // A point at every place in a cell: where its veil is, from where the point is.
    double sum = 0.0;
    double square = 0.0;
    constexpr int places = 8;
    for (int place = 0; place < places; ++place)
    {
      const LineIntegrals point = Block(size, 248 + place, 248 + place);
      sharp.Expose(point, nullptr, nullptr, 1e4, 0, 0.0);
      const std::vector<float>& signal = veiled.Expose(point, nullptr, nullptr, 1e4, 0, 0.0);
      for (std::size_t i = 0; i < signal.size(); ++i)
      {
        const double veil = 2.0 * (signal[i] - 0.5 * sharp.Signal()[i]);
        const double offset =
          static_cast<double>(i % static_cast<std::size_t>(size)) - 248.0 - place;
        sum += veil / places;
        square += veil * offset * offset / places;
      }
    }
    const double width = std::sqrt(square / sum);
    const std::string name = "glare, " + std::to_string(size) + " px: ";
    Row(name + "sum", 1e4, sum, "1e-4");
    Row(name + "standard deviation, px", 18.0, width, "1 %");
    EXPECT_NEAR(sum, 1e4, 1.0);
    EXPECT_NEAR(width, 18.0, 0.18);
    const Spread corner =
      SpreadOf(veiled.Expose(Block(size, 0, 7), nullptr, nullptr, 1e4, 1, 0.0), size);
    EXPECT_NEAR(corner.sum, 64e4, 64.0);
  }
}

TEST(Detector, lagFollowsItsStepResponse)
{
  Detector detector(Bare(), 1);
  const LineIntegrals dark = Flat(32, 32, 5.0F);
  const LineIntegrals bright = Flat(32, 32, 0.0F);
  constexpr double lag = 0.3;
  const double low = detector.Expose(dark, nullptr, nullptr, 100.0, 0, lag)[0];
  EXPECT_NEAR(low, 100.0 * std::exp(-5.0), 1e-5);
  double worst = 0.0;
  double measured = 0.0;
  for (int n = 0; n < 8; ++n)
  {
    measured = detector.Expose(bright, nullptr, nullptr, 100.0, 1, lag)[5];
    const double wanted = low + (100.0 - low) * (1.0 - std::pow(lag, n + 1));
    worst = std::max(worst, std::abs(measured / wanted - 1.0));
  }
  Row("lag 0.3, step response over 8 frames: greatest relative error", 0.0, worst, "1e-5");
  EXPECT_LT(worst, 1e-5);
  detector.Forget();
  EXPECT_NEAR(detector.Expose(dark, nullptr, nullptr, 100.0, 2, lag)[0], low, 1e-6);
}

TEST(Detector, shuttersCoverWhatTheyShall)
{
  DetectorSettings settings = Bare();
  settings.shutters.left = 0.25;
  settings.shutters.bottom = 0.125;
  settings.shutters.transmission = 0.01;
  Detector detector(settings, 1);
  const std::vector<float>& signal =
    detector.Expose(Flat(64, 64, 0.0F), nullptr, nullptr, 100.0, 0, 0.0);
  const auto at = [&signal](int column, int row)
  { return signal[static_cast<std::size_t>(row) * 64 + column]; };
  EXPECT_NEAR(at(15, 10), 1.0, 1e-4);
  EXPECT_NEAR(at(16, 10), 100.0, 1e-3);
  EXPECT_NEAR(at(40, 55), 100.0, 1e-3);
  EXPECT_NEAR(at(40, 56), 1.0, 1e-4);
  EXPECT_NEAR(at(0, 63), 0.01, 1e-5);
  EXPECT_DOUBLE_EQ(settings.shutters.OpenFraction(), 0.75 * 0.875);
}

TEST(Detector, sameSeedSameBitsOnAllProcessors)
{
  LineIntegrals image(120, 88);
  for (std::size_t i = 0; i < image.values.size(); ++i)
  {
    image.values[i] = 2.5F + 2.5F * std::sin(0.01F * static_cast<float>(i));
  }
  const auto hash = [&image](std::uint64_t seed, std::uint64_t frame)
  {
    Detector detector({}, seed);
    detector.Expose(image, &image, nullptr, 20000.0, frame, 0.3);
    const std::vector<float>& signal =
      detector.Expose(image, nullptr, &image, 20000.0, frame + 1, 0.3);
    return Fnv1a(signal.data(), signal.size() * sizeof(float));
  };
  const std::uint64_t wide = hash(7, 3);
  EXPECT_EQ(wide, hash(7, 3));
  EXPECT_NE(wide, hash(8, 3));
  EXPECT_NE(wide, hash(7, 4));
  ASSERT_TRUE(DetectorKernelChoice().Select(Instructions::Baseline));
  EXPECT_EQ(wide, hash(7, 3));
  DetectorKernelChoice().Select(Instructions::Widest);
}

TEST(Detector, staysFiniteForWhatLayersMayHold)
{
  LineIntegrals image = Flat(64, 64, 1.0F);
  image.values[0] = std::numeric_limits<float>::quiet_NaN();
  image.values[1] = std::numeric_limits<float>::infinity();
  image.values[2] = -std::numeric_limits<float>::infinity();
  image.values[3] = 1e30F;
  image.values[4] = -5.0F;
  Detector detector({}, 1);
  for (const float value : detector.Expose(image, nullptr, nullptr, 1e7, 0, 0.0))
  {
    ASSERT_TRUE(std::isfinite(value) && value >= 0.0F);
  }
}

TEST(Detector, refusesWhatIsNotPossible)
{
  const auto settings = [](auto change)
  {
    DetectorSettings changed;
    change(changed);
    Detector detector(changed, 1);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal(
    [&] { settings([](DetectorSettings& s) { s.glareFraction = 0.6; }); }, "share of glare");
  ExpectRefusal(
    [&] { settings([=](DetectorSettings& s) { s.glareSigma = nan; }); }, "width of glare");
  ExpectRefusal([&] { settings([](DetectorSettings& s) { s.blurSigma = -1.0; }); }, "blur");
  ExpectRefusal(
    [&] { settings([](DetectorSettings& s) { s.fluoroscopyLag = 1.0; }); }, "lag in fluoroscopy");
  ExpectRefusal([&] { settings([](DetectorSettings& s) { s.cineLag = -0.1; }); }, "lag in cine");
  ExpectRefusal(
    [&] { settings([](DetectorSettings& s) { s.shutters.top = 0.5; }); }, "top shutter");
  Detector detector({}, 1);
  const LineIntegrals image = Flat(8, 8, 1.0F);
  const LineIntegrals other = Flat(8, 9, 1.0F);
  LineIntegrals hollow(8, 8);
  hollow.values.clear();
  ExpectRefusal([&] { detector.Expose(LineIntegrals(), nullptr, nullptr, 1.0, 0, 0.0); }, "0 x 0");
  ExpectRefusal([&] { detector.Expose(hollow, nullptr, nullptr, 1.0, 0, 0.0); }, "0 values");
  ExpectRefusal([&] { detector.Expose(image, &other, nullptr, 1.0, 0, 0.0); }, "8 x 8 and 8 x 9");
  ExpectRefusal([&] { detector.Expose(image, nullptr, nullptr, nan, 0, 0.0); }, "photons a pixel");
  ExpectRefusal([&] { detector.Expose(image, nullptr, nullptr, 1.0, 0, 1.0); }, "lag");
}

TEST(FluoroscopyImager, greyIsTheLogarithmInItsWindow)
{
  ImagerSettings settings;
  settings.detector = Bare();
  settings.harmonisation = 0.0;
  settings.window = 4.0;
  FluoroscopyImager imager(settings);
  LineIntegrals background = Flat(64, 64, 3.0F);
  LineIntegrals contrast(64, 64);
  contrast.values[10] = 1.0F;
  contrast.values[20] = 3.0F;
  contrast.values[30] = -1.0F;
  const GreyImage& grey = imager.Expose(background, LineIntegrals(64, 64), contrast, Frame(0));
  EXPECT_NEAR(imager.DisplayLevel(), -3.0, 1e-6);
  EXPECT_NEAR(grey.values[0], 127.5, 0.51);
  EXPECT_NEAR(grey.values[10], 127.5 - 255.0 / 4.0, 0.51);
  EXPECT_EQ(grey.values[20], 0);
  EXPECT_NEAR(grey.values[30], 127.5 + 255.0 / 4.0, 0.51);
  EXPECT_EQ(&grey, &imager.Shown());
}

TEST(FluoroscopyImager, contrastDoesNotMakeItFlicker)
{
  // A bolus over a tenth of the field; what is far away changes by the glare alone.
  ImagerSettings settings;
  settings.detector.noise = false;
  settings.detector.fluoroscopyLag = 0.0;
  FluoroscopyImager imager(settings);
  LineIntegrals background(512, 512);
  for (std::size_t i = 0; i < background.values.size(); ++i)
  {
    background.values[i] = 3.5F + std::sin(0.02F * static_cast<float>(i % 512));
  }
  const LineIntegrals nothing(512, 512);
  LineIntegrals bolus(512, 512);
  for (int row = 180; row < 340; ++row)
  {
    std::fill_n(bolus.values.begin() + row * 512 + 180, 160, 2.5F);
  }
  const GreyImage before = imager.Expose(background, nothing, nothing, Frame(0));
  double level = imager.DisplayLevel();
  const GreyImage after = imager.Expose(background, nothing, bolus, Frame(1));
  EXPECT_DOUBLE_EQ(imager.DisplayLevel(), level);
  int worstFar = 0;
  for (std::size_t i = 0; i < before.values.size(); ++i)
  {
    const int row = static_cast<int>(i / 512);
    const int column = static_cast<int>(i % 512);
    // Four standard deviations of the glare away.
    const bool away = row < 180 - 72 || row >= 340 + 72 || column < 180 - 72 || column >= 340 + 72;
    const int change = std::abs(int(before.values[i]) - int(after.values[i]));
    worstFar = std::max(worstFar, away ? change : 0);
  }
  Row("bolus over a tenth of the field: change of grey far from it", 0.0, worstFar, "1 of 255");
  EXPECT_LE(worstFar, 1);
  EXPECT_LT(after.values[260 * 512 + 260], before.values[260 * 512 + 260]);
}

TEST(FluoroscopyImager, brightnessFollowsTheBackgroundSlowly)
{
  ImagerSettings settings;
  settings.exposureSeconds = 0.5;
  FluoroscopyImager imager(settings);
  const LineIntegrals nothing(64, 64);
  imager.Expose(Flat(64, 64, 3.0F), nothing, nothing, Frame(0));
  double worst = 0.0;
  for (int n = 1; n <= 20; ++n)
  {
    imager.Expose(Flat(64, 64, 5.0F), nothing, nothing, Frame(n));
    const double wanted = -5.0 + 2.0 * std::exp(-n / 15.0 / 0.5);
    worst = std::max(worst, std::abs(imager.DisplayLevel() - wanted));
  }
  Row("automatic brightness, exponential of 0.5 s: greatest error", 0.0, worst, "1e-5");
  EXPECT_LT(worst, 1e-5);
}

TEST(FluoroscopyImager, subtractionOfEqualFramesIsMidGreyWithTheNoiseOfBoth)
{
  const LineIntegrals background = Flat(256, 256, 1.0F);
  const LineIntegrals nothing(256, 256);
  for (const int maskFrames : { 1, 4 })
  {
    ImagerSettings settings;
    settings.detector = Bare();
    settings.detector.noise = true;
    settings.maskFrames = maskFrames;
    settings.subtractionWindow = 1.0;
    FluoroscopyImager imager(settings, 4);
    imager.SetMode(ImageMode::Subtraction);
    constexpr double photons = 2000.0;
    const Moments first = MomentsOf(imager.Expose(background, nothing, nothing, Frame(0)).values);
    EXPECT_NEAR(first.mean, 128.0, 0.5);
    EXPECT_EQ(first.variance, 0.0);
    EXPECT_TRUE(imager.HasMask());
    for (int frame = 1; frame < maskFrames; ++frame)
    {
      imager.Expose(background, nothing, nothing, Frame(frame));
    }
    const Moments moments =
      MomentsOf(imager.Expose(background, nothing, nothing, Frame(maskFrames)).values);
    // Relative noise of a frame is the noise of its logarithm; rounding to grey levels adds 1/12.
    const double single = 255.0 / std::sqrt(photons * std::exp(-1.0));
    const double noise = std::sqrt(moments.variance - 1.0 / 12.0) / single;
    const double wanted = std::sqrt(1.0 + 1.0 / maskFrames);
    const std::string name = "subtraction, mask of " + std::to_string(maskFrames) + ": ";
    Row(name + "mean grey", 127.5, moments.mean, "1");
    Row(name + "noise over that of a frame", wanted, noise, "5 %");
    EXPECT_NEAR(moments.mean, 127.5, 1.0);
    EXPECT_NEAR(noise, wanted, 0.05 * wanted);
  }
}

TEST(FluoroscopyImager, subtractionShowsContrastAlone)
{
  ImagerSettings settings;
  settings.detector = Bare();
  settings.subtractionWindow = 2.0;
  FluoroscopyImager imager(settings);
  imager.SetMode(ImageMode::Subtraction);
  LineIntegrals background = Flat(64, 64, 2.0F);
  background.values[7] = 4.0F;
  const LineIntegrals nothing(64, 64);
  LineIntegrals contrast(64, 64);
  contrast.values[9] = 0.5F;
  imager.Expose(background, nothing, nothing, Frame(0));
  const GreyImage grey = imager.Expose(background, nothing, contrast, Frame(1));
  EXPECT_NEAR(grey.values[7], 127.5, 0.51);
  EXPECT_NEAR(grey.values[9], 127.5 - 255.0 * 0.25, 0.51);
  // A new mask: on request, from the pedal, with new radiation.
  Exposure withMask = Frame(2);
  withMask.mask = true;
  EXPECT_NEAR(imager.Expose(background, nothing, contrast, withMask).values[9], 127.5, 0.51);
  EXPECT_NEAR(
    imager.Expose(background, nothing, nothing, Frame(3)).values[9], 127.5 + 255.0 * 0.25, 0.51);
  EXPECT_NEAR(imager.Expose(background, nothing, nothing, Frame(4, 2)).values[9], 127.5, 0.51);
  imager.Expose(background, nothing, contrast, Frame(5, 2));
  imager.TakeMask();
  EXPECT_NEAR(imager.Expose(background, nothing, contrast, Frame(6, 2)).values[9], 127.5, 0.51);
}

TEST(FluoroscopyImager, roadmapPutsTheVesselsUnderTheLiveImage)
{
  ImagerSettings settings;
  settings.detector = Bare();
  settings.subtractionWindow = 2.0;
  settings.roadmapOpacity = 0.5;
  FluoroscopyImager imager(settings);
  imager.SetMode(ImageMode::Roadmap);
  const LineIntegrals background = Flat(64, 64, 2.0F);
  const LineIntegrals nothing(64, 64);
  LineIntegrals vessel(64, 64);
  LineIntegrals wire(64, 64);
  for (int row = 0; row < 64; ++row)
  {
    std::fill_n(vessel.values.begin() + row * 64 + 20, 5, 1.0F);
    wire.values[static_cast<std::size_t>(row) * 64 + 40] = 0.6F;
  }
  imager.Expose(background, nothing, nothing, Frame(0));
  for (int frame = 1; frame < 20; ++frame)
  {
    // The bolus comes and goes.
    imager.Expose(background, nothing, frame < 12 ? vessel : nothing, Frame(frame));
  }
  EXPECT_FALSE(imager.HasRoadmap());
  imager.Expose(background, nothing, nothing, Frame(20, 2));
  EXPECT_TRUE(imager.HasRoadmap());
  const GreyImage& grey = imager.Expose(background, wire, nothing, Frame(21, 2));
  const auto at = [&grey](int column)
  { return int(grey.values[30 * 64 + static_cast<std::size_t>(column)]); };
  Row("roadmap: full vessel over mid-grey", 127.5 * 0.5, at(22) - 127.5, "1");
  EXPECT_NEAR(at(22), 127.5 + 127.5 * 0.5, 1.0);
  EXPECT_NEAR(at(5), 127.5, 0.51);
  EXPECT_NEAR(at(40), 127.5 - 255.0 * 0.3, 0.51);
  imager.SetMode(ImageMode::Roadmap);
  EXPECT_FALSE(imager.HasRoadmap());
}

TEST(FluoroscopyImager, refusesWhatIsNotPossible)
{
  const auto with = [](auto change)
  {
    ImagerSettings settings;
    change(settings);
    FluoroscopyImager imager(settings);
  };
  ExpectRefusal([&] { with([](ImagerSettings& s) { s.window = 0.0; }); }, "window");
  ExpectRefusal([&] { with([](ImagerSettings& s) { s.level = 11.0; }); }, "level");
  ExpectRefusal([&] { with([](ImagerSettings& s) { s.harmonisation = 1.0; }); }, "harmonisation");
  ExpectRefusal([&] { with([](ImagerSettings& s) { s.exposureSeconds = 0.0; }); }, "time constant");
  ExpectRefusal(
    [&] { with([](ImagerSettings& s) { s.subtractionWindow = 0.0; }); }, "window of subtraction");
  ExpectRefusal([&] { with([](ImagerSettings& s) { s.roadmapOpacity = 2.0; }); }, "opacity");
  ExpectRefusal([&] { with([](ImagerSettings& s) { s.roadmapThreshold = -1.0; }); }, "threshold");
  ExpectRefusal([&] { with([](ImagerSettings& s) { s.maskFrames = 0; }); }, "frames of a mask");
  ExpectRefusal([&] { with([](ImagerSettings& s) { s.detector.blurSigma = 9.0; }); }, "blur");
  FluoroscopyImager imager;
  const LineIntegrals nothing(8, 8);
  ExpectRefusal([&] { imager.Expose(nothing, LineIntegrals(9, 8), nothing, Frame(0)); }, "9 x 8");
  EXPECT_EQ(imager.Shown().columns, 0);
  // Small and odd sizes work.
  imager.Expose(LineIntegrals(1, 1), LineIntegrals(1, 1), LineIntegrals(1, 1), Frame(0));
  EXPECT_EQ(
    imager.Expose(LineIntegrals(13, 7), LineIntegrals(13, 7), LineIntegrals(13, 7), Frame(1))
      .values.size(),
    91U);
}
}
