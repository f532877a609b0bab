#include "PanelWidgets.h"

#include "FluoroscopyWidget.h"

#include <QRegularExpression>

#include <cmath>

namespace coronary
{
namespace
{
class AngleBox : public QDoubleSpinBox
{
public:
  AngleBox(const QString& positive, const QString& negative)
    : Positive(positive)
    , Negative(negative)
  {
  }

  QString textFromValue(double value) const override
  {
    return SideText(value, this->Positive, this->Negative) + QChar(0x00B0);
  }

  double valueFromText(const QString& text) const override
  {
    const QRegularExpressionMatch match = this->Pattern().match(text);
    const bool isNegative = match.captured(1).compare(this->Negative, Qt::CaseInsensitive) == 0;
    return (isNegative ? -1.0 : 1.0) * match.captured(2).toDouble();
  }

  QValidator::State validate(QString& text, int&) const override
  {
    const QRegularExpressionMatch match = this->Pattern().match(text);
    return match.hasMatch() && !match.captured(2).isEmpty() &&
        std::abs(this->valueFromText(text)) <= this->maximum()
      ? QValidator::Acceptable
      : QValidator::Intermediate;
  }

private:
  QRegularExpression Pattern() const
  {
    return QRegularExpression(
      "^\\s*(" + this->Positive + "|" + this->Negative + ")?\\s*(-?\\d*)\\s*\u00B0?\\s*$",
      QRegularExpression::CaseInsensitiveOption);
  }

  QString Positive;
  QString Negative;
};

/// Of a click, not of the tabulator.
QDoubleSpinBox* Prepared(
  QDoubleSpinBox* box, double low, double high, double step, int decimals, const QString& help)
{
  box->setRange(low, high);
  box->setSingleStep(step);
  box->setDecimals(decimals);
  box->setToolTip(help);
  box->setKeyboardTracking(false);
  box->setFocusPolicy(Qt::ClickFocus);
  return box;
}

template <typename Widget>
Widget* WithoutKeys(Widget* widget, const QString& help = {})
{
  widget->setToolTip(help);
  widget->setFocusPolicy(Qt::NoFocus);
  return widget;
}
}

QDoubleSpinBox* NumberBox(
  double low, double high, double step, int decimals, const QString& unit, const QString& help)
{
  QDoubleSpinBox* box = Prepared(new QDoubleSpinBox, low, high, step, decimals, help);
  box->setSuffix(unit.isEmpty() ? unit : " " + unit);
  return box;
}

QDoubleSpinBox* AxisBox(
  AxisKind kind, double step, const QString& positive, const QString& negative)
{
  const HandAxis& axis = *HandAxisOf(kind);
  if (axis.unit != AxisUnit::Radian)
  {
    return NumberBox(axis.low, axis.high, step, 0, "", positive);
  }
  return Prepared(new AngleBox(positive, negative), std::round(axis.low / DegreeOfHands),
    std::round(axis.high / DegreeOfHands), step, 0, positive + " or " + negative);
}

QPushButton* PanelButton(const QString& text, const QString& help)
{
  return WithoutKeys(new QPushButton(text), help);
}

QComboBox* ChoiceBox()
{
  return WithoutKeys(new QComboBox);
}

QCheckBox* CheckBox(const QString& text)
{
  return WithoutKeys(new QCheckBox(text));
}

QSlider* PanelSlider(const QString& help)
{
  return WithoutKeys(new QSlider(Qt::Horizontal), help);
}

void Choose(QComboBox& box, const QString& text, const QVariant& value)
{
  if (box.findText(text) < 0)
  {
    box.addItem(text, value);
  }
  box.setCurrentText(text);
}

QString Decimal(double value, int digits)
{
  const double unit = std::pow(10.0, digits);
  return QString::number(std::round(value * unit) / unit + 0.0, 'f', digits);
}

QString BranchName(const WallTopology& topology, int branch)
{
  const auto n = static_cast<std::size_t>(branch);
  const auto& names = topology.groupName;
  return branch < 0                         ? QString("catheter")
    : n < names.size() && !names[n].empty() ? QString::fromStdString(names[n])
                                            : QString::number(branch);
}
}
