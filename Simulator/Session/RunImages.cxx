#include "RunImages.h"

#include "BoundedJson.h"
#include "TextFile.h"

#include <filesystem>
#include <stdexcept>

namespace coronary
{
RunImages ReadRunImages(const std::string& folder)
{
  using Json = nlohmann::ordered_json;
  const std::filesystem::path path(folder);
  const std::string file = (path / "report.json").string();
  const Json report = ParseBoundedJson<Json>(ReadTextFile(file, "a report"), "'" + file + "'");
  const auto member = [&file](const Json& object, const char* name) -> const Json&
  {
    if (!object.is_object() || !object.contains(name))
    {
      throw std::runtime_error("'" + file + "' has no '" + name +
        "': a run of images has it when its arteries were segmented.");
    }
    return object.at(name);
  };
  RunImages images;
  images.time = FiniteIn(member(report, "time"), file, "time");
  const Json& segmentation = member(report, "segmentation");
  const Json& window = member(segmentation, "window");
  if (!window.is_array() || window.size() != 2)
  {
    throw std::runtime_error("'" + file + "' has a 'window' that is not two numbers.");
  }
  images.blood.tissue = FiniteIn(window[0], file, "window[0]");
  images.blood.blood = FiniteIn(window[1], file, "window[1]");
  for (const Json& seed : member(segmentation, "seeds"))
  {
    images.blood.ostia.push_back(PositionIn(seed, file, "segmentation.seeds"));
  }
  images.mask = (path / TextIn(segmentation, "file", file, "segmentation")).string();
  return images;
}
}
