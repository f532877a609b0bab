#include "vtkCoronaryTreeTopology.h"

#include "CenterlineTopology.h"
#include "SegmentLabeling.h"
#include "TreeCheck.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkVesselTree.h"
#include "vtkVmtkLines.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

using coronary::CenterlineTopology;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkCoronaryTreeTopology);

namespace
{
// Not NaN, which VTK writes into XML files so that its reader complains.
constexpr double NoDaughter = -1.0;

/// As many daughters as the arrays of a bifurcation have room for at least.
constexpr int MinimumDaughters = 3;

/// One row of `width` values for each list; what a list does not have is `missing`.
template <typename Array, typename Value>
void AddRows(vtkFieldData* data, const std::string& name,
  const std::vector<std::vector<Value>>& rows, int width, Value missing)
{
  vtkNew<Array> array;
  array->SetName(name.c_str());
  array->SetNumberOfComponents(width);
  array->SetNumberOfTuples(static_cast<vtkIdType>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
  {
    for (int k = 0; k < width; ++k)
    {
      const bool has = k < static_cast<int>(rows[i].size());
      array->SetTypedComponent(static_cast<vtkIdType>(i), k, has ? rows[i][k] : missing);
    }
  }
  data->AddArray(array);
}

template <typename Get>
auto OfBifurcations(const CenterlineTopology& tree, const Get& get)
{
  std::vector<decltype(get(tree.bifurcations[0]))> values;
  values.reserve(tree.bifurcations.size());
  for (const auto& bifurcation : tree.bifurcations)
  {
    values.push_back(get(bifurcation));
  }
  return values;
}

const char* NameOf(coronary::Dominance dominance)
{
  return dominance == coronary::Dominance::Right ? "right"
    : dominance == coronary::Dominance::Left     ? "left"
                                                 : "balanced";
}
}

/// The outputs, out of the algorithm's result.
class vtkCoronaryTreeTopology::Writer
{
public:
  Writer(vtkCoronaryTreeTopology* self, vtkPolyData* input, const CenterlineTopology& tree)
    : Self(self)
    , Input(input)
    , Tree(tree)
  {
  }

  void WriteTree(vtkPolyData* output) const
  {
    const CenterlineTopology& tree = this->Tree;
    const auto count = static_cast<vtkIdType>(tree.points.size());
    vtkPointData* data = output->GetPointData();
    vtkPointData* given = this->Input->GetPointData();
    data->CopyAllOn();
    data->CopyAllocate(given, count);
    for (vtkIdType i = 0; i < count; ++i)
    {
      data->CopyData(given, tree.source[i], i);
    }
    vtkCoronary::SetTree(output, tree, vtkCoronary::BranchArrays::Named,
      this->Input->GetPoints() != nullptr ? this->Input->GetPoints()->GetDataType() : VTK_DOUBLE);
    vtkCoronary::AddVectors(data, vtkCoronaryArrayNames::FrenetTangent, tree.tangent);
    vtkCoronary::AddVectors(data, vtkCoronaryArrayNames::FrenetNormal, tree.normal);
    vtkCoronary::AddVectors(data, vtkCoronaryArrayNames::FrenetBinormal, tree.binormal);
    vtkCoronary::AddArray<vtkDoubleArray>(data, vtkCoronaryArrayNames::Curvature, tree.curvature);
    vtkCoronary::AddArray<vtkDoubleArray>(data, vtkCoronaryArrayNames::Torsion, tree.torsion);
    vtkCoronary::AddArray<vtkDoubleArray>(data, vtkCoronaryArrayNames::SectionArea, tree.area);
    vtkCoronary::AddArray<vtkIntArray>(data, vtkCoronaryArrayNames::SegmentIds, tree.segmentId);
  }

  void WriteBifurcations(vtkPolyData* output) const
  {
    namespace names = vtkCoronaryArrayNames;
    using coronary::Bifurcation;
    const auto& self = *this->Self;
    const CenterlineTopology& tree = this->Tree;
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    vtkNew<vtkCellArray> vertices;
    int width = MinimumDaughters;
    for (const Bifurcation& bifurcation : tree.bifurcations)
    {
      const vtkIdType id = points->InsertNextPoint(tree.points[bifurcation.point].data());
      vertices->InsertNextCell(1, &id);
      width = std::max(width, static_cast<int>(bifurcation.daughters.size()));
    }
    output->SetPoints(points);
    output->SetVerts(vertices);
    vtkPointData* data = output->GetPointData();
    vtkCoronary::AddArray<vtkIntArray>(data, vtkCoronaryArrayNames::ParentGroupIds,
      OfBifurcations(tree, [](const Bifurcation& b) { return b.parent; }));
    AddRows<vtkIntArray>(data, names::DaughterGroupIds,
      OfBifurcations(tree, [](const Bifurcation& b) { return b.daughters; }), width, -1);
    vtkCoronary::AddArray<vtkIntArray>(data, vtkCoronaryArrayNames::TreeIds,
      OfBifurcations(tree, [&](const Bifurcation& b) { return tree.branches[b.parent].treeId; }));
    vtkCoronary::AddArray<vtkIntArray>(data, vtkCoronaryArrayNames::SegmentIds,
      OfBifurcations(
        tree, [&](const Bifurcation& b) { return tree.branches[b.parent].segmentId; }));
    AddRows<vtkDoubleArray>(data, names::DaughterAngles,
      OfBifurcations(tree, [](const Bifurcation& b) { return b.daughterAngles; }), width,
      NoDaughter);
    AddRows<vtkDoubleArray>(data, names::DaughterRadii,
      OfBifurcations(tree, [](const Bifurcation& b) { return b.daughterRadius; }), width,
      NoDaughter);
    const auto numbers = [&](const char* name, double Bifurcation::*member)
    {
      vtkCoronary::AddArray<vtkDoubleArray>(
        data, name, OfBifurcations(tree, [=](const Bifurcation& b) { return b.*member; }));
    };
    numbers(names::BifurcationAngle, &Bifurcation::angle);
    numbers(names::ParentRadius, &Bifurcation::parentRadius);
    numbers(names::AreaRatio, &Bifurcation::areaRatio);
    numbers(names::DaughterAreaRatio, &Bifurcation::daughterAreaRatio);
    numbers(names::MurrayResidual, &Bifurcation::murrayResidual);
    numbers(names::HuoKassabResidual, &Bifurcation::huoKassabResidual);
    numbers(names::FinetRatio, &Bifurcation::finetRatio);
    numbers(names::FittedExponent, &Bifurcation::fittedExponent);
    vtkCoronary::AddArray<vtkDoubleArray>(data, names::MurrayExponent,
      std::vector<double>(tree.bifurcations.size(), self.MurrayExponent));
  }

