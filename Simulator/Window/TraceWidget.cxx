#include "TraceWidget.h"

#include "Electrocardiogram.h"

#include <QPainter>
#include <QPolygonF>

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double Shown = 6.0;      // s
constexpr double Interval = 0.006; // s between samples: a QRS complex takes 0.08 s
constexpr double LowLead = -0.5;
constexpr double HighLead = 1.3;
constexpr double LowPressure = 40.0;
constexpr double HighPressure = 160.0;
}

TraceWidget::TraceWidget(QWidget* parent)
  : QWidget(parent)
{
  this->setFixedHeight(110);
  this->setAttribute(Qt::WA_OpaquePaintEvent);
}

void TraceWidget::Clear()
{
  this->Samples.clear();
  this->Empty = true;
  this->update();
}

void TraceWidget::Add(const SessionSnapshot& snapshot)
{
  const double phase = snapshot.report.phase;
  const double shift = snapshot.metrics.stShift;
  this->HeartRate = snapshot.heartRate;
  if (this->Empty || this->Samples.empty() || snapshot.seconds < this->Samples.back().seconds)
  {
    this->Samples.clear();
    this->Samples.push_back(
      { snapshot.seconds, ElectrocardiogramAt(phase, shift), snapshot.tipPressure });
  }
  else
  {
    const double from = this->Samples.back().seconds;
    double turned = phase - this->LastPhase - std::floor(phase - this->LastPhase);
    // Whole beats that nobody has drawn.
    turned +=
      std::max(0.0, std::round(this->HeartRate / 60.0 * (snapshot.seconds - from) - turned));
    const int steps = std::clamp(static_cast<int>((snapshot.seconds - from) / Interval), 1, 1000);
    for (int n = 1; n <= steps; ++n)
    {
      const double share = static_cast<double>(n) / steps;
      this->Samples.push_back({ from + share * (snapshot.seconds - from),
        ElectrocardiogramAt(this->LastPhase + share * turned, shift),
        this->LastPressure + share * (snapshot.tipPressure - this->LastPressure) });
    }
  }
  this->Empty = false;
  this->StShift = shift;
  this->LastPhase = phase;
  this->LastPressure = snapshot.tipPressure;
  while (this->Samples.front().seconds < snapshot.seconds - Shown)
  {
    this->Samples.pop_front();
  }
  this->update();
}

QString TraceWidget::PressureText() const
{
  const double now = this->Samples.back().pressure;
  double highest = now;
  double lowest = now;
  const double from =
    this->Samples.back().seconds - (this->HeartRate > 0.0 ? 60.0 / this->HeartRate : 0.0);
  for (const Sample& sample : this->Samples)
  {
    if (sample.seconds >= from)
    {
      highest = std::max(highest, sample.pressure);
      lowest = std::min(lowest, sample.pressure);
    }
  }
  // Before the first beat is over, and while the heart stands, there are no two pressures.
  const bool isBeat = this->HeartRate > 0.0 && this->Samples.front().seconds <= from;
  return (isBeat ? QString("%1/%2 mmHg").arg(highest, 0, 'f', 0).arg(lowest, 0, 'f', 0)
                 : QString("%1 mmHg").arg(now, 0, 'f', 0));
}

void TraceWidget::paintEvent(QPaintEvent*)
{
  QPainter painter(this);
  painter.fillRect(this->rect(), QColor(8, 10, 12));
  painter.setPen(QColor(150, 160, 165));
  const QRect writing = this->rect().adjusted(8, 4, -8, -4);
  painter.drawText(writing, Qt::AlignLeft | Qt::AlignTop, "ECG");
  painter.drawText(writing, Qt::AlignLeft | Qt::AlignBottom, "Ao");
  painter.setPen(QColor(90, 230, 120));
  QFont font = painter.font();
  font.setPixelSize(22);
  font.setBold(true);
  painter.setFont(font);
  painter.drawText(writing, Qt::AlignRight | Qt::AlignTop,
    this->HeartRate > 0.0 ? QString("%1 /min").arg(this->HeartRate, 0, 'f', 0) : QString("pause"));
  if (this->StShift >= Ischaemia::Elevated)
  {
    painter.setPen(QColor(255, 200, 60));
    painter.drawText(writing, Qt::AlignRight | Qt::AlignVCenter,
      QString("ST +%1 mV").arg(this->StShift, 0, 'f', 1));
  }
  painter.setPen(QColor(240, 90, 80));
  if (!this->Samples.empty())
  {
    painter.drawText(writing, Qt::AlignRight | Qt::AlignBottom, this->PressureText());
  }
  if (this->Samples.size() < 2)
  {
    return;
  }
  painter.setRenderHint(QPainter::Antialiasing);
  const double end = this->Samples.back().seconds;
  const double width = this->width() - 220.0;
  const double half = 0.5 * this->height();
  QPolygonF lead;
  QPolygonF pressure;
  for (const Sample& sample : this->Samples)
  {
    const double x = 40.0 + width * (1.0 - (end - sample.seconds) / Shown);
    lead << QPointF(x, half - 4.0 - (half - 8.0) * (sample.lead - LowLead) / (HighLead - LowLead));
    pressure << QPointF(x,
      2.0 * half - 4.0 -
        (half - 8.0) *
          std::clamp((sample.pressure - LowPressure) / (HighPressure - LowPressure), 0.0, 1.0));
  }
  painter.setPen(QPen(QColor(90, 230, 120), 1.5));
  painter.drawPolyline(lead);
  painter.setPen(QPen(QColor(240, 90, 80), 1.5));
  painter.drawPolyline(pressure);
}
}
