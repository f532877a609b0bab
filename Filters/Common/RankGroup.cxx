#include "RankGroup.h"

namespace coronary
{
RankGroup::~RankGroup() = default;

std::vector<std::string> RankGroup::Gather(const std::string& own)
{
  return { own };
}

void RankGroup::Collect(const void* own, std::size_t size, void* all)
{
  std::memmove(all, own, size);
}

std::string RankGroup::FromFirst(const std::string& text)
{
  return this->Gather(this->IsFirst() ? text : std::string()).front();
}

RankGroup& RankGroup::Alone()
{
  static RankGroup alone;
  return alone;
}
}
