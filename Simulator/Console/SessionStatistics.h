/**
 * @file SessionStatistics.h
 * @brief What comes together over the ticks of a session.
 */
#ifndef DynamicCoronary_SessionStatistics_h
#define DynamicCoronary_SessionStatistics_h

#include "Intervention.h"
#include "WallMotion.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
class SessionStatistics
{
public:
  explicit SessionStatistics(const WallTopology& topology);

  void Add(const TickReport& report);
  void AddMessage(std::uint64_t tick, const std::string& text);

  std::uint64_t Ticks() const { return this->Count; }
  std::uint64_t Messages() const { return this->MessageCount; }
  double MaximumPenetration() const { return this->MaximumPenetration_; }
  std::vector<std::string> Branches() const; ///< in the order in which they were reached

  nlohmann::json ToJson() const;

private:
  struct Visit
  {
    int branch;
    std::uint64_t first;
    std::uint64_t ticks;
  };
  struct Said
  {
    std::uint64_t tick;
    std::string text;
  };

  std::string NameOf(int branch) const;

  std::vector<std::string> Names;
  std::uint64_t Count = 0;
  std::uint64_t TicksWithContact = 0;
  std::uint64_t Contacts = 0;
  int MostContacts = 0;
  double MaximumPenetration_ = 0.0;
  double SumOfPenetrations = 0.0; ///< of the samples that touch
  double MaximumGap = 0.0;
  std::uint64_t Outside = 0;
  double MaximumProximalForce = 0.0;
  double MaximumProximalTorque = 0.0;
  double MaximumTipForce = 0.0;
  double MaximumContactForce = 0.0;
  double SumOfTipForces = 0.0;
  double MaximumInserted = 0.0;
  TickReport Last;
  std::vector<Visit> Visits;
  std::vector<Said> List;
  std::uint64_t MessageCount = 0;
};
}

#endif
