#include "vtkRunLimits.h"

#include "Geometry.h"
#include "PoseSequence.h"
#include "ReportJson.h"
#include "vtkMessageTrap.h"
#include "vtkRunTrees.h"
#include "vtkVesselTree.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkDataArray.h"
#include "vtkMotionRegularizer.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;
namespace names = vtkCoronaryArrayNames;

/// By the bits of coronary::MotionClamp.
constexpr std::array<const char*, 5> LimitNames = { "bending", "curvature", "strain", "step",
  "tolerance" };

std::string NameOf(const VesselTree::Branch& branch)
{
  return branch.name.empty() ? "branch " + std::to_string(branch.groupId) : branch.name;
}

double LengthOf(const std::vector<std::int64_t>& line, const std::vector<Vector3>& points)
{
  double length = 0.0;
  for (std::size_t n = 1; n < line.size(); ++n)
  {
    length += (points[line[n]] - points[line[n - 1]]).norm();
  }
  return length;
}

double Component(vtkDataArray* array, std::int64_t point)
{
  return array ? array->GetComponent(point, 0) : 0.0;
}

/// Calls at(time, lines) for every time step.
template <typename Function>
void AtEachStep(vtkAlgorithm* moving, vtkMessageTrap& messages, const Function& at)
{
  for (const double time : TimeSteps(moving))
  {
    UpdateAtTime(moving, 0, time, messages, [](double) {});
    at(time, vtkPolyData::SafeDownCast(moving->GetOutputDataObject(0)));
  }
}

/// A stretch of a branch without a gap.
struct Piece
{
  std::vector<std::int64_t> points;
  TrackingStatus status = TrackingStatus::Filled;
};

/// The stretches of a branch that were not seen.
std::vector<Piece> UnseenPieces(const VesselTree::Branch& branch, vtkDataArray* status)
{
  std::vector<Piece> pieces;
  bool open = false;
  for (const std::int64_t point : branch.points)
  {
    const auto own = static_cast<TrackingStatus>(static_cast<int>(Component(status, point)));
    if (!IsUnseen(own))
    {
      open = false;
      continue;
    }
    if (!open)
    {
      pieces.emplace_back();
      open = true;
    }
    pieces.back().points.push_back(point);
    if (own == TrackingStatus::Lost)
    {
      pieces.back().status = own;
    }
  }
  return pieces;
}

Json DescribeMotion(vtkMotionRegularizer* regularizer)
{
  auto* data = vtkDataSet::SafeDownCast(regularizer->GetOutputDataObject(0));
  const auto one = [data](const char* name)
  {
    const Json values = Numbers(data, name);
    return values.empty() ? Json() : values.front();
  };
  Json said = { { "greatest_move_mm", one(names::MaximumMove) },
    { "violations", one(names::LimitViolations) }, { "iterations", one(names::LimitIterations) },
    { "noise_mm", Numbers(data, names::MotionNoise) } };
  const std::pair<const char*, const char*> energies[] = { { "temporal", names::TemporalEnergy },
    { "spatial", names::SpatialEnergy }, { "total", names::TotalEnergy },
    { "objective", names::MotionObjective } };
  for (const auto& [energy, array] : energies)
  {
    const Json values = Numbers(data, array);
    for (std::size_t n = 0; n < values.size() && n < 2; ++n)
    {
      said[std::string(energy) + (n == 0 ? "_before_mm2" : "_after_mm2")] = values[n];
    }
  }
  return said;
}
}

Json DescribeFilled(vtkAlgorithm* tracked, vtkPolyData* tree, vtkMessageTrap& messages)
{
  const VesselTree rest = vtkCoronary::BranchesOf(tree, nullptr);
  Json list = Json::array();
  AtEachStep(tracked, messages,
    [&](double time, vtkPolyData* lines)
    {
      vtkDataArray* status = lines->GetPointData()->GetArray(names::TrackingStatus);
      vtkDataArray* confidence = lines->GetPointData()->GetArray(names::TrackingConfidence);
      for (const VesselTree::Branch& branch : rest.branches)
      {
        for (const Piece& piece : UnseenPieces(branch, status))
        {
          double sum = 0.0;
          for (const std::int64_t point : piece.points)
          {
            sum += Component(confidence, point);
          }
          list.push_back({ { "vessel", NameOf(branch) }, { "time", time },
            { "status", piece.status == TrackingStatus::Lost ? "lost" : "filled" },
            { "length_mm", LengthOf(piece.points, rest.points) },
            { "confidence", sum / static_cast<double>(piece.points.size()) },
            { "place", PlaceOf(rest.points[piece.points[piece.points.size() / 2]]) } });
        }
      }
    });
  return list;
}

