#include "vtkTGFWriter.h"

#include "AtomicFile.h"
#include "CenterlineConversion.h"
#include "vtkCenterlineForms.h"

#include "vtkInformation.h"
#include "vtkObjectFactory.h"
#include "vtkPolyData.h"

#include <sstream>
#include <stdexcept>

vtkStandardNewMacro(vtkTGFWriter);

vtkTGFWriter::~vtkTGFWriter()
{
  delete[] this->FileName;
}

int vtkTGFWriter::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  return 1;
}

int vtkTGFWriter::Write()
{
  this->Written = false;
  return this->Superclass::Write() && this->Written ? 1 : 0;
}

void vtkTGFWriter::WriteData()
{
  try
  {
    auto* input = vtkPolyData::SafeDownCast(this->GetInput());
    if (this->FileName == nullptr || *this->FileName == '\0')
    {
      throw std::invalid_argument("FileName is not set");
    }
    if (input == nullptr || input->GetNumberOfLines() == 0)
    {
      throw std::invalid_argument("There are no lines to write to " + std::string(this->FileName));
    }
    coronary::CenterlineTree tree;
    switch (vtkCoronary::FormOf(input))
    {
      case vtkCoronary::CenterlineForm::Tree:
        tree = vtkCoronary::TreeOf(input, "");
        break;
      case vtkCoronary::CenterlineForm::Vmtk:
        tree = coronary::FromVmtkTracts(vtkCoronary::TractsOf(input, ""), this->Tolerance);
        break;
      case vtkCoronary::CenterlineForm::Unknown:
        throw std::invalid_argument(
          "The lines are neither a tree (cell arrays GroupIds and ParentGroupIds) nor VMTK's "
          "branches (CenterlineIds, TractIds and GroupIds): make a tree of them with "
          "vtkCoronaryTreeTopology");
    }
    std::ostringstream text;
    coronary::WriteTgf(text, coronary::ToSkeleton(tree));
    coronary::WriteFileAtomically(this->FileName, text.str());
    this->Written = true;
  }
  catch (const std::exception& error)
  {
    vtkErrorMacro(<< error.what());
  }
}

void vtkTGFWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << '\n';
  os << indent << "Tolerance: " << this->Tolerance << '\n';
}
