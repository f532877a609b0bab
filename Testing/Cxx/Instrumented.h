/**
 * @file Instrumented.h
 * @brief Whether a sanitizer slows this program down.
 */
#ifndef DynamicCoronary_Instrumented_h
#define DynamicCoronary_Instrumented_h

namespace coronary
{
/// With a sanitizer's code in it, how long something takes says nothing.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool Instrumented = true;
#else
constexpr bool Instrumented = false;
#endif
}

#endif
