// The same loops with wider registers; the compiler options select them.
#include "SkinKernels.cxx" // NOLINT(bugprone-suspicious-include)
