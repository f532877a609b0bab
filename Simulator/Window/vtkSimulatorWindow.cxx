#include "vtkSessionWindow.h"

#include "AtomicFile.h"
#include "DeviceUri.h"
#include "HeadlessSession.h"
#include "HeartShell.h"
#include "Interruption.h"
#include "Program.h"
#include "RecordedDevices.h"
#include "StentEnhancement.h"
#include "vtkAnatomyPanel.h"
#include "vtkLoadingWindow.h"
#include "vtkWindowProgram.h"

#include "vtkRenderer.h"

#include <QApplication>
#include <QCloseEvent>
#include <QDockWidget>
#include <QFileDialog>
#include <QKeyEvent>
#include <QMessageBox>
#include <QScrollArea>
#include <QSplitter>
#include <QStatusBar>
#include <QToolBar>
#include <QVBoxLayout>

#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr double WheelAdvance = 2.0;               // mm a notch
constexpr double WheelTurn = 15.0 * DegreeOfHands; // a notch
constexpr double DragTurn = 0.3;                   // degrees of the C-arm, a pixel
constexpr int PollInterval = 15;                   // ms

/// X11's name of a key, as the key map has it.
std::string KeyName(const QKeyEvent& event)
{
  static constexpr std::pair<int, const char*> names[] = { { Qt::Key_Up, "Up" },
    { Qt::Key_Down, "Down" }, { Qt::Key_Left, "Left" }, { Qt::Key_Right, "Right" },
    { Qt::Key_Space, "space" }, { Qt::Key_Shift, "Shift_L" }, { Qt::Key_Control, "Control_L" },
    { Qt::Key_PageUp, "Prior" }, { Qt::Key_PageDown, "Next" }, { Qt::Key_Home, "Home" },
    { Qt::Key_End, "End" }, { Qt::Key_Return, "Return" }, { Qt::Key_Plus, "plus" },
    { Qt::Key_Backspace, "BackSpace" }, { Qt::Key_Minus, "minus" }, { Qt::Key_Comma, "comma" },
    { Qt::Key_Period, "period" } };
  for (const auto& [key, name] : names)
  {
    if (event.key() == key)
    {
      return name;
    }
  }
  if (event.key() >= Qt::Key_A && event.key() <= Qt::Key_Z)
  {
    return { static_cast<char>('a' + event.key() - Qt::Key_A) };
  }
  if (event.key() >= Qt::Key_0 && event.key() <= Qt::Key_9)
  {
    return { static_cast<char>('0' + event.key() - Qt::Key_0) };
  }
  return {};
}

/// Whose arteries they are, as far as the folder tells.
std::string NameOf(const Scenario& scenario)
{
  const std::string name = std::filesystem::path(scenario.vessels.path).filename().string();
  return scenario.vessels.kind == VesselSource::Kind::Run && !name.empty()
    ? name + " - " + scenario.name
    : scenario.name;
}

QString TitleOf(const Scenario& scenario)
{
  return "DynamicCoronary simulator - " + QString::fromStdString(NameOf(scenario));
}
}

SessionWindow::SessionWindow(
  const SessionWorld& world, std::unique_ptr<vtkSimulatorScene> scene, const WindowOptions& options)
  : World(world)
  , Options(options)
  , Scene(std::move(scene))
  , Recorder(*this, this->Options)
{
  // For as long as the window is open: nobody should take this motion for the patient's.
  const std::string foreign = world.foreignMotion.empty() ? "" : " - " + world.foreignMotion;
  this->setWindowTitle(TitleOf(world.scenario) + QString::fromStdString(foreign));
  this->resize(options.width, options.height);
  for (const std::string& uri : options.devices)
  {
    this->Hardware.push_back(OpenDevice(uri, StartInputOf(world.scenario)));
  }

  if (options.igtlPort > 0)
  {
    this->Igtl = std::make_unique<IgtlOutput>(options.igtlPort, options.igtlAddress);
  }

  this->setCentralWidget(this->MakeCentre());
  auto* dock = new QDockWidget("Panel");
  dock->setFeatures(QDockWidget::DockWidgetMovable | QDockWidget::DockWidgetFloatable);
  dock->setWidget(this->MakePanels());
  this->addDockWidget(Qt::RightDockWidgetArea, dock);
  this->MakeToolBar();
  this->statusBar()->addPermanentWidget(this->DeviceText);
  this->ConnectPanels();
  this->ShowScenario();
  QObject::connect(&this->Timer, &QTimer::timeout, [this] { this->Poll(); });
  this->Timer.start(PollInterval);
  this->setFocusPolicy(Qt::StrongFocus);
}

