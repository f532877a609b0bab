#include "MeshSequenceReport.h"

#include "BoundedJson.h"
#include "TextFile.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;

constexpr double Degrees = 57.295779513082320877;

/// Paths by kind.
Json ByKind(const std::vector<std::pair<std::string, std::string>>& files)
{
  Json list = Json::object();
  for (const auto& [kind, path] : files)
  {
    list[kind] = path;
  }
  return list;
}

double PoorFraction(const MeshSequenceReport& report, const MeshSequenceReport::Phase& phase)
{
  return report.tetrahedra == 0
    ? 0.0
    : static_cast<double>(phase.tetrahedra.poor) / static_cast<double>(report.tetrahedra);
}

/// Numbers in the order of the columns, by their names: one list for both kinds of file.
Json QualityOf(const MeshSequenceReport& report, const MeshSequenceReport::Phase& phase)
{
  Json row = Json::object();
  if (report.tetrahedra > 0)
  {
    const TetrahedraQuality& t = phase.tetrahedra;
    row["inverted_tetrahedra"] = t.inverted.size();
    row["poor_tetrahedra"] = t.poor;
    row["poor_fraction"] = PoorFraction(report, phase);
    row["least_volume_mm3"] = t.minimumVolume;
    row["least_volume_id"] = t.minimumVolumeAt;
    row["least_dihedral_angle_deg"] = t.minimumDihedralAngle * Degrees;
    row["least_dihedral_angle_id"] = t.minimumDihedralAngleAt;
    row["greatest_radius_edge_ratio"] = t.maximumRadiusEdgeRatio;
    row["greatest_radius_edge_ratio_id"] = t.maximumRadiusEdgeRatioAt;
    row["total_volume_mm3"] = t.totalVolume;
  }
  else
  {
    row["enclosed_volume_mm3"] = phase.surface.enclosedVolume;
  }
  row["surface_area_mm2"] = phase.surface.area;
  row["degenerate_triangles"] = phase.surface.degenerate.size();
  row["least_triangle_angle_deg"] = phase.surface.minimumAngle * Degrees;
  return row;
}

/// Of a file without prefix: a kind that there is, and then what tells files of a kind apart.
bool IsBareName(const std::string& name)
{
  const std::size_t end = name.find_first_of("_./");
  const std::string kind = name.substr(0, end);
  return end != std::string::npos && name.find("..") == std::string::npos &&
    (kind == "volume" || kind == "surface" || kind == "vmtk" || kind == "simvascular" ||
      kind == "skin" || kind == "quality");
}

std::string Joined(const std::vector<std::int64_t>& ids)
{
  std::string text;
  for (const std::int64_t id : ids)
  {
    text += (text.empty() ? "" : " ") + std::to_string(id);
  }
  return text;
}
}

std::string MeshSequenceJson(const MeshSequenceReport& report)
{
  Json json;
  json["points"] = report.points;
  json["tetrahedra"] = report.tetrahedra;
  json["surface_points"] = report.surfacePoints;
  json["triangles"] = report.triangles;
  json["poor_below_deg"] =
    std::round(report.poorAngle * Degrees * 1e9) / 1e9; // 15, not 15.000000000000002
  json["faces"] = Json::array();
  for (const MeshSequenceReport::Face& face : report.faces)
  {
    json["faces"].push_back({ { "id", face.id }, { "name", face.name },
      { "type", face.id == 1 ? "wall" : "cap" }, { "triangles", face.triangles } });
  }
  json["prefix"] = report.prefix;
  json["files"] = ByKind(report.files);
  json["phases"] = Json::array();
  for (const MeshSequenceReport::Phase& phase : report.phases)
  {
    Json entry = { { "phase", json["phases"].size() }, { "time", phase.time } };
    entry["files"] = ByKind(phase.files);
    entry["quality"] = QualityOf(report, phase);
    if (report.tetrahedra > 0)
    {
      entry["inverted_ids"] = phase.tetrahedra.inverted;
    }
    entry["degenerate_ids"] = phase.surface.degenerate;
    json["phases"].push_back(std::move(entry));
  }
  // Names come from users' files, which may hold anything.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string MeshSequenceCsv(const MeshSequenceReport& report)
{
  std::ostringstream text;
  for (std::size_t k = 0; k < report.phases.size(); ++k)
  {
    const MeshSequenceReport::Phase& phase = report.phases[k];
    const Json row = QualityOf(report, phase);
    if (k == 0)
    {
      text << "phase,time";
      for (const auto& [name, value] : row.items())
      {
        text << ',' << name;
      }
      text << (report.tetrahedra > 0 ? ",inverted_ids" : ",degenerate_ids") << '\n';
    }
    text << k << ',' << Json(phase.time).dump();
    for (const auto& [name, value] : row.items())
    {
      const bool finite = !value.is_number_float() || std::isfinite(value.get<double>());
      text << ',' << (finite ? value.dump() : std::string("inf"));
    }
    text << ','
         << Joined(report.tetrahedra > 0 ? phase.tetrahedra.inverted : phase.surface.degenerate)
         << '\n';
  }
  return text.str();
}

namespace
{
/// Null when it is not there, or no JSON.
Json ReadReport(const std::string& path)
{
  try
  {
    return ParseBoundedJson<Json>(ReadTextFile(path, "a report"), path);
  }
  catch (const std::exception&)
  {
    return {};
  }
}
}

std::vector<std::string> MeshSequenceFiles(const std::string& path)
{
  const std::filesystem::path file(path);
  const std::string stem = file.stem().string();
  std::vector<std::string> names;
  const Json json = ReadReport(path);
  const auto object = [](const Json& parent, const char* name) -> Json
  {
    const auto found = parent.is_object() ? parent.find(name) : parent.end();
    return parent.is_object() && found != parent.end() ? *found : Json();
  };
  const auto each = [](const Json& list, const auto& use)
  {
    for (const auto& [kind, name] : list.items())
    {
      if (name.is_string())
      {
        use(kind, name.template get<std::string>());
      }
    }
  };
  std::vector<std::string> faces;
  for (const Json& face : object(json, "faces"))
  {
    const Json name = object(face, "name");
    if (name.is_string())
    {
      faces.push_back(name.get<std::string>());
    }
  }
  for (const Json& phase : object(json, "phases"))
  {
    each(object(phase, "files"),
      [&](const std::string& kind, const std::string& name)
      {
        if (kind != "simvascular")
        {
          names.push_back(name);
          return;
        }
        for (const char* part :
          { "/mesh-complete.mesh.vtu", "/mesh-complete.exterior.vtp", "/walls_combined.vtp" })
        {
          names.push_back(name + part);
        }
        for (const std::string& face : faces)
        {
          names.push_back(name + "/mesh-surfaces/");
          names.back().append(face).append(".vtp");
        }
      });
  }
  each(object(json, "files"),
    [&](const std::string& kind, const std::string& name)
    {
      names.push_back(name);
      const std::filesystem::path list(name);
      if (list.extension() == ".pvd")
      {
        names.push_back(list.stem().string() + (kind == "surface" ? ".vtp" : ".vtu") + ".series");
      }
    });
  const Json given = object(json, "prefix");
  const bool bare = given.is_string() && given.get<std::string>().empty();
  names.erase(std::remove_if(names.begin(), names.end(),
                [&](const std::string& name)
                { return bare ? !IsBareName(name) : name.rfind(stem + "_", 0) != 0; }),
    names.end());
  if (!names.empty())
  {
    names.push_back(file.filename().string());
  }
  return names;
}
}
