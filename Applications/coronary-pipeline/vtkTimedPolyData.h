/**
 * @class vtkTimedPolyData
 * @brief A source of poly data that are known at several times.
 *
 * Answers for the last time that is not after the one that is asked for.
 */
#ifndef vtkTimedPolyData_h
#define vtkTimedPolyData_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSmartPointer.h"

#include <string>
#include <utility>
#include <vector>

class vtkMessageTrap;
class vtkPolyData;

class vtkTimedPolyData : public vtkPolyDataAlgorithm
{
public:
  static vtkTimedPolyData* New();
  vtkTypeMacro(vtkTimedPolyData, vtkPolyDataAlgorithm);

  /// Times have to increase.
  void Add(double time, vtkPolyData* data);

  const std::vector<double>& GetTimes() const { return this->Times; }

  /// Whether the data of the first time have a field array.
  bool Find(const char* fieldArray) const;

  /// Of a cycle (`CycleLength`); 1 where the data do not say.
  double CycleSeconds() const;

protected:
  vtkTimedPolyData();
  ~vtkTimedPolyData() override;

  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkTimedPolyData(const vtkTimedPolyData&) = delete;
  void operator=(const vtkTimedPolyData&) = delete;

  std::vector<double> Times;
  std::vector<vtkSmartPointer<vtkPolyData>> Steps;
};

namespace coronary
{
/**
 * Reads poses: one .series or .pvd file, or several .vtp files with their times.
 * @param times  of .vtp files, one each; none for a .series or .pvd file
 * @throws std::runtime_error naming the file; UsageError
 */
vtkSmartPointer<vtkTimedPolyData> ReadTimedPolyData(const std::vector<std::string>& paths,
  const std::vector<double>& times, vtkMessageTrap& messages);
}

#endif
