#include "KernelChoice.h"

namespace coronary
{
bool ProcessorHas(Instructions instructions)
{
  switch (instructions)
  {
#if defined(__x86_64__)
    case Instructions::Avx2:
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
        __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") &&
        __builtin_cpu_supports("popcnt");
    case Instructions::Avx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl");
#else
    case Instructions::Avx2:
    case Instructions::Avx512:
      return false;
#endif
    default:
      return true;
  }
}
}
