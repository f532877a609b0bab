// The same loops with wider registers; the compiler options select them.
#include "ReconstructionKernels.cxx" // NOLINT(bugprone-suspicious-include)
