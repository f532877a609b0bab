#include "vtkVesselEdits.h"

#include "EditedTopology.h"
#include "EditsFile.h"
#include "TreeEdits.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkTopologyOutput.h"
#include "vtkVesselTree.h"

#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDataObject.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
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
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <stdexcept>
#include <variant>

namespace names = vtkCoronaryArrayNames;
using coronary::EditNote;
using coronary::TreeEdit;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkVesselEdits);

namespace
{
constexpr double MurrayExponent = 3.0; // as vtkCoronaryTreeTopology's default

vtkImageData* ImageAt(vtkInformationVector** inputs, int port)
{
  vtkImageData* image = inputs[port]->GetNumberOfInformationObjects() > 0
    ? vtkImageData::GetData(inputs[port], 0)
    : nullptr;
  return image && image->GetNumberOfPoints() > 0 ? image : nullptr;
}

vtkDataArray* ScalarsOf(vtkImageData* image, const char* whose)
{
  vtkDataArray* scalars = image->GetPointData()->GetScalars();
  vtkCoronary::Require(scalars != nullptr && scalars->GetNumberOfComponents() == 1,
    std::string(whose) + " has no scalars of one component");
  return scalars;
}

/// What is drawn in, with what was copied for it.
struct Scene
{
  coronary::EditScene scene;
  coronary::ScalarImage image;
  std::vector<float> imageCopy;
  std::vector<float> vesselnessCopy;

  Scene(vtkInformationVector** inputs, vtkFieldData* fields)
  {
    vtkImageData* intensity = ImageAt(inputs, 1);
    if (!intensity)
    {
      return;
    }
    this->image =
      vtkCoronary::ScalarImageOf(intensity, ScalarsOf(intensity, "The image"), this->imageCopy);
    this->scene.image = &this->image;
    if (vtkDataArray* blur = fields->GetArray(names::ImageBlur))
    {
      this->scene.blur = blur->GetNumberOfValues() > 0 ? blur->GetTuple1(0) : 0.0;
    }
    vtkImageData* vesselness = ImageAt(inputs, 2);
    if (!vesselness)
    {
      return;
    }
    const coronary::ImageGrid grid = vtkCoronary::GridOf(vesselness);
    vtkCoronary::Require(grid.extent == this->image.grid.extent &&
        grid.origin.isApprox(this->image.grid.origin, 1e-5) &&
        grid.spacing.isApprox(this->image.grid.spacing, 1e-5) &&
        grid.direction.isApprox(this->image.grid.direction, 1e-5),
      "The vesselness is on another grid than the image: extent, spacing, origin or direction "
      "differs");
    vtkDataArray* values = ScalarsOf(vesselness, "The vesselness");
    const coronary::ScalarImage tubes =
      vtkCoronary::ScalarImageOf(vesselness, values, this->vesselnessCopy);
    if (const auto* const* floats = std::get_if<const float*>(&tubes.values))
    {
      this->scene.vesselness = *floats;
      return;
    }
    this->vesselnessCopy.resize(static_cast<std::size_t>(values->GetNumberOfTuples()));
    for (vtkIdType i = 0; i < values->GetNumberOfTuples(); ++i)
    {
      this->vesselnessCopy[i] = static_cast<float>(values->GetComponent(i, 0));
    }
    this->scene.vesselness = this->vesselnessCopy.data();
  }
};

void WriteNotes(vtkFieldData* fields, const std::vector<EditNote>& notes)
{
  std::vector<vtkStdString> what;
  std::vector<int> numbers;
  std::vector<double> lengths;
  std::vector<double> seen;
  vtkNew<vtkDoubleArray> places;
  places->SetName(names::EditPlaces);
  places->SetNumberOfComponents(3);
  for (const EditNote& note : notes)
  {
    what.emplace_back(note.what);
    numbers.push_back(note.number);
    lengths.push_back(note.length);
    seen.push_back(note.seen);
    places->InsertNextTuple(note.place.data());
  }
  vtkCoronary::AddArray<vtkStringArray>(fields, names::EditNotes, what);
  vtkCoronary::AddArray<vtkIntArray>(fields, names::EditNumbers, numbers);
  vtkCoronary::AddArray<vtkDoubleArray>(fields, names::EditLengths, lengths);
  vtkCoronary::AddArray<vtkDoubleArray>(fields, names::EditSeen, seen);
  fields->AddArray(places);
}

/// The points of the edited tree with all that the given ones have.
vtkSmartPointer<vtkPolyData> PointsOf(vtkPolyData* given, const coronary::EditedTree& edited)
{
  auto points = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> places;
  places->SetDataType(given->GetPoints()->GetDataType());
  vtkPointData* from = given->GetPointData();
  vtkPointData* to = points->GetPointData();
  to->CopyAllOn();
  to->CopyAllocate(from, static_cast<vtkIdType>(edited.source.size()));
  for (std::size_t p = 0; p < edited.source.size(); ++p)
  {
    const vtkIdType id = places->InsertNextPoint(edited.tree.points[p].data());
    if (edited.source[p] >= 0)
    {
      to->CopyData(from, edited.source[p], id);
    }
    else
    {
      to->NullData(id);
    }
  }
  points->SetPoints(places);
  const auto replace = [&](const char* name, const auto& values)
  {
    vtkDataArray* array = to->GetArray(name);
    for (std::size_t p = 0; array && p < values.size(); ++p)
    {
      array->SetTuple1(static_cast<vtkIdType>(p), static_cast<double>(values[p]));
    }
  };
  replace(names::Confidence, edited.tree.confidence);
  replace(names::Bridged, edited.tree.bridged);
  replace(names::BridgeConfidence, edited.tree.bridgeConfidence);
  // What was drawn by hand hangs on no ostium that was guessed, and is no vein: NullData has 0.
  vtkDataArray* ostium = to->GetArray(names::OstiumConfidence);
  for (std::size_t p = 0; ostium && p < edited.source.size(); ++p)
  {
    if (edited.source[p] < 0)
    {
      ostium->SetTuple1(static_cast<vtkIdType>(p), 1.0);
    }
  }
  vtkCoronary::AddArray<vtkIntArray>(to, names::EditNumber, edited.edit);
  vtkFieldData* fields = points->GetFieldData();
  fields->PassData(given->GetFieldData());
  // They are looked for anew.
  for (const char* name :
    { names::Warnings, names::WarningVessels, names::WarningPlaces, names::WarningConfidences })
  {
    fields->RemoveArray(name);
  }
  WriteNotes(fields, edited.notes);
  return points;
}
}

