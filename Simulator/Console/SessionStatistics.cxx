#include "SessionStatistics.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr std::size_t MostMessages = 1000;
}

SessionStatistics::SessionStatistics(const WallTopology& topology)
  : Names(topology.groupName)
{
}

std::string SessionStatistics::NameOf(int branch) const
{
  const auto n = static_cast<std::size_t>(branch);
  return n < this->Names.size() && !this->Names[n].empty() ? this->Names[n]
                                                           : "branch " + std::to_string(branch);
}

void SessionStatistics::Add(const TickReport& report)
{
  ++this->Count;
  this->TicksWithContact += report.contacts > 0 ? 1 : 0;
  this->Contacts += static_cast<std::uint64_t>(std::max(0, report.contacts));
  this->MostContacts = std::max(this->MostContacts, report.contacts);
  this->MaximumPenetration_ = std::max(this->MaximumPenetration_, report.maximumPenetration);
  this->SumOfPenetrations += report.meanPenetration * std::max(0, report.contacts);
  this->MaximumGap = std::max(this->MaximumGap, report.jointGap);
  this->Outside += static_cast<std::uint64_t>(std::max(0, report.outside));
  this->MaximumProximalForce = std::max(this->MaximumProximalForce, std::abs(report.proximalForce));
  this->MaximumProximalTorque =
    std::max(this->MaximumProximalTorque, std::abs(report.proximalTorque));
  this->MaximumTipForce = std::max(this->MaximumTipForce, report.tipForce);
  this->MaximumContactForce = std::max(this->MaximumContactForce, report.maximumForce);
  this->SumOfTipForces += report.tipForce;
  this->MaximumInserted = std::max(this->MaximumInserted, report.inserted);
  this->Last = report;
  if (report.branch >= 0)
  {
    const auto known = std::find_if(this->Visits.begin(), this->Visits.end(),
      [&](const Visit& visit) { return visit.branch == report.branch; });
    if (known == this->Visits.end())
    {
      this->Visits.push_back({ report.branch, this->Count, 1 });
    }
    else
    {
      ++known->ticks;
    }
  }
}

void SessionStatistics::AddMessage(std::uint64_t tick, const std::string& text)
{
  ++this->MessageCount;
  if (this->List.size() < MostMessages)
  {
    this->List.push_back({ tick, text });
  }
}

std::vector<std::string> SessionStatistics::Branches() const
{
  std::vector<std::string> names;
  for (const Visit& visit : this->Visits)
  {
    names.push_back(this->NameOf(visit.branch));
  }
  return names;
}

nlohmann::json SessionStatistics::ToJson() const
{
  using Json = nlohmann::json;
  const auto mean = [](double sum, std::uint64_t count)
  { return count > 0 ? sum / static_cast<double>(count) : 0.0; };
  Json branches = Json::array();
  for (const Visit& visit : this->Visits)
  {
    branches.push_back({ { "branch", visit.branch }, { "name", this->NameOf(visit.branch) },
      { "first_tick", visit.first }, { "ticks", visit.ticks } });
  }
  Json said = Json::array();
  for (const Said& one : this->List)
  {
    said.push_back({ { "tick", one.tick }, { "text", one.text } });
  }
  return { { "ticks", this->Count },
    { "penetration",
      { { "largest_mm", this->MaximumPenetration_ },
        { "mean_of_contacts_mm", mean(this->SumOfPenetrations, this->Contacts) } } },
    { "largest_joint_gap_mm", this->MaximumGap },
    { "contacts",
      { { "mean", mean(static_cast<double>(this->Contacts), this->Count) },
        { "most", this->MostContacts }, { "ticks_with_contact", this->TicksWithContact } } },
    { "samples_put_back_into_the_lumen", this->Outside },
    { "forces",
      { { "largest_proximal_N", this->MaximumProximalForce },
        { "largest_proximal_N_mm", this->MaximumProximalTorque },
        { "largest_tip_N", this->MaximumTipForce },
        { "mean_tip_N", mean(this->SumOfTipForces, this->Count) },
        { "largest_contact_N", this->MaximumContactForce } } },
    { "inserted", { { "largest_mm", this->MaximumInserted }, { "last_mm", this->Last.inserted } } },
    { "branches", branches }, { "messages", said }, { "number_of_messages", this->MessageCount } };
}
}
