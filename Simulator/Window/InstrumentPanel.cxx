#include "InstrumentPanel.h"

#include "InstrumentCatalogue.h"

#include <QFormLayout>

namespace coronary
{
InstrumentPanel::InstrumentPanel()
  : QGroupBox("Instruments")
{
  for (const CatalogueWire& one : BuiltInCatalogue().wires)
  {
    this->Wire->addItem(QString::fromStdString(one.wire.name));
  }
  for (const CatalogueCatheter& one : BuiltInCatalogue().catheters)
  {
    this->Catheter->addItem(QString::fromStdString(one.catheter.name));
  }
  for (QComboBox* box : { this->Wire, this->Catheter })
  {
    box->setToolTip("Taken at the next new session");
  }
  this->Text->setTextFormat(Qt::PlainText);
  auto* form = new QFormLayout(this);
  form->addRow("Wire", this->Wire);
  form->addRow("Catheter", this->Catheter);
  form->addRow(this->Text);
}

void InstrumentPanel::ShowScenario(const Scenario& scenario)
{
  Choose(*this->Wire, QString::fromStdString(scenario.wire.name), {});
  Choose(*this->Catheter, QString::fromStdString(scenario.catheter.name), {});
}

void InstrumentPanel::ShowReport(const TickReport& report, const WallTopology& topology)
{
  this->Text->setText(QString("Beyond the catheter  %1 mm, in %2\nCatheter beyond ostium  %3 mm\n"
                              "Hand  %4 N, %5 N mm    Tip  %6 N")
                        .arg(Decimal(report.inserted, 1), BranchName(topology, report.branch),
                          Decimal(report.catheterTip, 1), Decimal(report.proximalForce, 2),
                          Decimal(report.proximalTorque, 2), Decimal(report.tipForce, 2)));
}

void InstrumentPanel::Take(Scenario& scenario) const
{
  const auto wire = this->Wire->currentText().toStdString();
  const auto catheter = this->Catheter->currentText().toStdString();
  if (wire != scenario.wire.name)
  {
    scenario.wire = BuiltInCatalogue().Wire(wire).wire;
  }
  if (catheter != scenario.catheter.name)
  {
    scenario.catheter = BuiltInCatalogue().Catheter(catheter).catheter;
  }
}
}
