#include "KernelChoice.h"
#include "XRayKernels.h"

namespace coronary
{
KernelChoice<XRayKernels>& XRayKernelChoice()
{
#if defined(DYNAMICCORONARY_WIDE_KERNELS)
  static KernelChoice<XRayKernels> choice(XRayKernelsBaseline, &XRayKernelsAvx2);
#else
  static KernelChoice<XRayKernels> choice(XRayKernelsBaseline);
#endif
  return choice;
}
}
