#include "vtkSimVascularForms.h"

#include "Numbers.h"
#include "TgfSkeleton.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>

namespace names = vtkCoronaryArrayNames;

namespace coronary
{
namespace
{
constexpr const char* BranchId = "BranchId";
constexpr const char* BifurcationId = "BifurcationId";
constexpr const char* CenterlineId = "CenterlineId";
constexpr const char* GlobalNodeId = "GlobalNodeId";
constexpr const char* Path = "Path";
constexpr const char* SectionArea = "CenterlineSectionArea";

/// A branch between forks, with its own points: the first one is that of the fork.
struct BranchPath
{
  std::vector<Vector3> points;
  std::vector<double> radius;
  std::size_t parent = 0; ///< not of the root
  std::vector<std::size_t> daughters;
  std::string label;
};

/// Branches with one daughter joined to it; the root comes first, parents before daughters.
std::vector<BranchPath> BranchPathsOf(vtkPolyData* data)
{
  const VesselTree whole = vtkCoronary::TreeOf(data);
  const VesselTree tree = SplitAtBifurcations(whole);
  const auto roots = std::count_if(tree.branches.begin(), tree.branches.end(),
    [](const VesselTree::Branch& branch) { return branch.parentGroupId == -1; });
  if (roots != 1)
  {
    throw std::runtime_error("The centerlines are " + std::to_string(roots) +
      " trees or branches at the root, SimVascular's are one: choose one with --tree.");
  }
  std::map<int, int> daughters;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    ++daughters[branch.parentGroupId];
  }
  // The name of a segment is found by the point before a branch's end: it is its own.
  std::map<std::int64_t, std::string> labelOf;
  for (const VesselTree::Branch& branch : vtkCoronary::BranchesOf(data, nullptr).branches)
  {
    for (std::size_t n = 1; n < branch.points.size(); ++n)
    {
      labelOf[branch.points[n]] = branch.name;
    }
  }
  std::vector<BranchPath> branchPaths;
  std::map<int, std::size_t> stretchOf;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    const bool root = branch.parentGroupId == -1;
    const bool goesOn = !root && daughters[branch.parentGroupId] == 1;
    if (!goesOn)
    {
      BranchPath branchPath;
      branchPath.label = labelOf[branch.points[1]];
      if (!root)
      {
        branchPath.parent = stretchOf.at(branch.parentGroupId);
        branchPaths[branchPath.parent].daughters.push_back(branchPaths.size());
      }
      branchPaths.push_back(branchPath);
    }
    const std::size_t number = goesOn ? stretchOf.at(branch.parentGroupId) : branchPaths.size() - 1;
    stretchOf[branch.groupId] = number;
    for (std::size_t n = goesOn ? 1 : 0; n < branch.points.size(); ++n)
    {
      const auto point = static_cast<std::size_t>(branch.points[n]);
      branchPaths[number].points.push_back(tree.points[point]);
      branchPaths[number].radius.push_back(tree.radius[point]);
    }
  }
  return branchPaths;
}

/// The longest step is halved until there are enough of them.
void Refine(BranchPath& branchPath, std::size_t steps)
{
  while (branchPath.points.size() < steps + 1)
  {
    std::size_t longest = 1;
    for (std::size_t n = 1; n < branchPath.points.size(); ++n)
    {
      const auto length = [&](std::size_t k)
      { return (branchPath.points[k] - branchPath.points[k - 1]).norm(); };
      longest = length(n) > length(longest) ? n : longest;
    }
    const auto at = static_cast<std::ptrdiff_t>(longest);
    const Vector3 point = 0.5 * (branchPath.points[longest] + branchPath.points[longest - 1]);
    const double radius = 0.5 * (branchPath.radius[longest] + branchPath.radius[longest - 1]);
    branchPath.points.insert(branchPath.points.begin() + at, point);
    branchPath.radius.insert(branchPath.radius.begin() + at, radius);
  }
}

Vector3 Tangent(const std::vector<Vector3>& points, std::size_t n)
{
  const std::size_t before = n > 0 ? n - 1 : 0;
  const std::size_t after = std::min(n + 1, points.size() - 1);
  const Vector3 way = points[after] - points[before];
  return way.norm() > 0.0 ? Vector3(way.normalized()) : Vector3(Vector3::UnitZ());
}

/// Fills the poly data point by point.
struct Output
{
  Output() { this->points->SetDataTypeToDouble(); }

  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> lines;
  std::vector<int> branch;
  std::vector<int> bifurcation;
  std::vector<double> path;
  std::vector<double> radius;
  std::vector<Vector3> normal;
  std::vector<std::size_t> branchPath; ///< that the point belongs to

