/**
 * @file OstiaCases.h
 * @brief Images in which ostia are hard to find, or are not there: phantoms that lie obliquely, are cut, changed, or wrong.
 */
#ifndef DynamicCoronary_OstiaCases_h
#define DynamicCoronary_OstiaCases_h

#include "CoronaryPhantom.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/// An image with what a search of its ostia should give.
struct OstiaCase
{
  ImageGrid grid;
  std::vector<std::int16_t> values; ///< HU
  std::vector<PhantomOstium> truth; ///< those that there are; may be empty
};

/// A kind of images.
struct OstiaGroup
{
  const char* name;
  const char* what;
  bool wrong; ///< an answer with confidence would be a mistake in some or all of them
};

const std::vector<OstiaGroup>& OstiaGroups();

/**
 * The image of one group that a seed gives; the same bits for the same arguments.
 * @param coarsest  mm, voxels of any image are at least this large; 0: as the group has them
 * @throws std::invalid_argument for a group that does not exist
 */
OstiaCase MakeOstiaCase(const std::string& group, std::uint64_t seed, double coarsest = 0.0);
}

#endif
