#include "vtkSessionWindow.h"

#include "AtomicFile.h"
#include "DeviceUri.h"
#include "HeadlessSession.h"
#include "HeartShell.h"
#include "InstrumentCatalogue.h"
#include "Interruption.h"
#include "Program.h"
#include "RecordedDevices.h"
#include "vtkLoadingWindow.h"
#include "vtkWindowProgram.h"

#include "vtkRenderer.h"

#include <QAction>
#include <QApplication>
#include <QCloseEvent>
#include <QDateTime>
#include <QDir>
#include <QDockWidget>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <QKeyEvent>
#include <QSaveFile>
#include <QSignalBlocker>
#include <QSplitter>
#include <QStatusBar>
#include <QVBoxLayout>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr double Degree = 3.14159265358979323846 / 180.0;
constexpr double WheelAdvance = 2.0;        // mm a notch
constexpr double WheelTurn = 15.0 * Degree; // a notch
constexpr double DragTurn = 0.3 * Degree;   // of the C-arm, a pixel
constexpr int PollInterval = 15;            // ms
constexpr double VideoRate = 10.0;          // Hz

/// X11's name of a key, as the key map has it.
std::string KeyName(const QKeyEvent& event)
{
  switch (event.key())
  {
    case Qt::Key_Up:
      return "Up";
    case Qt::Key_Down:
      return "Down";
    case Qt::Key_Left:
      return "Left";
    case Qt::Key_Right:
      return "Right";
    case Qt::Key_Space:
      return "space";
    case Qt::Key_Shift:
      return "Shift_L";
    case Qt::Key_Control:
      return "Control_L";
    case Qt::Key_PageUp:
      return "Prior";
    case Qt::Key_PageDown:
      return "Next";
    case Qt::Key_Home:
      return "Home";
    case Qt::Key_End:
      return "End";
    case Qt::Key_Return:
      return "Return";
    case Qt::Key_Plus:
      return "plus";
    case Qt::Key_Backspace:
      return "BackSpace";
    case Qt::Key_Minus:
      return "minus";
    case Qt::Key_Comma:
      return "comma";
    case Qt::Key_Period:
      return "period";
    default:
      break;
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

/// Without a minus before what is rounded to nothing.
QString Decimal(double value, int digits)
{
  const double unit = std::pow(10.0, digits);
  return QString::number(std::round(value * unit) / unit + 0.0, 'f', digits);
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

  this->Monitor = new FluoroscopyWidget;
  this->Anatomy = new QVTKOpenGLNativeWidget;
  this->Anatomy->setRenderWindow(this->AnatomyWindow);
  this->Anatomy->setMinimumSize(256, 256);
  this->AnatomyWindow->SetMultiSamples(0);
  this->AnatomyWindow->AddRenderer(this->Scene->Renderer());
  auto* views = new QSplitter(Qt::Horizontal);
  views->addWidget(this->Monitor);
  views->addWidget(this->Anatomy);
  views->setSizes({ 1000, 1000 });
  views->setChildrenCollapsible(false);
  this->Traces = new TraceWidget;
  auto* centre = new QWidget;
  auto* column = new QVBoxLayout(centre);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(2);
  column->addWidget(views, 1);
  auto* below = new QHBoxLayout;
  below->setSpacing(0);
  below->addWidget(this->Traces, 1);
  below->addWidget(this->MakeMetrics());
  column->addLayout(below);
  this->setCentralWidget(centre);

  auto* dock = new QDockWidget("Panel");
  dock->setFeatures(QDockWidget::DockWidgetMovable | QDockWidget::DockWidgetFloatable);
  dock->setWidget(this->MakePanel());
  this->addDockWidget(Qt::RightDockWidgetArea, dock);
  this->MakeToolBar();
  this->DeviceText = new QLabel;
  this->statusBar()->addPermanentWidget(this->DeviceText);
  this->ConnectMouse();
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

/// The panel says what the next session begins with.
void SessionWindow::ShowScenario()
{
  const Scenario& scenario = this->World.scenario;
  const auto choose = [](QComboBox* box, const QString& text, const QVariant& value)
  {
    if (box->findText(text) < 0)
    {
      box->addItem(text, value); // the scenario's own
    }
    box->setCurrentText(text);
  };
  choose(this->WireChoice, QString::fromStdString(scenario.wire.name), {});
  choose(this->CatheterChoice, QString::fromStdString(scenario.catheter.name), {});
  const ImagingSettings& imaging = scenario.imaging;
  choose(this->RateChoice, QString("%1 frames/s").arg(imaging.frameRate), imaging.frameRate);
  choose(this->FieldChoice, QString("%1 mm").arg(imaging.fieldOfView), imaging.fieldOfView);
  const double heartRate = scenario.settings.heartRate;
  const QSignalBlocker sliderSilence(this->HeartSlider);
  const QSignalBlocker pauseSilence(this->HeartPause);
  this->HeartPause->setChecked(heartRate <= 0.0);
  if (heartRate > 0.0)
  {
    this->HeartSlider->setValue(static_cast<int>(std::lround(heartRate)));
  }
  this->HeartText->setText(
    QString("%1 /min").arg(heartRate > 0.0 ? heartRate : this->HeartSlider->value()));
}

void SessionWindow::PressFluoroscopy()
{
  this->Panel->SetPedal(
    FluoroscopyPedal, this->FluoroscopyButton->isDown() || this->FluoroscopyHold->isChecked());
}

void SessionWindow::ConnectMouse()
{
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
  {
    this->Primary =
      std::clamp(this->Primary + moved.x() * DragTurn, -105.0 * Degree, 105.0 * Degree);
    this->Secondary =
      std::clamp(this->Secondary + moved.y() * DragTurn, -50.0 * Degree, 50.0 * Degree);
    this->PrimaryBox->setValue(this->Primary / Degree);
    this->SecondaryBox->setValue(this->Secondary / Degree);
  };
}

void SessionWindow::PlaceView()
{
  if (this->ViewIsOurs || !this->Mux)
  {
    return;
  }
  ViewPlace view;
  view.primary = this->PrimaryBox->value() * Degree;
  view.secondary = this->SecondaryBox->value() * Degree;
  view.sourceToDetector = this->DistanceBox->value();
  for (int axis = 0; axis < 3; ++axis)
  {
    view.table[axis] = this->TableBoxes[axis]->value();
  }
  this->Mux->PlaceView(view);
}

void SessionWindow::Begin(const std::string& record, const std::string& replay)
{
  Scenario& scenario = this->World.scenario;
  if (replay.empty())
  {
    const auto wire = this->WireChoice->currentText().toStdString();
    const auto catheter = this->CatheterChoice->currentText().toStdString();
    if (wire != scenario.wire.name)
    {
      scenario.wire = BuiltInCatalogue().Wire(wire).wire;
    }
    if (catheter != scenario.catheter.name)
    {
      scenario.catheter = BuiltInCatalogue().Catheter(catheter).catheter;
    }
  }
  this->Engine.reset();
  this->Keys = std::make_shared<KeyboardDevice>();
  this->Panel = std::make_shared<PanelDevice>();
  this->Mux = std::make_shared<DeviceMux>();
  this->PressFluoroscopy();
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
  this->Engine->SetImageMode(this->Mode);
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

void SessionWindow::Post(const RecordedEvent& event)
{
  if (this->Engine)
  {
    this->Engine->Post(event);
  }
}

void SessionWindow::End()
{
  this->ToggleVideo(false);
  if (!this->Engine)
  {
    return;
  }
  try
  {
    this->Engine->Stop();
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
  this->TakeDueScreenshots();
  this->RecordVideo();
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
  this->ShowNumbers(this->Now);
  this->ShowDevices();
  this->Monitor->SetState(this->Now, this->Shown.completeness, this->Mode);
}

/// The wire's tip for others: its last axis is the way forward.
void SessionWindow::SendPose()
{
  if (!this->Igtl || this->Now.wire.size() < 2)
  {
    return;
  }
  ToolPose pose;
  pose.origin = this->Now.wire[0];
  pose.axes[2] = (this->Now.wire[0] - this->Now.wire[1]).normalized();
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

void SessionWindow::ShowNumbers(const SessionSnapshot& now)
{
  const TickReport& report = now.report;
  const auto& names = this->World.wall->Topology().groupName;
  const auto nameOf = [&](int branch)
  {
    const auto n = static_cast<std::size_t>(branch);
    return branch < 0                         ? QString("catheter")
      : n < names.size() && !names[n].empty() ? QString::fromStdString(names[n])
                                              : QString::number(branch);
  };
  this->InstrumentText->setText(
    QString("Beyond the catheter  %1 mm, in %2\nCatheter beyond ostium  %3 mm\n"
            "Hand  %4 N, %5 N mm    Tip  %6 N")
      .arg(Decimal(report.inserted, 1), nameOf(report.branch), Decimal(report.catheterTip, 1),
        Decimal(report.proximalForce, 2), Decimal(report.proximalTorque, 2),
        Decimal(report.tipForce, 2)));
  this->ContrastText->setText(
    QString("%1 mL injected, %2 mL in the arteries,\n%3 mL in the myocardium, %4 mL spilled")
      .arg(now.contrast.injected, 0, 'f', 1)
      .arg(now.contrast.inTree, 0, 'f', 2)
      .arg(now.contrast.blush, 0, 'f', 2)
      .arg(now.contrast.spilled, 0, 'f', 2));
  const SessionMetrics& metrics = now.metrics;
  QString branches;
  QString last;
  for (const int branch : metrics.branches)
  {
    const QString name = nameOf(branch);
    branches += name == last ? QString() : (branches.isEmpty() ? "" : ", ") + name;
    last = name;
  }
  this->MetricsText->setText(
    QString("Time  %1 s    Fluoroscopy  %2 s (cine %3 s)\nDose  %4 mGy, %5 Gy cm%6, %7 frames\n"
            "Contrast  %8 mL    Greatest wall force  %9 N\n")
      .arg(metrics.procedureSeconds, 0, 'f', 0)
      .arg(metrics.fluoroscopySeconds, 0, 'f', 1)
      .arg(metrics.cineSeconds, 0, 'f', 1)
      .arg(metrics.airKerma, 0, 'f', 1)
      .arg(metrics.doseAreaProduct, 0, 'f', 2)
      .arg(QChar(0x00B2))
      .arg(metrics.frames)
      .arg(metrics.contrast, 0, 'f', 1)
      .arg(metrics.maximumWallForce, 0, 'f', 2) +
    QString("Wire moved  %1 mm, turned %2, deepest %3 mm\nPath  %4")
      .arg(metrics.wireTravel, 0, 'f', 0)
      .arg(QString::number(metrics.wireTurning / (2.0 * M_PI), 'f', 1) + " turns")
      .arg(metrics.deepest, 0, 'f', 0)
      .arg(branches));
  // The panel follows what devices make of the view, but not while somebody types into it.
  this->ViewIsOurs = true;
  const auto follow = [](QDoubleSpinBox* box, double value)
  {
    if (!box->hasFocus() && std::abs(box->value() - value) >= 0.5)
    {
      box->setValue(value);
    }
  };
  follow(this->PrimaryBox, now.pose.primary / Degree);
  follow(this->SecondaryBox, now.pose.secondary / Degree);
  follow(this->DistanceBox, now.pose.sourceToDetector);
  for (int axis = 0; axis < 3; ++axis)
  {
    follow(this->TableBoxes[axis], now.input.table[axis]);
  }
  this->ViewIsOurs = false;
  if (std::abs(this->Primary - now.pose.primary) > 2.0 * Degree)
  {
    this->Primary = now.pose.primary;
  }
  if (std::abs(this->Secondary - now.pose.secondary) > 2.0 * Degree)
  {
    this->Secondary = now.pose.secondary;
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
  this->SceneFrameRate = 1000.0 * this->DrawnFrames / static_cast<double>(this->Second.restart());
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
      .arg(this->SceneFrameRate, 0, 'f', 1)
      .arg(this->Scene->NumberOfTriangles()));
  std::size_t runs = 0;
  std::size_t frames = 0;
  GreyImage unused;
  this->Engine->CineFrame(0, SIZE_MAX, unused, runs, frames);
  this->RunSlider->setEnabled(runs > 0);
  this->FrameSlider->setEnabled(runs > 0);
  this->RunSlider->setMaximum(runs > 0 ? static_cast<int>(runs) - 1 : 0);
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
  const auto run = static_cast<std::size_t>(this->RunSlider->value());
  this->Engine->CineFrame(run, SIZE_MAX, image, runs, frames);
  this->FrameSlider->setMaximum(frames > 0 ? static_cast<int>(frames) - 1 : 0);
  const auto frame = static_cast<std::size_t>(this->FrameSlider->value());
  if (this->Engine->CineFrame(run, frame, image, runs, frames))
  {
    this->Monitor->SetImage(image);
    this->Monitor->SetRunText(
      QString("RUN %1/%2  FRAME %3/%4").arg(run + 1).arg(runs).arg(frame + 1).arg(frames));
  }
}

void SessionWindow::TakeDueScreenshots()
{
  while (this->NextScreenshot < this->Options.screenshotSeconds.size() &&
    this->Now.seconds >= this->Options.screenshotSeconds[this->NextScreenshot])
  {
    const QDir folder(QString::fromStdString(this->Options.screenshots));
    const QString at =
      QString("%1s").arg(this->Options.screenshotSeconds[this->NextScreenshot], 6, 'f', 2, '0');
    this->SaveScreenshot(folder.filePath("window_" + at + ".png"));
    this->SaveXRay(folder.filePath("xray_" + at));
    ++this->NextScreenshot;
  }
}

/// Whole or not at all.
bool SavePicture(const QImage& picture, const QString& path)
{
  QSaveFile file(path);
  return file.open(QIODevice::WriteOnly) && picture.save(&file, "PNG") && file.commit();
}

void SessionWindow::SaveScreenshot(const QString& path)
{
  if (!SavePicture(this->grab().toImage(), path))
  {
    this->Problem("Cannot write '" + path + "'.");
    return;
  }
  this->Log->appendPlainText("Saved " + path);
}

/// The last X-ray image, and what was exposed.
void SessionWindow::SaveXRay(const QString& name)
{
  const GreyImage& image = this->Shown.image;
  if (image.values.empty())
  {
    return;
  }
  const SessionSnapshot& moment = this->Shown.moment;
  const QJsonObject about{ { "tick", static_cast<double>(moment.tick) },
    { "seconds", moment.seconds }, { "phase", moment.report.phase },
    { "primary_deg", moment.pose.primary / Degree },
    { "secondary_deg", moment.pose.secondary / Degree },
    { "source_to_detector_mm", moment.pose.sourceToDetector },
    { "source_to_isocentre_mm", moment.pose.sourceToIsocentre },
    { "isocentre_mm",
      QJsonArray{
        moment.pose.isocentre.x(), moment.pose.isocentre.y(), moment.pose.isocentre.z() } },
    { "field_of_view_mm", moment.fieldOfView }, { "background", this->Shown.completeness },
    { "injected_mL", moment.contrast.injected }, { "in_tree_mL", moment.contrast.inTree },
    { "inserted_mm", moment.report.inserted }, { "branch", moment.report.branch } };
  const QImage picture(
    image.values.data(), image.columns, image.rows, image.columns, QImage::Format_Grayscale8);
  QSaveFile text(name + ".json");
  const QByteArray bytes = QJsonDocument(about).toJson();
  const bool written = text.open(QIODevice::WriteOnly) && text.write(bytes) == bytes.size() &&
    text.commit() && SavePicture(picture, name + ".png");
  if (!written)
  {
    this->Problem("Cannot write '" + name + ".json' and its picture.");
  }
}

void SessionWindow::ToggleVideo(bool on)
{
  if (!on)
  {
    if (this->Video)
    {
      try
      {
        this->Video->Finish();
      }
      catch (const std::exception& error)
      {
        this->Problem(error.what());
      }
      this->Video.reset();
    }
    this->VideoAction->setChecked(false);
    return;
  }
  const QString path = this->Options.video.empty()
    ? "simulator-" + QDateTime::currentDateTime().toString("yyyyMMdd-HHmmss") + ".ogv"
    : QString::fromStdString(this->Options.video);
  try
  {
    this->Video = std::make_unique<vtkVideoFile>(path.toStdString(), VideoRate);
    this->VideoClock.start();
    this->Filmed = 0;
    this->VideoAction->setChecked(true);
    this->Log->appendPlainText("Filming into " + path);
  }
  catch (const std::exception& error)
  {
    this->Problem(error.what());
  }
}

void SessionWindow::RecordVideo()
{
  if (!this->Options.video.empty() && !this->Video && this->Now.tick > 0 &&
    !this->VideoClock.isValid())
  {
    this->ToggleVideo(true);
  }
  const double seconds = 1e-3 * static_cast<double>(this->VideoClock.elapsed());
  if (!this->Video || seconds * VideoRate < static_cast<double>(this->Filmed))
  {
    return;
  }
  this->Filmed = static_cast<std::int64_t>(seconds * VideoRate) + 1;
  const QImage picture = this->grab().toImage().convertToFormat(QImage::Format_RGB888);
  this->Video->Add(picture.constBits(), picture.width(), picture.height(),
    static_cast<std::size_t>(picture.bytesPerLine()), seconds);
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
