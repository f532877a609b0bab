/**
 * @file CtScanner.h
 * @brief A beating heart as a CT scanner sees it: projections of moving matter, reconstructed.
 *
 * Every view is taken at its own moment of the beat, at all energies of a tube, with noise of photons
 * and electronics; slices are made of views of different beats. docs/scanner.md has formulas, sources,
 * and what is not modelled.
 */
#ifndef DynamicCoronary_CtScanner_h
#define DynamicCoronary_CtScanner_h

#include "ScannedAnatomy.h"
#include "ScannerGating.h"

#include <map>
#include <memory>
#include <string>

namespace coronary
{
/// One of the images that are made of the same path lengths.
struct ScanVariant
{
  ReconstructionKernel kernel = ReconstructionKernel::Standard;
  double imageNoise = 0.0; ///< HU, as ScannerSettings::imageNoise
};

/// Slices at one phase that are made of the same views, as they were seen.
struct ScannedStack
{
  GatedStack stack;
  Vector3 shift;     ///< of the heart in the middle of its views, mm
  double iodine;     ///< factor on all iodine
  double interval;   ///< R-R of its first beat, s
  double firstPhase; ///< of the heart, at the first and the last view: whole numbers are beats
  double lastPhase;
  double current; ///< mean share of the tube current
};

/// Keeps the finished parts of a scan, so that one that was stopped goes on where it was.
class ScanStore
{
public:
  virtual ~ScanStore() = default;
  virtual bool Has(const std::string& name) const = 0;
  virtual void Put(const std::string& name, const std::vector<std::int16_t>& part) = 0;
  virtual std::vector<std::int16_t> Get(const std::string& name) const = 0;
};

class MemoryScanStore : public ScanStore
{
public:
  bool Has(const std::string& name) const override { return this->Parts.count(name) > 0; }
  void Put(const std::string& name, const std::vector<std::int16_t>& part) override
  {
    this->Parts[name] = part;
  }
  std::vector<std::int16_t> Get(const std::string& name) const override
  {
    return this->Parts.at(name);
  }

private:
  std::map<std::string, std::vector<std::int16_t>> Parts;
};

class CtScanner
{
public:
  /**
   * @param anatomy   has to live as long
   * @param grid      the images; axial slices: direction identity
   * @param phases    of the heart, 0 to 1
   * @param variants  none: the settings' own kernel and noise
   * @throws std::invalid_argument for settings that can not be, a grid or a patient that does not fit
   *   into the scanner
   */
  CtScanner(const ScannedAnatomy& anatomy, const ScannerSettings& settings, const ImageGrid& grid,
    const std::vector<double>& phases, const std::vector<ScanVariant>& variants = {});
  ~CtScanner();
  CtScanner(const CtScanner&) = delete;
  CtScanner& operator=(const CtScanner&) = delete;

  /**
   * Makes all parts that the store does not have. Views are taken once for all phases and variants, and
   * kept only as long as they are needed. The same on any number of threads.
   * @throws Cancelled
   */
  void Scan(ScanStore& store, const ProgressCallback& progress = {});

  /**
   * The image of a phase, by its index, from its parts.
   * @param values  HU, limited to -1024..3071, i fastest over grid.extent
   * @throws Cancelled
   */
  void Image(std::size_t phase, std::size_t variant, const ScanStore& store, std::int16_t* values,
    const ProgressCallback& progress = {}) const;

  std::vector<ScannedStack> Stacks(std::size_t phase) const;

  /// Tube current of a variant, mA; after Scan().
  double Milliamperes(std::size_t variant) const;

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};
}

#endif
