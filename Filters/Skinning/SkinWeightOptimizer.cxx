#include "SkinWeightOptimizer.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numeric>

namespace coronary
{
namespace
{
constexpr std::int64_t ColumnsAtOnce = 8; // fixed, so that results do not depend on the threads
constexpr std::int64_t ValuesAtOnce = 1 << 15;
constexpr std::int64_t RowsAtOnce = 1 << 11;
constexpr double Relaxation = 1.6;
constexpr int CheckEvery = 10;
constexpr int Memory = 8; // of the acceleration
}

SkinWeightOptimizer::SkinWeightOptimizer(
  const SkinWeightSystem& system, const SkinWeightSettings& settings)
  : System(system)
  , Settings(settings)
  , Joint(settings.mode == SkinWeightMode::Joint)
{
  this->MakeGroups();
  this->MakePairs();
  if (const char* rho = std::getenv("RHO"))
  {
    this->Rho = std::atof(rho);
  }
}

void SkinWeightOptimizer::MakeGroups()
{
  const std::int64_t rows = this->System.energy.rows;
  const std::int64_t bones = this->System.bones;
  if (this->Settings.neighbourhood == 0)
  {
    this->Groups.resize(1);
    this->Groups[0].bones.resize(bones);
    std::iota(this->Groups[0].bones.begin(), this->Groups[0].bones.end(), 0);
    this->Groups[0].rows.resize(rows);
    std::iota(this->Groups[0].rows.begin(), this->Groups[0].rows.end(), 0);
  }
  else
  {
    this->Groups.resize(bones);
    std::vector<std::vector<std::int32_t>> rowsOf(bones);
    for (std::int64_t r = 0; r < rows; ++r)
    {
      rowsOf[this->System.nearest[r]].push_back(static_cast<std::int32_t>(r));
    }
    for (std::int64_t b = 0; b < bones; ++b)
    {
      std::vector<int> hops(bones, -1);
      std::vector<std::int32_t> reached{ static_cast<std::int32_t>(b) };
      hops[b] = 0;
      Group& group = this->Groups[b];
      group.bones = { static_cast<std::int32_t>(b) };
      for (std::size_t i = 0; i < reached.size(); ++i)
      {
        const std::int32_t bone = reached[i];
        group.rows.insert(group.rows.end(), rowsOf[bone].begin(), rowsOf[bone].end());
        if (hops[bone] < this->Settings.neighbourhood)
        {
          for (const std::int32_t next : this->System.neighbours[bone])
          {
            if (hops[next] < 0)
            {
              hops[next] = hops[bone] + 1;
              reached.push_back(next);
            }
          }
        }
      }
      std::sort(group.rows.begin(), group.rows.end());
    }
  }
  for (std::size_t g = 0; g < this->Groups.size(); ++g)
  {
    Group& group = this->Groups[g];
    group.base = this->Size;
    const auto columns = static_cast<std::int64_t>(group.bones.size());
    this->Size += columns * static_cast<std::int64_t>(group.rows.size());
    for (std::int64_t first = 0; first < columns; first += ColumnsAtOnce)
    {
      this->Tasks.push_back({ g, first, std::min(ColumnsAtOnce, columns - first),
        std::make_unique<SparseCholesky::Workspace>() });
    }
  }
}

void SkinWeightOptimizer::MakePairs()
{
  const std::int64_t rows = this->System.energy.rows;
  this->PairOffset.assign(rows + 1, 0);
  for (const Group& group : this->Groups)
  {
    for (const std::int32_t r : group.rows)
    {
      this->PairOffset[r + 1] += static_cast<std::int64_t>(group.bones.size());
    }
  }
  std::partial_sum(this->PairOffset.begin(), this->PairOffset.end(), this->PairOffset.begin());
  this->PairBone.resize(this->Size);
  this->PairIndex.resize(this->Size);
  this->RowOfValue.resize(this->Size);
  this->Linear.assign(this->Size, 0.0);
  std::vector<std::int64_t> next(this->PairOffset.begin(), this->PairOffset.end() - 1);
  for (const Group& group : this->Groups)
  {
    const auto height = static_cast<std::int64_t>(group.rows.size());
    for (std::size_t k = 0; k < group.bones.size(); ++k)
    {
      const std::int64_t base = group.base + static_cast<std::int64_t>(k) * height;
      auto entry = this->System.linear[group.bones[k]].begin();
      const auto end = this->System.linear[group.bones[k]].end();
      for (std::int64_t i = 0; i < height; ++i)
      {
        const std::int32_t r = group.rows[i];
        this->PairBone[next[r]] = group.bones[k];
        this->PairIndex[next[r]] = base + i;
        ++next[r];
        this->RowOfValue[base + i] = r;
        while (entry != end && entry->row < r)
        {
          ++entry;
        }
        if (entry != end && entry->row == r)
        {
          this->Linear[base + i] = entry->value;
        }
      }
    }
  }
}

void SkinWeightOptimizer::Factorize()
{
  ParallelFor(static_cast<std::int64_t>(this->Groups.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t g = first; g < last; ++g)
      {
        Group& group = this->Groups[g];
        group.factor.reset();
        if (group.rows.empty())
        {
          continue;
        }
        Values shift(group.rows.size());
        for (std::size_t i = 0; i < shift.size(); ++i)
        {
          shift[i] = this->Rho * this->System.diagonal[group.rows[i]];
        }
        group.factor =
          std::make_unique<SparseCholesky>(this->System.energy, group.rows, shift.data());
      }
    });
  ++this->Factorizations;
}

