/**
 * @file ByteStream.h
 * @brief The bytes of a plain or a gzip/zlib compressed file, by position in the decoded data.
 */
#ifndef DynamicCoronary_ByteStream_h
#define DynamicCoronary_ByteStream_h

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace coronary
{
/// Called now and then during long work; throws Cancelled to stop it.
using Poll = std::function<void()>;

/**
 * Random access for plain files. Compressed data is decoded forward: going on is cheap, going back
 * decodes from the start again; no more than a few hundred kilobytes are held.
 */
class ByteStream
{
public:
  /**
   * @param path        an existing file
   * @param offset      where the data begins in the file, bytes
   * @param compressed  the data is one or more gzip members, or one zlib stream
   * @throws std::runtime_error naming `path` when it can not be opened
   */
  ByteStream(const std::string& path, std::uint64_t offset, bool compressed);
  ~ByteStream();
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  /**
   * Reads up to `size` bytes from `position` on; returns how many there are.
   * @throws std::runtime_error naming the file when its compressed data is damaged
   */
  std::size_t ReadSome(
    std::uint64_t position, void* destination, std::size_t size, const Poll& poll = {});

  /**
   * Reads `size` bytes from `position` on.
   * @param expected  the length the header promises, for the message
   * @throws std::runtime_error "truncated: expected N bytes, got M" naming the file
   */
  void Read(std::uint64_t position, void* destination, std::size_t size, std::uint64_t expected,
    const Poll& poll = {});

private:
  struct Internals;
  std::unique_ptr<Internals> Impl;
};

/// @throws std::runtime_error naming `path` when it is missing, or no regular file (a folder, a pipe)
void RequireFile(const std::string& path);

/**
 * Size of an existing regular file in bytes.
 * @throws std::runtime_error naming `path` when it is missing, a folder, empty or not readable
 */
std::uint64_t CheckedFileSize(const std::string& path);

/// True when the file begins as gzip files do.
bool IsGzipFile(const std::string& path);
}

#endif
