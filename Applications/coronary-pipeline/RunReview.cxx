#include "RunReview.h"

#include "AtomicFile.h"
#include "Interruption.h"
#include "StagedFolder.h"
#include "vtkMessageTrap.h"

#include <cmath>
#include <filesystem>
#include <memory>
#include <stdexcept>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int Directions = 3;

Json NamedPicture(
  const ViewPicture& view, const std::string& name, WebReview& review, StagedFolder* folder)
{
  const std::string file = "pictures/" + name + ".png";
  Json entry = view.layout;
  if (folder)
  {
    WriteFileAtomically(folder->Add(file), view.picture.WholePng());
    entry["file"] = file;
  }
  entry["picture"] = review.AddPicture(view.picture.PlainPng());
  entry["marks"] = review.AddPicture(view.picture.LayerPng());
  entry["columns"] = view.picture.plain.Width();
  entry["rows"] = view.picture.plain.Height();
  return entry;
}

/// Of a name what file systems take, with a number before it that keeps the order.
std::string FileStem(std::size_t number, const std::string& name)
{
  std::string stem = (number < 9 ? "0" : "") + std::to_string(number + 1) + "-";
  for (const char c : name)
  {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    const bool capital = c >= 'A' && c <= 'Z';
    if (plain || capital)
    {
      stem += capital ? static_cast<char>(c - 'A' + 'a') : c;
    }
    else if (stem.back() != '-')
    {
      stem += '-';
    }
  }
  constexpr std::size_t Longest = 60;
  stem = stem.substr(0, Longest);
  return stem.back() == '-' ? stem.substr(0, stem.size() - 1) : stem;
}

double Rounded(double value)
{
  return std::round(100.0 * value) / 100.0;
}

Json DescribeVessel(const VesselView& view)
{
  Json entry = { { "name", view.name }, { "group", view.chain.groupId },
    { "tree", view.chain.treeId }, { "length", Rounded(view.chain.Length()) },
    { "bridged", Rounded(view.bridged) }, { "edited", Rounded(view.edited) },
    { "interpolated", Rounded(view.interpolated) }, { "stenosis", Rounded(view.narrowest) } };
  entry["pieces"] = Json::array();
  for (const VesselPiece& piece : view.chain.pieces)
  {
    entry["pieces"].push_back(
      { { "name", piece.name }, { "begin", Rounded(piece.begin) }, { "end", Rounded(piece.end) } });
  }
  entry["path"] = Json::array();
  for (const Vector3& place : view.path)
  {
    entry["path"].push_back({ Rounded(place[0]), Rounded(place[1]), Rounded(place[2]) });
  }
  return entry;
}

Json Describe(const ReviewedRun& look, int reference)
{
  Json run = { { "reference", reference }, { "warnings", look.result.Warnings() } };
  if (!look.withoutPictures.empty())
  {
    run["warnings"].push_back(look.withoutPictures);
  }
  for (const char* kind : { "edits", "checks", "bridges", "lesions", "calcium" })
  {
    run[kind] = look.result.Findings(kind);
  }
  // Of a population's motion: whose it is not.
  run["statement"] = look.result.MotionFindings("statement");
  for (const char* kind : { "placement", "filled", "limits" })
  {
    run[kind] = look.result.MotionFindings(kind);
  }
  run["cycle"] = look.cycle;
  run["stages"] = Json::array();
  const Json stages = look.result.report.contains("stages") ? look.result.report["stages"] : Json();
  for (const Json& stage : stages)
  {
    if (stage.is_object() && stage.contains("name") && stage.contains("state"))
    {
      run["stages"].push_back({ { "name", stage["name"] }, { "state", stage["state"] },
        { "seconds", stage.contains("seconds") ? stage["seconds"] : Json() } });
    }
  }
  return run;
}
}

bool IsRunFolder(const std::string& folder)
{
  std::error_code error;
  return fs::is_regular_file(fs::path(folder) / "report.json", error) &&
    fs::is_regular_file(fs::path(folder) / "centerline.vtp", error);
}

ReviewedRun OpenRun(const std::string& folder, const std::vector<std::string>& images,
  bool pictures, vtkMessageTrap& messages)
{
  ReviewedRun run;
  run.result = ReadRunResult(folder, messages);
  run.vessels = ViewsOf(run.result);
  if (!pictures)
  {
    return run;
  }
  try
  {
    run.image =
      ReadRunImage(run.result, images, messages, [](double) { return Interruption() == 0; });
    run.calcium = ReadRunCalcium(run.result, messages);
  }
  catch (const std::runtime_error& reason)
  {
    ThrowIfInterrupted();
    // What was asked for by name has to be there.
    if (!images.empty())
    {
      throw;
    }
    run.image = ResultImage();
    run.withoutPictures = std::string("there are no views of the image: ") + reason.what();
  }
  return run;
}

int RunReviewSteps(const ReviewedRun& run)
{
  return run.image.values ? static_cast<int>(run.vessels.size()) + Directions : 0;
}

std::size_t AddRunReview(const ReviewedRun& run, const ViewSettings& views, int reference,
  WebReview& review, StagedFolder* folder, const std::function<void(const std::string&)>& begin,
  const ProgressCallback& progress)
{
  Json said = Describe(run, reference);
  const auto goOn = [&](double) { return !progress || Interruption() == 0; };
  std::unique_ptr<VesselPainter> painter;
  if (run.image.values)
  {
    painter = std::make_unique<VesselPainter>(run.result, *run.image.values, run.calcium, views);
    said["window"] = { painter->Window().low, painter->Window().high };
    said["thickness"] = views.thickness;
    said["half_width"] = views.halfWidth;
  }
  std::size_t pictures = 0;
  said["vessels"] = Json::array();
  for (std::size_t n = 0; n < run.vessels.size(); ++n)
  {
    const VesselView& view = run.vessels[n];
    Json entry = DescribeVessel(view);
    if (painter)
    {
      begin(view.name);
      const std::string stem = FileStem(n, view.name);
      entry["straightened"] = NamedPicture(painter->Straightened(view, goOn), stem, review, folder);
      Report(progress, 0.25);
      entry["curved"] = NamedPicture(painter->Curved(view, goOn), stem + "-curved", review, folder);
      Report(progress, 0.5);
      entry["slab"] = NamedPicture(painter->Slab(view, goOn), stem + "-slab", review, folder);
      Report(progress, 0.75);
      const ViewPicture sections = painter->Sections(view, goOn);
      entry["sections"] = sections.layout;
      entry["sections"]["picture"] = review.AddPicture(sections.picture.PlainPng());
      pictures += 3;
    }
    said["vessels"].push_back(entry);
  }
  said["sheets"] = Json::array();
  for (int direction = 0; painter && direction < Directions; ++direction)
  {
    const char* sheet = VesselPainter::SheetName(direction);
    begin(std::string(sheet) + " slabs");
    Json entry = NamedPicture(
      painter->Sheet(direction, progress), std::string("slabs-") + sheet, review, folder);
    entry["name"] = sheet;
    said["sheets"].push_back(entry);
    ++pictures;
  }
  review.SetRun(std::move(said));
  return pictures;
}
}
