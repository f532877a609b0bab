#include "MetricsPanel.h"

#include "PanelWidgets.h"

#include <cmath>

namespace coronary
{
namespace
{
constexpr int Margin = 5;    // pixels
constexpr int MostLines = 8; // a step of two lines, and five or six of numbers
}

MetricsPanel::MetricsPanel()
{
  this->setTextFormat(Qt::PlainText);
  this->setWordWrap(true);
  this->setFixedWidth(400);
  this->setMargin(Margin);
  this->setMinimumHeight(MostLines * this->fontMetrics().lineSpacing() + 2 * Margin);
  this->setStyleSheet("background: rgb(8, 10, 12); color: rgb(225, 232, 235);");
  this->setToolTip("What distinguishes trainees");
}

void MetricsPanel::ShowMetrics(
  const SessionMetrics& metrics, const WallTopology& topology, const std::string& next)
{
  QString branches;
  QString last;
  for (const int branch : metrics.branches)
  {
    const QString name = BranchName(topology, branch);
    branches += name == last ? QString() : (branches.isEmpty() ? "" : ", ") + name;
    last = name;
  }
  const QString step = QString::fromStdString(next);
  const QString blood = metrics.pericardialBlood > 0.0
    ? QString("Pericardium  %1 mL, %2 mmHg    Stroke volume  %3 %\n")
        .arg(metrics.pericardialBlood, 0, 'f', 0)
        .arg(metrics.pericardialPressure, 0, 'f', 1)
        .arg(100.0 * metrics.strokeShare, 0, 'f', 0)
    : QString();
  this->setText((step.isEmpty() ? step : step + "\n") + blood +
    QString("Time  %1 s    Fluoroscopy  %2 s (cine %3 s)\nDose  %4 mGy, %5 Gy cm%6, %7 frames\n"
            "Contrast  %8 mL    Greatest wall force  %9 N\n")
      .arg(metrics.procedureSeconds, 0, 'f', 0)
      .arg(metrics.fluoroscopySeconds, 0, 'f', 1)
      .arg(metrics.cineSeconds, 0, 'f', 1)
      .arg(metrics.airKerma, 0, 'f', 1)
      .arg(metrics.doseAreaProduct, 0, 'f', 2)
      .arg(QChar(0x00B2))
      .arg(metrics.frames)
      .arg(metrics.contrast, 0, 'f', 1)
      .arg(metrics.maximumWallForce, 0, 'f', 2) +
    QString("Wire moved  %1 mm, turned %2, deepest %3 mm\nPath  %4")
      .arg(metrics.wireTravel, 0, 'f', 0)
      .arg(QString::number(metrics.wireTurning / (2.0 * M_PI), 'f', 1) + " turns")
      .arg(metrics.deepest, 0, 'f', 0)
      .arg(branches));
}
}
