// The simulator as a trainee has it, on a display: an emulated device drives a wire into the left coronary artery and
// injects; what is on the monitor is held against where the phantom's arteries are at that moment. Then it is unplugged.
#include "CArm.h"
#include "CoronaryPhantom.h"
#include "Scenario.h"
#include "SessionInput.h"
#include "SimulatorRun.h"

#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkPNGReader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <memory>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

using namespace coronary;
using nlohmann::json;
namespace fs = std::filesystem;

namespace
{
constexpr double Degree = M_PI / 180.0;

/// A program that runs beside the test.
class Process
{
public:
  explicit Process(const std::string& command)
    : Id(fork())
  {
    if (this->Id == 0)
    {
      execl("/bin/sh", "sh", "-c", ("exec " + command).c_str(), nullptr);
      _exit(127);
    }
  }
  ~Process()
  {
    if (this->Id > 0)
    {
      kill(this->Id, SIGTERM);
      waitpid(this->Id, nullptr, 0);
    }
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

private:
  pid_t Id;
};

/// An image of the monitor with what was exposed.
struct Frame
{
  json about;
  int columns = 0;
  int rows = 0;
  std::vector<double> grey;

  double At(double column, double row) const
  {
    // Mean of 3 x 3 pixels.
    double sum = 0.0;
    for (int dy = -1; dy <= 1; ++dy)
    {
      for (int dx = -1; dx <= 1; ++dx)
      {
        const int x = std::clamp(static_cast<int>(std::lround(column)) + dx, 0, this->columns - 1);
        const int y = std::clamp(static_cast<int>(std::lround(row)) + dy, 0, this->rows - 1);
        sum += this->grey[static_cast<std::size_t>(y) * this->columns + x];
      }
    }
    return sum / 9.0;
  }
};

Frame ReadFrame(const fs::path& text)
{
  Frame frame;
  frame.about = json::parse(ReadText(text));
  vtkNew<vtkPNGReader> reader;
  reader->SetFileName(fs::path(text).replace_extension(".png").c_str());
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  frame.columns = image->GetDimensions()[0];
  frame.rows = image->GetDimensions()[1];
  for (int y = frame.rows - 1; y >= 0; --y)
  {
    for (int x = 0; x < frame.columns; ++x)
    {
      frame.grey.push_back(image->GetScalarComponentAsDouble(x, y, 0, 0));
    }
  }
  return frame;
}

/// How much darker than its sides a vessel of the phantom is on a frame, grey values, the median along it.
double Darkness(const CoronaryPhantom& phantom, const Frame& frame, const std::string& name)
{
  CArmPose pose;
  pose.primary = frame.about["primary_deg"].get<double>() * Degree;
  pose.secondary = frame.about["secondary_deg"].get<double>() * Degree;
  pose.sourceToDetector = frame.about["source_to_detector_mm"];
  pose.sourceToIsocentre = frame.about["source_to_isocentre_mm"];
  const json& centre = frame.about["isocentre_mm"];
  pose.isocentre = { centre[0].get<double>(), centre[1].get<double>(), centre[2].get<double>() };
  DetectorFormat format;
  format.columns = frame.columns;
  format.rows = frame.rows;
  format.width = format.height = frame.about["field_of_view_mm"];
  const CArmGeometry geometry(pose, format);
  const PhantomTree tree = phantom.Tree(frame.about["phase"].get<double>());
  std::vector<double> darker;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    if (SegmentName(branch.segmentId) != name)
    {
      continue;
    }
    for (std::size_t n = 2; n + 2 < branch.points.size(); n += 2)
    {
      const auto pixel = [&](std::size_t k)
      { return geometry.Project(tree.points[static_cast<std::size_t>(branch.points[k])]); };
      const Vector3 here = pixel(n);
      const Vector3 along = pixel(n + 1) - pixel(n - 1);
      const double length = std::hypot(along.x(), along.y());
      const double radius = tree.radius[static_cast<std::size_t>(branch.points[n])] *
        geometry.Magnification(here.z()) * format.columns / format.width;
      if (length < 0.3)
      {
        continue; // end on
      }
      const double away = radius + 6.0;
      const double acrossX = -along.y() / length * away;
      const double acrossY = along.x() / length * away;
      darker.push_back(0.5 *
          (frame.At(here.x() + acrossX, here.y() + acrossY) +
            frame.At(here.x() - acrossX, here.y() - acrossY)) -
        frame.At(here.x(), here.y()));
    }
  }
  if (darker.empty())
  {
    ADD_FAILURE() << "the phantom has no " << name;
    return 0.0;
  }
  std::nth_element(darker.begin(), darker.begin() + darker.size() / 2, darker.end());
  return darker[darker.size() / 2];
}

/// Of the session, by the last line that the emulated device has written of it; 0: nothing yet.
double TickToldTo(const fs::path& log)
{
  const std::string text = ReadText(log);
  const std::size_t begin = text.rfind("\"tick\":", text.rfind('\n'));
  return begin < text.size() ? std::stod(text.substr(begin + 7)) : 0.0;
}

class TestSimulatorWindow : public SimulatorRun
{
protected:
  TestSimulatorWindow()
    : SimulatorRun("simulator window")
  {
    fs::create_directories(this->Folder / "shots");
  }

