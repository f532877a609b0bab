#include "pqCoronaryJointHandle.h"

#include "pqUndoStack.h"

#include "vtkCommand.h"
#include "vtkSMNewWidgetRepresentationProxy.h"
#include "vtkSMProperty.h"
#include "vtkSMPropertyHelper.h"
#include "vtkSMProxy.h"
#include "vtkSMSourceProxy.h"
#include "vtkSMTrace.h"
#include "vtkSMUncheckedPropertyHelper.h"

#include <QHBoxLayout>
#include <QPushButton>
#include <QSignalBlocker>
#include <QVBoxLayout>

#include <vector>

pqCoronaryJointHandle::pqCoronaryJointHandle(
  vtkSMProxy* proxy, vtkSMPropertyGroup* group, QWidget* parentWidget)
  : Superclass(proxy, group, parentWidget)
{
  auto* buttons = new QWidget(this);
  auto* row = new QHBoxLayout(buttons);
  row->setContentsMargins(0, 0, 0, 0);
  auto* reset = new QPushButton(tr("Reset The Joint"), buttons);
  reset->setObjectName("ResetJoint");
  reset->setToolTip(
    tr("Puts the handle where the joint is after the edits, and takes its move back."));
  this->KeepButton = new QPushButton(tr("Keep As Edit"), buttons);
  this->KeepButton->setObjectName("KeepAsEdit");
  this->KeepButton->setToolTip(
    tr("Adds the applied move of the joint to the list of edits: the next joint may be chosen."));
  row->addWidget(reset);
  row->addWidget(this->KeepButton);
  this->layout()->addWidget(buttons);
  this->connect(reset, SIGNAL(clicked()), SLOT(resetJoint()));
  this->connect(this->KeepButton, SIGNAL(clicked()), SLOT(keepAsEdit()));
  this->connect(this, SIGNAL(endInteraction()), SLOT(handleMoved()));
  this->JointTag = proxy->GetProperty("Joint")->AddObserver(
    vtkCommand::UncheckedPropertyModifiedEvent, this, &pqCoronaryJointHandle::jointChosen);
  this->UpdateTag =
    proxy->AddObserver(vtkCommand::UpdateDataEvent, this, &pqCoronaryJointHandle::updated);
  this->updated();
}

pqCoronaryJointHandle::~pqCoronaryJointHandle()
{
  this->proxy()->GetProperty("Joint")->RemoveObserver(this->JointTag);
  this->proxy()->RemoveObserver(this->UpdateTag);
}

void pqCoronaryJointHandle::showEvent(QShowEvent* event)
{
  this->Superclass::showEvent(event);
  // ParaView forgets that it was visible when another filter was chosen meanwhile.
  this->setWidgetVisible(true);
}

bool pqCoronaryJointHandle::moves() const
{
  return vtkSMUncheckedPropertyHelper(this->proxy(), "MoveJoint").GetAsInt() != 0;
}

bool pqCoronaryJointHandle::placeOfJoint(double* place)
{
  this->proxy()->UpdatePropertyInformation(this->proxy()->GetProperty("JointPlaces"));
  const std::vector<double> places =
    vtkSMPropertyHelper(this->proxy(), "JointPlaces").GetDoubleArray();
  const int joint = vtkSMUncheckedPropertyHelper(this->proxy(), "Joint").GetAsInt();
  if (joint < 0 || 3 * static_cast<std::size_t>(joint) + 3 > places.size())
  {
    return false;
  }
  std::copy_n(places.begin() + 3 * joint, 3, place);
  return true;
}

void pqCoronaryJointHandle::setHandle(const double* place)
{
  vtkSMPropertyHelper(this->widgetProxy(), "WorldPosition").Set(place, 3);
  this->widgetProxy()->UpdateVTKObjects();
  this->render();
}

void pqCoronaryJointHandle::jointChosen()
{
  double place[3];
  if (this->placeOfJoint(place))
  {
    // Another joint: what was done to the one before is not done to this one.
    this->resetJoint();
  }
}

void pqCoronaryJointHandle::followJoint()
{
  double place[3];
  if (!this->moves() && this->placeOfJoint(place))
  {
    this->setHandle(place);
  }
}

void pqCoronaryJointHandle::updated()
{
  this->proxy()->UpdatePropertyInformation(this->proxy()->GetProperty("MoveAsEdit"));
  this->KeepButton->setEnabled(
    vtkSMPropertyHelper(this->proxy(), "MoveAsEdit").GetNumberOfElements() > 0);
  this->followJoint();
}

void pqCoronaryJointHandle::handleMoved()
{
  vtkSMUncheckedPropertyHelper(this->proxy(), "MoveJoint").Set(1);
  Q_EMIT this->changeAvailable();
}

void pqCoronaryJointHandle::resetJoint()
{
  const double none[3] = { 0.0, 0.0, 0.0 };
  vtkSMUncheckedPropertyHelper(this->proxy(), "MoveJoint").Set(0);
  vtkSMUncheckedPropertyHelper(this->proxy(), "JointRotation").Set(none, 3);
  this->followJoint();
  Q_EMIT this->changeAvailable();
  Q_EMIT this->changeFinished();
}

void pqCoronaryJointHandle::keepAsEdit()
{
  vtkSMProxy* pose = this->proxy();
  pose->UpdatePropertyInformation(pose->GetProperty("MoveAsEdit"));
  const std::vector<double> edit = vtkSMPropertyHelper(pose, "MoveAsEdit").GetDoubleArray();
  if (edit.size() != 10)
  {
    return;
  }
  std::vector<double> edits = vtkSMPropertyHelper(pose, "Edits").GetDoubleArray();
  edits.insert(edits.end(), edit.begin(), edit.end());
  const double none[3] = { 0.0, 0.0, 0.0 };
  BEGIN_UNDO_SET(tr("Keep the joint's move as an edit"));
  {
    SM_SCOPED_TRACE(PropertiesModified).arg("proxy", pose);
    vtkSMPropertyHelper(pose, "Edits").Set(edits.data(), static_cast<unsigned int>(edits.size()));
    vtkSMPropertyHelper(pose, "MoveJoint").Set(0);
    vtkSMPropertyHelper(pose, "JointRotation").Set(none, 3);
    pose->UpdateVTKObjects();
  }
  END_UNDO_SET();
  vtkSMSourceProxy::SafeDownCast(pose)->UpdatePipeline();
  this->updated();
  this->render();
}

void pqCoronaryJointHandle::placeWidget()
{
  this->Superclass::placeWidget();
  this->followJoint();
}