void SkinWeightOptimizer::Project(const Values& s, Values& z) const
{
  if (!this->Joint)
  {
    ParallelFor(this->Size, ValuesAtOnce,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t i = first; i < last; ++i)
        {
          z[i] = std::clamp(s[i], 0.0, 1.0);
        }
      });
    return;
  }
  // Onto the simplex: minus what makes the positive parts sum to 1 (Held, Wolfe, Crowder 1974).
  ParallelFor(this->System.energy.rows, RowsAtOnce,
    [&](std::int64_t firstRow, std::int64_t lastRow)
    {
      Values sorted;
      for (std::int64_t r = firstRow; r < lastRow; ++r)
      {
        const std::int64_t first = this->PairOffset[r];
        const std::int64_t last = this->PairOffset[r + 1];
        sorted.clear();
        for (std::int64_t p = first; p < last; ++p)
        {
          sorted.push_back(s[this->PairIndex[p]]);
        }
        std::sort(sorted.begin(), sorted.end(), std::greater<>());
        double sum = 0.0;
        double threshold = 0.0;
        for (std::size_t k = 0; k < sorted.size(); ++k)
        {
          sum += sorted[k];
          const double candidate = (sum - 1.0) / static_cast<double>(k + 1);
          if (sorted[k] <= candidate)
          {
            break;
          }
          threshold = candidate;
        }
        for (std::int64_t p = first; p < last; ++p)
        {
          z[this->PairIndex[p]] = std::max(0.0, s[this->PairIndex[p]] - threshold);
        }
      }
    });
}

void SkinWeightOptimizer::Solve(const Values& s, const Values& z, Values& x)
{
  ParallelFor(static_cast<std::int64_t>(this->Tasks.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      Values right;
      for (std::int64_t t = first; t < last; ++t)
      {
        Task& task = this->Tasks[t];
        const Group& group = this->Groups[task.group];
        const auto height = static_cast<std::int64_t>(group.rows.size());
        if (height == 0)
        {
          continue;
        }
        const std::int64_t base = group.base + task.firstColumn * height;
        right.resize(height * task.columns);
        for (std::int64_t i = 0; i < height * task.columns; ++i)
        {
          const std::int64_t v = base + i;
          right[i] = this->Rho * this->System.diagonal[this->RowOfValue[v]] * (2.0 * z[v] - s[v]) -
            this->Linear[v];
        }
        group.factor->Solve(right.data(), x.data() + base, task.columns, *task.workspace);
      }
    });
}

double SkinWeightOptimizer::Dot(const Values& a, const Values& b) const
{
  const auto count = static_cast<std::int64_t>(a.size());
  Values parts((count + ValuesAtOnce - 1) / ValuesAtOnce, 0.0);
  ParallelFor(static_cast<std::int64_t>(parts.size()), 1,
    [&](std::int64_t firstPart, std::int64_t lastPart)
    {
      for (std::int64_t p = firstPart; p < lastPart; ++p)
      {
        double sum = 0.0;
        for (std::int64_t i = p * ValuesAtOnce; i < std::min(count, (p + 1) * ValuesAtOnce); ++i)
        {
          sum += a[i] * b[i];
        }
        parts[p] = sum;
      }
    });
  return std::accumulate(parts.begin(), parts.end(), 0.0);
}