  std::string Said() const
  {
    return ReadText(this->Folder / "stdout") + ReadText(this->Folder / "stderr");
  }

  std::vector<Frame> Frames() const
  {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(this->Folder / "shots"))
    {
      if (entry.path().extension() == ".json")
      {
        files.push_back(entry.path());
      }
    }
    std::sort(files.begin(), files.end());
    std::vector<Frame> frames;
    for (const fs::path& file : files)
    {
      frames.push_back(ReadFrame(file));
    }
    return frames;
  }
};
}

TEST_F(TestSimulatorWindow, ADeviceDrivesInjectsAndTheRightBranchesFill)
{
  // Real time is what hands have; the simulation may be slower on a busy machine, so moments are told by what has been
  // injected and not by the clock.
  this->Put("hands.json",
    { { "format", "dynamiccoronary script" }, { "version", 1 },
      { "pieces",
        { { { "seconds", 3.0 }, { "wire_mm", 45 }, { "pedals", { "fluoroscopy" } } },
          { { "seconds", 2.5 }, { "inject_mL", 6 }, { "pedals", { "cine" } } },
          { { "seconds", 30.0 } } } } });
  Process device("'" DYNAMICCORONARY_EMULATOR "' --quiet --scenario '" +
    (this->Folder / "hands.json").string() + "' --link '" + (this->Folder / "device").string() +
    "' --log '" + (this->Folder / "device.log").string() + "'");
  std::string shots;
  for (int n = 1; n <= 26; ++n)
  {
    shots += " --screenshot-at " + std::to_string(0.5 * n);
  }
  ASSERT_EQ(this->Run("--scenario phantom-lca --device serial:device --record a.pcirec "
                      "--size 1200x800 --screenshots shots --quit-after 13.2" +
              shots),
    0)
    << this->Said();
  EXPECT_NE(this->Said().find("times real time"), std::string::npos) << this->Said();
  EXPECT_GT(fs::file_size(this->Folder / "shots/window_005.00s.png"), 50000U);

  const std::vector<Frame> frames = this->Frames();
  ASSERT_GT(frames.size(), 10U);
  const PhantomSettings settings = LoadScenario("phantom-lca").vessels.phantom;
  const CoronaryPhantom phantom(settings);
  const Frame* empty = nullptr;  // the wire is in, nothing was injected
  const Frame* full = nullptr;   // at the end of the injection
  const Frame* washed = nullptr; // long after
  for (const Frame& frame : frames)
  {
    const double injected = frame.about["injected_mL"];
    const double inside = frame.about["in_tree_mL"];
    empty = injected == 0.0 && frame.about["inserted_mm"] > 10.0 ? &frame : empty;
    full = injected > 1.5 && (!full || inside > full->about["in_tree_mL"]) ? &frame : full;
    washed = injected > 1.5 && inside < 0.03 ? &frame : washed;
  }
  std::string moments;
  for (const Frame& frame : frames)
  {
    moments += frame.about["seconds"].dump() + " s: " + frame.about["inserted_mm"].dump() +
      " mm, " + frame.about["injected_mL"].dump() + " mL, " + frame.about["in_tree_mL"].dump() +
      " mL in the arteries\n";
  }
  ASSERT_TRUE(empty && full && washed) << moments << this->Said();
  double faintest = 1e9;
  for (const char* name : { "pLAD", "mLAD", "pLCx" })
  {
    const double filled = Darkness(phantom, *full, name);
    faintest = std::min(faintest, filled);
    EXPECT_GT(filled, 15.0) << name;
    EXPECT_LT(Darkness(phantom, *empty, name), 0.5 * filled) << name << " before";
    EXPECT_LT(Darkness(phantom, *washed, name), 0.5 * filled) << name << " after";
  }
  // What is seen there are edges of the patient's bones and of the heart.
  for (const char* name : { "pRCA", "mRCA" })
  {
    EXPECT_LT(std::abs(Darkness(phantom, *full, name)), 0.6 * faintest) << name << " gets none";
  }
  EXPECT_GE(washed->about["branch"].get<int>(), 0) << "the wire is in a branch";
  EXPECT_GT(washed->about["inserted_mm"].get<double>(), 30.0);

  // What was recorded is the session, to the bit.
  EXPECT_EQ(this->Run("--headless --replay a.pcirec --verify"), 0) << this->Said();
  EXPECT_NE(this->Said().find("hashes are equal"), std::string::npos);
}

