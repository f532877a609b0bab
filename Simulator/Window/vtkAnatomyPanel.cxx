#include "vtkAnatomyPanel.h"

#include "PanelWidgets.h"

#include <QGridLayout>

#include <utility>

namespace coronary
{
AnatomyPanel::AnatomyPanel(vtkSimulatorScene& scene, bool heart, std::function<CArmPose()> pose)
  : QGroupBox("Anatomy")
{
  QCheckBox* heartBox = CheckBox("Heart");
  QCheckBox* medium = CheckBox("Contrast");
  QSlider* opacity = PanelSlider("Opacity of the arteries");
  QPushButton* asCArm = PanelButton("As the C-arm", "Looks at the anatomy from the detector");
  QPushButton* front = PanelButton("Front", "Looks at all of it from the front");
  heartBox->setChecked(heart);
  heartBox->setEnabled(heart);
  medium->setChecked(true);
  opacity->setRange(0, 100);
  opacity->setValue(38);
  auto* grid = new QGridLayout(this);
  grid->addWidget(heartBox, 0, 0);
  grid->addWidget(medium, 0, 1);
  grid->addWidget(opacity, 1, 0, 1, 2);
  grid->addWidget(asCArm, 2, 0);
  grid->addWidget(front, 2, 1);
  QObject::connect(heartBox, &QCheckBox::toggled, [&scene](bool on) { scene.ShowHeart(on); });
  QObject::connect(medium, &QCheckBox::toggled, [&scene](bool on) { scene.ShowTracers(on); });
  QObject::connect(
    opacity, &QSlider::valueChanged, [&scene](int value) { scene.SetWallOpacity(0.01 * value); });
  QObject::connect(
    asCArm, &QPushButton::clicked, [&scene, pose = std::move(pose)] { scene.LookAsCArm(pose()); });
  QObject::connect(front, &QPushButton::clicked, [&scene] { scene.LookFromFront(); });
}
}