SessionWindow::~SessionWindow()
{
  // The scene's renderer goes before the window that draws it.
  this->AnatomyWindow->RemoveRenderer(this->Scene->Renderer());
}

QWidget* SessionWindow::MakeCentre()
{
  this->Anatomy->setRenderWindow(this->AnatomyWindow);
  this->Anatomy->setMinimumSize(256, 256);
  this->AnatomyWindow->SetMultiSamples(0);
  this->AnatomyWindow->AddRenderer(this->Scene->Renderer());
  auto* views = new QSplitter(Qt::Horizontal);
  views->addWidget(this->Monitor);
  views->addWidget(this->Anatomy);
  views->setSizes({ 1000, 1000 });
  views->setChildrenCollapsible(false);
  auto* centre = new QWidget;
  auto* column = new QVBoxLayout(centre);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(2);
  column->addWidget(views, 1);
  auto* below = new QHBoxLayout;
  below->setSpacing(0);
  below->addWidget(this->Traces, 1);
  below->addWidget(this->Metrics);
  column->addLayout(below);
  return centre;
}

QWidget* SessionWindow::MakePanels()
{
  auto* inside = new QWidget;
  auto* column = new QVBoxLayout(inside);
  column->setContentsMargins(6, 6, 6, 6);
  auto* anatomy =
    new AnatomyPanel(*this->Scene, this->Options.heart, [this] { return this->Now.pose; });
  for (QWidget* panel : std::initializer_list<QWidget*>{
         this->Instruments, this->View, this->XRay, this->Contrast, this->Heart, anatomy })
  {
    column->addWidget(panel);
  }
  this->ForceButton =
    PanelButton("Confirm forces", "Hands are on the device and ready to feel forces");
  this->ForceButton->hide();
  this->Log->setReadOnly(true);
  this->Log->setMaximumBlockCount(500);
  this->Log->setMinimumHeight(60);
  this->Log->setFocusPolicy(Qt::ClickFocus);
  column->addWidget(this->ForceButton);
  column->addWidget(this->Log, 1);
  auto* scroll = new QScrollArea;
  scroll->setWidget(inside);
  scroll->setWidgetResizable(true);
  scroll->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  scroll->setMinimumWidth(inside->minimumSizeHint().width() + 24);
  return scroll;
}

