#include "ViewPanel.h"

#include <QFormLayout>
#include <QHBoxLayout>
#include <QSignalBlocker>

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
struct StandardView
{
  const char* name;
  double primary; // degrees
  double secondary;
};

/// Views that coronary angiography is taught with.
constexpr StandardView StandardViews[] = { { "AP", 0.0, 0.0 }, { "RAO 30", -30.0, 0.0 },
  { "RAO 30 CRA 25", -30.0, 25.0 }, { "RAO 20 CAU 20", -20.0, -20.0 }, { "AP CRA 35", 0.0, 35.0 },
  { "AP CAU 30", 0.0, -30.0 }, { "LAO 40", 40.0, 0.0 }, { "LAO 40 CRA 25", 40.0, 25.0 },
  { "LAO 45 CAU 25 (spider)", 45.0, -25.0 }, { "LAO 90", 90.0, 0.0 } };
}

ViewPanel::ViewPanel()
  : QGroupBox("C-arm and table")
{
  QComboBox* views = ChoiceBox();
  views->addItem("Standard view ...");
  for (const StandardView& view : StandardViews)
  {
    views->addItem(view.name);
  }
  this->Distance->setSuffix(" mm");
  auto* form = new QFormLayout(this);
  form->addRow(views);
  form->addRow("LAO / RAO", this->Primary);
  form->addRow("CRA / CAU", this->Secondary);
  form->addRow("SID", this->Distance);
  auto* table = new QHBoxLayout;
  const char* const help[] = { "Towards the patient's left", "Backwards", "Towards the head" };
  const AxisKind kinds[] = { AxisKind::TableLeft, AxisKind::TableBack, AxisKind::TableHead };
  for (int axis = 0; axis < 3; ++axis)
  {
    this->Table[axis] = AxisBox(kinds[axis], 5.0, help[axis], "");
    table->addWidget(this->Table[axis]);
  }
  form->addRow("Table (mm)", table);
  for (QDoubleSpinBox* box : { this->Primary, this->Secondary, this->Distance, this->Table[0],
         this->Table[1], this->Table[2] })
  {
    QObject::connect(
      box, QOverload<double>::of(&QDoubleSpinBox::valueChanged), [this](double) { this->Place(); });
  }
  QObject::connect(views, QOverload<int>::of(&QComboBox::activated),
    [this, views](int index)
    {
      if (index > 0)
      {
        this->Primary->setValue(StandardViews[index - 1].primary);
        this->Secondary->setValue(StandardViews[index - 1].secondary);
        views->setCurrentIndex(0);
      }
    });
}

void ViewPanel::Place()
{
  if (this->placed)
  {
    this->placed({ this->Primary->value() * DegreeOfHands, this->Secondary->value() * DegreeOfHands,
      this->Distance->value(),
      Vector3(this->Table[0]->value(), this->Table[1]->value(), this->Table[2]->value()) });
  }
}

void ViewPanel::Turn(double primary, double secondary)
{
  const auto turn = [](QDoubleSpinBox& box, double& turned, double angle)
  {
    turned = std::clamp(turned + angle, box.minimum(), box.maximum());
    box.setValue(turned);
  };
  turn(*this->Primary, this->Turned[0], primary);
  turn(*this->Secondary, this->Turned[1], secondary);
}

void ViewPanel::Follow(const CArmPose& pose, const Vector3& table)
{
  const auto follow = [](QDoubleSpinBox* box, double value)
  {
    const QSignalBlocker silence(box);
    if (!box->hasFocus() && std::abs(box->value() - value) >= 0.5)
    {
      box->setValue(value);
    }
  };
  const double angles[] = { pose.primary / DegreeOfHands, pose.secondary / DegreeOfHands };
  follow(this->Primary, angles[0]);
  follow(this->Secondary, angles[1]);
  follow(this->Distance, pose.sourceToDetector);
  for (int axis = 0; axis < 3; ++axis)
  {
    follow(this->Table[axis], table[axis]);
  }
  for (int axis = 0; axis < 2; ++axis)
  {
    if (std::abs(this->Turned[axis] - angles[axis]) > 2.0)
    {
      this->Turned[axis] = angles[axis];
    }
  }
}
}
