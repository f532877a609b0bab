// The controls of a session: panel and tool bar.
#include "vtkSessionWindow.h"

#include "InstrumentCatalogue.h"

#include <QDateTime>
#include <QFileDialog>
#include <QFormLayout>
#include <QGridLayout>
#include <QGroupBox>
#include <QMessageBox>
#include <QRegularExpression>
#include <QScrollArea>
#include <QToolBar>
#include <QVBoxLayout>

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
struct StandardView
{
  const char* name;
  double primary; // degrees
  double secondary;
};

/// Views that coronary angiography is taught with.
constexpr StandardView StandardViews[] = { { "AP", 0.0, 0.0 }, { "RAO 30", -30.0, 0.0 },
  { "RAO 30 CRA 25", -30.0, 25.0 }, { "RAO 20 CAU 20", -20.0, -20.0 }, { "AP CRA 35", 0.0, 35.0 },
  { "AP CAU 30", 0.0, -30.0 }, { "LAO 40", 40.0, 0.0 }, { "LAO 40 CRA 25", 40.0, 25.0 },
  { "LAO 45 CAU 25 (spider)", 45.0, -25.0 }, { "LAO 90", 90.0, 0.0 } };

QDoubleSpinBox* Number(
  double low, double high, double step, int decimals, const QString& unit, const QString& help)
{
  auto* box = new QDoubleSpinBox;
  box->setRange(low, high);
  box->setSingleStep(step);
  box->setDecimals(decimals);
  box->setSuffix(unit.isEmpty() ? unit : " " + unit);
  box->setToolTip(help);
  box->setKeyboardTracking(false);
  box->setFocusPolicy(Qt::ClickFocus);
  return box;
}

/// An angle of the C-arm, which is named by its side and has no sign: "RAO 25". A number alone, with a sign, can be typed.
class AngleBox : public QDoubleSpinBox
{
public:
  AngleBox(double most, const QString& positive, const QString& negative)
    : Positive(positive)
    , Negative(negative)
  {
    this->setRange(-most, most);
    this->setSingleStep(5.0);
    this->setDecimals(0);
    this->setToolTip(positive + " or " + negative);
    this->setKeyboardTracking(false);
    this->setFocusPolicy(Qt::ClickFocus);
  }

  QString textFromValue(double value) const override
  {
    return SideText(value, this->Positive, this->Negative) + QChar(0x00B0);
  }

  double valueFromText(const QString& text) const override
  {
    const QRegularExpressionMatch match = this->Pattern().match(text);
    const bool isNegative = match.captured(1).compare(this->Negative, Qt::CaseInsensitive) == 0;
    return (isNegative ? -1.0 : 1.0) * match.captured(2).toDouble();
  }

  QValidator::State validate(QString& text, int&) const override
  {
    const QRegularExpressionMatch match = this->Pattern().match(text);
    return match.hasMatch() && !match.captured(2).isEmpty() &&
        std::abs(this->valueFromText(text)) <= this->maximum()
      ? QValidator::Acceptable
      : QValidator::Intermediate;
  }

private:
  QRegularExpression Pattern() const
  {
    return QRegularExpression(
      "^\\s*(" + this->Positive + "|" + this->Negative + ")?\\s*(-?\\d*)\\s*\u00B0?\\s*$",
      QRegularExpression::CaseInsensitiveOption);
  }

  QString Positive;
  QString Negative;
};

QPushButton* Button(const QString& text, const QString& help)
{
  auto* button = new QPushButton(text);
  button->setToolTip(help);
  button->setFocusPolicy(Qt::NoFocus);
  return button;
}
}

