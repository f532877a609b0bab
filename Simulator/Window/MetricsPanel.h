/**
 * @file MetricsPanel.h
 * @brief What distinguishes trainees.
 */
#ifndef DynamicCoronary_MetricsPanel_h
#define DynamicCoronary_MetricsPanel_h

#include "TrainingSession.h"

#include <QLabel>

namespace coronary
{
class MetricsPanel : public QLabel
{
public:
  MetricsPanel();
  void ShowMetrics(const SessionMetrics& metrics, const WallTopology& topology);
};
}

#endif
