#include "XRayPanel.h"

#include "SessionInput.h"

#include <QFormLayout>
#include <QHBoxLayout>
#include <QSignalBlocker>

#include <utility>

namespace coronary
{
namespace
{
constexpr int MostShutter = 45; // percent

QString RateText(double rate)
{
  return QString("%1 frames/s").arg(rate);
}

QString FieldText(double field)
{
  return QString("%1 mm").arg(field);
}
}

XRayPanel::XRayPanel()
  : QGroupBox("X-ray")
{
  auto* form = new QFormLayout(this);
  auto* row = new QHBoxLayout;
  auto* cine = PanelButton("Cine", "A run that is stored, while it is held; key C");
  auto* mask =
    PanelButton("Mask", "The next frame becomes the mask of subtraction and roadmap; key M");
  row->addWidget(this->Fluoroscopy);
  row->addWidget(cine);
  row->addWidget(mask);
  form->addRow(row);
  form->addRow(this->Hold);
  const auto pedal = [this](QPushButton* button, std::uint32_t bit)
  {
    QObject::connect(button, &QPushButton::pressed, [this, bit] { this->pedalMoved(bit, true); });
    QObject::connect(button, &QPushButton::released, [this, bit] { this->pedalMoved(bit, false); });
  };
  pedal(cine, CinePedal);
  pedal(mask, MaskPedal);
  const auto fluoroscopy = [this] { this->PressFluoroscopy(); };
  QObject::connect(this->Fluoroscopy, &QPushButton::pressed, fluoroscopy);
  QObject::connect(this->Fluoroscopy, &QPushButton::released, fluoroscopy);
  QObject::connect(this->Hold, &QCheckBox::toggled, fluoroscopy);

  for (const double rate : { 7.5, 15.0, 30.0 })
  {
    this->Rates->addItem(RateText(rate), rate);
  }
  this->Modes->addItems({ "Plain", "Subtraction (DSA)", "Roadmap" });
  for (const double field : { 130.0, 170.0, 200.0, 250.0, 300.0 })
  {
    this->Fields->addItem(FieldText(field), field);
  }
  form->addRow("Rate", this->Rates);
  form->addRow("Image", this->Modes);
  form->addRow("Field", this->Fields);
  auto* shutters = new QHBoxLayout;
  for (const auto& [slider, kind] : { std::pair(this->Sides, RecordedEvent::ShutterSides),
         std::pair(this->Ends, RecordedEvent::ShutterEnds) })
  {
    slider->setMaximum(MostShutter);
    shutters->addWidget(slider);
    QObject::connect(slider, &QSlider::valueChanged,
      [this, kind = kind](int percent) {
        this->chosen({ kind, 0.01 * percent });
      });
  }
  form->addRow("Shutters", shutters);
  this->Offer(*this->Rates, RecordedEvent::FrameRate);
  this->Offer(*this->Fields, RecordedEvent::FieldOfView);
  QObject::connect(this->Modes, QOverload<int>::of(&QComboBox::activated),
    [this](int) { this->modeChosen(this->Mode()); });

  for (QSlider* slider : { this->Runs, this->Frames })
  {
    slider->setEnabled(false);
    QObject::connect(slider, &QSlider::sliderMoved, [this](int) { this->frameChosen(); });
  }
  form->addRow("Cine run", this->Runs);
  form->addRow("Frame", this->Frames);
  form->addRow(this->Enhance);
  this->Enhance->setToolTip("The run's frames, laid over each other by the balloon's markers");
  QObject::connect(this->Enhance, &QCheckBox::toggled, [this](bool) { this->frameChosen(); });
}

void XRayPanel::Offer(QComboBox& box, RecordedEvent::Kind kind)
{
  QObject::connect(&box, QOverload<int>::of(&QComboBox::activated),
    [this, &box, kind](int) {
      this->chosen({ kind, box.currentData().toDouble() });
    });
}

void XRayPanel::ShowScenario(const ImagingSettings& imaging)
{
  for (QSlider* slider : { this->Sides, this->Ends })
  {
    const QSignalBlocker silence(slider); // a session begins without shutters
    slider->setValue(0);
  }
  Choose(*this->Rates, RateText(imaging.frameRate), imaging.frameRate);
  Choose(*this->Fields, FieldText(imaging.fieldOfView), imaging.fieldOfView);
}

void XRayPanel::PressFluoroscopy()
{
  this->pedalMoved(FluoroscopyPedal, this->Fluoroscopy->isDown() || this->Hold->isChecked());
}

void XRayPanel::SetRuns(std::size_t count)
{
  this->Runs->setEnabled(count > 0);
  this->Frames->setEnabled(count > 0);
  this->Runs->setMaximum(count > 0 ? static_cast<int>(count) - 1 : 0);
}

void XRayPanel::SetFrames(std::size_t count)
{
  this->Frames->setMaximum(count > 0 ? static_cast<int>(count) - 1 : 0);
}
}