vtkVesselEdits::vtkVesselEdits()
{
  this->SetNumberOfInputPorts(3);
  this->SetNumberOfOutputPorts(2);
}

vtkVesselEdits::~vtkVesselEdits() = default;

vtkPolyData* vtkVesselEdits::GetBifurcations()
{
  return vtkPolyData::SafeDownCast(this->GetOutputDataObject(BifurcationPort));
}

void vtkVesselEdits::AddEdit(const char* text)
{
  // ParaView has an empty row for what is not written yet.
  if (text && *text)
  {
    this->Edits.emplace_back(text);
    this->Modified();
  }
}

void vtkVesselEdits::RemoveAllEdits()
{
  if (!this->Edits.empty())
  {
    this->Edits.clear();
    this->Modified();
  }
}

const char* vtkVesselEdits::GetEdit(int index)
{
  return index >= 0 && index < this->GetNumberOfEdits() ? this->Edits[index].c_str() : nullptr;
}

void vtkVesselEdits::SetPoint(int index, double x, double y, double z)
{
  if (index < 0 || index >= this->GetNumberOfPoints())
  {
    vtkErrorMacro("There is no point " << index << " of " << this->GetNumberOfPoints());
    return;
  }
  const std::array<double, 3> point{ x, y, z };
  if (this->Points[index] != point)
  {
    this->Points[index] = point;
    this->Modified();
  }
}

