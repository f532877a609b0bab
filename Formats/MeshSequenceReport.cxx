#include "MeshSequenceReport.h"

#include <nlohmann/json.hpp>

#include <cmath>
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
    row["least_volume_mm3"] = t.leastVolume;
    row["least_volume_id"] = t.leastVolumeAt;
    row["least_dihedral_angle_deg"] = t.leastDihedralAngle * Degrees;
    row["least_dihedral_angle_id"] = t.leastDihedralAngleAt;
    row["greatest_radius_edge_ratio"] = t.greatestRadiusEdgeRatio;
    row["greatest_radius_edge_ratio_id"] = t.greatestRadiusEdgeRatioAt;
    row["total_volume_mm3"] = t.totalVolume;
  }
  else
  {
    row["enclosed_volume_mm3"] = phase.surface.enclosedVolume;
  }
  row["surface_area_mm2"] = phase.surface.area;
  row["degenerate_triangles"] = phase.surface.degenerate.size();
  row["least_triangle_angle_deg"] = phase.surface.leastAngle * Degrees;
  return row;
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
}
