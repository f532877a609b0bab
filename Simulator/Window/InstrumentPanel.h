/**
 * @file InstrumentPanel.h
 * @brief Which wire, catheter and balloon the next session has, and what this one's do.
 */
#ifndef DynamicCoronary_InstrumentPanel_h
#define DynamicCoronary_InstrumentPanel_h

#include "PanelWidgets.h"
#include "TrainingSession.h"

#include <QGroupBox>
#include <QLabel>

namespace coronary
{
class InstrumentPanel : public QGroupBox
{
public:
  InstrumentPanel();
  void ShowScenario(const Scenario& scenario);
  void ShowMoment(const SessionSnapshot& moment, const WallTopology& topology);
  /// What is chosen, into the scenario of a new session.
  void Take(Scenario& scenario) const;

private:
  QComboBox* Wire = ChoiceBox();
  QComboBox* Catheter = ChoiceBox();
  QComboBox* Balloon = ChoiceBox();
  QLabel* Text = new QLabel;
};
}

#endif