QWidget* SessionWindow::MakePanel()
{
  auto* inside = new QWidget;
  auto* column = new QVBoxLayout(inside);
  column->setContentsMargins(6, 6, 6, 6);
  column->addWidget(this->MakeInstrumentGroup());
  column->addWidget(this->MakeViewGroup());
  column->addWidget(this->MakeXRayGroup());
  column->addWidget(this->MakeContrastGroup());
  column->addWidget(this->MakeHeartGroup());
  column->addWidget(this->MakeAnatomyGroup());
  this->ForceButton = Button("Confirm forces", "Hands are on the device and ready to feel forces");
  this->ForceButton->hide();
  QObject::connect(this->ForceButton, &QPushButton::clicked,
    [this]
    {
      for (const std::shared_ptr<Device>& device : this->Hardware)
      {
        device->ConfirmForces();
      }
    });
  this->Log = new QPlainTextEdit;
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

QGroupBox* SessionWindow::MakeInstrumentGroup()
{
  auto* group = new QGroupBox("Instruments");
  auto* form = new QFormLayout(group);
  this->WireChoice = new QComboBox;
  this->CatheterChoice = new QComboBox;
  for (const CatalogueWire& one : BuiltInCatalogue().wires)
  {
    this->WireChoice->addItem(QString::fromStdString(one.wire.name));
  }
  for (const CatalogueCatheter& one : BuiltInCatalogue().catheters)
  {
    this->CatheterChoice->addItem(QString::fromStdString(one.catheter.name));
  }
  for (QComboBox* box : { this->WireChoice, this->CatheterChoice })
  {
    box->setFocusPolicy(Qt::NoFocus);
    box->setToolTip("Taken at the next new session");
  }
  this->InstrumentText = new QLabel;
  this->InstrumentText->setTextFormat(Qt::PlainText);
  form->addRow("Wire", this->WireChoice);
  form->addRow("Catheter", this->CatheterChoice);
  form->addRow(this->InstrumentText);
  return group;
}

QGroupBox* SessionWindow::MakeViewGroup()
{
  auto* group = new QGroupBox("C-arm and table");
  auto* form = new QFormLayout(group);
  this->ViewChoice = new QComboBox;
  this->ViewChoice->addItem("Standard view ...");
  for (const StandardView& view : StandardViews)
  {
    this->ViewChoice->addItem(view.name);
  }
  this->ViewChoice->setFocusPolicy(Qt::NoFocus);
  this->PrimaryBox = new AngleBox(105.0, "LAO", "RAO");
  this->SecondaryBox = new AngleBox(50.0, "CRA", "CAU");
  this->DistanceBox = Number(900.0, 1300.0, 10.0, 0, "mm", "Source to detector");
  form->addRow(this->ViewChoice);
  form->addRow("LAO / RAO", this->PrimaryBox);
  form->addRow("CRA / CAU", this->SecondaryBox);
  form->addRow("SID", this->DistanceBox);
  auto* table = new QHBoxLayout;
  const char* const help[] = { "Towards the patient's left", "Backwards", "Towards the head" };
  for (int axis = 0; axis < 3; ++axis)
  {
    this->TableBoxes[axis] = Number(-200.0, 200.0, 5.0, 0, "", help[axis]);
    table->addWidget(this->TableBoxes[axis]);
  }
  form->addRow("Table (mm)", table);
  const auto place = [this](double) { this->PlaceView(); };
  for (QDoubleSpinBox* box : { this->PrimaryBox, this->SecondaryBox, this->DistanceBox,
         this->TableBoxes[0], this->TableBoxes[1], this->TableBoxes[2] })
  {
    QObject::connect(box, QOverload<double>::of(&QDoubleSpinBox::valueChanged), place);
  }
  QObject::connect(this->ViewChoice, QOverload<int>::of(&QComboBox::activated),
    [this](int index)
    {
      if (index > 0)
      {
        const StandardView& view = StandardViews[index - 1];
        this->PrimaryBox->setValue(view.primary);
        this->SecondaryBox->setValue(view.secondary);
        this->ViewChoice->setCurrentIndex(0);
      }
    });
  return group;
}

QGroupBox* SessionWindow::MakeXRayGroup()
{
  auto* group = new QGroupBox("X-ray");
  auto* form = new QFormLayout(group);
  auto* row = new QHBoxLayout;
  this->FluoroscopyButton = Button("Fluoroscopy", "Radiation while it is held; key F");
  auto* cine = Button("Cine", "A run that is stored, while it is held; key C");
  auto* mask = Button("Mask", "The next frame becomes the mask of subtraction and roadmap; key M");
  row->addWidget(this->FluoroscopyButton);
  row->addWidget(cine);
  row->addWidget(mask);
  form->addRow(row);
  this->FluoroscopyHold = new QCheckBox("Hold the pedal down");
  this->FluoroscopyHold->setFocusPolicy(Qt::NoFocus);
  form->addRow(this->FluoroscopyHold);
  const auto pedal = [this](QPushButton* button, std::uint32_t bit)
  {
    QObject::connect(
      button, &QPushButton::pressed, [this, bit] { this->Panel->SetPedal(bit, true); });
    QObject::connect(
      button, &QPushButton::released, [this, bit] { this->Panel->SetPedal(bit, false); });
  };
  pedal(cine, CinePedal);
  pedal(mask, MaskPedal);
  const auto fluoroscopy = [this] { this->PressFluoroscopy(); };
  QObject::connect(this->FluoroscopyButton, &QPushButton::pressed, fluoroscopy);
  QObject::connect(this->FluoroscopyButton, &QPushButton::released, fluoroscopy);
  QObject::connect(this->FluoroscopyHold, &QCheckBox::toggled, fluoroscopy);
  this->RateChoice = new QComboBox;
  this->RateChoice->addItem("7.5 frames/s", 7.5);
  this->RateChoice->addItem("15 frames/s", 15.0);
  this->RateChoice->addItem("30 frames/s", 30.0);
  this->ModeChoice = new QComboBox;
  this->ModeChoice->addItems({ "Plain", "Subtraction (DSA)", "Roadmap" });
  this->FieldChoice = new QComboBox;
  for (const double field : { 130.0, 170.0, 200.0, 250.0, 300.0 })
  {
    this->FieldChoice->addItem(QString("%1 mm").arg(field), field);
  }
  for (QComboBox* box : { this->RateChoice, this->ModeChoice, this->FieldChoice })
  {
    box->setFocusPolicy(Qt::NoFocus);
  }
  form->addRow("Rate", this->RateChoice);
  form->addRow("Image", this->ModeChoice);
  form->addRow("Field", this->FieldChoice);
  // What is chosen is for this session, if there is one, and for the next ones.
  const auto set = [this](QComboBox* box, RecordedEvent::Kind kind, double ImagingSettings::*value)
  {
    QObject::connect(box, QOverload<int>::of(&QComboBox::activated),
      [this, box, kind, value](int)
      {
        const double chosen = box->currentData().toDouble();
        this->World.scenario.imaging.*value = chosen;
        this->Post({ kind, chosen });
      });
  };
  set(this->RateChoice, RecordedEvent::FrameRate, &ImagingSettings::frameRate);
  set(this->FieldChoice, RecordedEvent::FieldOfView, &ImagingSettings::fieldOfView);
  QObject::connect(this->ModeChoice, QOverload<int>::of(&QComboBox::activated),
    [this](int index)
    {
      this->Mode = static_cast<ImageMode>(index);
      if (this->Engine)
      {
        this->Engine->SetImageMode(this->Mode);
      }
    });
  this->RunSlider = new QSlider(Qt::Horizontal);
  this->FrameSlider = new QSlider(Qt::Horizontal);
  for (QSlider* slider : { this->RunSlider, this->FrameSlider })
  {
    slider->setEnabled(false);
    slider->setFocusPolicy(Qt::NoFocus);
    QObject::connect(slider, &QSlider::sliderMoved, [this](int) { this->ShowCine(); });
  }
  this->RunSlider->setToolTip("Stored cine runs");
  this->FrameSlider->setToolTip("Frames of the run");
  form->addRow("Cine run", this->RunSlider);
  form->addRow("Frame", this->FrameSlider);
  return group;
}

QGroupBox* SessionWindow::MakeContrastGroup()
{
  auto* group = new QGroupBox("Contrast medium");
  auto* form = new QFormLayout(group);
  auto* inject =
    Button("Inject (Space)", "Pushes the syringe while it is held, as the key Space does");
  this->InjectionBox = Number(0.5, 10.0, 0.5, 1, "mL/s", "How fast the button pushes");
  this->InjectionBox->setValue(3.0);
  auto* row = new QHBoxLayout;
  row->addWidget(inject);
  row->addWidget(this->InjectionBox);
  form->addRow(row);
  this->ContrastText = new QLabel;
  form->addRow(this->ContrastText);
  QObject::connect(inject, &QPushButton::pressed,
    [this] { this->Panel->SetInjection(this->InjectionBox->value()); });
  QObject::connect(inject, &QPushButton::released, [this] { this->Panel->SetInjection(0.0); });
  return group;
}

QGroupBox* SessionWindow::MakeHeartGroup()
{
  auto* group = new QGroupBox("Heart");
  auto* form = new QFormLayout(group);
  this->HeartSlider = new QSlider(Qt::Horizontal);
  this->HeartSlider->setRange(40, 140);
  this->HeartSlider->setFocusPolicy(Qt::NoFocus);
  this->HeartText = new QLabel;
  this->HeartPause = new QCheckBox("Standing still");
  this->HeartPause->setFocusPolicy(Qt::NoFocus);
  form->addRow(this->HeartText, this->HeartSlider);
  form->addRow(this->HeartPause);
  const auto set = [this]
  {
    const double rate = this->HeartPause->isChecked() ? 0.0 : this->HeartSlider->value();
    this->HeartText->setText(QString("%1 /min").arg(this->HeartSlider->value()));
    this->World.scenario.settings.heartRate = rate;
    this->Post({ RecordedEvent::HeartRate, rate });
  };
  QObject::connect(this->HeartSlider, &QSlider::valueChanged, [set](int) { set(); });
  QObject::connect(this->HeartPause, &QCheckBox::toggled, [set](bool) { set(); });
  return group;
}

QGroupBox* SessionWindow::MakeAnatomyGroup()
{
  auto* group = new QGroupBox("Anatomy");
  auto* grid = new QGridLayout(group);
  auto* heart = new QCheckBox("Heart");
  auto* medium = new QCheckBox("Contrast");
  auto* opacity = new QSlider(Qt::Horizontal);
  opacity->setRange(0, 100);
  opacity->setValue(38);
  opacity->setToolTip("Opacity of the arteries");
  auto* asCArm = Button("As the C-arm", "Looks at the anatomy from the detector");
  auto* front = Button("Front", "Looks at all of it from the front");
  for (QCheckBox* box : { heart, medium })
  {
    box->setChecked(true);
    box->setFocusPolicy(Qt::NoFocus);
  }
  heart->setChecked(this->Options.heart);
  heart->setEnabled(this->Options.heart);
  opacity->setFocusPolicy(Qt::NoFocus);
  grid->addWidget(heart, 0, 0);
  grid->addWidget(medium, 0, 1);
  grid->addWidget(opacity, 1, 0, 1, 2);
  grid->addWidget(asCArm, 2, 0);
  grid->addWidget(front, 2, 1);
  QObject::connect(heart, &QCheckBox::toggled, [this](bool on) { this->Scene->ShowHeart(on); });
  QObject::connect(medium, &QCheckBox::toggled, [this](bool on) { this->Scene->ShowTracers(on); });
  QObject::connect(opacity, &QSlider::valueChanged,
    [this](int value) { this->Scene->SetWallOpacity(0.01 * value); });
  QObject::connect(
    asCArm, &QPushButton::clicked, [this] { this->Scene->LookAsCArm(this->Now.pose); });
  QObject::connect(front, &QPushButton::clicked, [this] { this->Scene->LookFromFront(); });
  return group;
}

QWidget* SessionWindow::MakeMetrics()
{
  this->MetricsText = new QLabel;
  this->MetricsText->setTextFormat(Qt::PlainText);
  this->MetricsText->setWordWrap(true);
  this->MetricsText->setFixedWidth(400);
  this->MetricsText->setMargin(8);
  this->MetricsText->setStyleSheet("background: rgb(8, 10, 12); color: rgb(225, 232, 235);");
  this->MetricsText->setToolTip("What distinguishes trainees");
  return this->MetricsText;
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
    [this](bool)
    {
      this->SaveScreenshot(
        "simulator-" + QDateTime::currentDateTime().toString("yyyyMMdd-HHmmss-zzz") + ".png");
    });
  this->VideoAction =
    add("Video", "Films the window into a file", [this](bool on) { this->ToggleVideo(on); });
  this->VideoAction->setCheckable(true);
  bar->addSeparator();
  add("Help", "Keys and mouse",
    [this](bool)
    {
      QString text = "<table>";
      for (const KeyBinding& binding : KeyboardDevice::KeyMap())
      {
        text +=
          QString("<tr><td><b>%1</b>&nbsp;&nbsp;</td><td>%2</td></tr>")
            .arg(QString(binding.key).toHtmlEscaped(), QString(binding.meaning).toHtmlEscaped());
      }
      text += "</table><p>Wheel on the X-ray image: the wire forth and back; with Shift it turns; "
              "with Control the catheter. Right button drags the C-arm.</p>";
      QMessageBox::information(this, "Keys and mouse", text);
    });
}
}
