#include "vtkRunMeshes.h"

#include "ParallelFor.h"
#include "TetrahedralMesh.h"
#include "TriangleBvh.h"
#include "vtkCoronaryArrayNames.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkIdList.h"
#include "vtkMath.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"
#include "vtkSurfaceCleaner.h"
#include "vtkTetrahedralMesher.h"

#include <cstdio>
#include <limits>
#include <set>
#include <stdexcept>
#include <vector>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;
namespace names = vtkCoronaryArrayNames;

/// What is wider than so many times the largest radius of a vessel is none; aneurysms are narrower.
constexpr double WidestVessel = 2.0;

vtkStringArray* Texts(vtkPolyData* data, const char* name)
{
  return vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray(name));
}

Json List(vtkPolyData* surface, const char* what, const char* key, const char* vessels,
  const char* places, const char* lengths)
{
  Json list = Json::array();
  vtkStringArray* texts = Texts(surface, what);
  vtkStringArray* of = Texts(surface, vessels);
  vtkDataArray* at = surface->GetFieldData()->GetArray(places);
  vtkDataArray* length = lengths ? surface->GetFieldData()->GetArray(lengths) : nullptr;
  // A given surface has repairs of another kind, without vessels.
  for (vtkIdType n = 0; texts && of && at && n < texts->GetNumberOfValues(); ++n)
  {
    Json one = { { "vessel", of->GetValue(n) }, { key, texts->GetValue(n) },
      { "place", { at->GetComponent(n, 0), at->GetComponent(n, 1), at->GetComponent(n, 2) } } };
    if (length)
    {
      one["length_mm"] = length->GetTuple1(n);
    }
    list.push_back(one);
  }
  return list;
}

/// The first "(x, y, z)" of a message. @return whether there is one
bool PlaceIn(const std::string& message, double place[3])
{
  for (std::size_t at = message.find('('); at != std::string::npos; at = message.find('(', at + 1))
  {
    if (std::sscanf(message.c_str() + at, "(%lf, %lf, %lf)", place, place + 1, place + 2) == 3)
    {
      return true;
    }
  }
  return false;
}
}

void RequireVessels(vtkPolyData* tree, const std::string& path, double maximumRadius)
{
  vtkDataArray* radii = tree->GetPointData()->GetArray(names::Radius);
  vtkIdType widest = 0;
  for (vtkIdType n = 1; n < radii->GetNumberOfTuples(); ++n)
  {
    widest = radii->GetTuple1(n) > radii->GetTuple1(widest) ? n : widest;
  }
  const double limit = WidestVessel * maximumRadius;
  if (radii->GetTuple1(widest) > limit)
  {
    double p[3];
    tree->GetPoint(widest, p);
    char text[200];
    std::snprintf(text, sizeof(text),
      "' has a radius of %.1f mm at (%.1f, %.1f, %.1f), more than twice --largest-radius (%g mm): "
      "the tree runs into a chamber or a great vessel",
      radii->GetTuple1(widest), p[0], p[1], p[2], maximumRadius);
    throw std::runtime_error(
      "'" + path + text + "; give seeds, a window, larger scales or another --largest-radius.");
  }
}

void DescribeChanges(vtkPolyData* surface, Json& numbers)
{
  numbers["repairs"] =
    List(surface, names::Repairs, "what", names::RepairVessels, names::RepairPlaces, nullptr);
  numbers["left_out"] = List(surface, names::LeftOut, "reason", names::LeftOutVessels,
    names::LeftOutPlaces, names::LeftOutLengths);
}

/// Points at free ends of a tree's lines that a mended surface no longer covers.
void AddUncovered(vtkPolyData* tree, vtkPolyData* surface, std::set<vtkIdType>& gone)
{
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
  for (vtkIdType n = 0; n < surface->GetNumberOfPoints(); ++n)
  {
    points.emplace_back(surface->GetPoint(n));
  }
  vtkNew<vtkIdList> ids;
  for (vtkIdType cell = 0; cell < surface->GetNumberOfCells(); ++cell)
  {
    surface->GetCellPoints(cell, ids);
    if (ids->GetNumberOfIds() == 3)
    {
      triangles.push_back({ ids->GetId(0), ids->GetId(1), ids->GetId(2) });
    }
  }
  const TriangleBvh wall(points, triangles);
  constexpr double onCap = 0.3; // mm
  std::vector<int> uses(static_cast<std::size_t>(tree->GetNumberOfPoints()), 0);
  for (vtkIdType cell = 0; cell < tree->GetNumberOfCells(); ++cell)
  {
    tree->GetCellPoints(cell, ids);
    for (vtkIdType i = 0; i < ids->GetNumberOfIds(); ++i)
    {
      ++uses[static_cast<std::size_t>(ids->GetId(i))];
    }
  }
  for (vtkIdType cell = 0; cell < tree->GetNumberOfCells(); ++cell)
  {
    tree->GetCellPoints(cell, ids);
    const vtkIdType count = ids->GetNumberOfIds();
    for (const bool fromStart : { true, false })
    {
      for (vtkIdType i = 0; i < count; ++i)
      {
        const vtkIdType p = ids->GetId(fromStart ? i : count - 1 - i);
        const Vector3 place(tree->GetPoint(p));
        // A tree begins and ends on its caps.
        if (uses[static_cast<std::size_t>(p)] > 1 || wall.Winding(place) != 0 ||
          wall.Closest(place, onCap).triangle >= 0)
        {
          break;
        }
        gone.insert(p);
      }
    }
  }
}

