/**
 * @file CtScanner.h
 * @brief The phantom as a CT scanner sees it: projections of the moving heart, reconstructed.
 *
 * Every view is taken at its own moment of the beat, at all energies of a tube, with noise of photons
 * and electronics; slabs are taken in different beats. docs/scanner.md has formulas, sources, and
 * what is not modelled.
 */
#ifndef DynamicCoronary_CtScanner_h
#define DynamicCoronary_CtScanner_h

#include "CoronaryPhantom.h"
#include "ScannerSettings.h"

#include <memory>

namespace coronary
{
/// A slab at one phase, as it was seen.
struct ScannedSlab
{
  ScannerSlab slab;
  double firstPhase; ///< of the heart, at the first and the last view: whole numbers are beats
  double lastPhase;
  double current; ///< mean share of the tube current
};

/// Immutable after construction.
class CtScanner
{
public:
  /**
   * @param phantom  has to live as long
   * @param grid     the images; axial slices: direction identity
   * @throws std::invalid_argument for settings that can not be, a grid or a patient that does not fit
   *   into the scanner
   */
  CtScanner(const CoronaryPhantom& phantom, const ScannerSettings& settings, const ImageGrid& grid);
  ~CtScanner();
  CtScanner(const CtScanner&) = delete;
  CtScanner& operator=(const CtScanner&) = delete;

  /**
   * The image at a phase: the tube's middle view is taken that share of the mean R-R interval after
   * each slab's R peak. The same on any number of threads.
   * @param values  HU, limited to -1024..3071, i fastest over grid.extent
   * @throws Cancelled
   */
  void Scan(double phase, std::int16_t* values, const ProgressCallback& progress = {}) const;

  std::vector<ScannedSlab> Slabs(double phase) const;

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};
}

#endif
