// coronary-simulator as a user runs it: sessions, recordings and their replay, messages, exit codes.
#include "AtomicFile.h"
#include "FileSeries.h"
#include "Recording.h"
#include "SessionImager.h"
#include "SimulatorRun.h"
#include "VesselTestData.h"
#include "XmlText.h"

#include "vtkXMLPolyDataReader.h"

#include <gdcmImageReader.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace fs = std::filesystem;
using nlohmann::json;

namespace
{
constexpr int Bones = 12;

class TestCoronarySimulator : public SimulatorRun
{
protected:
  TestCoronarySimulator()
    : SimulatorRun("simulator test")
  {
    SaveChainRun(this->Folder / "result", Bones);
    this->Put("s.json", TestScenario());
    this->Put("drive.json",
      { { "format", "dynamiccoronary script" }, { "version", 1 },
        { "pieces",
          { { { "seconds", 0.5 }, { "wire_mm", 8 } }, { { "seconds", 0.2 }, { "wire_deg", 60 } },
            { { "seconds", 0.3 }, { "wire_mm", 3 }, { "heart_rate_bpm", 100 } } } } });
  }

  static json TestScenario()
  {
    return { { "format", "dynamiccoronary scenario" }, { "version", 1 }, { "name", "bar" },
      { "vessels", { { "run", "result" } } }, { "artery", "RCA" }, { "wire", "workhorse" },
      { "catheter", "JR4-6F" }, { "settings", { { "heart_rate_bpm", 60 } } } };
  }

  std::string Said() const { return ReadText(this->Folder / "stderr"); }

  json Statistics(const std::string& folder) const
  {
    return json::parse(ReadText(this->Folder / folder / "statistics.json"));
  }

  /// Exit code and one line that says why; nothing is written.
  void ExpectFailure(int code, const std::string& options, const std::string& part) const
  {
    EXPECT_EQ(this->Run("--headless --quiet --output bad " + options), code) << options;
    const std::string text = this->Said();
    EXPECT_EQ(text.rfind("coronary-simulator: ", 0), 0U) << options << ": " << text;
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << options << ": " << text;
    EXPECT_NE(text.find(part), std::string::npos) << options << ": " << text;
    EXPECT_FALSE(fs::exists(this->Folder / "bad")) << options;
  }

  /// A scenario that is changed somewhere.
  template <typename Change>
  void ExpectBadScenario(const Change& change, const std::string& part) const
  {
    json scenario = TestScenario();
    change(scenario);
    this->Put("changed.json", scenario);
    this->ExpectFailure(1, "--scenario changed.json --ticks 10", part);
  }
};
}

