#include "InstrumentPanel.h"

#include "InstrumentCatalogue.h"
#include "Numbers.h"

#include <QFormLayout>

namespace coronary
{
namespace
{
const char* const NoBalloon = "none";
constexpr double MouthTold = 0.05; // of the diameter, that it is narrower than before

/// Of two wires, where the other one is.
QString TextOfWires(const SessionSnapshot& moment, const WallTopology& topology)
{
  const TickReport& report = moment.report;
  if (moment.secondWire.empty())
  {
    return {};
  }
  const WireReport& other = report.wires[1 - report.hand];
  QString text = QString("\nIn hand: the %1 wire. The other  %2 mm, in %3")
                   .arg(report.hand == 0 ? "first" : "second", Decimal(other.inserted, 1),
                     BranchName(topology, other.branch));
  for (const WireReport& wire : report.wires)
  {
    text += wire.held > 0.0
      ? QString("\n%1 mm of the %2 wire are %3, %4 N")
          .arg(Decimal(wire.held, 1), &wire == &report.wires[0] ? "first" : "second",
            wire.jailed ? "jailed" : "held", Decimal(wire.grip, 2))
      : QString();
  }
  return text;
}

QString TextOfCatheter(const TickReport& report)
{
  if (report.catheterTip < 0.0)
  {
    return QString("Catheter in the aorta, %1 mm from ostium").arg(Decimal(-report.catheterTip, 1));
  }
  const QString text = QString("Catheter beyond ostium  %1 mm").arg(Decimal(report.catheterTip, 1));
  return report.seat.engaged
    ? text + QString(", %1 deg").arg(Decimal(report.seat.angle / Degree, 0))
    : text;
}

/// The balloon, lesions and stents as they are now.
QString TextOfBalloon(const SessionSnapshot& moment, bool hasBalloon)
{
  const BalloonReport& balloon = moment.report.balloon;
  QString text;
  if (hasBalloon && balloon.microcatheter)
  {
    text += QString("\nMicrocatheter  %1 mm out, hand %2 N\nWire  %3 mm beyond it")
              .arg(Decimal(balloon.tip, 1), Decimal(balloon.force, 2),
                Decimal(moment.report.inserted - balloon.tip, 1));
  }
  else if (hasBalloon)
  {
    text += QString("\nBalloon  %1 mm out, %2 atm\n%3 to %4 mm wide, hand %5 N")
              .arg(Decimal(balloon.tip, 1), Decimal(balloon.pressure, 1), Decimal(balloon.least, 2),
                Decimal(balloon.greatest, 2), Decimal(balloon.force, 2));
    text += balloon.crimped ? "\nStent on it, not opened" : "";
  }
  for (const LesionResult& lesion : moment.lesions)
  {
    text += QString("\nLesion in %1  %2 % (was %3)\nPd/Pa %4, FFR %5")
              .arg(QString::fromStdString(lesion.vessel), Decimal(100.0 * lesion.degree, 0),
                Decimal(100.0 * lesion.degreeBefore, 0), Decimal(lesion.pressureRatio, 2),
                Decimal(lesion.reserve, 2));
  }
  for (const MouthResult& mouth : moment.mouths)
  {
    if (mouth.degree > mouth.degreeBefore + MouthTold)
    {
      text += QString("\nMouth of %1  %2, FFR %3")
                .arg(QString::fromStdString(mouth.vessel),
                  mouth.closed ? QString("closed") : Decimal(100.0 * mouth.degree, 0) + " %",
                  Decimal(mouth.reserve, 2));
    }
  }
  for (const StentResult& stent : moment.results)
  {
    if (const StentRingResult* narrowest = stent.Narrowest())
    {
      text += QString("\nStent in %1  least %2 mm, %3 % of area\nresidual %4 %, gap %5 mm")
                .arg(QString::fromStdString(stent.vessel), Decimal(narrowest->diameter, 2),
                  Decimal(100.0 * stent.LeastExpanded()->Expansion(), 0),
                  Decimal(100.0 * stent.residual, 0), Decimal(stent.GreatestGap()->gap, 2));
    }
  }
  return text;
}
}

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
  this->Balloon->addItem(NoBalloon);
  for (const CatalogueBalloon& one : BuiltInCatalogue().balloons)
  {
    this->Balloon->addItem(QString::fromStdString(one.balloon.name));
  }
  for (const CatalogueBalloon& one : BuiltInCatalogue().microcatheters)
  {
    this->Balloon->addItem(QString::fromStdString(one.balloon.name));
  }
  for (QComboBox* box : { this->Wire, this->Catheter, this->Balloon })
  {
    box->setToolTip("Taken at the next new session");
  }
  this->FromArch->setToolTip(
    "At the next new session it lies in the aorta, and has to be brought to the ostium");
  this->Text->setTextFormat(Qt::PlainText);
  this->Text->setWordWrap(true);
  auto* form = new QFormLayout(this);
  form->addRow("Wire", this->Wire);
  form->addRow("Catheter", this->Catheter);
  form->addRow("", this->FromArch);
  form->addRow("Balloon", this->Balloon);
  form->addRow(this->OtherWire);
  form->addRow(this->NextWire.button);
  form->addRow(this->NextBalloon.button);
  form->addRow(this->Text);
  this->NextWire.button->setToolTip(
    "Once the wire is drawn back into the guide catheter, or to a microcatheter's tip");
  this->NextBalloon.button->setToolTip(
    "Once the balloon or microcatheter is wholly in the guide catheter, and empty");
  const auto exchanges = [this](const NextButton& next, RecordedEvent::Kind kind)
  {
    QObject::connect(next.button, &QPushButton::clicked,
      [this, &next, kind] {
        this->chosen({ kind, static_cast<double>(next.Next()) });
      });
  };
  exchanges(this->NextWire, RecordedEvent::ExchangeWire);
  exchanges(this->NextBalloon, RecordedEvent::Exchange);
  QObject::connect(this->OtherWire, &QPushButton::clicked,
    [this] {
      this->chosen({ RecordedEvent::TakeWire, static_cast<double>(1 - this->Hand) });
    });
}

