#include "LargePages.h"

#include <cerrno>
#include <cstdint>

#ifdef __linux__
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace coronary
{
void PreferLargePages(void* memory, std::size_t bytes) noexcept
{
#if defined(__linux__) && defined(MADV_HUGEPAGE)
  if (memory == nullptr || bytes < LargePagesWorth)
  {
    return;
  }
  static const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const auto begin = (reinterpret_cast<std::uintptr_t>(memory) + page - 1) / page * page;
  const auto end = (reinterpret_cast<std::uintptr_t>(memory) + bytes) / page * page;
  // What is refused stays as it is.
  const int before = errno;
  auto* const first =
    static_cast<char*>(memory) + (begin - reinterpret_cast<std::uintptr_t>(memory));
  ::madvise(first, end - begin, MADV_HUGEPAGE);
  errno = before;
#else
  (void)memory;
  (void)bytes;
#endif
}
}
