// Every reader over its good inputs, over what was found before, and over some hundred damaged inputs. The long runs are
// scripts/fuzz.sh's.
#include "FuzzHarness.h"

#include "CounterRandom.h"
#include "FormatTestFiles.h"

#include <gtest/gtest.h>

#include <sys/resource.h>

#include <algorithm>
#include <cctype>
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

/// An input that once went wrong.
struct Finding
{
  std::string harness; ///< the folder that it lies in
  std::string file;
};

std::vector<Finding> Findings()
{
  std::vector<Finding> found;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(
         DYNAMICCORONARY_SOURCE_DIR "/Testing/Fuzz/Findings"))
  {
    if (entry.is_regular_file())
    {
      found.push_back({ entry.path().parent_path().filename().string(), entry.path().string() });
    }
  }
  std::sort(
    found.begin(), found.end(), [](const Finding& a, const Finding& b) { return a.file < b.file; });
  return found;
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

class FuzzFinding : public testing::TestWithParam<Finding>
{
};

TEST_P(FuzzFinding, StaysMended)
{
  const std::vector<Harness>& all = Harnesses();
  const auto harness = std::find_if(all.begin(), all.end(),
    [this](const Harness& one) { return one.name == this->GetParam().harness; });
  ASSERT_NE(harness, all.end()) << "no harness reads what is in that folder";
  const std::string input = Contents(this->GetParam().file);
  ASSERT_FALSE(input.empty());
  EXPECT_NO_THROW(Accepts(*harness, input));
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

INSTANTIATE_TEST_SUITE_P(All, FuzzFinding, testing::ValuesIn(Findings()),
  [](const auto& chosen)
  {
    std::string name =
      chosen.param.harness + "_" + std::filesystem::path(chosen.param.file).filename().string();
    std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
    return name;
  });
