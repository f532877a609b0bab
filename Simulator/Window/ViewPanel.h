/**
 * @file ViewPanel.h
 * @brief C-arm and table.
 */
#ifndef DynamicCoronary_ViewPanel_h
#define DynamicCoronary_ViewPanel_h

#include "CArm.h"
#include "DeviceMux.h"
#include "PanelWidgets.h"

#include <QGroupBox>

#include <functional>

namespace coronary
{
class ViewPanel : public QGroupBox
{
public:
  ViewPanel();

  std::function<void(const ViewPlace&)> placed; ///< by hand

  /// By so many degrees; whole ones are shown, parts of them add up.
  void Turn(double primary, double secondary);

  /// Shows what devices make of the view, but not while somebody types into it.
  void Follow(const CArmPose& pose, const Vector3& table);

private:
  void Place();

  QDoubleSpinBox* Primary = AxisBox(AxisKind::Primary, 5.0, "LAO", "RAO");
  QDoubleSpinBox* Secondary = AxisBox(AxisKind::Secondary, 5.0, "CRA", "CAU");
  QDoubleSpinBox* Distance = AxisBox(AxisKind::SourceToDetector, 10.0, "Source to detector", "");
  QDoubleSpinBox* Table[3];
  double Turned[2] = { 0.0, 0.0 }; ///< degrees that were asked for
};
}

#endif
