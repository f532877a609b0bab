/**
 * @file DilatableWall.h
 * @brief How sections of a vessel answer to what presses from inside: elastic wall, plaque that yields and stays
 * open, stents.
 */
#ifndef DynamicCoronary_DilatableWall_h
#define DynamicCoronary_DilatableWall_h

#include "StentRing.h"
#include "VesselLesions.h"
#include "WallMotion.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// Pressures in atm, beyond that of blood. docs/simulator.md says what was chosen and why.
struct DilationSettings
{
  double plaqueStiffness = 30.0;   ///< a reference diameter of opening, soft and fibrous
  double plaqueYield = 2.0;        ///< from where it stays open
  double calciumStiffness = 120.0; ///< the same of a whole ring of calcium
  double calciumYield = 16.0;
  double elasticShare = 0.25;   ///< of the opening beyond yield that springs back
  double wholePlaque = 0.3;     ///< part of the diameter from which plaque has its whole stiffness
  double meanPressure = 0.1316; ///< of blood: 100 mmHg
  double wallStiffening = 12.0; ///< b in ln(p / p0) = b (D / D0 - 1), of the wall around it
  double tearing = 1.3;         ///< D / reference from which dissection threatens
  double heldStiffening = 4.0;  ///< c of plaque that a stent holds
};

/// A section. Lengths are radii, mm; openings are parts of the reference radius.
struct WallStation
{
  double rest = 0.0;
  double reference = 0.0;
  double calcium = 0.0;      ///< part of the circle
  double stiffness = 0.0;    ///< atm, of its plaque; 0: none
  double yield = 0.0;        ///< atm
  double hardening = 0.0;    ///< atm a reference of plastic opening
  double plastic = 0.0;      ///< opening that stays
  double pinched = 0.0;      ///< opening that a shifted carina takes, of a branch's mouth
  double held = 0.0;         ///< greatest opening since there is a stent
  std::int32_t stented = -1; ///< number of its rings in the wall's list; -1: none
};

/// The station of a radius in a reference one. @param calcium  part of the section, 0 to 1
WallStation MakeWallStation(
  double rest, double reference, double calcium, const DilationSettings& settings = {});

/**
 * p(R) = plaque((R - rest) / reference) + wall(R / reference).
 * Plaque: k (g - g_p); where that is above yield + H g_p it flows: k (g - g_p) = yield + H g_p, with
 * H = k r / (1 - r), so that (1 - r) of the opening beyond yield stays. Wall: p0 (exp(b (R / reference - 1)) - 1) above 1.
 * Behind a stent plaque comes back as tissue does, softly at last: from p_held at the greatest opening by
 * p_held (exp(c u) - 1) / (exp(c) - 1), u being 1 there and 0 at g_p.
 */
double WallPressure(const WallStation& station, double radius, const DilationSettings& settings);
/// Plastic opening after a radius.
double PlasticOpening(const WallStation& station, double radius);
/// Where nothing presses.
double NaturalRadius(const WallStation& station, const DilationSettings& settings);

/// All sections of the vessels, by the points of their axes (numbers in one list).
class DilatableWall
{
public:
  /// @param points, axis  at one moment
  DilatableWall(const WallTopology& topology, const std::vector<Vector3>& points,
    const std::vector<Vector3>& axis, const DilationSettings& settings = {});

  const DilationSettings& Settings() const { return this->Settings_; }
  const std::vector<WallStation>& Stations() const { return this->Stations_; }
  /// Radii of the vessel now, mm.
  const std::vector<double>& Radii() const { return this->Radii_; }

  /// A ring is left in a section, within those that are there.
  void Place(std::int64_t point, const StentRing& ring);
  /// Of a section, the innermost one last.
  const std::vector<StentRing>& Rings(std::int64_t point) const;
  /// mm to what a balloon meets there: a ring, or the wall.
  double InsideRadius(std::int64_t point) const;
  /// mm between the outermost ring and the wall; 0 without a ring.
  double Gap(std::int64_t point) const;
  /// atm that hold rings and wall open, together. @param radius  mm, inside
  double Resistance(std::int64_t point, double radius) const;

  /// What presses from outside leaves a section so much narrower where nothing presses from inside.
  /// Where there is a stent it holds.
  /// @param part  of its radius, 0 to 1  @param least  mm that are left in any case
  void Pinch(std::int64_t point, double part, double least);

  /// Sections that are not held any more go to where nothing presses, rings to where they and the wall balance.
  void Release();
  /// A section is held open; what flows plastically stays. @param radius  mm, inside
  void Hold(std::int64_t point, double radius);

  /// Of sections that differ from rest. @param axis, points  at one moment
  void Deform(const std::vector<Vector3>& axis, std::vector<Vector3>& points) const;

  std::uint64_t Hash(std::uint64_t hash) const;

private:
  /// What rings do when nothing holds them: they come back, then stay. Only what came back flows inwards.
  enum class Coming
  {
    Held,
    Back,
    Stays
  };
  struct Stented
  {
    std::vector<StentRing> rings; ///< from the wall inwards
    Coming coming = Coming::Back;
  };
  double Resistance(
    const WallStation& station, const Stented& stented, std::size_t rings, double radius) const;
  void HoldRing(std::int64_t point, std::size_t ring, double radius, bool flows);
  void ReleaseRing(std::int64_t point, std::size_t ring, bool flows);
  void SetRadius(std::int64_t point, double radius);
  void Remember(std::int64_t point);

  DilationSettings Settings_;
  WallSections Sections;
  std::vector<WallStation> Stations_;
  std::vector<Stented> Stented_;
  std::vector<double> Radii_;
  std::vector<double> Ratio;       ///< now to rest
  std::vector<std::int64_t> Moved; ///< that were ever held, ascending
};
}

#endif
