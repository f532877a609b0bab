/**
 * @file VesselLinking.h
 * @brief Pieces of vessel that hang on nothing, and the ways across lesions that lead to them.
 *
 * A stenosis, a calcification or an occlusion interrupts what is connected, not the artery. Pieces of
 * tube that no seed reaches are described by their ends: where, in which direction, how wide, how
 * bright. An end is linked to an end of the tree, or to its wall, when both point at each other, calibre
 * and brightness fit, and the cheapest way between them does not lead through a chamber. Every link has a
 * confidence: the odds of its signs, with weights fitted to phantoms (scripts/fit-odds.sh).
 */
#ifndef DynamicCoronary_VesselLinking_h
#define DynamicCoronary_VesselLinking_h

#include "LumenMeasurement.h"
#include "ParallelFor.h"
#include "VesselBridge.h"
#include "VoxelLattice.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace coronary
{
/// What the odds of a link are made of, each in a range where its logarithmic odds are about linear.
constexpr std::size_t NumberOfLinkSigns = 15;
const std::array<const char*, NumberOfLinkSigns>& LinkSignNames();

/// A way across a place where no vessel is seen, or too little of it: from the tree to a piece.
struct VesselLink : VesselBridge
{
  double length = 0.0;              ///< mm
  double radiusBefore = 0.0;        ///< mm, lumen on the tree's side; 0 not known
  double radiusBehind = 0.0;        ///< mm, on the piece's side; 0 not known
  double pieceLength = 0.0;         ///< mm of vessel that hang on it, at least
  std::vector<std::int64_t> voxels; ///< numbers in the lattice, along the points
  std::array<double, NumberOfLinkSigns> signs{};
};

/// A link that was thought of, made or not: what the weights of the signs are fitted to.
struct ConsideredLink
{
  VesselLink link;
  std::vector<Vector3> behind; ///< mm, places in the first 15 mm of the piece that it leads to
};

/// Where a tree is known to begin, and hardly anything is seen of it.
struct VesselRoot
{
  Vector3 position = Vector3::Zero(); ///< mm, the last that is seen
  Vector3 outwards = Vector3::Zero(); ///< unit, into the vessel
  double reach = 0.0;                 ///< mm from the beginning to `position`
};

/// Values of single voxels that linking looks at; numbers are the lattice's.
struct LinkingImage
{
  const VoxelLattice& lattice;
  const ImageInterpolator& image;
  double blood = 0.0;                            ///< image value of undiluted contrast medium
  double tissue = 0.0;                           ///< of muscle
  double maximumRadius = 4.5;                    ///< mm
  std::function<float(std::int64_t)> share;      ///< of the contrast between tissue and blood
  std::function<float(std::int64_t)> tube;       ///< vesselness over that of a clear tube
  std::function<bool(std::int64_t)> couldBelong; ///< vessel-like, and free
  std::function<bool(std::int64_t)> inTree;
  std::function<bool(std::int64_t)> forbidden; ///< chamber, great vessel, leakage: no way through
  std::vector<VesselRoot> roots;               ///< ends of the tree beside those that it shows
};

struct LinkingSettings
{
  double minimumPiece = 8.0;      ///< mm, length of a piece worth a link, > 0
  double longestGap = 25.0;       ///< mm between ends that point at each other, >= 0
  double minimumConfidence = 0.5; ///< of a link, 0 to 1
};

/// Finds links, round by round: what was found out of pieces that are the same a round later is kept.
class VesselLinker
{
public:
  /// @param image  must outlive this; its functions are called from several threads, its roots may change between calls
  VesselLinker(const LinkingImage& image, const LinkingSettings& settings);
  ~VesselLinker();
  VesselLinker(const VesselLinker&) = delete;
  VesselLinker& operator=(const VesselLinker&) = delete;

  /**
   * The links that may be made now: at most one a piece, none that contradict each other. What they lead to is
   * not part of the tree yet, and may have more pieces behind it.
   * @param tree  numbers of the tree's voxels, with the path length from the root, mm
   * @throws Cancelled
   */
  std::vector<VesselLink> Find(
    const std::vector<std::pair<std::int64_t, float>>& tree, const ProgressCallback& progress = {});

  /// All that the last Find() thought of.
  std::vector<ConsideredLink> TakeConsidered();

private:
  struct Work;
  std::unique_ptr<Work> Data;
};
}

#endif
