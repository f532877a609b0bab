#include "vtkMovingMesh.h"

#include "vtkMessageTrap.h"

#include "vtkCardiacPhaseInterpolator.h"
#include "vtkMeshSequenceWriter.h"
#include "vtkSkinDeformation.h"

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
  this->Interpolator->SetSteps(vtkCardiacPhaseInterpolator::ListedSteps);
  this->Writer->SetPhases(vtkMeshSequenceWriter::ListedTimes);
  for (const double time : times)
  {
    this->Interpolator->AddStep(time);
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
