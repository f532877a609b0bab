/**
 * @file Detector.h
 * @brief From what rays lose to what a flat-panel detector reads: glare, quantum noise, blur, lag.
 *
 * In the order of what happens to the radiation: the beam between the shutters, N = N0 exp(-A); veiling glare (a
 * share of it comes back as a broad veil); absorption of a Poisson number of photons; spread of their light in the
 * scintillator, which blurs the noise with the image; what the panel still holds of the frame before.
 * docs/fluoroscopy-image.md has the formulas.
 */
#ifndef DynamicCoronary_Detector_h
#define DynamicCoronary_Detector_h

#include "BroadBlur.h"
#include "LineIntegrals.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// 8 bits a pixel, row by row from the top left; 0 is black.
struct GreyImage
{
  int columns = 0;
  int rows = 0;
  std::vector<std::uint8_t> values;
};

/// Rectangular shutters at the tube: how much of the image each of them covers.
struct Collimation
{
  double left = 0.0; ///< fraction of the columns, 0 to 0.45
  double right = 0.0;
  double top = 0.0; ///< fraction of the rows, 0 to 0.45
  double bottom = 0.0;
  double transmission = 0.002; ///< of the blades, 0 to 1

  bool operator==(const Collimation& other) const
  {
    return this->left == other.left && this->right == other.right && this->top == other.top &&
      this->bottom == other.bottom && this->transmission == other.transmission;
  }
  bool operator!=(const Collimation& other) const { return !(*this == other); }

  /// Share of the image that is not covered.
  double OpenFraction() const
  {
    return (1.0 - this->left - this->right) * (1.0 - this->top - this->bottom);
  }
};

struct DetectorSettings
{
  double glareFraction = 0.03; ///< of the radiation, that becomes the veil, 0 to 0.5
  double glareSigma = 18.0;    ///< standard deviation of the veil, pixels, 4 to 200
  double blurSigma = 0.7;      ///< of the scintillator's light, pixels, 0 (none) to 3
  double fluoroscopyLag = 0.3; ///< share of the frame before in each frame, 0 to 0.95
  double cineLag = 0.05;       ///< the same in cine
  bool noise = true;           ///< false: the expected number of photons
  Collimation shutters;

  /// @throws std::invalid_argument that names the first setting out of range or not finite
  void Validate() const;
};

/**
 * Reads frame by frame. The image does not depend on the number of threads (there is one) nor on the processor: a
 * frame's noise is a function of seed, frame number and pixel alone.
 */
class Detector
{
public:
  /// @throws std::invalid_argument as DetectorSettings::Validate()
  Detector(const DetectorSettings& settings, std::uint64_t seed);

  const DetectorSettings& Settings() const { return this->Settings_; }

  /// From the next frame on. @throws std::invalid_argument as DetectorSettings::Validate()
  void SetSettings(const DetectorSettings& settings);

  /**
   * One frame from the sum of one to three layers of the same size; null: no such layer.
   * @param photons  a pixel of the beam that nothing is in the way of, more than 0 to 1e7
   * @param frame    names the noise
   * @param lag      share of the frame before, 0 to below 1; it has none after Forget() or another size
   * @returns photons a pixel, row by row: Signal()
   * @throws std::invalid_argument for layers that are empty or not of one size, or numbers out of range
   */
  const std::vector<float>& Expose(const LineIntegrals& first, const LineIntegrals* second,
    const LineIntegrals* third, double photons, std::uint64_t frame, double lag);

  const std::vector<float>& Signal() const { return this->Signal_; }
  int Columns() const { return this->Columns_; }
  int Rows() const { return this->Rows_; }

  /// The next frame has no lag.
  void Forget() { this->Filled = false; }

private:
  void Resize(int columns, int rows);
  void Prepare();
  void Transmit(
    const LineIntegrals& first, const LineIntegrals* second, const LineIntegrals* third);
  void DetectRow(int row, float photons, std::uint64_t key);
  void AddNoise(float* row, std::uint64_t first);
  void BlurAcrossRows(float lag);

  DetectorSettings Settings_;
  std::uint64_t Seed;
  int Columns_ = 0;
  int Rows_ = 0;
  bool Filled = false;
  std::vector<float> ShutterColumns; ///< open share of each column, and row
  std::vector<float> ShutterRows;
  std::vector<float> BlurKernel; ///< right half
  BroadBlur Veil;
  std::vector<float> Transmission;   ///< exp(-A) between the shutters; then photons
  std::vector<float> Blurred;        ///< along rows
  std::vector<float> Scratch;        ///< of one row
  std::vector<std::uint64_t> Bits;   ///< random, of one row
  std::vector<std::int32_t> TableOf; ///< each pixel of one row
  std::vector<float> Padded;
  std::vector<float> Signal_;
};

/**
 * A Poisson number of the given mean, from 64 random bits: of a discrete distribution within 3e-7 of Poisson's up
 * to a mean of 32, above that the normal one of the same mean and variance (not rounded).
 */
float PoissonPhotons(float mean, std::uint64_t bits);

/// exp(x), relative error below 3e-7, for x in -87 to 87; limited to the values there.
float FastExp(float x);

/// ln(x), absolute error below 2e-6 for x in 1e-6 to 1e8.
float FastLog(float x);
}

#endif
