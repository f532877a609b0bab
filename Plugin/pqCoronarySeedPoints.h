/**
 * @class pqCoronarySeedPoints
 * @brief A list of points that are picked in the view: the seeds of a filter.
 *
 * Every point is a row of the table and a handle in the view. **P** puts the chosen point where the mouse points, on
 * whatever is drawn there: a slice of an image as well as a surface. A point that is not chosen yet is added. Handles are
 * dragged; numbers can be typed.
 */
#ifndef pqCoronarySeedPoints_h
#define pqCoronarySeedPoints_h

#include "pqPropertyWidget.h"

#include "vtkSmartPointer.h"

#include <QList>
#include <QVariant>

#include <array>
#include <vector>

class pqRenderView;
class QCheckBox;
class QPushButton;
class QTableWidget;
class vtkObject;
class vtkSMNewWidgetRepresentationProxy;

class pqCoronarySeedPoints : public pqPropertyWidget
{
  Q_OBJECT
  Q_PROPERTY(QList<QVariant> points READ points WRITE setPoints NOTIFY pointsChanged)
  typedef pqPropertyWidget Superclass;

public:
  pqCoronarySeedPoints(vtkSMProxy* proxy, vtkSMProperty* property, QWidget* parent = nullptr);
  ~pqCoronarySeedPoints() override;

  ///@{
  /// Coordinates in mm, three a point.
  QList<QVariant> points() const;
  void setPoints(const QList<QVariant>& points);
  ///@}

  ///@{
  /// The handles are shown while the filter is the chosen one.
  void select() override;
  void deselect() override;
  void setView(pqView* view) override;
  void showEvent(QShowEvent* event) override;
  void hideEvent(QHideEvent* event) override;
  ///@}

Q_SIGNALS:
  void pointsChanged();
  /// ParaView's shortcuts listen to the handles under this name.
  void widgetVisibilityUpdated(bool visible);

private Q_SLOTS:
  void addPoint();
  void removePoint();
  void pickPoint();
  void cellEdited(int row, int column);
  void updateHandles();

private:
  Q_DISABLE_COPY(pqCoronarySeedPoints);

  using Point = std::array<double, 3>;
  struct Handle
  {
    vtkSmartPointer<vtkSMNewWidgetRepresentationProxy> proxy;
    unsigned long moved = 0;
    unsigned long released = 0;
  };

  pqRenderView* renderView() const;
  int chosen() const;
  void choose(int row);
  /// Into the table and the handles, and into the property unless it was what changed.
  void changePoints(std::vector<Point> points);
  void fillTable();
  void makeHandles();
  void showHandle(const Handle& handle, bool visible);
  void dropHandle(const Handle& handle);
  void handleMoved(vtkObject* caller, unsigned long event, void* data);

  std::vector<Point> Points;
  std::vector<Handle> Handles;
  QTableWidget* Table = nullptr;
  QPushButton* RemoveButton = nullptr;
  QCheckBox* ShowHandles = nullptr;
};

#endif
