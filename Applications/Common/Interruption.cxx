#include "Interruption.h"

#include "ParallelFor.h"

#include <csignal>

namespace coronary
{
namespace
{
volatile std::sig_atomic_t ArrivedSignal = 0;

extern "C" void RememberSignal(int number)
{
  ArrivedSignal = number;
}
}

void CatchInterruptions()
{
  struct sigaction action = {};
  action.sa_handler = &RememberSignal;
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

int Interruption()
{
  return ArrivedSignal;
}

void RememberInterruption(int signal)
{
  ArrivedSignal = signal;
}

void ThrowIfInterrupted()
{
  if (Interruption() != 0)
  {
    throw Cancelled();
  }
}
}
