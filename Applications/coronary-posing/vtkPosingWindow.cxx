#include "Interruption.h"
#include "Numbers.h"
#include "PosingSession.h"
#include "vtkMessageTrap.h"
#include "vtkPosingModel.h"
#include "vtkPosingScene.h"
#include "vtkWindowProgram.h"

#include "QVTKOpenGLNativeWidget.h"
#include "vtkCamera.h"
#include "vtkGenericOpenGLRenderWindow.h"
#include "vtkNew.h"
#include "vtkRenderer.h"

#include <QAction>
#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QDir>
#include <QDockWidget>
#include <QDoubleSpinBox>
#include <QElapsedTimer>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QGroupBox>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QMainWindow>
#include <QMessageBox>
#include <QMouseEvent>
#include <QPushButton>
#include <QSlider>
#include <QSpinBox>
#include <QStatusBar>
#include <QTimer>
#include <QToolBar>
#include <QVBoxLayout>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <stdexcept>
#include <vector>

namespace coronary
{
namespace
{
constexpr double MoveStep = 0.5;          // mm a key press
constexpr double TurnStep = 5.0 * Degree; // a key press
constexpr double WidenStep = 1.1;         // a key press
constexpr double PickRadius = 12.0;       // pixels
constexpr int InterruptionInterval = 100; // ms

/// Offers the events to somebody else before the camera gets them.
class View : public QVTKOpenGLNativeWidget
{
public:
  std::function<bool(QEvent&)> filter; ///< true: it was taken

protected:
  bool event(QEvent* event) override
  {
    if (this->filter && this->filter(*event))
    {
      event->accept();
      return true;
    }
    return this->QVTKOpenGLNativeWidget::event(event);
  }
};

class Window : public QMainWindow
{
public:
  Window(const std::string& folder, const PosingOptions& options, vtkMessageTrap& messages);
  ~Window() override;

  /// After the window was shown: what the options say.
  void Begin();

  bool Failed() const { return this->HasFailed; }

private:
  QWidget* MakePanel();
  QGroupBox* MakeMoveGroup();
  QGroupBox* MakeSkinGroup();
  QGroupBox* MakeJointGroup();
  void MakeToolBar();
  QCheckBox* Check(const QString& text, bool PosingSettings::*member, const QString& help);
  template <typename Change>
  void ChangeSettings(const Change& change);

  bool TakeEvent(QEvent& event);
  bool TakeMouse(QMouseEvent& event);
  bool TakeKey(QKeyEvent& event);
  bool ArrowKey(const QKeyEvent& event);
  void FollowMouse();
  void ChooseBeside(int step);
  Vector3 InView(double right, double up) const;

  /// Does it, shows what has come of it, and says where it failed.
  void Do(const std::function<void()>& what);
  void Redraw();
  void ShowState();
  void Problem(const QString& text);
  void SavePictures(int number);
  void AskAndDo(
    bool save, const QString& title, const std::function<void(const std::string&)>& what);

  vtkPosingModel Model;
  PosingOptions Options;
  vtkPosingScene Scene;
  bool HasFailed = false;
  bool Scripted = false;
  Vector3 Grabbed = Vector3::Zero();    ///< place of the joint when its move began
  Vector3 GrabOffset = Vector3::Zero(); ///< of the joint from the mouse
  Vector3 Wanted = Vector3::Zero();
  double FrameMilliseconds = 0.0;
  QTimer Timer;
  QTimer MouseTimer; ///< runs while a place of the mouse is not shown yet

