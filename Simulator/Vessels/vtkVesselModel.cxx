#include "VesselModel.h"

#include "BoundedJson.h"
#include "ContractionMotion.h"
#include "FileSeries.h"
#include "TextFile.h"
#include "WallMotions.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"
#include "vtkSkeletonForms.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkUnstructuredGrid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
namespace names = vtkCoronaryArrayNames;

constexpr int PhantomPhases = 40;
constexpr double Irregular = 0.1; // of the healthy radius: what is less narrow is no lesion
constexpr int SampledPhases = 40; // of a motion that hangs on a skeleton

[[noreturn]] void Fail(const std::string& path, const std::string& what)
{
  throw std::runtime_error("'" + path + "' " + what + ".");
}

bool IsFile(const std::string& path)
{
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

/// A file of a run, with the stage that makes it.
std::string FileOfRun(const std::string& folder, const char* name, const char* stage)
{
  const std::string path = (fs::path(folder) / name).string();
  if (!IsFile(path))
  {
    Fail(path,
      std::string("is missing: '") + folder +
        "' is no finished result of 'coronary-pipeline run' ("
        "stage " +
        stage + "; 'run --resume' finishes it)");
  }
  return path;
}

/// Triangles with points of their own, and where these were in the file.
struct Boundary
{
  std::vector<Triangle> triangles;
  std::vector<int> entity;
  std::vector<int> groupId; ///< per triangle; empty: not known
  std::vector<Vector3> points;
  std::vector<std::int64_t> origin; ///< per point: its number in the file
};

std::vector<int> NumbersOfCells(vtkPolyData* data, const char* name, const std::string& path)
{
  vtkDataArray* array = data->GetCellData()->GetArray(name);
  std::vector<int> numbers;
  if (!array)
  {
    return numbers;
  }
  if (array->GetNumberOfTuples() != data->GetNumberOfCells())
  {
    Fail(path, std::string("has an array '") + name + "' of the wrong length");
  }
  for (vtkIdType n = 0; n < array->GetNumberOfTuples(); ++n)
  {
    const double value = array->GetComponent(n, 0);
    if (!(std::abs(value) < 1e9))
    {
      Fail(
        path, std::string("has an array '") + name + "' with a value that is no number of a part");
    }
    numbers.push_back(static_cast<int>(value));
  }
  return numbers;
}

Boundary BoundaryOf(vtkPolyData* data, const std::string& path)
{
  Boundary boundary;
  if (data->GetNumberOfPolys() == 0 || data->GetNumberOfCells() != data->GetNumberOfPolys())
  {
    Fail(path, "is no surface: it has no polygons, or other cells beside them");
  }
  boundary.entity = NumbersOfCells(data, names::CellEntityIds, path);
  if (boundary.entity.empty())
  {
    boundary.entity.assign(static_cast<std::size_t>(data->GetNumberOfPolys()), 1);
  }
  boundary.groupId = NumbersOfCells(data, names::GroupIds, path);
  std::vector<std::int64_t> place(static_cast<std::size_t>(data->GetNumberOfPoints()), -1);
  for (vtkIdType cell = 0; cell < data->GetNumberOfPolys(); ++cell)
  {
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    data->GetPolys()->GetCellAtId(cell, count, ids);
    if (count != 3)
    {
      Fail(path, "has a polygon of " + std::to_string(count) + " corners; triangles are needed");
    }
    Triangle triangle{};
    for (std::size_t corner = 0; corner < 3; ++corner)
    {
      const vtkIdType id = ids[corner];
      if (id < 0 || id >= data->GetNumberOfPoints())
      {
        Fail(path, "has a triangle with a point that is not there");
      }
      std::int64_t& now = place[static_cast<std::size_t>(id)];
      if (now < 0)
      {
        now = static_cast<std::int64_t>(boundary.points.size());
        boundary.points.emplace_back(data->GetPoint(id));
        boundary.origin.push_back(id);
      }
      triangle[corner] = now;
    }
    boundary.triangles.push_back(triangle);
  }
  return boundary;
}

/// Axis, radii, names and parents, a branch a line; gives the branch of each GroupId.
std::map<int, int> TakeTree(vtkPolyData* tree, const std::string& path, WallTopology& topology)
{
  const vtkIdType lines = tree->GetNumberOfLines();
  if (lines == 0 || tree->GetNumberOfCells() != lines)
  {
    Fail(path, "is no tree of centerlines: it has no lines, or other cells beside them");
  }
  vtkDataArray* radius = tree->GetPointData()->GetArray(names::Radius);
  if (!radius || radius->GetNumberOfTuples() != tree->GetNumberOfPoints())
  {
    Fail(path, std::string("has no point array '") + names::Radius + "'");
  }
  if (NumbersOfCells(tree, names::GroupIds, path).empty() ||
    NumbersOfCells(tree, names::ParentGroupIds, path).empty())
  {
    Fail(path,
      std::string("has no cell arrays '") + names::GroupIds + "' and '" + names::ParentGroupIds +
        "'");
  }
  const VesselTree vessels = vtkCoronary::BranchesOf(tree, radius);
  // What the run found of lesions, where it did: the radius without them, and the number of the calcium beside.
  const auto pointValues = [&](const char* name)
  {
    vtkDataArray* array = tree->GetPointData()->GetArray(name);
    const bool fits = array && array->GetNumberOfTuples() == tree->GetNumberOfPoints();
    return fits ? vtkCoronary::BranchesOf(tree, array).radius : std::vector<double>();
  };
  const std::vector<double> healthy = pointValues(names::ReferenceRadius);
  const std::vector<double> calcium = pointValues(names::CalciumLabel);
  std::map<int, int> branchOf;
  for (const VesselTree::Branch& branch : vessels.branches)
  {
    if (!branchOf.emplace(branch.groupId, static_cast<int>(branchOf.size())).second)
    {
      Fail(path, "has two branches with the GroupId " + std::to_string(branch.groupId));
    }
    std::vector<Vector3> axis;
    std::vector<double> radii;
    std::vector<double> references;
    std::vector<double> labels;
    for (const std::int64_t p : branch.points)
    {
      // Where two points fall together there is no direction.
      const Vector3& point = vessels.points[static_cast<std::size_t>(p)];
      if (axis.empty() || (point - axis.back()).norm() > 1e-6)
      {
        axis.push_back(point);
        radii.push_back(vessels.radius[static_cast<std::size_t>(p)]);
        const double reference =
          healthy.size() == vessels.points.size() ? healthy[static_cast<std::size_t>(p)] : 0.0;
        references.push_back(
          radii.back() < (1.0 - Irregular) * reference ? reference : radii.back());
        labels.push_back(
          calcium.size() == vessels.points.size() ? calcium[static_cast<std::size_t>(p)] : 0.0);
      }
    }
    topology.axis.push_back(std::move(axis));
    topology.axisRadius.push_back(std::move(radii));
    if (!healthy.empty())
    {
      topology.axisReference.push_back(std::move(references));
      topology.axisCalcium.push_back(std::move(labels));
    }
    topology.groupName.push_back(branch.name);
  }
  for (const VesselTree::Branch& branch : vessels.branches)
  {
    const auto found = branchOf.find(branch.parentGroupId);
    topology.parent.push_back(found == branchOf.end() ? -1 : found->second);
  }
  return branchOf;
}

/// The branch whose axis is nearest, in its radii.
int NearestBranch(const WallTopology& topology, const Vector3& point)
{
  double minimum = std::numeric_limits<double>::max();
  int nearest = -1;
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    const std::vector<Vector3>& axis = topology.axis[b];
    for (std::size_t k = 1; k < axis.size(); ++k)
    {
      const SegmentPlace place = NearestOnSegment(point, axis[k - 1], axis[k]);
      const double radius = topology.axisRadius[b][k - 1] +
        place.fraction * (topology.axisRadius[b][k] - topology.axisRadius[b][k - 1]);
      const double away = place.squaredDistance / std::max(1e-6, radius * radius);
      if (away < minimum)
      {
        minimum = away;
        nearest = static_cast<int>(b);
      }
    }
  }
  return nearest;
}