TEST_F(TestSimulatorWindow, AnUnpluggedDeviceStopsPedalAndInjection)
{
  this->Put("hands.json",
    { { "format", "dynamiccoronary script" }, { "version", 1 },
      { "pieces",
        { { { "seconds", 20.0 }, { "wire_mm", 200 }, { "inject_mL", 40 },
          { "pedals", { "fluoroscopy" } } } } },
      { "device", { { "repeat", true } } } });
  const fs::path log = this->Folder / "device.log";
  auto device = std::make_unique<Process>("'" DYNAMICCORONARY_EMULATOR "' --quiet --scenario '" +
    (this->Folder / "hands.json").string() + "' --link '" + (this->Folder / "device").string() +
    "' --log '" + log.string() + "'");
  // On a busy machine nobody knows when the session begins: the plug is pulled when the device hears of its tick.
  std::atomic<bool> over{ false };
  std::thread puller(
    [&]
    {
      while (!over && TickToldTo(log) < 3000)
      {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
      device.reset();
    });
  const int exitCode =
    this->Run("--scenario phantom-lca --device serial:device --record a.pcirec --quit-after 8");
  over = true;
  puller.join();
  ASSERT_EQ(exitCode, 0) << this->Said();
  const double pulled = TickToldTo(log);
  ASSERT_GE(pulled, 3000) << "the session was over before the plug was pulled";
  ASSERT_EQ(this->Run("--dump a.pcirec"), 0) << this->Said();
  // The last input that was recorded: nothing came after the plug was pulled.
  std::ifstream dump(this->Folder / "stdout");
  json last;
  json before; // of the inputs while it was still there
  // Its pedal was down; a busy machine may keep it from talking just before the plug is pulled, and then it is up.
  bool pressed = false;
  for (std::string line; std::getline(dump, line);)
  {
    const json item = json::parse(line);
    last = item["type"] == "input" ? item : last;
    before = item["type"] == "input" && item["tick"] <= pulled ? item : before;
    pressed =
      pressed || (before == item && item["pedals"] == static_cast<unsigned>(FluoroscopyPedal));
  }
  ASSERT_FALSE(before.is_null());
  EXPECT_TRUE(pressed);
  EXPECT_GT(before["wire_mm"].get<double>(), 2.0) << "it did drive";
  EXPECT_EQ(last["pedals"], 0);
  EXPECT_LT(last["tick"].get<double>(), 2000.0 * 7.5) << "and stopped";
}

TEST_F(TestSimulatorWindow, WithoutADisplayItSaysSo)
{
  EXPECT_EQ(this->Run("--scenario phantom-lca --quit-after 1", "env -u DISPLAY"), 1);
  EXPECT_NE(this->Said().find("There is no display"), std::string::npos) << this->Said();
  EXPECT_NE(this->Said().find("--headless"), std::string::npos) << this->Said();
}
