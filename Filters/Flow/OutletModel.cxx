#include "OutletModel.h"

#include "Require.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double PascalPerMmHg = 133.322387415;
constexpr double CubicMetresPerMillilitre = 1e-6;
constexpr int StepsOfCycle = 400;
constexpr RequireOf RequireSetting{ "outlets" };

/// All outlets as one, in mmHg, mL and s.
struct OneOutlet
{
  double proximal = 0.0;
  double distal = 0.0;
  double compliance = 0.0;
};

struct PeriodicFlow
{
  std::vector<double> flow; ///< mL/s, at k / StepsOfCycle
  double compartment = 0.0; ///< mmHg, at time 0
  double systole = 0.0;     ///< mean of the flow
  double diastole = 0.0;
};

PeriodicFlow FlowOf(
  const OneOutlet& outlet, const OutletModelSettings& settings, double muscleShare)
{
  PeriodicFlow result;
  const double step = settings.cycle / StepsOfCycle;
  const int cycles = 2 + static_cast<int>(std::ceil(10.0 * settings.time / settings.cycle));
  double compartment = settings.pressures.diastolic;
  double before = settings.pressures.Ventricular(0.0);
  int inSystole = 0;
  for (int k = 1; k <= cycles * StepsOfCycle; ++k)
  {
    const double phase = static_cast<double>(k % StepsOfCycle) / StepsOfCycle;
    const double aortic = settings.pressures.Aortic(phase);
    const double ventricular = settings.pressures.Ventricular(phase);
    const double storage = outlet.compliance / step;
    compartment = (storage * (compartment + muscleShare * (ventricular - before)) +
                    aortic / outlet.proximal + settings.venousPressure / outlet.distal) /
      (storage + 1.0 / outlet.proximal + 1.0 / outlet.distal);
    before = ventricular;
    if (k > (cycles - 1) * StepsOfCycle)
    {
      const double flow = (aortic - compartment) / outlet.proximal;
      result.flow.push_back(flow);
      const bool early = phase < settings.pressures.systoleEnd;
      (early ? result.systole : result.diastole) += flow;
      inSystole += early ? 1 : 0;
    }
  }
  // The last one is that of time 0.
  std::rotate(result.flow.begin(), result.flow.end() - 1, result.flow.end());
  result.compartment = compartment;
  result.systole /= inSystole;
  result.diastole /= StepsOfCycle - inSystole;
  return result;
}

std::vector<double> SeriesOf(const std::vector<double>& values, int harmonics, double scale)
{
  std::vector<double> series(1 + 2 * static_cast<std::size_t>(harmonics), 0.0);
  const auto count = static_cast<double>(values.size());
  for (std::size_t n = 0; n < values.size(); ++n)
  {
    const double value = scale * values[n] / count;
    series[0] += value;
    for (int k = 1; k <= harmonics; ++k)
    {
      const double angle = 2.0 * M_PI * k * static_cast<double>(n) / count;
      series[2 * static_cast<std::size_t>(k) - 1] += 2.0 * value * std::cos(angle);
      series[2 * static_cast<std::size_t>(k)] += 2.0 * value * std::sin(angle);
    }
  }
  return series;
}
}

void OutletModelSettings::Validate() const
{
  RequireSetting(this->venousPressure < this->pressures.diastolic, "venousPressure",
    this->venousPressure, "below the diastolic pressure");
  RequireSetting(this->meanFlow > 0.0 && std::isfinite(this->meanFlow), "meanFlow", this->meanFlow,
    "above 0 mL/s");
  RequireSetting(
    Within(this->diastolicRatio, 0.3, 5.0), "diastolicRatio", this->diastolicRatio, "0.3 to 5");
  RequireSetting(Within(this->exponent, 1.0, 4.0), "exponent", this->exponent, "1 to 4");
  RequireSetting(
    Within(this->arterialShare, 0.05, 0.95), "arterialShare", this->arterialShare, "0.05 to 0.95");
  RequireSetting(Within(this->time, 0.02, 5.0), "time", this->time, "0.02 to 5 s");
  RequireSetting(
    this->cycle > 0.0 && std::isfinite(this->cycle), "cycle", this->cycle, "above 0 s");
  RequireSetting(
    this->harmonics >= 1 && this->harmonics <= 40, "harmonics", this->harmonics, "1 to 40");
}

double OutletModel::At(const std::vector<double>& series, double cycle, double time)
{
  double value = series.empty() ? 0.0 : series[0];
  for (std::size_t k = 1; k + 1 < series.size(); k += 2)
  {
    const double angle = 2.0 * M_PI * static_cast<double>((k + 1) / 2) * time / cycle;
    value += series[k] * std::cos(angle) + series[k + 1] * std::sin(angle);
  }
  return value;
}

OutletModel MakeOutletModel(
  const std::vector<double>& diameters, const OutletModelSettings& settings)
{
  settings.Validate();
  Require(!diameters.empty(), "outlets: there is none");
  double sum = 0.0;
  for (const double diameter : diameters)
  {
    Require(diameter > 0.0 && std::isfinite(diameter), "outlets: a diameter is not positive");
    sum += std::pow(diameter, settings.exponent);
  }
  double aortic = 0.0;
  std::vector<double> ventricular;
  for (int k = 0; k < StepsOfCycle; ++k)
  {
    const double phase = static_cast<double>(k) / StepsOfCycle;
    aortic += settings.pressures.Aortic(phase) / StepsOfCycle;
    ventricular.push_back(settings.pressures.Ventricular(phase));
  }
  const double whole = (aortic - settings.venousPressure) / settings.meanFlow;
  const double share = settings.arterialShare;
  const OneOutlet one{ share * whole, (1.0 - share) * whole,
    settings.time / (share * (1.0 - share) * whole) };
  // Flow is linear in the muscle's share of the ventricle's pressure.
  const PeriodicFlow none = FlowOf(one, settings, 0.0);
  const PeriodicFlow full = FlowOf(one, settings, 1.0);
  const double slope =
    (full.diastole - none.diastole) - settings.diastolicRatio * (full.systole - none.systole);
  OutletModel model;
  model.muscleShare = slope > 0.0
    ? std::clamp((settings.diastolicRatio * none.systole - none.diastole) / slope, 0.0, 1.0)
    : 0.0;
  const PeriodicFlow flow = FlowOf(one, settings, model.muscleShare);
  model.diastolicRatio = flow.diastole / flow.systole;
  model.inflow = SeriesOf(flow.flow, settings.harmonics, CubicMetresPerMillilitre);
  model.musclePressure =
    SeriesOf(ventricular, settings.harmonics, model.muscleShare * PascalPerMmHg);
  model.venousPressure = settings.venousPressure * PascalPerMmHg;
  model.startPressure = flow.compartment * PascalPerMmHg;
  constexpr double ResistanceUnit = PascalPerMmHg / CubicMetresPerMillilitre;
  for (const double diameter : diameters)
  {
    const double part = std::pow(diameter, settings.exponent) / sum;
    model.outlets.push_back({ part, one.proximal / part * ResistanceUnit,
      one.distal / part * ResistanceUnit, one.compliance * part / ResistanceUnit });
  }
  return model;
}
}
