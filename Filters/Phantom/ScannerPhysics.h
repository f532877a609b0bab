/**
 * @file ScannerPhysics.h
 * @brief X-rays from the tube through matter into a detector cell, at all energies.
 *
 * Matter is told by three basis materials; what is none of them is the sum of water and
 * hydroxyapatite that attenuates most like it (Alvarez and Macovski, Phys Med Biol 1976;21:733).
 */
#ifndef DynamicCoronary_ScannerPhysics_h
#define DynamicCoronary_ScannerPhysics_h

#include "Attenuation.h"
#include "ScannerSettings.h"

#include <Eigen/Core>

namespace coronary
{
/// Basis materials: water (of 1 g/cm^3), iodine (mg/mL), hydroxyapatite (mg/cm^3).
constexpr int BasisMaterials = 3;
/// How much of each there is at a place, or along a path (times mm).
using MaterialAmounts = Eigen::Array3f;
/// Path lengths of a view's rays, in mm times amount: [column][row] for each material.
using ViewPaths = std::array<std::vector<float>, BasisMaterials>;

/**
 * Tungsten tube: Kramers' law with the anode's own absorption, and the K lines above 69.5 kV whose
 * yield follows Green and Cosslett, J Phys D 1968;1:425. Absolute output: calibrated at 120 kV.
 */
class TubeSpectrum
{
public:
  /// @param aluminium  filter, mm
  TubeSpectrum(double kilovolts, double aluminium);

  std::vector<double> energies; ///< keV, of the bins
  std::vector<double> photons;  ///< of the bins, per mm^2 at 1 m and mAs
};

/// What a detector cell gets, in keV, and with which variance.
struct CellSignal
{
  double mean;
  double variance; ///< of the photons' number and energy, keV^2
};

/// What comes through the patient, [column][row].
struct TransmittedView
{
  std::vector<float> share;   ///< of the signal without a patient
  std::vector<float> quantum; ///< keV that one effective photon brings
};

/// From path lengths to corrected line integrals.
class ScannerPhysics
{
public:
  explicit ScannerPhysics(const ScannerSettings& settings);

  /// HU of a mixture in a thin layer behind 28 cm of water on the central ray.
  double Hounsfield(const MaterialAmounts& amounts) const;

  /// Signal of a cell behind path lengths (mm times amount) in one view, without blur.
  CellSignal Signal(int column, const MaterialAmounts& path) const;

  /// Mean energy of what is detected behind a path, weighted by energy as the detector does, keV.
  double DetectedEnergy(int column, const MaterialAmounts& path) const;

  /// Photons that reach a cell in one view.
  double Photons(int column, const MaterialAmounts& path) const;

  /// What comes through the patient in a view: intensities, blurred by focal spot and cells.
  void Transmit(const ViewPaths& paths, TransmittedView& view) const;

  /**
   * Turns it into line integrals of an ideal scanner in water, in units of mm of water: noise,
   * logarithm, water correction.
   * @param current  share of the tube current
   * @param key      names the view among all of the scan
   * @param result   [column][row]
   */
  void Detect(const TransmittedView& view, double current, std::uint64_t key, float* result) const;

  /// Variance of what Detect() says of a cell, mm^2 of water: of photons (falls with the current) and of
  /// electronics (falls with its square).
  std::array<double, 2> Variance(const TransmittedView& view, int column, int row) const;

  /// Water path that gives a column the log signal, mm.
  double WaterPath(int column, double logSignal) const;

private:
  void Blur(std::vector<float>& values) const;

  const ScannerSettings Settings;
  std::vector<double> Energies;
  Eigen::ArrayXXd Coefficients; ///< 1/mm of each basis material (columns) at the energies
  Eigen::ArrayXXf Weights;      ///< photons at an energy (rows) into a cell of a column, one view
  Eigen::ArrayXf AirSignal;     ///< keV of a column
  Eigen::ArrayXXd Correction;   ///< polynomial of each column
  Eigen::ArrayXd Detected;      ///< weights behind 28 cm of water
  std::vector<float> ColumnBlur;
  std::vector<float> RowBlur;
};

/// Poisson number of a mean, a function of the key alone; beyond 1,000 from a normal number.
double PoissonNumber(double mean, std::uint64_t key);

/**
 * Amounts of basis materials in a tissue that looks like `hounsfield` at 120 kV: lung and fat of that
 * density, soft tissue, blood or muscle with iodine, bone or plaque with hydroxyapatite.
 */
class TissueMaterials
{
public:
  TissueMaterials();

  MaterialAmounts Lung(double hounsfield) const;
  MaterialAmounts Fat(double hounsfield) const;
  MaterialAmounts Soft(double hounsfield) const;
  MaterialAmounts Muscle(double hounsfield) const; ///< with iodine above 55 HU
  MaterialAmounts Blood(double hounsfield) const;  ///< with iodine above its own
  MaterialAmounts Calcified(double hounsfield) const;
  /// Stainless steel, as stents and leads are of: its K edges lie below all energies of a tube, so that it is
  /// a sum of water and hydroxyapatite, too, within 3 % from 40 to 120 keV.
  const MaterialAmounts& Metal() const { return this->Steel; }

private:
  MaterialAmounts Scaled(const MaterialAmounts& tissue, double hounsfield) const;

  ScannerPhysics Reference; ///< at 120 kV
  MaterialAmounts Adipose;
  MaterialAmounts SoftTissue;
  MaterialAmounts BloodAmounts;
  MaterialAmounts Steel;
};
}

#endif
