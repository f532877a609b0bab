#include "Command.h"

#include "AtomicFile.h"
#include "MarkupsFile.h"
#include "OptionChecks.h"
#include "SimVascularFile.h"
#include "StagedFolder.h"
#include "VolumeFile.h"
#include "vtkDataFiles.h"
#include "vtkMarkups.h"
#include "vtkMaskSurface.h"
#include "vtkMeshConversion.h"
#include "vtkMessageTrap.h"
#include "vtkSimVascularForms.h"
#include "vtkSlicerModel.h"
#include "vtkSurfaceFile.h"

#include "vtkAppendPolyData.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkCenterlineConversion.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryTreeTopology.h"
#include "vtkIdList.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkTGFReader.h"
#include "vtkTGFWriter.h"
#include "vtkVesselTree.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace coronary
{
namespace
{
struct ConvertJob
{
  std::string input;
  std::string output;
  std::string form;
  std::string array = "BoneWeights";
  bool binary = false;
  double radius = 1.0;
  double tolerance = 1e-6;
  std::vector<std::string> segments;
  bool join = false;
  std::string unit = "mm";
  int treeId = -1;

  void Declare(CLI::App& app);
  void Run() const;

private:
  /// Millimetres in a unit of SimVascular's files.
  double Unit() const { return this->unit == "cm" ? 10.0 : 1.0; }
  bool IsMaskInput() const;
  bool IsLinesOutput() const;
  void CheckNames() const;
  /// @param isTree  whether the file has a tree in our form
  vtkSmartPointer<vtkPolyData> Read(vtkMessageTrap& messages, bool& isTree) const;
  vtkSmartPointer<vtkPolyData> ReadSimVascular() const;
  vtkSmartPointer<vtkPolyData> Joined(vtkPolyData* lines, vtkMessageTrap& messages) const;
  vtkSmartPointer<vtkPolyData> AsTree(vtkPolyData* lines, vtkMessageTrap& messages) const;
  vtkSmartPointer<vtkPolyData> OneTree(vtkPolyData* tree) const;
  void WriteVessels(vtkPolyData* tree) const;
  /// @return what was written
  vtkSmartPointer<vtkPolyData> Write(
    vtkPolyData* lines, bool wasTree, vtkMessageTrap& messages) const;
};

constexpr const char* Forms[] = { "tree", "vmtk", "skeleton", "simvascular", "svpath", "slicer" };

void ConvertJob::Declare(CLI::App& app)
{
  app
    .add_option("INPUT", this->input,
      "Centerlines: .vtp (a tree, VMTK's branches, SimVascular's centerlines, or a skeleton), "
      ".tgf, "
      ".mrk.json, .pth, .ctgr or a folder of these two. Masks: .seg.nrrd, .nrrd, .nhdr, .mha, "
      ".mhd, "
      ".nii, .nii.gz. Meshes: .obj, .off, .mesh, .vtp, .vtu. Matrices: .dmat")
    ->type_name("")
    ->required();
  app
    .add_option("OUTPUT", this->output,
      "File to write, of the same kinds but for masks; of a mask the surface: .vtp, .vtk, .stl, "
      ".ply "
      "or .obj; with --form svpath a folder")
    ->type_name("")
    ->required();
  app
    .add_option("--form", this->form,
      "Form of a .vtp file: tree (one line a branch), vmtk (lines from a root to every tip), "
      "simvascular (one merged line, for its 0D and 1D simulations), slicer (as it is, in a file "
      "for 3D Slicer), or, of a .tgf file, skeleton (one line a bone); svpath: SimVascular's paths "
      "and contours in a folder. Default: of a .vtp file that is a tree vmtk, else a tree")
    ->check(CLI::IsMember(std::vector<std::string>(std::begin(Forms), std::end(Forms))))
    ->type_name("FORM");
  app
    .add_option(
      "--array", this->array, "Point array that is written to a .dmat file, a row a point")
    ->type_name("NAME")
    ->capture_default_str();
  app.add_flag("--binary", this->binary, "Write a .dmat file in its binary form");
  app
    .add_option("--radius", this->radius,
      "Radius for points that have none in the file (.tgf, .pth, .mrk.json), in mm")
    ->check(Within(0.0, 1e6))
    ->type_name("MM")
    ->capture_default_str();
  app
    .add_option("--tolerance", this->tolerance,
      "How far apart the ends of VMTK's branches, or of curves, may lie to be one point, in mm")
    ->check(Within(0.0, 1e6))
    ->type_name("MM")
    ->capture_default_str();
  app
    .add_option("--segment", this->segments,
      "Name or ID of a segment of a mask; may be repeated. Without any, all of them")
    ->allow_extra_args(false)
    ->type_name("NAME");
  app.add_flag("--join", this->join,
    "Make trees of lines over gaps and overlaps, and name the segments, as run does");
  app
    .add_option(
      "--simvascular-unit", this->unit, "Unit of SimVascular's files, in and out: mm or cm")
    ->check(CLI::IsMember({ "mm", "cm" }))
    ->type_name("UNIT")
    ->capture_default_str();
  app
    .add_option("--tree", this->treeId,
      "The tree to write, by its TreeIds (0 left, 1 right), where the form has room for one only")
    ->check(WholeWithin(0, 1000000))
    ->type_name("N");
}

/// With the name of the file that it is about.
void ThrowIfError(vtkMessageTrap& messages, const std::string& path)
{
  try
  {
    messages.ThrowIfError();
  }
  catch (const std::runtime_error& error)
  {
    throw std::runtime_error("'" + path + "': " + error.what());
  }
}

bool IsSimVascularFile(const std::string& path)
{
  return EndsWith(path, ".pth") || EndsWith(path, ".ctgr");
}

bool IsFolder(const std::string& path)
{
  std::error_code error;
  return std::filesystem::is_directory(path, error);
}

bool ConvertJob::IsMaskInput() const
{
  return IsVolumeFileName(this->input);
}

bool ConvertJob::IsLinesOutput() const
{
  return EndsWith(this->output, ".vtp") || EndsWith(this->output, ".tgf") ||
    IsMarkupsFileName(this->output);
}

void ConvertJob::CheckNames() const
{
  const bool fromTgf = EndsWith(this->input, ".tgf");
  const bool known = fromTgf || EndsWith(this->input, ".vtp") || IsMarkupsFileName(this->input) ||
    IsSimVascularFile(this->input) || IsFolder(this->input);
  if (!known)
  {
    throw UsageError(
      "INPUT must end in .vtp, .tgf, .mrk.json, .pth or .ctgr, '" + this->input + "' does not");
  }
  if (this->form == "svpath")
  {
    return;
  }
  if (!this->IsLinesOutput() && this->form != "slicer")
  {
    throw UsageError("OUTPUT must end in .vtp, .tgf or .mrk.json, '" + this->output + "' does not");
  }
  if (!EndsWith(this->output, ".vtp") && !this->form.empty() && this->form != "slicer")
  {
    throw UsageError("--form is for .vtp files, '" + this->output + "' has one form");
  }
  if (this->form == "skeleton" && !fromTgf)
  {
    throw UsageError("--form skeleton is for .tgf files: they have bones");
  }
}

vtkSmartPointer<vtkPolyData> ConvertJob::ReadSimVascular() const
{
  std::vector<std::string> files{ this->input };
  if (IsFolder(this->input))
  {
    files.clear();
    for (const auto& entry : std::filesystem::directory_iterator(this->input))
    {
      if (IsSimVascularFile(entry.path().string()))
      {
        files.push_back(entry.path().string());
      }
    }
    std::sort(files.begin(), files.end());
    // Contours know the radii: a path beside them adds nothing.
    const bool contours = std::any_of(
      files.begin(), files.end(), [](const std::string& file) { return EndsWith(file, ".ctgr"); });
    files.erase(std::remove_if(files.begin(), files.end(),
                  [&](const std::string& file) { return contours && EndsWith(file, ".pth"); }),
      files.end());
    if (files.empty())
    {
      throw std::runtime_error("'" + this->input + "' has neither .ctgr nor .pth files.");
    }
  }
  vtkNew<vtkAppendPolyData> all;
  for (const std::string& file : files)
  {
    const std::string text = ReadSimVascularFile(file);
    const std::string name = std::filesystem::path(file).stem().string();
    all->AddInputData(EndsWith(file, ".pth")
        ? LineOf(ParseSimVascularPath(text, file), name, this->radius, this->Unit())
        : LineOf(ParseSimVascularContours(text, file), this->Unit()));
  }
  all->SetOutputPointsPrecision(vtkAlgorithm::DOUBLE_PRECISION);
  all->Update();
  return all->GetOutput();
}

vtkSmartPointer<vtkPolyData> ConvertJob::Joined(vtkPolyData* lines, vtkMessageTrap& messages) const
{
  vtkNew<vtkCoronaryTreeTopology> topology;
  topology->SetInputData(lines);
  topology->Update();
  ThrowIfError(messages, this->input);
  return topology->GetOutput();
}

vtkSmartPointer<vtkPolyData> ConvertJob::Read(vtkMessageTrap& messages, bool& isTree) const
{
  isTree = false;
  if (EndsWith(this->input, ".tgf"))
  {
    vtkNew<vtkTGFReader> reader;
    reader->SetFileName(this->input.c_str());
    reader->SetRadius(this->radius);
    reader->SetOutputForm(
      this->form == "skeleton" ? vtkTGFReader::SkeletonForm : vtkTGFReader::TreeForm);
    reader->Update();
    ThrowIfError(messages, this->input);
    return reader->GetOutput();
  }
  if (IsMarkupsFileName(this->input))
  {
    const std::vector<Markup> markups = ReadMarkupsFile(this->input);
    return AreFiducials(markups) ? SeedsOf(markups) : LinesOf(markups, this->radius, this->input);
  }
  if (IsFolder(this->input) || IsSimVascularFile(this->input))
  {
    return this->ReadSimVascular();
  }
  auto lines = ReadPolyData(this->input, messages);
  if (vtkCoronary::FormOf(lines) == vtkCoronary::CenterlineForm::Unknown &&
    IsSimVascularCenterline(lines))
  {
    return FromSimVascular(lines, this->Unit());
  }
  isTree = vtkCoronary::FormOf(lines) == vtkCoronary::CenterlineForm::Tree;
  return lines;
}

vtkSmartPointer<vtkPolyData> ConvertJob::AsTree(vtkPolyData* lines, vtkMessageTrap& messages) const
{
  if (this->join)
  {
    return this->Joined(lines, messages);
  }
  if (vtkCoronary::FormOf(lines) != vtkCoronary::CenterlineForm::Unknown)
  {
    return lines;
  }
  const bool skeleton = EndsWith(this->input, ".tgf") || EndsWith(this->output, ".tgf");
  const bool asItIs =
    skeleton || (EndsWith(this->input, ".vtp") && IsMarkupsFileName(this->output));
  if (EndsWith(this->input, ".vtp") && !asItIs)
  {
    throw std::runtime_error("'" + this->input +
      "' is neither a tree (cell arrays GroupIds and ParentGroupIds), nor VMTK's branches "
      "(CenterlineIds, TractIds and GroupIds), nor SimVascular's centerlines (point arrays "
      "BranchId "
      "and BifurcationId): --join makes a tree of its lines.");
  }
  return asItIs ? vtkSmartPointer<vtkPolyData>(lines) : TreeOfLines(lines, this->tolerance);
}

vtkSmartPointer<vtkPolyData> ConvertJob::OneTree(vtkPolyData* tree) const
{
  if (this->treeId < 0)
  {
    return tree;
  }
  vtkDataArray* ids = tree->GetCellData()->GetArray(vtkCoronaryArrayNames::TreeIds);
  if (ids == nullptr)
  {
    throw std::runtime_error("'" + this->input + "' has no cell array 'TreeIds' for --tree.");
  }
  vtkNew<vtkPolyData> one;
  one->CopyStructure(tree);
  one->GetPointData()->PassData(tree->GetPointData());
  one->GetCellData()->CopyAllocate(tree->GetCellData());
  vtkNew<vtkCellArray> kept;
  vtkNew<vtkIdList> points;
  for (vtkIdType line = 0; line < tree->GetNumberOfLines(); ++line)
  {
    const vtkIdType cell = tree->GetNumberOfVerts() + line;
    if (ids->GetComponent(cell, 0) == this->treeId)
    {
      tree->GetLines()->GetCellAtId(line, points);
      one->GetCellData()->CopyData(tree->GetCellData(), cell, kept->InsertNextCell(points));
    }
  }
  if (kept->GetNumberOfCells() == 0)
  {
    throw std::runtime_error(
      "'" + this->input + "' has no tree " + std::to_string(this->treeId) + ".");
  }
  one->SetVerts(nullptr);
  one->SetLines(kept);
  return one;
}

void ConvertJob::WriteVessels(vtkPolyData* tree) const
{
  StagedFolder folder(this->output);
  std::size_t contours = 0;
  const std::vector<SimVascularVessel> vessels = VesselsOf(tree, this->Unit());
  for (const SimVascularVessel& vessel : vessels)
  {
    WriteFileAtomically(folder.Add(vessel.name + ".pth"), SimVascularPathText(vessel.path));
    WriteFileAtomically(folder.Add(vessel.name + ".ctgr"), SimVascularContourText(vessel.contours));
    contours += vessel.contours.contours.size();
  }
  folder.Commit();
  std::printf("%s: %zu paths, %zu contours\n", this->output.c_str(), vessels.size(), contours);
}

vtkSmartPointer<vtkPolyData> ConvertJob::Write(
  vtkPolyData* lines, bool wasTree, vtkMessageTrap& messages) const
{
  if (IsMarkupsFileName(this->output))
  {
    const bool points = lines->GetNumberOfLines() == 0;
    const std::string name = std::filesystem::path(this->output).stem().stem().string();
    WriteFileAtomically(
      this->output, MarkupsText(points ? FiducialsOf(lines, name) : CurvesOf(lines)));
    return lines;
  }
  if (EndsWith(this->output, ".tgf"))
  {
    vtkNew<vtkTGFWriter> writer;
    writer->SetInputData(lines);
    writer->SetFileName(this->output.c_str());
    writer->SetTolerance(this->tolerance);
    writer->Write();
    ThrowIfError(messages, this->input);
    return lines;
  }
  if (this->form == "skeleton" || lines->GetNumberOfLines() == 0)
  {
    WritePolyData(this->output, lines, messages);
    return lines;
  }
  vtkNew<vtkCenterlineConversion> conversion;
  conversion->SetInputData(lines);
  conversion->SetTolerance(this->tolerance);
  const bool tree = this->form.empty() ? this->join || !wasTree : this->form != "vmtk";
  conversion->SetOutputForm(
    tree ? vtkCenterlineConversion::TreeForm : vtkCenterlineConversion::VmtkForm);
  conversion->Update();
  ThrowIfError(messages, this->input);
  vtkSmartPointer<vtkPolyData> written = this->form == "simvascular"
    ? ToSimVascular(this->OneTree(conversion->GetOutput()), this->Unit())
    : vtkSmartPointer<vtkPolyData>(conversion->GetOutput());
  WritePolyData(this->output, written, messages);
  return written;
}

void ConvertJob::Run() const
{
  vtkMessageTrap messages;
  if (this->IsMaskInput() || (this->form == "slicer" && IsSurfaceFile(this->input)))
  {
    if (!IsSlicerModelFile(this->output))
    {
      throw UsageError(
        "OUTPUT must end in .vtp, .vtk, .stl, .ply or .obj, '" + this->output + "' does not");
    }
    // Lines are models, too.
    const vtkSmartPointer<vtkPolyData> model = this->IsMaskInput()
      ? ReadMaskSurface(this->input, this->segments)
      : EndsWith(this->input, ".vtp") ? ReadPolyData(this->input, messages)
                                      : ReadSurface(this->input, messages);
    WriteSlicerModel(this->output, model, messages);
    std::printf("%s: %lld triangles, %lld points\n", this->output.c_str(),
      static_cast<long long>(model->GetNumberOfPolys()),
      static_cast<long long>(model->GetNumberOfPoints()));
    return;
  }
  if (IsMeshConversion(this->input, this->output))
  {
    std::printf(
      "%s\n", ConvertMesh(this->input, this->output, this->array, this->binary, messages).c_str());
    return;
  }
  this->CheckNames();
  bool wasTree = false;
  vtkSmartPointer<vtkPolyData> lines = this->Read(messages, wasTree);
  const bool points = lines->GetNumberOfLines() == 0 && lines->GetNumberOfVerts() > 0 &&
    (IsMarkupsFileName(this->input) || IsMarkupsFileName(this->output));
  if (lines->GetNumberOfLines() == 0 && !points)
  {
    throw std::runtime_error("'" + this->input + "' has no lines.");
  }
  if (!points)
  {
    lines = this->AsTree(lines, messages);
  }
  if (this->form == "svpath")
  {
    this->WriteVessels(this->OneTree(lines));
    return;
  }
  lines = this->Write(lines, wasTree, messages);
  std::printf("%s: %lld lines, %lld points\n", this->output.c_str(),
    static_cast<long long>(lines->GetNumberOfLines()),
    static_cast<long long>(lines->GetNumberOfPoints()));
}
}

Command MakeConvertCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand("convert",
    "Convert centerlines between trees, VMTK, SimVascular, 3D Slicer and TGF; masks to surfaces; "
    "meshes and matrices");
  auto job = std::make_shared<ConvertJob>();
  job->Declare(*app);
  return { app, [job] { job->Run(); } };
}
}
