#include "pqCoronarySeedPoints.h"

#include "pqKeySequences.h"
#include "pqModalShortcut.h"
#include "pqRenderView.h"
#include "pqShortcutDecorator.h"

#include "vtkCommand.h"
#include "vtkNew.h"
#include "vtkRenderWindowInteractor.h"
#include "vtkRenderer.h"
#include "vtkSMNewWidgetRepresentationProxy.h"
#include "vtkSMParaViewPipelineController.h"
#include "vtkSMProperty.h"
#include "vtkSMPropertyHelper.h"
#include "vtkSMRenderViewProxy.h"
#include "vtkSMSessionProxyManager.h"
#include "vtkWorldPointPicker.h"

#include <QCheckBox>
#include <QCursor>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QPushButton>
#include <QSignalBlocker>
#include <QTableWidget>
#include <QVBoxLayout>

#include <algorithm>
#include <cmath>

pqCoronarySeedPoints::pqCoronarySeedPoints(
  vtkSMProxy* smProxy, vtkSMProperty* smProperty, QWidget* parentWidget)
  : Superclass(smProxy, parentWidget)
{
  this->Table = new QTableWidget(0, 3, this);
  this->Table->setObjectName("Points");
  this->Table->setHorizontalHeaderLabels({ tr("X (mm)"), tr("Y (mm)"), tr("Z (mm)") });
  this->Table->horizontalHeader()->setSectionResizeMode(QHeaderView::Stretch);
  this->Table->horizontalHeader()->setMinimumSectionSize(20);
  this->Table->setMinimumWidth(100);
  this->Table->setSelectionBehavior(QAbstractItemView::SelectRows);
  this->Table->setSelectionMode(QAbstractItemView::SingleSelection);
  this->Table->setMaximumHeight(120);
  auto* add = new QPushButton(tr("Add"), this);
  add->setObjectName("Add");
  add->setToolTip(tr("Adds a point in the middle of the view."));
  this->RemoveButton = new QPushButton(tr("Remove"), this);
  this->RemoveButton->setObjectName("Remove");
  this->RemoveButton->setToolTip(tr("Removes the chosen point."));
  this->ShowHandles = new QCheckBox(tr("Handles"), this);
  this->ShowHandles->setObjectName("ShowHandles");
  this->ShowHandles->setChecked(true);
  this->ShowHandles->setToolTip(
    tr("Shows the points in the view, where they can be dragged. P puts the "
       "chosen one where the mouse points, or adds one."));
  auto* buttons = new QHBoxLayout;
  buttons->addWidget(add);
  buttons->addWidget(this->RemoveButton);
  buttons->addWidget(this->ShowHandles);
  auto* rows = new QVBoxLayout(this);
  rows->setContentsMargins(0, 0, 0, 0);
  // Above the table, which needs the width of the panel for its three columns.
  this->setShowLabel(false);
  rows->addWidget(new QLabel(smProperty->GetXMLLabel(), this));
  rows->addWidget(this->Table);
  rows->addLayout(buttons);

  auto* decorator = new pqShortcutDecorator(this);
  pqModalShortcut* shortcut =
    pqKeySequences::instance().addModalShortcut(QKeySequence("P"), nullptr, this);
  decorator->addShortcut(shortcut);
  this->connect(shortcut, SIGNAL(activated()), SLOT(pickPoint()));
  QObject::connect(this, &pqPropertyWidget::viewChanged, shortcut,
    [shortcut](pqView* shown)
    {
      if (auto* render = qobject_cast<pqRenderView*>(shown))
      {
        // Wherever in the window the focus is: nobody has to click into the view before the first pick. Fields that
        // are typed in take their letters first.
        shortcut->setContextWidget(render->widget(), Qt::WindowShortcut);
      }
    });

  this->connect(add, SIGNAL(clicked()), SLOT(addPoint()));
  this->connect(this->RemoveButton, SIGNAL(clicked()), SLOT(removePoint()));
  this->connect(this->ShowHandles, SIGNAL(toggled(bool)), SLOT(updateHandles()));
  this->connect(this->Table, SIGNAL(cellChanged(int, int)), SLOT(cellEdited(int, int)));
  this->connect(this->Table, &QTableWidget::itemSelectionChanged,
    [this] { this->RemoveButton->setEnabled(this->chosen() >= 0); });
  this->RemoveButton->setEnabled(false);
  this->setProperty(smProperty);
  // While a handle is dragged the change is not finished: nothing is applied automatically.
  this->setChangeAvailableAsChangeFinished(false);
  this->addPropertyLink(this, "points", SIGNAL(pointsChanged()), smProperty);
}