SkinWeightOptimizer::Violation SkinWeightOptimizer::Judge(
  const Values& z, Values& gradient, bool everywhere) const
{
  const SparseMatrix& q = this->System.energy;
  struct Outside
  {
    std::int32_t row;
    double gradient;
  };
  std::vector<std::vector<Outside>> outside(this->System.bones);
  Values energies(this->System.bones, 0.0);
  ParallelFor(static_cast<std::int64_t>(this->Tasks.size()), 1,
    [&](std::int64_t firstTask, std::int64_t lastTask)
    {
      Values g(q.rows, 0.0);
      std::vector<char> touched(q.rows, 0);
      std::vector<std::int32_t> list;
      const auto add = [&](std::int32_t row, double value)
      {
        if (!touched[row])
        {
          touched[row] = 1;
          list.push_back(row);
        }
        g[row] += value;
      };
      for (std::int64_t t = firstTask; t < lastTask; ++t)
      {
        const Group& group = this->Groups[this->Tasks[t].group];
        const auto height = static_cast<std::int64_t>(group.rows.size());
        for (std::int64_t k = 0; k < this->Tasks[t].columns; ++k)
        {
          const std::int64_t column = this->Tasks[t].firstColumn + k;
          const std::int32_t bone = group.bones[column];
          const double* w = z.data() + group.base + column * height;
          list.clear();
          for (std::int64_t i = 0; i < height; ++i)
          {
            if (w[i] != 0.0)
            {
              const std::int32_t row = group.rows[i];
              for (std::int64_t a = q.offset[row]; a < q.offset[row + 1]; ++a)
              {
                add(q.column[a], q.value[a] * w[i]);
              }
            }
          }
          // 1/2 w'Qw + c'w, of which the gradient has Qw until now
          double energy = this->System.constant[bone];
          for (std::int64_t i = 0; i < height; ++i)
          {
            energy += 0.5 * w[i] * g[group.rows[i]];
          }
          for (const SkinWeightSystem::Entry& entry : this->System.linear[bone])
          {
            add(entry.row, entry.value);
          }
          for (std::int64_t i = 0; i < height; ++i)
          {
            const std::int64_t v = group.base + column * height + i;
            energy += w[i] * this->Linear[v];
            gradient[v] = g[group.rows[i]];
            g[group.rows[i]] = 0.0;
            touched[group.rows[i]] = touched[group.rows[i]] ? 2 : 0;
          }
          energies[bone] = energy;
          for (const std::int32_t row : list)
          {
            if (touched[row] == 1 && everywhere)
            {
              outside[bone].push_back({ row, g[row] });
            }
            touched[row] = 0;
            g[row] = 0.0;
          }
        }
      }
    });

  Violation violation;
  violation.energy = std::accumulate(energies.begin(), energies.end(), 0.0);
  const std::int64_t parts = (q.rows + RowsAtOnce - 1) / RowsAtOnce;
  std::vector<Violation> partial(parts);
  Values multiplier(q.rows, 0.0); // of the sum, Joint
  Values lowest(q.rows, 0.0);     // gradient of any bone
  ParallelFor(parts, 1,
    [&](std::int64_t firstPart, std::int64_t lastPart)
    {
      for (std::int64_t part = firstPart; part < lastPart; ++part)
      {
        for (std::int64_t r = part * RowsAtOnce; r < std::min(q.rows, (part + 1) * RowsAtOnce); ++r)
        {
          double highest = -std::numeric_limits<double>::infinity();
          double least = std::numeric_limits<double>::infinity();
          double work = 0.0;
          double worst = 0.0;
          for (std::int64_t p = this->PairOffset[r]; p < this->PairOffset[r + 1]; ++p)
          {
            const std::int64_t v = this->PairIndex[p];
            least = std::min(least, gradient[v]);
            work += z[v] * gradient[v];
            if (this->Joint)
            {
              highest = z[v] > 0.0 ? std::max(highest, gradient[v]) : highest;
            }
            else
            {
              const double up = z[v] < 1.0 ? -gradient[v] : 0.0;
              const double down = z[v] > 0.0 ? gradient[v] : 0.0;
              worst = std::max({ worst, up, down });
              partial[part].gap += z[v] * gradient[v] - std::min(0.0, gradient[v]);
            }
          }
          if (this->Joint)
          {
            // The multiplier in the middle of its bounds.
            worst = std::max(0.0, 0.5 * (highest - least));
            multiplier[r] = 0.5 * (highest + least);
            lowest[r] = least;
            partial[part].gap += work;
          }
          partial[part].inside = std::max(partial[part].inside, worst / this->System.diagonal[r]);
        }
      }
    });
  for (const Violation& part : partial)
  {
    violation.inside = std::max(violation.inside, part.inside);
    violation.gap += part.gap;
  }
  violation.everywhere = violation.inside;
  if (!everywhere)
  {
    return violation;
  }
  // Bones that are not allowed somewhere. Where a bone's weight is far away, its gradient is 0.
  std::vector<std::int64_t> known(q.rows);
  for (std::int64_t r = 0; r < q.rows; ++r)
  {
    known[r] = this->PairOffset[r + 1] - this->PairOffset[r];
  }
  const auto judge = [&](std::int64_t r, double g)
  {
    const double excess = (this->Joint ? multiplier[r] : 0.0) - g;
    violation.everywhere = std::max(violation.everywhere, excess / this->System.diagonal[r]);
    if (this->Joint)
    {
      lowest[r] = std::min(lowest[r], g);
    }
    else
    {
      violation.gap += std::max(0.0, -g);
    }
  };
  for (const std::vector<Outside>& list : outside)
  {
    for (const Outside& o : list)
    {
      ++known[o.row];
      judge(o.row, o.gradient);
    }
  }
  for (std::int64_t r = 0; r < q.rows; ++r)
  {
    if (known[r] < this->System.bones)
    {
      judge(r, 0.0);
    }
    violation.gap -= this->Joint ? lowest[r] : 0.0;
  }
  return violation;
}

