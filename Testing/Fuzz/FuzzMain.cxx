// libFuzzer's side of the harnesses: coronary-fuzz --harness=NAME [libFuzzer's options] FOLDER
// and for scripts/fuzz.sh: coronary-fuzz --list, coronary-fuzz --seeds=NAME FOLDER
#include "FuzzHarness.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>

namespace
{
const fuzzing::Harness* Chosen = nullptr;

std::string ValueOf(const std::string& argument, const std::string& name)
{
  return argument.rfind(name, 0) == 0 ? argument.substr(name.size()) : std::string();
}

void WriteSeeds(const fuzzing::Harness& harness, const std::string& folder)
{
  int number = 0;
  for (const std::string& seed : harness.seeds())
  {
    std::ofstream file(folder + "/seed-" + std::to_string(number++), std::ios::binary);
    file.write(seed.data(), static_cast<std::streamsize>(seed.size()));
  }
}

/// What is not for libFuzzer: chooses the harness, or does another task and ends the program.
void Take(const std::string& argument, const std::string& next)
{
  if (argument == "--list")
  {
    for (const fuzzing::Harness& harness : fuzzing::Harnesses())
    {
      std::puts(harness.name.c_str());
    }
    std::exit(0);
  }
  if (const std::string name = ValueOf(argument, "--seeds="); !name.empty())
  {
    WriteSeeds(fuzzing::FindHarness(name), next);
    std::exit(0);
  }
  if (const std::string name = ValueOf(argument, "--harness="); !name.empty())
  {
    Chosen = &fuzzing::FindHarness(name);
  }
}
}

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments)
{
  try
  {
    for (int n = 1; n < *count; ++n)
    {
      Take((*arguments)[n], n + 1 < *count ? (*arguments)[n + 1] : ".");
    }
    if (!Chosen)
    {
      throw std::invalid_argument("coronary-fuzz takes --harness=NAME, --seeds=NAME or --list.");
    }
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "%s\n", error.what());
    std::exit(2);
  }
  char** end = *arguments + *count;
  *count = static_cast<int>(
    std::remove_if(*arguments + 1, end,
      [](const char* argument) { return std::string(argument).rfind("--", 0) == 0; }) -
    *arguments);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  try
  {
    fuzzing::Accepts(*Chosen, std::string(reinterpret_cast<const char*>(data), size));
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "%s\n", error.what());
    std::abort();
  }
  return 0;
}
