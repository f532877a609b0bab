/**
 * @file Refusals.h
 * @brief What is expected of an algorithm that is given bad input.
 */
#ifndef DynamicCoronary_Refusals_h
#define DynamicCoronary_Refusals_h

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

/// Calls what is to throw std::invalid_argument with `part` in its message.
template <typename Function>
void ExpectRefusal(const Function& function, const std::string& part)
{
  try
  {
    function();
    ADD_FAILURE() << "nothing was thrown, wanted: " << part;
  }
  catch (const std::invalid_argument& error)
  {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

#endif
