#include "VoxelRegion.h"

#include "ParallelFor.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>

namespace coronary
{
VoxelRegion::VoxelRegion(const std::array<int, 6>& extent,
  const std::function<void(int j, int k, unsigned char* flags)>& row)
{
  if (extent[1] < extent[0] || extent[3] < extent[2] || extent[5] < extent[4])
  {
    return;
  }
  const auto width = static_cast<std::size_t>(extent[1] - extent[0]) + 1;
  const int slices = extent[5] - extent[4] + 1;

  // Bounds of each slice.
  std::vector<std::array<int, 4>> found(slices, { 1, 0, 1, 0 });
  ParallelFor(slices, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      std::vector<unsigned char> flags(width);
      for (std::int64_t s = first; s < last; ++s)
      {
        std::array<int, 4>& bounds = found[s];
        for (int j = extent[2]; j <= extent[3]; ++j)
        {
          std::fill(flags.begin(), flags.end(), 0);
          row(j, static_cast<int>(s) + extent[4], flags.data());
          const auto isSet = [](unsigned char flag) { return flag != 0; };
          const auto low = std::find_if(flags.begin(), flags.end(), isSet);
          if (low == flags.end())
          {
            continue;
          }
          const auto high = std::find_if(flags.rbegin(), flags.rend(), isSet);
          const int from = extent[0] + static_cast<int>(low - flags.begin());
          const int to = extent[1] - static_cast<int>(high - flags.rbegin());
          if (bounds[1] < bounds[0])
          {
            bounds = { from, to, j, j };
          }
          bounds = { std::min(bounds[0], from), std::max(bounds[1], to), bounds[2], j };
        }
      }
    });
  for (int s = 0; s < slices; ++s)
  {
    const std::array<int, 4>& bounds = found[s];
    const int k = s + extent[4];
    if (bounds[1] < bounds[0])
    {
      continue;
    }
    if (this->Bounds[1] < this->Bounds[0])
    {
      this->Bounds = { bounds[0], bounds[1], bounds[2], bounds[3], k, k };
    }
    this->Bounds = { std::min(this->Bounds[0], bounds[0]), std::max(this->Bounds[1], bounds[1]),
      std::min(this->Bounds[2], bounds[2]), std::max(this->Bounds[3], bounds[3]), this->Bounds[4],
      k };
  }
  if (this->Bounds[1] < this->Bounds[0])
  {
    return;
  }

  for (int axis = 0; axis < 3; ++axis)
  {
    this->Bricks[axis] =
      static_cast<Address>((this->Bounds[2 * axis + 1] - this->Bounds[2 * axis] + 5 + 7) / 8);
  }
  const std::uint64_t bricks =
    static_cast<std::uint64_t>(this->Bricks[0]) * this->Bricks[1] * this->Bricks[2];
  if (bricks * 512 >= notAMember)
  {
    throw std::invalid_argument("VoxelRegion: the box of the region has too many voxels");
  }
  const std::array<Address, 3> brick = { 512, 512 * this->Bricks[0],
    512 * this->Bricks[0] * this->Bricks[1] };
  for (int axis = 0; axis < 3; ++axis)
  {
    // Along one axis, from the brick before to the one behind.
    const auto at = [&](Address place)
    { return (place >> 3) * brick[axis] + InBrick(place & 7, axis); };
    for (Address place = 8; place < 16; ++place)
    {
      this->StepTable[axis][place - 8] = { at(place - 2) - at(place), at(place - 1) - at(place),
        at(place + 1) - at(place), at(place + 2) - at(place) };
    }
  }
  this->Words.resize(static_cast<std::size_t>(bricks) * 8);

  // A layer of bricks has words of its own.
  ParallelFor(this->Bricks[2], 1,
    [&](std::int64_t first, std::int64_t last)
    {
      std::vector<unsigned char> flags(width);
      const int low = std::max(this->Bounds[4], static_cast<int>(first) * 8 - 2 + this->Bounds[4]);
      const int high = std::min(this->Bounds[5], static_cast<int>(last) * 8 - 3 + this->Bounds[4]);
      for (int k = low; k <= high; ++k)
      {
        for (int j = this->Bounds[2]; j <= this->Bounds[3]; ++j)
        {
          std::fill(flags.begin(), flags.end(), 0);
          row(j, k, flags.data());
          for (int i = this->Bounds[0]; i <= this->Bounds[1]; ++i)
          {
            if (flags[static_cast<std::size_t>(i - extent[0])])
            {
              const Address address = this->AddressOf(i, j, k);
              this->Words[address >> 6].bits |= std::uint64_t{ 1 } << (address & 63);
            }
          }
        }
      }
    });
  this->NumberMembers();
}

void VoxelRegion::NumberMembers()
{
  this->Count = 0;
  for (Word& word : this->Words)
  {
    word.before = this->Count;
    this->Count += static_cast<std::uint32_t>(__builtin_popcountll(word.bits));
  }
}

void VoxelRegion::JoinDiagonals()
{
  const auto isMember = [&](Address address)
  { return (this->Words[address >> 6].bits >> (address & 63) & 1) != 0; };
  const auto step = [&](Address address, int axis, int sign)
  { return sign > 0 ? this->Above(address, axis) : this->Below(address, axis); };
  std::vector<Address> added;
  this->ForEach(
    [&](std::uint32_t, Address here)
    {
      Address side[3][2];
      for (int axis = 0; axis < 3; ++axis)
      {
        side[axis][0] = this->Below(here, axis);
        side[axis][1] = this->Above(here, axis);
      }
      // Each pair once: the other one lies above along the last axis in which they differ.
      for (int last = 1; last < 3; ++last)
      {
        for (int axis = 0; axis < last; ++axis)
        {
          for (int sign = 0; sign < 2; ++sign)
          {
            const Address a = side[last][1];
            const Address b = side[axis][sign];
            if (!isMember(a) && !isMember(b) && isMember(step(a, axis, sign * 2 - 1)))
            {
              added.push_back(a);
              added.push_back(b);
            }
          }
        }
      }
      for (int corner = 0; corner < 4; ++corner)
      {
        const int x = corner % 2;
        const int y = corner / 2;
        const Address up = side[2][1];
        const Address between[6] = { side[0][x], side[1][y], step(side[0][x], 1, y * 2 - 1), up,
          step(up, 0, x * 2 - 1), step(up, 1, y * 2 - 1) };
        if (isMember(step(between[4], 1, y * 2 - 1)) &&
          std::none_of(std::begin(between), std::end(between), isMember))
        {
          added.insert(added.end(), std::begin(between), std::end(between));
        }
      }
    });
  for (const Address address : added)
  {
    this->Words[address >> 6].bits |= std::uint64_t{ 1 } << (address & 63);
  }
  this->NumberMembers();
}
}