WallTopology TopologyOf(const Boundary& boundary, vtkPolyData* tree, const std::string& treePath,
  const ProgressCallback& progress)
{
  WallTopology topology;
  topology.points = static_cast<std::int64_t>(boundary.points.size());
  topology.triangles = boundary.triangles;
  topology.entity = boundary.entity;
  const std::map<int, int> branchOf = TakeTree(tree, treePath, topology);
  topology.group.assign(boundary.points.size(), -1);
  for (std::size_t n = 0; n < boundary.groupId.size(); ++n)
  {
    const auto branch = branchOf.find(boundary.groupId[n]);
    for (const std::int64_t corner : boundary.triangles[n])
    {
      int& group = topology.group[static_cast<std::size_t>(corner)];
      group = group < 0 && branch != branchOf.end() ? branch->second : group;
    }
  }
  for (std::size_t n = 0; n < topology.group.size(); ++n)
  {
    if (n % 1024 == 0 && progress &&
      !progress(static_cast<double>(n) / static_cast<double>(topology.group.size())))
    {
      throw Cancelled();
    }
    if (topology.group[n] < 0)
    {
      topology.group[n] = NearestBranch(topology, boundary.points[n]);
    }
  }
  return topology;
}

CompactSkinWeights WeightsOf(vtkUnstructuredGrid* mesh, const std::string& path)
{
  vtkDataArray* bones = mesh->GetPointData()->GetArray(names::BoneIndices);
  vtkDataArray* weights = mesh->GetPointData()->GetArray(names::BoneWeightsCompact);
  if (!bones || !weights)
  {
    Fail(path,
      std::string("is a mesh without weights: it has no point array '") +
        (bones ? names::BoneWeightsCompact : names::BoneIndices) + "'");
  }
  const int influences = weights->GetNumberOfComponents();
  if (bones->GetNumberOfComponents() != influences ||
    bones->GetNumberOfTuples() != mesh->GetNumberOfPoints() ||
    weights->GetNumberOfTuples() != mesh->GetNumberOfPoints())
  {
    Fail(path, "has weights that do not fit its points");
  }
  CompactSkinWeights compact;
  compact.influences = influences;
  const auto size = static_cast<std::size_t>(mesh->GetNumberOfPoints()) * influences;
  compact.bone.reserve(size);
  compact.weight.reserve(size);
  for (vtkIdType n = 0; n < mesh->GetNumberOfPoints(); ++n)
  {
    for (int c = 0; c < influences; ++c)
    {
      const double bone = bones->GetComponent(n, c);
      compact.bone.push_back(
        std::abs(bone) < 1e9 ? static_cast<std::int32_t>(bone) : std::int32_t{ -1 });
      compact.weight.push_back(static_cast<float>(weights->GetComponent(n, c)));
    }
  }
  return compact;
}

