/**
 * @file LargePages.h
 * @brief Memory of whole images in large pages, where the system has them.
 */
#ifndef DynamicCoronary_LargePages_h
#define DynamicCoronary_LargePages_h

#include <cstddef>

namespace coronary
{
/// Blocks from this size on are worth asking: a few large pages.
constexpr std::size_t LargePagesWorth = std::size_t(8) << 20;

/**
 * Asks that a block gets large pages when it is first written to: the system hands out an image of 400 MB in 200 steps
 * instead of 100,000. Only a wish: nothing else depends on it, and small blocks and other systems than Linux ignore it.
 */
void PreferLargePages(void* memory, std::size_t bytes) noexcept;
}

#endif
