#include "Command.h"

#include "OptionChecks.h"
#include "vtkDataFiles.h"
#include "vtkMeshConversion.h"
#include "vtkMessageTrap.h"

#include "vtkCenterlineConversion.h"
#include "vtkCenterlineForms.h"
#include "vtkNew.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkTGFReader.h"
#include "vtkTGFWriter.h"

#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>

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

  void Declare(CLI::App& app);
  void Run() const;
};

void ConvertJob::Declare(CLI::App& app)
{
  app
    .add_option("INPUT", this->input,
      "Centerlines: .vtp (a tree, VMTK's branches, or a skeleton) or .tgf. Meshes: .obj, .off, "
      ".mesh, .vtp, "
      ".vtu. "
      "Matrices: .dmat")
    ->type_name("")
    ->required();
  app.add_option("OUTPUT", this->output, "File to write, of the same kinds")
    ->type_name("")
    ->required();
  app
    .add_option("--form", this->form,
      "Form of a .vtp file: tree (one line a branch), vmtk (lines from a root to every tip), or, "
      "of a "
      ".tgf file, skeleton (one line a bone). Default: of a .vtp file the other one, of a .tgf "
      "file "
      "a tree")
    ->check(CLI::IsMember({ "tree", "vmtk", "skeleton" }))
    ->type_name("FORM");
  app
    .add_option(
      "--array", this->array, "Point array that is written to a .dmat file, a row a point")
    ->type_name("NAME")
    ->capture_default_str();
  app.add_flag("--binary", this->binary, "Write a .dmat file in its binary form");
  app.add_option("--radius", this->radius, "Radius for the points of a .tgf file, in mm")
    ->check(Within(0.0, 1e6))
    ->type_name("MM")
    ->capture_default_str();
  app
    .add_option("--tolerance", this->tolerance,
      "How far apart the ends of VMTK's branches may lie to be one point, in mm")
    ->check(Within(0.0, 1e6))
    ->type_name("MM")
    ->capture_default_str();
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

void ConvertJob::Run() const
{
  if (IsMeshConversion(this->input, this->output))
  {
    vtkMessageTrap messages;
    std::printf(
      "%s\n", ConvertMesh(this->input, this->output, this->array, this->binary, messages).c_str());
    return;
  }
  const bool fromTgf = EndsWith(this->input, ".tgf");
  const bool toTgf = EndsWith(this->output, ".tgf");
  if (!fromTgf && !EndsWith(this->input, ".vtp"))
  {
    throw UsageError("INPUT must end in .vtp or .tgf, '" + this->input + "' does not");
  }
  if (!toTgf && !EndsWith(this->output, ".vtp"))
  {
    throw UsageError("OUTPUT must end in .vtp or .tgf, '" + this->output + "' does not");
  }
  if (toTgf && !this->form.empty())
  {
    throw UsageError("--form is for .vtp files, a .tgf file has one form");
  }
  const bool bones = this->form == "skeleton";
  if (bones && !fromTgf)
  {
    throw UsageError("--form skeleton is for .tgf files: they have bones");
  }

  vtkMessageTrap messages;
  vtkSmartPointer<vtkPolyData> lines;
  if (fromTgf)
  {
    vtkNew<vtkTGFReader> reader;
    reader->SetFileName(this->input.c_str());
    reader->SetRadius(this->radius);
    reader->SetOutputForm(bones ? vtkTGFReader::SkeletonForm : vtkTGFReader::TreeForm);
    reader->Update();
    messages.ThrowIfError();
    lines = reader->GetOutput();
  }
  else
  {
    lines = ReadPolyData(this->input, messages);
  }
  if (lines->GetNumberOfLines() == 0)
  {
    throw std::runtime_error("'" + this->input + "' has no lines.");
  }
  if (toTgf)
  {
    vtkNew<vtkTGFWriter> writer;
    writer->SetInputData(lines);
    writer->SetFileName(this->output.c_str());
    writer->SetTolerance(this->tolerance);
    writer->Write();
    ThrowIfError(messages, this->input);
  }
  else if (bones)
  {
    WritePolyData(this->output, lines, messages);
  }
  else
  {
    vtkNew<vtkCenterlineConversion> conversion;
    conversion->SetInputData(lines);
    conversion->SetTolerance(this->tolerance);
    const bool wasTree = vtkCoronary::FormOf(lines) == vtkCoronary::CenterlineForm::Tree;
    const bool tree = this->form.empty() ? fromTgf || !wasTree : this->form == "tree";
    conversion->SetOutputForm(
      tree ? vtkCenterlineConversion::TreeForm : vtkCenterlineConversion::VmtkForm);
    conversion->Update();
    ThrowIfError(messages, this->input);
    lines = conversion->GetOutput();
    WritePolyData(this->output, lines, messages);
  }
  std::printf("%s: %lld lines, %lld points\n", this->output.c_str(),
    static_cast<long long>(lines->GetNumberOfLines()),
    static_cast<long long>(lines->GetNumberOfPoints()));
}
}

Command MakeConvertCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand("convert",
    "Convert centerlines between trees, VMTK's lines and TGF skeletons; meshes and matrices");
  auto job = std::make_shared<ConvertJob>();
  job->Declare(*app);
  return { app, [job] { job->Run(); } };
}
}
