// Every reader over its good inputs, over what was found before, and over some hundred damaged inputs. The long runs are
// scripts/fuzz.sh's.
#include "FuzzHarness.h"

#include "CounterRandom.h"
#include "FormatTestFiles.h"

#include <gtest/gtest.h>

#include <sys/resource.h>

#include <algorithm>
#include <filesystem>

using namespace fuzzing;

namespace
{
constexpr int Rounds = 150; // of damage, for each harness

/// Changes a few bytes, cuts, doubles or joins: what a fuzzer does without knowing anything.
std::string Damaged(std::string bytes, const std::string& other, coronary::RandomStream& random)
{
  const auto below = [&](std::size_t limit)
  { return random.Bits() % std::max<std::size_t>(1, limit); };
  for (std::uint64_t changes = 1 + below(4); changes > 0 && !bytes.empty(); --changes)
  {
    const std::size_t at = below(bytes.size());
    switch (below(8))
    {
      case 0:
        bytes[at] = static_cast<char>(below(256));
        break;
      case 1:
        bytes[at] = '\xff';
        break;
      case 2:
        bytes[at] = "0123456789-.eE\n =(,{}[]\""[below(24)];
        break;
      case 3:
        bytes.resize(at);
        break;
      case 4:
        bytes.insert(at, bytes.substr(at, below(64)));
        break;
      case 5:
        bytes.replace(at, below(16), other, below(other.size()), below(32));
        break;
      case 6:
        bytes.erase(at, below(16));
        break;
      default:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
        break;
    }
  }
  return bytes;
}

/// Inputs that once went wrong, in the folder of the harness.
std::vector<std::string> Findings(const Harness& harness)
{
  std::vector<std::string> inputs;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(
         std::filesystem::path(DYNAMICCORONARY_FINDINGS) / harness.name, none))
  {
    inputs.push_back(Contents(entry.path().string()));
  }
  return inputs;
}

class FuzzHarness : public testing::TestWithParam<std::size_t>
{
protected:
  const Harness& Tested() const { return Harnesses()[this->GetParam()]; }
};
}

TEST_P(FuzzHarness, SeedsAreRead)
{
  const Harness& harness = this->Tested();
  const std::vector<std::string> seeds = harness.seeds();
  int accepted = 0;
  for (const std::string& seed : seeds)
  {
    EXPECT_FALSE(seed.empty());
    accepted += Accepts(harness, seed) ? 1 : 0;
  }
  EXPECT_GT(accepted, 0) << "no seed is taken: the fuzzer would begin from nothing";
}

TEST_P(FuzzHarness, FindingsStayMended)
{
  for (const std::string& input : Findings(this->Tested()))
  {
    EXPECT_NO_THROW(Accepts(this->Tested(), input));
  }
}

TEST_P(FuzzHarness, DamageIsRefusedInOneSentence)
{
  const Harness& harness = this->Tested();
  const std::vector<std::string> seeds = harness.seeds();
  coronary::RandomStream random(static_cast<std::uint64_t>(this->GetParam()) + 1);
  EXPECT_NO_THROW(Accepts(harness, ""));
  for (int round = 0; round < Rounds; ++round)
  {
    const std::string& seed = seeds[random.Bits() % seeds.size()];
    const std::string input = Damaged(seed, seeds[random.Bits() % seeds.size()], random);
    ASSERT_NO_THROW(Accepts(harness, input)) << "round " << round;
  }
#ifndef __SANITIZE_ADDRESS__
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  EXPECT_LT(usage.ru_maxrss, 600000) << "kilobytes: more than any of the inputs can hold";
#endif
}

INSTANTIATE_TEST_SUITE_P(All, FuzzHarness, testing::Range<std::size_t>(0, Harnesses().size()),
  [](const auto& chosen)
  {
    std::string name = Harnesses()[chosen.param].name;
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
  });