void vtkVesselEdits::SetNumberOfPoints(int count)
{
  if (count >= 0 && count != this->GetNumberOfPoints())
  {
    this->Points.resize(static_cast<std::size_t>(count), { 0.0, 0.0, 0.0 });
    this->Modified();
  }
}

TreeEdit vtkVesselEdits::CurrentEdit() const
{
  TreeEdit edit;
  edit.kind = coronary::EditKinds()[static_cast<std::size_t>(this->Kind)];
  for (const std::array<double, 3>& point : this->Points)
  {
    edit.points.emplace_back(point.data());
  }
  edit.name = this->VesselName;
  edit.newName = this->NewName;
  edit.radius = this->Radius;
  edit.reach = this->Reach;
  coronary::CheckEdit(edit);
  return edit;
}

std::vector<TreeEdit> vtkVesselEdits::AllEdits() const
{
  std::vector<TreeEdit> edits =
    this->FileName.empty() ? std::vector<TreeEdit>() : coronary::ReadEditsFile(this->FileName);
  for (std::size_t n = 0; n < this->Edits.size(); ++n)
  {
    edits.push_back(coronary::ParseEdit(this->Edits[n], "Edits[" + std::to_string(n) + "]"));
  }
  if (this->Kind != NoEdit)
  {
    edits.push_back(this->CurrentEdit());
  }
  return edits;
}

template <typename Make>
const char* vtkVesselEdits::Kept(const Make& make)
{
  try
  {
    this->Text = make();
  }
  catch (const std::exception&)
  {
    // ParaView asks while somebody writes; the next update says what is wrong.
    this->Text.clear();
  }
  return this->Text.c_str();
}

const char* vtkVesselEdits::GetEditsText()
{
  return this->Kept([this] { return coronary::EditsText(this->AllEdits()); });
}

const char* vtkVesselEdits::GetCurrentEdit()
{
  return this->Kept(
    [this] { return this->Kind == NoEdit ? "" : coronary::EditText(this->CurrentEdit()); });
}

int vtkVesselEdits::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Remove(INPUT_REQUIRED_DATA_TYPE());
  info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  if (port == 0)
  {
    info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  }
  else
  {
    info->Set(INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

int vtkVesselEdits::FillOutputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkDataObject::DATA_TYPE_NAME(), port == EditedPort ? "vtkDataSet" : "vtkPolyData");
  return 1;
}

int vtkVesselEdits::RequestDataObject(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkDataObject* input = vtkDataObject::GetData(inputs[0], 0);
  if (!input)
  {
    return 0;
  }
  vtkInformation* info = outputs->GetInformationObject(EditedPort);
  vtkDataObject* output = vtkDataObject::GetData(info);
  if (!output || !output->IsA(input->GetClassName()))
  {
    info->Set(
      vtkDataObject::DATA_OBJECT(), vtkSmartPointer<vtkDataObject>::Take(input->NewInstance()));
  }
  info = outputs->GetInformationObject(BifurcationPort);
  if (!vtkPolyData::GetData(info))
  {
    vtkNew<vtkPolyData> bifurcations;
    info->Set(vtkDataObject::DATA_OBJECT(), bifurcations);
  }
  return 1;
}

int vtkVesselEdits::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  return 1;
}

int vtkVesselEdits::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  for (int port = 0; port < this->GetNumberOfInputPorts(); ++port)
  {
    vtkInformation* info = inputs[port]->GetNumberOfInformationObjects() > 0
      ? inputs[port]->GetInformationObject(0)
      : nullptr;
    if (info && info->Has(SDDP::WHOLE_EXTENT()))
    {
      int whole[6];
      info->Get(SDDP::WHOLE_EXTENT(), whole);
      info->Set(SDDP::UPDATE_EXTENT(), whole, 6);
    }
  }
  return 1;
}

