#include "vtkSessionFiles.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

namespace coronary
{
namespace
{
namespace names = vtkCoronaryArrayNames;

void AddField(vtkPolyData* data, const char* name, double value)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->InsertNextValue(value);
  data->GetFieldData()->AddArray(array);
}

double RadiusAt(const Guidewire& wire, double fromTip)
{
  double end = 0.0;
  for (const WireSection& section : wire.sections)
  {
    end += section.length;
    if (fromTip <= end)
    {
      return section.radius;
    }
  }
  return wire.sections.back().radius;
}

template <typename RadiusFunction>
void AddLine(const std::vector<Vector3>& line, int instrument, const RadiusFunction& radiusAt,
  vtkPoints* points, vtkCellArray* lines, vtkDoubleArray* radius, vtkDoubleArray* abscissa,
  vtkIntArray* instruments)
{
  if (line.size() < 2)
  {
    return;
  }
  lines->InsertNextCell(static_cast<int>(line.size()));
  instruments->InsertNextValue(instrument);
  double s = 0.0;
  for (std::size_t n = 0; n < line.size(); ++n)
  {
    s += n > 0 ? (line[n] - line[n - 1]).norm() : 0.0;
    lines->InsertCellPoint(points->InsertNextPoint(line[n].data()));
    radius->InsertNextValue(radiusAt(s));
    abscissa->InsertNextValue(s);
  }
}
}

void WriteInstruments(const std::string& path, const Intervention& intervention,
  const GuideCatheter& catheter, vtkMessageTrap& messages)
{
  const Guidewire& wire = intervention.Wire();
  vtkNew<vtkPolyData> data;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkDoubleArray> radius;
  radius->SetName(names::Radius);
  vtkNew<vtkDoubleArray> abscissa;
  abscissa->SetName(names::Abscissas);
  vtkNew<vtkIntArray> instruments;
  instruments->SetName("Instrument");
  AddLine(
    intervention.Centerline(), 0, [&](double s) { return RadiusAt(wire, s); }, points, lines,
    radius, abscissa, instruments);
  AddLine(
    intervention.CatheterLine(), 1, [&](double) { return catheter.outerRadius; }, points, lines,
    radius, abscissa, instruments);
  std::vector<Vector3> balloon;
  std::vector<double> radii;
  intervention.BalloonLine(balloon, radii);
  std::size_t next = 0;
  AddLine(
    balloon, intervention.Report().balloon.microcatheter ? 5 : 2,
    [&](double) { return radii[next++]; }, points, lines, radius, abscissa, instruments);
  std::vector<StentShape> stents;
  intervention.StentShapes(stents);
  for (const StentShape& stent : stents)
  {
    std::size_t place = 0;
    AddLine(
      stent.line, 3, [&](double) { return stent.radii[place++]; }, points, lines, radius, abscissa,
      instruments);
  }
  if (intervention.NumberOfWires() > 1)
  {
    AddLine(
      intervention.Centerline(1), 4, [&](double s) { return RadiusAt(intervention.Wire(1), s); },
      points, lines, radius, abscissa, instruments);
  }
  data->SetPoints(points);
  data->SetLines(lines);
  data->GetPointData()->AddArray(radius);
  data->GetPointData()->AddArray(abscissa);
  data->GetCellData()->AddArray(instruments);
  const TickReport& report = intervention.Report();
  AddField(data, "Tick", static_cast<double>(report.tick));
  AddField(data, names::PhaseTime, report.phase);
  AddField(data, "Inserted", report.inserted);
  AddField(data, "ProximalForce", report.proximalForce);
  AddField(data, "ProximalTorque", report.proximalTorque);
  AddField(data, "TipForce", report.tipForce);
  AddField(data, "MaximumForce", report.maximumForce);
  WritePolyData(path, data, messages);
}

vtkWallFiles::vtkWallFiles(const WallTopology& topology)
  : Cells(vtkSmartPointer<vtkPolyData>::New())
{
  vtkNew<vtkCellArray> polys;
  vtkNew<vtkIntArray> entity;
  entity->SetName(names::CellEntityIds);
  for (std::size_t n = 0; n < topology.triangles.size(); ++n)
  {
    const Triangle& triangle = topology.triangles[n];
    const vtkIdType ids[3] = { triangle[0], triangle[1], triangle[2] };
    polys->InsertNextCell(3, ids);
    entity->InsertNextValue(n < topology.entity.size() ? topology.entity[n] : 1);
  }
  vtkNew<vtkIntArray> group;
  group->SetName(names::GroupIds);
  for (const int branch : topology.group)
  {
    group->InsertNextValue(branch);
  }
  this->Cells->SetPolys(polys);
  this->Cells->GetCellData()->AddArray(entity);
  if (static_cast<std::int64_t>(topology.group.size()) == topology.points)
  {
    this->Cells->GetPointData()->AddArray(group);
  }
}

vtkWallFiles::~vtkWallFiles() = default;

void vtkWallFiles::Write(
  const std::string& path, const std::vector<Vector3>& points, vtkMessageTrap& messages) const
{
  vtkNew<vtkPolyData> data;
  data->ShallowCopy(this->Cells);
  vtkNew<vtkPoints> now;
  now->SetNumberOfPoints(static_cast<vtkIdType>(points.size()));
  for (std::size_t n = 0; n < points.size(); ++n)
  {
    now->SetPoint(static_cast<vtkIdType>(n), points[n].data());
  }
  data->SetPoints(now);
  WritePolyData(path, data, messages);
}
}
