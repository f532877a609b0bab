/**
 * @file coronaryQt.h
 * @brief The one place that knows how Qt 5 (ParaView 5.11) and Qt 6 (from 5.13 on) differ.
 */
#ifndef coronaryQt_h
#define coronaryQt_h

#include <QAction>
#include <QKeyEvent>
#include <QList>
#include <QMouseEvent>
#include <QWheelEvent>
#include <QWidget>

#include <memory>

namespace coronaryQt
{
/// Of a key, a wheel or the buttons of a mouse; null of anything else.
inline std::unique_ptr<QEvent> CopyOfInput(const QEvent& event)
{
  switch (event.type())
  {
#if QT_VERSION >= QT_VERSION_CHECK(6, 0, 0)
    case QEvent::MouseButtonPress:
    case QEvent::MouseButtonRelease:
    case QEvent::MouseButtonDblClick:
    case QEvent::KeyPress:
    case QEvent::KeyRelease:
    case QEvent::Wheel:
      return std::unique_ptr<QEvent>(event.clone());
#else
    case QEvent::MouseButtonPress:
    case QEvent::MouseButtonRelease:
    case QEvent::MouseButtonDblClick:
      return std::make_unique<QMouseEvent>(static_cast<const QMouseEvent&>(event));
    case QEvent::KeyPress:
    case QEvent::KeyRelease:
      return std::make_unique<QKeyEvent>(static_cast<const QKeyEvent&>(event));
    case QEvent::Wheel:
      return std::make_unique<QWheelEvent>(static_cast<const QWheelEvent&>(event));
#endif
    default:
      return nullptr;
  }
}

/// The menus and tool bars that an action stands in.
inline QList<QWidget*> WidgetsOf(const QAction& action)
{
#if QT_VERSION >= QT_VERSION_CHECK(6, 0, 0)
  QList<QWidget*> widgets;
  for (QObject* object : action.associatedObjects())
  {
    if (auto* widget = qobject_cast<QWidget*>(object))
    {
      widgets.push_back(widget);
    }
  }
  return widgets;
#else
  return action.associatedWidgets();
#endif
}
}

#endif
