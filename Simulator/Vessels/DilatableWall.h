/**
 * @file DilatableWall.h
 * @brief How sections of a vessel answer to what presses from inside: elastic wall, plaque that yields and stays open.
 */
#ifndef DynamicCoronary_DilatableWall_h
#define DynamicCoronary_DilatableWall_h

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
};

/// A section. Lengths are radii, mm; openings are parts of the reference radius.
struct WallStation
{
  double rest = 0.0;
  double reference = 0.0;
  double stiffness = 0.0; ///< atm, of its plaque; 0: none
  double yield = 0.0;     ///< atm
  double hardening = 0.0; ///< atm a reference of plastic opening
  double plastic = 0.0;   ///< opening that stays
};

/// The station of a radius in a reference one. @param calcium  part of the section, 0 to 1
WallStation MakeWallStation(
  double rest, double reference, double calcium, const DilationSettings& settings = {});

/**
 * p(R) = plaque((R - rest) / reference) + wall(R / reference).
 * Plaque: k (g - g_p); where that is above yield + H g_p it flows: k (g - g_p) = yield + H g_p, with
 * H = k r / (1 - r), so that (1 - r) of the opening beyond yield stays. Wall: p0 (exp(b (R / reference - 1)) - 1) above 1.
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
  /// Radii now, mm.
  const std::vector<double>& Radii() const { return this->Radii_; }

  /// Sections that are not held any more go to where nothing presses.
  void Release();
  /// A section is held open; what flows plastically stays.
  void Hold(std::int64_t point, double radius);

  /// Of sections that differ from rest. @param axis, points  at one moment
  void Deform(const std::vector<Vector3>& axis, std::vector<Vector3>& points) const;

  std::uint64_t Hash(std::uint64_t hash) const;

private:
  DilationSettings Settings_;
  WallSections Sections;
  std::vector<WallStation> Stations_;
  std::vector<double> Radii_;
  std::vector<double> Ratio;       ///< now to rest
  std::vector<std::int64_t> Moved; ///< that were ever held, ascending
};
}

#endif
