// The same loops with wider registers; the compiler options select them.
#include "XRayKernels.cxx" // NOLINT(bugprone-suspicious-include)
