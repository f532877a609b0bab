/**
 * @file ScannerSettings.h
 * @brief What a simulated CT scanner is: geometry, tube, beats, reconstruction.
 *
 * Third-generation geometry: tube and detector turn together about the z axis, the detector is an arc
 * about the focal spot. docs/scanner.md has the sources of all numbers.
 */
#ifndef DynamicCoronary_ScannerSettings_h
#define DynamicCoronary_ScannerSettings_h

#include "Geometry.h"

#include <string>
#include <variant>
#include <vector>

namespace coronary
{
enum class ReconstructionKernel
{
  Soft,
  Standard,
  Sharp
};

/// Everything that decides what a scanner sees. Defaults: a single source with 64 rows. Names, units and
/// ranges of the numbers: AllScannerNumbers().
struct ScannerSettings
{
  // Geometry.
  double sourceToAxis = 541.0;       ///< of the tube from the axis of rotation
  double sourceToDetector = 949.075; ///< of the tube from the detector
  int channels = 888;                ///< detector columns
  int rows = 64;                     ///< detector rows
  double channelPitch = 1.0239;      ///< of the columns, at the detector
  double channelOffset = 0.25;       ///< of the arc's middle from the central ray, columns
  double rowPitch = 1.0988;          ///< at the detector
  double fill = 0.85;                ///< active share of a cell's width and height
  double focalSpot = 0.9;            ///< its width
  int viewsPerTurn = 984;            ///< of each tube
  int sources = 1;                   ///< two stand at a right angle
  double turnTime = 0.35;            ///< of the gantry

  // Tube.
  double kilovolts = 120.0;        ///< of each tube
  double milliamperes = 600.0;     ///< of each tube
  double aluminium = 3.0;          ///< flat filter
  double systolicCurrent = 1.0;    ///< share of the current before 55 and after 96 % R-R
  double electronicNoise = 3500.0; ///< standard deviation, electrons
  double electronsPerKeV = 17.0;   ///< that a cell gives
  int noise = 1; ///< 0: neither Poisson nor electronic noise, whatever image_noise_hu says

  // Time.
  double pitch = 0.0;          ///< table feed of a turn over the rows' height; 0: step and shoot
  int segments = 1;            ///< beats that share the angles of a half scan
  int extrasystole = 0;        ///< beat of the scan that is cut short, counted from 1; 0: none
  double overlap = 0.125;      ///< share of a slab (helical: of a beat's feed) that is seen again
  double beatDeviation = 0.03; ///< relative standard deviation of the R-R intervals
  double heartShift = 0.87;    ///< standard deviation of a beat's shift along each axis
  double breathing = 0.0;      ///< drift of the heart towards the feet over the whole scan
  double contrastLoss = 0.0;   ///< share of the iodine lost from beat to beat

  // Reconstruction.
  ReconstructionKernel kernel = ReconstructionKernel::Standard;
  double imageNoise = 0.0; ///< HU in the middle of the patient: sets the current; 0: does not
  double iterative = 0.0;  ///< share of the noise that smoothing within edges takes away

  // Computing.
  double anatomySpacing = 0.5; ///< voxels of the material maps
  double anatomyStep = 0.008;  ///< time between two material maps
  std::uint64_t seed = 1;      ///< of noise, beats and shifts

  /// @throws std::invalid_argument that names the first setting at fault
  void Validate() const;

  /// Angle of a detector column at the focal spot, rad.
  double ColumnPitch() const { return this->channelPitch / this->sourceToDetector; }
  double ColumnAngle(double column) const
  {
    return (column - 0.5 * (this->channels - 1) - this->channelOffset) * this->ColumnPitch();
  }
  /// Column of the central ray.
  double MiddleColumn() const { return 0.5 * (this->channels - 1) + this->channelOffset; }
  /// Height of a row on the detector over the central plane, mm.
  double RowHeight(double row) const { return (row - 0.5 * (this->rows - 1)) * this->rowPitch; }
  /// Greatest angle between a ray and the central ray, rad.
  double HalfFan() const;
  /// Radius of the circle that all views see, mm.
  double FieldRadius() const;
  /// Height of a slab at the axis, mm.
  double SlabHeight() const
  {
    return this->rows * this->rowPitch * this->sourceToAxis / this->sourceToDetector;
  }
  double ViewAngle() const { return 2.0 * 3.14159265358979323846 / this->viewsPerTurn; }
  /// Views of a half scan: 180 degrees and the fan.
  int HalfScanViews() const;
  /// From the first view of a half scan to its last, s.
  double HalfScanTime() const;
};

/// A number of ScannerSettings, as files name it.
struct ScannerNumber
{
  const char* name;
  std::variant<double ScannerSettings::*, int ScannerSettings::*> member;
  double low;
  double high;
};
const std::vector<ScannerNumber>& AllScannerNumbers();

/// Names of the presets, as options take them.
const std::vector<std::string>& ScannerPresets();

/// @throws std::invalid_argument that lists the presets
ScannerSettings ScannerPreset(const std::string& name);

}

#endif
