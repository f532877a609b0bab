/**
 * @file TimedTestSource.h
 * @brief A source with time steps for tests; what it gives at a time is up to its classes.
 */
#ifndef DynamicCoronary_TimedTestSource_h
#define DynamicCoronary_TimedTestSource_h

#include "vtkDataObject.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPassInputTypeAlgorithm.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <vector>

class TimedTestSource : public vtkPassInputTypeAlgorithm
{
public:
  vtkTypeMacro(TimedTestSource, vtkPassInputTypeAlgorithm);

  std::vector<double> Steps; ///< empty: no time
  int Executions = 0;

protected:
  TimedTestSource() { this->SetNumberOfInputPorts(0); }

  virtual vtkSmartPointer<vtkDataObject> NewOutput() { return vtkSmartPointer<vtkPolyData>::New(); }

  /// @return whether it succeeded
  virtual bool Make(double time, vtkDataObject* output) = 0;

  int FillOutputPortInformation(int, vtkInformation* info) override
  {
    info->Set(vtkDataObject::DATA_TYPE_NAME(), "vtkDataObject");
    return 1;
  }

  int RequestDataObject(
    vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    outputs->GetInformationObject(0)->Set(vtkDataObject::DATA_OBJECT(), this->NewOutput());
    return 1;
  }

  int RequestInformation(
    vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    using SDDP = vtkStreamingDemandDrivenPipeline;
    vtkInformation* info = outputs->GetInformationObject(0);
    info->Remove(SDDP::TIME_STEPS());
    info->Remove(SDDP::TIME_RANGE());
    if (!this->Steps.empty())
    {
      info->Set(SDDP::TIME_STEPS(), this->Steps.data(), static_cast<int>(this->Steps.size()));
      const double range[2] = { this->Steps.front(), this->Steps.back() };
      info->Set(SDDP::TIME_RANGE(), range, 2);
    }
    info->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
    return 1;
  }

  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    using SDDP = vtkStreamingDemandDrivenPipeline;
    ++this->Executions;
    vtkInformation* info = outputs->GetInformationObject(0);
    const double time =
      info->Has(SDDP::UPDATE_TIME_STEP()) ? info->Get(SDDP::UPDATE_TIME_STEP()) : 0.0;
    vtkDataObject* output = vtkDataObject::GetData(info);
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), time);
    return this->Make(time, output) ? 1 : 0;
  }
};

#endif