Json DescribePlacement(vtkAlgorithm* moving, vtkPolyData* tree, vtkMessageTrap& messages)
{
  const VesselTree rest = vtkCoronary::BranchesOf(tree, nullptr);
  std::vector<Json> branches;
  AtEachStep(moving, messages,
    [&](double time, vtkPolyData* lines)
    {
      vtkDataArray* placement = lines->GetPointData()->GetArray(names::PlacementConfidence);
      for (std::size_t n = 0; n < rest.branches.size(); ++n)
      {
        const VesselTree::Branch& branch = rest.branches[n];
        // Its first point may be its parent's.
        const double own = Component(placement, branch.points.back());
        if (branches.size() == n)
        {
          branches.push_back({ { "vessel", NameOf(branch) }, { "confidence", own },
            { "time", time }, { "length_mm", LengthOf(branch.points, rest.points) },
            { "place", PlaceOf(rest.points[branch.points[branch.points.size() / 2]]) },
            { "phases", Json::array() } });
        }
        Json& told = branches[n];
        told["phases"].push_back({ time, own });
        if (own < told["confidence"].get<double>())
        {
          told["confidence"] = own;
          told["time"] = time;
        }
      }
    });
  std::stable_sort(branches.begin(), branches.end(),
    [](const Json& a, const Json& b)
    { return a["confidence"].get<double>() < b["confidence"].get<double>(); });
  return branches;
}

std::string DoubtfulPlaces(const Json& placement)
{
  constexpr double Doubtful = 0.5;
  constexpr int Named = 8;
  std::string text;
  int count = 0;
  for (const Json& branch : placement)
  {
    if (branch["confidence"].get<double>() >= Doubtful || ++count > Named)
    {
      continue;
    }
    char one[80];
    std::snprintf(one, sizeof one, " (%.2f at %.0f %% R-R)", branch["confidence"].get<double>(),
      100.0 * branch["time"].get<double>());
    text += (text.empty() ? "" : ", ") + branch["vessel"].get<std::string>() + one;
  }
  if (count == 0)
  {
    return {};
  }
  return std::to_string(count) + (count == 1 ? " branch is" : " branches are") +
    " rather more than 1 mm off at some phase, or no artery: " + text +
    (count > Named ? " and others (motion.placement in report.json)" : "");
}

Json DescribeLimits(vtkMotionRegularizer* lines, vtkMotionRegularizer* skeleton, vtkPolyData* tree,
  vtkMessageTrap& messages)
{
  const VesselTree rest = vtkCoronary::BranchesOf(tree, nullptr);
  Json clamped = Json::array();
  AtEachStep(lines, messages,
    [&](double time, vtkPolyData* moved)
    {
      vtkDataArray* clamps = moved->GetPointData()->GetArray(names::MotionClamps);
      vtkDataArray* moves = moved->GetPointData()->GetArray(names::RegularizationMove);
      for (const VesselTree::Branch& branch : rest.branches)
      {
        for (std::size_t bit = 0; bit < LimitNames.size(); ++bit)
        {
          std::vector<std::int64_t> points;
          double farthest = 0.0;
          for (const std::int64_t point : branch.points)
          {
            if ((static_cast<int>(Component(clamps, point)) >> bit & 1) == 0)
            {
              continue;
            }
            points.push_back(point);
            Vector3 move = Vector3::Zero();
            if (moves)
            {
              moves->GetTuple(point, move.data());
            }
            farthest = std::max(farthest, move.norm());
          }
          if (!points.empty())
          {
            clamped.push_back(
              { { "vessel", NameOf(branch) }, { "time", time }, { "limit", LimitNames[bit] },
                { "points", points.size() }, { "greatest_move_mm", farthest },
                { "place", PlaceOf(rest.points[points[points.size() / 2]]) } });
          }
        }
      }
    });
  Json said = DescribeMotion(lines);
  said["skeleton"] = DescribeMotion(skeleton);
  said["clamped"] = clamped;
  return said;
}
}