  vtkIdType Add(const BranchPath& from, std::size_t number, std::size_t n, int branchId, int fork,
    double along, double unit)
  {
    this->branch.push_back(branchId);
    this->bifurcation.push_back(fork);
    this->path.push_back(along / unit);
    this->radius.push_back(from.radius[n] / unit);
    this->normal.push_back(Tangent(from.points, n));
    this->branchPath.push_back(number);
    const Vector3 place = from.points[n] / unit;
    return this->points->InsertNextPoint(place.data());
  }
};

/// Which ways to the outlets go through each stretch, by number.
std::vector<std::vector<int>> PathsThrough(const std::vector<BranchPath>& branchPaths)
{
  std::vector<std::vector<int>> ways(branchPaths.size());
  int outlets = 0;
  for (std::size_t n = 0; n < branchPaths.size(); ++n)
  {
    if (!branchPaths[n].daughters.empty())
    {
      continue;
    }
    for (std::size_t at = n;; at = branchPaths[at].parent)
    {
      ways[at].push_back(outlets);
      if (at == 0)
      {
        break;
      }
    }
    ++outlets;
  }
  return ways;
}

void AddArrays(vtkPolyData* data, const Output& output, const std::vector<BranchPath>& branchPaths)
{
  vtkPointData* arrays = data->GetPointData();
  std::vector<int> ids(output.branch.size());
  std::vector<int> closed(output.branch.size(), 1);
  std::vector<double> area;
  std::vector<double> size;
  const std::vector<double> shape(output.branch.size(), 1.0);
  for (std::size_t n = 0; n < ids.size(); ++n)
  {
    ids[n] = static_cast<int>(n);
    area.push_back(Pi * output.radius[n] * output.radius[n]);
    size.push_back(2.0 * output.radius[n]);
  }
  vtkCoronary::AddArray<vtkIntArray>(arrays, BranchId, output.branch);
  vtkCoronary::AddArray<vtkIntArray>(arrays, BifurcationId, output.bifurcation);
  vtkCoronary::AddArray<vtkIntArray>(arrays, GlobalNodeId, ids);
  vtkCoronary::AddArray<vtkDoubleArray>(arrays, Path, output.path);
  vtkCoronary::AddArray<vtkDoubleArray>(arrays, names::Radius, output.radius);
  vtkCoronary::AddArray<vtkDoubleArray>(arrays, SectionArea, area);
  vtkCoronary::AddArray<vtkDoubleArray>(arrays, "CenterlineSectionMinSize", size);
  vtkCoronary::AddArray<vtkDoubleArray>(arrays, "CenterlineSectionMaxSize", size);
  vtkCoronary::AddArray<vtkDoubleArray>(arrays, "CenterlineSectionShape", shape);
  vtkCoronary::AddArray<vtkIntArray>(arrays, "CenterlineSectionClosed", closed);
  vtkNew<vtkDoubleArray> normals;
  normals->SetName("CenterlineSectionNormal");
  normals->SetNumberOfComponents(3);
  for (const Vector3& normal : output.normal)
  {
    normals->InsertNextTuple(normal.data());
  }
  arrays->AddArray(normals);
  const std::vector<std::vector<int>> ways = PathsThrough(branchPaths);
  vtkNew<vtkIntArray> centerlines;
  centerlines->SetName(CenterlineId);
  centerlines->SetNumberOfComponents(static_cast<int>(ways.front().size()));
  centerlines->SetNumberOfTuples(static_cast<vtkIdType>(output.branchPath.size()));
  centerlines->Fill(0.0);
  for (std::size_t n = 0; n < output.branchPath.size(); ++n)
  {
    for (const int way : ways[output.branchPath[n]])
    {
      centerlines->SetComponent(static_cast<vtkIdType>(n), way, 1.0);
    }
  }
  arrays->AddArray(centerlines);
}

vtkDataArray* PointArray(vtkPolyData* data, const char* name)
{
  vtkDataArray* array = data->GetPointData()->GetArray(name);
  return array != nullptr && array->GetNumberOfComponents() == 1 ? array : nullptr;
}

std::vector<double> RadiiOf(vtkPolyData* lines, double unit)
{
  vtkDataArray* radius = PointArray(lines, names::Radius);
  vtkDataArray* area = PointArray(lines, SectionArea);
  if (radius == nullptr && area == nullptr)
  {
    throw std::invalid_argument("The centerlines of SimVascular have neither a point array '" +
      std::string(names::Radius) + "' nor '" + SectionArea + "'");
  }
  std::vector<double> radii;
  for (vtkIdType n = 0; n < lines->GetNumberOfPoints(); ++n)
  {
    const double value = radius != nullptr
      ? radius->GetComponent(n, 0)
      : std::sqrt(std::max(0.0, area->GetComponent(n, 0)) / Pi);
    radii.push_back(unit * value);
  }
  return radii;
}

