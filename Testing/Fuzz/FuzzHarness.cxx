#include "FuzzHarness.h"

#include "FormatTestFiles.h"

#include <fstream>
#include <iterator>
#include <stdexcept>

namespace fuzzing
{
namespace
{
/// Of Require(): nothing that a reader throws.
struct Broken : std::exception
{
  explicit Broken(const char* text)
    : What(text)
  {
  }
  const char* what() const noexcept override { return this->What; }
  const char* What;
};

void CheckMessage(const std::string& harness, const std::string& message)
{
  const auto fail = [&](const char* what)
  { throw std::logic_error(harness + ": " + what + ": " + message); };
  if (message.empty())
  {
    fail("a refusal without a message");
  }
  if (message.size() > MostMessage)
  {
    fail("a message that is too long");
  }
  if (message.find('\n') != std::string::npos)
  {
    fail("a message of several lines");
  }
}
}

const std::vector<Harness>& Harnesses()
{
  static const std::vector<Harness> all = []
  {
    std::vector<Harness> list;
    for (const std::vector<Harness>& group :
      { FormatHarnesses(), SessionHarnesses(), DeviceHarnesses() })
    {
      list.insert(list.end(), group.begin(), group.end());
    }
    return list;
  }();
  return all;
}

const Harness& FindHarness(const std::string& name)
{
  std::string names;
  for (const Harness& harness : Harnesses())
  {
    if (harness.name == name)
    {
      return harness;
    }
    names += " " + harness.name;
  }
  throw std::invalid_argument("No harness '" + name + "'; there are:" + names);
}

bool Accepts(const Harness& harness, const std::string& bytes)
{
  std::string message;
  try
  {
    harness.read(bytes);
    return true;
  }
  catch (const Broken& error)
  {
    throw std::logic_error(harness.name + ": " + error.what());
  }
  catch (const std::runtime_error& error)
  {
    message = error.what();
  }
  catch (const std::invalid_argument& error)
  {
    message = error.what();
  }
  catch (const std::exception& error)
  {
    throw std::logic_error(harness.name + ": an exception of another kind: " + error.what());
  }
  CheckMessage(harness.name, message);
  return false;
}

std::string FileWith(const std::string& name, const std::string& bytes)
{
  static const formattest::TemporaryFolder folder;
  const std::string path = folder / name;
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return path;
}

std::string Contents(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  if (!file)
  {
    throw std::runtime_error("Cannot open '" + path + "'.");
  }
  return { std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>() };
}

void Require(bool holds, const char* what)
{
  if (!holds)
  {
    throw Broken(what);
  }
}
}
