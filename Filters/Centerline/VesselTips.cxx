#include "VesselTips.h"

#include "CoronaryAnatomy.h"
#include "FittedOdds.h"
#include "Median.h"

#include <algorithm>

namespace coronary
{
namespace
{
/// mm before a tip, of its three sections: healthy vessels lose 0.1 mm of radius at most from the second to the first.
constexpr double Sections[] = { 0.0, 2.0, 5.0, 9.0 };
constexpr double JudgedLength = 4.0; ///< mm of vessel without which a tip is not judged
constexpr double TipLength = 3.0;    ///< mm over which the calibre is taken
constexpr double UsualTip = 0.48;    ///< mm, median radius of healthy tips
constexpr double UsualBefore = 0.51; ///< mm, the same in the second section

/// Fitted to the tips of phantoms (scripts/fit-odds.sh). A unit is 0.1 mm of radius, in hearts of usual calibre.
constexpr double Unit = 0.1;
constexpr double TipIntercept = -5.56;
constexpr std::array<FittedSign, NumberOfTipSigns> TipSigns{ {
  { "wide_before", 1.11 },
  { "tapers_before", 0.43 },
  { "wide_narrows", 1.35 },
} };

/// A right coronary artery that is not dominant ends in full calibre.
bool IsTrunkOfRca(const VesselTree& tree, const VesselPath& path)
{
  const int segment = tree.segmentId.empty() ? 0 : tree.segmentId[path.points.back()];
  return segment == ProximalRCA || segment == MidRCA || segment == DistalRCA;
}
}

const std::array<const char*, NumberOfTipSigns>& TipSignNames()
{
  static const auto names = NamesOf(TipSigns);
  return names;
}

double RadiusBeforeTip(const VesselTree& tree, const VesselPath& path, double from, double to)
{
  std::vector<double> radii;
  // The first point of a branch is its parent's.
  for (std::size_t i = path.FirstOwn(); i < path.points.size(); ++i)
  {
    const double back = path.arc.back() - path.arc[i];
    if (back >= from && back <= to)
    {
      radii.push_back(tree.radius[path.points[i]]);
    }
  }
  return MedianOf(radii);
}

double TipCalibre(const VesselTree& tree, const std::vector<VesselPath>& paths)
{
  std::vector<double> radii;
  for (const VesselPath& path : paths)
  {
    radii.push_back(RadiusBeforeTip(tree, path, 0.0, TipLength));
  }
  return radii.empty() ? 1.0 : std::clamp(MedianOf(radii) / UsualTip, 0.9, 1.3);
}

std::vector<VesselTip> JudgeTips(const VesselTree& tree, const std::vector<VesselPath>& paths)
{
  const double calibre = TipCalibre(tree, paths);
  std::vector<VesselTip> tips;
  for (const VesselPath& path : paths)
  {
    VesselTip& tip = tips.emplace_back();
    tip.end = RadiusBeforeTip(tree, path, Sections[0], Sections[1]);
    tip.before = RadiusBeforeTip(tree, path, Sections[1], Sections[2]);
    const double farther = RadiusBeforeTip(tree, path, Sections[2], Sections[3]);
    // No sign counts more than it was seen to in what the weights are fitted to: a wide vessel may end wide.
    const double wide = std::clamp((tip.before / calibre - UsualBefore) / Unit, -1.0, 3.0);
    const double narrows = std::clamp((tip.before - tip.end) / (Unit * calibre), 0.0, 4.0);
    tip.signs = { wide,
      farther > 0.0 ? std::clamp((farther - tip.before) / (Unit * calibre), -1.0, 3.0) : 0.0,
      narrows * std::max(0.0, wide) };
    const bool judged = path.arc.back() >= JudgedLength && !IsTrunkOfRca(tree, path);
    tip.goesOn = judged ? ProbabilityOf(FittedOdds(TipIntercept, TipSigns, tip.signs)) : 0.0;
  }
  return tips;
}
}
