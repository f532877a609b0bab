/**
 * @file HeartPanel.h
 * @brief How fast the heart beats, and whether the breath is held.
 */
#ifndef DynamicCoronary_HeartPanel_h
#define DynamicCoronary_HeartPanel_h

#include "Breathing.h"
#include "PanelWidgets.h"
#include "Recording.h"

#include <QGroupBox>
#include <QLabel>

#include <functional>

namespace coronary
{
class HeartPanel : public QGroupBox
{
public:
  HeartPanel();
  std::function<void(const RecordedEvent&)> chosen;
  /// @param rate  beats a minute; 0: it stands still
  void ShowRate(double rate);
  /// @param rate  breaths a minute; 0: held, from then on the last rate above 0 is breathed again
  void ShowBreaths(double rate);

private:
  void SetText(double rate);

  QSlider* Rate = PanelSlider("");
  QCheckBox* Pause = CheckBox("Standing still");
  QCheckBox* Hold = CheckBox("Breath held");
  double Breaths = BreathingSettings().rate;
  QLabel* Text = new QLabel;
};
}

#endif
