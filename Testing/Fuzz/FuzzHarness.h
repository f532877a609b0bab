/**
 * @file FuzzHarness.h
 * @brief What reads bytes of others: one function a format, with good inputs to begin from.
 *
 * A new harness is a function, a list of seeds and a row in the table of its group.
 */
#ifndef DynamicCoronary_FuzzHarness_h
#define DynamicCoronary_FuzzHarness_h

#include <string>
#include <vector>

namespace fuzzing
{
struct Harness
{
  std::string name;
  /// Reads the bytes as the programs do. May throw std::runtime_error and std::invalid_argument.
  void (*read)(const std::string& bytes);
  /// Inputs that read() takes, or takes in part: written by the repository's own writers where it has them.
  std::vector<std::string> (*seeds)();
};

/// All of them, the names different.
const std::vector<Harness>& Harnesses();

/// The groups that Harnesses() is made of.
///@{
std::vector<Harness> FormatHarnesses();
std::vector<Harness> SessionHarnesses();
std::vector<Harness> DeviceHarnesses();
///@}

/// @throws std::invalid_argument naming the harnesses that there are
const Harness& FindHarness(const std::string& name);

/**
 * Reads the bytes: true when they are taken, false when they are refused as they should be.
 * @throws std::logic_error when they are refused in another way: another exception, no message, one of
 *   several lines or one that is longer than MostMessage
 */
bool Accepts(const Harness& harness, const std::string& bytes);

constexpr std::size_t MostMessage = 2000;

/// The path of a file with these bytes, the same one for every call with this name. It goes away with the process.
std::string FileWith(const std::string& name, const std::string& bytes);

/// The contents of a file. @throws std::runtime_error naming it
std::string Contents(const std::string& path);

/// Fails the harness: what was read is not what it says it is.
void Require(bool holds, const char* what);
}

#endif
