#include "vtkMarkups.h"

#include "CenterlineConversion.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkSeeds.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkIdList.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkStaticPointLocator.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

namespace names = vtkCoronaryArrayNames;

namespace coronary
{
namespace
{
constexpr const char* RadiusMeasurement = "Radius";

/// Colours that are told apart on a dark background.
constexpr std::array<std::array<double, 3>, 6> Colors{ { { 0.90, 0.35, 0.30 }, { 0.30, 0.65, 0.90 },
  { 0.45, 0.80, 0.35 }, { 0.95, 0.75, 0.25 }, { 0.75, 0.50, 0.90 }, { 0.30, 0.80, 0.75 } } };

vtkStringArray* Texts(vtkDataSetAttributes* data, const char* name)
{
  return vtkStringArray::SafeDownCast(data->GetAbstractArray(name));
}

Vector3 PointOf(vtkPolyData* data, vtkIdType id)
{
  Vector3 point;
  data->GetPoint(id, point.data());
  return point;
}

std::string Unused(const std::string& wanted, std::set<std::string>& used)
{
  std::string name = wanted;
  for (int n = 2; !used.insert(name).second; ++n)
  {
    name = wanted + " " + std::to_string(n);
  }
  return name;
}

std::vector<vtkDataArray*> Scalars(vtkPointData* data)
{
  std::vector<vtkDataArray*> arrays;
  for (int n = 0; n < data->GetNumberOfArrays(); ++n)
  {
    vtkDataArray* array = data->GetArray(n);
    if (array != nullptr && array->GetName() != nullptr && array->GetNumberOfComponents() == 1)
    {
      const bool radius = std::string(array->GetName()) == names::Radius;
      arrays.insert(radius ? arrays.begin() : arrays.end(), array);
    }
  }
  return arrays;
}
}

std::vector<Markup> CurvesOf(vtkPolyData* tree)
{
  if (tree->GetNumberOfLines() == 0)
  {
    throw std::runtime_error("There are no lines to be curves.");
  }
  vtkStringArray* labels = Texts(tree->GetCellData(), names::SegmentLabel);
  const std::vector<vtkDataArray*> arrays = Scalars(tree->GetPointData());
  std::vector<Markup> curves;
  std::set<std::string> used;
  vtkNew<vtkIdList> ids;
  const vtkIdType first = tree->GetNumberOfVerts();
  for (vtkIdType line = 0; line < tree->GetNumberOfLines(); ++line)
  {
    tree->GetLines()->GetCellAtId(line, ids);
    Markup curve;
    const std::string label = labels != nullptr ? labels->GetValue(first + line) : std::string();
    curve.name = Unused(label.empty() ? "Branch " + std::to_string(line) : label, used);
    curve.color = Colors[static_cast<std::size_t>(line) % Colors.size()];
    curve.glyphScale = 0.3;
    for (vtkDataArray* array : arrays)
    {
      const std::string name = array->GetName();
      const bool radius = name == names::Radius;
      const bool length = radius || name == names::Abscissas;
      Markup::Measurement values{ radius ? RadiusMeasurement : name, length ? "mm" : "", {} };
      for (const vtkIdType id : *ids)
      {
        values.values.push_back(array->GetComponent(id, 0));
      }
      // The format has no place for values that are missing.
      if (std::all_of(values.values.begin(), values.values.end(),
            [](double value) { return std::isfinite(value); }))
      {
        curve.measurements.push_back(std::move(values));
      }
    }
    for (const vtkIdType id : *ids)
    {
      curve.points.push_back(
        { curve.name + "-" + std::to_string(curve.points.size() + 1), "", PointOf(tree, id) });
    }
    curves.push_back(std::move(curve));
  }
  return curves;
}

std::vector<Markup> FiducialsOf(vtkPolyData* points, const std::string& name)
{
  vtkStringArray* labels = Texts(points->GetPointData(), names::Name);
  Markup list;
  list.type = "Fiducial";
  list.name = name;
  list.labels = true;
  list.glyphScale = 2.0;
  for (vtkIdType n = 0; n < points->GetNumberOfPoints(); ++n)
  {
    list.points.push_back(
      { labels != nullptr ? std::string(labels->GetValue(n)) : name + "-" + std::to_string(n + 1),
        "", PointOf(points, n) });
  }
  return { list };
}

bool AreFiducials(const std::vector<Markup>& markups)
{
  return std::all_of(
    markups.begin(), markups.end(), [](const Markup& markup) { return markup.type == "Fiducial"; });
}

vtkSmartPointer<vtkPolyData> SeedsOf(const std::vector<Markup>& markups)
{
  std::vector<Vector3> positions;
  std::vector<std::string> labels;
  for (const Markup& markup : markups)
  {
    for (const Markup::Point& point : markup.points)
    {
      positions.push_back(point.position);
      labels.push_back(point.label);
    }
  }
  return MakeSeeds(positions, 1.0, labels);
}

vtkSmartPointer<vtkPolyData> LinesOf(
  const std::vector<Markup>& markups, double radius, const std::string& file)
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkStringArray> labels;
  labels->SetName(names::SegmentLabel);
  vtkNew<vtkDoubleArray> radii;
  radii->SetName(names::Radius);
  for (const Markup& markup : markups)
  {
    const bool closed = markup.type == "ClosedCurve";
    if ((markup.type != "Curve" && markup.type != "Line" && !closed) || markup.points.size() < 2)
    {
      continue;
    }
    const Markup::Measurement* widths = markup.Find(RadiusMeasurement);
    widths = widths != nullptr ? widths : markup.Find(names::Radius);
    vtkNew<vtkIdList> ids;
    for (std::size_t n = 0; n < markup.points.size(); ++n)
    {
      ids->InsertNextId(points->InsertNextPoint(markup.points[n].position.data()));
      const double width = widths != nullptr ? widths->values[n] : radius;
      if (!(width >= 0.0 && std::isfinite(width)))
      {
        throw std::runtime_error("'" + file + "': the curve '" + markup.name +
          "' has a radius that is negative or not finite.");
      }
      radii->InsertNextValue(width);
    }
    if (closed)
    {
      ids->InsertNextId(ids->GetId(0));
    }
    lines->InsertNextCell(ids);
    labels->InsertNextValue(markup.name);
  }
  if (lines->GetNumberOfCells() == 0)
  {
    throw std::runtime_error("'" + file + "' has no curves of two or more points.");
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetLines(lines);
  data->GetPointData()->AddArray(radii);
  data->GetCellData()->AddArray(labels);
  return data;
}

vtkSmartPointer<vtkPolyData> TreeOfLines(vtkPolyData* lines, double tolerance)
{
  // Ends are put onto the points of other lines, the earlier line keeping its own.
  vtkNew<vtkStaticPointLocator> locator;
  locator->SetDataSet(lines);
  locator->BuildLocator();
  std::vector<vtkIdType> sameAs(static_cast<std::size_t>(lines->GetNumberOfPoints()));
  for (std::size_t n = 0; n < sameAs.size(); ++n)
  {
    sameAs[n] = static_cast<vtkIdType>(n);
  }
  const auto resolve = [&](vtkIdType id)
  {
    while (sameAs[static_cast<std::size_t>(id)] != id)
    {
      id = sameAs[static_cast<std::size_t>(id)];
    }
    return id;
  };
  vtkNew<vtkIdList> ids;
  vtkNew<vtkIdList> near;
  const vtkIdType count = lines->GetNumberOfLines();
  for (vtkIdType line = 0; line < count; ++line)
  {
    lines->GetLines()->GetCellAtId(line, ids);
    const std::set<vtkIdType> own(ids->begin(), ids->end());
    for (const vtkIdType end : { ids->GetId(0), ids->GetId(ids->GetNumberOfIds() - 1) })
    {
      locator->FindPointsWithinRadius(tolerance, PointOf(lines, end).data(), near);
      vtkIdType best = end;
      double nearest = 0.0;
      for (const vtkIdType other : *near)
      {
        const double away = (PointOf(lines, other) - PointOf(lines, end)).norm();
        if (own.count(other) == 0 && resolve(other) != resolve(end) &&
          (best == end || away < nearest || (away == nearest && other < best)))
        {
          best = other;
          nearest = away;
        }
      }
      const vtkIdType low = std::min(resolve(best), resolve(end));
      const vtkIdType high = std::max(resolve(best), resolve(end));
      sameAs[static_cast<std::size_t>(high)] = low;
    }
  }
  TgfSkeleton skeleton;
  std::map<vtkIdType, std::int64_t> joints;
  std::vector<double> radii;
  vtkDataArray* widths = lines->GetPointData()->GetArray(names::Radius);
  vtkStringArray* labels = Texts(lines->GetCellData(), names::SegmentLabel);
  std::map<std::array<std::int64_t, 2>, vtkIdType> lineOf;
  for (vtkIdType line = 0; line < count; ++line)
  {
    lines->GetLines()->GetCellAtId(line, ids);
    std::int64_t before = -1;
    for (const vtkIdType id : *ids)
    {
      const vtkIdType point = resolve(id);
      const auto found = joints.emplace(point, static_cast<std::int64_t>(joints.size()));
      if (found.second)
      {
        skeleton.joints.push_back(PointOf(lines, point));
        radii.push_back(widths != nullptr ? widths->GetComponent(point, 0) : 0.0);
      }
      const std::int64_t joint = found.first->second;
      if (before >= 0 && before != joint)
      {
        skeleton.bones.push_back({ before, joint });
        lineOf[{ std::min(before, joint), std::max(before, joint) }] = line;
      }
      before = joint;
    }
  }
  VesselTree tree = FromSkeleton(skeleton);
  tree.radius = radii;
  auto data = vtkSmartPointer<vtkPolyData>::New();
  vtkCoronary::SetTree(data, tree);
  if (labels != nullptr)
  {
    vtkNew<vtkStringArray> texts;
    texts->SetName(names::SegmentLabel);
    for (const VesselTree::Branch& branch : tree.branches)
    {
      const std::int64_t a = branch.points[0];
      const std::int64_t b = branch.points[1];
      texts->InsertNextValue(labels->GetValue(lineOf.at({ std::min(a, b), std::max(a, b) })));
    }
    data->GetCellData()->AddArray(texts);
  }
  return data;
}
}
