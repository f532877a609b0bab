// The same loop with wider registers; the compiler options select them.
#include "WallKernels.cxx" // NOLINT(bugprone-suspicious-include)