void vtkVesselEdits::EditPolyData(vtkPolyData* input, vtkInformationVector** inputs,
  const std::vector<TreeEdit>& edits, vtkPolyData* output, vtkPolyData* bifurcations)
{
  const bool any = std::any_of(edits.begin(), edits.end(),
    [](const TreeEdit& edit) { return !coronary::IsMaskEdit(edit.kind); });
  if (input->GetNumberOfLines() == 0)
  {
    vtkCoronary::Require(!any, "edit 1: there is no tree to be edited");
    output->ShallowCopy(input);
    return;
  }
  coronary::VesselTree tree = vtkCoronary::TreeOf(input);
  vtkCoronary::AddPointValues(input, tree);
  const Scene scene(inputs, input->GetFieldData());
  const coronary::EditedTree edited = coronary::EditTree(tree, edits,
    any ? scene.scene : coronary::EditScene(), vtkCoronary::ProgressOf(this, 0.0, 0.8));
  coronary::TopologySettings settings;
  settings.murrayExponent = MurrayExponent;
  const coronary::EditedTopology made =
    coronary::OrderEdited(edited, edits, settings, vtkCoronary::ProgressOf(this, 0.8, 1.0));
  const vtkSmartPointer<vtkPolyData> points = PointsOf(input, edited);
  const vtkCoronary::TopologyOutput writer(points, made.tree, MurrayExponent);
  const coronary::LabelingResult* labels = made.named ? &made.labels : nullptr;
  writer.WriteBifurcations(bifurcations);
  writer.WriteFieldData(bifurcations, labels);
  if (!any)
  {
    output->ShallowCopy(input);
    return;
  }
  writer.WriteTree(output);
  writer.WriteFieldData(output, labels);
  if (labels)
  {
    writer.WriteWarnings(output, writer.Warnings(*labels));
  }
}

void vtkVesselEdits::EditImage(
  vtkImageData* input, const std::vector<TreeEdit>& edits, vtkImageData* output)
{
  output->ShallowCopy(input);
  if (input->GetNumberOfPoints() == 0 ||
    std::none_of(edits.begin(), edits.end(),
      [](const TreeEdit& edit) { return coronary::IsMaskEdit(edit.kind); }))
  {
    return;
  }
  vtkDataArray* given = ScalarsOf(input, "The mask");
  vtkNew<vtkUnsignedCharArray> mask;
  mask->SetName(given->GetName() ? given->GetName() : names::VesselMask);
  mask->SetNumberOfTuples(given->GetNumberOfTuples());
  for (vtkIdType i = 0; i < given->GetNumberOfTuples(); ++i)
  {
    mask->SetValue(i, given->GetComponent(i, 0) != 0.0 ? 1 : 0);
  }
  WriteNotes(output->GetFieldData(),
    coronary::EditMask(vtkCoronary::GridOf(input), mask->GetPointer(0), edits));
  output->GetPointData()->SetScalars(mask);
}

int vtkVesselEdits::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkDataObject* input = vtkDataObject::GetData(inputs[0], 0);
  vtkDataObject* output = vtkDataObject::GetData(outputs, EditedPort);
  vtkPolyData* bifurcations = vtkPolyData::GetData(outputs, BifurcationPort);
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  const bool wanted = outputs->GetInformationObject(port)->Get(SDDP::UPDATE_PIECE_NUMBER()) <= 0;
  try
  {
    output->Initialize();
    bifurcations->Initialize();
    if (!wanted)
    {
      return 1;
    }
    const std::vector<TreeEdit> edits = this->AllEdits();
    if (auto* tree = vtkPolyData::SafeDownCast(input))
    {
      this->EditPolyData(tree, inputs, edits, vtkPolyData::SafeDownCast(output), bifurcations);
    }
    else
    {
      this->EditImage(vtkImageData::SafeDownCast(input), edits, vtkImageData::SafeDownCast(output));
    }
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the edits");
  }
}

void vtkVesselEdits::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << this->FileName << '\n';
  os << indent << "Edits: " << this->Edits.size() << '\n';
  os << indent << "Kind: " << this->Kind << '\n';
  os << indent << "Points: " << this->Points.size() << '\n';
  os << indent << "VesselName: " << this->VesselName << '\n';
  os << indent << "NewName: " << this->NewName << '\n';
  os << indent << "Radius: " << this->Radius << '\n';
  os << indent << "Reach: " << this->Reach << '\n';
}
