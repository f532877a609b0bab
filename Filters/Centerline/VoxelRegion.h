/**
 * @file VoxelRegion.h
 * @brief A set of voxels of an image, numbered without gaps, at a quarter byte a voxel of its box.
 *
 * Vessels fill less than a hundredth of a cardiac CT. What is kept for each voxel of a region is
 * kept in arrays over its members, not over the image.
 */
#ifndef DynamicCoronary_VoxelRegion_h
#define DynamicCoronary_VoxelRegion_h

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace coronary
{
/**
 * Members lie in a box that is two voxels wider than they need, and are found by the *address* of a
 * voxel in that box: from a member, two steps along an axis need no check of bounds.
 *
 * The box is cut into bricks of 8 x 8 x 8 voxels, one after the other in memory, and these into
 * cells of 2 x 2 x 2: what is kept for a voxel and for two steps along each axis lies in seven
 * pieces of memory, a cache line each for eight bytes a voxel. Members are numbered in the order of
 * their addresses. The number of a voxel is the count of the members before it: a bit for each
 * voxel, and the count of bits before every 64 voxels.
 */
class VoxelRegion
{
public:
  using Address = std::uint32_t;
  static constexpr std::uint32_t notAMember = 0xffffffffU;

  VoxelRegion() = default;

  /**
   * @param extent  inclusive index ranges of the image
   * @param row     fills one flag for each voxel of row j, k from extent[0] to extent[1]; called
   *                from several threads, twice for each row
   * @throws std::invalid_argument if the box of the members has 2^32 - 2 voxels or more
   */
  VoxelRegion(const std::array<int, 6>& extent,
    const std::function<void(int j, int k, unsigned char* flags)>& row);

  std::uint32_t Size() const { return Count; }

  /// Inclusive index ranges of the members, without the margin.
  const std::array<int, 6>& Box() const { return Bounds; }

  /// What to add to an address for two steps down, one down, one up, two up along an axis (modulo
  /// 2^32).
  const std::array<Address, 4>& Steps(Address address, int axis) const
  {
    // Bits of a place in a brick, from the lowest: x, y, z in the cell; cell along x, y, z, two each.
    return StepTable[axis][(address >> (3 + 2 * axis) & 3) << 1 | (address >> axis & 1)];
  }

  /// Address of the next voxel along an axis.
  Address Above(Address address, int axis) const { return address + Steps(address, axis)[2]; }

  /// Address of the voxel before along an axis.
  Address Below(Address address, int axis) const { return address + Steps(address, axis)[1]; }

  /// Addresses are below this.
  std::size_t AddressCount() const { return Words.size() * 64; }

  /// Number of the member at an address, or notAMember.
  std::uint32_t Number(Address address) const
  {
    const Word& word = Words[address >> 6];
    const std::uint64_t bit = std::uint64_t{ 1 } << (address & 63);
    const std::uint32_t number =
      word.before + static_cast<std::uint32_t>(__builtin_popcountll(word.bits & (bit - 1)));
    return (word.bits & bit) == 0 ? notAMember : number;
  }

  /// Whether an address exists for a voxel of the image; members have one.
  bool InBox(int i, int j, int k) const
  {
    return Count > 0 && i >= Bounds[0] && i <= Bounds[1] && j >= Bounds[2] && j <= Bounds[3] &&
      k >= Bounds[4] && k <= Bounds[5];
  }

  Address AddressOf(int i, int j, int k) const
  {
    const auto x = static_cast<Address>(i - Bounds[0] + 2);
    const auto y = static_cast<Address>(j - Bounds[2] + 2);
    const auto z = static_cast<Address>(k - Bounds[4] + 2);
    return (((z >> 3) * Bricks[1] + (y >> 3)) * Bricks[0] + (x >> 3)) * 512 + InBrick(x, 0) +
      InBrick(y, 1) + InBrick(z, 2);
  }

  std::uint32_t NumberOf(int i, int j, int k) const
  {
    return InBox(i, j, k) ? Number(AddressOf(i, j, k)) : notAMember;
  }

  std::array<int, 3> IndexOf(Address address) const
  {
    const Address brick = address >> 9;
    const Address x = brick % Bricks[0] * 8 + Coordinate(address, 0);
    const Address y = brick / Bricks[0] % Bricks[1] * 8 + Coordinate(address, 1);
    const Address z = brick / Bricks[0] / Bricks[1] * 8 + Coordinate(address, 2);
    return { static_cast<int>(x) + Bounds[0] - 2, static_cast<int>(y) + Bounds[2] - 2,
      static_cast<int>(z) + Bounds[4] - 2 };
  }

  /// Calls visit(number, address) for every member in order.
  template <typename Visit>
  void ForEach(const Visit& visit) const
  {
    std::uint32_t number = 0;
    for (std::size_t w = 0; w < Words.size(); ++w)
    {
      for (std::uint64_t bits = Words[w].bits; bits != 0; bits &= bits - 1)
      {
        visit(number++, static_cast<Address>(w * 64 + __builtin_ctzll(bits)));
      }
    }
  }

  /**
   * Adds the voxels between members that touch by an edge or a corner alone, so that what hangs
   * together by any of 26 neighbours does so by 6. Members get new numbers.
   */
  void JoinDiagonals();

  /// Bytes in memory.
  std::size_t MemorySize() const { return Words.capacity() * sizeof(Word); }

private:
  void NumberMembers();
  static Address InBrick(Address coordinate, int axis)
  {
    return (coordinate & 1) << axis | (coordinate >> 1 & 3) << (3 + 2 * axis);
  }
  static Address Coordinate(Address address, int axis)
  {
    return (address >> axis & 1) | (address >> (3 + 2 * axis) & 3) << 1;
  }

  struct Word
  {
    std::uint64_t bits = 0;
    std::uint32_t before = 0;
  };
  std::vector<Word> Words;
  std::array<int, 6> Bounds{ 0, -1, 0, -1, 0, -1 };
  std::array<Address, 3> Bricks{ 0, 0, 0 };
  std::array<std::array<std::array<Address, 4>, 8>, 3> StepTable{};
  std::uint32_t Count = 0;
};
}

#endif
