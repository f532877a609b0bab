// The same loops with wider registers; the compiler options select them.
#include "VesselnessKernels.cxx" // NOLINT(bugprone-suspicious-include)
