#include "vtkCoronaryTreeTopology.h"

#include "CenterlineTopology.h"
#include "SegmentLabeling.h"
#include "TreeCheck.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkTopologyOutput.h"
#include "vtkVesselTree.h"
#include "vtkVmtkLines.h"

#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

using coronary::CenterlineTopology;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkCoronaryTreeTopology);

vtkCoronaryTreeTopology::vtkCoronaryTreeTopology()
{
  this->SetNumberOfInputPorts(2);
  this->SetNumberOfOutputPorts(4);
}

void vtkCoronaryTreeTopology::SetRootData(vtkPolyData* roots)
{
  this->SetInputData(1, roots);
}

int vtkCoronaryTreeTopology::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), port == 0 ? "vtkPolyData" : "vtkPointSet");
  if (port == 1)
  {
    info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

int vtkCoronaryTreeTopology::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  return 1;
}

int vtkCoronaryTreeTopology::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // A tree is built from all its lines.
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  return 1;
}

int vtkCoronaryTreeTopology::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkPolyData* input = vtkPolyData::GetData(inputs[0], 0);
  vtkPointSet* roots = vtkPointSet::GetData(inputs[1], 0);
  vtkPolyData* output[4];
  for (int port = 0; port < 4; ++port)
  {
    output[port] = vtkPolyData::GetData(outputs, port);
  }
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  const bool wanted = outputs->GetInformationObject(port)->Get(SDDP::UPDATE_PIECE_NUMBER()) <= 0;
  try
  {
    coronary::TopologySettings settings;
    settings.gapRatio = this->GapRatio;
    settings.pruneRatio = this->PruneRatio;
    settings.murrayExponent = this->MurrayExponent;
    settings.smoothing.wavelength = this->SmoothingWavelength;
    settings.Validate();
    if (!(this->SmoothingWavelength <= 1000.0))
    {
      throw std::invalid_argument("The smoothing wavelength must be at most 1000");
    }
    coronary::LabelingSettings labeling;
    labeling.dominance = this->Dominance;
    labeling.Validate();
    coronary::Polylines lines;
    std::vector<Vector3> starts;
    if (wanted && input->GetNumberOfLines() > 0)
    {
      lines = vtkCoronary::LinesOf(
        input, vtkCoronary::RadiusOf(input, "The input has", this->InputRadiusArrayName));
      for (vtkIdType i = 0; roots != nullptr && i < roots->GetNumberOfPoints(); ++i)
      {
        starts.emplace_back(roots->GetPoint(i));
      }
    }
    CenterlineTopology tree = coronary::BuildTopology(
      lines, settings, starts, vtkCoronary::ProgressOf(this, 0.0, this->LabelSegments ? 0.3 : 1.0));
    coronary::LabelingResult labels;
    if (this->LabelSegments)
    {
      labels = coronary::LabelSegments(tree, labeling, vtkCoronary::ProgressOf(this, 0.3, 1.0));
      coronary::SplitAtSegmentBorders(tree);
    }
    const vtkCoronary::TopologyOutput writer(input, tree, this->MurrayExponent);
    writer.WriteTree(output[TreePort]);
    writer.WriteBifurcations(output[BifurcationPort]);
    writer.WriteLoops(output[LoopPort]);
    const coronary::LabelingResult* named =
      this->LabelSegments && !tree.branches.empty() ? &labels : nullptr;
    writer.WriteFieldData(output[TreePort], named);
    writer.WriteFieldData(output[BifurcationPort], named);
    if (named != nullptr)
    {
      const std::vector<coronary::TreeWarning> warnings = writer.Warnings(labels);
      writer.WriteWarnings(output[TreePort], warnings);
      writer.WriteWarnings(output[BifurcationPort], warnings);
    }
    vtkCoronary::ToVmtkLines(output[TreePort], output[VmtkPort]);
    if (!tree.loops.empty())
    {
      vtkWarningMacro(<< tree.loops.size() << (tree.loops.size() == 1 ? " loop was" : " loops were")
                      << " found and cut open; the output Loops shows where");
    }
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the trees");
  }
}

void vtkCoronaryTreeTopology::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "GapRatio: " << this->GapRatio << "\n";
  os << indent << "PruneRatio: " << this->PruneRatio << "\n";
  os << indent << "MurrayExponent: " << this->MurrayExponent << "\n";
  os << indent << "SmoothingWavelength: " << this->SmoothingWavelength << "\n";
  os << indent << "LabelSegments: " << this->LabelSegments << "\n";
  os << indent << "Dominance: " << this->Dominance << "\n";
  os << indent << "InputRadiusArrayName: " << this->InputRadiusArrayName << "\n";
}