PoseSequence PosesOf(const std::string& list, const Skeleton& skeleton, vtkMessageTrap& messages)
{
  const SkeletonRig rig(skeleton);
  PoseSequence poses;
  for (const TimedFile& file : ReadFileSeries(list))
  {
    const auto data = ReadPolyData(file.path, messages);
    const SkeletonPose pose = About(file.path, [&] { return vtkSkeletonForms::PoseOf(data, rig); });
    poses.times.push_back(file.time);
    poses.points.push_back(pose.joints);
    poses.calibre.push_back(pose.calibre);
    poses.rotation.push_back(pose.rotation);
  }
  // What not all have is not used.
  const auto none = [](const auto& one) { return one.empty(); };
  if (std::any_of(poses.calibre.begin(), poses.calibre.end(), none))
  {
    poses.calibre.clear();
  }
  if (std::any_of(poses.rotation.begin(), poses.rotation.end(), none))
  {
    poses.rotation.clear();
  }
  return poses;
}

/// The patient's heart by its named vessels; null where their names do not tell it.
std::shared_ptr<const PatientHeart> HeartOf(vtkPolyData* lines)
{
  vtkDataArray* frame = lines->GetFieldData()->GetArray(names::HeartFrame);
  if (!frame || frame->GetNumberOfValues() != 16)
  {
    return nullptr;
  }
  std::array<double, 16> matrix{};
  for (vtkIdType n = 0; n < 16; ++n)
  {
    matrix[static_cast<std::size_t>(n)] = frame->GetVariantValue(n).ToDouble();
  }
  try
  {
    VesselTree tree = vtkCoronary::TreeOf(lines);
    vtkCoronary::AddPointValues(lines, tree);
    return std::make_shared<PatientHeart>(EstimateHeart(tree, HeartPoseOf(matrix)));
  }
  catch (const std::invalid_argument&)
  {
    return nullptr;
  }
}

/// The wall at rest, its topology and where it is from.
struct RestingWall
{
  std::string path;
  Boundary boundary;
  WallTopology topology;
  std::shared_ptr<const PatientHeart> heart;
};

RestingWall ReadWall(const std::string& surface, const std::string& centerline,
  vtkMessageTrap& messages, const ProgressCallback& progress)
{
  RestingWall wall;
  wall.path = surface;
  wall.boundary = BoundaryOf(ReadPolyData(surface, messages), surface);
  const auto tree = ReadPolyData(centerline, messages);
  wall.topology = TopologyOf(wall.boundary, tree, centerline, progress);
  wall.heart = HeartOf(tree);
  return wall;
}

std::shared_ptr<WallMotion> StillWall(const RestingWall& wall)
{
  return About(wall.path,
    [&]() -> std::shared_ptr<WallMotion>
    { return std::make_shared<StillWallMotion>(wall.topology, wall.boundary.points); });
}

