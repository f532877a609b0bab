/**
 * @file BroadBlur.h
 * @brief A Gaussian many pixels wide, cheaply: between means of cells of pixels.
 */
#ifndef DynamicCoronary_BroadBlur_h
#define DynamicCoronary_BroadBlur_h

#include <vector>

namespace coronary
{
/// Right half, from the centre on, of a sampled Gaussian that sums to 1; sigma in samples, 0: nothing is blurred.
std::vector<float> GaussianHalf(double sigma);

/// Where a sample outside 0 .. count - 1 is taken from: the image is continued as in a mirror at its edge, so that a
/// symmetric kernel neither loses nor adds there.
int Mirrored(int i, int count);

/**
 * Blurs along a row that is continued as in mirrors.
 * @param padded  scratch, width + 2 half.size()
 */
void BlurMirroredRow(const float* in, int width, const std::vector<float>& half,
  std::vector<float>& padded, float* result);

/// An odd number of rows around `row`, of an image that is continued as in mirrors.
void PointToMirroredRows(
  const float* image, int columns, int rows, int row, std::vector<const float*>& around);

/**
 * Means over cells of up to 16 x 16 pixels, a Gaussian between the cells, linear interpolation between their centres:
 * together of the wanted standard deviation. A single pixel's blur is centred at its cell, up to half a cell beside.
 * The image's sum is kept, to rounding.
 */
class BroadBlur
{
public:
  /// @param sigma  pixels, 4 or more. Sizes that 2, 4, 8 or 16 do not divide take longer.
  void Prepare(int columns, int rows, double sigma);

  /// columns * rows values, row by row.
  void Blur(const float* image);

  /// The pixels of one row of the blurred image.
  void Row(int row, float* result) const;

private:
  int Columns = 0;
  int Rows = 0;
  int CellColumns = 1; ///< pixels a cell
  int CellRows = 1;
  std::vector<float> Along; ///< right halves of the Gaussians between cells
  std::vector<float> Across;
  std::vector<float> Cells;
  std::vector<float> Scratch;
  std::vector<float> Padded;
};
}

#endif
