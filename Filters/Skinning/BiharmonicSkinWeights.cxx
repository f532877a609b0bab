#include "BiharmonicSkinWeights.h"

#include "PartialProgress.h"
#include "Require.h"
#include "SkinWeightOptimizer.h"
#include "SkinWeightSystem.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace coronary
{
namespace
{
/// Weights without bounds: one linear solve for all bones.
std::vector<std::vector<double>> SolveWithoutBounds(
  const SkinWeightSystem& system, SkinWeights& result, const ProgressCallback& progress)
{
  const std::int64_t rows = system.energy.rows;
  std::vector<std::int32_t> all(rows);
  std::iota(all.begin(), all.end(), 0);
  SupernodalFactor<double> factor(system.energy, all, EliminationOrder::Given);
  factor.Factorize(system.energy, 0.0);
  result.factorizations = 1;
  Report(progress, 0.5);
  std::vector<std::vector<double>> weights(system.bones);
  constexpr std::int64_t block = 8;
  ParallelFor((system.bones + block - 1) / block, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      std::vector<double> scratch;
      for (std::int64_t group = first; group < last; ++group)
      {
        const std::int64_t from = group * block;
        const std::int64_t to = std::min(system.bones, from + block);
        std::vector<double> right(rows * (to - from), 0.0);
        for (std::int64_t b = from; b < to; ++b)
        {
          for (const SkinWeightSystem::Entry& entry : system.linear[b])
          {
            right[(b - from) * rows + entry.row] = -entry.value;
          }
        }
        std::vector<double> solution(right.size());
        factor.AddSolution(right.data(), solution.data(), to - from, scratch);
        for (std::int64_t b = from; b < to; ++b)
        {
          weights[b].assign(
            solution.begin() + (b - from) * rows, solution.begin() + (b - from + 1) * rows);
        }
      }
    });
  Report(progress, 1.0);
  return weights;
}

/// One weight of a row.
struct RowWeight
{
  std::int32_t bone;
  double weight;
};

/// Of every free row: its weights in the order of the bones.
using WeightRows = std::vector<std::vector<RowWeight>>;

/// 1/2 w'Qw and the rest, of one bone after the other.
double EnergyOf(const SkinWeightSystem& system, const std::vector<std::vector<double>>& weights)
{
  std::vector<double> energies(system.bones);
  ParallelFor(system.bones, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t b = first; b < last; ++b)
      {
        const std::vector<double>& w = weights[b];
        double sum = system.constant[b];
        for (const SkinWeightSystem::Entry& entry : system.linear[b])
        {
          sum += entry.value * w[entry.row];
        }
        for (std::int64_t i = 0; i < system.energy.rows; ++i)
        {
          double product = 0.0;
          for (std::int64_t a = system.energy.offset[i]; a < system.energy.offset[i + 1]; ++a)
          {
            product += system.energy.value[a] * w[system.energy.column[a]];
          }
          sum += 0.5 * w[i] * product;
        }
        energies[b] = sum;
      }
    });
  return std::accumulate(energies.begin(), energies.end(), 0.0);
}

/// Divides every row by its sum.
void Normalize(WeightRows& rows, SkinWeights& result)
{
  for (std::vector<RowWeight>& row : rows)
  {
    double sum = 0.0;
    for (const RowWeight& w : row)
    {
      sum += w.weight;
    }
    result.maximumSum = std::max(result.maximumSum, sum);
    result.minimumSum = std::min(result.minimumSum, sum);
    if (sum > 0.0)
    {
      for (RowWeight& w : row)
      {
        w.weight /= sum;
      }
    }
  }
}
}

void SkinWeightSettings::Validate() const
{
  // Written so that NaN fails.
  Require(this->mode >= SkinWeightMode::Joint && this->mode <= SkinWeightMode::Harmonic,
    "mode must be Joint, Independent, Unbounded or Harmonic");
  Require(
    this->tolerance >= 1e-10 && this->tolerance <= 0.01, "tolerance must be within 1e-10 to 0.01");
  Require(
    this->iterations >= 1 && this->iterations <= 1000000, "iterations must be within 1 to 1000000");
  Require(this->neighbourhood >= 0.0 && this->neighbourhood <= 1e6,
    "neighbourhood must be within 0 to 1000000");
  Require(this->penalty >= 1.0 && this->penalty <= 1e8, "penalty must be within 1 to 1e8");
}

namespace
{
/// The weights of the bones that are not outside, numbered as all bones are.
SkinWeights ComputeWithout(const std::vector<std::int64_t>& outside,
  const std::vector<double>& lengthOutside, const SkinWeightInput& input,
  const SkinWeightSettings& settings, const ProgressCallback& progress)
{
  Require(outside.size() < input.bones.size(), "all bones lie outside of the mesh");
  SkinWeightInput inside = input;
  inside.bones.clear();
  std::vector<std::int32_t> number;
  for (std::size_t b = 0; b < input.bones.size(); ++b)
  {
    if (!std::binary_search(outside.begin(), outside.end(), static_cast<std::int64_t>(b)))
    {
      inside.bones.push_back(input.bones[b]);
      number.push_back(static_cast<std::int32_t>(b));
    }
  }
  SkinWeights result = ComputeSkinWeights(inside, settings, progress);
  for (std::int32_t& bone : result.bone)
  {
    bone = number[bone];
  }
  const std::vector<double> lengths = std::move(result.lengthOutside);
  result.lengthOutside = lengthOutside;
  for (std::size_t n = 0; n < number.size(); ++n)
  {
    result.lengthOutside[number[n]] = lengths[n];
  }
  result.bones = static_cast<std::int64_t>(input.bones.size());
  result.leftOut = outside;
  return result;
}
}

