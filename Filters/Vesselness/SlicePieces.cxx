#include "SlicePieces.h"

#include <algorithm>

namespace coronary
{
void DropTwigs(
  std::vector<SlicePiece>& pieces, std::vector<std::pair<std::int32_t, std::int32_t>> contacts)
{
  std::sort(contacts.begin(), contacts.end());
  contacts.erase(std::unique(contacts.begin(), contacts.end()), contacts.end());
  std::vector<std::vector<std::int32_t>> touching(pieces.size());
  for (const auto& [a, b] : contacts)
  {
    touching[a].push_back(b);
    touching[b].push_back(a);
  }
  std::vector<std::int32_t> tips;
  std::vector<int> degree(pieces.size());
  for (std::size_t p = 0; p < pieces.size(); ++p)
  {
    degree[p] = static_cast<int>(touching[p].size());
    if (degree[p] <= 1)
    {
      tips.push_back(static_cast<std::int32_t>(p));
    }
  }
  while (!tips.empty())
  {
    const std::int32_t tip = tips.back();
    tips.pop_back();
    if (pieces[tip].strong || pieces[tip].dropped || pieces[tip].slice == 0)
    {
      continue;
    }
    pieces[tip].dropped = true;
    pieces[tip].twig = true;
    for (const std::int32_t next : touching[tip])
    {
      if (--degree[next] == 1)
      {
        tips.push_back(next);
      }
    }
  }
}
}
