#include "SessionPictures.h"

#include "CineRuns.h"
#include "HeartShell.h"
#include "Numbers.h"
#include "SessionImager.h"
#include "StentEnhancement.h"
#include "vtkDisplay.h"
#include "vtkPictureCanvas.h"
#include "vtkScenePicture.h"
#include "vtkSimulatorScene.h"

#include "vtkImageData.h"

#include <cstdio>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr int SceneSize = 768;
constexpr std::int64_t SceneTriangles = 40000; // there is no hurry
/// Bytes of a file of images; a longer run has several. Twice as much is in memory while one is written.
constexpr std::size_t CineFile = std::size_t(128) << 20;

void WriteGrey(const GreyImage& image, const std::string& path)
{
  const auto row = static_cast<std::size_t>(image.columns);
  WritePngFile(ImageOfRows(image.columns, image.rows, 1,
                 [&](int y, unsigned char* to)
                 { std::memcpy(to, &image.values[static_cast<std::size_t>(y) * row], row); }),
    path);
}
}

struct SessionPictures::Internals
{
  std::unique_ptr<SessionImager> Imager;
  std::unique_ptr<vtkSimulatorScene> Scene;
  std::unique_ptr<vtkScenePicture> Picture;
  std::optional<CineRuns> Runs;
  struct Best
  {
    double contrast = -1.0; ///< mL
    ReportPicture picture;
  };
  std::map<std::int64_t, Best> BestOfRuns;
  std::vector<ReportPicture> Boosts;
  SessionSnapshot Moment;
  std::size_t Frames = 0;
  std::size_t Scenes = 0;
  void WriteRuns(bool all, const FolderCallback& folder);
  std::string Table = "file,tick,seconds,primary_deg,secondary_deg,phase,cine_run,photons,"
                      "air_kerma_mGy,contrast_mL,image_hash\n";
};

SessionPictures::SessionPictures(const PictureOptions& options, const SessionWorld& world)
  : Data(std::make_unique<Internals>())
{
  const Scenario& scenario = world.scenario;
  if (options.xray)
  {
    this->Data->Imager = std::make_unique<SessionImager>(
      world.wall->Topology(), scenario, world.background, false, world.moving);
    this->Data->Runs.emplace(scenario, "coronary-simulator " DYNAMICCORONARY_VERSION, 2 * CineFile);
  }
  if (options.scene)
  {
    std::string why;
    if (!CanDraw(why))
    {
      throw std::runtime_error("The anatomy can not be drawn: " + why +
        ". X-ray images need no display; xvfb-run gives one to programs.");
    }
    this->Data->Scene = std::make_unique<vtkSimulatorScene>(*world.wall, scenario,
      MakeHeartShell(*world.wall, scenario.vessels, world.heart.get()),
      SceneSettings{ SceneTriangles });
    this->Data->Picture =
      std::make_unique<vtkScenePicture>(*this->Data->Scene, SceneSize, SceneSize);
  }
}

SessionPictures::~SessionPictures() = default;

void SessionPictures::Internals::WriteRuns(bool all, const FolderCallback& folder)
{
  for (XrayAngiogram& run : this->Runs->Take(all))
  {
    const std::string name = NameOfCineFile(run);
    if (const EnhancedStent stent = EnhanceStent(run); stent.frames > 0)
    {
      const std::string picture = "boost" + name.substr(4, name.size() - 7) + "png";
      WriteGrey(stent.image, folder(picture));
      this->Boosts.push_back({ picture,
        "Run " + std::to_string(run.run) + ", stent boost of " + std::to_string(stent.frames) +
          " frames" });
    }
    WriteXrayAngiogram(std::move(run), folder(name));
  }
}

void SessionPictures::Finish(const FolderCallback& folder)
{
  if (this->Data->Runs)
  {
    this->Data->WriteRuns(true, folder);
  }
}

void SessionPictures::AddFrame(
  const TrainingSession& session, const FolderCallback& folder, RecordingWriter* recording)
{
  Internals& data = *this->Data;
  if (!data.Imager)
  {
    return;
  }
  session.SnapshotOfImage(data.Moment);
  const GreyImage& image = data.Imager->Expose(data.Moment);
  const std::uint64_t hash = SessionImager::HashOf(image);
  if (recording)
  {
    recording->ImageHash(session.Ticks(), hash);
  }
  if (!folder)
  {
    return;
  }
  data.Runs->Add(data.Moment, image, data.Imager->Images().Mode());
  data.WriteRuns(data.Runs->Bytes() >= CineFile, folder);
  char name[48];
  std::snprintf(name, sizeof(name), "xray_%05zu.png", data.Frames);
  WriteGrey(image, folder(name));
  const SessionSnapshot& now = data.Moment;
  char line[320];
  std::snprintf(line, sizeof(line), "%s,%llu,%.9g,%.6g,%.6g,%.6g,%lld,%.6g,%.6g,%.6g,%s\n", name,
    static_cast<unsigned long long>(now.tick), now.seconds, now.pose.primary / Degree,
    now.pose.secondary / Degree, now.report.phase, static_cast<long long>(now.exposure.run),
    now.exposure.photons, now.metrics.airKerma, now.contrast.injected, Hexadecimal(hash).c_str());
  data.Table += line;
  if (now.exposure.cine)
  {
    Internals::Best& best = data.BestOfRuns[now.exposure.run];
    if (now.contrast.inTree > best.contrast)
    {
      std::snprintf(line, sizeof(line), "Run %lld, %s at %.1f s",
        static_cast<long long>(now.exposure.run), ViewName(now.pose).c_str(), now.seconds);
      best = { now.contrast.inTree, { name, line } };
    }
  }
  ++data.Frames;
}

void SessionPictures::AddScene(const TrainingSession& session, const FolderCallback& folder)
{
  Internals& data = *this->Data;
  if (!data.Picture)
  {
    return;
  }
  session.SnapshotOfScene(data.Scene->WallPoints(), data.Moment);
  data.Scene->Update(data.Moment);
  if (data.Scenes == 0)
  {
    data.Scene->LookAsCArm(data.Moment.pose);
  }
  char name[48];
  std::snprintf(name, sizeof(name), "scene_%05zu.png", data.Scenes);
  data.Picture->Write(folder(name));
  ++data.Scenes;
}

std::size_t SessionPictures::Frames() const
{
  return this->Data->Frames;
}

std::vector<ReportPicture> SessionPictures::PicturesOfRuns() const
{
  std::vector<ReportPicture> pictures;
  for (const auto& [run, best] : this->Data->BestOfRuns)
  {
    pictures.push_back(best.picture);
  }
  pictures.insert(pictures.end(), this->Data->Boosts.begin(), this->Data->Boosts.end());
  return pictures;
}

const std::string& SessionPictures::FrameTable() const
{
  return this->Data->Table;
}
}
