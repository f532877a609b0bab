/**
 * @file TripleBuffer.h
 * @brief The latest value from one thread to another, without waiting on either side.
 */
#ifndef DynamicCoronary_TripleBuffer_h
#define DynamicCoronary_TripleBuffer_h

#include <array>
#include <atomic>
#include <cstdint>

namespace coronary
{
/// One thread writes, one reads; the reader gets the last whole value, and may miss some. T is copied.
template <typename T>
class TripleBuffer
{
public:
  void Write(const T& value)
  {
    this->Slots[this->Writing] = value;
    const std::uint8_t before = this->Between.exchange(
      static_cast<std::uint8_t>(this->Writing | New), std::memory_order_acq_rel);
    this->Writing = before & Index;
  }

  /// @return whether it is another than at the last call
  bool Read(T& value)
  {
    const bool fresh = (this->Between.load(std::memory_order_relaxed) & New) != 0;
    if (fresh)
    {
      this->Reading = this->Between.exchange(this->Reading, std::memory_order_acq_rel) & Index;
    }
    value = this->Slots[this->Reading];
    return fresh;
  }

private:
  static constexpr std::uint8_t Index = 3;
  static constexpr std::uint8_t New = 4;

  std::array<T, 3> Slots{};
  std::uint8_t Writing = 0;
  std::atomic<std::uint8_t> Between{ 1 };
  std::uint8_t Reading = 2;
};
}

#endif
