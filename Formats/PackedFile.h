/**
 * @file PackedFile.h
 * @brief A header and the voxels behind it, which may be compressed. Not installed.
 */
#ifndef DynamicCoronary_PackedFile_h
#define DynamicCoronary_PackedFile_h

#include "AtomicFile.h"

#include <zlib.h>

#include <cstdint>
#include <cstdio>
#include <memory>
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

/// Appears under its name with Commit(). All throw std::runtime_error naming the file and the reason: a full disk, ...
class PackedFile
{
public:
  PackedFile(const std::string& path, const std::string& header, Packing packing);
  ~PackedFile();
  PackedFile(const PackedFile&) = delete;
  PackedFile& operator=(const PackedFile&) = delete;

  void Add(const void* data, std::size_t bytes);

  /// Ends the data; returns how many bytes of the file they are. Once, before Commit().
  std::uint64_t Finish();

  /// Writes over a part of the header. After Finish().
  void Overwrite(std::size_t position, const std::string& text);

  void Commit();

private:
  void Deflate(const void* data, std::size_t bytes, int flush);
  void Write(const void* data, std::size_t bytes);
  [[noreturn]] void Fail() const;

  AtomicFile Target;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> File;
  Packing Kind;
  z_stream Stream{};
  std::vector<unsigned char> Packed;
  std::uint64_t Written = 0;
};
}

#endif
