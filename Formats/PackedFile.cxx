#include "PackedFile.h"

#include <algorithm>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr std::size_t PackedAtOnce = 1u << 20;
}

PackedFile::PackedFile(const std::string& path, const std::string& header, Packing packing)
  : AtomicFile(path)
  , Kind(packing)
{
  this->Write(header.data(), header.size());
  if (packing == Packing::None)
  {
    return;
  }
  this->Packed.resize(PackedAtOnce);
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
    this->Written += bytes;
    return;
  }
  const auto* from = static_cast<const unsigned char*>(data);
  for (std::size_t done = 0; done < bytes;)
  {
    const std::size_t block = std::min(PackedAtOnce, bytes - done);
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
    const std::size_t size = this->Packed.size() - this->Stream.avail_out;
    this->Write(this->Packed.data(), size);
    this->Written += size;
  } while (this->Stream.avail_out == 0);
}
}
