// The same loop with wider registers; the compiler options select them.
#define DYNAMICCORONARY_TRACER_LOOP MoveTracersAvx2
#include "TracerKernels.cxx" // NOLINT(bugprone-suspicious-include)
