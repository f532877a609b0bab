#include "PackedFile.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr std::size_t BlockBytes = 1u << 20;
}

PackedFile::PackedFile(const std::string& path, const std::string& header, Packing packing)
  : Target(path)
  , File(std::fopen(this->Target.TemporaryPath().c_str(), "wb"), &std::fclose)
  , Kind(packing)
{
  this->Write(header.data(), header.size());
  this->Written = 0;
  if (packing == Packing::None)
  {
    return;
  }
  this->Packed.resize(BlockBytes);
  // Noisy voxels gain little from higher levels, which are several times slower.
  const int level = packing == Packing::Gzip ? 1 : 2;
  // 16 more than the bits of the window: with gzip's header, without a date.
  const int window = packing == Packing::Gzip ? 31 : 15;
  if (deflateInit2(&this->Stream, level, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY) != Z_OK)
  {
    throw std::runtime_error("zlib can not be initialised.");
  }
}

PackedFile::~PackedFile()
{
  if (this->Kind != Packing::None)
  {
    deflateEnd(&this->Stream);
  }
}

void PackedFile::Add(const void* data, std::size_t bytes)
{
  if (this->Kind == Packing::None)
  {
    this->Write(data, bytes);
    return;
  }
  const auto* from = static_cast<const unsigned char*>(data);
  for (std::size_t done = 0; done < bytes;)
  {
    const std::size_t block = std::min(BlockBytes, bytes - done);
    this->Deflate(from + done, block, Z_NO_FLUSH);
    done += block;
  }
}

std::uint64_t PackedFile::Finish()
{
  if (this->Kind != Packing::None)
  {
    this->Deflate(nullptr, 0, Z_FINISH);
  }
  return this->Written;
}

void PackedFile::Overwrite(std::size_t position, const std::string& text)
{
  if (std::fseek(this->File.get(), static_cast<long>(position), SEEK_SET) != 0)
  {
    this->Fail();
  }
  this->Write(text.data(), text.size());
}

void PackedFile::Commit()
{
  // A full disk may show only when the buffer is flushed.
  if (std::fclose(this->File.release()) != 0)
  {
    this->Fail();
  }
  this->Target.Commit();
}

void PackedFile::Deflate(const void* data, std::size_t bytes, int flush)
{
  // zlib's interface is not const-correct; it does not write to its input.
  this->Stream.next_in = const_cast<unsigned char*>(static_cast<const unsigned char*>(data));
  this->Stream.avail_in = static_cast<uInt>(bytes);
  do
  {
    this->Stream.next_out = this->Packed.data();
    this->Stream.avail_out = static_cast<uInt>(this->Packed.size());
    deflate(&this->Stream, flush);
    this->Write(this->Packed.data(), this->Packed.size() - this->Stream.avail_out);
  } while (this->Stream.avail_out == 0);
}

void PackedFile::Write(const void* data, std::size_t bytes)
{
  if (!this->File || std::fwrite(data, 1, bytes, this->File.get()) != bytes)
  {
    this->Fail();
  }
  this->Written += bytes;
}

void PackedFile::Fail() const
{
  throw std::runtime_error(
    "Cannot write '" + this->Target.Path() + "': " + std::strerror(errno) + ".");
}
}
