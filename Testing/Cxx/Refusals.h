/**
 * @file Refusals.h
 * @brief What is expected of an algorithm that is given bad input.
 */
#ifndef DynamicCoronary_Refusals_h
#define DynamicCoronary_Refusals_h

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <tuple>

/// Calls what is to throw `Error` with each of `parts` in its message, which is one short line.
template <typename Error, typename Function, typename... Parts>
void ExpectThrown(const Function& function, const Parts&... parts)
{
  try
  {
    function();
    ADD_FAILURE() << "nothing was thrown, wanted: " << testing::PrintToString(std::tie(parts...));
  }
  catch (const Error& error)
  {
    const std::string what = error.what();
    for (const std::string& part : { std::string(parts)... })
    {
      EXPECT_NE(what.find(part), std::string::npos) << "'" << part << "' is not in: " << what;
    }
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    EXPECT_LT(what.size(), 600U) << what;
  }
}

/// The same of std::invalid_argument: what a caller asks for is wrong.
template <typename Function, typename... Parts>
void ExpectRefusal(const Function& function, const Parts&... parts)
{
  ExpectThrown<std::invalid_argument>(function, parts...);
}

/// The same of std::runtime_error: a file or the machine is at fault.
template <typename Function, typename... Parts>
void ExpectError(const Function& function, const Parts&... parts)
{
  ExpectThrown<std::runtime_error>(function, parts...);
}

#endif
