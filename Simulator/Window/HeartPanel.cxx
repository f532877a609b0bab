#include "HeartPanel.h"

#include <QFormLayout>
#include <QSignalBlocker>

#include <cmath>

namespace coronary
{
HeartPanel::HeartPanel()
  : QGroupBox("Heart and breath")
{
  this->Rate->setRange(40, 140);
  auto* form = new QFormLayout(this);
  form->addRow(this->Text, this->Rate);
  form->addRow(this->Pause);
  form->addRow(this->Hold);
  const auto choose = [this]
  {
    const double rate = this->Pause->isChecked() ? 0.0 : this->Rate->value();
    this->SetText(rate);
    this->chosen({ RecordedEvent::HeartRate, rate });
  };
  QObject::connect(this->Rate, &QSlider::valueChanged, [choose](int) { choose(); });
  QObject::connect(this->Pause, &QCheckBox::toggled, [choose](bool) { choose(); });
  QObject::connect(this->Hold, &QCheckBox::toggled,
    [this](bool held) {
      this->chosen({ RecordedEvent::Breaths, held ? 0.0 : this->Breaths });
    });
}

void HeartPanel::ShowBreaths(double rate)
{
  const QSignalBlocker silence(this->Hold);
  this->Hold->setChecked(rate <= 0.0);
  this->Breaths = rate > 0.0 ? rate : this->Breaths;
}

void HeartPanel::ShowRate(double rate)
{
  const QSignalBlocker silence(this->Rate);
  const QSignalBlocker pauseSilence(this->Pause);
  this->Pause->setChecked(rate <= 0.0);
  if (rate > 0.0)
  {
    this->Rate->setValue(static_cast<int>(std::lround(rate)));
  }
  this->SetText(rate);
}

void HeartPanel::SetText(double rate)
{
  this->Text->setText(QString("%1 /min").arg(rate > 0.0 ? rate : this->Rate->value()));
}
}