void SkinWeightOptimizer::Run(const ProgressCallback& progress)
{
  const bool verbose = std::getenv("VERBOSE") != nullptr;
  Values s(this->Size, 0.0);
  // Begins with the nearest bone's weight 1.
  for (std::int64_t r = 0; r < this->System.energy.rows; ++r)
  {
    for (std::int64_t p = this->PairOffset[r]; p < this->PairOffset[r + 1]; ++p)
    {
      s[this->PairIndex[p]] = this->PairBone[p] == this->System.nearest[r] ? 1.0 : 0.0;
    }
  }
  Values z(this->Size);
  Values x(this->Size);
  Values previous(this->Size);
  Values gradient(this->Size);
  this->Factorize();
  double reported = 0.05;
  Report(progress, reported);
  double firstResidual = 0.0;

  std::vector<Values> steps;    // differences of s
  std::vector<Values> residues; // differences of the fixed point's residual
  Values lastS;
  Values lastF;
  Values f(this->Size);
  double lastNorm = std::numeric_limits<double>::infinity();
  Values safeS; // where a plain step would have led
  int lastFactorization = 0;

  for (this->Iterations = 1; this->Iterations <= this->Settings.iterations; ++this->Iterations)
  {
    this->Project(s, z);
    if (this->Iterations % CheckEvery == 1)
    {
      const Violation violation = this->Judge(z, gradient, false);
      if (verbose)
      {
        std::fprintf(stderr, "%5d rho %.3g kkt %.3e energy %.9g gap? %.3e\n", this->Iterations,
          this->Rho, violation.inside, violation.energy, violation.gap);
      }
      if (firstResidual == 0.0)
      {
        firstResidual = violation.inside;
      }
      this->Weights = z;
      this->Quality = violation;
      if (violation.inside <= this->Settings.tolerance)
      {
        this->Converged = true;
        break;
      }
      const double done = std::log(firstResidual / violation.inside) /
        std::log(std::max(1.0 + 1e-9, firstResidual / this->Settings.tolerance));
      reported = std::max(reported, 0.05 + 0.85 * std::clamp(done, 0.0, 1.0));
    }
    Report(progress, reported);
    this->Solve(s, z, x);
    ParallelFor(this->Size, ValuesAtOnce,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t i = first; i < last; ++i)
        {
          f[i] = Relaxation * (x[i] - z[i]);
        }
      });

    // Balance of the two residuals, as OSQP does.
    if (this->Iterations % CheckEvery == 0 && this->Iterations - lastFactorization >= 20)
    {
      double primal = 0.0;
      double dual = 0.0;
      double size = 0.0;
      double force = 0.0;
      for (std::int64_t i = 0; i < this->Size; ++i)
      {
        const double d = this->System.diagonal[this->RowOfValue[i]];
        primal += d * (x[i] - z[i]) * (x[i] - z[i]);
        dual += d * (z[i] - previous[i]) * (z[i] - previous[i]);
        size += d * z[i] * z[i];
        force += d * (s[i] - z[i]) * (s[i] - z[i]);
      }
      const double ratio = std::sqrt((primal / size) / std::max(1e-300, dual / force));
      if (verbose)
      {
        std::fprintf(stderr, "      primal %.3g dual %.3g ratio %.3g\n", std::sqrt(primal / size),
          std::sqrt(dual / force), ratio);
      }
      if (std::getenv("RHO") == nullptr && (ratio > 5.0 || ratio < 0.2))
      {
        const double wanted = std::clamp(this->Rho * ratio, 1e-6, 1e3);
        const double change = this->Rho / wanted;
        for (std::int64_t i = 0; i < this->Size; ++i)
        {
          s[i] = z[i] + (s[i] - z[i]) * change;
        }
        this->Rho = wanted;
        this->Factorize();
        lastFactorization = this->Iterations;
        steps.clear();
        residues.clear();
        lastS.clear();
        lastNorm = std::numeric_limits<double>::infinity();
        previous = z;
        continue;
      }
    }
    previous = z;

    const bool accelerate = std::getenv("NOAA") == nullptr;
    if (accelerate)
    {
      const double norm = this->Dot(f, f);
      if (!lastS.empty() && norm > 4.0 * lastNorm)
      {
        // The accelerated step made it worse: back to the plain one.
        s = safeS;
        steps.clear();
        residues.clear();
        lastS.clear();
        lastNorm = std::numeric_limits<double>::infinity();
        continue;
      }
      lastNorm = norm;
      if (!lastS.empty())
      {
        if (static_cast<int>(steps.size()) == Memory)
        {
          std::rotate(steps.begin(), steps.begin() + 1, steps.end());
          std::rotate(residues.begin(), residues.begin() + 1, residues.end());
        }
        else
        {
          steps.emplace_back(this->Size);
          residues.emplace_back(this->Size);
        }
        ParallelFor(this->Size, ValuesAtOnce,
          [&](std::int64_t first, std::int64_t last)
          {
            for (std::int64_t i = first; i < last; ++i)
            {
              steps.back()[i] = s[i] - lastS[i];
              residues.back()[i] = f[i] - lastF[i];
            }
          });
      }
      lastS = s;
      lastF = f;
      safeS.resize(this->Size);
      const auto columns = static_cast<Eigen::Index>(steps.size());
      Eigen::VectorXd coefficient = Eigen::VectorXd::Zero(columns);
      if (columns > 0)
      {
        Eigen::MatrixXd normal(columns, columns);
        Eigen::VectorXd right(columns);
        for (Eigen::Index i = 0; i < columns; ++i)
        {
          for (Eigen::Index j = 0; j <= i; ++j)
          {
            normal(i, j) = normal(j, i) = this->Dot(residues[i], residues[j]);
          }
          right[i] = this->Dot(residues[i], f);
        }
        normal.diagonal() *= 1.0 + 1e-10;
        coefficient = normal.ldlt().solve(right);
        if (!coefficient.allFinite())
        {
          coefficient.setZero();
        }
      }
      ParallelFor(this->Size, ValuesAtOnce,
        [&](std::int64_t first, std::int64_t last)
        {
          for (std::int64_t i = first; i < last; ++i)
          {
            safeS[i] = s[i] + f[i];
            double value = safeS[i];
            for (Eigen::Index k = 0; k < columns; ++k)
            {
              value -= coefficient[k] * (steps[k][i] + residues[k][i]);
            }
            s[i] = value;
          }
        });
    }
    else
    {
      for (std::int64_t i = 0; i < this->Size; ++i)
      {
        s[i] += f[i];
      }
    }
  }
  this->Iterations = std::min(this->Iterations, this->Settings.iterations);
  this->Quality = this->Judge(this->Weights, gradient, true);
  Report(progress, 1.0);
}

void SkinWeightOptimizer::Describe(SkinWeights& result) const
{
  result.converged = this->Converged;
  result.iterations = this->Iterations;
  result.factorizations = this->Factorizations;
  result.polishSteps = this->PolishSteps;
  result.penaltyParameter = this->Rho;
  result.residual = this->Quality.inside;
  result.residualEverywhere = this->Quality.everywhere;
  result.energy = this->Quality.energy;
  result.energyGap =
    this->Quality.energy > 0.0 ? this->Quality.gap / this->Quality.energy : this->Quality.gap;
  std::size_t largest = 0;
  for (const Group& group : this->Groups)
  {
    largest = std::max(largest, group.rows.size());
  }
  result.largestDomainShare = this->System.energy.rows == 0
    ? 1.0
    : static_cast<double>(largest) / static_cast<double>(this->System.energy.rows);
}
}