pqCoronarySeedPoints::~pqCoronarySeedPoints()
{
  for (const Handle& handle : this->Handles)
  {
    this->dropHandle(handle);
  }
}

QList<QVariant> pqCoronarySeedPoints::points() const
{
  QList<QVariant> values;
  for (const Point& point : this->Points)
  {
    for (const double coordinate : point)
    {
      values.push_back(coordinate);
    }
  }
  return values;
}

void pqCoronarySeedPoints::setPoints(const QList<QVariant>& values)
{
  std::vector<Point> points;
  for (int n = 0; n + 2 < values.size(); n += 3)
  {
    points.push_back({ values[n].toDouble(), values[n + 1].toDouble(), values[n + 2].toDouble() });
  }
  this->changePoints(std::move(points));
}

void pqCoronarySeedPoints::changePoints(std::vector<Point> points)
{
  if (points != this->Points)
  {
    this->Points = std::move(points);
    this->fillTable();
    this->makeHandles();
    Q_EMIT this->pointsChanged();
  }
}

void pqCoronarySeedPoints::fillTable()
{
  const QSignalBlocker blocker(this->Table);
  this->Table->setRowCount(static_cast<int>(this->Points.size()));
  for (int row = 0; row < this->Table->rowCount(); ++row)
  {
    for (int column = 0; column < 3; ++column)
    {
      auto* item = this->Table->item(row, column);
      if (!item)
      {
        item = new QTableWidgetItem;
        this->Table->setItem(row, column, item);
      }
      // Hundredths of a millimetre: all three fit into a narrow panel.
      item->setText(QString::number(this->Points[row][column], 'f', 2));
      item->setToolTip(QString::number(this->Points[row][column], 'g', 9));
    }
  }
  this->RemoveButton->setEnabled(this->chosen() >= 0);
}

void pqCoronarySeedPoints::cellEdited(int row, int column)
{
  bool isNumber = false;
  const double value = this->Table->item(row, column)->text().toDouble(&isNumber);
  if (!isNumber || !std::isfinite(value))
  {
    this->fillTable();
    return;
  }
  std::vector<Point> points = this->Points;
  points[row][column] = value;
  this->changePoints(std::move(points));
  Q_EMIT this->changeFinished();
}

int pqCoronarySeedPoints::chosen() const
{
  const QModelIndexList rows = this->Table->selectionModel()->selectedRows();
  return rows.isEmpty() ? -1 : rows.first().row();
}

void pqCoronarySeedPoints::choose(int row)
{
  this->Table->selectRow(row);
}

void pqCoronarySeedPoints::addPoint()
{
  Point point{ 0.0, 0.0, 0.0 };
  if (pqRenderView* shown = this->renderView())
  {
    vtkSMPropertyHelper(shown->getProxy(), "CameraFocalPoint").Get(point.data(), 3);
  }
  std::vector<Point> points = this->Points;
  points.push_back(point);
  this->changePoints(points);
  this->choose(static_cast<int>(points.size()) - 1);
  Q_EMIT this->changeFinished();
}

void pqCoronarySeedPoints::removePoint()
{
  const int row = this->chosen();
  if (row < 0)
  {
    return;
  }
  std::vector<Point> points = this->Points;
  points.erase(points.begin() + row);
  this->changePoints(points);
  if (!points.empty())
  {
    this->choose(std::min(row, static_cast<int>(points.size()) - 1));
  }
  Q_EMIT this->changeFinished();
}

void pqCoronarySeedPoints::pickPoint()
{
  pqRenderView* shown = this->renderView();
  if (!shown || !this->isSelected() ||
    !shown->widget()->rect().contains(shown->widget()->mapFromGlobal(QCursor::pos())))
  {
    return;
  }
  vtkSMRenderViewProxy* view = shown->getRenderViewProxy();
  const int* place = view->GetInteractor()->GetEventPosition();
  // What is seen there: ParaView's selection, which a server's picture needs, does not know slices.
  Point point;
  double normal[3];
  if (view->GetRenderer()->GetZ(place[0], place[1]) < 1.0)
  {
    vtkNew<vtkWorldPointPicker> picker;
    picker->Pick(place[0], place[1], 0.0, view->GetRenderer());
    picker->GetPickPosition(point.data());
  }
  else if (!view->ConvertDisplayToPointOnSurface(place, point.data(), normal, false))
  {
    return;
  }
  std::vector<Point> points = this->Points;
  int row = this->chosen();
  if (row < 0)
  {
    row = static_cast<int>(points.size());
    points.push_back(point);
  }
  points[row] = point;
  this->changePoints(std::move(points));
  this->choose(row);
  Q_EMIT this->changeFinished();
}

void pqCoronarySeedPoints::select()
{
  this->Superclass::select();
  this->updateHandles();
}