void SessionWindow::ConnectPanels()
{
  this->Recorder.say = [this](const QString& text) { this->Log->appendPlainText(text); };
  this->Recorder.fail = [this](const QString& text) { this->Problem(text); };
  this->View->placed = [this](const ViewPlace& view)
  {
    if (this->Mux)
    {
      this->Mux->PlaceView(view);
    }
  };
  this->XRay->pedalMoved = [this](std::uint32_t pedal, bool down)
  {
    if (this->Panel)
    {
      this->Panel->SetPedal(pedal, down);
    }
  };
  this->XRay->chosen = [this](const RecordedEvent& event) { this->Chosen(event); };
  this->XRay->modeChosen = [this](ImageMode mode)
  {
    if (this->Engine)
    {
      this->Engine->SetImageMode(mode);
    }
  };
  this->XRay->frameChosen = [this] { this->ShowCine(); };
  this->Contrast->injects = [this](double speed)
  {
    if (this->Panel)
    {
      this->Panel->SetInjection(speed);
    }
  };
  this->Contrast->chosen = [this](const RecordedEvent& event) { this->Chosen(event); };
  this->Heart->chosen = [this](const RecordedEvent& event) { this->Chosen(event); };
  this->Instruments->chosen = [this](const RecordedEvent& event)
  {
    if (this->Engine)
    {
      this->Engine->Post(event);
    }
  };
  QObject::connect(this->ForceButton, &QPushButton::clicked,
    [this]
    {
      for (const std::shared_ptr<Device>& device : this->Hardware)
      {
        device->ConfirmForces();
      }
    });
  this->Monitor->wheelTurned = [this](double steps, Qt::KeyboardModifiers modifiers)
  {
    if ((modifiers & Qt::ShiftModifier) != 0)
    {
      this->Panel->TurnWire(steps * WheelTurn);
    }
    else if ((modifiers & Qt::ControlModifier) != 0)
    {
      this->Panel->AdvanceCatheter(0.5 * steps);
    }
    else
    {
      this->Panel->AdvanceWire(steps * WheelAdvance);
    }
  };
  this->Monitor->dragged = [this](QPoint moved)
  { this->View->Turn(moved.x() * DragTurn, moved.y() * DragTurn); };
}

void SessionWindow::MakeToolBar()
{
  QToolBar* bar = this->addToolBar("Session");
  bar->setMovable(false);
  const auto add = [&](const QString& text, const QString& help, auto action)
  {
    QAction* one = bar->addAction(text);
    one->setToolTip(help);
    QObject::connect(one, &QAction::triggered, action);
    return one;
  };
  add("New session", "From the beginning, with the chosen instruments",
    [this](bool) { this->Restart({}, {}); });
  add("Record ...", "A new session that is recorded",
    [this](bool)
    {
      const QString path = QFileDialog::getSaveFileName(
        this, "Record a new session", "session.pcirec", "Recordings (*.pcirec)");
      if (!path.isEmpty())
      {
        this->Restart(path.toStdString(), {});
      }
    });
  add("Replay ...", "Goes through a recording",
    [this](bool)
    {
      const QString path =
        QFileDialog::getOpenFileName(this, "Replay", {}, "Recordings (*.pcirec)");
      if (!path.isEmpty())
      {
        this->Restart({}, path.toStdString());
      }
    });
  add("Stop", "Ends the session and finishes its recording", [this](bool) { this->End(); });
  this->PauseAction = add("Pause", "Time stands still",
    [this](bool on)
    {
      if (this->Engine)
      {
        this->Engine->SetPaused(on);
      }
    });
  this->PauseAction->setCheckable(true);
  bar->addSeparator();
  add("Screenshot", "Saves a picture of the window in the current folder",
    [this](bool) { this->Recorder.SaveScreenshot(); });
  this->Recorder.filming =
    add("Video", "Films the window into a file", [this](bool on) { this->Recorder.Film(on); });
  this->Recorder.filming->setCheckable(true);
  add("Save run ...", "The chosen cine run as a DICOM file", [this](bool) { this->SaveCine(); });
  bar->addSeparator();
  add("Help", "Keys and mouse", [this](bool) { this->ShowKeys(); });
}

void SessionWindow::ShowKeys()
{
  QString text = "<table>";
  for (const KeyBinding& binding : KeyboardDevice::KeyMap())
  {
    text += QString("<tr><td><b>%1</b>&nbsp;&nbsp;</td><td>%2</td></tr>")
              .arg(QString(binding.key).toHtmlEscaped(), QString(binding.meaning).toHtmlEscaped());
  }
  text += "</table><p>Wheel on the X-ray image: the wire forth and back; with Shift it turns; "
          "with Control the catheter. Right button drags the C-arm.</p>";
  QMessageBox::information(this, "Keys and mouse", text);
}