TEST_F(TestCoronarySimulator, RecordsAndReplaysToTheBit)
{
  ASSERT_EQ(this->Run("--headless --scenario s.json --script drive.json --record a.pcirec "
                      "--output a --write-wall"),
    0)
    << this->Said();
  EXPECT_NE(ReadText(this->Folder / "stdout").find("bar: 2000 ticks, 1 s;"), std::string::npos)
    << ReadText(this->Folder / "stdout");
  const json statistics = this->Statistics("a");
  EXPECT_EQ(statistics["ticks"], 2000);
  EXPECT_EQ(statistics["seconds"], 1.0);
  EXPECT_EQ(statistics["scenario"], "bar");
  EXPECT_EQ(statistics["motion"], "tracked at 5 moments");
  EXPECT_EQ(statistics["state_hashes"].size(), 2U);
  EXPECT_EQ(statistics["state_hashes"][1], statistics["last_state_hash"]);
  EXPECT_NE(statistics["state_hashes"][0], statistics["state_hashes"][1]);
  EXPECT_GT(statistics["inserted"]["last_mm"].get<double>(), 5.0);
  EXPECT_EQ(statistics["branches"][0]["name"], "pRCA");
  EXPECT_EQ(statistics.dump().find("real"), std::string::npos)
    << "nothing that depends on the clock";

  // 20 Hz.
  const auto files = coronary::ReadFileSeries((this->Folder / "a/trajectory.pvd").string());
  ASSERT_EQ(files.size(), 20U);
  EXPECT_NEAR(files[1].time - files[0].time, 0.05, 1e-12);
  EXPECT_EQ(coronary::ReadFileSeries((this->Folder / "a/wall.pvd").string()).size(), 20U);
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName(files.back().path.c_str());
  reader->Update();
  EXPECT_EQ(reader->GetOutput()->GetNumberOfLines(), 2);
  const std::string forces = ReadText(this->Folder / "a/forces.csv");
  EXPECT_EQ(std::count(forces.begin(), forces.end(), '\n'), 21);
  const std::string tips = ReadText(this->Folder / "a/tip.csv");
  EXPECT_EQ(std::count(tips.begin(), tips.end(), '\n'), 21);

  // The same again: by the script, by the recording with its own scenario and with the file.
  const auto same = [&](const char* folder)
  {
    for (const auto& entry : fs::directory_iterator(this->Folder / "a"))
    {
      const std::string name = entry.path().filename().string();
      if (name != "statistics.json")
      {
        EXPECT_EQ(ReadText(entry.path()), ReadText(this->Folder / folder / name)) << name;
      }
    }
    EXPECT_EQ(this->Statistics(folder)["state_hashes"], statistics["state_hashes"]);
  };
  ASSERT_EQ(this->Run("--headless --scenario s.json --script drive.json --output b --write-wall "
                      "--threads 1 --quiet"),
    0);
  EXPECT_EQ(ReadText(this->Folder / "stdout") + this->Said(), "");
  same("b");
  ASSERT_EQ(
    this->Run("--headless --replay a.pcirec --verify --output c --write-wall --record c.pcirec"), 0)
    << this->Said();
  EXPECT_NE(ReadText(this->Folder / "stdout").find("2 of 2 hashes are equal"), std::string::npos);
  same("c");
  EXPECT_EQ(this->Statistics("c")["replay"]["equal"], 2);
  ASSERT_EQ(
    this->Run("--headless --scenario s.json --replay c.pcirec --verify --output d --write-wall"), 0)
    << this->Said();
  same("d");
  // Only the beginning.
  ASSERT_EQ(this->Run("--headless --replay a.pcirec --verify --ticks 1200 --quiet"), 0);
}

TEST_F(TestCoronarySimulator, NoticesAnotherState)
{
  ASSERT_EQ(
    this->Run("--headless --quiet --scenario s.json --script drive.json --record a.pcirec"), 0)
    << this->Said();
  json other = TestScenario();
  other["settings"]["heart_rate_bpm"] = 61;
  this->Put("other.json", other);
  this->ExpectFailure(1, "--scenario other.json --replay a.pcirec --verify --ticks 1500",
    "The state after tick 1000 is another one than in 'a.pcirec'");
  EXPECT_EQ(this->Run("--headless --scenario other.json --replay a.pcirec --output e"), 0);
  EXPECT_EQ(this->Statistics("e")["replay"]["first_different_tick"], 1000);
  EXPECT_NE(this->Said().find("another one than in"), std::string::npos);

  // Other vessels.
  other = TestScenario();
  other["vessels"]["motion"] = { { "model", "still" } };
  this->Put("other.json", other);
  this->ExpectFailure(
    1, "--scenario other.json --replay a.pcirec --verify", "recorded with other vessels");
  // Torn.
  const std::string bytes = ReadText(this->Folder / "a.pcirec");
  std::ofstream(this->Folder / "torn.pcirec", std::ios::binary)
    << bytes.substr(0, bytes.size() - 100);
  this->ExpectFailure(1, "--replay torn.pcirec --verify", "is good up to tick");
  EXPECT_EQ(this->Run("--headless --replay torn.pcirec --output f"), 0) << this->Said();
  EXPECT_GT(this->Statistics("f")["ticks"], 1000);
}

TEST_F(TestCoronarySimulator, DumpsRecordings)
{
  ASSERT_EQ(this->Run("--headless --quiet --scenario s.json --script drive.json --ticks 1600 "
                      "--record a.pcirec"),
    0);
  ASSERT_EQ(this->Run("--dump a.pcirec"), 0);
  std::istringstream lines(ReadText(this->Folder / "stdout"));
  std::string line;
  std::vector<json> items;
  while (std::getline(lines, line))
  {
    items.push_back(json::parse(line));
  }
  ASSERT_GT(items.size(), 1000U);
  EXPECT_EQ(items.front()["type"], "header");
  EXPECT_EQ(items.front()["scenario"]["name"], "bar");
  EXPECT_EQ(items.back()["type"], "end");
  EXPECT_EQ(items.back()["ticks"], 1600);
  const auto event = std::find_if(
    items.begin(), items.end(), [](const json& item) { return item["type"] == "event"; });
  ASSERT_NE(event, items.end());
  EXPECT_EQ((*event)["value"], 100.0);
  EXPECT_EQ((*event)["tick"], 1400);
  std::ofstream(this->Folder / "noise.pcirec") << "PCIREC? no";
  EXPECT_EQ(this->Run("--dump noise.pcirec"), 1);
  EXPECT_NE(this->Said().find("is no recording"), std::string::npos);
}

