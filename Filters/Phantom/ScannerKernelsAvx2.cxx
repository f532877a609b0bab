// The same loops with wider registers; the compiler options select them.
#include "ScannerKernels.cxx" // NOLINT(bugprone-suspicious-include)
