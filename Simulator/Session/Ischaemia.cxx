#include "Ischaemia.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace coronary
{
namespace
{
constexpr double ShiftOfAll = 1.0;  // mV, of a whole heart without blood
constexpr double OnsetTime = 66.0;  // s: 0.1 of 0.4 mV after 19 s
constexpr double ReturnTime = 14.4; // s: from 0.4 back to 0.1 mV in 20 s
constexpr double Shortage = 0.02;   // of what a tip needs: less is none
constexpr double Collateral = 0.02; // of the healthy flow: a tip that had less lives of others
}

Ischaemia::Ischaemia(const CoronaryFlow& flow)
{
  const FlowNetwork& network = flow.Network();
  const std::vector<double>& healthy = flow.HealthyTipFlows();
  const std::vector<double> now = flow.TipFlows();
  double all = 0.0;
  for (std::size_t n = 0; n < healthy.size(); ++n)
  {
    if (network.IsTip(static_cast<int>(n)) && healthy[n] > 0.0)
    {
      Tip tip;
      tip.node = static_cast<int>(n);
      tip.branch = network.Segments()[network.Nodes()[n].above].branch;
      tip.share = healthy[n];
      const double before = now[n] / healthy[n];
      tip.needs = before < Collateral ? 0.0 : std::min(CoronaryFlow::LeastSupply, before);
      all += tip.share;
      this->Tips.push_back(tip);
    }
  }
  for (Tip& tip : this->Tips)
  {
    tip.needs *= tip.share;
    tip.share /= all;
  }
}

void Ischaemia::SetFlow(const CoronaryFlow& flow)
{
  const std::vector<double> now = flow.TipFlows();
  for (Tip& tip : this->Tips)
  {
    const double lacks = tip.needs > 0.0 ? 1.0 - now[tip.node] / tip.needs : 0.0;
    tip.lacks = lacks > Shortage ? std::min(lacks, 1.0) : 0.0;
  }
}

void Ischaemia::Step(double seconds)
{
  for (Tip& tip : this->Tips)
  {
    const double time = tip.lacks > tip.injury ? OnsetTime : ReturnTime;
    tip.injury += -std::expm1(-seconds / time) * (tip.lacks - tip.injury);
  }
  this->Up = this->StShift() >= (this->Up ? Back : Elevated);
}

double Ischaemia::StShift() const
{
  double sum = 0.0;
  for (const Tip& tip : this->Tips)
  {
    sum += tip.share * tip.injury;
  }
  return ShiftOfAll * sum;
}

double Ischaemia::ShareWithout() const
{
  double sum = 0.0;
  for (const Tip& tip : this->Tips)
  {
    sum += tip.lacks > 0.0 ? tip.share : 0.0;
  }
  return sum;
}

std::vector<int> Ischaemia::BranchesWithout() const
{
  std::vector<Tip> without;
  std::copy_if(this->Tips.begin(), this->Tips.end(), std::back_inserter(without),
    [](const Tip& tip) { return tip.lacks > 0.0; });
  std::stable_sort(
    without.begin(), without.end(), [](const Tip& a, const Tip& b) { return a.share > b.share; });
  std::vector<int> branches;
  std::transform(without.begin(), without.end(), std::back_inserter(branches),
    [](const Tip& tip) { return tip.branch; });
  return branches;
}
}
