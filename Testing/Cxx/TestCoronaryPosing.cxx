// coronary-posing as a user runs it: moves, files, messages, exit codes.
#include "VesselTestData.h"

#include "vtkXMLPolyDataReader.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <sys/wait.h>
#include <unistd.h>

namespace fs = std::filesystem;

namespace
{
constexpr int Bones = 12;

std::string ReadText(const fs::path& path)
{
  std::ifstream file(path, std::ios::binary);
  return { std::istreambuf_iterator<char>(file), {} };
}

class TestCoronaryPosing : public ::testing::Test
{
protected:
  void SetUp() override
  {
    this->Folder = fs::temp_directory_path() / ("posing test." + std::to_string(getpid()));
    SaveChainRun(this->Folder / "result", Bones);
  }

  void TearDown() override { fs::remove_all(this->Folder); }

  /// Runs the program in the folder.
  int Run(const std::string& options) const
  {
    const std::string command = "cd '" + this->Folder.string() +
      "' && '" DYNAMICCORONARY_POSING "' " + options + " >stdout 2>stderr";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  std::string Said() const { return ReadText(this->Folder / "stderr"); }

  fs::path Folder;
};
}

TEST_F(TestCoronaryPosing, MovesJointsWithoutWindow)
{
  ASSERT_EQ(this->Run("--headless --pose-move 6:3,0,-1 --pose-move 12:0,2,-1 --pose-output "
                      "posed.vtp --pose-surface surface.vtp result"),
    0)
    << this->Said();
  EXPECT_EQ(ReadText(this->Folder / "stdout").rfind("2 moves: greatest displacement ", 0), 0U)
    << ReadText(this->Folder / "stdout");
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName((this->Folder / "posed.vtp").c_str());
  reader->Update();
  ASSERT_EQ(reader->GetOutput()->GetNumberOfPoints(), Bones + 1);
  EXPECT_NEAR(reader->GetOutput()->GetPoint(6)[0], 3.0, 1e-6);
  EXPECT_TRUE(fs::exists(this->Folder / "surface.vtp"));
  // A pose goes on where it was left.
  ASSERT_EQ(this->Run("result --headless --quiet --pose-start posed.vtp --pose-output b.vtp"), 0)
    << this->Said();
  EXPECT_EQ(ReadText(this->Folder / "posed.vtp"), ReadText(this->Folder / "b.vtp"));
}

TEST_F(TestCoronaryPosing, SaysWhatIsWrong)
{
  const auto refused = [this](int code, const std::string& options, const std::string& part)
  {
    EXPECT_EQ(this->Run("--headless --pose-output bad " + options), code) << options;
    const std::string text = this->Said();
    EXPECT_EQ(text.rfind("coronary-posing: ", 0), 0U) << options << ": " << text;
    EXPECT_NE(text.find(part), std::string::npos) << options << ": " << text;
    EXPECT_FALSE(fs::exists(this->Folder / "bad")) << options;
  };
  refused(1, "nowhere", "'nowhere' is no folder");
  refused(1, "result/motion", "coronary-pipeline run ... --until weights");
  refused(1, "result --pose-move 99:1,0,0", "There is no joint 99");
  refused(2, "result --pose-move 3:1,0", "JOINT:DX,DY,DZ is wanted");
  refused(2, "--pose-move 3:1,0,0", "RUN is required");
  EXPECT_EQ(this->Run("--help"), 0);
  EXPECT_EQ(this->Run("--version"), 0);
}
