/**
 * @file MetaImageWriter.h
 * @brief Writes a volume as a MetaImage (.mha), with its direction matrix.
 */
#ifndef DynamicCoronary_MetaImageWriter_h
#define DynamicCoronary_MetaImageWriter_h

#include "Geometry.h"
#include "ParallelFor.h"

#include <string>

namespace coronary
{
/**
 * Writes one volume to a single .mha file, atomically.
 *
 * @param path      ends in .mha; its folder must exist
 * @param grid      sampling in LPS millimetres; an extent that does not start at 0 is honoured by the
 *                  file's Offset, which is the world position of the first voxel
 * @param values    one value a voxel of the extent, i fastest
 * @param compress  zlib (readable by every MetaImage reader), or raw
 * @param progress  see ProgressCallback
 *
 * The orientation goes into TransformMatrix (row a = direction of axis a in LPS, as ITK writes it)
 * and, rounded to the nearest axes, into AnatomicalOrientation.
 *
 * @throws std::runtime_error with one sentence naming `path`: an empty extent, a grid that is not
 *   finite, a folder that is missing or can not be written to, a full disk. Nothing is left behind.
 * @throws Cancelled when progress returned false; nothing is left behind.
 */
void WriteMetaImage(const std::string& path, const ImageGrid& grid, const short* values,
  bool compress, const ProgressCallback& progress = {});

/// The same for single precision values.
void WriteMetaImage(const std::string& path, const ImageGrid& grid, const float* values,
  bool compress, const ProgressCallback& progress = {});

/// The same for masks.
void WriteMetaImage(const std::string& path, const ImageGrid& grid, const unsigned char* values,
  bool compress, const ProgressCallback& progress = {});
}

#endif