std::shared_ptr<WallMotion> TrackedWall(
  const std::string& folder, const RestingWall& wall, VesselModel& model, vtkMessageTrap& messages)
{
  const std::string list = FileOfRun(folder, "motion/skeleton.vtp.series", "motion");
  const std::string weightsPath = FileOfRun(folder, "weights.vtu", "weights");
  const std::string skeletonPath = FileOfRun(folder, "skeleton.vtp", "volume");
  const auto mesh = ReadUnstructuredGrid(weightsPath, messages);
  const CompactSkinWeights weights = WeightsOf(mesh, weightsPath);
  // The boundary is on the points of the tetrahedra.
  for (std::size_t n = 0; n < wall.boundary.origin.size(); ++n)
  {
    const std::int64_t id = wall.boundary.origin[n];
    if (id >= mesh->GetNumberOfPoints() ||
      (Vector3(mesh->GetPoint(id)) - wall.boundary.points[n]).norm() > 1e-3)
    {
      Fail(wall.path,
        "does not belong to '" + weightsPath + "': point " + std::to_string(id) +
          " is another one there");
    }
  }
  const auto bones = ReadPolyData(skeletonPath, messages);
  const Skeleton skeleton =
    About(skeletonPath, [&] { return vtkSkeletonForms::SkeletonOf(bones, "the rest skeleton"); });
  const PoseSequence poses = PosesOf(list, skeleton, messages);
  model.motion = "tracked at " + std::to_string(poses.times.size()) + " moments";
  const auto posed = ReadPolyData(ReadFileSeries(list).front().path, messages);
  vtkDataArray* cycle = posed->GetFieldData()->GetArray(names::CycleLength);
  if (cycle && cycle->GetNumberOfValues() > 0 && cycle->GetTuple1(0) > 0.0)
  {
    model.heartRate = 60.0 / cycle->GetTuple1(0);
  }
  auto* source =
    vtkStringArray::SafeDownCast(posed->GetFieldData()->GetAbstractArray(names::MotionSource));
  if (source && source->GetNumberOfValues() > 0)
  {
    model.foreignMotion = source->GetValue(0);
    model.motion = model.foreignMotion;
    model.notes.push_back("'" + folder + "': " + model.foreignMotion + ".");
  }
  return About(folder,
    [&]() -> std::shared_ptr<WallMotion>
    {
      SkinnedWallMotion skinned(
        wall.topology, wall.boundary.points, weights, wall.boundary.origin, skeleton, poses);
      return SampleWallMotion(skinned, SampledPhases);
    });
}

void MakeStillOrContracting(
  const VesselSource& source, std::shared_ptr<WallMotion> still, VesselModel& model)
{
  if (source.motion != VesselMotion::Contraction)
  {
    model.wall = std::move(still);
    model.motion = "still";
    return;
  }
  const auto moving = std::make_shared<ContractionMotion>(std::move(still), source.contraction);
  const ContractionSettings& used = moving->Settings();
  if (used.axial != source.contraction.axial || used.radial != source.contraction.radial)
  {
    char text[160];
    std::snprintf(text, sizeof(text),
      "The contraction was scaled down to %.3g mm, %.3g and %.3g rad, so that no point is faster "
      "than %g mm/s.",
      used.axial, used.radial, used.twist, used.peakSpeed);
    model.notes.emplace_back(text);
  }
  model.wall = moving;
  model.motion = "contraction by formula";
}

/// Whether a list of poses has different ones: that of a run of one phase has the pose at rest, several times.
bool Moves(const std::string& list, vtkMessageTrap& messages)
{
  vtkSmartPointer<vtkPolyData> first;
  for (const TimedFile& file : ReadFileSeries(list))
  {
    const auto data = ReadPolyData(file.path, messages);
    first = first ? first : data;
    if (data->GetNumberOfPoints() != first->GetNumberOfPoints())
    {
      return true; // told when the poses are read
    }
    for (vtkIdType n = 0; n < data->GetNumberOfPoints(); ++n)
    {
      if ((Vector3(data->GetPoint(n)) - Vector3(first->GetPoint(n))).norm() > 1e-6)
      {
        return true;
      }
    }
  }
  return false;
}

