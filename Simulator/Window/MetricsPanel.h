/**
 * @file MetricsPanel.h
 * @brief What distinguishes trainees.
 */
#ifndef DynamicCoronary_MetricsPanel_h
#define DynamicCoronary_MetricsPanel_h

#include "TrainingSession.h"

#include <QLabel>

#include <string>

namespace coronary
{
class MetricsPanel : public QLabel
{
public:
  MetricsPanel();
  /// @param next  step of the procedure; may be empty
  void ShowMetrics(
    const SessionMetrics& metrics, const WallTopology& topology, const std::string& next);
};
}

#endif