  View* Picture = nullptr;
  vtkNew<vtkGenericOpenGLRenderWindow> RenderWindow;
  QSpinBox* BonesBox = nullptr;
  QCheckBox* LengthsBox = nullptr;
  QDoubleSpinBox* ReachBox = nullptr;
  QLabel* JointText = nullptr;
  QLabel* PlaceText = nullptr;
  QLabel* StateText = nullptr;
  QAction* UndoAction = nullptr;
  QAction* RedoAction = nullptr;
};

Window::Window(const std::string& folder, const PosingOptions& options, vtkMessageTrap& messages)
  : Model(folder, messages)
  , Options(options)
  , Scene(this->Model, options.triangles)
  , Scripted(!options.screenshots.empty())
{
  this->Model.SetSettings(options.settings);
  this->setWindowTitle("DynamicCoronary posing - " + QString::fromStdString(folder));
  this->resize(options.width, options.height);
  this->Picture = new View;
  this->Picture->setRenderWindow(this->RenderWindow);
  this->Picture->setFocusPolicy(Qt::StrongFocus);
  this->Picture->setMinimumSize(256, 256);
  this->Picture->filter = [this](QEvent& event) { return this->TakeEvent(event); };
  this->RenderWindow->SetMultiSamples(0);
  this->RenderWindow->SetNumberOfLayers(2);
  this->RenderWindow->AddRenderer(this->Scene.Renderer());
  this->RenderWindow->AddRenderer(this->Scene.FrontRenderer());
  this->setCentralWidget(this->Picture);
  auto* dock = new QDockWidget("Panel");
  dock->setFeatures(QDockWidget::DockWidgetMovable | QDockWidget::DockWidgetFloatable);
  dock->setWidget(this->MakePanel());
  this->addDockWidget(Qt::RightDockWidgetArea, dock);
  this->MakeToolBar();
  this->StateText = new QLabel;
  this->statusBar()->addWidget(this->StateText, 1);
  QObject::connect(&this->Timer, &QTimer::timeout,
    [this]
    {
      if (Interruption() != 0)
      {
        this->close();
      }
    });
  this->Timer.start(InterruptionInterval);
  this->MouseTimer.setSingleShot(true);
  QObject::connect(&this->MouseTimer, &QTimer::timeout, [this] { this->FollowMouse(); });
}

Window::~Window()
{
  // The scene's renderers go before the window that draws them.
  this->RenderWindow->RemoveRenderer(this->Scene.Renderer());
  this->RenderWindow->RemoveRenderer(this->Scene.FrontRenderer());
}

QWidget* Window::MakePanel()
{
  auto* panel = new QWidget;
  auto* column = new QVBoxLayout(panel);
  column->addWidget(this->MakeMoveGroup());
  column->addWidget(this->MakeSkinGroup());
  column->addWidget(this->MakeJointGroup());
  column->addStretch(1);
  panel->setMinimumWidth(270);
  return panel;
}

template <typename Change>
void Window::ChangeSettings(const Change& change)
{
  this->Do(
    [&]
    {
      PosingSettings settings = this->Model.Settings();
      change(settings);
      this->Model.SetSettings(settings);
    });
}

QCheckBox* Window::Check(const QString& text, bool PosingSettings::*member, const QString& help)
{
  auto* box = new QCheckBox(text);
  box->setToolTip(help);
  box->setFocusPolicy(Qt::NoFocus);
  box->setChecked(this->Model.Settings().*member);
  QObject::connect(box, &QCheckBox::toggled,
    [this, member](bool on)
    { this->ChangeSettings([&](PosingSettings& settings) { settings.*member = on; }); });
  return box;
}

QGroupBox* Window::MakeMoveGroup()
{
  auto* group = new QGroupBox("A joint that is dragged");
  auto* form = new QFormLayout(group);
  auto* choice = new QComboBox;
  choice->addItems({ "moves alone", "takes along what is beyond it", "turns the bones before it" });
  choice->setCurrentIndex(static_cast<int>(this->Model.Settings().drag));
  choice->setFocusPolicy(Qt::NoFocus);
  this->BonesBox = new QSpinBox;
  this->BonesBox->setRange(1, 64);
  this->BonesBox->setValue(this->Model.Settings().bones);
  this->BonesBox->setFocusPolicy(Qt::ClickFocus);
  this->BonesBox->setToolTip("Bones before the joint that share the bend");
  this->LengthsBox = this->Check("Bones keep their lengths", &PosingSettings::keepLengths,
    "The joint gets as near to the mouse as it can");
  form->addRow(choice);
  form->addRow("Bones that bend", this->BonesBox);
  form->addRow(this->LengthsBox);
  QObject::connect(choice, QOverload<int>::of(&QComboBox::activated),
    [this](int index)
    {
      const bool turns = static_cast<JointDrag>(index) == JointDrag::Turn;
      this->BonesBox->setEnabled(turns);
      this->LengthsBox->setEnabled(turns);
      this->ChangeSettings(
        [&](PosingSettings& settings) { settings.drag = static_cast<JointDrag>(index); });
    });
  QObject::connect(this->BonesBox, QOverload<int>::of(&QSpinBox::valueChanged),
    [this](int value)
    { this->ChangeSettings([&](PosingSettings& settings) { settings.bones = value; }); });
  return group;
}

QGroupBox* Window::MakeSkinGroup()
{
  auto* group = new QGroupBox("Skin");
  auto* column = new QVBoxLayout(group);
  column->addWidget(this->Check("Keeps its calibre in bends", &PosingSettings::dualQuaternions,
    "Dual quaternions; else linear blending"));
  column->addWidget(
    this->Check("Follows the stretch of bones", &PosingSettings::stretch, "Else bones are rigid"));
  column->addWidget(this->Check(
    "Keeps its volume", &PosingSettings::keepVolume, "Stretched vessels become thinner"));
  column->addWidget(this->Check(
    "Inverted tetrahedra are repaired", &PosingSettings::repair, "When a move is over"));
  auto* opacity = new QSlider(Qt::Horizontal);
  opacity->setRange(10, 100);
  opacity->setValue(static_cast<int>(100.0 * this->Scene.Opacity()));
  opacity->setFocusPolicy(Qt::NoFocus);
  QObject::connect(opacity, &QSlider::valueChanged,
    [this](int percent)
    {
      this->Scene.SetOpacity(0.01 * percent);
      this->Redraw();
    });
  auto* row = new QFormLayout;
  row->addRow("Opacity", opacity);
  column->addLayout(row);
  return group;
}

QGroupBox* Window::MakeJointGroup()
{
  auto* group = new QGroupBox("Chosen joint");
  auto* form = new QFormLayout(group);
  this->JointText = new QLabel;
  this->PlaceText = new QLabel;
  form->addRow("Joint", this->JointText);
  form->addRow("Place", this->PlaceText);
  const auto pair = [&](const QString& label, const QString& less, const QString& more,
                      const std::function<void(double)>& what)
  {
    auto* row = new QHBoxLayout;
    for (const double sign : { -1.0, 1.0 })
    {
      auto* button = new QPushButton(sign < 0.0 ? less : more);
      button->setFocusPolicy(Qt::NoFocus);
      button->setAutoRepeat(true);
      QObject::connect(
        button, &QPushButton::clicked, [this, what, sign] { this->Do([&] { what(sign); }); });
      row->addWidget(button);
    }
    form->addRow(label, row);
  };
  const QString degree = QChar(0x00B0);
  pair("Twist", QString("-5") + degree, QString("+5") + degree,
    [this](double sign) { this->Model.Twist(sign * TurnStep); });
  pair("Calibre", "narrower", "wider",
    [this](double sign) { this->Model.Widen(std::pow(WidenStep, sign), this->ReachBox->value()); });
  this->ReachBox = new QDoubleSpinBox;
  this->ReachBox->setRange(0.0, 100.0);
  this->ReachBox->setValue(10.0);
  this->ReachBox->setSuffix(" mm");
  this->ReachBox->setFocusPolicy(Qt::ClickFocus);
  this->ReachBox->setToolTip("Along the vessel, within which the change falls to nothing");
  form->addRow("Reach", this->ReachBox);
  return group;
}

void Window::AskAndDo(
  bool save, const QString& title, const std::function<void(const std::string&)>& what)
{
  const QString kinds = "Poly data (*.vtp)";
  QString path = save ? QFileDialog::getSaveFileName(this, title, {}, kinds)
                      : QFileDialog::getOpenFileName(this, title, {}, kinds);
  if (path.isEmpty())
  {
    return;
  }
  if (save && QFileInfo(path).suffix().isEmpty())
  {
    path += ".vtp";
  }
  this->Do([&] { what(path.toStdString()); });
}

void Window::MakeToolBar()
{
  QToolBar* bar = this->addToolBar("Posing");
  bar->setMovable(false);
  const auto add = [&](const QString& text, const QString& help, const QKeySequence& keys,
                     const std::function<void()>& what)
  {
    QAction* action = bar->addAction(text);
    action->setToolTip(keys.isEmpty() ? help : help + " (" + keys.toString() + ")");
    action->setShortcut(keys);
    QObject::connect(action, &QAction::triggered, [what](bool) { what(); });
    return action;
  };
  this->UndoAction = add("Undo", "Take the last step back", QKeySequence::Undo,
    [this] { this->Do([&] { this->Model.Undo(); }); });
  this->RedoAction = add("Redo", "Do it again", QKeySequence("Ctrl+Shift+Z"),
    [this] { this->Do([&] { this->Model.Redo(); }); });
  add("Reset", "Back to rest; may be undone", QKeySequence("Ctrl+R"),
    [this] { this->Do([&] { this->Model.Reset(); }); });
  bar->addSeparator();
  add("Open pose ...", "Read a posed skeleton", QKeySequence::Open,
    [this]
    {
      this->AskAndDo(
        false, "Open a pose", [this](const std::string& path) { this->Model.ReadPose(path); });
    });
  add("Save pose ...", "Write the posed skeleton", QKeySequence::Save,
    [this]
    {
      this->AskAndDo(
        true, "Save the pose", [this](const std::string& path) { this->Model.WritePose(path); });
    });
  add("Save surface ...", "Write the deformed surface", {},
    [this]
    {
      this->AskAndDo(true, "Save the surface",
        [this](const std::string& path) { this->Model.WriteSurface(path); });
    });
  bar->addSeparator();
  add("Whole view", "Look at all from the front", {},
    [this]
    {
      this->Scene.LookFromFront();
      this->Redraw();
    });
  add("Help", "Keys and mouse", QKeySequence("F1"),
    [this]
    {
      QMessageBox::information(this, "Keys and mouse",
        "<table>"
        "<tr><td><b>Left button on a joint&nbsp;&nbsp;</b></td><td>chooses and drags it</td></tr>"
        "<tr><td><b>Escape</b></td><td>cancels the drag</td></tr>"
        "<tr><td><b>Left button beside</b></td><td>turns the view; middle shifts, right "
        "zooms</td></tr>"
        "<tr><td><b>Tab, Shift+Tab</b></td><td>next and previous joint</td></tr>"
        "<tr><td><b>Up, Down</b></td><td>towards the root, towards the tips</td></tr>"
        "<tr><td><b>Left, Right</b></td><td>to the vessel beside, at a bifurcation</td></tr>"
        "<tr><td><b>Shift+arrows</b></td><td>move the joint by 0.5 mm in the view</td></tr>"
        "<tr><td><b>Ctrl+arrows</b></td><td>turn what is beyond it by 5 degrees</td></tr>"
        "<tr><td><b>Ctrl+Shift+Left, Right</b></td><td>turn it in the plane of the view</td></tr>"
        "<tr><td><b>Alt+Left, Right</b></td><td>twist the bone that ends in it</td></tr>"
        "<tr><td><b>+, -</b></td><td>wider, narrower</td></tr></table>");
    });
}

Vector3 Window::InView(double right, double up) const
{
  vtkCamera* camera = this->Scene.Renderer()->GetActiveCamera();
  const Vector3 upwards = Vector3(camera->GetViewUp()).normalized();
  const Vector3 forwards = Vector3(camera->GetDirectionOfProjection()).normalized();
  const Vector3 rightwards = forwards.cross(upwards).normalized();
  return right * rightwards + up * rightwards.cross(forwards);
}

bool Window::TakeEvent(QEvent& event)
{
  switch (event.type())
  {
    case QEvent::MouseButtonPress:
    case QEvent::MouseMove:
    case QEvent::MouseButtonRelease:
      return this->TakeMouse(static_cast<QMouseEvent&>(event));
    case QEvent::KeyPress:
      return this->TakeKey(static_cast<QKeyEvent&>(event));
    case QEvent::KeyRelease:
    case QEvent::ContextMenu:
      return true; // not VTK's letters
    case QEvent::FocusOut:
      if (this->Model.Moving())
      {
        this->Do([&] { this->Model.EndMove(); });
      }
      return false;
    default:
      return false;
  }
}

bool Window::TakeMouse(QMouseEvent& event)
{
  const double ratio = this->Picture->devicePixelRatioF();
  const double x = ratio * event.pos().x();
  const double y = ratio * (this->Picture->height() - 1 - event.pos().y());
  if (event.type() == QEvent::MouseButtonPress && event.button() == Qt::LeftButton)
  {
    this->Picture->setFocus();
    const std::int64_t joint = this->Scene.JointAt(x, y, ratio * PickRadius);
    if (joint < 0)
    {
      return false;
    }
    this->Do(
      [&]
      {
        this->Model.Choose(joint);
        this->Model.BeginMove();
        this->Grabbed = this->Model.Joint(joint);
        this->GrabOffset = this->Grabbed - this->Scene.PlaceAt(x, y, this->Grabbed);
      });
    return true;
  }
  if (!this->Model.Moving())
  {
    return false;
  }
  if (event.type() == QEvent::MouseButtonRelease && event.button() == Qt::LeftButton)
  {
    if (this->MouseTimer.isActive())
    {
      this->MouseTimer.stop();
      this->FollowMouse();
    }
    this->Do([&] { this->Model.EndMove(); });
    return true;
  }
  if (event.type() == QEvent::MouseMove && (event.buttons() & Qt::LeftButton) != 0)
  {
    // In the plane where the joint was grabbed, wherever it has got to.
    this->Wanted = this->Scene.PlaceAt(x, y, this->Grabbed) + this->GrabOffset;
    // Moves that came in the meantime are one.
    if (!this->MouseTimer.isActive())
    {
      this->MouseTimer.start(0);
    }
  }
  return true;
}

void Window::FollowMouse()
{
  if (this->Model.Moving())
  {
    this->Do([&] { this->Model.MoveTo(this->Wanted); });
  }
}

void Window::ChooseBeside(int step)
{
  const std::int64_t joint = this->Model.Chosen();
  const std::int64_t parent = this->Model.Parent(joint);
  if (parent < 0)
  {
    return;
  }
  const std::vector<std::int64_t> sisters = this->Model.Daughters(parent);
  const auto here = std::find(sisters.begin(), sisters.end(), joint) - sisters.begin();
  const auto count = static_cast<std::ptrdiff_t>(sisters.size());
  this->Model.Choose(sisters[static_cast<std::size_t>((here + step + count) % count)]);
}

bool Window::ArrowKey(const QKeyEvent& event)
{
  const int key = event.key();
  const int right = key == Qt::Key_Right ? 1 : key == Qt::Key_Left ? -1 : 0;
  const int up = key == Qt::Key_Up ? 1 : key == Qt::Key_Down ? -1 : 0;
  if (right == 0 && up == 0)
  {
    return false;
  }
  const Qt::KeyboardModifiers with = event.modifiers();
  const bool shift = (with & Qt::ShiftModifier) != 0;
  const bool control = (with & Qt::ControlModifier) != 0;
  this->Do(
    [&]
    {
      vtkPosingModel& model = this->Model;
      if (control && shift)
      {
        model.Turn(right * TurnStep * this->InView(1.0, 0.0).cross(this->InView(0.0, 1.0)));
      }
      else if (control)
      {
        model.Turn(TurnStep * this->InView(-up, right));
      }
      else if (shift)
      {
        model.Move(MoveStep * this->InView(right, up));
      }
      else if ((with & Qt::AltModifier) != 0)
      {
        model.Twist(right * TurnStep);
      }
      else if (right != 0)
      {
        this->ChooseBeside(right);
      }
      else if (up > 0 && model.Parent(model.Chosen()) >= 0)
      {
        model.Choose(model.Parent(model.Chosen()));
      }
      else if (up < 0 && !model.Daughters(model.Chosen()).empty())
      {
        model.Choose(model.Daughters(model.Chosen()).front());
      }
    });
  return true;
}

bool Window::TakeKey(QKeyEvent& event)
{
  vtkPosingModel& model = this->Model;
  const auto next = [&](std::int64_t step)
  {
    const std::int64_t count = model.NumberOfJoints();
    this->Do([&] { model.Choose((model.Chosen() + step + count) % count); });
  };
  const auto widen = [&](double factor)
  { this->Do([&] { model.Widen(factor, this->ReachBox->value()); }); };
  switch (event.key())
  {
    case Qt::Key_Tab:
      next(1);
      return true;
    case Qt::Key_Backtab:
      next(-1);
      return true;
    case Qt::Key_Escape:
      this->Do([&] { model.CancelMove(); });
      return true;
    case Qt::Key_Plus:
      widen(WidenStep);
      return true;
    case Qt::Key_Minus:
      widen(1.0 / WidenStep);
      return true;
    default:
      this->ArrowKey(event);
      return true;
  }
}

void Window::Do(const std::function<void()>& what)
{
  QElapsedTimer clock;
  clock.start();
  try
  {
    what();
    this->statusBar()->clearMessage();
  }
  catch (const std::exception& error)
  {
    this->Problem(error.what());
  }
  this->Scene.Update();
  this->Redraw();
  this->FrameMilliseconds = 1e-6 * static_cast<double>(clock.nsecsElapsed());
  this->ShowState();
}

void Window::Redraw()
{
  this->RenderWindow->Render();
  this->RenderWindow->WaitForCompletion();
}

void Window::ShowState()
{
  const PosingReport& report = this->Model.Report();
  const std::int64_t joint = this->Model.Chosen();
  const Vector3 place = this->Model.Joint(joint);
  this->JointText->setText(
    QString("%1  %2").arg(joint).arg(QString::fromStdString(this->Model.BoneName(joint))));
  this->PlaceText->setText(QString("%1  %2  %3 mm")
                             .arg(place.x(), 0, 'f', 1)
                             .arg(place.y(), 0, 'f', 1)
                             .arg(place.z(), 0, 'f', 1));
  this->StateText->setText(
    QString("Greatest displacement %1 mm    Strain of bones %2    Volume ratios %3 to %4    "
            "Inverted %5, repaired %6    ")
      .arg(report.maximumDisplacement, 0, 'f', 2)
      .arg(report.maximumStrain, 0, 'f', 2)
      .arg(report.minimumVolumeRatio, 0, 'f', 2)
      .arg(report.maximumVolumeRatio, 0, 'f', 2)
      .arg(report.inverted)
      .arg(report.repaired) +
    QString("%1 ms a frame, skin %2 ms, %3 triangles")
      .arg(this->FrameMilliseconds, 0, 'f', 1)
      .arg(report.deformationMilliseconds, 0, 'f', 1)
      .arg(this->Scene.NumberOfTriangles()));
  this->UndoAction->setEnabled(this->Model.CanUndo());
  this->RedoAction->setEnabled(this->Model.CanRedo());
}

void Window::Problem(const QString& text)
{
  std::fprintf(stderr, "coronary-posing: %s\n", text.toUtf8().constData());
  this->statusBar()->showMessage(text);
}

void Window::SavePictures(int number)
{
  QApplication::processEvents();
  const QDir folder(QString::fromStdString(this->Options.screenshots));
  const QString ending = QString("_%1.png").arg(number, 2, 10, QChar('0'));
  const auto save = [&](const QString& path, bool good)
  {
    if (!good)
    {
      this->HasFailed = true;
      this->Problem("Cannot write '" + path + "'.");
    }
  };
  const QString whole = folder.filePath("posing" + ending);
  save(whole, this->grab().save(whole, "PNG"));
  const QString vessels = folder.filePath("vessels" + ending);
  save(vessels, this->Picture->grabFramebuffer().save(vessels, "PNG"));
}

void Window::Begin()
{
  const auto step = [this](const std::function<void()>& what)
  {
    // What is written on the command line must work.
    try
    {
      what();
    }
    catch (const std::exception&)
    {
      this->HasFailed = true;
      throw;
    }
    this->Do([] {});
  };
  step(
    [&]
    {
      if (!this->Options.start.empty())
      {
        this->Model.ReadPose(this->Options.start);
      }
    });
  int number = 0;
  if (this->Scripted)
  {
    this->SavePictures(number);
  }
  std::vector<double> frames;
  for (const PosingMove& move : this->Options.moves)
  {
    QElapsedTimer clock;
    clock.start();
    step(
      [&]
      {
        this->Model.Choose(move.joint);
        this->Model.Move(move.millimetres);
      });
    QApplication::processEvents();
    frames.push_back(1e-6 * static_cast<double>(clock.nsecsElapsed()));
    if (this->Scripted)
    {
      this->SavePictures(++number);
    }
  }
  if (!frames.empty())
  {
    const auto middle = frames.begin() + static_cast<std::ptrdiff_t>(frames.size() / 2);
    std::nth_element(frames.begin(), middle, frames.end());
    std::printf("%zu moves, %.1f ms a frame (median)\n", frames.size(), *middle);
  }
  if (!this->Options.output.empty())
  {
    this->Model.WritePose(this->Options.output);
  }
  if (!this->Options.surface.empty())
  {
    this->Model.WriteSurface(this->Options.surface);
  }
}
}

int RunPosingWindow(const std::string& folder, const PosingOptions& options)
{
  const vtkWindowProgram program("coronary-posing", "DynamicCoronary posing");
  vtkMessageTrap messages;
  Window window(folder, options, messages);
  window.show();
  QApplication::processEvents();
  window.Begin();
  if (options.screenshots.empty())
  {
    QApplication::exec();
  }
  ThrowIfInterrupted();
  return window.Failed() ? 1 : 0;
}
}
