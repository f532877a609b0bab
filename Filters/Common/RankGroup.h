/**
 * @file RankGroup.h
 * @brief Processes that work on one thing together, each on its share: what an algorithm sees of MPI.
 *
 * The base class is a process that works alone. An algorithm that is given a group divides what is independent,
 * and shares what it found: every rank then goes on with all of it, so that the result is that of one process.
 */
#ifndef DynamicCoronary_RankGroup_h
#define DynamicCoronary_RankGroup_h

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace coronary
{
class RankGroup
{
public:
  RankGroup() = default;
  virtual ~RankGroup();
  RankGroup(const RankGroup&) = delete;
  RankGroup& operator=(const RankGroup&) = delete;

  /// Number of this process, from 0.
  virtual int Rank() const { return 0; }

  virtual int Size() const { return 1; }

  bool IsFirst() const { return this->Rank() == 0; }

  /// Whether an item is of this rank's share: they are dealt out in turn.
  bool Owns(std::size_t item) const
  {
    return item % static_cast<std::size_t>(this->Size()) == static_cast<std::size_t>(this->Rank());
  }

  /**
   * Bytes of every rank, in the order of the ranks, on every rank. All ranks have to call it.
   * @throws std::runtime_error, Cancelled: another rank failed instead of coming here, and why
   */
  virtual std::vector<std::string> Gather(const std::string& own);

  /// Bytes of every rank one after the other on the first one. `all` has room for them; the others do not use it.
  /// All ranks have to call it. @throws as Gather
  virtual void Collect(const void* own, std::size_t size, void* all);

  /// The text of the first rank on every rank. All ranks have to call it. @throws as Gather
  std::string FromFirst(const std::string& text);

  /// A process that works alone.
  static RankGroup& Alone();
};

/**
 * Lists of plain values, each filled by one rank and empty on the others, become known to all.
 * All ranks have to call it. @throws as RankGroup::Gather
 */
template <typename Value>
void ShareLists(RankGroup& ranks, std::vector<std::vector<Value>>& lists)
{
  // Eigen's fixed vectors and matrices are plain, though the standard's traits do not say so.
  static_assert(std::is_trivially_destructible_v<Value>, "only the bytes of a value are shared");
  if (ranks.Size() == 1)
  {
    return;
  }
  const auto bytes = [](const auto* values, std::size_t count)
  { return std::string(reinterpret_cast<const char*>(values), count * sizeof(*values)); };
  std::string own;
  for (std::size_t k = 0; k < lists.size(); ++k)
  {
    if (!lists[k].empty())
    {
      const std::uint64_t head[2] = { k, lists[k].size() };
      own += bytes(head, 2) + bytes(lists[k].data(), lists[k].size());
    }
  }
  const std::vector<std::string> all = ranks.Gather(own);
  for (std::size_t rank = 0; rank < all.size(); ++rank)
  {
    if (static_cast<int>(rank) == ranks.Rank())
    {
      continue;
    }
    for (std::size_t at = 0; at < all[rank].size();)
    {
      std::uint64_t head[2];
      std::memcpy(head, all[rank].data() + at, sizeof(head));
      at += sizeof(head);
      std::vector<Value>& list = lists.at(head[0]);
      if (!list.empty())
      {
        throw std::logic_error("two ranks have filled the same list");
      }
      list.resize(head[1]);
      std::memcpy(
        reinterpret_cast<char*>(list.data()), all[rank].data() + at, head[1] * sizeof(Value));
      at += head[1] * sizeof(Value);
    }
  }
}
}

#endif
