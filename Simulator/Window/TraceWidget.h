/**
 * @file TraceWidget.h
 * @brief The strip below: electrocardiogram and pressure in the aorta over the last seconds.
 */
#ifndef DynamicCoronary_TraceWidget_h
#define DynamicCoronary_TraceWidget_h

#include "TrainingSession.h"

#include <QWidget>

#include <deque>

namespace coronary
{
class TraceWidget : public QWidget
{
public:
  explicit TraceWidget(QWidget* parent = nullptr);

  /// A moment later than the last one; between them the phase went on evenly.
  void Add(const SessionSnapshot& snapshot);
  void Clear();

protected:
  void paintEvent(QPaintEvent* event) override;

private:
  /// Systolic over diastolic pressure of the last beat, as 120/80.
  QString PressureText() const;

  struct Sample
  {
    double seconds;
    double lead;     // mV
    double pressure; // mmHg
  };

  std::deque<Sample> Samples;
  double LastPhase = 0.0;
  double LastPressure = 0.0;
  double HeartRate = 0.0;
  double StShift = 0.0; // mV
  bool Empty = true;
};
}

#endif
