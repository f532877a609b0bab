/**
 * @file vtkAnatomyPanel.h
 * @brief How the anatomy is looked at.
 */
#ifndef vtkAnatomyPanel_h
#define vtkAnatomyPanel_h

#include "vtkSimulatorScene.h"

#include <QGroupBox>

#include <functional>

namespace coronary
{
class AnatomyPanel : public QGroupBox
{
public:
  /// @param scene  has to live longer  @param pose  of the C-arm, now
  AnatomyPanel(vtkSimulatorScene& scene, bool heart, std::function<CArmPose()> pose);
};
}

#endif
