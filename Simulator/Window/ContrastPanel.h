/**
 * @file ContrastPanel.h
 * @brief The syringe, and where its contrast medium is; saline, drugs, and what an instructor lets happen.
 */
#ifndef DynamicCoronary_ContrastPanel_h
#define DynamicCoronary_ContrastPanel_h

#include "PanelWidgets.h"
#include "Recording.h"
#include "Scenario.h"

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
  std::function<void(const RecordedEvent&)> chosen;
  void ShowScenario(const Scenario& scenario);
  void ShowBalance(const ContrastBalance& balance);

private:
  QDoubleSpinBox* Speed = NumberBox(0.5, 10.0, 0.5, 1, "mL/s", "How fast the button pushes");
  QPushButton* Flush = PanelButton("Flush", "5 mL of saline through the guide catheter");
  QPushButton* Draw = PanelButton("Draw back", "2 mL out of the guide catheter");
  QPushButton* Nitrates = PanelButton("Nitrates", "Relax a spasm");
  QComboBox* Events = ChoiceBox();
  QPushButton* Happens = PanelButton("Happens", "Lets the scenario's event happen now");
  QLabel* Text = new QLabel;
};
}

#endif
