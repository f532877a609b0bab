/**
 * @file RingQueue.h
 * @brief Values from one thread to another in their order, without waiting on either side.
 */
#ifndef DynamicCoronary_RingQueue_h
#define DynamicCoronary_RingQueue_h

#include <array>
#include <atomic>
#include <cstddef>
#include <utility>

namespace coronary
{
/// One thread pushes, one pops. Holds one less than Size.
template <typename T, std::size_t Size>
class RingQueue
{
public:
  /// @return false: it is full, and nothing is changed
  bool Push(T value)
  {
    const std::size_t last = this->Last.load(std::memory_order_relaxed);
    const std::size_t next = (last + 1) % Size;
    if (next == this->First.load(std::memory_order_acquire))
    {
      return false;
    }
    this->Slots[last] = std::move(value);
    this->Last.store(next, std::memory_order_release);
    return true;
  }

  /// @return false: it is empty
  bool Pop(T& value)
  {
    const std::size_t first = this->First.load(std::memory_order_relaxed);
    if (first == this->Last.load(std::memory_order_acquire))
    {
      return false;
    }
    value = std::exchange(this->Slots[first], T());
    this->First.store((first + 1) % Size, std::memory_order_release);
    return true;
  }

private:
  std::array<T, Size> Slots{};
  std::atomic<std::size_t> First{ 0 };
  std::atomic<std::size_t> Last{ 0 };
};
}

#endif
