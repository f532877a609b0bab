/**
 * @file Losses.h
 * @brief What of a phantom's tree was not found, what a run says is wrong, and whether one names the other.
 */
#ifndef DynamicCoronary_Losses_h
#define DynamicCoronary_Losses_h

#include "CoronaryPhantom.h"
#include "PhantomScan.h"
#include "SweepSurface.h"

#include <map>
#include <string>
#include <vector>

namespace coronary
{
constexpr double MinimumRadius = 0.5; ///< mm: thinner vessels need not be found
constexpr double FoundWithin = 1.5;   ///< mm from an axis

/// Connected true vessel that was not found, or vessel that is not there.
struct LostPath
{
  double length = 0.0; ///< mm
  std::vector<Vector3> points;
  std::map<int, double> segments; ///< mm of each true segment; empty of what is not there
  int treeId = 0;                 ///< 0 left, 1 right

  /// "OM3 32, dLCx 4"; segments of less than 3 mm only where there is no other.
  std::string Text() const;
};

struct LengthComparison
{
  double found = 0.0;           ///< share of the true length
  double missed = 0.0;          ///< mm
  double wrong = 0.0;           ///< mm of the result that is no artery
  std::vector<LostPath> losses; ///< what was missed, longest first
  std::vector<LostPath> extras; ///< what is no artery, longest first
};

/// The truth's and the result's lengths within a distance of each other.
LengthComparison CompareLengths(const PhantomTree& truth, const VesselTree& tree);

/// The share of a line, by length, that is artery.
double ShareOnArteries(const PhantomTree& truth, const std::vector<Vector3>& line);

/// The share of some places.
double ShareNearArteries(const PhantomTree& truth, const std::vector<Vector3>& places);

/// From a place to the nearest of some points, mm; infinite without points.
double Distance(const Vector3& place, const std::vector<Vector3>& points);

/// Something that a run says is wrong.
struct Said
{
  std::string source; ///< "ostia", "seeds", "bridge", "check", "loose", "vein", "surface"
  std::string what;
  std::string vessel; ///< SCCT name, "LAD", "LCx", "LCA" or "RCA", or none
  std::vector<Vector3> places;
};

/// All that `run` prints as a warning or an error about this tree, apart from its surface.
std::vector<Said> WarningsOf(const PhantomScan& scan, const FoundTree& found);

/// What the surface leaves out.
std::vector<Said> WarningsOf(const SweptSurface& surface);

/**
 * Whether a warning says where a loss is: its place is within 15 mm of it, or its vessel is the SCCT segment of a quarter of
 * it or more, or a whole artery (LAD, LCx, LCA, RCA) that a quarter of it or more belongs to.
 */
bool Names(const Said& said, const LostPath& loss);

/// Whether there is a reason for a warning: a loss or an extra of 3 mm or more that it names, or a true lesion or a wrong
/// ostium within 15 mm.
bool IsJustified(
  const Said& said, const LengthComparison& lengths, const std::vector<Vector3>& troubles);

/**
 * The losses that a case has to tell of and does not: none when no more than 10 mm are missed in all; else the longest loss
 * and every one above 10 mm has to be named.
 */
std::vector<LostPath> Untold(const LengthComparison& lengths, const std::vector<Said>& said);
constexpr double MaximumUntold = 10.0; ///< mm
}

#endif
