/**
 * @class coronaryFrameGuard
 * @brief Keeps clicks and keys back while ParaView computes a frame that is not played.
 *
 * ParaView handles what the user does while it is within the tick of a frame. A click on play that waits for
 * a slow frame then starts a tick within the tick, and the program aborts. Here such a click waits for the end of the frame.
 */
#ifndef coronaryFrameGuard_h
#define coronaryFrameGuard_h

#include <vtkWeakPointer.h>

#include <QEvent>
#include <QObject>
#include <QPointer>

#include <memory>
#include <utility>
#include <vector>

class pqAnimationScene;
class vtkObject;

class coronaryFrameGuard : public QObject
{
  Q_OBJECT

public:
  explicit coronaryFrameGuard(QObject* parent = nullptr);
  ~coronaryFrameGuard() override;

  /// Called by ParaView when the plugin is loaded, and before it ends.
  void Start();
  void Stop();

  bool eventFilter(QObject* receiver, QEvent* event) override;

private:
  Q_DISABLE_COPY(coronaryFrameGuard);

  void Watch(pqAnimationScene* scene);
  void BeginPlay();
  void EndPlay();
  void BeginTick();
  void EndTick();

  vtkWeakPointer<vtkObject> Scene;
  std::vector<unsigned long> Observers;
  bool Playing = false;
  bool Ticking = false;
  /// What was kept back, and for whom.
  std::vector<std::pair<QPointer<QObject>, std::unique_ptr<QEvent>>> Kept;
};

#endif
