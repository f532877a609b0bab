/**
 * @file HeartPanel.h
 * @brief How fast the heart beats.
 */
#ifndef DynamicCoronary_HeartPanel_h
#define DynamicCoronary_HeartPanel_h

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

private:
  void SetText(double rate);

  QSlider* Rate = PanelSlider("");
  QCheckBox* Pause = CheckBox("Standing still");
  QLabel* Text = new QLabel;
};
}

#endif
