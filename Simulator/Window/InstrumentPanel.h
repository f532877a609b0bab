/**
 * @file InstrumentPanel.h
 * @brief Which wire, catheter and balloon the next session has, and what this one's do.
 */
#ifndef DynamicCoronary_InstrumentPanel_h
#define DynamicCoronary_InstrumentPanel_h

#include "PanelWidgets.h"
#include "TrainingSession.h"

#include <QCheckBox>
#include <QGroupBox>
#include <QLabel>

#include <functional>

namespace coronary
{
class InstrumentPanel : public QGroupBox
{
public:
  InstrumentPanel();
  std::function<void(const RecordedEvent&)>
    chosen; ///< another wire, another balloon, the other wire in hand
  /// @param aorta  whether there is one that a guide can come through
  void ShowScenario(const Scenario& scenario, bool aorta);
  void ShowMoment(const SessionSnapshot& moment, const WallTopology& topology);
  /// What is chosen, into the scenario of a new session.
  void Take(Scenario& scenario) const;

private:
  /// Takes the next of the scenario's instruments of a kind, after the last one the first.
  struct NextButton
  {
    QPushButton* button = PanelButton("Exchange", "");
    std::vector<std::string> names; ///< in the order in which they are taken
    std::size_t inUse = 0;

    std::size_t Next() const { return (this->inUse + 1) % this->names.size(); }
    void Show() const;
    void Use(std::size_t number);
  };

  void ShowHand(std::size_t hand);

  QComboBox* Wire = ChoiceBox();
  QComboBox* Catheter = ChoiceBox();
  QCheckBox* FromArch = new QCheckBox("from the arch");
  QComboBox* Balloon = ChoiceBox();
  NextButton NextWire;
  NextButton NextBalloon;
  QPushButton* OtherWire = PanelButton("", "The hand goes to it; this one is held where it is");
  std::size_t Hand = 0; ///< wire that it is on
  QLabel* Text = new QLabel;
};
}

#endif
