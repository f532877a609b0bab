#include "MarchingQueue.h"

namespace coronary
{
void MarchingQueue::Extend(List& list)
{
  if (this->Free == nullptr)
  {
    this->Slabs.emplace_back(this->Slabs.size() < 16 ? SmallSlab : LargeSlab, Chunk{});
    HugeArray<Chunk>& slab = this->Slabs.back();
    for (std::size_t chunk = slab.Size(); chunk-- > 0;)
    {
      this->Release(slab.Data() + chunk);
    }
  }
  Chunk* const chunk = this->Free;
  this->Free = chunk->older;
  chunk->older = list.newest;
  chunk->count = 0;
  list.newest = chunk;
}

MarchingQueue::Chunk* MarchingQueue::Take(std::uint32_t level, std::uint32_t digit)
{
  Chunk* const list = this->Lists[level][digit].newest;
  this->Lists[level][digit].newest = nullptr;
  this->Filled[level][digit / 64] &= ~(std::uint64_t{ 1 } << (digit % 64));
  return list;
}

std::uint32_t MarchingQueue::NextDigit(std::uint32_t level, std::uint32_t digit) const
{
  const std::uint32_t first = digit + 1;
  for (std::uint32_t word = first / 64; word < 4; ++word)
  {
    std::uint64_t bits = this->Filled[level][word];
    if (word == first / 64)
    {
      bits = bits >> (first % 64) << (first % 64);
    }
    if (bits != 0)
    {
      return word * 64 + static_cast<std::uint32_t>(__builtin_ctzll(bits));
    }
  }
  return NoDigit;
}

void MarchingQueue::PushOnHeap(Entry entry)
{
  std::size_t at = this->Heap.size();
  this->Heap.push_back(entry);
  while (at > 0 && entry < this->Heap[(at - 1) / 2])
  {
    this->Heap[at] = this->Heap[(at - 1) / 2];
    at = (at - 1) / 2;
  }
  this->Heap[at] = entry;
}

void MarchingQueue::SiftDown(std::size_t at, Entry entry)
{
  // Down along the lesser children to the bottom, then up to its place, which is near.
  const std::size_t root = at;
  const std::size_t size = this->Heap.size();
  Entry* const heap = this->Heap.data();
  std::size_t child = 2 * at + 1;
  while (child + 1 < size)
  {
    child += heap[child + 1] < heap[child] ? 1 : 0;
    heap[at] = heap[child];
    at = child;
    child = 2 * at + 1;
  }
  if (child < size)
  {
    heap[at] = heap[child];
    at = child;
  }
  while (at > root && entry < heap[(at - 1) / 2])
  {
    heap[at] = heap[(at - 1) / 2];
    at = (at - 1) / 2;
  }
  heap[at] = entry;
}

void MarchingQueue::RemoveMinimum()
{
  const Entry last = this->Heap.back();
  this->Heap.pop_back();
  if (!this->Heap.empty())
  {
    this->SiftDown(0, last);
  }
}

void MarchingQueue::MakeHeap()
{
  for (std::size_t at = this->Heap.size() / 2; at-- > 0;)
  {
    this->SiftDown(at, this->Heap[at]);
  }
}

void MarchingQueue::ChangeWidth(double factor)
{
  std::vector<Chunk*> taken;
  std::vector<Entry> heap;
  heap.swap(this->Heap);
  // What leaves next is the least of all, and nothing enters before it.
  Entry minimum = heap.empty() ? ~Entry{ 0 } : heap.front();
  for (std::uint32_t level = 0; level < Levels; ++level)
  {
    for (std::uint32_t digit = 0; digit < 256; ++digit)
    {
      Chunk* const list = this->Take(level, digit);
      if (list == nullptr)
      {
        continue;
      }
      taken.push_back(list);
      for (const Chunk* chunk = list; chunk != nullptr; chunk = chunk->older)
      {
        minimum = std::min(minimum,
          *std::min_element(chunk->entries.begin(), chunk->entries.begin() + chunk->count));
      }
    }
  }
  this->SetWidth(factor / this->PerWidth);
  this->Current = this->BucketOf(minimum);
  for (Chunk* list : taken)
  {
    this->PushAll(list);
  }
  for (const Entry entry : heap)
  {
    this->Push(entry);
  }
}

void MarchingQueue::Split()
{
  if (this->Current < MaximumToRefine)
  {
    this->ChangeWidth(1.0 / 16.0);
  }
  // Not again and again where it does not help.
  this->HeapLimit = std::max(SmallHeap, 2 * this->Heap.size());
}

void MarchingQueue::PushAll(Chunk* list)
{
  for (Chunk* chunk = list; chunk != nullptr;)
  {
    Chunk* const older = chunk->older;
    for (std::uint32_t e = 0; e < chunk->count; ++e)
    {
      this->Push(chunk->entries[e]);
    }
    this->Release(chunk);
    chunk = older;
  }
}
}
