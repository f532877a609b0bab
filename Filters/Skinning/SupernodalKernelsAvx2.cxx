// The same loops with wider registers; the compiler options select them.
#include "SupernodalKernels.cxx" // NOLINT(bugprone-suspicious-include)
