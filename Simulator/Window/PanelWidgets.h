/**
 * @file PanelWidgets.h
 * @brief What the panels are made of. Keys drive the wire: so nothing here takes them but what is typed into.
 */
#ifndef DynamicCoronary_PanelWidgets_h
#define DynamicCoronary_PanelWidgets_h

#include "HandAxes.h"
#include "WallMotion.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QPushButton>
#include <QSlider>
#include <QString>

namespace coronary
{
QDoubleSpinBox* NumberBox(
  double low, double high, double step, int decimals, const QString& unit, const QString& help);

/// In mm or, of an axis that turns, in degrees: an angle of the C-arm is named by its side and has no sign, "RAO 25". A
/// number alone, with a sign, can be typed.
/// @param positive, negative  the sides; of a length: its help, and nothing
QDoubleSpinBox* AxisBox(
  AxisKind kind, double step, const QString& positive, const QString& negative);

QPushButton* PanelButton(const QString& text, const QString& help);
QComboBox* ChoiceBox();
QCheckBox* CheckBox(const QString& text);
QSlider* PanelSlider(const QString& help);

/// Chooses a text, which is added with its value when it is not there.
void Choose(QComboBox& box, const QString& text, const QVariant& value);

/// Without a minus before what is rounded to nothing.
QString Decimal(double value, int digits);

/// For people. @param branch  negative: in the catheter
QString BranchName(const WallTopology& topology, int branch);
}

#endif