/// The panels say what the next session begins with.
void SessionWindow::ShowScenario()
{
  this->Instruments->ShowScenario(
    this->World.scenario, this->World.wall->Topology().aorta != nullptr);
  this->Contrast->ShowScenario(this->World.scenario);
  this->XRay->ShowScenario(this->World.scenario.imaging);
  this->Heart->ShowRate(this->World.scenario.settings.heartRate);
  this->Heart->ShowBreaths(this->World.scenario.imaging.breathing.rate);
}

/// For this session, if there is one, and for the next ones.
void SessionWindow::Chosen(const RecordedEvent& event)
{
  Scenario& scenario = this->World.scenario;
  (event.kind == RecordedEvent::HeartRate      ? scenario.settings.heartRate
      : event.kind == RecordedEvent::FrameRate ? scenario.imaging.frameRate
      : event.kind == RecordedEvent::Breaths   ? scenario.imaging.breathing.rate
                                               : scenario.imaging.fieldOfView) = event.value;
  if (this->Engine)
  {
    this->Engine->Post(event);
  }
}

void SessionWindow::Begin(const std::string& record, const std::string& replay)
{
  Scenario& scenario = this->World.scenario;
  if (replay.empty())
  {
    this->Instruments->Take(scenario);
  }
  this->Engine.reset();
  this->Keys = std::make_shared<KeyboardDevice>();
  this->Panel = std::make_shared<PanelDevice>();
  this->Mux = std::make_shared<DeviceMux>();
  this->XRay->PressFluoroscopy();
  const CArmPose& pose = scenario.imaging.pose;
  EngineOptions options;
  if (!this->Options.script.empty())
  {
    options.script = ReadDriveScript(this->Options.script);
    this->Mux->Add(
      std::make_shared<ScriptDevice>(options.script, this->Options.script, StartInputOf(scenario)));
  }
  for (const std::shared_ptr<Device>& device : this->Hardware)
  {
    this->Mux->Add(device);
  }
  this->Mux->Add(this->Panel);
  this->Mux->Add(this->Keys);
  this->Mux->Start({ pose.primary, pose.secondary, pose.sourceToDetector, Vector3::Zero() });
  options.record = record;
  options.replay = replay;
  options.wallPoints = this->Scene->WallPoints();
  this->Engine =
    std::make_unique<SessionEngine>(this->World, replay.empty() ? this->Mux : nullptr, options);
  this->Replaying = !replay.empty();
  this->Engine->SetImageMode(this->XRay->Mode());
  this->Traces->Clear();
  this->PauseAction->setChecked(false);
  this->Engine->Start();
  this->Second.start();
  this->Whole.start();
  this->AllDrawn = 0;
}

/// A recording is of its own instruments and settings; the vessels have to be the same.
void SessionWindow::TakeScenarioOf(const std::string& recording)
{
  HeadlessOptions options;
  options.replay = recording;
  Scenario scenario = ScenarioOf(options);
  CheckRecording(recording, scenario, this->World.wallHash, false);
  if (scenario.imaging.exposureControl &&
    (!this->World.measured || !SamePatient(scenario.imaging, this->World.scenario.imaging)))
  {
    throw std::runtime_error("'" + recording +
      "' was recorded with another patient, whose thickness sets the dose: start with --replay.");
  }
  scenario.imaging.pose = StartPose(this->World.wall->Topology(), scenario.imaging);
  this->World.scenario = scenario;
  this->ShowScenario();
}

void SessionWindow::Restart(const std::string& record, const std::string& replay)
{
  this->End();
  try
  {
    if (!replay.empty())
    {
      this->TakeScenarioOf(replay);
    }
    this->Begin(record, replay);
  }
  catch (const std::exception& error)
  {
    this->Engine.reset();
    this->Problem(error.what());
  }
}

