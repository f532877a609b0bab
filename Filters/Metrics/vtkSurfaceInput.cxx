#include "vtkSurfaceInput.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"

#include "vtkAppendPolyData.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkCompositeDataIterator.h"
#include "vtkCompositeDataSet.h"
#include "vtkDataArray.h"
#include "vtkDataObject.h"
#include "vtkIdList.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkTriangleFilter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

using SDDP = vtkStreamingDemandDrivenPipeline;

namespace vtkCoronary
{
namespace
{
bool IsTriangles(vtkPolyData* data)
{
  return data->GetNumberOfVerts() == 0 && data->GetNumberOfLines() == 0 &&
    data->GetNumberOfStrips() == 0 &&
    (data->GetNumberOfPolys() == 0 || data->GetPolys()->IsHomogeneous() == 3);
}

std::string Text(double value)
{
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

bool HasTime(vtkInformation* info)
{
  return info->Has(SDDP::TIME_STEPS()) || info->Has(SDDP::TIME_RANGE());
}
}

std::vector<std::int64_t> IdsOf(vtkDataArray* array, vtkIdType count, const std::string& kind)
{
  std::vector<std::int64_t> ids;
  if (array == nullptr)
  {
    return ids;
  }
  if (array->GetNumberOfComponents() != 1 || array->GetNumberOfTuples() != count)
  {
    throw std::invalid_argument(
      "The " + kind + " array " + array->GetName() + " must have one value each");
  }
  ids.resize(count);
  for (vtkIdType i = 0; i < count; ++i)
  {
    const double value = array->GetComponent(i, 0);
    // Also false for NaN.
    if (!(std::abs(value) < 9e15))
    {
      throw std::invalid_argument(
        "The " + kind + " array " + array->GetName() + " has a value that is no whole number");
    }
    ids[i] = static_cast<std::int64_t>(std::llround(value));
  }
  return ids;
}

vtkSmartPointer<vtkPolyData> PolyDataOf(vtkDataObject* input)
{
  vtkSmartPointer<vtkPolyData> data = vtkPolyData::SafeDownCast(input);
  if (auto* composite = vtkCompositeDataSet::SafeDownCast(input))
  {
    vtkNew<vtkAppendPolyData> append;
    int blocks = 0;
    vtkSmartPointer<vtkCompositeDataIterator> iterator;
    iterator.TakeReference(composite->NewIterator());
    for (iterator->InitTraversal(); !iterator->IsDoneWithTraversal(); iterator->GoToNextItem())
    {
      auto* block = vtkPolyData::SafeDownCast(iterator->GetCurrentDataObject());
      if (block != nullptr && block->GetNumberOfPoints() > 0)
      {
        vtkNew<vtkPolyData> copy;
        copy->ShallowCopy(block);
        append->AddInputData(copy);
        data = copy;
        ++blocks;
      }
    }
    if (blocks > 1)
    {
      append->SetOutputPointsPrecision(vtkAlgorithm::DOUBLE_PRECISION);
      append->Update();
      data = append->GetOutput();
    }
  }
  return data;
}

vtkSmartPointer<vtkPolyData> TrianglesOf(vtkDataObject* input)
{
  auto result = vtkSmartPointer<vtkPolyData>::New();
  const vtkSmartPointer<vtkPolyData> data = PolyDataOf(input);
  if (data == nullptr)
  {
    return result;
  }
  if (IsTriangles(data))
  {
    result->ShallowCopy(data);
    return result;
  }
  vtkNew<vtkPolyData> copy;
  copy->ShallowCopy(data);
  vtkNew<vtkTriangleFilter> triangulate;
  triangulate->SetInputData(copy);
  triangulate->PassLinesOff();
  triangulate->PassVertsOff();
  triangulate->Update();
  result->ShallowCopy(triangulate->GetOutput());
  return result;
}

coronary::SurfaceMesh SurfaceOf(
  vtkPolyData* triangles, const std::string& groupName, const std::string& capName)
{
  coronary::SurfaceMesh mesh;
  mesh.points.resize(triangles->GetNumberOfPoints());
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
  {
    triangles->GetPoint(static_cast<vtkIdType>(i), mesh.points[i].data());
  }
  vtkCellArray* polygons = triangles->GetPolys();
  mesh.triangles.reserve(polygons->GetNumberOfCells());
  vtkNew<vtkIdList> ids;
  for (vtkIdType cell = 0; cell < polygons->GetNumberOfCells(); ++cell)
  {
    polygons->GetCellAtId(cell, ids);
    mesh.triangles.push_back({ ids->GetId(0), ids->GetId(1), ids->GetId(2) });
  }
  const vtkIdType cells = triangles->GetNumberOfCells();
  if (!groupName.empty())
  {
    mesh.pointGroups = IdsOf(triangles->GetPointData()->GetArray(groupName.c_str()),
      triangles->GetNumberOfPoints(), "point");
    mesh.triangleGroups =
      IdsOf(triangles->GetCellData()->GetArray(groupName.c_str()), cells, "cell");
  }
  if (!capName.empty())
  {
    for (const std::int64_t entity :
      IdsOf(triangles->GetCellData()->GetArray(capName.c_str()), cells, "cell"))
    {
      mesh.caps.push_back(entity > 1 ? 1 : 0);
    }
  }
  return mesh;
}

void PublishCommonTime(vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* infos[2] = { inputs[0]->GetInformationObject(0),
    inputs[1]->GetInformationObject(0) };
  std::vector<double> steps;
  bool hasRange = false;
  double range[2] = { -HUGE_VAL, HUGE_VAL };
  for (vtkInformation* info : infos)
  {
    if (steps.empty() && info->Has(SDDP::TIME_STEPS()) && info->Length(SDDP::TIME_STEPS()) > 0)
    {
      const double* values = info->Get(SDDP::TIME_STEPS());
      steps.assign(values, values + info->Length(SDDP::TIME_STEPS()));
    }
    if (info->Has(SDDP::TIME_RANGE()))
    {
      hasRange = true;
      range[0] = std::max(range[0], info->Get(SDDP::TIME_RANGE())[0]);
      range[1] = std::min(range[1], info->Get(SDDP::TIME_RANGE())[1]);
    }
  }
  if (!steps.empty())
  {
    hasRange = true;
    const auto ends = std::minmax_element(steps.begin(), steps.end());
    range[0] = *ends.first;
    range[1] = *ends.second;
  }
  for (int port = 0; port < outputs->GetNumberOfInformationObjects(); ++port)
  {
    vtkInformation* info = outputs->GetInformationObject(port);
    info->Remove(SDDP::TIME_STEPS());
    info->Remove(SDDP::TIME_RANGE());
    if (!steps.empty())
    {
      info->Set(SDDP::TIME_STEPS(), steps.data(), static_cast<int>(steps.size()));
    }
    if (hasRange && range[0] <= range[1])
    {
      info->Set(SDDP::TIME_RANGE(), range, 2);
    }
  }
}

void RequestCommonTime(vtkInformationVector** inputs, vtkInformation* output)
{
  const bool any = output->Has(SDDP::UPDATE_TIME_STEP()) == 0;
  double time = any ? 0.0 : output->Get(SDDP::UPDATE_TIME_STEP());
  bool first = any;
  for (int i = 0; i < 2; ++i)
  {
    vtkInformation* info = inputs[i]->GetInformationObject(0);
    const Moment moment = NearestMoment(info, first, time);
    if (moment.exists)
    {
      info->Set(SDDP::UPDATE_TIME_STEP(), moment.time);
      time = moment.time;
      first = false;
    }
  }
}

std::string TimeMismatch(vtkInformationVector** inputs, double tolerance)
{
  vtkInformation* infos[2] = { inputs[0]->GetInformationObject(0),
    inputs[1]->GetInformationObject(0) };
  double times[2];
  for (int i = 0; i < 2; ++i)
  {
    if (!HasTime(infos[i]) || !infos[i]->Has(SDDP::UPDATE_TIME_STEP()))
    {
      return {};
    }
    times[i] = infos[i]->Get(SDDP::UPDATE_TIME_STEP());
  }
  if (std::abs(times[0] - times[1]) <= tolerance)
  {
    return {};
  }
  return "The result is of time " + Text(times[0]) + ", and the reference's nearest time is " +
    Text(times[1]) + ": further apart than TimeTolerance, " + Text(tolerance);
}

void SetCommonTime(vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  for (int side = 0; side < 2; ++side)
  {
    vtkInformation* info = inputs[side]->GetInformationObject(0);
    if (HasTime(info) && info->Has(SDDP::UPDATE_TIME_STEP()))
    {
      for (int port = 0; port < outputs->GetNumberOfInformationObjects(); ++port)
      {
        vtkDataObject::GetData(outputs, port)
          ->GetInformation()
          ->Set(vtkDataObject::DATA_TIME_STEP(), info->Get(SDDP::UPDATE_TIME_STEP()));
      }
      return;
    }
  }
}

namespace
{
/// Cells of the groups' array count in VTK's order: vertices come before lines.
coronary::Polylines TreeOfLines(vtkPolyData* data)
{
  coronary::Polylines tree;
  vtkDataArray* radius = vtkCoronary::FindRadius(data);
  tree.points.resize(data->GetNumberOfPoints());
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    data->GetPoint(i, tree.points[i].data());
    if (radius != nullptr)
    {
      tree.radius.push_back(radius->GetComponent(i, 0));
    }
  }
  const std::vector<std::int64_t> groups =
    IdsOf(data->GetCellData()->GetArray(vtkCoronaryArrayNames::GroupIds), data->GetNumberOfCells(),
      "cell");
  vtkNew<vtkIdList> cell;
  vtkCellArray* lines = data->GetLines();
  vtkIdType number = data->GetNumberOfVerts();
  for (lines->InitTraversal(); lines->GetNextCell(cell) != 0; ++number)
  {
    tree.lines.emplace_back(cell->begin(), cell->end());
    if (!groups.empty())
    {
      tree.groups.push_back(groups[number]);
    }
  }
  return tree;
}
}

coronary::Polylines TreeOf(vtkPolyData* data, const std::string& side)
{
  if (data == nullptr || data->GetNumberOfCells() == 0)
  {
    return {};
  }
  if (data->GetNumberOfLines() > 0)
  {
    return TreeOfLines(data);
  }
  if (data->GetNumberOfPolys() + data->GetNumberOfStrips() == 0)
  {
    return {};
  }
  vtkDataArray* group = data->GetPointData()->GetArray(vtkCoronaryArrayNames::GroupIds);
  vtkDataArray* abscissa = data->GetPointData()->GetArray(vtkCoronaryArrayNames::Abscissas);
  if (group == nullptr || abscissa == nullptr)
  {
    const std::string missing =
      group == nullptr ? vtkCoronaryArrayNames::GroupIds : vtkCoronaryArrayNames::Abscissas;
    throw std::invalid_argument("The " + side + " is a surface without the point array " + missing +
      ": its branches are not known; give its centerline instead");
  }
  const vtkIdType count = data->GetNumberOfPoints();
  const std::vector<std::int64_t> groups = IdsOf(group, count, "point");
  if (abscissa->GetNumberOfComponents() != 1 || abscissa->GetNumberOfTuples() != count)
  {
    throw std::invalid_argument("The point array Abscissas must have one value each");
  }
  std::vector<coronary::Vector3> points(count);
  std::vector<double> along(count);
  for (vtkIdType i = 0; i < count; ++i)
  {
    data->GetPoint(i, points[i].data());
    along[i] = abscissa->GetComponent(i, 0);
  }
  return coronary::TreeOfSurface(points, groups, along);
}
}