SkinWeights ComputeSkinWeights(const SkinWeightInput& input, const SkinWeightSettings& settings,
  const ProgressCallback& progress)
{
  settings.Validate();
  const auto part = [&](double first, double last) { return PartOf(progress, first, last); };
  const SkinWeightSystem system = MakeSkinWeightSystem(input, settings, part(0.0, 0.1));
  if (!system.outside.empty())
  {
    return ComputeWithout(system.outside, system.lengthOutside, input, settings, part(0.1, 1.0));
  }
  SkinWeights result;
  result.bones = system.bones;
  result.samples = static_cast<std::int64_t>(system.samples.size());
  result.lengthOutside = system.lengthOutside;
  result.fixedPoints = static_cast<std::int64_t>(system.fixed.size()) - system.energy.rows;

  WeightRows rows(system.energy.rows);
  if (settings.mode == SkinWeightMode::Joint || settings.mode == SkinWeightMode::Independent)
  {
    SkinWeightOptimizer optimizer(system, settings);
    optimizer.Run(part(0.1, 1.0));
    optimizer.Describe(result);
    for (std::int64_t r = 0; r < system.energy.rows; ++r)
    {
      optimizer.ForWeights(r,
        [&](std::int32_t bone, double weight)
        {
          if (weight != 0.0)
          {
            rows[r].push_back({ bone, weight });
          }
        });
      if (rows[r].empty())
      {
        // No bone reached this point; the nearest one takes it along.
        rows[r].push_back({ system.nearest[r], 1.0 });
        result.minimumSum = 0.0;
      }
    }
    Normalize(rows, result);
  }
  else
  {
    const std::vector<std::vector<double>> weights =
      SolveWithoutBounds(system, result, part(0.1, 1.0));
    result.energy = EnergyOf(system, weights);
    result.converged = true;
    for (std::int64_t r = 0; r < system.energy.rows; ++r)
    {
      for (std::int64_t b = 0; b < system.bones; ++b)
      {
        const double weight = settings.mode == SkinWeightMode::Harmonic
          ? std::clamp(weights[b][r], 0.0, 1.0)
          : weights[b][r];
        if (weight != 0.0)
        {
          rows[r].push_back({ static_cast<std::int32_t>(b), weight });
        }
      }
    }
    if (settings.mode == SkinWeightMode::Harmonic)
    {
      Normalize(rows, result);
    }
  }
  result.energy /= system.unit;

  std::vector<std::int64_t> rowOfPoint(input.points.size(), -1);
  for (std::int64_t r = 0; r < system.energy.rows; ++r)
  {
    rowOfPoint[system.pointOfRow[r]] = r;
  }
  result.offset.assign(1, 0);
  result.offset.reserve(input.points.size() + 1);
  for (std::size_t i = 0; i < input.points.size(); ++i)
  {
    if (rowOfPoint[i] >= 0)
    {
      for (const RowWeight& w : rows[rowOfPoint[i]])
      {
        result.bone.push_back(w.bone);
        result.weight.push_back(w.weight);
      }
    }
    else
    {
      for (const SkinWeightSystem::Target& target : system.fixed[i])
      {
        result.bone.push_back(target.bone);
        result.weight.push_back(target.value);
      }
    }
    result.offset.push_back(static_cast<std::int64_t>(result.bone.size()));
  }

  for (const SkinWeightSystem::Sample& sample : system.samples)
  {
    for (const SkinWeightSystem::Target& target : sample.targets)
    {
      double value = 0.0;
      for (int a = 0; a < 4; ++a)
      {
        for (std::int64_t e = result.offset[sample.points[a]];
             e < result.offset[sample.points[a] + 1]; ++e)
        {
          value += result.bone[e] == target.bone ? sample.barycentric[a] * result.weight[e] : 0.0;
        }
      }
      result.constraintResidual =
        std::max(result.constraintResidual, std::abs(value - target.value));
    }
  }
  return result;
}

CompactSkinWeights CompactWeights(const SkinWeights& weights, int influences)
{
  Require(influences >= 1 && influences <= 64, "influences must be within 1 to 64");
  const auto points = static_cast<std::int64_t>(weights.offset.size()) - 1;
  CompactSkinWeights compact;
  compact.influences = influences;
  compact.bone.assign(points * influences, 0);
  compact.weight.assign(points * influences, 0.0f);
  compact.dropped.assign(points, 0.0f);
  std::vector<RowWeight> row;
  for (std::int64_t i = 0; i < points; ++i)
  {
    row.clear();
    double sum = 0.0;
    for (std::int64_t e = weights.offset[i]; e < weights.offset[i + 1]; ++e)
    {
      row.push_back({ weights.bone[e], weights.weight[e] });
      sum += weights.weight[e];
    }
    // By size, whatever the sign: weights without bounds may be negative.
    std::stable_sort(row.begin(), row.end(),
      [](const RowWeight& a, const RowWeight& b)
      { return std::abs(a.weight) > std::abs(b.weight); });
    double kept = 0.0;
    double dropped = 0.0;
    const auto entries = std::min<std::size_t>(row.size(), influences);
    for (std::size_t k = 0; k < row.size(); ++k)
    {
      (k < entries ? kept : dropped) += k < entries ? row[k].weight : std::abs(row[k].weight);
    }
    const double factor = kept != 0.0 ? sum / kept : 1.0;
    for (std::size_t k = 0; k < entries; ++k)
    {
      compact.bone[i * influences + k] = row[k].bone;
      compact.weight[i * influences + k] = static_cast<float>(row[k].weight * factor);
    }
    compact.dropped[i] = static_cast<float>(dropped);
    compact.maximumDropped = std::max(compact.maximumDropped, dropped);
  }
  return compact;
}
}
