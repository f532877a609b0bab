#include "vtkFrenetSweepSurface.h"

#include "MeasuredContours.h"
#include "SweepSurface.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkCompositeDataSet.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkStructuredGrid.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

using coronary::SweptSurface;
using coronary::Vector3;
using coronary::VesselTree;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkFrenetSweepSurface);

namespace
{
template <typename Array, typename Value>
vtkSmartPointer<Array> MakeArray(const std::string& name, const std::vector<Value>& values)
{
  auto array = vtkSmartPointer<Array>::New();
  array->SetName(name.c_str());
  array->SetNumberOfValues(static_cast<vtkIdType>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
  {
    array->SetValue(static_cast<vtkIdType>(i), values[i]);
  }
  return array;
}

vtkSmartPointer<vtkDoubleArray> MakeVectors(
  const std::string& name, const std::vector<Vector3>& values)
{
  auto array = vtkSmartPointer<vtkDoubleArray>::New();
  array->SetName(name.c_str());
  array->SetNumberOfComponents(3);
  array->SetNumberOfTuples(static_cast<vtkIdType>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
  {
    array->SetTypedTuple(static_cast<vtkIdType>(i), values[i].data());
  }
  return array;
}

vtkSmartPointer<vtkPoints> MakePoints(const std::vector<Vector3>& values)
{
  auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetData(MakeVectors("Points", values));
  return points;
}

template <typename Item, typename Get>
auto Collect(const std::vector<Item>& items, const Get& get)
{
  std::vector<decltype(get(items[0]))> values;
  values.reserve(items.size());
  for (const Item& item : items)
  {
    values.push_back(get(item));
  }
  return values;
}
}

/// The algorithm's input, out of the pipeline's.
class vtkFrenetSweepSurface::Reader
{
public:
  VesselTree tree;
  coronary::SweepSections sections;
  bool hasSegmentIds = false;
  bool hasLabels = false;
  std::map<int, int> segmentIds;             ///< of each group
  std::map<int, vtkStdString> segmentLabels; ///< of each group

  /// @param hasImage  the contours come from there
  Reader(const vtkFrenetSweepSurface& self, vtkPolyData* input, bool wanted, bool hasImage)
  {
    if (input == nullptr)
    {
      return;
    }
    vtkCellData* cells = input->GetCellData();
    this->hasSegmentIds = cells->GetArray(vtkCoronaryArrayNames::SegmentIds) != nullptr;
    this->hasLabels = vtkStringArray::SafeDownCast(
                        cells->GetAbstractArray(vtkCoronaryArrayNames::SegmentLabel)) != nullptr;
    if (!wanted || input->GetNumberOfLines() == 0)
    {
      return;
    }
    this->tree = vtkCoronary::BranchesOf(
      input, vtkCoronary::RadiusOf(input, "The input has", self.InputRadiusArrayName));
    this->ReadSections(self, input, hasImage);
    this->firstAtPlace = this->SamePlaces();
    for (VesselTree::Branch& branch : this->tree.branches)
    {
      for (std::int64_t& point : branch.points)
      {
        point = this->firstAtPlace[point];
      }
      this->segmentIds.emplace(branch.groupId, branch.segmentId);
      this->segmentLabels.emplace(branch.groupId, branch.name);
    }
  }

  /// The first of the points at the same place, for each point.
  std::vector<std::int64_t> firstAtPlace;

private:
  static vtkDataArray* Find(vtkPolyData* input, const std::string& name)
  {
    vtkDataArray* array = input->GetPointData()->GetArray(name.c_str());
    if (array == nullptr)
    {
      throw std::invalid_argument("The input has no point array " + name);
    }
    return array;
  }

  void ReadSections(const vtkFrenetSweepSurface& self, vtkPolyData* input, bool hasImage)
  {
    const vtkIdType count = input->GetNumberOfPoints();
    if (!self.EndNormalArrayName.empty() && self.EndNormalArrayName != "None")
    {
      vtkDataArray* ends = Find(input, self.EndNormalArrayName);
      if (ends->GetNumberOfComponents() != 3)
      {
        throw std::invalid_argument(
          "The normals of the ends " + self.EndNormalArrayName + " must have 3 components");
      }
      this->sections.endNormals.resize(count);
      for (vtkIdType i = 0; i < count; ++i)
      {
        ends->GetTuple(i, this->sections.endNormals[i].data());
      }
    }
    if (hasImage || self.ContourArrayName.empty() || self.ContourArrayName == "None")
    {
      return;
    }
    vtkDataArray* contours = Find(input, self.ContourArrayName);
    vtkDataArray* normals = Find(input, vtkCoronaryArrayNames::FrenetNormal);
    const int samples = contours->GetNumberOfComponents();
    if (samples < 6)
    {
      throw std::invalid_argument("The contour array " + self.ContourArrayName + " has " +
        std::to_string(samples) + " components; at least 6 directions are needed");
    }
    if (normals->GetNumberOfComponents() != 3)
    {
      throw std::invalid_argument(std::string("The contour normals ") +
        vtkCoronaryArrayNames::FrenetNormal + " must have 3 components");
    }
    this->sections.contourSamples = samples;
    this->sections.contours.resize(static_cast<std::size_t>(count) * samples);
    this->sections.contourNormals.resize(count);
    for (vtkIdType i = 0; i < count; ++i)
    {
      contours->GetTuple(i, this->sections.contours.data() + i * samples);
      normals->GetTuple(i, this->sections.contourNormals[i].data());
    }
  }

  /// For each point the first one at the same place.
  std::vector<std::int64_t> SamePlaces() const
  {
    std::map<std::array<double, 3>, std::int64_t> first;
    std::vector<std::int64_t> same;
    same.reserve(this->tree.points.size());
    for (const Vector3& p : this->tree.points)
    {
      const auto number = static_cast<std::int64_t>(same.size());
      // What is not a number has no order; the algorithm names such points.
      same.push_back(p.allFinite()
          ? first.emplace(std::array<double, 3>{ p[0], p[1], p[2] }, number).first->second
          : number);
    }
    return same;
  }
};

/// The outputs, out of the algorithm's result.
class vtkFrenetSweepSurface::Writer
{
public:
  Writer(const vtkFrenetSweepSurface& self, const Reader& reader, const SweptSurface& surface)
    : Self(self)
    , From(reader)
    , Surface(surface)
  {
  }

  void WriteSurface(vtkPolyData* output) const
  {
    const SweptSurface& s = this->Surface;
    output->SetPoints(MakePoints(s.points));
    vtkNew<vtkCellArray> triangles;
    triangles->AllocateEstimate(static_cast<vtkIdType>(s.triangles.size()), 3);
    std::vector<int> group;
    group.reserve(s.triangles.size());
    std::map<int, int> groupOfCap;
    for (const coronary::SweepCap& cap : s.caps)
    {
      groupOfCap[cap.entityId] = cap.groupId;
    }
    for (std::size_t t = 0; t < s.triangles.size(); ++t)
    {
      const coronary::Triangle& corners = s.triangles[t];
      const std::array<vtkIdType, 3> ids{ corners[0], corners[1], corners[2] };
      triangles->InsertNextCell(3, ids.data());
      const auto cap = groupOfCap.find(s.entityId[t]);
      const int b = s.groupId[corners[1]];
      group.push_back(cap != groupOfCap.end() ? cap->second
          : b == s.groupId[corners[2]]        ? b
                                              : s.groupId[corners[0]]);
    }
    output->SetPolys(triangles);
    vtkPointData* points = output->GetPointData();
    points->AddArray(MakeArray<vtkIntArray>(vtkCoronaryArrayNames::GroupIds, s.groupId));
    points->AddArray(MakeArray<vtkDoubleArray>(vtkCoronaryArrayNames::Abscissas, s.abscissa));
    points->AddArray(MakeArray<vtkDoubleArray>(vtkCoronaryArrayNames::Radius, s.radius));
    points->AddArray(MakeArray<vtkDoubleArray>(vtkCoronaryArrayNames::WallCurvature, s.curvature));
    points->AddArray(MakeArray<vtkDoubleArray>(vtkCoronaryArrayNames::EdgeLength, s.edgeLength));
    points->SetNormals(MakeVectors("Normals", s.normals));
    vtkCellData* cells = output->GetCellData();
    cells->AddArray(MakeArray<vtkIntArray>(vtkCoronaryArrayNames::CellEntityIds, s.entityId));
    cells->AddArray(MakeArray<vtkIntArray>(vtkCoronaryArrayNames::GroupIds, group));
    this->AddSegments(cells, group);
  }

  /// What was changed and what is missing, into field data; nothing where all is as it should be.
  void WriteChanges(vtkPolyData* output) const
  {
    namespace names = vtkCoronaryArrayNames;
    using coronary::SweepLeftOut;
    using coronary::SweepRepair;
    const SweptSurface& s = this->Surface;
    vtkFieldData* field = output->GetFieldData();
    if (!s.repaired.empty())
    {
      output->GetPointData()->AddArray(
        MakeArray<vtkUnsignedCharArray>(names::Repaired, s.repaired));
    }
    if (!s.repairs.empty())
    {
      field->AddArray(MakeArray<vtkStringArray>(
        names::Repairs, Collect(s.repairs, [](const SweepRepair& r) { return r.what; })));
      field->AddArray(MakeArray<vtkStringArray>(
        names::RepairVessels, Collect(s.repairs, [](const SweepRepair& r) { return r.vessel; })));
      field->AddArray(MakeVectors(
        names::RepairPlaces, Collect(s.repairs, [](const SweepRepair& r) { return r.place; })));
    }
    if (!s.leftOut.empty())
    {
      field->AddArray(MakeArray<vtkStringArray>(
        names::LeftOut, Collect(s.leftOut, [](const SweepLeftOut& l) { return l.reason; })));
      field->AddArray(MakeArray<vtkStringArray>(
        names::LeftOutVessels, Collect(s.leftOut, [](const SweepLeftOut& l) { return l.vessel; })));
      field->AddArray(MakeVectors(
        names::LeftOutPlaces, Collect(s.leftOut, [](const SweepLeftOut& l) { return l.place; })));
      field->AddArray(MakeArray<vtkDoubleArray>(
        names::LeftOutLengths, Collect(s.leftOut, [](const SweepLeftOut& l) { return l.length; })));
      std::vector<std::int64_t> points;
      for (std::size_t i = 0; i < this->From.firstAtPlace.size(); ++i)
      {
        if (std::binary_search(
              s.leftOutPoints.begin(), s.leftOutPoints.end(), this->From.firstAtPlace[i]))
        {
          points.push_back(static_cast<std::int64_t>(i));
        }
      }
      field->AddArray(MakeArray<vtkIdTypeArray>(names::LeftOutPoints, points));
    }
  }

  void WritePatches(vtkMultiBlockDataSet* output) const
  {
    namespace names = vtkCoronaryArrayNames;
    using Station = coronary::VesselAxis::Station;
    unsigned int block = 0;
    for (const coronary::SweepPatches& patches : this->Surface.patches)
    {
      const int around = patches.samples;
      const int along = static_cast<int>(patches.centres.size());
      vtkNew<vtkStructuredGrid> grid;
      grid->SetDimensions(around + 1, along, 1);
      std::vector<Vector3> points;
      points.reserve(static_cast<std::size_t>(around + 1) * along);
      for (int j = 0; j < along; ++j)
      {
        for (int i = 0; i <= around; ++i)
        {
          points.push_back(patches.contours[static_cast<std::size_t>(j) * around + i % around]);
        }
      }
      grid->SetPoints(MakePoints(points));
      vtkPointData* data = grid->GetPointData();
      const auto spread = [&](const auto& values)
      {
        std::decay_t<decltype(values)> result;
        for (const auto& value : values)
        {
          result.insert(result.end(), around + 1, value);
        }
        return result;
      };
      const auto numbers = [&](const std::string& name, double Station::*member)
      {
        data->AddArray(MakeArray<vtkDoubleArray>(
          name, spread(Collect(patches.centres, [=](const Station& s) { return s.*member; }))));
      };
      const auto vectors = [&](const std::string& name, Vector3 Station::*member)
      {
        data->AddArray(MakeVectors(
          name, spread(Collect(patches.centres, [=](const Station& s) { return s.*member; }))));
      };
      data->AddArray(
        MakeArray<vtkDoubleArray>(vtkCoronaryArrayNames::Abscissas, spread(patches.abscissa)));
      numbers(vtkCoronaryArrayNames::Radius, &Station::radius);
      vectors(names::PatchCentre, &Station::point);
      vectors(names::FrenetTangent, &Station::tangent);
      vectors(names::FrenetNormal, &Station::normal);
      vectors(names::FrenetBinormal, &Station::binormal);
      data->AddArray(MakeArray<vtkDoubleArray>(names::Curvature,
        spread(Collect(patches.centres, [](const Station& s) { return s.curvature.norm(); }))));
      numbers(names::Torsion, &Station::torsion);
      numbers(names::FrameTwist, &Station::twist);
      grid->GetFieldData()->AddArray(MakeArray<vtkIntArray>(
        vtkCoronaryArrayNames::GroupIds, std::vector<int>{ patches.groupId }));
      output->SetBlock(block, grid);
      const auto label = this->From.segmentLabels.find(patches.groupId);
      const std::string name = label != this->From.segmentLabels.end() && !label->second.empty()
        ? std::string(label->second)
        : "Group " + std::to_string(patches.groupId);
      output->GetMetaData(block)->Set(vtkCompositeDataSet::NAME(), name.c_str());
      ++block;
    }
  }

  void WriteCaps(vtkPolyData* output) const
  {
    namespace names = vtkCoronaryArrayNames;
    using coronary::SweepCap;
    const std::vector<SweepCap>& caps = this->Surface.caps;
    output->SetPoints(MakePoints(Collect(caps, [](const SweepCap& c) { return c.centre; })));
    vtkNew<vtkCellArray> vertices;
    for (vtkIdType i = 0; i < static_cast<vtkIdType>(caps.size()); ++i)
    {
      vertices->InsertNextCell(1, &i);
    }
    output->SetVerts(vertices);
    vtkPointData* data = output->GetPointData();
    data->AddArray(MakeArray<vtkIntArray>(vtkCoronaryArrayNames::CellEntityIds,
      Collect(caps, [](const SweepCap& c) { return c.entityId; })));
    const std::vector<int> groups = Collect(caps, [](const SweepCap& c) { return c.groupId; });
    data->AddArray(MakeArray<vtkIntArray>(vtkCoronaryArrayNames::GroupIds, groups));
    data->AddArray(
      MakeVectors(names::CapNormal, Collect(caps, [](const SweepCap& c) { return c.normal; })));
    data->AddArray(MakeArray<vtkDoubleArray>(
      vtkCoronaryArrayNames::Radius, Collect(caps, [](const SweepCap& c) { return c.radius; })));
    data->AddArray(MakeArray<vtkIntArray>(
      names::IsInlet, Collect(caps, [](const SweepCap& c) { return c.inlet ? 1 : 0; })));
    this->AddSegments(data, groups);
  }

private:
  void AddSegments(vtkFieldData* data, const std::vector<int>& groups) const
  {
    const auto of = [](const auto& map, int group, auto missing)
    {
      const auto found = map.find(group);
      return found != map.end() ? found->second : missing;
    };
    if (this->From.hasSegmentIds)
    {
      data->AddArray(MakeArray<vtkIntArray>(vtkCoronaryArrayNames::SegmentIds,
        Collect(groups, [&](int group) { return of(this->From.segmentIds, group, 0); })));
    }
    if (this->From.hasLabels)
    {
      data->AddArray(MakeArray<vtkStringArray>(vtkCoronaryArrayNames::SegmentLabel,
        Collect(
          groups, [&](int group) { return of(this->From.segmentLabels, group, vtkStdString()); })));
    }
  }

  const vtkFrenetSweepSurface& Self;
  const Reader& From;
  const SweptSurface& Surface;
};

vtkFrenetSweepSurface::vtkFrenetSweepSurface()
{
  this->SetNumberOfInputPorts(2);
  this->SetNumberOfOutputPorts(3);
}

vtkMultiBlockDataSet* vtkFrenetSweepSurface::GetPatches()
{
  return vtkMultiBlockDataSet::SafeDownCast(this->GetOutputDataObject(PatchPort));
}

void vtkFrenetSweepSurface::SetImageConnection(vtkAlgorithmOutput* image)
{
  this->SetInputConnection(1, image);
}

void vtkFrenetSweepSurface::SetImageData(vtkDataObject* image)
{
  this->SetInputDataObject(1, image);
}

void vtkFrenetSweepSurface::MeasureContoursIn(vtkInformationVector* images, Reader& reader)
{
  using vtkCoronary::Require;
  vtkImageData* image = vtkImageData::GetData(images, 0);
  Require(image != nullptr && image->GetNumberOfPoints() > 0, "The image has no voxels");
  vtkDataArray* values = vtkCoronary::VoxelArrayOf(image, this->InputImageArrayName, "the image");
  std::vector<float> copy;
  const coronary::ScalarImage scalars = vtkCoronary::ScalarImageOf(image, values, copy);
  const coronary::ImageInterpolator interpolator(scalars);
  const double share = coronary::MeasureContours(
    interpolator, {}, reader.tree, reader.sections, vtkCoronary::ProgressOf(this, 0.0, 0.1));
  if (share < 0.1)
  {
    vtkWarningMacro("Only " << static_cast<int>(std::lround(100.0 * share))
                            << " % of the cross-sections are to be seen in the image; the others "
                               "are round");
  }
}

int vtkFrenetSweepSurface::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), port == 0 ? "vtkPolyData" : "vtkImageData");
  if (port == 1)
  {
    info->Set(INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

int vtkFrenetSweepSurface::FillOutputPortInformation(int port, vtkInformation* info)
{
  info->Set(
    vtkDataObject::DATA_TYPE_NAME(), port == PatchPort ? "vtkMultiBlockDataSet" : "vtkPolyData");
  return 1;
}

int vtkFrenetSweepSurface::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  return 1;
}

int vtkFrenetSweepSurface::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // A surface is made from the whole tree: piece 0 asks for it, the others for nothing.
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, 1, outputs);
  if (inputs[1]->GetNumberOfInformationObjects() > 0)
  {
    vtkInformation* info = inputs[1]->GetInformationObject(0);
    if (info->Has(SDDP::WHOLE_EXTENT()))
    {
      int whole[6];
      info->Get(SDDP::WHOLE_EXTENT(), whole);
      info->Set(SDDP::UPDATE_EXTENT(), whole, 6);
    }
  }
  return 1;
}

