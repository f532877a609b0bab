/**
 * @file MarchingQueue.h
 * @brief Priority queue for a front that never goes back: nothing enters before what left last.
 *
 * Buckets of equal width in arrival. Only the bucket that is being emptied is a heap, small enough
 * for the first cache; the others are lists that are appended to. Buckets far ahead share one
 * list for 256, 256^2, 256^3 of them, which is dealt out when its turn comes, as in a radix heap
 * (Ahuja, Mehlhorn, Orlin, Tarjan, J. ACM 1990;37:213). So what leaves is always exactly the least:
 * the width, which follows the number of entries, changes the time that is needed, not the order.
 *
 * Nothing is moved or removed inside: what has a new arrival enters again, and whoever takes
 * entries out recognizes the outdated ones (`keep`).
 */
#ifndef DynamicCoronary_MarchingQueue_h
#define DynamicCoronary_MarchingQueue_h

#include "HugeArray.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace coronary
{
class MarchingQueue
{
public:
  /// The bits of an arrival that is not negative above, an address below: one comparison orders by
  /// arrival, and by address where that is equal.
  using Entry = std::uint64_t;

  static Entry MakeEntry(std::uint32_t arrivalBits, std::uint32_t address)
  {
    return static_cast<Entry>(arrivalBits) << 32 | address;
  }
  static std::uint32_t ArrivalBits(Entry entry) { return static_cast<std::uint32_t>(entry >> 32); }
  static std::uint32_t Address(Entry entry) { return static_cast<std::uint32_t>(entry); }
  static float Arrival(Entry entry)
  {
    const std::uint32_t bits = ArrivalBits(entry);
    float arrival;
    std::memcpy(&arrival, &bits, sizeof(arrival));
    return arrival;
  }

  /// @param width  of a bucket, in units of arrival; a first guess
  explicit MarchingQueue(double width) { this->SetWidth(width); }

  /// @param entry  not less than the last that left
  void Push(Entry entry)
  {
    const std::uint32_t bucket = this->BucketOf(entry);
    const std::uint32_t different = bucket ^ this->Current;
    if (different == 0)
    {
      this->PushOnHeap(entry);
      return;
    }
    const auto level = static_cast<std::uint32_t>(31 - __builtin_clz(different)) / 8;
    const std::uint32_t digit = bucket >> (8 * level) & 255;
    List& list = this->Lists[level][digit];
    if (list.newest == nullptr || list.newest->count == Chunk::capacity)
    {
      this->Extend(list);
      this->Filled[level][digit / 64] |= std::uint64_t{ 1 } << (digit % 64);
    }
    list.newest->entries[list.newest->count++] = entry;
  }

  /**
   * Finds the least entry for which keep(entry) is true, and drops outdated ones on the way.
   * @param expect  called with entries that keep() will soon be asked for
   * @param prepare called with entries that will soon be the least, unless they are outdated until
   *                then: time to load what they need
   * @return whether there is one: it is Least() then
   */
  template <typename Keep, typename Expect, typename Prepare>
  bool Find(const Keep& keep, const Expect& expect, const Prepare& prepare)
  {
    if (this->Heap.size() > this->HeapLimit)
    {
      this->Split();
    }
    for (;;)
    {
      while (!this->Heap.empty())
      {
        if (keep(this->Heap.front()))
        {
          return true;
        }
        this->RemoveMinimum();
      }
      if (!this->Advance(keep, expect, prepare))
      {
        return false;
      }
    }
  }

  Entry Minimum() const { return this->Heap.front(); }

  void RemoveMinimum();

  /// Greatest number of bytes that it has held.
  std::size_t MemorySize() const
  {
    std::size_t size = this->Heap.capacity() * sizeof(Entry);
    for (const HugeArray<Chunk>& slab : this->Slabs)
    {
      size += slab.MemorySize();
    }
    return size;
  }

private:
  static constexpr std::uint32_t Levels = 4;
  static constexpr std::uint32_t NoDigit = 256;
  static constexpr std::uint32_t CountedBuckets = 64;
  static constexpr std::size_t SmallHeap = 2048;
  static constexpr std::uint32_t MostPerBucket = 192;
  static constexpr std::uint32_t MinimumPerBucket = 12;
  static constexpr std::uint32_t MaximumToRefine = 1U << 24;
  static constexpr std::uint32_t MaximumBucket = 1U << 31;

  struct Chunk
  {
    static constexpr std::uint32_t capacity = 30;
    Chunk* older;
    std::uint32_t count;
    std::array<Entry, capacity> entries;
  };
  // A small queue takes little; of a great one every list lies in a few pages of memory.
  static constexpr std::size_t SmallSlab = 64;
  static constexpr std::size_t LargeSlab = (std::size_t{ 2 } << 20) / sizeof(Chunk);
  struct List
  {
    Chunk* newest = nullptr;
  };

  std::uint32_t BucketOf(Entry entry) const
  {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(
      std::min(static_cast<double>(Arrival(entry)) * this->PerWidth, 4294967295.0)));
  }
  void SetWidth(double width) { this->PerWidth = std::min(std::max(1.0 / width, 1e-300), 1e300); }
  void Extend(List& list);
  Chunk* Take(std::uint32_t level, std::uint32_t digit);
  void Release(Chunk* chunk)
  {
    chunk->older = this->Free;
    this->Free = chunk;
  }
  template <typename Visit>
  static void ForEach(const Chunk* newest, const Visit& visit)
  {
    for (const Chunk* chunk = newest; chunk != nullptr; chunk = chunk->older)
    {
      for (std::uint32_t e = 0; e < chunk->count; ++e)
      {
        visit(chunk->entries[e]);
      }
    }
  }
  /// First list of a level after one that is not empty, or NoDigit.
  std::uint32_t NextDigit(std::uint32_t level, std::uint32_t digit) const;
  void PushOnHeap(Entry entry);
  void SiftDown(std::size_t at, Entry entry);
  void MakeHeap();
  void ChangeWidth(double factor);
  void Split();
  void PushAll(Chunk* list);

  template <typename Keep, typename Expect, typename Prepare>
  bool Advance(const Keep& keep, const Expect& expect, const Prepare& prepare)
  {
    if (this->Buckets >= CountedBuckets)
    {
      const std::uint64_t each = this->Dealt / this->Buckets;
      this->Buckets = 0;
      this->Dealt = 0;
      // Arrivals that are all the same can not be told apart by any width.
      const bool narrower = each > MostPerBucket && this->Current < MaximumToRefine;
      if (narrower || each < MinimumPerBucket)
      {
        this->ChangeWidth(narrower ? 0.25 : 4.0);
        return true;
      }
    }
    std::uint32_t level = 0;
    std::uint32_t digit = this->NextDigit(0, this->Current & 255);
    while (digit == NoDigit)
    {
      if (++level == Levels)
      {
        return false;
      }
      digit = this->NextDigit(level, this->Current >> (8 * level) & 255);
    }
    const std::uint32_t below = level + 1 == Levels ? ~0U : (1U << (8 * (level + 1))) - 1;
    const std::uint32_t next = (this->Current & ~below) | digit << (8 * level);
    if (next > MaximumBucket && this->PerWidth > 1e-300)
    {
      this->ChangeWidth(4.0);
      return true;
    }
    this->Current = next;
    Chunk* const list = this->Take(level, digit);
    if (level > 0)
    {
      this->PushAll(list);
      return true;
    }
    // Loading takes longer than a bucket: what the next one needs, and where the one after it lies.
    const std::uint32_t second = this->NextDigit(0, digit);
    if (second != NoDigit)
    {
      ForEach(this->Lists[0][second].newest,
        [&](Entry entry)
        {
          if (keep(entry))
          {
            prepare(entry);
          }
        });
      const std::uint32_t third = this->NextDigit(0, second);
      if (third != NoDigit)
      {
        ForEach(this->Lists[0][third].newest, expect);
      }
    }
    for (Chunk* chunk = list; chunk != nullptr;)
    {
      Chunk* const older = chunk->older;
      for (std::uint32_t e = 0; e < chunk->count; ++e)
      {
        if (keep(chunk->entries[e]))
        {
          this->Heap.push_back(chunk->entries[e]);
        }
      }
      this->Release(chunk);
      chunk = older;
    }
    ++this->Buckets;
    this->Dealt += this->Heap.size();
    this->MakeHeap();
    return true;
  }

  double PerWidth = 1.0;
  std::uint32_t Current = 0;
  std::vector<Entry> Heap; ///< of the current bucket
  std::size_t HeapLimit = SmallHeap;
  std::array<std::array<List, 256>, Levels> Lists;
  std::array<std::array<std::uint64_t, 4>, Levels> Filled{};
  std::vector<HugeArray<Chunk>> Slabs;
  Chunk* Free = nullptr;
  std::uint64_t Dealt = 0;   ///< entries of the last buckets
  std::uint32_t Buckets = 0; ///< their number
};
}

#endif