/// Of the ends of a piece the one of the least node number.
vtkIdType RootOf(const std::vector<vtkIdType>& piece,
  const std::vector<std::vector<vtkIdType>>& neighbours, vtkDataArray* nodes)
{
  vtkIdType best = -1;
  for (const vtkIdType point : piece)
  {
    const bool end = neighbours[static_cast<std::size_t>(point)].size() == 1;
    if (end && (best < 0 || nodes->GetComponent(point, 0) < nodes->GetComponent(best, 0)))
    {
      best = point;
    }
  }
  return best >= 0 ? best : piece.front();
}

std::string FileName(std::string name)
{
  std::replace_if(
    name.begin(), name.end(),
    [](char c)
    {
      const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
      return !letter && !(c >= '0' && c <= '9') && c != '-' && c != '_';
    },
    '_');
  return name;
}

constexpr int CirclePoints = 36;

/// Frames that turn about the path as little as they can.
std::vector<PathFrame> FramesOf(const std::vector<Vector3>& points)
{
  std::vector<PathFrame> frames;
  Vector3 rotation = Vector3::Zero();
  for (std::size_t n = 0; n < points.size(); ++n)
  {
    const Vector3 tangent = Tangent(points, n);
    rotation -= rotation.dot(tangent) * tangent;
    if (!(rotation.norm() > 1e-6))
    {
      rotation = tangent.unitOrthogonal();
    }
    rotation.normalize();
    frames.push_back({ static_cast<int>(n), points[n], tangent, rotation });
  }
  return frames;
}

SimVascularContour Circle(const PathFrame& frame, double radius, int id)
{
  SimVascularContour contour;
  contour.id = id;
  contour.type = "Circle";
  contour.frame = frame;
  const Vector3 side = frame.tangent.cross(frame.rotation);
  for (int n = 0; n < CirclePoints; ++n)
  {
    const double angle = 2.0 * Pi * n / CirclePoints;
    contour.contourPoints.emplace_back(
      frame.position + radius * (std::cos(angle) * frame.rotation + std::sin(angle) * side));
  }
  contour.controlPoints = { frame.position, contour.contourPoints.front() };
  return contour;
}

SimVascularVessel VesselAlong(
  const std::vector<Vector3>& points, const std::vector<double>& radii, double unit)
{
  constexpr double controlSpacing = 5.0;
  SimVascularVessel vessel;
  std::vector<Vector3> scaled;
  scaled.reserve(points.size());
  for (const Vector3& point : points)
  {
    scaled.emplace_back(point / unit);
  }
  vessel.path.points = FramesOf(scaled);
  double sinceControl = controlSpacing;
  double sinceCircle = 2.0 * radii.front();
  for (std::size_t n = 0; n < points.size(); ++n)
  {
    const double step = n > 0 ? (points[n] - points[n - 1]).norm() : 0.0;
    sinceControl += step;
    sinceCircle += step;
    const bool last = n + 1 == points.size();
    if (sinceControl >= controlSpacing || last)
    {
      vessel.path.controlPoints.push_back(scaled[n]);
      sinceControl = 0.0;
    }
    if (sinceCircle >= 2.0 * radii[n] || last)
    {
      vessel.contours.contours.push_back(Circle(
        vessel.path.points[n], radii[n] / unit, static_cast<int>(vessel.contours.contours.size())));
      sinceCircle = 0.0;
    }
  }
  return vessel;
}

vtkSmartPointer<vtkPolyData> Polyline(
  const std::vector<Vector3>& points, const std::vector<double>& radii, const std::string& name)
{
  Polylines line{ points, radii, { std::vector<std::int64_t>(points.size()) }, {} };
  std::iota(line.lines[0].begin(), line.lines[0].end(), 0);
  auto data = vtkSmartPointer<vtkPolyData>::New();
  vtkCoronary::SetLines(data, line);
  vtkCoronary::AddArray<vtkDoubleArray>(data->GetPointData(), names::Radius, radii);
  vtkNew<vtkStringArray> label;
  label->SetName(names::SegmentLabel);
  label->InsertNextValue(name);
  data->GetCellData()->AddArray(label);
  return data;
}
}

