#include "vtkMovingMesh.h"

#include "vtkMessageTrap.h"

#include "vtkCardiacPhaseInterpolator.h"
#include "vtkMeshSequenceWriter.h"
#include "vtkSkinDeformation.h"

#include <algorithm>
#include <map>
#include <stdexcept>

namespace coronary
{
namespace
{
const std::map<std::string, int> Modes = {
  { "linear", vtkCardiacPhaseInterpolator::Linear },
  { "cubic", vtkCardiacPhaseInterpolator::PeriodicCubic },
  { "low-noise", vtkCardiacPhaseInterpolator::LowNoise },
};

/// The deformation takes velocities between the time steps around a moment: these are close to it, and on
/// both sides of the first and of the last one too.
void OfferMomentsAround(const std::vector<double>& times, vtkCardiacPhaseInterpolator* interpolator)
{
  double step = 0.002;
  for (std::size_t k = 1; k < times.size(); ++k)
  {
    step = std::min(step, 0.25 * (times[k] - times[k - 1]));
  }
  interpolator->SetSteps(vtkCardiacPhaseInterpolator::ListedSteps);
  for (const double time : times)
  {
    interpolator->AddStep(time - step);
    interpolator->AddStep(time);
    interpolator->AddStep(time + step);
  }
}
}

int InterpolationMode(const std::string& name)
{
  return Modes.at(name);
}

std::vector<std::string> InterpolationModes()
{
  std::vector<std::string> names;
  names.reserve(Modes.size());
  for (const auto& [name, mode] : Modes)
  {
    names.push_back(name);
  }
  return names;
}

MovingMesh::MovingMesh()
{
  this->Deformation->SetPoseConnection(this->Interpolator->GetOutputPort());
  // Thin tetrahedra far from the origin are better off, and files take longer than this.
  this->Deformation->DoublePrecisionOn();
  this->Writer->SetInputConnection(this->Deformation->GetOutputPort());
}

MovingMesh::~MovingMesh() = default;

void MovingMesh::Write(const std::string& path, const std::vector<double>& times,
  vtkMessageTrap& messages, const std::function<void(double)>& progress)
{
  OfferMomentsAround(times, this->Interpolator);
  this->Writer->SetPhases(vtkMeshSequenceWriter::ListedTimes);
  for (const double time : times)
  {
    this->Writer->AddTime(time);
  }
  this->Writer->SetFileName(path.c_str());
  int good = 0;
  WithProgress(this->Writer, progress, [&] { good = this->Writer->Write(); });
  messages.ThrowIfError();
  if (!good)
  {
    throw std::runtime_error("Nothing was written to '" + path + "'.");
  }
}
}