void SessionWindow::End()
{
  this->Recorder.Film(false);
  if (!this->Engine)
  {
    return;
  }
  try
  {
    this->Engine->Stop();
    if (!this->World.scenario.procedure.empty())
    {
      for (const std::string& line : LinesOf(this->Engine->Score()))
      {
        this->Log->appendPlainText(QString::fromStdString(line));
      }
    }
    if (this->Replaying)
    {
      const auto [compared, equal] = this->Engine->ReplayHashes();
      this->Log->appendPlainText(
        QString("%1 of %2 state hashes of the recording are equal.").arg(equal).arg(compared));
    }
  }
  catch (const std::exception& error)
  {
    this->Problem(error.what());
  }
  this->Engine.reset();
}

/// The trainee is told now, whoever started the program when it ends.
void SessionWindow::Problem(const QString& text)
{
  this->Trouble_ = this->Trouble_.isEmpty() ? text : this->Trouble_;
  this->Log->appendPlainText(text);
  this->Monitor->SetBanner(text);
}

void SessionWindow::Poll()
{
  if (Interruption() != 0)
  {
    this->close();
    return;
  }
  if (!this->Engine)
  {
    return;
  }
  try // Qt does not let exceptions through
  {
    this->ShowSession();
  }
  catch (const std::exception& error)
  {
    this->Problem(error.what());
    this->End();
  }
}

void SessionWindow::ShowSession()
{
  this->ShowImage();
  this->ShowScene();
  for (const std::string& message : this->Engine->TakeMessages())
  {
    this->Log->appendPlainText(QString::fromStdString(message));
  }
  this->ShowRates();
  this->Recorder.Update(this->Now, this->Shown);
  const bool timeIsUp =
    this->Options.quitAfter > 0.0 && this->Now.seconds >= this->Options.quitAfter;
  if (this->Engine->IsOver() || timeIsUp)
  {
    if (this->Options.quitAfter > 0.0)
    {
      if (!this->Options.quiet)
      {
        this->PrintRates();
      }
      this->close();
    }
    this->End();
  }
}

void SessionWindow::ShowScene()
{
  if (!this->Engine->LatestScene(this->Now))
  {
    return;
  }
  this->SendPose();
  this->Scene->Update(this->Now);
  this->AnatomyWindow->Render();
  ++this->DrawnFrames;
  ++this->AllDrawn;
  this->Traces->Add(this->Now);
  const WallTopology& topology = this->World.wall->Topology();
  this->Instruments->ShowMoment(this->Now, topology);
  this->Contrast->ShowBalance(this->Now.contrast);
  this->Metrics->ShowMetrics(
    this->Now.metrics, topology, NextOf(this->World.scenario.procedure, this->Now.procedure));
  this->View->Follow(this->Now.pose, this->Now.input.table);
  this->ShowDevices();
  this->Monitor->SetState(this->Now, this->Shown.completeness, this->XRay->Mode());
}

/// The tip of the wire in hand for others: its last axis is the way forward.
void SessionWindow::SendPose()
{
  const std::vector<Vector3>& wire =
    this->Now.report.hand == 0 ? this->Now.wire : this->Now.secondWire;
  if (!this->Igtl || wire.size() < 2)
  {
    return;
  }
  ToolPose pose;
  pose.origin = wire[0];
  pose.axes[2] = (wire[0] - wire[1]).normalized();
  pose.axes[0] = pose.axes[2].unitOrthogonal();
  pose.axes[1] = pose.axes[2].cross(pose.axes[0]);
  this->Igtl->SendPose("WireTip", pose, this->Now.seconds);
}

void SessionWindow::ShowImage()
{
  if (!this->Engine->LatestImage(this->Shown))
  {
    return;
  }
  this->Monitor->SetRunText({});
  this->Monitor->SetImage(this->Shown.image);
  if (this->Igtl)
  {
    const GreyImage& image = this->Shown.image;
    const SessionSnapshot& moment = this->Shown.moment;
    this->Igtl->SendImage("Fluoroscopy", image, moment.fieldOfView / image.columns, moment.seconds);
  }
}

