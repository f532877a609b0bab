#include "coronaryMenuActions.h"

#include "coronaryBuild.h"
#include "coronaryQt.h"

#include <pqPVApplicationCore.h>
#include <pqPythonManager.h>

#include <QByteArray>
#include <QMenu>
#include <QTimer>

coronaryMenuActions::coronaryMenuActions(QObject* parent)
  : QActionGroup(parent)
{
  QAction* build = this->Add("coronaryBuild", "Build from 4D CT",
    "The beating model of the selected image series; of a small phantom when there is nothing yet");
  QObject::connect(build, &QAction::triggered, this,
    [this, build]
    {
      if (!this->Build)
      {
        QWidget* menu = coronaryQt::WidgetsOf(*build).value(0);
        this->Build = new coronaryBuild(menu ? menu->parentWidget()->window() : nullptr);
      }
      this->Build->show();
      this->Build->raise();
    });
  this->Add("coronaryCompare", "Compare Series",
    "The selected model over the selected truth, and its distance from it", "compare");
  this->Add("coronaryLook", "Look Along the Vessel",
    "The image along and across a vessel of the selected tree, and its diameter over the cycle",
    "look");
  this->AddSeparator();
  this->Add("coronaryCorrect", "Correct the Tree",
    "Vessel Edits behind the selected named tree: branches added by clicks, cut, joined, renamed",
    "correct");
  this->Add("coronaryKeepEdit", "Keep the Edit",
    "The edit that the settings of Vessel Edits make goes into its list", "keep_edit");
  this->Add("coronaryUndoEdit", "Undo the Last Edit", "The last edit of Vessel Edits is taken back",
    "undo_edit");
  this->Add("coronarySaveEdits", "Save Edits",
    "The edits as edits.json of the run that the tree is from", "save_edits");
  this->AddSeparator();
  this->Add(
    "coronaryPhantom", "Example: Phantom", "A beating phantom: surface and gated CT", "phantom");
  this->Add("coronaryReview", "Example: Overlay Review",
    "A model over the truth, and its distance from it, phase by phase", "overlay_review");
  this->Add("coronaryPosing", "Example: Posing",
    "A coronary tree that is bent by the joints of its skeleton", "posing");
  this->Add("coronaryExport", "Example: CFD Export",
    "A moving mesh of tetrahedra for simulations of flow", "cfd_export");
  this->NameMenu();
}

coronaryMenuActions::~coronaryMenuActions() = default;

QAction* coronaryMenuActions::Add(const char* name, const char* text, const char* help)
{
  auto* action = new QAction(text, this);
  action->setObjectName(name);
  action->setToolTip(help);
  action->setStatusTip(help);
  return action;
}

void coronaryMenuActions::Add(
  const char* name, const char* text, const char* help, const char* function)
{
  QAction* action = this->Add(name, text, help);
  // With paraview.simple Python finds the modules of plugins.
  const QByteArray code =
    QByteArray("import paraview.simple\nimport coronary_menu\ncoronary_menu.") + function + "()\n";
  QObject::connect(action, &QAction::triggered, this,
    [code] { pqPVApplicationCore::instance()->pythonManager()->executeCode(code); });
}

void coronaryMenuActions::NameMenu()
{
  // ParaView makes the menu, once there is a window, and gives it no name: recorded tests need one.
  for (QWidget* widget : coronaryQt::WidgetsOf(*this->actions().first()))
  {
    if (qobject_cast<QMenu*>(widget))
    {
      widget->setObjectName("menuDynamicCoronary");
      return;
    }
  }
  constexpr int Milliseconds = 100;
  QTimer::singleShot(Milliseconds, this, [this] { this->NameMenu(); });
}

void coronaryMenuActions::AddSeparator()
{
  auto* action = new QAction(this);
  action->setSeparator(true);
}
