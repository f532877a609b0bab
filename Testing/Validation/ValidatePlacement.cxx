// How likely each branch of a run's moving tree was said to be where it is, and whether it is: rows for scripts/fit-odds.py and
// scripts/reliability.py, one a branch and tracked phase.
#include "BranchPlacement.h"
#include "CyclicTime.h"
#include "FileSeries.h"
#include "Geometry.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"
#include "vtkVesselTree.h"

#include "vtkDataArray.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace coronary;
namespace names = vtkCoronaryArrayNames;

constexpr double SameTime = 1e-4;     // of R-R
constexpr double MinimumLength = 5.0; // mm, of branches that are judged

class Series
{
public:
  explicit Series(const std::string& list)
    : Files(ReadFileSeries(list))
    , List(list)
  {
  }

  vtkSmartPointer<vtkPolyData> At(double time)
  {
    for (const TimedFile& file : this->Files)
    {
      if (CyclicDistance(file.time, time) < SameTime)
      {
        return ReadPolyData(file.path, this->Messages);
      }
    }
    throw std::runtime_error("'" + this->List + "' has nothing at " + std::to_string(time));
  }

private:
  std::vector<TimedFile> Files;
  std::string List;
  vtkMessageTrap Messages;
};

Polylines LinesOf(vtkPolyData* data)
{
  return vtkCoronary::LinesOf(data, vtkCoronary::FindRadius(data));
}

std::vector<double> Values(vtkPolyData* data, const char* name)
{
  vtkDataArray* array = data->GetPointData()->GetArray(name);
  if (array == nullptr)
  {
    throw std::runtime_error(std::string("the moving tree has no point array ") + name);
  }
  std::vector<double> values;
  for (vtkIdType n = 0; n < array->GetNumberOfTuples(); ++n)
  {
    values.push_back(array->GetComponent(n, 0));
  }
  return values;
}

/// The tree at these moments, as what was tracked.
/// @param sights  gets what the images showed there
PoseSequence PosesOf(
  Series& series, const std::vector<double>& times, std::vector<LumenSight>& sights)
{
  PoseSequence poses;
  poses.times = times;
  for (const double time : times)
  {
    const vtkSmartPointer<vtkPolyData> data = series.At(time);
    poses.points.push_back(LinesOf(data).points);
    poses.status.emplace_back();
    for (const double value : Values(data, names::TrackingStatus))
    {
      poses.status.back().push_back(static_cast<TrackingStatus>(static_cast<int>(value)));
    }
    sights.push_back({ Values(data, names::LumenBeside), Values(data, names::LumenContrast) });
  }
  return poses;
}

/// @throws std::runtime_error naming the array
double FieldNumber(vtkPolyData* data, const char* name)
{
  vtkDataArray* array = data->GetFieldData()->GetArray(name);
  if (array == nullptr)
  {
    throw std::runtime_error(std::string("the moving tree has no field array ") + name);
  }
  return array->GetComponent(0, 0);
}

/// Mean distance of a line's points from the nearest true axis, mm.
double MeanDistance(
  const std::vector<std::int64_t>& line, const std::vector<Vector3>& points, const Polylines& truth)
{
  double sum = 0.0;
  for (const std::int64_t p : line)
  {
    double nearest = std::numeric_limits<double>::infinity();
    for (const std::vector<std::int64_t>& other : truth.lines)
    {
      for (std::size_t i = 1; i < other.size(); ++i)
      {
        nearest = std::min(nearest,
          NearestOnSegment(points[p], truth.points[other[i - 1]], truth.points[other[i]])
            .squaredDistance);
      }
    }
    sum += std::sqrt(nearest);
  }
  return sum / static_cast<double>(line.size());
}

double Length(const std::vector<std::int64_t>& line, const std::vector<Vector3>& points)
{
  double length = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i)
  {
    length += (points[line[i]] - points[line[i - 1]]).norm();
  }
  return length;
}

void PrintHead()
{
  std::printf("condition,seed,placed,used,probability,x,y,z");
  for (const std::string& name : PlacementSigns::Names())
  {
    std::printf(",%s", name.c_str());
  }
  std::printf(",distance\n");
}

void Judge(const std::string& run, const std::string& truth, const std::string& condition,
  const std::string& seed, double shift)
{
  std::ifstream file(run + "/report.json");
  if (!file)
  {
    throw std::runtime_error("'" + run + "' has no report.json: it is no folder of `run`");
  }
  const auto report = nlohmann::json::parse(file);
  const auto& motion = report.at("motion");
  Series found(run + "/motion/centerline.vtp.series");
  Series real(truth + "/centerline.pvd");
  const auto times = motion.at("tracked_times").get<std::vector<double>>();
  const vtkSmartPointer<vtkPolyData> first = found.At(times.front());
  const ImageTiming timing{ FieldNumber(first, names::ReferenceTime),
    1e-3 * report.at("settings").at("temporal_window_ms").get<double>() /
      FieldNumber(first, names::CycleLength) };
  const Polylines rest = LinesOf(found.At(timing.reference));
  PlacementEvidence evidence{ Values(first, names::Confidence),
    Values(first, names::OstiumConfidence), Values(first, names::VeinProbability), {} };
  const PoseSequence poses = PosesOf(found, times, evidence.sights);
  const std::vector<std::vector<PlacementSigns>> signs =
    SignsOfPlacement(rest, evidence, poses, timing);
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    const Polylines truly = LinesOf(real.At(times[k]));
    for (std::size_t l = 0; l < rest.lines.size(); ++l)
    {
      const std::vector<std::int64_t>& line = rest.lines[l];
      if (Length(line, rest.points) < MinimumLength)
      {
        continue;
      }
      const double distance = std::max(0.0, MeanDistance(line, poses.points[k], truly) - shift);
      const bool placed = distance <= PlacedWithin;
      const Vector3& middle = rest.points[line[line.size() / 2]];
      std::printf("%s,%s,%d,1,%.4f,%.1f,%.1f,%.1f", condition.c_str(), seed.c_str(), placed ? 1 : 0,
        PlacementConfidence(signs[k][l]), middle[0], middle[1], middle[2]);
      for (const double value : signs[k][l].Values())
      {
        std::printf(",%.4f", value);
      }
      std::printf(",%.2f\n", distance);
    }
  }
}
}

int main(int argc, char** argv)
{
  try
  {
    CLI::App program("Whether the branches of a run are where they are said to be, and how "
                     "likely that was said to be; rows on stdout");
    std::string run;
    std::string truth;
    std::string condition = "case";
    std::string seed = "0";
    double shift = 0.0;
    bool head = false;
    program.add_option("--run", run, "folder of `coronary-pipeline run`")->required();
    program.add_option("--truth", truth, "folder with centerline.pvd")->required();
    program.add_option("--condition", condition, "for the rows")->capture_default_str();
    program.add_option("--seed", seed, "of the heart, for the rows")->capture_default_str();
    program.add_option("--shift", shift, "mm that the scan has the heart beside its truth at most")
      ->capture_default_str();
    program.add_flag("--head", head, "names of the columns first");
    CLI11_PARSE(program, argc, argv);
    if (head)
    {
      PrintHead();
    }
    Judge(run, truth, condition, seed, shift);
    return 0;
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-placement: %s\n", error.what());
    return 2;
  }
}
