// A scanner that is quick to compute, for tests.
#ifndef DynamicCoronary_CoarseScanner_h
#define DynamicCoronary_CoarseScanner_h

#include "ScannerSettings.h"

/// The VCT with cells `factor` times as wide and high, as many fewer views, and without noise.
inline coronary::ScannerSettings CoarseScanner(int factor)
{
  coronary::ScannerSettings s;
  s.channels /= factor;
  s.channelPitch *= factor;
  s.rows /= factor;
  s.rowPitch *= factor;
  s.viewsPerTurn = s.viewsPerTurn / factor / 4 * 4;
  s.noise = 0;
  return s;
}

#endif
