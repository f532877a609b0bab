/**
 * @file ScannedAnatomy.h
 * @brief What a scanner looks at: matter that moves, and the paths of rays through it.
 */
#ifndef DynamicCoronary_ScannedAnatomy_h
#define DynamicCoronary_ScannedAnatomy_h

#include "CoronaryPhantom.h"
#include "ScannerProjection.h"

namespace coronary
{
/// How the patient is at a moment of the scan.
struct PatientState
{
  double phase = 0.0;              ///< of the heart: whole numbers at the R peaks
  Vector3 shift = Vector3::Zero(); ///< mm
  double iodine = 1.0;             ///< factor on all iodine
};

/// Matter as a function of time: safe to use from several threads.
class ScannedAnatomy
{
public:
  virtual ~ScannedAnatomy() = default;

  /// Mean R-R interval, s.
  virtual double CycleLength() const = 0;

  /// The trunk, which does not end above and below.
  virtual CoronaryPhantom::Box Body() const = 0;

  /// Around all that moves; its height does not count. What moves beyond it is seen at rest.
  virtual CoronaryPhantom::Box Moving() const { return this->Body(); }

  /// Fills the maps with all matter, but what Tubes() and Balls() have. Who projects them calls
  /// FindColumns().
  virtual void Render(const PatientState& state, const ImageGrid& grid, MaterialVolume& volume,
    const ProgressCallback& progress) const = 0;

  ///@{
  /// Matter that is too fine for voxels.
  virtual std::vector<ScannedTube> Tubes(const PatientState& state) const = 0;
  virtual std::vector<ScannedBall> Balls(const PatientState& state) const = 0;
  ///@}
};

/// The phantom; it has to live as long.
class ScannedPhantom : public ScannedAnatomy
{
public:
  explicit ScannedPhantom(const CoronaryPhantom& phantom);

  double CycleLength() const override { return this->Phantom.Settings().cycleLength; }
  CoronaryPhantom::Box Body() const override { return this->Phantom.Body(); }
  CoronaryPhantom::Box Moving() const override { return this->Heart; }
  void Render(const PatientState& state, const ImageGrid& grid, MaterialVolume& volume,
    const ProgressCallback& progress) const override;
  std::vector<ScannedTube> Tubes(const PatientState& state) const override;
  std::vector<ScannedBall> Balls(const PatientState& state) const override;

private:
  MaterialAmounts Amounts(PhantomTissue tissue, double hounsfield, double iodine) const;

  const CoronaryPhantom& Phantom;
  const TissueMaterials Tissue;
  CoronaryPhantom::Box Heart;
};

/**
 * The patient in the scanner during a short time: made ready once, then seen by many views. The chest
 * stands still, in voxels twice as wide, kept as long as the table is near; the heart's box, with what the
 * shift moves, is rendered anew. Between them one fades into the other.
 */
class ScannedPatient
{
public:
  /// @param anatomy, settings  have to live as long
  ScannedPatient(const ScannedAnatomy& anatomy, const ScannerSettings& settings);

  /**
   * Makes ready for views around a moment and a height of the table. Threads are used within.
   * @throws Cancelled
   */
  void Prepare(const PatientState& state, double height, const ProgressCallback& progress = {});

  /// Paths of a view's rays at its own state, close to that of Prepare(). Safe from many threads.
  void Project(const ScannerView& view, const PatientState& state, ViewPaths& paths) const;

private:
  void PrepareStill(double iodine, double height, const ProgressCallback& progress);
  ImageGrid Grid(const CoronaryPhantom::Box& box, double low, double high, double spacing) const;
  void Fade(MaterialVolume& volume, bool inside) const;

  const ScannedAnatomy& Anatomy;
  const ScannerSettings& Settings;
  const ScannerProjector Projector;
  const CoronaryPhantom::Box Body;
  const CoronaryPhantom::Box Heart;
  double Reach; ///< of the rays from the central plane, within the body, mm
  MaterialVolume Still;
  MaterialVolume Beating;
  std::array<int, 2> StillKey{ 0, -1 }; ///< step of height and of iodine that the chest is made for
};
}

#endif
