#include "FluoroscopyWidget.h"

#include "Numbers.h"

#include <QMouseEvent>
#include <QPainter>
#include <QWheelEvent>

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double WheelStep = 120.0; // eighths of a degree of a usual wheel's notch

QString TimeText(double seconds)
{
  const int whole = static_cast<int>(seconds);
  return QString("%1:%2").arg(whole / 60, 2, 10, QChar('0')).arg(whole % 60, 2, 10, QChar('0'));
}
}

QString SideText(double degrees, const QString& positive, const QString& negative)
{
  const int whole = static_cast<int>(std::lround(degrees));
  const QString size = QString::number(std::abs(whole));
  return whole == 0 ? size : (whole > 0 ? positive : negative) + " " + size;
}

FluoroscopyWidget::FluoroscopyWidget(QWidget* parent)
  : QWidget(parent)
{
  this->setMinimumSize(256, 256);
  this->setAttribute(Qt::WA_OpaquePaintEvent);
  this->setFocusPolicy(Qt::StrongFocus);
}

void FluoroscopyWidget::SetImage(const GreyImage& image)
{
  if (image.columns <= 0 || image.rows <= 0)
  {
    return;
  }
  this->Image =
    QImage(image.values.data(), image.columns, image.rows, image.columns, QImage::Format_Grayscale8)
      .copy();
  this->update();
}

void FluoroscopyWidget::SetState(const SessionSnapshot& now, double completeness, ImageMode mode)
{
  this->Now = now;
  this->Completeness = completeness;
  this->Mode = mode;
  this->update();
}

void FluoroscopyWidget::SetBanner(const QString& text)
{
  if (text != this->Banner)
  {
    this->Banner = text;
    this->update();
  }
}

void FluoroscopyWidget::SetRunText(const QString& text)
{
  this->RunText = text;
  this->update();
}

/// What a newcomer has not done yet: pedals first, for without radiation there is no image and no use of contrast medium.
QString FluoroscopyWidget::Hint() const
{
  const SessionMetrics& metrics = this->Now.metrics;
  if (!this->RunText.isEmpty())
  {
    return {};
  }
  if (metrics.frames == 0)
  {
    return "Hold F for fluoroscopy, C for a cine run\n"
           "Hold Space to inject contrast medium\n"
           "Arrow keys move and turn the wire";
  }
  return metrics.contrast <= 0.0 ? "Hold Space to inject contrast medium" : QString();
}

