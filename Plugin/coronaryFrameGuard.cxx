#include "coronaryFrameGuard.h"

#include "coronaryQt.h"

#include <pqAnimationManager.h>
#include <pqAnimationScene.h>
#include <pqPVApplicationCore.h>

#include <vtkCommand.h>
#include <vtkSMProxy.h>

#include <QApplication>
#include <QTimer>

coronaryFrameGuard::coronaryFrameGuard(QObject* parent)
  : QObject(parent)
{
}

coronaryFrameGuard::~coronaryFrameGuard()
{
  this->Watch(nullptr);
}

void coronaryFrameGuard::Start()
{
  pqPVApplicationCore* core = pqPVApplicationCore::instance();
  pqAnimationManager* manager = core ? core->animationManager() : nullptr;
  if (!manager)
  {
    // ParaView 6 loads plugins while it makes what has the animation.
    QTimer::singleShot(100, this, &coronaryFrameGuard::Start);
    return;
  }
  QObject::connect(
    manager, &pqAnimationManager::activeSceneChanged, this, &coronaryFrameGuard::Watch);
  this->Watch(manager->getActiveScene());
  QCoreApplication::instance()->installEventFilter(this);
}

void coronaryFrameGuard::Stop()
{
  QCoreApplication::instance()->removeEventFilter(this);
  this->Watch(nullptr);
}

void coronaryFrameGuard::Watch(pqAnimationScene* scene)
{
  if (this->Scene)
  {
    for (const unsigned long observer : this->Observers)
    {
      this->Scene->RemoveObserver(observer);
    }
  }
  this->Observers.clear();
  this->Playing = this->Ticking = false;
  this->Scene = scene ? vtkObject::SafeDownCast(scene->getProxy()->GetClientSideObject()) : nullptr;
  if (!this->Scene)
  {
    return;
  }
  // ParaView's own observer, which handles events, stands between the two of a tick.
  constexpr float Before = 1.0F;
  constexpr float After = -1.0F;
  this->Observers = {
    this->Scene->AddObserver(vtkCommand::StartEvent, this, &coronaryFrameGuard::BeginPlay, Before),
    this->Scene->AddObserver(vtkCommand::EndEvent, this, &coronaryFrameGuard::EndPlay, Before),
    this->Scene->AddObserver(
      vtkCommand::AnimationCueTickEvent, this, &coronaryFrameGuard::BeginTick, Before),
    this->Scene->AddObserver(
      vtkCommand::AnimationCueTickEvent, this, &coronaryFrameGuard::EndTick, After),
  };
}

void coronaryFrameGuard::BeginPlay()
{
  this->Playing = true;
}

void coronaryFrameGuard::EndPlay()
{
  this->Playing = false;
}

void coronaryFrameGuard::BeginTick()
{
  // While it plays there is nothing that starts another tick, and pause has to work.
  this->Ticking = !this->Playing;
}

void coronaryFrameGuard::EndTick()
{
  this->Ticking = false;
  for (auto& kept : this->Kept)
  {
    if (kept.first)
    {
      QCoreApplication::postEvent(kept.first, kept.second.release());
    }
  }
  this->Kept.clear();
}

bool coronaryFrameGuard::eventFilter(QObject* receiver, QEvent* event)
{
  if (!this->Ticking)
  {
    return false;
  }
  if (event->type() == QEvent::Shortcut || event->type() == QEvent::ShortcutOverride)
  {
    return true;
  }
  // Windows hand on to their widgets.
  std::unique_ptr<QEvent> copy =
    receiver->isWindowType() ? coronaryQt::CopyOfInput(*event) : nullptr;
  if (!copy)
  {
    return false;
  }
  this->Kept.emplace_back(receiver, std::move(copy));
  return true;
}
