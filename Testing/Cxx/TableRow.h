// A line of the tables of the simulator's validation, which scripts/validate-simulator.sh collects.
#ifndef TableRow_h
#define TableRow_h

#include <cstdio>
#include <string>

namespace coronary
{
inline void Row(const std::string& what, double wanted, double measured, const char* tolerance)
{
  char off[64] = "";
  if (wanted != 0.0)
  {
    std::snprintf(off, sizeof(off), "%.2g %%", 100.0 * (measured / wanted - 1.0));
  }
  std::printf("| %s | %.6g | %.6g | %s | %s |\n", what.c_str(), wanted, measured, off, tolerance);
}
}

#endif
