// Tests of coronary-simulator: a folder of their own, in which the program is run.
#ifndef SimulatorRun_h
#define SimulatorRun_h

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <sys/wait.h>
#include <unistd.h>

inline std::string ReadText(const std::filesystem::path& path)
{
  std::ifstream file(path, std::ios::binary);
  return { std::istreambuf_iterator<char>(file), {} };
}

class SimulatorRun : public ::testing::Test
{
protected:
  explicit SimulatorRun(const std::string& name)
    : Folder(std::filesystem::temp_directory_path() / (name + "." + std::to_string(getpid())))
  {
    std::filesystem::create_directories(this->Folder);
  }
  ~SimulatorRun() override
  {
    if (!this->HasFailure()) // otherwise it is looked at
    {
      std::filesystem::remove_all(this->Folder);
    }
  }

  void Put(const std::string& name, const nlohmann::json& content) const
  {
    std::ofstream(this->Folder / name) << content.dump(1);
  }

  /// @return its exit code
  int Run(const std::string& options, const std::string& before = "") const
  {
    const std::string command = "cd '" + this->Folder.string() + "' && " + before +
      " '" DYNAMICCORONARY_SIMULATOR "' " + options + " >stdout 2>stderr";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  std::filesystem::path Folder;
};

#endif
