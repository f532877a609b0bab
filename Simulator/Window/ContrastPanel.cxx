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
  form->addRow(this->Text);
  QObject::connect(inject, &QPushButton::pressed, [this] { this->injects(this->Speed->value()); });
  QObject::connect(inject, &QPushButton::released, [this] { this->injects(0.0); });
}

void ContrastPanel::ShowBalance(const ContrastBalance& balance)
{
  this->Text->setText(
    QString("%1 mL injected, %2 mL in the arteries,\n%3 mL in the myocardium, %4 mL spilled")
      .arg(balance.injected, 0, 'f', 1)
      .arg(balance.inTree, 0, 'f', 2)
      .arg(balance.blush, 0, 'f', 2)
      .arg(balance.spilled, 0, 'f', 2));
}
}
