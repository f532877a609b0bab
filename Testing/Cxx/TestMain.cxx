// Runs GoogleTest where a program has the cases of several sources: --source=NAME takes those of NAME.cxx only.

#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>
#include <string>

namespace
{
/// The filter, without the cases of all other sources. Empty: the source has none.
std::string Without(std::string filter, const std::string& others)
{
  filter += filter.find('-') == std::string::npos ? "-" : ":";
  bool any = false;
  const testing::UnitTest& program = *testing::UnitTest::GetInstance();
  for (int s = 0; s < program.total_test_suite_count(); ++s)
  {
    const testing::TestSuite& suite = *program.GetTestSuite(s);
    for (int c = 0; c < suite.total_test_count(); ++c)
    {
      const testing::TestInfo& info = *suite.GetTestInfo(c);
      if (std::filesystem::path(info.file()).stem() == others)
      {
        any = true;
      }
      else
      {
        filter += std::string(info.test_suite_name()) + '.' + info.name() + ':';
      }
    }
  }
  return any ? filter : std::string();
}
}

int main(int argc, char** argv)
{
  testing::InitGoogleTest(&argc, argv);
  const std::string option = "--source=";
  for (int i = 1; i < argc; ++i)
  {
    const std::string argument = argv[i];
    const std::string source =
      argument.substr(0, option.size()) == option ? argument.substr(option.size()) : "";
    const std::string filter = Without(testing::GTEST_FLAG(filter), source);
    if (source.empty() || filter.empty())
    {
      std::cerr << "No cases of a source are chosen by '" << argument
                << "'; --source=NAME does, without .cxx\n";
      return 2;
    }
    testing::GTEST_FLAG(filter) = filter;
  }
  return RUN_ALL_TESTS();
}