void InstrumentPanel::NextButton::Show() const
{
  const bool has = this->names.size() > 1;
  this->button->setVisible(has);
  if (has)
  {
    this->button->setText("Exchange for " + QString::fromStdString(this->names[this->Next()]));
  }
}

void InstrumentPanel::NextButton::Use(std::size_t number)
{
  if (number != this->inUse)
  {
    this->inUse = number;
    this->Show();
  }
}

void InstrumentPanel::ShowScenario(const Scenario& scenario, bool aorta)
{
  this->FromArch->setEnabled(aorta);
  this->FromArch->setChecked(aorta && scenario.settings.guideFromArch);
  Choose(*this->Wire, QString::fromStdString(scenario.wire.name), {});
  Choose(*this->Catheter, QString::fromStdString(scenario.catheter.name), {});
  Choose(*this->Balloon,
    scenario.balloon ? QString::fromStdString(scenario.balloon->name) : QString(NoBalloon), {});
  this->NextWire.names.clear();
  for (std::size_t n = 0; const Guidewire* one = WireOf(scenario, n); ++n)
  {
    this->NextWire.names.push_back(one->name);
  }
  this->NextBalloon.names.clear();
  for (std::size_t n = 0; const BalloonCatheter* one = BalloonOf(scenario, n); ++n)
  {
    this->NextBalloon.names.push_back(one->name);
  }
  for (NextButton* next : { &this->NextWire, &this->NextBalloon })
  {
    next->inUse = 0;
    next->Show();
  }
  this->OtherWire->setVisible(scenario.secondWire.has_value());
  this->ShowHand(0);
}

void InstrumentPanel::ShowHand(std::size_t hand)
{
  this->Hand = hand;
  this->OtherWire->setText(hand == 0 ? "Take the second wire" : "Take the first wire");
}

void InstrumentPanel::ShowMoment(const SessionSnapshot& moment, const WallTopology& topology)
{
  const TickReport& report = moment.report;
  this->NextWire.Use(report.hand == 0 ? moment.wireNumber : moment.secondNumber);
  if (report.hand != this->Hand)
  {
    this->ShowHand(report.hand);
  }
  this->NextBalloon.Use(moment.balloonNumber);
  this->Text->setText(QString("Beyond the catheter  %1 mm, in %2\n%3\n"
                              "Hand  %4 N, %5 N mm    Tip  %6 N")
                        .arg(Decimal(report.inserted, 1), BranchName(topology, report.branch),
                          TextOfCatheter(report), Decimal(report.proximalForce, 2),
                          Decimal(report.proximalTorque, 2), Decimal(report.tipForce, 2)) +
    TextOfWires(moment, topology) + TextOfBalloon(moment, !this->NextBalloon.names.empty()));
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
  scenario.settings.guideFromArch = this->FromArch->isChecked();
  const auto balloon = this->Balloon->currentText().toStdString();
  if (balloon == NoBalloon)
  {
    scenario.balloon.reset();
    scenario.exchanges.clear();
  }
  else if (!scenario.balloon || scenario.balloon->name != balloon)
  {
    scenario.balloon = BuiltInCatalogue().Balloon(balloon).balloon;
  }
}
}
