#include "vtkRunTrees.h"

#include "LooseVessels.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkVesselTree.h"

#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDataSet.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <cstdio>
#include <variant>
#include <vector>

namespace coronary
{
using Json = nlohmann::ordered_json;

namespace
{
/// Text for one field of a CSV file.
std::string Quoted(const std::string& text)
{
  std::string quoted = "\"";
  for (const char c : text)
  {
    quoted += c == '"' ? "\"\"" : std::string(1, c);
  }
  return quoted + "\"";
}

std::string AtPlace(const Json& position)
{
  char text[100];
  std::snprintf(text, sizeof(text), "(%.1f, %.1f, %.1f)", position[0].get<double>(),
    position[1].get<double>(), position[2].get<double>());
  return text;
}

/// What a tree is called by the name of its seed.
std::string TreeName(const std::string& seed)
{
  return seed == "LCA" ? "the left coronary tree"
    : seed == "RCA"    ? "the right coronary tree"
                       : "the tree of seed " + seed;
}
}

Json Numbers(vtkDataSet* data, const char* name)
{
  Json list = Json::array();
  if (vtkDataArray* array = data->GetFieldData()->GetArray(name))
  {
    for (vtkIdType n = 0; n < array->GetNumberOfValues(); ++n)
    {
      list.push_back(array->GetTuple1(n));
    }
  }
  return list;
}

Json DescribeSeeds(vtkPolyData* seeds)
{
  vtkPointData* data = seeds->GetPointData();
  auto* names = vtkStringArray::SafeDownCast(data->GetAbstractArray(vtkCoronaryArrayNames::Name));
  Json list = Json::array();
  for (vtkIdType n = 0; n < seeds->GetNumberOfPoints(); ++n)
  {
    // Seeds of a surface have neither radius nor volume.
    const auto value = [&](const char* name)
    { return data->HasArray(name) ? data->GetArray(name)->GetTuple1(n) : 0.0; };
    double position[3];
    seeds->GetPoint(n, position);
    list.push_back(
      { { "name", names->GetValue(n) }, { "position", { position[0], position[1], position[2] } },
        { "confidence", value(vtkCoronaryArrayNames::Confidence) },
        { "radius", value(vtkCoronaryArrayNames::Radius) },
        { "volume", value(vtkCoronaryArrayNames::SeedVolume) } });
  }
  return list;
}

Json DescribeTrees(vtkPolyData* lines, vtkPolyData* seeds)
{
  vtkFieldData* fields = lines->GetFieldData();
  vtkDataArray* status = fields->GetArray(vtkCoronaryArrayNames::SeedStatus);
  auto* messages =
    vtkStringArray::SafeDownCast(fields->GetAbstractArray(vtkCoronaryArrayNames::SeedMessage));
  auto* names = vtkStringArray::SafeDownCast(
    seeds->GetPointData()->GetAbstractArray(vtkCoronaryArrayNames::Name));
  vtkDataArray* treeIds = lines->GetCellData()->GetArray(vtkCoronaryArrayNames::TreeIds);
  vtkDataArray* lengths = lines->GetCellData()->GetArray(vtkCoronaryArrayNames::Length);
  Json list = Json::array();
  for (vtkIdType n = 0; n < seeds->GetNumberOfPoints(); ++n)
  {
    vtkIdType branches = 0;
    double length = 0.0;
    for (vtkIdType cell = 0; cell < lines->GetNumberOfCells(); ++cell)
    {
      if (treeIds->GetTuple1(cell) == static_cast<double>(n))
      {
        ++branches;
        length += lengths->GetTuple1(cell);
      }
    }
    double position[3];
    seeds->GetPoint(n, position);
    list.push_back(
      { { "name", names->GetValue(n) }, { "position", { position[0], position[1], position[2] } },
        { "status", static_cast<int>(status->GetTuple1(n)) }, { "message", messages->GetValue(n) },
        { "branches", branches }, { "length", length } });
  }
  return list;
}

Json OstiaNotFound(const Json& seeds)
{
  Json lost = Json::array();
  for (const char* name : { "LCA", "RCA" })
  {
    const auto is = [&](const Json& seed) { return seed["name"] == name; };
    if (std::none_of(seeds.begin(), seeds.end(), is))
    {
      lost.push_back({ { "tree", name },
        { "message",
          TreeName(name) +
            " is lost: its ostium was not found on the aorta. Give the ostia of "
            "all trees with --seed X Y Z" } });
    }
  }
  return lost;
}

Json TreesNotFound(const Json& trees)
{
  Json lost = Json::array();
  for (const auto& tree : trees)
  {
    if (tree["status"] != 0 || tree["branches"] == 0)
    {
      const std::string why = tree["message"].get<std::string>();
      const std::string name = tree["name"].get<std::string>();
      lost.push_back({ { "tree", name },
        { "message",
          TreeName(name) + " is lost: no vessel was followed from " + AtPlace(tree["position"]) +
            (why.empty() ? "" : " (" + why + ")") +
            ". Give a point in its lumen with --seed X Y Z, or leave that seed out" } });
    }
  }
  return lost;
}

void AddLooseVessels(
  vtkPolyData* tree, vtkImageData* image, vtkImageData* vesselness, double tissue, double blood)
{
  namespace names = vtkCoronaryArrayNames;
  vtkFieldData* fields = tree->GetFieldData();
  vtkDataArray* frame = fields->GetArray(names::HeartFrame);
  if (!frame || frame->GetNumberOfComponents() != 16 || tree->GetNumberOfLines() == 0)
  {
    return;
  }
  std::array<double, 16> matrix{};
  frame->GetTuple(0, matrix.data());
  const HeartPose heart = HeartPoseOf(matrix);
  const VesselTree lines = vtkCoronary::TreeOf(tree);
  std::vector<float> imageCopy;
  std::vector<float> copy;
  const ScalarImage tubes =
    vtkCoronary::ScalarImageOf(vesselness, vesselness->GetPointData()->GetScalars(), copy);
  const LooseVesselInput input{ vtkCoronary::ScalarImageOf(
                                  image, image->GetPointData()->GetScalars(), imageCopy),
    std::get<const float*>(tubes.values), lines, heart, tissue, blood };
  const auto texts = [&](const char* name)
  {
    auto* array = vtkStringArray::SafeDownCast(fields->GetAbstractArray(name));
    if (!array)
    {
      vtkNew<vtkStringArray> made;
      made->SetName(name);
      fields->AddArray(made);
      array = made;
    }
    return array;
  };
  const auto numbers = [&](const char* name, int components)
  {
    vtkDataArray* array = fields->GetArray(name);
    if (!array)
    {
      vtkNew<vtkDoubleArray> made;
      made->SetName(name);
      made->SetNumberOfComponents(components);
      fields->AddArray(made);
      array = made;
    }
    return array;
  };
  for (const TreeWarning& warning : LooseVesselWarnings(FindLooseVessels(input)))
  {
    texts(names::Warnings)->InsertNextValue(warning.what);
    texts(names::WarningVessels)->InsertNextValue(warning.vessel);
    numbers(names::WarningPlaces, 3)->InsertNextTuple(warning.place.data());
    numbers(names::WarningConfidences, 1)->InsertNextTuple1(warning.confidence);
  }
}

Json DescribeChecks(vtkPolyData* tree)
{
  namespace names = vtkCoronaryArrayNames;
  vtkFieldData* fields = tree->GetFieldData();
  auto* texts = vtkStringArray::SafeDownCast(fields->GetAbstractArray(names::Warnings));
  auto* vessels = vtkStringArray::SafeDownCast(fields->GetAbstractArray(names::WarningVessels));
  vtkDataArray* places = fields->GetArray(names::WarningPlaces);
  vtkDataArray* confidences = fields->GetArray(names::WarningConfidences);
  Json list = Json::array();
  for (vtkIdType n = 0; texts && vessels && places && confidences && n < texts->GetNumberOfValues();
       ++n)
  {
    const double* place = places->GetTuple3(n);
    list.push_back({ { "what", texts->GetValue(n) }, { "vessel", vessels->GetValue(n) },
      { "place", { place[0], place[1], place[2] } }, { "confidence", confidences->GetTuple1(n) } });
  }
  return list;
}

std::string StatusTable(const Json& trees)
{
  std::string table = "name,x_mm,y_mm,z_mm,status,message,branches,length_mm\n";
  for (const auto& tree : trees)
  {
    table += Quoted(tree["name"].get<std::string>());
    for (const auto& value : tree["position"])
    {
      table += "," + value.dump();
    }
    table += "," + tree["status"].dump() + "," + Quoted(tree["message"].get<std::string>()) + "," +
      tree["branches"].dump() + "," + tree["length"].dump() + "\n";
  }
  return table;
}
}