TEST_F(TestCoronarySimulator, SaysWhatIsWrong)
{
  this->ExpectFailure(2, "--ticks 10", "--scenario is required");
  this->ExpectFailure(2, "--scenario s.json", "--ticks is required");
  this->ExpectFailure(2, "--scenario s.json --ticks 0", "--ticks");
  this->ExpectFailure(2, "--scenario s.json --ticks ten", "--ticks");
  this->ExpectFailure(2, "--scenario s.json --ticks 10 --heart-rate nan", "--heart-rate");
  this->ExpectFailure(2, "--scenario s.json --ticks 10 --verify", "--verify");
  this->ExpectFailure(2, "--scenario s.json --ticks 10 --speed 3", "--speed");
  this->ExpectFailure(2, "--scenario hra-lca --ticks 10", "--vessels is required");
  this->ExpectFailure(1, "--scenario none.json --ticks 10", "'none.json' is neither");
  this->ExpectFailure(1, "--scenario s.json --vessels nowhere --ticks 10", "is no folder");
  this->ExpectFailure(1, "--scenario s.json --wire rope --ticks 10", "no wire 'rope'");
  this->ExpectFailure(1, "--scenario s.json --script none.json", "Cannot open 'none.json'");
  this->ExpectFailure(1, "--scenario s.json --script s.json", "is no script");
  this->ExpectFailure(1, "--scenario drive.json --ticks 10", "is no scenario");
  this->ExpectFailure(1, "--replay none.pcirec", "Cannot open 'none.pcirec'");
  this->ExpectFailure(1, "--replay s.json", "is no recording");
  this->ExpectFailure(
    1, "--scenario s.json --ticks 10 --record no/such/folder/a.pcirec", "no/such/folder");
  this->ExpectBadScenario([](json& s) { s["vessels"]["run"] = "away"; }, "is no folder");
  this->ExpectBadScenario([](json& s) { s["artery"] = "LCA"; }, "no root of the LCA");
  this->ExpectBadScenario([](json& s) { s["catalogue"] = "own.json"; }, "own.json");
  this->ExpectBadScenario(
    [](json& s)
    {
      s["wire"] = { { "name", "weak" }, { "length_mm", 1800 },
        { "sections",
          json::array({ { { "length_mm", 10 }, { "bending_stiffness_N_mm2", -3 } } }) } };
    },
    "wire 'weak', section 1 has a negative 'bending_stiffness_N_mm2'");
  this->ExpectBadScenario(
    [](json& s) { s["settings"]["tick_rate_hz"] = 1e9; }, "settings has 'tick_rate_hz'");
  // With a window or without, so many ticks are for sessions without one.
  EXPECT_EQ(this->Run("--scenario s.json --ticks 10"), 2);
  EXPECT_NE(this->Said().find("--headless"), std::string::npos) << this->Said();
  fs::remove(this->Folder / "result/weights.vtu");
  this->ExpectFailure(1, "--scenario s.json --ticks 10", "weights.vtu' is missing");
}

