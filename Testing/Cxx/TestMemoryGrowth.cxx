// Memory over many cycles of one process: what a cycle takes, it gives back. DYNAMICCORONARY_CYCLES says how many cycles;
// scripts/check-leaks.sh shows the table.
#include "ProcessMemory.h"
#include "vtkCenterlineSkeleton.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkFrangiVesselness.h"

#include "vtkNew.h"
#include "vtkPolyData.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace
{
constexpr int Phases = 2;
constexpr double MostGrowth =
  65536; // bytes that 20 cycles may leave behind, caches of the libraries included

/// From the phantom to its vesselness and skeleton, for a beat.
void Beat()
{
  vtkNew<vtkCoronaryPhantomSource> phantom;
  phantom->SetSeed(3);
  phantom->SetTemporalWindow(0.0);
  phantom->SetSpacing(3.0, 3.0, 3.0);
  phantom->SetSurfaceSpacing(1.5);
  phantom->SetCenterlineSpacing(2.0);
  vtkNew<vtkFrangiVesselness> vesselness;
  vesselness->SetInputConnection(phantom->GetOutputPort(vtkCoronaryPhantomSource::ImagePort));
  vesselness->SetAutomaticReferenceTime(false);
  vesselness->SetSigmaMin(2.0);
  vesselness->SetSigmaMax(3.0);
  vesselness->SetNumberOfScales(1);
  vtkNew<vtkCenterlineSkeleton> skeleton;
  skeleton->SetInputConnection(phantom->GetOutputPort(vtkCoronaryPhantomSource::TreePort));
  for (int phase = 0; phase < Phases; ++phase)
  {
    const double time = static_cast<double>(phase) / Phases;
    vesselness->UpdateTimeStep(time);
    skeleton->UpdateTimeStep(time);
    ASSERT_GT(skeleton->GetOutput()->GetNumberOfLines(), 0);
  }
}
}

TEST(MemoryGrowth, ABeatGivesBackWhatItTook)
{
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer's own allocator counts; its leak check does the work";
#endif
  const char* wanted = std::getenv("DYNAMICCORONARY_CYCLES");
  const int cycles = wanted ? std::max(3, std::atoi(wanted)) : 4;
  std::vector<double> allocated;
  std::printf("cycle  allocated MiB  resident MiB  since cycle 2, bytes\n");
  for (int cycle = 1; cycle <= cycles; ++cycle)
  {
    Beat();
    malloc_trim(0);
    allocated.push_back(AllocatedBytes());
    const double grown = cycle < 3 ? 0.0 : allocated.back() - allocated[1];
    std::printf("%5d  %13.3f  %12.1f  %20.0f\n", cycle, allocated.back() / 1048576.0,
      ResidentBytes() / 1048576.0, grown);
    std::fflush(stdout);
  }
  EXPECT_LT(allocated.back() - allocated[1], MostGrowth);
}