void pqCoronarySeedPoints::deselect()
{
  this->Superclass::deselect();
  this->updateHandles();
}

void pqCoronarySeedPoints::showEvent(QShowEvent* event)
{
  this->Superclass::showEvent(event);
  this->updateHandles();
}

void pqCoronarySeedPoints::hideEvent(QHideEvent* event)
{
  this->Superclass::hideEvent(event);
  this->updateHandles();
}

pqRenderView* pqCoronarySeedPoints::renderView() const
{
  return qobject_cast<pqRenderView*>(this->view());
}

void pqCoronarySeedPoints::setView(pqView* shown)
{
  auto* render = qobject_cast<pqRenderView*>(shown);
  if (render && render->getProxy()->GetSession() != this->proxy()->GetSession())
  {
    render = nullptr;
  }
  if (render == this->view())
  {
    return;
  }
  for (const Handle& handle : this->Handles)
  {
    this->dropHandle(handle);
  }
  this->Handles.clear();
  this->Superclass::setView(render);
  this->makeHandles();
}

void pqCoronarySeedPoints::makeHandles()
{
  pqRenderView* shown = this->renderView();
  const std::size_t wanted = shown ? this->Points.size() : 0;
  for (; this->Handles.size() > wanted; this->Handles.pop_back())
  {
    this->dropHandle(this->Handles.back());
  }
  vtkSMSessionProxyManager* manager = this->proxy()->GetSessionProxyManager();
  while (this->Handles.size() < wanted)
  {
    Handle handle;
    handle.proxy.TakeReference(vtkSMNewWidgetRepresentationProxy::SafeDownCast(
      manager->NewProxy("representations", "HandleWidgetRepresentation")));
    vtkNew<vtkSMParaViewPipelineController> controller;
    controller->InitializeProxy(handle.proxy);
    handle.proxy->UpdateVTKObjects();
    // Undo is of the property, not of what shows it.
    handle.proxy->PrototypeOn();
    handle.moved = handle.proxy->AddObserver(
      vtkCommand::InteractionEvent, this, &pqCoronarySeedPoints::handleMoved);
    handle.released = handle.proxy->AddObserver(
      vtkCommand::EndInteractionEvent, this, &pqCoronarySeedPoints::handleMoved);
    vtkSMPropertyHelper(shown->getProxy(), "HiddenRepresentations").Add(handle.proxy);
    shown->getProxy()->UpdateVTKObjects();
    this->Handles.push_back(handle);
  }
  for (std::size_t n = 0; n < this->Handles.size(); ++n)
  {
    vtkSMPropertyHelper(this->Handles[n].proxy, "WorldPosition").Set(this->Points[n].data(), 3);
    this->Handles[n].proxy->UpdateVTKObjects();
  }
  this->updateHandles();
}

void pqCoronarySeedPoints::dropHandle(const Handle& handle)
{
  handle.proxy->RemoveObserver(handle.moved);
  handle.proxy->RemoveObserver(handle.released);
  this->showHandle(handle, false);
  if (pqRenderView* shown = this->renderView())
  {
    vtkSMPropertyHelper(shown->getProxy(), "HiddenRepresentations").Remove(handle.proxy);
    shown->getProxy()->UpdateVTKObjects();
  }
}

void pqCoronarySeedPoints::showHandle(const Handle& handle, bool visible)
{
  vtkSMPropertyHelper(handle.proxy, "Visibility").Set(visible);
  vtkSMPropertyHelper(handle.proxy, "Enabled").Set(visible);
  handle.proxy->UpdateVTKObjects();
}

void pqCoronarySeedPoints::updateHandles()
{
  const bool visible = this->isSelected() && this->isVisible() && this->ShowHandles->isChecked();
  for (const Handle& handle : this->Handles)
  {
    this->showHandle(handle, visible);
  }
  Q_EMIT this->widgetVisibilityUpdated(visible);
  if (pqRenderView* shown = this->renderView())
  {
    shown->render();
  }
}

void pqCoronarySeedPoints::handleMoved(vtkObject* caller, unsigned long event, void*)
{
  for (std::size_t n = 0; n < this->Handles.size(); ++n)
  {
    if (this->Handles[n].proxy == caller)
    {
      this->Handles[n].proxy->UpdatePropertyInformation();
      std::vector<Point> points = this->Points;
      vtkSMPropertyHelper(this->Handles[n].proxy, "WorldPositionInfo").Get(points[n].data(), 3);
      this->changePoints(std::move(points));
      this->choose(static_cast<int>(n));
    }
  }
  if (event == vtkCommand::EndInteractionEvent)
  {
    Q_EMIT this->changeFinished();
  }
}