TEST_F(TestCoronarySimulator, RefusesWrongImagesAndContrast)
{
  this->ExpectBadScenario([](json& s) { s["imaging"] = { { "zoom", 2 } }; }, "imaging has 'zoom'");
  this->ExpectBadScenario(
    [](json& s) {
      s["imaging"] = { { "frame_rate_hz", 13 } };
    },
    "none of 7.5, 15, 30");
  this->ExpectBadScenario(
    [](json& s) {
      s["imaging"] = { { "columns", 100000 } };
    },
    "imaging has 'columns'");
  this->ExpectBadScenario(
    [](json& s) {
      s["contrast"] = { { "tracers", "many" } };
    },
    "contrast has 'tracers'");
  this->ExpectBadScenario(
    [](json& s) {
      s["contrast"] = { { "viscosity_mPa_s", -1 } };
    },
    "'viscosity_mPa_s'");
  this->Put("changed.json", TestScenario());
  std::string text = ReadText(this->Folder / "changed.json");
  text.insert(text.size() - 1, R"(,"imaging":{"energy_keV":NaN})");
  coronary::WriteFileAtomically((this->Folder / "changed.json").string(), text);
  this->ExpectFailure(1, "--scenario changed.json --ticks 10", "is not JSON");

  // A patient that is none.
  fs::create_directories(this->Folder / "empty");
  std::ofstream(this->Folder / "text.txt") << "hello";
  std::ofstream(this->Folder / "text.nii") << "hello";
  for (const auto& [file, part] : { std::pair("text.txt", "can not be a background"),
         std::pair("text.nii", "is not a NIfTI file"), std::pair("empty", "holds no DICOM images"),
         std::pair("nowhere.nii", "is not there") })
  {
    json scenario = TestScenario();
    scenario["imaging"] = { { "background", file } };
    this->Put("changed.json", scenario);
    this->ExpectFailure(1, "--scenario changed.json --ticks 10 --xray", part);
  }
}

TEST_F(TestCoronarySimulator, CineRunsBecomeDicomFilesAndAReport)
{
  json asked = TestScenario();
  asked["procedure"] =
    json::array({ { { "text", "Show <it> & well" }, { "goal", "angiogram" }, { "views", 1 } },
      { { "text", "Turn back" }, { "goal", "wire_back" } },
      { { "text", "Show more" }, { "goal", "angiogram" }, { "views", 2 } } });
  this->Put("s.json", asked);
  const auto pieces = [this](const json& list)
  {
    this->Put("cine.json",
      { { "format", "dynamiccoronary script" }, { "version", 1 }, { "pieces", list } });
  };
  const auto hold = [](double seconds, const char* pedal) {
    return json{ { "seconds", seconds }, { "pedals", { pedal } } };
  };
  json injection = hold(0.4, "cine");
  injection["inject_mL"] = 3;
  pieces(json::array(
    { hold(0.2, "fluoroscopy"), injection, hold(0.2, "fluoroscopy"), hold(0.3, "cine") }));
  const std::string session = "--headless --scenario s.json --xray --script cine.json --output ";
  ASSERT_EQ(this->Run(session + "a"), 0) << this->Said();
  // Each frame is the one that was shown.
  std::ifstream table(this->Folder / "a/frames.csv");
  std::map<int, std::vector<std::string>> shown;
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line))
  {
    std::vector<std::string> cells;
    std::istringstream words(line);
    for (std::string cell; std::getline(words, cell, ',');)
    {
      cells.push_back(cell);
    }
    ASSERT_EQ(cells.size(), 11U) << line;
    shown[std::stoi(cells[6])].push_back(cells[10]);
  }
  EXPECT_EQ(shown.size(), 3U);
  for (const int run : { 1, 2 })
  {
    gdcm::ImageReader reader;
    reader.SetFileName((this->Folder / "a/cine_0").concat(std::to_string(run) + ".dcm").c_str());
    ASSERT_TRUE(reader.Read());
    const gdcm::Image& image = reader.GetImage();
    ASSERT_EQ(image.GetDimension(2), shown[run].size());
    std::vector<char> pixels(image.GetBufferLength());
    ASSERT_TRUE(image.GetBuffer(pixels.data()));
    const std::size_t size = std::size_t(image.GetDimension(0)) * image.GetDimension(1);
    for (std::size_t frame = 0; frame < shown[run].size(); ++frame)
    {
      coronary::GreyImage grey;
      grey.columns = static_cast<int>(image.GetDimension(0));
      grey.rows = static_cast<int>(image.GetDimension(1));
      grey.values.assign(pixels.begin() + frame * size, pixels.begin() + (frame + 1) * size);
      EXPECT_EQ(coronary::Hexadecimal(coronary::SessionImager::HashOf(grey)), shown[run][frame])
        << run << ", " << frame;
    }
  }
  // What was asked for, and how well it was done.
  const json procedure = this->Statistics("a")["procedure"];
  ASSERT_EQ(procedure["steps"].size(), 3U);
  EXPECT_GT(procedure["steps"][0]["seconds"].get<double>(), 0.2);
  EXPECT_LT(procedure["steps"][0]["seconds"].get<double>(), 0.65);
  EXPECT_FALSE(procedure["steps"][1]["seconds"].is_null());
  EXPECT_TRUE(procedure["steps"][2]["seconds"].is_null());
  EXPECT_FALSE(procedure["passed"].get<bool>());
  double points = 100.0;
  for (const json& item : procedure["items"])
  {
    points -= std::min(
      item["most"].get<double>(), item["weight"].get<double>() * item["amount"].get<double>());
  }
  EXPECT_NEAR(procedure["points"].get<double>(), points, 1e-9);
  EXPECT_NE(this->Said().find("Step 1 of 3 is done: Show <it> & well."), std::string::npos);
  EXPECT_NE(
    ReadText(this->Folder / "stdout").find("Failed: not done: Show more."), std::string::npos);
  std::string page = ReadText(this->Folder / "a/report.html");
  EXPECT_NE(page.find("Show &lt;it&gt; &amp; well"), std::string::npos);
  EXPECT_NE(page.find("Failed: not done: Show more"), std::string::npos);
  page.erase(0, page.find('\n') + 1); // the document type
  std::size_t pictures = 0;
  coronary::ReadXml(page, "report.html",
    [&](const coronary::XmlElement& element)
    {
      if (element.Name() == "img")
      {
        ++pictures;
        EXPECT_TRUE(fs::exists(this->Folder / "a" / element.Required("src")));
      }
    });
  EXPECT_EQ(pictures, 2U);
  // A session in the same folder takes the place of these.
  pieces(json::array({ hold(0.1, "fluoroscopy") }));
  ASSERT_EQ(this->Run(session + "a"), 0) << this->Said();
  EXPECT_FALSE(fs::exists(this->Folder / "a/cine_01.dcm"));
}

