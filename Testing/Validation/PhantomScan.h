/**
 * @file PhantomScan.h
 * @brief From a phantom to the tree that the stages find in its image, nothing given by hand.
 */
#ifndef DynamicCoronary_PhantomScan_h
#define DynamicCoronary_PhantomScan_h

#include "CenterlineExtraction.h"
#include "CenterlineTopology.h"
#include "CoronaryPhantom.h"
#include "SegmentLabeling.h"
#include "VesselLinking.h"
#include "VesselSegmentation.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/// The image of one moment, and what the stages before the centerlines make of it.
struct PhantomScan
{
  ImageGrid grid;
  std::vector<std::int16_t> values;
  std::vector<float> vesselness;
  std::vector<unsigned char> mask;
  std::vector<Vector3> seeds;
  std::vector<std::string> seedNames; ///< "LCA", "RCA"
  std::string doubt;                  ///< of the search for the ostia; empty when it is sure
  BloodWindow window;
  std::vector<VesselLink> links;
  std::vector<ConsideredLink> considered;

  /// The image as the algorithms take it, of `values`.
  ScalarImage Image() const;
};

/**
 * @param moment     fraction of R-R
 * @param trueOstia  seeds from the truth instead of those found
 * @param seconds    null, or room for 2 processor times: ostia and vesselness, mask
 * @throws std::runtime_error  no ostium was found
 */
PhantomScan ScanPhantom(const CoronaryPhantom& phantom, const ImageGrid& grid, double moment,
  bool trueOstia, double* seconds = nullptr);

/// A tree as `run` has it before its surface: the lumen measured anew, named, cut where names change.
struct FoundTree
{
  CenterlineTopology tree;
  LabelingResult labels;
  CenterlineResult extraction; ///< before that
};

/// @throws as ExtractCenterlines
FoundTree FindTree(const PhantomScan& image);

/// The tree as the extraction alone gives it, named.
/// @param seconds  null, or room for 2 processor times: extraction, topology and names
/// @param blur     null, or room for the standard deviation of the image's blur as the extraction found it, mm
CenterlineTopology TreeOf(
  const PhantomScan& image, double* seconds = nullptr, double* blur = nullptr);

/// A tree as the measures of overlap take it.
template <typename Tree>
Polylines SetOf(const Tree& tree)
{
  Polylines set;
  set.points = tree.points;
  set.radius = tree.radius;
  for (const auto& branch : tree.branches)
  {
    set.lines.push_back(branch.points);
  }
  return set;
}
}

#endif