void FluoroscopyWidget::paintEvent(QPaintEvent*)
{
  QPainter painter(this);
  painter.fillRect(this->rect(), Qt::black);
  const int side = std::min(this->width(), this->height());
  const QRect place((this->width() - side) / 2, (this->height() - side) / 2, side, side);
  if (!this->Image.isNull())
  {
    painter.setRenderHint(QPainter::SmoothPixmapTransform);
    painter.drawImage(place, this->Image);
  }
  QFont font = painter.font();
  font.setPixelSize(std::clamp(side / 36, 11, 22));
  painter.setFont(font);
  const int line = painter.fontMetrics().height();
  const QRect inner = this->rect().adjusted(10, 8, -10, -8);
  const auto write = [&](int flags, int lines, const QString& text, const QColor& colour)
  {
    const int down = (flags & Qt::AlignBottom) != 0 ? -lines * line : lines * line;
    painter.setPen(QColor(0, 0, 0, 180));
    painter.drawText(inner.translated(1, down + 1), flags, text);
    painter.setPen(colour);
    painter.drawText(inner.translated(0, down), flags, text);
  };
  const QColor plain(225, 232, 235);
  const SessionMetrics& metrics = this->Now.metrics;
  write(Qt::AlignLeft | Qt::AlignTop, 0, QString::fromStdString(ViewName(this->Now.pose)), plain);
  write(Qt::AlignLeft | Qt::AlignTop, 1,
    QString("SID %1 mm   FOV %2 mm")
      .arg(this->Now.pose.sourceToDetector, 0, 'f', 0)
      .arg(this->Now.fieldOfView, 0, 'f', 0),
    plain);
  const char* const modes[] = { "", "DSA", "ROADMAP" };
  const bool cine = this->Now.radiating && this->Now.exposure.cine;
  write(Qt::AlignRight | Qt::AlignTop, 0,
    QString("%1  %2 f/s")
      .arg(modes[static_cast<int>(this->Mode)])
      .arg(this->Now.frameRate, 0, 'g', 3),
    plain);
  if (this->Now.radiating)
  {
    write(Qt::AlignRight | Qt::AlignTop, 1,
      cine ? QString::fromUtf8("\u25CF CINE") : QString::fromUtf8("\u25CF X-RAY"),
      cine ? QColor(255, 90, 70) : QColor(255, 200, 60));
  }
  else if (!this->RunText.isEmpty())
  {
    write(Qt::AlignRight | Qt::AlignTop, 1, this->RunText, QColor(130, 200, 255));
  }
  else if (metrics.frames > 0)
  {
    write(Qt::AlignRight | Qt::AlignTop, 1, "LAST IMAGE", plain);
  }
  write(Qt::AlignLeft | Qt::AlignBottom, 1,
    QString("Fluoro %1   %2 frames").arg(TimeText(metrics.fluoroscopySeconds)).arg(metrics.frames),
    plain);
  write(Qt::AlignLeft | Qt::AlignBottom, 0,
    QString("%1 mGy   %2 Gy cm%3")
      .arg(metrics.airKerma, 0, 'f', 1)
      .arg(metrics.doseAreaProduct, 0, 'f', 2)
      .arg(QChar(0x00B2)),
    plain);
  write(Qt::AlignRight | Qt::AlignBottom, 0,
    QString("Contrast %1 mL").arg(metrics.contrast, 0, 'f', 1),
    this->Now.injection > 0.0 ? QColor(255, 200, 60) : plain);
  if (this->Now.radiating && this->Completeness > 0.0 && this->Completeness < 1.0)
  {
    write(Qt::AlignRight | Qt::AlignBottom, 1,
      QString("Refining %1 %").arg(100.0 * this->Completeness, 0, 'f', 0), plain);
  }
  const QString hint = this->Hint();
  if (!hint.isEmpty())
  {
    const QRect low = place.adjusted(20, place.height() * 6 / 10, -20, -3 * line);
    painter.setPen(QColor(0, 0, 0, 180));
    painter.drawText(low.translated(1, 1), Qt::AlignHCenter | Qt::AlignBottom, hint);
    painter.setPen(QColor(150, 210, 255));
    painter.drawText(low, Qt::AlignHCenter | Qt::AlignBottom, hint);
  }
  if (!this->Banner.isEmpty())
  {
    font.setPixelSize(std::clamp(side / 24, 14, 30));
    font.setBold(true);
    painter.setFont(font);
    QRect box = painter.boundingRect(
      place.adjusted(20, 20, -20, -20), Qt::AlignCenter | Qt::TextWordWrap, this->Banner);
    painter.fillRect(box.adjusted(-14, -8, 14, 8), QColor(150, 25, 20, 215));
    painter.setPen(Qt::white);
    painter.drawText(box, Qt::AlignCenter | Qt::TextWordWrap, this->Banner);
  }
}

void FluoroscopyWidget::wheelEvent(QWheelEvent* event)
{
  // Shift makes some systems scroll sideways.
  const QPoint turned = event->angleDelta();
  const int amount = turned.y() != 0 ? turned.y() : turned.x();
  if (this->wheelTurned)
  {
    this->wheelTurned(amount / WheelStep, event->modifiers());
  }
  event->accept();
}

void FluoroscopyWidget::mousePressEvent(QMouseEvent* event)
{
  this->LastPlace = event->pos();
  this->setFocus();
}

void FluoroscopyWidget::mouseMoveEvent(QMouseEvent* event)
{
  if ((event->buttons() & (Qt::RightButton | Qt::MiddleButton)) != 0 && this->dragged)
  {
    this->dragged(event->pos() - this->LastPlace);
  }
  this->LastPlace = event->pos();
}
}
