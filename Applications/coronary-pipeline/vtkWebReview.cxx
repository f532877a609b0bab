#include "vtkWebReview.h"

#include "MeshDistance.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkScenePainter.h"
#include "vtkSurfaceInput.h"
#include "vtkSurfaceReduction.h"

#include "vtkCellArray.h"
#include "vtkCellArrayIterator.h"
#include "vtkCellData.h"
#include "vtkMath.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace coronary
{
namespace
{
/// What a reduced surface may differ from its original by more than is said, mm.
constexpr double DeviationError = 1e-2;
/// Of a guessed piece of a line that is drawn, and of one that is not, mm.
constexpr double DashLength = 1.5;
/// Free at each side of the picture of a result, share of its size.
constexpr double ResultMargin = 0.09;
constexpr double ResultAspect = 10.0 / 9.0;

/// Branches by their group's name, in the order in which they are met.
class BranchList
{
public:
  std::uint8_t IndexOf(std::int64_t group, const std::map<std::int64_t, std::string>& labels)
  {
    const auto known = this->Indices.find(group);
    if (known != this->Indices.end())
    {
      return known->second;
    }
    const auto label = labels.find(group);
    const std::string name = label == labels.end() || label->second.empty()
      ? "branch " + std::to_string(group)
      : label->second;
    const auto named = std::find(this->Names.begin(), this->Names.end(), name);
    auto index = static_cast<std::size_t>(named - this->Names.begin());
    if (named == this->Names.end() && index < ReviewTopology::NoBranch)
    {
      this->Names.push_back(name);
    }
    index = std::min<std::size_t>(index, ReviewTopology::NoBranch);
    return this->Indices[group] = static_cast<std::uint8_t>(index);
  }

  std::vector<std::string> Names;

private:
  std::map<std::int64_t, std::uint8_t> Indices;
};

bool SameCells(vtkPolyData* a, vtkPolyData* b, vtkCellArray* cellsOfA, vtkCellArray* cellsOfB)
{
  if (a->GetNumberOfPoints() != b->GetNumberOfPoints() ||
    cellsOfA->GetNumberOfCells() != cellsOfB->GetNumberOfCells())
  {
    return false;
  }
  auto left = vtkSmartPointer<vtkCellArrayIterator>::Take(cellsOfA->NewIterator());
  auto right = vtkSmartPointer<vtkCellArrayIterator>::Take(cellsOfB->NewIterator());
  right->GoToFirstCell();
  for (left->GoToFirstCell(); !left->IsDoneWithTraversal(); left->GoToNextCell())
  {
    vtkIdType count[2];
    const vtkIdType* ids[2];
    left->GetCurrentCell(count[0], ids[0]);
    right->GetCurrentCell(count[1], ids[1]);
    if (count[0] != count[1] || !std::equal(ids[0], ids[0] + count[0], ids[1]))
    {
      return false;
    }
    right->GoToNextCell();
  }
  return true;
}

void AppendPosition(vtkPolyData* data, vtkIdType point, std::vector<float>& positions)
{
  double place[3];
  data->GetPoint(point, place);
  for (const double coordinate : place)
  {
    positions.push_back(static_cast<float>(coordinate));
  }
}

/// Of each point that triangles of a group have, or that has one itself.
std::vector<std::optional<std::int64_t>> GroupsOfPoints(const SurfaceMesh& surface)
{
  std::vector<std::optional<std::int64_t>> groups(surface.points.size());
  for (std::size_t k = 0; k < surface.triangleGroups.size(); ++k)
  {
    for (const std::int64_t corner : surface.triangles[k])
    {
      groups[static_cast<std::size_t>(corner)] = surface.triangleGroups[k];
    }
  }
  std::copy(surface.pointGroups.begin(), surface.pointGroups.end(), groups.begin());
  return groups;
}

/// A tree over the phases, and what it calls its groups.
struct Lines
{
  ReviewSeries series;
  std::map<std::int64_t, std::string> labels;
};

/// Which pieces of lines are taken.
enum class Pieces
{
  Seen,  ///< both ends were
  Dashes ///< every other of the rest, about DashLength long
};

bool IsGuessed(const std::vector<double>& guessed, vtkIdType point)
{
  return point < static_cast<vtkIdType>(guessed.size()) &&
    guessed[static_cast<std::size_t>(point)] > 0.5;
}

/// Pieces of the lines, and each name at the middle of the longest line that bears it.
ReviewTopology TopologyOfLines(vtkPolyData* tree, const std::map<std::int64_t, std::string>& names,
  BranchList& branches, const std::vector<double>& guessed, Pieces pieces)
{
  ReviewTopology topology;
  topology.points = static_cast<std::uint32_t>(tree->GetNumberOfPoints());
  topology.branches.assign(topology.points, ReviewTopology::NoBranch);
  vtkDataArray* groups = tree->GetNumberOfVerts() == 0
    ? tree->GetCellData()->GetArray(vtkCoronaryArrayNames::GroupIds)
    : nullptr;
  std::map<std::string, std::pair<vtkIdType, ReviewLabel>> labels;
  auto cells = vtkSmartPointer<vtkCellArrayIterator>::Take(tree->GetLines()->NewIterator());
  for (cells->GoToFirstCell(); !cells->IsDoneWithTraversal(); cells->GoToNextCell())
  {
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    cells->GetCurrentCell(count, ids);
    double arc = 0.0; // of the guessed stretch
    for (vtkIdType k = 1; k < count; ++k)
    {
      const bool isGuessed = IsGuessed(guessed, ids[k - 1]) || IsGuessed(guessed, ids[k]);
      const bool isDash = std::fmod(arc, 2.0 * DashLength) < DashLength;
      if (isGuessed)
      {
        double ends[2][3];
        tree->GetPoint(ids[k - 1], ends[0]);
        tree->GetPoint(ids[k], ends[1]);
        arc += std::sqrt(vtkMath::Distance2BetweenPoints(ends[0], ends[1]));
      }
      else
      {
        arc = 0.0;
      }
      if (pieces == Pieces::Dashes ? isGuessed && isDash : !isGuessed)
      {
        topology.cells.push_back(static_cast<std::uint32_t>(ids[k - 1]));
        topology.cells.push_back(static_cast<std::uint32_t>(ids[k]));
      }
    }
    if (!groups || count == 0)
    {
      continue;
    }
    const auto group = static_cast<std::int64_t>(groups->GetTuple1(cells->GetCurrentCellId()));
    const std::uint8_t branch = branches.IndexOf(group, names);
    for (vtkIdType k = 0; k < count; ++k)
    {
      topology.branches[static_cast<std::size_t>(ids[k])] = branch;
    }
    const auto name = names.find(group);
    if (name != names.end() && !name->second.empty())
    {
      auto& [longest, label] = labels[name->second];
      if (count > longest)
      {
        longest = count;
        label = { name->second, static_cast<std::uint32_t>(ids[count / 2]) };
      }
    }
  }
  for (const auto& [name, entry] : labels)
  {
    topology.labels.push_back(entry.second);
  }
  return topology;
}

Lines ReadLines(const EvaluationScene::Source& source, int count,
  const std::vector<double>& guessed = {}, Pieces pieces = Pieces::Seen)
{
  Lines lines;
  lines.series.corners = 2;
  BranchList branches;
  vtkSmartPointer<vtkPolyData> last;
  for (int k = 0; source && k < count; ++k)
  {
    const vtkSmartPointer<vtkPolyData> tree = source(k);
    ReviewFrame frame;
    if (tree && tree->GetNumberOfLines() > 0)
    {
      if (!last || !SameCells(last, tree, last->GetLines(), tree->GetLines()))
      {
        AddGroupNames(tree, lines.labels);
        lines.series.topologies.push_back(
          TopologyOfLines(tree, lines.labels, branches, guessed, pieces));
      }
      last = tree;
      for (vtkIdType point = 0; point < tree->GetNumberOfPoints(); ++point)
      {
        AppendPosition(tree, point, frame.positions);
      }
    }
    else
    {
      // A phase without lines.
      lines.series.topologies.emplace_back();
      last = nullptr;
    }
    frame.topology = lines.series.topologies.size() - 1;
    lines.series.frames.push_back(std::move(frame));
  }
  lines.series.branches = branches.Names;
  const bool any = std::any_of(lines.series.topologies.begin(), lines.series.topologies.end(),
    [](const ReviewTopology& topology) { return topology.points > 0; });
  return any ? lines : Lines();
}

/// A surface over the phases, as it is reduced.
class SurfaceSeries
{
public:
  SurfaceSeries(const EvaluationScene::Source& source, std::map<std::int64_t, std::string> labels,
    vtkIdType wanted)
    : Source(source)
    , Labels(std::move(labels))
    , Wanted(wanted)
  {
  }

  /// @param distances  one a point of the surface; empty: there are none
  void Add(
    int index, vtkPolyData* surface, const SurfaceMesh& mesh, const std::vector<double>& distances)
  {
    if (!this->Last || !SameCells(this->Last, surface, this->Last->GetPolys(), surface->GetPolys()))
    {
      this->Reduced = ReduceSurface(surface, this->Wanted);
      this->AddTopology(index);
    }
    this->Last = surface;
    ReviewFrame frame;
    frame.topology = this->Series.topologies.size() - 1;
    SurfaceMesh left;
    for (const vtkIdType point : this->Reduced.points)
    {
      AppendPosition(surface, point, frame.positions);
      if (!distances.empty())
      {
        frame.distances.push_back(static_cast<float>(distances[static_cast<std::size_t>(point)]));
      }
      left.points.push_back(mesh.points[static_cast<std::size_t>(point)]);
    }
    this->Series.frames.push_back(std::move(frame));
    this->Series.originalCells =
      std::max<std::int64_t>(this->Series.originalCells, surface->GetNumberOfPolys());
    if (static_cast<vtkIdType>(this->Reduced.triangles.size()) < surface->GetNumberOfPolys())
    {
      left.triangles = this->Reduced.triangles;
      MeshDistanceSettings settings;
      settings.areaMeasures = false;
      settings.pointMeasures = false;
      settings.signedDistances = false;
      settings.errorBound = DeviationError;
      const MeshDistance distance = CompareSurfaces(left, mesh, settings);
      this->Series.deviation =
        std::max(this->Series.deviation, distance.hausdorff + distance.hausdorffError);
    }
  }

  ReviewSeries Take()
  {
    this->Series.branches = this->Branches.Names;
    return std::move(this->Series);
  }

private:
  void AddTopology(int index)
  {
    ReviewTopology topology;
    topology.points = static_cast<std::uint32_t>(this->Reduced.points.size());
    for (const Triangle& triangle : this->Reduced.triangles)
    {
      for (const std::int64_t corner : triangle)
      {
        topology.cells.push_back(static_cast<std::uint32_t>(corner));
      }
    }
    // The surfaces of the pictures have no arrays.
    const auto groups = GroupsOfPoints(vtkCoronary::SurfaceOf(
      vtkCoronary::TrianglesOf(this->Source(index)), vtkCoronaryArrayNames::GroupIds, ""));
    for (const vtkIdType point : this->Reduced.points)
    {
      const std::optional<std::int64_t>& group = groups[static_cast<std::size_t>(point)];
      topology.branches.push_back(
        group ? this->Branches.IndexOf(*group, this->Labels) : ReviewTopology::NoBranch);
    }
    this->Series.topologies.push_back(std::move(topology));
  }

  const EvaluationScene::Source& Source;
  const std::map<std::int64_t, std::string> Labels;
  const vtkIdType Wanted;
  BranchList Branches;
  ReducedSurface Reduced;
  vtkSmartPointer<vtkPolyData> Last;
  ReviewSeries Series;
};

void SetView(const PictureView& view, ReviewCase& review)
{
  review.leftAnterior = view.leftAnterior;
  review.cranial = view.cranial;
  review.height = view.height;
  review.centre = { view.centre[0], view.centre[1], view.centre[2] };
}
}

void AddGroupNames(vtkPolyData* tree, std::map<std::int64_t, std::string>& names)
{
  auto* texts = vtkStringArray::SafeDownCast(
    tree->GetCellData()->GetAbstractArray(vtkCoronaryArrayNames::SegmentLabel));
  vtkDataArray* groups = tree->GetCellData()->GetArray(vtkCoronaryArrayNames::GroupIds);
  for (vtkIdType n = 0; texts && groups && n < texts->GetNumberOfValues(); ++n)
  {
    names.emplace(static_cast<std::int64_t>(groups->GetTuple1(n)), texts->GetValue(n));
  }
}

ReviewCase MakeReviewCase(
  const EvaluationScene& scene, std::int64_t triangles, const ProgressCallback& progress)
{
  ReviewCase review;
  SetView(OverlayView(scene, review.aspect), review);

  const int count = static_cast<int>(scene.evaluation->phases.size());
  Lines modelLines = ReadLines(scene.centerline, count);
  Lines truthLines = ReadLines(scene.truthCenterline, count);
  review.modelLines = std::move(modelLines.series);
  review.truthLines = std::move(truthLines.series);
  SurfaceSeries models(scene.model, std::move(modelLines.labels), triangles);
  SurfaceSeries truths(scene.truth, std::move(truthLines.labels), triangles);

  MeshDistanceSettings settings;
  settings.hausdorff = false;
  settings.areaMeasures = false;
  const std::vector<int> ranged = DistancePhases(scene);
  std::vector<double> distances;
  for (int k = 0; k < count; ++k)
  {
    Report(progress, double(k) / count);
    vtkPolyData* model = ShownModel(scene, k);
    vtkPolyData* truth = ShownTruth(scene, k);
    const SurfaceMesh a = vtkCoronary::SurfaceOf(model, "", "");
    const SurfaceMesh b = vtkCoronary::SurfaceOf(truth, "", "");
    const MeshDistance distance = CompareSurfaces(a, b, settings);
    models.Add(k, model, a, distance.pointDistancesA);
    truths.Add(k, truth, b, distance.pointDistancesB);
    if (std::find(ranged.begin(), ranged.end(), k) != ranged.end())
    {
      distances.insert(
        distances.end(), distance.pointDistancesA.begin(), distance.pointDistancesA.end());
    }
  }
  review.range = DistanceRange(distances);
  review.model = models.Take();
  review.truth = truths.Take();
  return review;
}

ReviewCase MakeResultCase(
  const ResultScene& scene, std::int64_t triangles, const ProgressCallback& progress)
{
  ReviewCase review;
  Lines lines = ReadLines(scene.centerline, scene.count, scene.guessed);
  review.modelLines = std::move(lines.series);
  if (std::any_of(
        scene.guessed.begin(), scene.guessed.end(), [](double value) { return value > 0.5; }))
  {
    review.guessedLines =
      ReadLines(scene.centerline, scene.count, scene.guessed, Pieces::Dashes).series;
    for (ReviewTopology& topology : review.guessedLines.topologies)
    {
      topology.labels.clear(); // the other lines have them
    }
  }
  std::vector<Vector3> points;
  const auto append = [&](const std::vector<float>& positions, std::size_t wanted)
  {
    const std::size_t step = std::max<std::size_t>(1, positions.size() / 3 / wanted);
    for (std::size_t k = 0; 3 * k + 2 < positions.size(); k += step)
    {
      points.emplace_back(positions[3 * k], positions[3 * k + 1], positions[3 * k + 2]);
    }
  };
  for (const ReviewFrame& frame : review.modelLines.frames)
  {
    append(frame.positions, 4000);
  }
  if (scene.model)
  {
    SurfaceSeries models(scene.model, std::move(lines.labels), triangles);
    for (int k = 0; k < scene.count; ++k)
    {
      Report(progress, double(k) / scene.count);
      const vtkSmartPointer<vtkPolyData> surface = vtkCoronary::TrianglesOf(scene.model(k));
      models.Add(k, surface, vtkCoronary::SurfaceOf(surface, "", ""), {});
    }
    review.model = models.Take();
    for (const ReviewFrame& frame : review.model.frames)
    {
      append(frame.positions, 4000);
    }
  }
  if (points.empty())
  {
    throw std::invalid_argument("The result to review has no points.");
  }
  SetView(FindView(points, points, ResultAspect, ResultMargin), review);
  review.aspect = ResultAspect;
  return review;
}
}
