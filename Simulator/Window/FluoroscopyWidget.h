/**
 * @file FluoroscopyWidget.h
 * @brief The X-ray monitor: the image, and around it what a laboratory's monitor says.
 */
#ifndef DynamicCoronary_FluoroscopyWidget_h
#define DynamicCoronary_FluoroscopyWidget_h

#include "Detector.h"
#include "SessionEngine.h"

#include <QImage>
#include <QPoint>
#include <QString>
#include <QWidget>

#include <functional>

namespace coronary
{
/// "LAO 30", "RAO 30": whole degrees, by their side; 0 has none.
QString SideText(double degrees, const QString& positive, const QString& negative);

class FluoroscopyWidget : public QWidget
{
public:
  explicit FluoroscopyWidget(QWidget* parent = nullptr);

  void SetImage(const GreyImage& image);
  void SetState(const SessionSnapshot& now, double completeness, ImageMode mode);
  /// Big, over the image: what the trainee has to know. Empty: nothing.
  void SetBanner(const QString& text);
  void SetRunText(const QString& text); ///< while a cine run is looked at

  std::function<void(double steps, Qt::KeyboardModifiers)> wheelTurned;
  std::function<void(QPoint moved)> dragged; ///< with the right or middle button, pixels

protected:
  void paintEvent(QPaintEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;

private:
  QString Hint() const;

  QImage Image;
  SessionSnapshot Now;
  double Completeness = 1.0;
  ImageMode Mode = ImageMode::Plain;
  QString Banner;
  QString RunText;
  QPoint LastPlace;
};
}

#endif
