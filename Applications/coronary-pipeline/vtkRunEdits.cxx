#include "vtkRunEdits.h"

#include "EditsFile.h"
#include "Interruption.h"
#include "MetaImageWriter.h"
#include "StagedFolder.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkDataArray.h"
#include "vtkDataSet.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"
#include "vtkVesselEdits.h"

#include <algorithm>
#include <stdexcept>

namespace coronary
{
namespace
{
namespace names = vtkCoronaryArrayNames;
using Json = nlohmann::ordered_json;

bool HasEdits(const RunStep& step, bool ofMask)
{
  return std::any_of(step.input.Edits.begin(), step.input.Edits.end(),
    [ofMask](const TreeEdit& edit) { return IsMaskEdit(edit.kind) == ofMask; });
}

void Apply(vtkVesselEdits* filter, const RunStep& step)
{
  for (const TreeEdit& edit : step.input.Edits)
  {
    filter->AddEdit(EditText(edit).c_str());
  }
  UpdateAtTime(filter, 0, 0.0, step.input.Messages, [](double) {});
}

/// What was done, in the order of the edits.
void AddNotes(vtkDataObject* edited, Json& list)
{
  vtkFieldData* fields = edited->GetFieldData();
  auto* notes = vtkStringArray::SafeDownCast(fields->GetAbstractArray(names::EditNotes));
  vtkDataArray* numbers = fields->GetArray(names::EditNumbers);
  vtkDataArray* places = fields->GetArray(names::EditPlaces);
  vtkDataArray* lengths = fields->GetArray(names::EditLengths);
  vtkDataArray* seen = fields->GetArray(names::EditSeen);
  for (vtkIdType n = 0; notes && n < notes->GetNumberOfValues(); ++n)
  {
    const double* place = places->GetTuple3(n);
    list.push_back({ { "number", static_cast<int>(numbers->GetTuple1(n)) },
      { "what", notes->GetValue(n) }, { "place", { place[0], place[1], place[2] } },
      { "length_mm", lengths->GetTuple1(n) }, { "seen", seen->GetTuple1(n) } });
  }
  std::sort(list.begin(), list.end(),
    [](const Json& a, const Json& b) { return a["number"].get<int>() < b["number"].get<int>(); });
}
}

vtkSmartPointer<vtkImageData> EditedMask(RunStep& step, Json& numbers)
{
  if (!HasEdits(step, true))
  {
    return step.input.Mask;
  }
  vtkNew<vtkVesselEdits> edits;
  edits->SetInputDataObject(0, step.input.Mask);
  Apply(edits, step);
  vtkSmartPointer<vtkImageData> mask =
    vtkImageData::SafeDownCast(edits->GetOutputDataObject(vtkVesselEdits::EditedPort));
  WriteMetaImage(step.Add("edited_mask.mha"), vtkCoronary::GridOf(mask),
    static_cast<const unsigned char*>(mask->GetScalarPointer()), step.input.Settings.compress,
    [](double) { return Interruption() == 0; });
  numbers["edited_mask_file"] = "edited_mask.mha";
  AddNotes(mask, numbers["edits"]);
  return mask;
}

void RequireMaskOfEdits(const RunStep& step)
{
  const bool mask =
    !step.input.IsSurface() && (step.input.IsMask() || !step.input.Settings.beyondMask);
  if (HasEdits(step, true) && !mask)
  {
    throw std::runtime_error(std::string("edits that paint or erase need a mask: ") +
      (step.input.IsSurface() ? "the input is a surface." : "with --beyond-mask none is used."));
  }
}

void EditTree(RunStep& step, vtkSmartPointer<vtkPolyData>& tree,
  vtkSmartPointer<vtkPolyData>& bifurcations, Json& numbers)
{
  if (!HasEdits(step, false))
  {
    return;
  }
  vtkNew<vtkVesselEdits> edits;
  edits->SetInputDataObject(0, tree);
  if (!step.input.IsSurface() && !step.input.IsMask())
  {
    edits->SetInputDataObject(1, step.input.Reference);
    edits->SetInputDataObject(2, step.input.Vesselness);
  }
  Apply(edits, step);
  tree = vtkPolyData::SafeDownCast(edits->GetOutputDataObject(vtkVesselEdits::EditedPort));
  bifurcations = edits->GetBifurcations();
  AddNotes(tree, numbers["edits"]);
}

std::string DescribeLastEdit(const Json& edits)
{
  return "edit " + edits.back()["number"].dump() + ": " + edits.back()["what"].get<std::string>();
}
}
