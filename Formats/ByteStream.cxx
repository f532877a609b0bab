#include "ByteStream.h"

#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace coronary
{
namespace fs = std::filesystem;

namespace
{
constexpr std::size_t ReadAtOnce = 256u << 10;
}

struct ByteStream::Internals
{
  std::string Path;
  std::uint64_t Offset = 0;
  bool Compressed = false;
  std::ifstream File;

  z_stream Stream{};
  bool Started = false;
  bool Ended = false;
  std::uint64_t Position = 0; ///< in the decoded data
  std::vector<unsigned char> Packed;
  std::vector<unsigned char> Skipped;

  ~Internals()
  {
    if (this->Started)
    {
      inflateEnd(&this->Stream);
    }
  }

  void Rewind()
  {
    this->File.clear();
    this->File.seekg(static_cast<std::streamoff>(this->Offset));
    // 32 lets zlib tell gzip and zlib headers apart.
    const int status =
      this->Started ? inflateReset(&this->Stream) : inflateInit2(&this->Stream, MAX_WBITS + 32);
    if (status != Z_OK)
    {
      throw std::runtime_error("'" + this->Path + "': zlib can not be initialised.");
    }
    this->Started = true;
    this->Ended = false;
    this->Position = 0;
    this->Stream.avail_in = 0;
    this->Packed.resize(ReadAtOnce);
  }

  bool Refill()
  {
    this->File.read(reinterpret_cast<char*>(this->Packed.data()),
      static_cast<std::streamsize>(this->Packed.size()));
    this->Stream.next_in = this->Packed.data();
    this->Stream.avail_in = static_cast<uInt>(this->File.gcount());
    return this->Stream.avail_in > 0;
  }

  // Decodes the next bytes; fewer than asked for at the end of the data.
  std::size_t Inflate(unsigned char* destination, std::size_t size)
  {
    // zlib counts in 32 bits.
    size = std::min<std::size_t>(size, 1u << 30);
    this->Stream.next_out = destination;
    this->Stream.avail_out = static_cast<uInt>(size);
    while (this->Stream.avail_out > 0 && !this->Ended)
    {
      if (this->Stream.avail_in == 0 && !this->Refill())
      {
        break;
      }
      const int status = inflate(&this->Stream, Z_NO_FLUSH);
      if (status == Z_STREAM_END)
      {
        // A gzip file may be several members, one after the other.
        this->Ended = (this->Stream.avail_in == 0 && !this->Refill()) ||
          this->Stream.next_in[0] != 0x1f || inflateReset(&this->Stream) != Z_OK;
      }
      else if (status != Z_OK && status != Z_BUF_ERROR)
      {
        throw std::runtime_error("'" + this->Path + "': the compressed data is damaged (" +
          (this->Stream.msg ? this->Stream.msg : "unknown reason") + ").");
      }
    }
    const std::size_t produced = size - this->Stream.avail_out;
    this->Position += produced;
    return produced;
  }

  /// Reads on to the checksum: damage may make other data of it, and more than there should be.
  void CheckEnd()
  {
    while (this->Inflate(this->Skipped.data(), this->Skipped.size()) > 0)
    {
    }
    if (!this->Ended)
    {
      throw std::runtime_error(
        "'" + this->Path + "': the compressed data is damaged (its end is missing).");
    }
  }
};

ByteStream::ByteStream(const std::string& path, std::uint64_t offset, bool compressed)
  : Impl(std::make_unique<Internals>())
{
  this->Impl->Path = path;
  this->Impl->Offset = offset;
  this->Impl->Compressed = compressed;
  this->Impl->File.open(path, std::ios::binary);
  if (!this->Impl->File)
  {
    throw std::runtime_error("File '" + path + "' cannot be read.");
  }
  if (compressed)
  {
    this->Impl->Rewind();
  }
}

ByteStream::~ByteStream() = default;

std::size_t ByteStream::ReadSome(
  std::uint64_t position, void* destination, std::size_t size, const Poll& poll)
{
  Internals& impl = *this->Impl;
  auto* bytes = static_cast<unsigned char*>(destination);
  if (!impl.Compressed)
  {
    impl.File.clear();
    impl.File.seekg(static_cast<std::streamoff>(impl.Offset + position));
    impl.File.read(reinterpret_cast<char*>(bytes), static_cast<std::streamsize>(size));
    return static_cast<std::size_t>(std::max<std::streamsize>(0, impl.File.gcount()));
  }
  if (position < impl.Position)
  {
    impl.Rewind();
  }
  impl.Skipped.resize(ReadAtOnce);
  while (impl.Position < position)
  {
    if (poll)
    {
      poll();
    }
    const auto block = static_cast<std::size_t>(
      std::min<std::uint64_t>(impl.Skipped.size(), position - impl.Position));
    if (impl.Inflate(impl.Skipped.data(), block) == 0)
    {
      return 0;
    }
  }
  std::size_t done = 0;
  while (done < size)
  {
    const std::size_t produced = impl.Inflate(bytes + done, size - done);
    if (produced == 0)
    {
      break;
    }
    done += produced;
  }
  return done;
}

void ByteStream::Read(std::uint64_t position, void* destination, std::size_t size,
  std::uint64_t expected, const Poll& poll)
{
  const std::size_t got = this->ReadSome(position, destination, size, poll);
  if (got < size)
  {
    const std::uint64_t available = this->Impl->Compressed ? this->Impl->Position : position + got;
    throw std::runtime_error("'" + this->Impl->Path + "' is truncated: expected " +
      std::to_string(expected) + " bytes, got " + std::to_string(available) + ".");
  }
  if (this->Impl->Compressed && this->Impl->Position >= expected)
  {
    this->Impl->CheckEnd();
  }
}

void RequireFile(const std::string& path)
{
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status))
  {
    throw std::runtime_error("File '" + path + "' does not exist.");
  }
  if (!fs::is_regular_file(status))
  {
    throw std::runtime_error("'" + path + "' is not a file.");
  }
}

std::uint64_t CheckedFileSize(const std::string& path)
{
  RequireFile(path);
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error)
  {
    throw std::runtime_error("File '" + path + "' cannot be read: " + error.message() + ".");
  }
  if (size == 0)
  {
    throw std::runtime_error("File '" + path + "' is empty.");
  }
  return size;
}

bool IsGzipFile(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  return file.get() == 0x1f && file.get() == 0x8b;
}
}
