#include "vtkTGFReader.h"

#include "CenterlineConversion.h"
#include "vtkCenterlineForms.h"
#include "vtkCoronaryArrayNames.h"

#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <fstream>
#include <stdexcept>

vtkStandardNewMacro(vtkTGFReader);

vtkTGFReader::vtkTGFReader()
{
  this->SetNumberOfInputPorts(0);
}

vtkTGFReader::~vtkTGFReader()
{
  delete[] this->FileName;
}

int vtkTGFReader::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  outputs->GetInformationObject(0)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  return 1;
}

int vtkTGFReader::RequestData(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  vtkInformation* info = outputs->GetInformationObject(0);
  if (info->Get(vtkStreamingDemandDrivenPipeline::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  if (this->FileName == nullptr || *this->FileName == '\0')
  {
    vtkErrorMacro("FileName is not set");
    return 0;
  }
  try
  {
    std::ifstream file(this->FileName);
    if (!file)
    {
      throw std::invalid_argument("can not be opened");
    }
    const coronary::TgfSkeleton skeleton = coronary::ReadTgf(file);
    if (file.bad())
    {
      throw std::invalid_argument("can not be read to its end");
    }
    vtkCoronary::SetTree(vtkPolyData::GetData(outputs, 0),
      coronary::FromSkeleton(skeleton, this->Radius), vtkCoronaryArrayNames::Radius);
    return 1;
  }
  catch (const std::exception& error)
  {
    vtkErrorMacro(<< this->FileName << ": " << error.what());
  }
  return 0;
}

void vtkTGFReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << '\n';
  os << indent << "Radius: " << this->Radius << '\n';
}
