#include <DynamicCoronary/vtkCoronaryPhantomSource.h>

#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <cstdlib>
#include <iostream>

int main()
{
  const int port = vtkCoronaryPhantomSource::TreePort;
  vtkNew<vtkCoronaryPhantomSource> phantom;
  phantom->UpdateInformation();
  phantom->GetOutputInformation(port)->Set(
    vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(), 0.35);
  phantom->Update(port);

  auto* tree = vtkPolyData::SafeDownCast(phantom->GetOutputDataObject(port));
  const vtkIdType points = tree ? tree->GetNumberOfPoints() : 0;
  std::cout << "centerline points at 35 % of the cycle: " << points << '\n';
  return points > 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
