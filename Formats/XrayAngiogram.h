/**
 * @file XrayAngiogram.h
 * @brief A run of X-ray images of a C-arm as a DICOM file: an XA image of several frames (PS3.3 A.14).
 */
#ifndef DynamicCoronary_XrayAngiogram_h
#define DynamicCoronary_XrayAngiogram_h

#include "Geometry.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
struct XrayAngiogram
{
  struct Frame
  {
    std::vector<std::uint8_t> pixels;   ///< rows from the top; 0 is black
    double primary = 0.0;               ///< degrees, LAO positive
    double secondary = 0.0;             ///< degrees, cranial positive
    Vector3 isocentre{ 0.0, 0.0, 0.0 }; ///< where in the patient, mm
    double seconds = 0.0;               ///< since the session began
    bool afterRWave = false;            ///< the first one after an R wave
    /// Column and row of both markers of a balloon, pixels; empty: it has none in the image. No file has them.
    std::vector<std::array<double, 2>> markers;
  };

  std::string patient; ///< a name; the file says that the images are simulated
  std::string view;    ///< of the first frame, for people
  std::string program; ///< version that made them
  std::uint64_t study =
    0; ///< the same for all runs of a session, and another one for other sessions
  int run = 1;
  int part = 1; ///< of a run that is too long for one file
  int columns = 0;
  int rows = 0;
  double width = 0.0;  ///< of the detector, mm, of all columns
  double height = 0.0; ///< mm
  ///@{
  /// Columns and rows that the shutters cover, from each border.
  int shutterLeft = 0;
  int shutterRight = 0;
  int shutterTop = 0;
  int shutterBottom = 0;
  ///@}
  double frameRate = 15.0;        ///< Hz
  double sourceToDetector = 0.0;  ///< mm
  double sourceToIsocentre = 0.0; ///< mm
  double areaDose = 0.0;          ///< Gy cm^2, of these frames
  bool subtracted = false;        ///< a mask was taken away, or a roadmap is shown
  double contrast = 0.0;          ///< mL given until the last frame; 0: none
  double iodine = 0.0;            ///< mg/mL of it
  std::int64_t dropped = 0;       ///< frames before the first one that were not kept
  std::vector<Frame> frames;

  std::size_t Bytes() const;
};

/**
 * Writes the file atomically; pixels are for display (8 bits, intensity relationship DISP), uncompressed. Unique identifiers
 * are made of `study`, run, part and the pixels: the same run gives the same file.
 * @param run  its frames' pixels are taken away
 * @throws std::runtime_error naming `path`; std::invalid_argument for a run without frames or whose frames are of another
 *         size
 */
void WriteXrayAngiogram(XrayAngiogram run, const std::string& path);
}

#endif