int vtkFrenetSweepSurface::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkPolyData* input = vtkPolyData::GetData(inputs[0], 0);
  vtkPolyData* surfaceOutput = vtkPolyData::GetData(outputs, SurfacePort);
  vtkMultiBlockDataSet* patchOutput = vtkMultiBlockDataSet::GetData(outputs, PatchPort);
  vtkPolyData* capOutput = vtkPolyData::GetData(outputs, CapPort);
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  const bool wanted = outputs->GetInformationObject(port)->Get(SDDP::UPDATE_PIECE_NUMBER()) <= 0;
  try
  {
    coronary::SweepSettings settings;
    settings.minimumEdgeLength = this->MinimumEdgeLength;
    settings.maximumEdgeLength = this->MaximumEdgeLength;
    settings.curvatureWeight = this->CurvatureWeight;
    settings.edgeLengthPerRadius = this->EdgeLengthPerRadius;
    settings.sharpestBend = this->SharpestBend;
    settings.blending = this->Blending;
    settings.smoothing = this->Smoothing;
    settings.capped = this->Capping;
    settings.patchSamples = this->PatchSamples;
    settings.patchSpacing = this->PatchSpacing;
    if (this->Frame != BlendedFrame && this->Frame != RotationMinimisingFrame)
    {
      throw std::invalid_argument("Frame must be 0 or 1");
    }
    settings.frame = static_cast<coronary::SweepFrame>(this->Frame);
    settings.Validate();
    const bool hasImage = inputs[1]->GetNumberOfInformationObjects() > 0;
    Reader reader(*this, input, wanted, hasImage);
    if (hasImage && !reader.tree.branches.empty())
    {
      this->MeasureContoursIn(inputs[1], reader);
    }
    const SweptSurface surface = coronary::SweepVesselTree(reader.tree, settings, reader.sections,
      vtkCoronary::ProgressOf(this, hasImage ? 0.1 : 0.0, 0.97));
    const Writer writer(*this, reader, surface);
    writer.WriteSurface(surfaceOutput);
    writer.WritePatches(patchOutput);
    writer.WriteCaps(capOutput);
    if (input != nullptr)
    {
      surfaceOutput->GetFieldData()->PassData(input->GetFieldData());
    }
    writer.WriteChanges(surfaceOutput);
    for (const std::string& remark : surface.remarks)
    {
      vtkWarningMacro(<< remark);
    }
    this->UpdateProgress(1.0);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(
      this, outputs, "for the surface", { "SweepSettings: ", "SweepVesselTree: " });
  }
}

void vtkFrenetSweepSurface::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "InputRadiusArrayName: " << this->InputRadiusArrayName << "\n";
  os << indent << "ContourArrayName: " << this->ContourArrayName << "\n";
  os << indent << "EndNormalArrayName: " << this->EndNormalArrayName << "\n";
  os << indent << "InputImageArrayName: " << this->InputImageArrayName << "\n";
  os << indent << "MinimumEdgeLength: " << this->MinimumEdgeLength << "\n";
  os << indent << "MaximumEdgeLength: " << this->MaximumEdgeLength << "\n";
  os << indent << "CurvatureWeight: " << this->CurvatureWeight << "\n";
  os << indent << "EdgeLengthPerRadius: " << this->EdgeLengthPerRadius << "\n";
  os << indent << "SharpestBend: " << this->SharpestBend << "\n";
  os << indent << "Blending: " << this->Blending << "\n";
  os << indent << "Smoothing: " << this->Smoothing << "\n";
  os << indent << "Capping: " << this->Capping << "\n";
  os << indent << "Frame: " << this->Frame << "\n";
  os << indent << "PatchSamples: " << this->PatchSamples << "\n";
  os << indent << "PatchSpacing: " << this->PatchSpacing << "\n";
}