  void WriteLoops(vtkPolyData* output) const
  {
    coronary::Polylines lines;
    std::vector<double> lengths;
    for (const coronary::CenterlineLoop& loop : this->Tree.loops)
    {
      if (loop.points.size() < 3)
      {
        continue;
      }
      lengths.push_back(loop.length);
      const auto first = static_cast<std::int64_t>(lines.points.size());
      std::vector<std::int64_t>& line = lines.lines.emplace_back();
      for (const std::int64_t point : loop.points)
      {
        line.push_back(static_cast<std::int64_t>(lines.points.size()));
        lines.points.push_back(this->Tree.points[point]);
      }
      line.push_back(first);
    }
    vtkCoronary::SetLines(output, lines);
    vtkCoronary::AddArray<vtkDoubleArray>(
      output->GetCellData(), vtkCoronaryArrayNames::Length, lengths);
  }

  void WriteWarnings(vtkPolyData* output, const std::vector<coronary::TreeWarning>& warnings) const
  {
    namespace names = vtkCoronaryArrayNames;
    if (warnings.empty())
    {
      return;
    }
    std::vector<vtkStdString> texts;
    std::vector<vtkStdString> vessels;
    std::vector<std::vector<double>> places;
    std::vector<double> confidences;
    for (const coronary::TreeWarning& warning : warnings)
    {
      texts.emplace_back(warning.what);
      vessels.emplace_back(warning.vessel);
      places.push_back({ warning.place[0], warning.place[1], warning.place[2] });
      confidences.push_back(warning.confidence);
    }
    vtkFieldData* data = output->GetFieldData();
    vtkCoronary::AddArray<vtkStringArray>(data, names::Warnings, texts);
    vtkCoronary::AddArray<vtkStringArray>(data, names::WarningVessels, vessels);
    AddRows<vtkDoubleArray>(data, names::WarningPlaces, places, 3, 0.0);
    vtkCoronary::AddArray<vtkDoubleArray>(data, names::WarningConfidences, confidences);
  }

  void WriteFieldData(vtkPolyData* output, const coronary::LabelingResult* labels) const
  {
    namespace names = vtkCoronaryArrayNames;
    const CenterlineTopology& tree = this->Tree;
    vtkFieldData* data = output->GetFieldData();
    data->PassData(this->Input->GetFieldData());
    vtkCoronary::AddArray<vtkIntArray>(
      data, names::PrunedTwigs, std::vector<int>{ tree.prunedTwigs });
    vtkCoronary::AddArray<vtkIntArray>(
      data, names::ClosedGaps, std::vector<int>{ tree.closedGaps });
    std::vector<double> lengths;
    for (const coronary::CenterlineLoop& loop : tree.loops)
    {
      lengths.push_back(loop.length);
    }
    vtkCoronary::AddArray<vtkDoubleArray>(data, names::LoopLengths, lengths);
    // No NaN here: VTK gathers the ranks' data in a form of text that cannot hold it.
    std::vector<double> fitted;
    if (!std::isnan(tree.fittedExponent))
    {
      fitted.push_back(tree.fittedExponent);
    }
    vtkCoronary::AddArray<vtkDoubleArray>(data, names::FittedExponent, fitted);
    if (labels != nullptr)
    {
      vtkCoronary::AddArray<vtkStringArray>(data, names::Dominance,
        std::vector<vtkStdString>{ vtkStdString(NameOf(labels->dominance)) });
      const coronary::HeartPose& heart = labels->heart;
      const Vector3 shift = -(heart.axes * heart.origin) / heart.size;
      std::vector<std::vector<double>> matrix(1);
      for (int row = 0; row < 4; ++row)
      {
        for (int column = 0; column < 4; ++column)
        {
          matrix[0].push_back(row == 3 ? (column == 3 ? 1.0 : 0.0)
              : column == 3            ? shift[row]
                                       : heart.axes(row, column) / heart.size);
        }
      }
      AddRows<vtkDoubleArray>(data, names::HeartFrame, matrix, 16, 0.0);
    }
  }

private:
  vtkCoronaryTreeTopology* Self;
  vtkPolyData* Input;
  const CenterlineTopology& Tree;
};

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
    const Writer writer(this, input, tree);
    writer.WriteTree(output[TreePort]);
    writer.WriteBifurcations(output[BifurcationPort]);
    writer.WriteLoops(output[LoopPort]);
    const coronary::LabelingResult* named =
      this->LabelSegments && !tree.branches.empty() ? &labels : nullptr;
    writer.WriteFieldData(output[TreePort], named);
    writer.WriteFieldData(output[BifurcationPort], named);
    if (named != nullptr)
    {
      const std::vector<coronary::TreeWarning> warnings =
        coronary::CheckCoronaryTrees(tree, labels);
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
