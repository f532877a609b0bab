#include "ItemSharing.h"

#include <numeric>

namespace coronary
{
ItemSharing::~ItemSharing() = default;

std::vector<std::string> ItemSharing::Results(
  const std::vector<std::size_t>& items, const Work& work)
{
  std::vector<std::string> results;
  results.reserve(items.size());
  for (const std::size_t item : items)
  {
    results.push_back(work(item));
  }
  return results;
}

std::vector<std::string> ItemSharing::ResultsOfAll(std::size_t count, const Work& work)
{
  std::vector<std::size_t> items(count);
  std::iota(items.begin(), items.end(), std::size_t{ 0 });
  return this->Results(items, work);
}

ItemSharing& ItemSharing::None()
{
  static ItemSharing none;
  return none;
}
}
