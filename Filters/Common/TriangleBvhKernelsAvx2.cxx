// The same loop with wider registers; the compiler options select them.
#include "TriangleBvhKernels.cxx" // NOLINT(bugprone-suspicious-include)
