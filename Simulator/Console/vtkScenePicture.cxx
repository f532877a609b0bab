#include "vtkScenePicture.h"

#include "vtkPictureCanvas.h"
#include "vtkSimulatorScene.h"

#include "vtkImageData.h"
#include "vtkRenderWindow.h"
#include "vtkRenderer.h"
#include "vtkWindowToImageFilter.h"

namespace coronary
{
vtkScenePicture::vtkScenePicture(const vtkSimulatorScene& scene, int width, int height)
{
  this->Window->SetOffScreenRendering(1);
  this->Window->SetSize(width, height);
  this->Window->AddRenderer(scene.Renderer());
}

vtkScenePicture::~vtkScenePicture() = default;

void vtkScenePicture::Write(const std::string& path)
{
  this->Window->Render();
  vtkNew<vtkWindowToImageFilter> grab;
  grab->SetInput(this->Window);
  grab->ReadFrontBufferOff();
  grab->Update();
  WritePngFile(grab->GetOutput(), path);
}
}