void SessionWindow::ShowDevices()
{
  QString banner = QString::fromStdString(this->World.foreignMotion);
  banner += (banner.isEmpty() || this->Trouble_.isEmpty() ? "" : "\n") + this->Trouble_;
  bool awaits = false;
  for (const std::shared_ptr<Device>& device : this->Hardware)
  {
    const DeviceStatus status = device->Status();
    awaits = awaits || status.awaitsForces;
    if (status.state != DeviceState::Running && status.state != DeviceState::Ended)
    {
      banner += (banner.isEmpty() ? "" : "\n") + QString::fromStdString(status.text);
    }
  }
  this->Monitor->SetBanner(banner);
  this->ForceButton->setVisible(awaits);
}

void SessionWindow::ShowRates()
{
  if (this->Second.elapsed() < 1000)
  {
    return;
  }
  const double drawn = 1000.0 * this->DrawnFrames / static_cast<double>(this->Second.restart());
  this->DrawnFrames = 0;
  const EngineRates rates = this->Engine->Rates();
  this->DeviceText->setText(
    QString("Physics %1 Hz, load %2 %, behind %3 s    X-ray %4 f/s, %5 ms, late %6    "
            "Anatomy %7 f/s, %8 triangles")
      .arg(rates.ticks, 0, 'f', 0)
      .arg(100.0 * rates.load, 0, 'f', 0)
      .arg(rates.lostSeconds, 0, 'f', 1)
      .arg(rates.images, 0, 'f', 1)
      .arg(rates.imageMilliseconds, 0, 'f', 1)
      .arg(rates.lateImages)
      .arg(drawn, 0, 'f', 1)
      .arg(this->Scene->NumberOfTriangles()));
  std::size_t runs = 0;
  std::size_t frames = 0;
  GreyImage unused;
  this->Engine->CineFrame(0, SIZE_MAX, unused, runs, frames);
  this->XRay->SetRuns(runs);
}

/// Over the whole session, for whoever runs it unattended.
void SessionWindow::PrintRates() const
{
  const double seconds = 1e-3 * static_cast<double>(this->Whole.elapsed());
  const EngineRates rates = this->Engine->Rates();
  std::printf(
    "%.1f s simulated in %.1f s: %.2f times real time, physics at %.0f %% of a core, %.2f s "
    "behind\n"
    "X-ray: %llu frames exposed, %llu shown, %.1f ms each; anatomy: %.1f pictures a second "
    "of %lld triangles\n",
    this->Now.seconds, seconds, this->Now.seconds / seconds, 100.0 * rates.load, rates.lostSeconds,
    static_cast<unsigned long long>(this->Now.metrics.frames),
    static_cast<unsigned long long>(this->Now.metrics.frames) - rates.lateImages,
    rates.imageMilliseconds, static_cast<double>(this->AllDrawn) / seconds,
    static_cast<long long>(this->Scene->NumberOfTriangles()));
}

void SessionWindow::ShowCine()
{
  if (!this->Engine || this->Now.radiating)
  {
    return;
  }
  std::size_t runs = 0;
  std::size_t frames = 0;
  GreyImage image;
  const std::size_t run = this->XRay->Run();
  this->Engine->CineFrame(run, SIZE_MAX, image, runs, frames);
  this->XRay->SetFrames(frames);
  if (this->XRay->Enhances())
  {
    this->ShowEnhancedStent(run);
    return;
  }
  const std::size_t frame = this->XRay->Frame();
  if (this->Engine->CineFrame(run, frame, image, runs, frames))
  {
    this->Monitor->SetImage(image);
    this->Monitor->SetRunText(
      QString("RUN %1/%2  FRAME %3/%4").arg(run + 1).arg(runs).arg(frame + 1).arg(frames));
  }
}

void SessionWindow::ShowEnhancedStent(std::size_t number)
{
  XrayAngiogram run;
  if (!this->Engine->CineRun(number, run))
  {
    return;
  }
  const EnhancedStent stent = EnhanceStent(run);
  if (stent.frames > 0)
  {
    this->Monitor->SetImage(stent.image);
  }
  this->Monitor->SetRunText(stent.frames > 0
      ? QString("RUN %1  STENT BOOST, %2 FRAMES").arg(number + 1).arg(stent.frames)
      : QString("RUN %1: NO TWO MARKERS IN ENOUGH FRAMES").arg(number + 1));
}

