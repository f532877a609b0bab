/**
 * @file SkinWeightCache.h
 * @brief Skin weights that are read from a file instead of solved for again.
 */
#ifndef DynamicCoronary_SkinWeightCache_h
#define DynamicCoronary_SkinWeightCache_h

#include "BiharmonicSkinWeights.h"

#include <string>
#include <vector>

namespace coronary
{
/// The file in `folder` that has the weights of this mesh, skeleton and settings; its name is made
/// from their contents, bit by bit.
std::string SkinWeightCachePath(
  const std::string& folder, const SkinWeightInput& input, const SkinWeightSettings& settings);

/**
 * Reads what WriteSkinWeights wrote under this name.
 * @return false when there is no such file
 * @throws std::runtime_error naming `path` when it is not such a file, of another computer, of another
 * mesh, or damaged
 */
bool ReadSkinWeights(const std::string& path, const SkinWeightInput& input, SkinWeights& weights);

/// The file appears when it is whole. @throws std::runtime_error naming `path`
void WriteSkinWeights(const std::string& path, const SkinWeights& weights);

/// The bytes of such a file with the right checksum in place of their last eight; for tests of what is behind it.
std::string WithSkinWeightChecksum(std::string bytes);

/**
 * ComputeSkinWeights, by way of the cache in `folder`, which is made when it is missing; without a
 * cache when `folder` is empty. Only weights that converged are kept.
 * @param warnings  a sentence for each file that could not be read or written; all goes on without it
 * @throws as ComputeSkinWeights
 */
SkinWeights CachedSkinWeights(const std::string& folder, const SkinWeightInput& input,
  const SkinWeightSettings& settings, const ProgressCallback& progress,
  std::vector<std::string>& warnings);
}

#endif
