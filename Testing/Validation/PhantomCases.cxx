#include "PhantomCases.h"

#include <CLI/CLI.hpp>

namespace coronary
{
std::vector<std::uint64_t> ParseSeeds(const std::string& text, LoneNumber meaning)
{
  const bool alone = meaning == LoneNumber::Seed;
  const auto number = [&](const std::string& part)
  {
    if (part.empty() || part.size() > 18 ||
      part.find_first_not_of("0123456789") != std::string::npos)
    {
      throw CLI::ValidationError(
        "seeds", "'" + text + "' is neither a " + (alone ? "seed" : "count") + " nor first..last");
    }
    return std::stoull(part);
  };
  const std::size_t dots = text.find("..");
  const bool range = dots != std::string::npos;
  const std::uint64_t last = number(range ? text.substr(dots + 2) : text);
  const std::uint64_t first = range ? number(text.substr(0, dots)) : alone ? last : 1;
  if (last < first || last - first >= 10000)
  {
    throw CLI::ValidationError("seeds", "'" + text + "' is no range of at most 10000 seeds");
  }
  std::vector<std::uint64_t> seeds;
  for (std::uint64_t seed = first; seed <= last; ++seed)
  {
    seeds.push_back(seed);
  }
  return seeds;
}

PhantomCase MakePhantomCase(std::uint64_t seed, bool varied)
{
  PhantomCase result;
  PhantomSettings& settings = result.settings;
  settings.seed = seed;
  if (varied)
  {
    settings.dominance = static_cast<Dominance>(seed % 3);
    settings.ramus = seed % 2 == 1;
    settings.stenoses = static_cast<int>(seed % 4);
    settings.tortuosity = 1.0 + 0.25 * static_cast<double>(seed % 3);
    settings.calibre = 0.9 + 0.05 * static_cast<double>(seed % 5);
    result.moment = 0.05 * static_cast<double>(seed % 20);
  }
  return result;
}

VesselTree SweepTreeOf(const PhantomTree& truth)
{
  VesselTree tree;
  tree.points = truth.points;
  tree.radius = truth.radius;
  for (const VesselTree::Branch& branch : truth.branches)
  {
    tree.branches.push_back({ branch.points, branch.groupId });
  }
  return tree;
}
}