void SessionWindow::SaveCine()
{
  const QString title = "Save a cine run";
  XrayAngiogram run;
  if (!this->Engine || !this->Engine->CineRun(this->XRay->Run(), run))
  {
    QMessageBox::information(this, title, "There is no cine run yet: hold C for one.");
    return;
  }
  const QString path = QFileDialog::getSaveFileName(
    this, title, QString::fromStdString(NameOfCineFile(run)), "DICOM files (*.dcm)");
  if (path.isEmpty())
  {
    return;
  }
  try
  {
    WriteXrayAngiogram(std::move(run), path.toStdString());
  }
  catch (const std::exception& problem)
  {
    QMessageBox::warning(this, title, QString::fromUtf8(problem.what()));
  }
}

void SessionWindow::keyPressEvent(QKeyEvent* event)
{
  const std::string key = KeyName(*event);
  if (event->isAutoRepeat() || key.empty() || !this->Keys || !this->Keys->Press(key))
  {
    QMainWindow::keyPressEvent(event);
  }
}

void SessionWindow::keyReleaseEvent(QKeyEvent* event)
{
  const std::string key = KeyName(*event);
  if (event->isAutoRepeat() || key.empty() || !this->Keys || !this->Keys->Release(key))
  {
    QMainWindow::keyReleaseEvent(event);
  }
}

void SessionWindow::changeEvent(QEvent* event)
{
  // A key that is released in another window would be held for ever.
  if (event->type() == QEvent::ActivationChange && !this->isActiveWindow() && this->Keys)
  {
    this->Keys->ReleaseAll();
  }
  QMainWindow::changeEvent(event);
}

void SessionWindow::closeEvent(QCloseEvent* event)
{
  this->End();
  event->accept();
}
void CheckWindow(const WindowOptions& options)
{
  RequireDisplay();
  for (const std::string& uri : options.devices)
  {
    try
    {
      ParseDeviceUri(uri);
    }
    catch (const std::invalid_argument& error)
    {
      throw UsageError(std::string("--device: ") + error.what());
    }
  }
  const std::string picture =
    options.screenshots.empty() ? std::string() : options.screenshots + "/window.png";
  for (const std::string& path : { options.record, options.video, picture })
  {
    if (!path.empty())
    {
      const AtomicFile place(path); // says when there is none, and leaves nothing
    }
  }
}

void RunWindow(const Scenario& scenario, const WorldLoader& load, const WindowOptions& options)
{
  const vtkWindowProgram program("coronary-simulator", "DynamicCoronary simulator");
  QApplication::setQuitOnLastWindowClosed(false); // the first one makes room for the second
  SessionWorld world;
  std::unique_ptr<vtkSimulatorScene> scene;
  LoadingWindow loading(TitleOf(scenario), options.width, options.height);
  const bool loaded = loading.Run(
    [&](const WorldProgress& progress)
    {
      world = load(progress);
      progress("anatomy", 0.0);
      scene = std::make_unique<vtkSimulatorScene>(*world.wall, world.scenario,
        options.heart ? MakeHeartShell(*world.wall, world.scenario.vessels, world.heart.get())
                      : nullptr,
        SceneSettings{ options.triangles });
      progress("", 1.0);
    });
  if (!loaded)
  {
    return;
  }
  QApplication::setQuitOnLastWindowClosed(true);
  SessionWindow window(world, std::move(scene), options);
  window.Begin(options.record, options.replay);
  window.show();
  loading.hide();
  QApplication::exec();
  ThrowIfInterrupted();
  if (!window.Trouble().isEmpty())
  {
    throw std::runtime_error(window.Trouble().toStdString());
  }
}
}
