// The same loops with wider registers; the compiler options select them.
#include "DetectorKernels.cxx" // NOLINT(bugprone-suspicious-include)