// The model of a patient's images: made where it is not there, kept where it is, never that of others.
TEST_F(TestCoronarySimulator, APatientsImagesBecomeVesselsAndBackground)
{
  const auto pipeline = [this](const std::string& arguments)
  {
    const fs::path program =
      fs::path(DYNAMICCORONARY_SIMULATOR).parent_path() / "coronary-pipeline";
    return std::system(("cd '" + this->Folder.string() + "' && '" + program.string() + "' " +
      arguments + " --quiet >stdout 2>stderr")
                         .c_str());
  };
  ASSERT_EQ(pipeline("phantom --no-truth --fractions 0.75 --seed 1 --spacing 1.2 --output anna"), 0)
    << this->Said();
  ASSERT_EQ(
    pipeline("run anna/series.json --motion none --until surface --output anna-coronary"), 0)
    << this->Said();
  const fs::path surface = this->Folder / "anna-coronary/surface.vtp";
  const std::string before = ReadText(surface);
  fs::remove(surface);
  this->Put("look.json",
    { { "format", "dynamiccoronary script" }, { "version", 1 },
      { "pieces", { { { "seconds", 0.2 }, { "pedals", { "fluoroscopy" } } } } } });
  const std::string session = "--headless --patient anna/series.json --xray --script look.json ";
  ASSERT_EQ(this->Run(session + "--output a"), 0) << this->Said();
  EXPECT_NE(this->Said().find("step 1 of 4 (model)"), std::string::npos) << this->Said();
  EXPECT_NE(this->Said().find("contrast medium was taken out of"), std::string::npos)
    << this->Said();
  EXPECT_EQ(ReadText(surface), before) << "made again, with the settings of before";
  EXPECT_TRUE(fs::exists(this->Folder / "a/xray_00000.png"));
  EXPECT_EQ(this->Statistics("a")["scenario"], "anna");

  // The next start finds it, here in a folder that is named.
  const auto made = fs::last_write_time(surface);
  auto report = nlohmann::ordered_json::parse(ReadText(this->Folder / "anna-coronary/report.json"));
  report["stages"][2]["warnings"] = { "a vessel of 55 mm is in no tree" };
  std::ofstream(this->Folder / "anna-coronary/report.json") << report.dump(1);
  ASSERT_EQ(this->Run(session + "--vessels anna-coronary --output b"), 0) << this->Said();
  EXPECT_EQ(fs::last_write_time(surface), made);
  EXPECT_NE(this->Said().find("Warning: a vessel of 55 mm is in no tree"), std::string::npos)
    << this->Said();
  EXPECT_EQ(this->Statistics("a")["last_state_hash"], this->Statistics("b")["last_state_hash"]);

  // Images that are no background: the vessels are there all the same.
  ASSERT_EQ(this->Run("--headless --patient anna/series.json --print-scenario"), 0);
  json scenario = json::parse(ReadText(this->Folder / "stdout"));
  scenario["imaging"]["background"] = "nobody.nii";
  this->Put("else.json", scenario);
  ASSERT_EQ(this->Run("--headless --scenario else.json --xray --script look.json --output c"), 0)
    << this->Said();
  EXPECT_NE(this->Said().find("is not there; a made-up chest stands in"), std::string::npos)
    << this->Said();
  EXPECT_TRUE(fs::exists(this->Folder / "c/xray_00000.png"));

  fs::create_directories(this->Folder / "berta");
  fs::copy(this->Folder / "anna", this->Folder / "berta", fs::copy_options::recursive);
  this->ExpectFailure(1, "--patient berta/series.json --vessels anna-coronary --ticks 9",
    "is not the model of 'berta/series.json'");
  EXPECT_EQ(fs::last_write_time(surface), made);
  this->ExpectFailure(1, "--patient nobody --ticks 9", "'nobody' is not there");
  std::ofstream(this->Folder / "clara.nii") << "hello";
  this->ExpectFailure(1, "--patient clara.nii --ticks 9", "is not a NIfTI file");
  EXPECT_FALSE(fs::exists(this->Folder / "clara-coronary"));
  this->ExpectFailure(2, "--patient anna --replay a.pcirec", "--patient");
}

