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

/// As if the signal had arrived here: it arrived at another process of the same work.
void RememberInterruption(int signal);

/// @throws Cancelled when a signal arrived.
void ThrowIfInterrupted();
}

#endif
