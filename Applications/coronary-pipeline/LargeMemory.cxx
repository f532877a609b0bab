/**
 * The program's memory: great blocks, which are images, in large pages. Handing them out page by page took a tenth of a
 * run's time.
 */
#include "LargePages.h"

#include <cstdlib>
#include <new>

namespace
{
void* Take(std::size_t size)
{
  for (;;)
  {
    if (void* memory = std::malloc(size == 0 ? 1 : size))
    {
      coronary::PreferLargePages(memory, size);
      return memory;
    }
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr)
    {
      throw std::bad_alloc();
    }
    handler();
  }
}
}

// The other forms without alignment come here.
void* operator new(std::size_t size)
{
  return Take(size);
}

void operator delete(void* memory) noexcept
{
  std::free(memory);
}

void operator delete(void* memory, std::size_t) noexcept
{
  std::free(memory);
}
