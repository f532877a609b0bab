#include "ContrastPanel.h"

#include <QFormLayout>
#include <QHBoxLayout>

namespace coronary
{
ContrastPanel::ContrastPanel()
  : QGroupBox("Contrast medium")
{
  auto* inject =
    PanelButton("Inject (Space)", "Pushes the syringe while it is held, as the key Space does");
  this->Speed->setValue(3.0);
  auto* row = new QHBoxLayout;
  row->addWidget(inject);
  row->addWidget(this->Speed);
  auto* form = new QFormLayout(this);
  form->addRow(row);
  auto* others = new QHBoxLayout;
  const auto add = [&](QPushButton* button, RecordedEvent event)
  {
    others->addWidget(button);
    QObject::connect(button, &QPushButton::clicked, [this, event] { this->chosen(event); });
  };
  add(this->Flush, { RecordedEvent::Flush, 5.0 });
  add(this->Draw, { RecordedEvent::Flush, -2.0 });
  add(this->Nitrates, { RecordedEvent::Incident, 0.0 });
  form->addRow(others);
  auto* happening = new QHBoxLayout;
  happening->addWidget(this->Events);
  happening->addWidget(this->Happens);
  form->addRow(happening);
  form->addRow(this->Text);
  QObject::connect(this->Happens, &QPushButton::clicked,
    [this] {
      this->chosen({ RecordedEvent::Incident, this->Events->currentIndex() + 1.0 });
    });
  QObject::connect(inject, &QPushButton::pressed, [this] { this->injects(this->Speed->value()); });
  QObject::connect(inject, &QPushButton::released, [this] { this->injects(0.0); });
}

void ContrastPanel::ShowScenario(const Scenario& scenario)
{
  this->Flush->setVisible(scenario.contrast.guideLumen);
  this->Draw->setVisible(scenario.contrast.guideLumen);
  const bool any = !scenario.incidents.empty();
  for (QWidget* widget : { static_cast<QWidget*>(this->Nitrates),
         static_cast<QWidget*>(this->Events), static_cast<QWidget*>(this->Happens) })
  {
    widget->setVisible(any);
  }
  this->Events->clear();
  for (const Incident& incident : scenario.incidents)
  {
    const bool spasm = incident.kind == Incident::Kind::Spasm;
    this->Events->addItem(
      QString::fromStdString((spasm ? "spasm " : "air ") + incident.vessel).trimmed());
  }
}

void ContrastPanel::ShowBalance(const ContrastBalance& balance)
{
  this->Text->setText(QString("%1 mL injected, %2 mL in the arteries,\n%3 mL in the myocardium, %4 "
                              "mL spilled,\n%5 mL in the guide, %6 mL in the aorta")
                        .arg(balance.injected, 0, 'f', 1)
                        .arg(balance.inTree, 0, 'f', 2)
                        .arg(balance.blush, 0, 'f', 2)
                        .arg(balance.spilled, 0, 'f', 2)
                        .arg(balance.inGuide, 0, 'f', 2)
                        .arg(balance.inAorta, 0, 'f', 2));
}
}
