// The same loop with wider registers; the compiler options select them.
#include "TracerKernels.cxx" // NOLINT(bugprone-suspicious-include)