vtkSmartPointer<vtkPolyData> SweptPart(vtkPolyData* tree, vtkPolyData* surface)
{
  std::set<vtkIdType> gone;
  if (vtkDataArray* missing = surface->GetFieldData()->GetArray(names::LeftOutPoints))
  {
    for (vtkIdType n = 0; n < missing->GetNumberOfTuples(); ++n)
    {
      gone.insert(static_cast<vtkIdType>(missing->GetTuple1(n)));
    }
  }
  // Ends that were trimmed are told by the repairs, not by their points.
  if (surface->GetFieldData()->GetAbstractArray(names::RepairVessels) != nullptr || !gone.empty())
  {
    AddUncovered(tree, surface, gone);
  }
  if (gone.empty())
  {
    return tree;
  }
  auto part = vtkSmartPointer<vtkPolyData>::New();
  part->SetPoints(tree->GetPoints());
  part->GetPointData()->PassData(tree->GetPointData());
  part->GetFieldData()->PassData(tree->GetFieldData());
  part->GetCellData()->CopyAllocate(tree->GetCellData());
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkIdList> line;
  for (vtkIdType cell = 0; cell < tree->GetNumberOfCells(); ++cell)
  {
    tree->GetCellPoints(cell, line);
    vtkIdType low = 0;
    vtkIdType high = line->GetNumberOfIds();
    while (low < high && gone.count(line->GetId(low)) > 0)
    {
      ++low;
    }
    while (high > low && gone.count(line->GetId(high - 1)) > 0)
    {
      --high;
    }
    if (high - low < 2)
    {
      continue;
    }
    vtkNew<vtkIdList> kept;
    for (vtkIdType i = low; i < high; ++i)
    {
      kept->InsertNextId(line->GetId(i));
    }
    part->GetCellData()->CopyData(tree->GetCellData(), cell, lines->InsertNextCell(kept));
  }
  part->SetLines(lines);
  return part;
}

std::string NearestVessel(vtkPolyData* tree, const double place[3])
{
  vtkDataArray* groups = tree->GetCellData()->GetArray(names::GroupIds);
  auto* labels =
    vtkStringArray::SafeDownCast(tree->GetCellData()->GetAbstractArray(names::SegmentLabel));
  double best = std::numeric_limits<double>::max();
  vtkIdType nearest = -1;
  vtkNew<vtkIdList> line;
  for (vtkIdType cell = 0; cell < tree->GetNumberOfCells(); ++cell)
  {
    tree->GetCellPoints(cell, line);
    for (vtkIdType i = 0; i < line->GetNumberOfIds(); ++i)
    {
      double p[3];
      tree->GetPoint(line->GetId(i), p);
      const double square = vtkMath::Distance2BetweenPoints(p, place);
      if (square < best)
      {
        best = square;
        nearest = cell;
      }
    }
  }
  if (nearest < 0)
  {
    return "";
  }
  const std::string label = labels ? std::string(labels->GetValue(nearest)) : std::string();
  const std::string group = "group " +
    std::to_string(
      groups ? static_cast<int>(groups->GetTuple1(nearest)) : static_cast<int>(nearest));
  return label.empty() ? group : label + " (" + group + ")";
}

std::string FillSurface(vtkTetrahedralMesher* mesher, vtkPolyData* surface, vtkPolyData* tree,
  const std::function<void()>& update)
{
  mesher->SetInputData(surface);
  std::string reason;
  try
  {
    update();
    return "";
  }
  catch (const Cancelled&)
  {
    throw;
  }
  catch (const std::runtime_error& error)
  {
    reason = error.what();
  }
  double place[3];
  const std::string vessel = PlaceIn(reason, place) ? NearestVessel(tree, place) : std::string();
  const std::string where = vessel.empty() ? std::string() : " of " + vessel;
  vtkNew<vtkSurfaceCleaner> cleaner;
  cleaner->SetInputData(surface);
  cleaner->Update();
  for (const bool other : { false, true })
  {
    if (other && !HasTetrahedralBackend(TetrahedralBackend::Cgal))
    {
      break;
    }
    mesher->SetInputData(cleaner->GetOutput());
    if (other)
    {
      mesher->SetBackend(vtkTetrahedralMesher::CgalBackend);
    }
    try
    {
      update();
    }
    catch (const Cancelled&)
    {
      throw;
    }
    catch (const std::runtime_error&)
    {
      continue;
    }
    vtkGenericWarningMacro(<< "The wall" << where << " could not be filled as it is (" << reason
                           << "); " << (other ? "the other mesher" : "cleaning it")
                           << " helped, look at the mesh there");
    return other ? "other backend" : "cleaned";
  }
  throw std::runtime_error("The wall" + where + " can not be filled with tetrahedra: " + reason +
    " Cleaning the surface and another mesher did not help" +
    (vessel.empty() ? "" : "; look at the centerline of " + vessel + " there") +
    ", take longer --edges, or leave short branches out with a greater --least-branch.");
}
}
