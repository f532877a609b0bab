/**
 * @file InstrumentPanel.h
 * @brief Which wire and catheter the next session has, and what this one's do.
 */
#ifndef DynamicCoronary_InstrumentPanel_h
#define DynamicCoronary_InstrumentPanel_h

#include "PanelWidgets.h"
#include "Scenario.h"

#include <QGroupBox>
#include <QLabel>

namespace coronary
{
class InstrumentPanel : public QGroupBox
{
public:
  InstrumentPanel();
  void ShowScenario(const Scenario& scenario);
  void ShowReport(const TickReport& report, const WallTopology& topology);
  /// What is chosen, into the scenario of a new session.
  void Take(Scenario& scenario) const;

private:
  QComboBox* Wire = ChoiceBox();
  QComboBox* Catheter = ChoiceBox();
  QLabel* Text = new QLabel;
};
}

#endif