/// Degrees of the section that calcium takes, in place of its number.
void TakeCalcium(const std::string& folder, WallTopology& topology)
{
  std::map<int, double> arcs;
  const std::string report = (fs::path(folder) / "report.json").string();
  if (IsFile(report))
  {
    const nlohmann::json json =
      ParseBoundedJson(ReadTextFile(report, "a report"), "'" + report + "'");
    const nlohmann::json objects = json.value(
      nlohmann::json::json_pointer("/centerline/calcium/objects"), nlohmann::json::array());
    for (const nlohmann::json& object : objects)
    {
      if (object.is_object())
      {
        arcs[object.value("label", 0)] = std::clamp(object.value("arc_deg", 0.0), 0.0, 360.0);
      }
    }
  }
  for (std::vector<double>& branch : topology.axisCalcium)
  {
    for (double& calcium : branch)
    {
      const auto arc = arcs.find(static_cast<int>(calcium));
      calcium = arc == arcs.end() ? 0.0 : arc->second;
    }
  }
}

/// The run's aorta; null: it found none.
std::shared_ptr<const AortaAtRest> AortaOfRun(const std::string& folder, vtkMessageTrap& messages)
{
  const std::string wallPath = (fs::path(folder) / "aorta_wall.vtp").string();
  const std::string linePath = (fs::path(folder) / "aorta_centerline.vtp").string();
  if (!IsFile(wallPath) || !IsFile(linePath))
  {
    return nullptr;
  }
  auto aorta = std::make_shared<AortaAtRest>();
  Boundary wall = BoundaryOf(ReadPolyData(wallPath, messages), wallPath);
  aorta->points = std::move(wall.points);
  aorta->triangles = std::move(wall.triangles);
  const auto line = ReadPolyData(linePath, messages);
  for (vtkIdType n = 0; n < line->GetNumberOfPoints(); ++n)
  {
    aorta->axis.emplace_back(line->GetPoint(n));
  }
  if (aorta->axis.size() < 2)
  {
    Fail(linePath, "is no line from the valve to the diaphragm: it has less than two points");
  }
  return aorta;
}

VesselModel LoadRun(
  const VesselSource& source, vtkMessageTrap& messages, const ProgressCallback& progress)
{
  std::error_code ignored;
  if (!fs::is_directory(source.path, ignored))
  {
    Fail(source.path, "is no folder: the vessels of a run were expected there");
  }
  VesselModel model;
  const std::string list = (fs::path(source.path) / "motion/skeleton.vtp.series").string();
  const bool tracked = source.motion == VesselMotion::Tracked ||
    (source.motion == VesselMotion::Automatic && IsFile(list) && Moves(list, messages));
  const std::string boundary = (fs::path(source.path) / "volume_boundary.vtp").string();
  const std::string surface = tracked ? FileOfRun(source.path, "volume_boundary.vtp", "volume")
    : IsFile(boundary)                ? boundary
                                      : FileOfRun(source.path, "surface.vtp", "surface");
  RestingWall wall =
    ReadWall(surface, FileOfRun(source.path, "centerline.vtp", "centerline"), messages, progress);
  TakeCalcium(source.path, wall.topology);
  wall.topology.aorta = AortaOfRun(source.path, messages);
  model.heart = wall.heart;
  if (tracked)
  {
    model.wall = TrackedWall(source.path, wall, model, messages);
    return model;
  }
  if (source.motion == VesselMotion::Automatic)
  {
    model.notes.push_back("'" + source.path + "' has no motion: the vessels stand still.");
  }
  MakeStillOrContracting(source, StillWall(wall), model);
  return model;
}
}

VesselModel LoadVessels(const VesselSource& source, const ProgressCallback& progress)
{
  vtkMessageTrap messages;
  VesselModel model;
  switch (source.kind)
  {
    case VesselSource::Kind::Run:
      return LoadRun(source, messages, progress);
    case VesselSource::Kind::Surface:
    {
      RestingWall wall = ReadWall(source.path, source.centerline, messages, progress);
      TakeCalcium("", wall.topology);
      MakeStillOrContracting(source, StillWall(wall), model);
      return model;
    }
    default:
      break;
  }
  model.wall =
    MakePhantomWallMotion(source.phantom, source.phantom.surfaceSpacing, PhantomPhases, progress);
  model.motion = "that of the phantom";
  if (source.motion == VesselMotion::Still || source.motion == VesselMotion::Contraction)
  {
    std::vector<Vector3> rest;
    model.wall->Positions(0.75, rest);
    WallTopology topology = model.wall->Topology();
    std::vector<Vector3> axis;
    model.wall->AxisPositions(0.75, axis);
    std::size_t next = 0;
    for (std::vector<Vector3>& branch : topology.axis)
    {
      for (Vector3& point : branch)
      {
        point = axis.at(next++);
      }
    }
    MakeStillOrContracting(
      source, std::make_shared<StillWallMotion>(std::move(topology), std::move(rest)), model);
  }
  return model;
}
}
