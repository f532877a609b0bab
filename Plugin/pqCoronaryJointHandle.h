/**
 * @class pqCoronaryJointHandle
 * @brief The handle in the view with which the chosen joint of a skeleton's pose is moved.
 *
 * ParaView's point handle, which begins at the chosen joint, and switches the move of the joint on when it is
 * dragged. *Reset The Joint* takes the move back, *Keep As Edit* makes a row of the list of edits of it: then
 * the next joint may be chosen.
 */
#ifndef pqCoronaryJointHandle_h
#define pqCoronaryJointHandle_h

#include "pqHandlePropertyWidget.h"

class QPushButton;

class pqCoronaryJointHandle : public pqHandlePropertyWidget
{
  Q_OBJECT
  typedef pqHandlePropertyWidget Superclass;

public:
  pqCoronaryJointHandle(vtkSMProxy* proxy, vtkSMPropertyGroup* group, QWidget* parent = nullptr);
  ~pqCoronaryJointHandle() override;

  /// Shows the handle, too.
  void showEvent(QShowEvent* event) override;

protected Q_SLOTS:
  /// To the joint instead of to the middle of the data.
  void placeWidget() override;

private Q_SLOTS:
  /// The handle goes to the joint, unless the joint has been moved already.
  void followJoint();
  void handleMoved();
  void resetJoint();
  void keepAsEdit();

private:
  Q_DISABLE_COPY(pqCoronaryJointHandle);

  void jointChosen();
  void updated();
  bool moves() const;
  void setHandle(const double* place);
  /// Of the joint that the panel shows; false when it is not known.
  bool placeOfJoint(double* place);

  QPushButton* KeepButton = nullptr;
  unsigned long JointTag = 0;
  unsigned long UpdateTag = 0;
};

#endif