// forces.csv of a wire that the artery holds (wall_friction_factor 6) and that is pulled out through a JL4 guide.
TEST_F(TestCoronarySimulator, AScriptedWithdrawalResistsThePullAndTheGuideAddsToIt)
{
  ASSERT_EQ(this->Run("--scenario phantom-lca --catheter JL4-6F --print-scenario"), 0)
    << this->Said();
  json scenario = json::parse(ReadText(this->Folder / "stdout"));
  scenario["settings"]["wall_friction_factor"] = 6.0;
  scenario["vessels"]["phantom"]["surface_spacing_mm"] = 1.0;
  const double friction = scenario["catheter"]["friction"];
  ASSERT_EQ(friction, 0.08);
  // Mean over the push, the rest and the pull, without the times in which friction turns round.
  std::array<std::array<double, 3>, 2> means{};
  for (const bool rubs : { false, true })
  {
    scenario["catheter"]["friction"] = rubs ? friction : 0.0;
    this->Put("withdrawal.json", scenario);
    ASSERT_EQ(
      this->Run("--headless --quiet --scenario withdrawal.json --output-rate 100 --output w "
                "--script '" DYNAMICCORONARY_SOURCE_DIR "/Testing/Data/Driving/withdrawal.json'"),
      0)
      << this->Said();
    std::istringstream table(ReadText(this->Folder / "w/forces.csv"));
    std::string line;
    std::getline(table, line);
    ASSERT_EQ(line.rfind("tick,seconds,phase,inserted_mm,proximal_force_N,", 0), 0U);
    std::array<int, 3> counts{};
    while (std::getline(table, line))
    {
      double seconds = 0.0;
      double force = 0.0;
      ASSERT_EQ(std::sscanf(line.c_str(), "%*d,%lf,%*f,%*f,%lf", &seconds, &force), 2) << line;
      const int part = seconds > 3.0 && seconds < 4.0 ? 0
        : seconds > 4.2 && seconds < 4.5              ? 1
        : seconds > 4.7                               ? 2
                                                      : -1;
      if (part >= 0)
      {
        means[rubs][part] += force;
        ++counts[part];
      }
    }
    for (int part = 0; part < 3; ++part)
    {
      ASSERT_GT(counts[part], 25);
      means[rubs][part] /= counts[part];
    }
  }
  const auto& [smooth, rough] = means;
  EXPECT_GT(smooth[0], 0.02) << "pushed: it resists";
  EXPECT_LT(smooth[2], -0.02) << "pulled: it resists";
  // Bends of 5 rad beyond the simulated end: exp(0.08 * 5) = 1.5, and what the wire's stiffness presses on top.
  EXPECT_GT(rough[0], 1.5 * smooth[0]);
  EXPECT_LT(rough[2], 1.5 * smooth[2]);
  EXPECT_GT(rough[1], smooth[1])
    << "at rest the guide still holds against the hand's last movement";
  std::printf("| withdrawal through a JL4 guide, N felt: pushed, at rest, pulled | without "
              "friction %.3f, %.3f, "
              "%.3f | %.3f, %.3f, %.3f | |\n",
    smooth[0], smooth[1], smooth[2], rough[0], rough[1], rough[2]);
}

