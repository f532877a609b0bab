/**
 * @file ContrastPanel.h
 * @brief The syringe, and where its contrast medium is.
 */
#ifndef DynamicCoronary_ContrastPanel_h
#define DynamicCoronary_ContrastPanel_h

#include "ContrastModel.h"
#include "PanelWidgets.h"

#include <QGroupBox>
#include <QLabel>

#include <functional>

namespace coronary
{
class ContrastPanel : public QGroupBox
{
public:
  ContrastPanel();
  std::function<void(double)> injects; ///< mL/s, 0 when the button is let go
  void ShowBalance(const ContrastBalance& balance);

private:
  QDoubleSpinBox* Speed = NumberBox(0.5, 10.0, 0.5, 1, "mL/s", "How fast the button pushes");
  QLabel* Text = new QLabel;
};
}

#endif
