#include "XRayKernels.h"

namespace coronary
{
const XRayKernels& BestXRayKernels()
{
#ifdef DYNAMICCORONARY_WIDE_KERNELS
  static const bool wide = __builtin_cpu_supports("avx2") != 0;
  return wide ? XRayKernelsAvx2 : XRayKernelsBaseline;
#else
  return XRayKernelsBaseline;
#endif
}
}