TEST_F(TestCoronarySimulator, TellsOfLesionsAndOfTheBalloon)
{
  const auto lesion = [](const char* vessel, double degree) {
    return json{ { "vessel", vessel }, { "at_mm", 10 }, { "length_mm", 8 }, { "degree", degree } };
  };
  json scenario = TestScenario();
  scenario["balloon"] = "semi-compliant-2.5x15";
  scenario["lesions"] = { lesion("pRCA", 0.5) };
  this->Put("lesion.json", scenario);
  ASSERT_EQ(
    this->Run(
      "--headless --scenario lesion.json --script drive.json --record a.pcirec --output out"),
    0)
    << this->Said();
  const json found = this->Statistics("out")["lesions"];
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0]["vessel"], "pRCA");
  EXPECT_NEAR(found[0]["stenosis_percent"].get<double>(), 50.0, 1.0);
  EXPECT_LT(found[0]["ffr"].get<double>(), 1.0);
  EXPECT_NE(ReadText(this->Folder / "out" / "balloon.csv").find("pressure_atm"), std::string::npos);
  EXPECT_EQ(this->Run("--headless --replay a.pcirec --verify"), 0) << this->Said();
  EXPECT_EQ(this->Run("--headless --scenario s.json --ticks 10 --output out"), 0);
  EXPECT_FALSE(fs::exists(this->Folder / "out" / "balloon.csv")) << "of the session before";

  EXPECT_FALSE(fs::exists(this->Folder / "out" / "stents.csv"));

  this->ExpectBadScenario([&](json& s) { s["lesions"] = { lesion("mLAD", 0.5) }; }, "no 'mLAD'");
  this->ExpectBadScenario([&](json& s) { s["lesions"] = { lesion("pRCA", 0.99) }; }, "'degree'");
  this->ExpectBadScenario([](json& s) { s["balloon"] = "none"; }, "has no balloon 'none'");
  this->ExpectBadScenario(
    [](json& s)
    {
      s["catheter"] = "JR4-4F";
      s["balloon"] = "non-compliant-3.5x12";
    },
    "is thicker");
  this->ExpectBadScenario(
    [](json& s)
    {
      s["catheter"] = "JR4-4F";
      s["balloon"] = "stent-3.5x12";
    },
    "'stent-3.5x12' is thicker");
  this->ExpectBadScenario([](json& s) { s["exchanges"] = { "stent-2.5x12" }; }, "'exchanges'");
  this->ExpectBadScenario(
    [](json& s)
    {
      s["balloon"] = "stent-2.5x12";
      s["exchanges"] = { "none" };
    },
    "has no balloon 'none'");
  const auto occlusion = [&](double degree, const json& cap)
  {
    json made = lesion("pRCA", degree);
    made["cap_MPa"] = cap;
    return made;
  };
  this->ExpectBadScenario([&](json& s) { s["lesions"] = { lesion("pRCA", 0.96) }; }, "not 1");
  this->ExpectBadScenario(
    [&](json& s) { s["lesions"] = { occlusion(0.9, 12) }; }, "lesion 1 has 'cap_MPa', which only");
  this->ExpectBadScenario([&](json& s) { s["lesions"] = { occlusion(1, -12) }; }, "'cap_MPa'");
  this->ExpectBadScenario([&](json& s) { s["lesions"] = { occlusion(1, "hard") }; }, "'cap_MPa'");
  this->ExpectBadScenario(
    [](json& s) { s["wire_exchanges"] = { "none" }; }, "has no wire 'none'; it has workhorse");
  this->ExpectBadScenario([](json& s) { s["wire_exchanges"] = "cto-9gf"; }, "'wire_exchanges'");
}

