/**
 * @file HugeArray.h
 * @brief An array for access all over the place: in pages of 2 MB where the system has them.
 */
#ifndef DynamicCoronary_HugeArray_h
#define DynamicCoronary_HugeArray_h

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace coronary
{
/// With small pages most of a random access is looking for its page.
template <typename T>
class HugeArray
{
  static_assert(std::is_trivially_copyable<T>::value && std::is_trivially_destructible<T>::value,
    "elements are not constructed one by one");

public:
  HugeArray() = default;

  /// @throws std::bad_alloc
  HugeArray(std::size_t size, const T& value)
    : Count(size)
  {
    const std::size_t bytes = std::max<std::size_t>(size, 1) * sizeof(T);
    const std::size_t alignment = bytes < HugePage ? SmallAlignment : HugePage;
    void* const memory =
      std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
    if (memory == nullptr)
    {
      throw std::bad_alloc();
    }
    this->Memory.reset(static_cast<T*>(memory));
#if defined(__linux__)
    if (bytes >= HugePage)
    {
      // The last page may be mostly unused: it stays small. Refused: small pages, all the same.
      (void)madvise(memory, bytes / HugePage * HugePage, MADV_HUGEPAGE);
    }
#endif
    std::uninitialized_fill_n(this->Memory.get(), size, value);
  }

  T* Data()
  {
    return this->Memory.get();
  }
  const T* Data() const
  {
    return this->Memory.get();
  }
  std::size_t Size() const
  {
    return this->Count;
  }
  std::size_t MemorySize() const
  {
    return this->Count * sizeof(T);
  }
  void Clear()
  {
    this->Memory.reset();
    this->Count = 0;
  }

private:
  static constexpr std::size_t HugePage = std::size_t{ 2 } << 20;
  static constexpr std::size_t SmallAlignment = 64;
  struct Free
  {
    void operator()(T* memory) const { std::free(memory); }
  };
  std::unique_ptr<T, Free> Memory;
  std::size_t Count = 0;
};
}

#endif