bool IsSimVascularCenterline(vtkPolyData* lines)
{
  return PointArray(lines, BranchId) != nullptr && PointArray(lines, BifurcationId) != nullptr;
}

vtkSmartPointer<vtkPolyData> ToSimVascular(vtkPolyData* tree, double unit)
{
  std::vector<BranchPath> branchPaths = BranchPathsOf(tree);
  // The fork, one point of the bifurcation, two of the branch, the next fork.
  for (BranchPath& branchPath : branchPaths)
  {
    Refine(branchPath, 4);
  }
  Output output;
  std::vector<vtkIdType> forkPoint(branchPaths.size(), -1);
  std::vector<int> forkId(branchPaths.size(), -1);
  int forks = 0;
  for (std::size_t number = 0; number < branchPaths.size(); ++number)
  {
    const BranchPath& branchPath = branchPaths[number];
    const bool root = number == 0;
    const bool ends = branchPath.daughters.empty();
    const std::size_t last = branchPath.points.size() - 1;
    const std::size_t lastOfBranch = ends ? last : last - 1;
    vtkIdType before = root ? -1 : forkPoint[branchPath.parent];
    const double reach = root ? 0.0 : branchPaths[branchPath.parent].radius.back();
    double along = 0.0;
    double fromFork = 0.0;
    bool inFork = !root;
    for (std::size_t n = root ? 0 : 1; n <= last; ++n)
    {
      const double step = n > 0 ? (branchPath.points[n] - branchPath.points[n - 1]).norm() : 0.0;
      fromFork += step;
      // The first point is in the bifurcation, the last two of the branch are not.
      const bool fork = inFork && (n == 1 || (fromFork < reach && n + 1 < lastOfBranch));
      vtkIdType id = -1;
      if (fork)
      {
        id = output.Add(branchPath, number, n, -1, forkId[branchPath.parent], fromFork, unit);
      }
      else if (n <= lastOfBranch)
      {
        along += inFork || n == 0 ? 0.0 : step;
        inFork = false;
        id = output.Add(branchPath, number, n, static_cast<int>(number), -1, along, unit);
      }
      else
      {
        forkId[number] = forks++;
        id = output.Add(branchPath, number, n, -1, forkId[number], 0.0, unit);
        forkPoint[number] = id;
      }
      if (before >= 0)
      {
        const vtkIdType ids[2] = { before, id };
        output.lines->InsertNextCell(2, ids);
      }
      before = id;
    }
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(output.points);
  data->SetLines(output.lines);
  AddArrays(data, output, branchPaths);
  return data;
}

vtkSmartPointer<vtkPolyData> FromSimVascular(vtkPolyData* lines, double unit)
{
  vtkDataArray* nodes = PointArray(lines, GlobalNodeId);
  if (nodes == nullptr)
  {
    throw std::invalid_argument("The centerlines of SimVascular have no point array '" +
      std::string(GlobalNodeId) + "': which end is the inlet is not known");
  }
  const std::vector<double> radii = RadiiOf(lines, unit);
  const auto count = static_cast<std::size_t>(lines->GetNumberOfPoints());
  std::vector<std::vector<vtkIdType>> neighbours(count);
  for (const std::vector<std::int64_t>& line : vtkCoronary::LinesOf(lines).lines)
  {
    for (const std::int64_t id : line)
    {
      if (id < 0 || static_cast<std::size_t>(id) >= count)
      {
        throw std::invalid_argument("A line of the centerlines has the point " +
          std::to_string(id) + ", of " + std::to_string(count));
      }
    }
    for (std::size_t n = 1; n < line.size(); ++n)
    {
      neighbours[static_cast<std::size_t>(line[n - 1])].push_back(line[n]);
      neighbours[static_cast<std::size_t>(line[n])].push_back(line[n - 1]);
    }
  }
  TgfSkeleton skeleton;
  std::vector<double> used;
  std::vector<std::int64_t> joint(count, -1);
  std::vector<bool> seen(count, false);
  const auto jointOf = [&](vtkIdType point)
  {
    std::int64_t& number = joint[static_cast<std::size_t>(point)];
    if (number < 0)
    {
      number = static_cast<std::int64_t>(skeleton.joints.size());
      Vector3 place;
      lines->GetPoint(point, place.data());
      skeleton.joints.push_back(unit * place);
      used.push_back(radii[static_cast<std::size_t>(point)]);
    }
    return number;
  };
  for (std::size_t start = 0; start < count; ++start)
  {
    if (seen[start] || neighbours[start].empty())
    {
      continue;
    }
    std::vector<vtkIdType> piece{ static_cast<vtkIdType>(start) };
    seen[start] = true;
    for (std::size_t n = 0; n < piece.size(); ++n)
    {
      for (const vtkIdType next : neighbours[static_cast<std::size_t>(piece[n])])
      {
        if (!seen[static_cast<std::size_t>(next)])
        {
          seen[static_cast<std::size_t>(next)] = true;
          piece.push_back(next);
        }
      }
    }
    // From the root outwards, each bone once; what closes a loop is told by FromSkeleton.
    std::set<std::pair<vtkIdType, vtkIdType>> bones;
    std::vector<vtkIdType> stack{ RootOf(piece, neighbours, nodes) };
    std::set<vtkIdType> reached(stack.begin(), stack.end());
    while (!stack.empty())
    {
      const vtkIdType here = stack.back();
      stack.pop_back();
      for (const vtkIdType next : neighbours[static_cast<std::size_t>(here)])
      {
        if (bones.insert(std::minmax(here, next)).second)
        {
          const std::int64_t from = jointOf(here);
          skeleton.bones.push_back({ from, jointOf(next) });
          if (reached.insert(next).second)
          {
            stack.push_back(next);
          }
        }
      }
    }
  }
  VesselTree tree = FromSkeleton(skeleton);
  tree.radius = used;
  auto data = vtkSmartPointer<vtkPolyData>::New();
  vtkCoronary::SetTree(data, tree);
  return data;
}

std::vector<SimVascularVessel> VesselsOf(vtkPolyData* tree, double unit)
{
  const std::vector<BranchPath> branchPaths = BranchPathsOf(tree);
  const auto width = [&](std::size_t number)
  {
    const std::vector<double>& radius = branchPaths[number].radius;
    const std::size_t some = std::min<std::size_t>(radius.size(), 11);
    double sum = 0.0;
    for (std::size_t n = 1; n < some; ++n)
    {
      sum += radius[n];
    }
    return sum / static_cast<double>(some - 1);
  };
  std::vector<SimVascularVessel> vessels;
  std::set<std::string> used;
  std::vector<std::size_t> starts{ 0 };
  for (std::size_t n = 0; n < starts.size(); ++n)
  {
    std::vector<Vector3> points;
    std::vector<double> radii;
    for (std::size_t at = starts[n];;)
    {
      const BranchPath& branchPath = branchPaths[at];
      const std::ptrdiff_t skip = points.empty() ? 0 : 1;
      points.insert(points.end(), branchPath.points.begin() + skip, branchPath.points.end());
      radii.insert(radii.end(), branchPath.radius.begin() + skip, branchPath.radius.end());
      if (branchPath.daughters.empty())
      {
        break;
      }
      const std::size_t next =
        *std::max_element(branchPath.daughters.begin(), branchPath.daughters.end(),
          [&](std::size_t a, std::size_t b) { return width(a) < width(b); });
      for (const std::size_t daughter : branchPath.daughters)
      {
        if (daughter != next)
        {
          starts.push_back(daughter);
        }
      }
      at = next;
    }
    SimVascularVessel vessel = VesselAlong(points, radii, unit);
    const std::string& label = branchPaths[starts[n]].label;
    const std::string stem = FileName(label.empty() ? "vessel_" + std::to_string(n) : label);
    vessel.name = stem;
    for (int again = 2; !used.insert(vessel.name).second; ++again)
    {
      vessel.name = stem + "_" + std::to_string(again);
    }
    vessel.path.id = static_cast<int>(n) + 1;
    vessel.contours.pathId = vessel.path.id;
    vessel.contours.pathName = vessel.name;
    vessels.push_back(std::move(vessel));
  }
  return vessels;
}

vtkSmartPointer<vtkPolyData> LineOf(
  const SimVascularPath& path, const std::string& name, double radius, double unit)
{
  std::vector<Vector3> points;
  for (const PathFrame& frame : path.points)
  {
    points.emplace_back(unit * frame.position);
  }
  if (points.size() < 2)
  {
    throw std::runtime_error("The path '" + name + "' has one point only.");
  }
  return Polyline(points, std::vector<double>(points.size(), radius), name);
}

vtkSmartPointer<vtkPolyData> LineOf(const SimVascularContourGroup& contours, double unit)
{
  std::vector<Vector3> points;
  std::vector<double> radii;
  for (const SimVascularContour& contour : contours.contours)
  {
    points.emplace_back(unit * contour.Center());
    radii.push_back(unit * contour.Radius());
  }
  if (points.size() < 2)
  {
    throw std::runtime_error("The contours of '" + contours.pathName + "' are less than two.");
  }
  return Polyline(points, radii, contours.pathName);
}
}
