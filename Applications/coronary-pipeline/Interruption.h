/**
 * @file Interruption.h
 * @brief Ctrl-C and termination as a flag that the work looks at.
 */
#ifndef DynamicCoronary_Interruption_h
#define DynamicCoronary_Interruption_h

namespace coronary
{
/// From now on SIGINT and SIGTERM set a flag. A second one of the same kind ends the process.
void CatchInterruptions();

/// The signal that arrived, or 0.
int Interruption();

/// @throws Cancelled when a signal arrived.
void ThrowIfInterrupted();
}

#endif
