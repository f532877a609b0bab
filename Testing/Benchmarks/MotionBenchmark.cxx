// Microseconds for a moment of a motion that is known, and milliseconds for what comes before.
//
// A winding tree, 20 phases from -5 to 106 %. DYNAMICCORONARY_POINTS sets the number of points (1000); the argument is
// the mode: linear, periodic cubic, low noise.

#include "CoronaryPhantom.h"
#include "MotionRegularization.h"
#include "ParallelFor.h"
#include "PhaseInterpolation.h"
#include "vtkCardiacPhaseInterpolator.h"

#include "vtkCellArray.h"
#include "vtkDataObject.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <benchmark/benchmark.h>

#include <algorithm>

#include <cmath>
#include <cstdlib>
#include <random>

namespace
{
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

int NumberOfPoints()
{
  const char* wanted = std::getenv("DYNAMICCORONARY_POINTS");
  return wanted ? std::max(30, std::atoi(wanted)) : 1000;
}

/// Branches of thirty points, one after the other on a bow.
coronary::Polylines Lines()
{
  coronary::Polylines lines;
  for (int n = 0; n < NumberOfPoints(); ++n)
  {
    const double s = 0.6 * n;
    lines.points.emplace_back(
      40.0 * std::cos(0.02 * s), 40.0 * std::sin(0.02 * s), 0.2 * s + 3.0 * std::sin(0.1 * s));
    if (n > 0 && n % 30 == 0)
    {
      lines.lines.push_back({ n - 1 });
    }
    if (lines.lines.empty())
    {
      lines.lines.emplace_back();
    }
    lines.lines.back().push_back(n);
  }
  return lines;
}

Vector3 Beat(const Vector3& rest, double t)
{
  const double angle = 2.0 * 3.14159265358979 * t;
  const double s = 0.5 - 0.5 * std::cos(angle) + 0.2 * std::sin(2.0 * angle);
  return Eigen::AngleAxisd(0.1 * s, Vector3::UnitZ()) * rest + Vector3(2.0, -1.0, 9.0) * s;
}

coronary::PoseSequence Motion(const coronary::Polylines& lines, bool spoiled)
{
  coronary::PoseSequence motion;
  motion.times = coronary::PaperPhases();
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.2);
  for (std::size_t k = 0; k < motion.times.size(); ++k)
  {
    motion.points.emplace_back();
    motion.confidence.emplace_back();
    for (std::size_t n = 0; n < lines.points.size(); ++n)
    {
      const bool lost = spoiled && (k == 6 || ((k == 5 || k == 7) && n % 50 < 20));
      const double scatter = lost ? 20.0 : 1.0;
      motion.points.back().push_back(Beat(lines.points[n], motion.times[k]) +
        scatter * Vector3(noise(random), noise(random), noise(random)));
      motion.confidence.back().push_back(lost ? 0.02 : 0.95);
    }
  }
  return motion;
}

/// The motion as a source of a pipeline.
class Source : public vtkPolyDataAlgorithm
{
public:
  static Source* New();
  vtkTypeMacro(Source, vtkPolyDataAlgorithm);
  coronary::Polylines Rest = Lines();

protected:
  Source() { this->SetNumberOfInputPorts(0); }
  int RequestInformation(
    vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    const std::vector<double> steps = coronary::PaperPhases();
    const double range[2] = { steps.front(), steps.back() };
    vtkInformation* info = outputs->GetInformationObject(0);
    info->Set(SDDP::TIME_STEPS(), steps.data(), static_cast<int>(steps.size()));
    info->Set(SDDP::TIME_RANGE(), range, 2);
    return 1;
  }
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    vtkInformation* info = outputs->GetInformationObject(0);
    vtkPolyData* output = vtkPolyData::GetData(info);
    const double time = info->Get(SDDP::UPDATE_TIME_STEP());
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    for (const Vector3& rest : this->Rest.points)
    {
      points->InsertNextPoint(Beat(rest, time).data());
    }
    vtkNew<vtkCellArray> lines;
    for (const std::vector<std::int64_t>& line : this->Rest.lines)
    {
      lines->InsertNextCell(static_cast<int>(line.size()));
      for (const std::int64_t point : line)
      {
        lines->InsertCellPoint(point);
      }
    }
    output->SetPoints(points);
    output->SetLines(lines);
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), time);
    return 1;
  }
};
vtkStandardNewMacro(Source);

/// A request of a time to the filter, through the pipeline.
void FilterMoment(benchmark::State& state)
{
  vtkNew<Source> source;
  vtkNew<vtkCardiacPhaseInterpolator> filter;
  filter->SetInputConnection(source->GetOutputPort());
  filter->SetMode(static_cast<int>(state.range(0)));
  filter->UpdateTimeStep(0.0);
  double time = 0.0;
  for (auto _ : state)
  {
    time += 0.0137;
    filter->UpdateTimeStep(time);
  }
}
BENCHMARK(FilterMoment)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void AlgorithmMoment(benchmark::State& state)
{
  coronary::PhaseInterpolationSettings settings;
  settings.mode = static_cast<coronary::PhaseInterpolationMode>(state.range(0));
  const coronary::PhaseInterpolation motion(Motion(Lines(), false), settings);
  coronary::InterpolatedPose pose;
  double time = 0.0;
  for (auto _ : state)
  {
    time += 0.0137;
    motion.Evaluate(time, pose);
    benchmark::DoNotOptimize(pose.points.data());
  }
}
BENCHMARK(AlgorithmMoment)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

/// Argument: whether samples are lost.
void Prepare(benchmark::State& state)
{
  coronary::PhaseInterpolationSettings settings;
  settings.mode = static_cast<coronary::PhaseInterpolationMode>(state.range(0));
  const coronary::PoseSequence motion = Motion(Lines(), state.range(1) != 0);
  for (auto _ : state)
  {
    const coronary::PhaseInterpolation made(motion, settings);
    benchmark::DoNotOptimize(made.Knots().data());
  }
}
BENCHMARK(Prepare)->ArgsProduct({ { 0, 1, 2 }, { 0, 1 } })->Unit(benchmark::kMillisecond);

void Regularize(benchmark::State& state)
{
  const coronary::Polylines lines = Lines();
  const coronary::PoseSequence motion = Motion(lines, state.range(0) != 0);
  int iterations = 0;
  for (auto _ : state)
  {
    const coronary::RegularizedMotion result = coronary::RegularizeMotion(motion, lines);
    iterations = result.iterations;
  }
  state.counters["iterations"] = iterations;
}
BENCHMARK(Regularize)->DenseRange(0, 1)->Unit(benchmark::kMillisecond);
}

BENCHMARK_MAIN();