TEST_F(TestCoronarySimulator, RefusesInstrumentsThatDoNotFit)
{
  // A wire as thick as the catheter, and a catheter as thick as the vessel.
  ASSERT_EQ(this->Run("--scenario s.json --print-scenario"), 0);
  json scenario = json::parse(ReadText(this->Folder / "stdout"));
  json exchange = scenario;
  for (json& section : scenario["wire"]["sections"])
  {
    section["diameter_mm"] = 1.9;
    section["rest_curvature_per_mm"] = 0.0;
  }
  this->Put("thick.json", scenario);
  EXPECT_EQ(this->Run("--headless --quiet --scenario thick.json --ticks 10"), 1) << this->Said();
  scenario["wire"]["name"] = "thick";
  exchange["wire_exchanges"] = { scenario["wire"] };
  this->Put("thick.json", exchange);
  EXPECT_EQ(this->Run("--headless --quiet --scenario thick.json --ticks 10"), 1);
  EXPECT_NE(this->Said().find("the wire 'thick' is thicker"), std::string::npos) << this->Said();
  EXPECT_EQ(this->Run("--scenario s.json --print-scenario"), 0);
  scenario = json::parse(ReadText(this->Folder / "stdout"));
  scenario["catheter"]["outer_diameter_mm"] = 8.0;
  scenario["catheter"]["shape"] = json::array();
  this->Put("thick.json", scenario);
  EXPECT_EQ(this->Run("--headless --quiet --scenario thick.json --ticks 10"), 1) << this->Said();
}

TEST_F(TestCoronarySimulator, ClampsAbsurdDriving)
{
  this->Put("absurd.json",
    { { "format", "dynamiccoronary script" }, { "version", 1 },
      { "pieces",
        { { { "seconds", 0.1 }, { "wire_mm", 10000 } }, { { "seconds", 0 }, { "wire_mm", -1e6 } },
          { { "seconds", 0.1 }, { "wire_deg", 1e7 }, { "catheter_mm", -1e5 } } } } });
  ASSERT_EQ(this->Run("--headless --quiet --scenario s.json --script absurd.json --output a"), 0)
    << this->Said();
  const json statistics = this->Statistics("a");
  EXPECT_GT(statistics["number_of_messages"], 0);
  EXPECT_LT(statistics["inserted"]["largest_mm"].get<double>(), 100.0);
}

TEST_F(TestCoronarySimulator, LeavesNothingWhenInterrupted)
{
  EXPECT_EQ(this->Run("--headless --scenario s.json --ticks 1000000000 --output bad --record "
                      "bad.pcirec",
              "timeout --foreground --preserve-status -s INT 2"),
    130);
  EXPECT_NE(this->Said().find("coronary-simulator: interrupted"), std::string::npos);
  EXPECT_FALSE(fs::exists(this->Folder / "bad"));
  EXPECT_FALSE(fs::exists(this->Folder / "bad.pcirec"));
}

TEST_F(TestCoronarySimulator, NamesTheProgramForPosing)
{
  EXPECT_EQ(this->Run("--headless --pose result --pose-move 6:3,0,-1"), 2);
  EXPECT_NE(this->Said().find("coronary-posing result"), std::string::npos) << this->Said();
}

TEST_F(TestCoronarySimulator, PrintsWhatItKnows)
{
  ASSERT_EQ(this->Run("--list-scenarios"), 0);
  for (const char* name : { "phantom-lca", "phantom-rca", "hra-lca", "angiogram-lca", "cto-lad",
         "cto-microcatheter", "engage-lca", "lad-bifurcation", "lad-lesion", "lad-perforation",
         "lad-stent", "lca-events", "patient-lca", "patient-rca" })
  {
    EXPECT_NE(ReadText(this->Folder / "stdout").find(name), std::string::npos);
  }
  ASSERT_EQ(this->Run("--list-instruments"), 0);
  EXPECT_NE(ReadText(this->Folder / "stdout").find("cto-9gf"), std::string::npos);
  EXPECT_NE(ReadText(this->Folder / "stdout").find("microcatheter-1.8F"), std::string::npos);
  ASSERT_EQ(this->Run("--scenario phantom-lca --heart-rate 99 --wire cto-9gf --print-scenario"), 0);
  const json scenario = json::parse(ReadText(this->Folder / "stdout"));
  EXPECT_EQ(scenario["settings"]["heart_rate_bpm"], 99.0);
  EXPECT_EQ(scenario["wire"]["name"], "cto-9gf");
  EXPECT_EQ(this->Run("--help"), 0);
  EXPECT_EQ(this->Run("--version"), 0);
}
