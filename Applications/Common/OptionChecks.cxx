#include "OptionChecks.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>

namespace coronary
{
namespace
{
std::string Range(double low, double high)
{
  return Format(low) + ".." + Format(high);
}

// NaN for a text that is no number.
double Parse(const std::string& text)
{
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return text.empty() || *end != '\0' ? std::nan("") : value;
}
}

std::string Format(double value)
{
  std::ostringstream text;
  text.precision(10);
  text << value;
  return text.str();
}

CLI::Validator Within(double low, double high)
{
  return CLI::Validator(
    [=](std::string& text)
    {
      const double value = Parse(text);
      return value >= low && value <= high
        ? std::string()
        : "'" + text + "' is not a number in " + Range(low, high);
    },
    Range(low, high));
}

CLI::Validator WholeWithin(long low, long high)
{
  const auto first = static_cast<double>(low);
  const auto last = static_cast<double>(high);
  return CLI::Validator(
    [=](std::string& text)
    {
      const double value = Parse(text);
      const bool digits =
        text.find_first_not_of("0123456789", text[0] == '-' ? 1 : 0) == std::string::npos;
      return digits && value >= first && value <= last
        ? std::string()
        : "'" + text + "' is not a whole number in " + Range(first, last);
    },
    Range(first, last));
}

CLI::Option* AddThreads(CLI::App& app, int& threads, const std::string& help)
{
  return app.add_option("--threads", threads, help)
    ->check(WholeWithin(0, 1024))
    ->type_name("N")
    ->capture_default_str();
}

CLI::Option* AddWindowSize(CLI::App& app, int& width, int& height)
{
  return app
    .add_option_function<std::string>(
      "--size",
      [&width, &height](const std::string& text)
      {
        char rest = 0;
        if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 640 ||
          width > 8192 || height < 480 || height > 8192)
        {
          throw CLI::ValidationError(
            "--size", "'" + text + "' is no size from 640x480 to 8192x8192");
        }
      },
      "Of the window in pixels, as 1500x860")
    ->type_name("WxH");
}
}
