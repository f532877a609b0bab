/**
 * @file PackedFile.h
 * @brief A header and the voxels behind it, which may be compressed. Not installed.
 */
#ifndef DynamicCoronary_PackedFile_h
#define DynamicCoronary_PackedFile_h

#include "AtomicFile.h"

#include <zlib.h>

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
enum class Packing
{
  None,
  Zlib,
  Gzip
};

/// All throw std::runtime_error as AtomicFile does.
class PackedFile : public AtomicFile
{
public:
  PackedFile(const std::string& path, const std::string& header, Packing packing);
  ~PackedFile();

  void Add(const void* data, std::size_t bytes);

  /// Ends the data; returns how many bytes of the file they are. Once, before Commit().
  std::uint64_t Finish();

private:
  void Deflate(const void* data, std::size_t bytes, int flush);

  Packing Kind;
  z_stream Stream{};
  std::vector<unsigned char> Packed;
  std::uint64_t Written = 0; ///< of the data
};
}

#endif
