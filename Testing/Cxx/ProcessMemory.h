/**
 * @file ProcessMemory.h
 * @brief What this process has of memory, for tests and programs that watch it.
 */
#ifndef DynamicCoronary_ProcessMemory_h
#define DynamicCoronary_ProcessMemory_h

#include <fstream>

#include <malloc.h>
#include <unistd.h>

/// Bytes that are allocated.
inline double AllocatedBytes()
{
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

/// Bytes of this process in memory.
inline double ResidentBytes()
{
  std::ifstream file("/proc/self/statm");
  double total = 0.0;
  double resident = 0.0;
  file >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

#endif
