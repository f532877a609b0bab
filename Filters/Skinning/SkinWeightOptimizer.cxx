#include "SkinWeightOptimizer.h"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace coronary
{
namespace
{
constexpr std::int64_t ValuesAtOnce = 1 << 15;
constexpr std::int64_t RowsAtOnce = 1 << 11;
constexpr double Relaxation = 1.6;
constexpr int CheckEvery = 10;
constexpr double MinimumRho = 0.02;
constexpr double MaximumRho = 2.0;
constexpr int MostPolishSteps = 10;
// Beyond it one exact step costs more than what the alternating directions took.
constexpr std::int64_t MostUnknowns = 8000;
// What bones that are not allowed somewhere may violate, in tolerances, before they are.
constexpr double Margin = 10.0;
// Diameters around a bone where it may have weight until the weights themselves show where.
constexpr double FirstReach = 0.75;
constexpr int FollowAt = 11;
constexpr int MostChanges = 8;
// Where a new factor costs about as much as the iterations to the end, in tolerances.
constexpr double NearEnd = 4.0;
constexpr double Rounding = 1e-13;
constexpr double Exact = 1e-10; // residual at which nothing is left to polish
}

SkinWeightOptimizer::SkinWeightOptimizer(
  const SkinWeightSystem& system, const SkinWeightSettings& settings)
  : System(system)
  , Settings(settings)
  , Joint(settings.mode == SkinWeightMode::Joint)
  , Reach(settings.neighbourhood)
{
  // Between the diagonal and what smooth weights feel of the energy, which falls with the fourth power
  // of the points across a vessel.
  this->Rho = std::clamp(0.8 / (system.radius * system.radius), MinimumRho, 0.2);
  if (this->Joint && settings.widen && this->Reach > FirstReach)
  {
    this->Reach = FirstReach;
  }
  this->ReachDomains();
  this->MakeGroups();
  this->MakePairs();
}

void SkinWeightOptimizer::Factorize()
{
  ParallelFor(static_cast<std::int64_t>(this->Groups.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t g = first; g < last; ++g)
      {
        Group& group = this->Groups[g];
        if (!group.factor)
        {
          group.factor = std::make_unique<SupernodalFactor<float>>(this->System.energy, group.rows);
          group.factorRho = 0.0;
        }
        if (group.factorRho != this->Rho)
        {
          group.factor->Factorize(this->System.energy, this->Rho);
          group.factorRho = this->Rho;
        }
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
      Values row;
      Values sorted;
      for (std::int64_t r = firstRow; r < lastRow; ++r)
      {
        const std::int64_t first = this->PairOffset[r];
        const std::int64_t last = this->PairOffset[r + 1];
        row.clear();
        sorted.clear();
        double highest = -std::numeric_limits<double>::infinity();
        for (std::int64_t p = first; p < last; ++p)
        {
          row.push_back(s[this->PairIndex[p]]);
          highest = std::max(highest, row.back());
        }
        // What makes the sum 1 is not below the highest minus 1.
        for (const double value : row)
        {
          if (value >= highest - 1.0)
          {
            sorted.push_back(value);
          }
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
          z[this->PairIndex[p]] = std::max(0.0, row[p - first] - threshold);
        }
      }
    });
}

void SkinWeightOptimizer::Solve(
  const Values& s, const Values& z, Values& right, Values& x, bool exact) const
{
  const SparseMatrix& q = this->System.energy;
  ParallelFor(static_cast<std::int64_t>(this->Tasks.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      Values change;
      Values spread;
      std::vector<float> scratch;
      for (std::int64_t t = first; t < last; ++t)
      {
        const Task& task = this->Tasks[t];
        const Group& group = this->Groups[task.group];
        const auto height = static_cast<std::int64_t>(group.rows.size());
        const std::int64_t base = group.base + task.firstColumn * height;
        change.resize(height * task.columns);
        for (std::int64_t i = 0; i < height * task.columns; ++i)
        {
          const std::int64_t v = base + i;
          const double wanted =
            this->Rho * this->System.diagonal[this->RowOfValue[v]] * (2.0 * z[v] - s[v]) -
            this->Linear[v];
          change[i] = wanted - right[v];
          right[v] = wanted;
        }
        if (exact)
        {
          spread.assign(q.rows, 0.0);
          for (std::int64_t c = 0; c < task.columns; ++c)
          {
            const double* column = x.data() + base + c * height;
            for (std::int64_t i = 0; i < height; ++i)
            {
              spread[group.rows[i]] = column[i];
            }
            for (std::int64_t i = 0; i < height; ++i)
            {
              const std::int32_t row = group.rows[i];
              double product = this->Rho * this->System.diagonal[row] * column[i];
              for (std::int64_t a = q.offset[row]; a < q.offset[row + 1]; ++a)
              {
                product += q.value[a] * spread[q.column[a]];
              }
              change[c * height + i] = right[base + c * height + i] - product;
            }
          }
        }
        group.factor->AddSolution(change.data(), x.data() + base, task.columns, scratch);
      }
    });
}

std::vector<double> SkinWeightOptimizer::Dots(
  const std::vector<const std::vector<float>*>& vectors, const std::vector<float>& b)
{
  const auto count = static_cast<std::int64_t>(b.size());
  const std::int64_t parts = (count + ValuesAtOnce - 1) / ValuesAtOnce;
  const auto width = static_cast<std::int64_t>(vectors.size());
  Values sums(parts * width, 0.0);
  ParallelFor(parts, 1,
    [&](std::int64_t firstPart, std::int64_t lastPart)
    {
      for (std::int64_t p = firstPart; p < lastPart; ++p)
      {
        for (std::int64_t k = 0; k < width; ++k)
        {
          const float* a = vectors[k]->data();
          // Several sums, so that the additions need not wait for each other.
          std::array<double, 8> sum{};
          const std::int64_t end = std::min(count, (p + 1) * ValuesAtOnce);
          std::int64_t i = p * ValuesAtOnce;
          for (; i + 8 <= end; i += 8)
          {
            for (int l = 0; l < 8; ++l)
            {
              sum[l] += static_cast<double>(a[i + l]) * b[i + l];
            }
          }
          for (; i < end; ++i)
          {
            sum[0] += static_cast<double>(a[i]) * b[i];
          }
          sums[p * width + k] = std::accumulate(sum.begin(), sum.end(), 0.0);
        }
      }
    });
  std::vector<double> result(width, 0.0);
  for (std::int64_t p = 0; p < parts; ++p)
  {
    for (std::int64_t k = 0; k < width; ++k)
    {
      result[k] += sums[p * width + k];
    }
  }
  return result;
}

double SkinWeightOptimizer::Dot(const Values& a, const Values& b)
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

/**
 * Anderson acceleration of s += f(s), with a way back to the plain step when it made things worse.
 * Source: Walker and Ni, SIAM J Numer Anal 2011;49:1715.
 */
class SkinWeightOptimizer::Acceleration
{
public:
  explicit Acceleration(std::int64_t size)
    : Size(size)
    , Plain(size)
  {
  }

  void Restart()
  {
    this->Columns = 0;
    this->HasLast = false;
    this->LastNorm = std::numeric_limits<double>::infinity();
  }

  void Step(Values& s, const Values& f)
  {
    std::vector<float> residue(f.begin(), f.end());
    const double norm = Dots({ &residue }, residue)[0];
    if (this->HasLast && !(norm <= 4.0 * this->LastNorm))
    {
      s = this->Plain;
      this->Restart();
      return;
    }
    this->LastNorm = norm;
    if (this->HasLast)
    {
      this->AddColumn(s, f);
    }
    else
    {
      this->LastS.resize(this->Size);
      this->LastF.resize(this->Size);
    }
    const auto columns = static_cast<Eigen::Index>(this->Columns);
    Eigen::VectorXd coefficient = Eigen::VectorXd::Zero(columns);
    if (columns > 0)
    {
      const std::vector<double> products = Dots(this->List(), residue);
      const Eigen::VectorXd right = Eigen::Map<const Eigen::VectorXd>(products.data(), columns);
      Eigen::MatrixXd normal = this->Gram.topLeftCorner(columns, columns);
      // Differences that nearly depend on each other must not blow the step up.
      normal.diagonal() *= 1.0 + 1e-10;
      const Eigen::VectorXd solved = normal.ldlt().solve(right);
      coefficient = solved.allFinite() ? solved : coefficient;
    }
    ParallelFor(this->Size, ValuesAtOnce,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t i = first; i < last; ++i)
        {
          this->LastS[i] = s[i];
          this->LastF[i] = f[i];
          s[i] = this->Plain[i] = s[i] + f[i];
        }
        for (Eigen::Index k = 0; k < columns; ++k)
        {
          const double factor = coefficient[k];
          const float* image = this->Images[k].data();
          for (std::int64_t i = first; i < last; ++i)
          {
            s[i] -= factor * image[i];
          }
        }
      });
    this->HasLast = true;
  }

private:
  static constexpr int Memory = 8;

  std::vector<const std::vector<float>*> List() const
  {
    std::vector<const std::vector<float>*> list;
    list.reserve(this->Columns);
    for (int k = 0; k < this->Columns; ++k)
    {
      list.push_back(&this->Residues[k]);
    }
    return list;
  }

  /// The differences to the last step take the place of the oldest ones.
  void AddColumn(const Values& s, const Values& f)
  {
    if (this->Columns == Memory)
    {
      std::rotate(this->Images.begin(), this->Images.begin() + 1, this->Images.end());
      std::rotate(this->Residues.begin(), this->Residues.begin() + 1, this->Residues.end());
      const Eigen::MatrixXd kept = this->Gram.bottomRightCorner(Memory - 1, Memory - 1);
      this->Gram.topLeftCorner(Memory - 1, Memory - 1) = kept;
      --this->Columns;
    }
    const int k = this->Columns++;
    this->Images[k].resize(this->Size);
    this->Residues[k].resize(this->Size);
    ParallelFor(this->Size, ValuesAtOnce,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t i = first; i < last; ++i)
        {
          const double change = f[i] - this->LastF[i];
          this->Images[k][i] = static_cast<float>(s[i] - this->LastS[i] + change);
          this->Residues[k][i] = static_cast<float>(change);
        }
      });
    const std::vector<double> products = Dots(this->List(), this->Residues[k]);
    for (int j = 0; j <= k; ++j)
    {
      this->Gram(j, k) = this->Gram(k, j) = products[j];
    }
  }

  std::int64_t Size;
  int Columns = 0;
  bool HasLast = false;
  std::array<std::vector<float>, Memory> Images;   ///< differences of s + f
  std::array<std::vector<float>, Memory> Residues; ///< differences of f
  Eigen::Matrix<double, Memory, Memory> Gram = Eigen::Matrix<double, Memory, Memory>::Zero();
  Values LastS;
  Values LastF;
  Values Plain; ///< where the last step would have led without acceleration
  double LastNorm = std::numeric_limits<double>::infinity();
};

double SkinWeightOptimizer::Gradients(const Values& z, Values& gradient, bool everywhere,
  std::vector<std::vector<Outside>>& outside) const
{
  const SparseMatrix& q = this->System.energy;
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
  return std::accumulate(energies.begin(), energies.end(), 0.0);
}

void SkinWeightOptimizer::JudgeRows(const Values& z, const Values& gradient, Values& multiplier,
  Values& lowest, Violation& violation) const
{
  const SparseMatrix& q = this->System.energy;
  const std::int64_t parts = (q.rows + RowsAtOnce - 1) / RowsAtOnce;
  std::vector<Violation> partial(parts);
  ParallelFor(parts, 1,
    [&](std::int64_t firstPart, std::int64_t lastPart)
    {
      for (std::int64_t part = firstPart; part < lastPart; ++part)
      {
        for (std::int64_t r = part * RowsAtOnce; r < std::min(q.rows, (part + 1) * RowsAtOnce); ++r)
        {
          double highest = -std::numeric_limits<double>::infinity();
          double minimum = std::numeric_limits<double>::infinity();
          double work = 0.0;
          double worst = 0.0;
          for (std::int64_t p = this->PairOffset[r]; p < this->PairOffset[r + 1]; ++p)
          {
            const std::int64_t v = this->PairIndex[p];
            minimum = std::min(minimum, gradient[v]);
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
            worst = std::max(0.0, 0.5 * (highest - minimum));
            multiplier[r] = 0.5 * (highest + minimum);
            lowest[r] = minimum;
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
}

void SkinWeightOptimizer::JudgeOutside(const std::vector<std::vector<Outside>>& outside,
  const Values& multiplier, Values& lowest, Violation& violation,
  std::vector<Violator>* violators) const
{
  const SparseMatrix& q = this->System.energy;
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
  for (std::size_t bone = 0; bone < outside.size(); ++bone)
  {
    for (const Outside& o : outside[bone])
    {
      ++known[o.row];
      judge(o.row, o.gradient);
      if (violators &&
        (this->Joint ? multiplier[o.row] : 0.0) - o.gradient >
          this->Settings.tolerance * this->System.diagonal[o.row])
      {
        violators->push_back({ o.row, static_cast<std::int32_t>(bone) });
      }
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
}

SkinWeightOptimizer::Violation SkinWeightOptimizer::Judge(
  const Values& z, Values& gradient, bool everywhere, std::vector<Violator>* violators) const
{
  const std::int64_t count = this->System.energy.rows;
  std::vector<std::vector<Outside>> outside(this->System.bones);
  Violation violation;
  violation.energy = this->Gradients(z, gradient, everywhere, outside);
  Values multiplier(count, 0.0);
  Values lowest(count, 0.0);
  this->JudgeRows(z, gradient, multiplier, lowest, violation);
  violation.everywhere = violation.inside;
  if (everywhere)
  {
    this->JudgeOutside(outside, multiplier, lowest, violation, violators);
  }
  return violation;
}

void SkinWeightOptimizer::Balance(
  const Values& x, const Values& z, const Values& previous, Values& s)
{
  Values parts[4];
  for (Values& part : parts)
  {
    part.resize(this->Size);
  }
  ParallelFor(this->Size, ValuesAtOnce,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        const double d = std::sqrt(this->System.diagonal[this->RowOfValue[i]]);
        parts[0][i] = d * (x[i] - z[i]);
        parts[1][i] = d * (z[i] - previous[i]);
        parts[2][i] = d * z[i];
        parts[3][i] = d * (s[i] - z[i]);
      }
    });
  const double primal = this->Dot(parts[0], parts[0]) / this->Dot(parts[2], parts[2]);
  const double dual = this->Dot(parts[1], parts[1]) / this->Dot(parts[3], parts[3]);
  const double ratio = std::sqrt(primal / dual);
  if (!(ratio > 0.0) || !std::isfinite(ratio) || (ratio < 3.0 && ratio > 1.0 / 3.0))
  {
    return;
  }
  const double wanted =
    std::clamp(this->Rho * std::clamp(ratio, 0.1, 10.0), MinimumRho, MaximumRho);
  // A new factor costs as much as several iterations.
  if (std::max(wanted, this->Rho) < 1.5 * std::min(wanted, this->Rho))
  {
    return;
  }
  // The multiplier R (s - z) stays.
  const double change = this->Rho / wanted;
  ParallelFor(this->Size, ValuesAtOnce,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        s[i] = z[i] + (s[i] - z[i]) * change;
      }
    });
  this->Rho = wanted;
  this->Factorize();
}

void SkinWeightOptimizer::Run(const ProgressCallback& progress)
{
  // Begins with the nearest bone's weight 1.
  this->Weights.assign(this->Size, 0.0);
  for (std::int64_t r = 0; r < this->System.energy.rows; ++r)
  {
    for (std::int64_t p = this->PairOffset[r]; p < this->PairOffset[r + 1]; ++p)
    {
      this->Weights[this->PairIndex[p]] = this->PairBone[p] == this->System.nearest[r] ? 1.0 : 0.0;
    }
  }
  Report(progress, 0.02);
  for (double done = 0.02; !this->Iterate(progress, done, 0.95);)
  {
    this->Widen();
    done += 0.2 * (0.95 - done);
  }
  Values gradient(this->Size);
  if (this->Settings.polish)
  {
    this->Polish([&](double done) { return !progress || progress(0.95 + 0.05 * done); });
    this->Converged = this->Converged || this->Quality.inside <= this->Settings.tolerance;
  }
  this->Quality = this->Judge(this->Weights, gradient, true);
  Report(progress, 1.0);
}

bool SkinWeightOptimizer::Iterate(const ProgressCallback& progress, double first, double last)
{
  this->Factorize();
  Values z = this->Weights;
  Values gradient(this->Size);
  this->Judge(z, gradient, false);
  // Where z is optimal, the fixed point. At first nothing is known of the multipliers.
  Values s = z;
  if (this->Iterations > 0)
  {
    for (std::int64_t v = 0; v < this->Size; ++v)
    {
      s[v] -= gradient[v] / (this->Rho * this->System.diagonal[this->RowOfValue[v]]);
    }
  }
  Values x = z;
  Values right(this->Size, 0.0);
  Values previous(this->Size);
  Values f(this->Size);
  Acceleration acceleration(this->Size);
  double reported = first;
  double firstResidual = 0.0;
  double lastResidual = std::numeric_limits<double>::infinity();
  bool slow = false;
  bool exact = true;
  const int begin = this->Iterations;
  for (++this->Iterations;; ++this->Iterations)
  {
    const int step = this->Iterations - begin;
    this->Project(s, z);
    const bool atEnd = this->Iterations >= this->Settings.iterations;
    if (step % CheckEvery == 1 || atEnd)
    {
      const bool widens = this->Settings.widen && this->CanWiden();
      std::vector<Violator> violators;
      const Violation violation = this->Judge(z, gradient, widens, &violators);
      this->Weights = z;
      this->Quality = violation;
      this->Converged = violation.inside <= this->Settings.tolerance;
      const bool lags = widens && !atEnd &&
        violation.everywhere > Margin * this->Settings.tolerance &&
        violation.inside < 0.5 * violation.everywhere;
      if (!lags && (this->Converged || atEnd))
      {
        return true;
      }
      firstResidual = firstResidual == 0.0 ? violation.inside : firstResidual;
      slow = violation.inside > std::max(0.5 * lastResidual, NearEnd * this->Settings.tolerance);
      lastResidual = violation.inside;
      const bool begins = this->Joint && widens && !this->Follows && (lags || step == FollowAt);
      const bool grows = lags && this->Follows && !violators.empty();
      if (lags && (this->Changes >= MostChanges || (!begins && !grows)))
      {
        return false;
      }
      if ((begins && this->Follow(z, violators, lags, s, x)) ||
        (grows && this->Grow(z, violators, s, x)))
      {
        ++this->Changes;
        for (Values* const values : { &gradient, &right, &previous, &f, &z })
        {
          values->assign(this->Size, 0.0);
        }
        acceleration = Acceleration(this->Size);
        slow = false;
        lastResidual = std::numeric_limits<double>::infinity();
        this->Factorize();
        this->Project(s, z);
        this->Weights = z;
      }
      const double done = std::log(firstResidual / violation.inside) /
        std::log(std::max(1.0 + 1e-9, firstResidual / this->Settings.tolerance));
      reported = std::max(reported, first + (last - first) * std::clamp(done, 0.0, 1.0));
      exact = true;
    }
    Report(progress, reported);
    this->Solve(s, z, right, x, exact);
    exact = false;
    if (step % CheckEvery == 0 && slow)
    {
      const double before = this->Rho;
      this->Balance(x, z, previous, s);
      if (this->Rho != before)
      {
        acceleration.Restart();
        previous = z;
        exact = true;
        continue;
      }
    }
    ParallelFor(this->Size, ValuesAtOnce,
      [&](std::int64_t firstValue, std::int64_t lastValue)
      {
        for (std::int64_t i = firstValue; i < lastValue; ++i)
        {
          f[i] = Relaxation * (x[i] - z[i]);
        }
      });
    std::swap(previous, z);
    acceleration.Step(s, f);
  }
}

SkinWeightOptimizer::Values SkinWeightOptimizer::NewtonStep(
  const std::vector<std::int64_t>& unknowns, const std::vector<std::int64_t>& offset,
  const std::vector<std::int64_t>& pivot, const Values& gradient) const
{
  const SparseMatrix& q = this->System.energy;
  const auto count = static_cast<std::int64_t>(unknowns.size());
  const auto boneOfPivot = [&](std::int64_t r)
  { return pivot[r] < 0 ? -1 : static_cast<int>(this->PairBone[pivot[r]]); };
  SparseMatrix hessian;
  hessian.rows = count;
  hessian.offset.assign(1, 0);
  Values right;
  for (std::int64_t r = 0; r < q.rows; ++r)
  {
    const int ownPivot = boneOfPivot(r);
    for (std::int64_t e = offset[r]; e < offset[r + 1]; ++e)
    {
      const int bone = this->PairBone[unknowns[e]];
      for (std::int64_t a = q.offset[r]; a < q.offset[r + 1]; ++a)
      {
        const std::int32_t u = q.column[a];
        const int otherPivot = boneOfPivot(u);
        for (std::int64_t o = offset[u]; o < offset[u + 1]; ++o)
        {
          const int other = this->PairBone[unknowns[o]];
          int factor = bone == other ? 1 : 0;
          if (this->Joint)
          {
            factor += (ownPivot == otherPivot ? 1 : 0) - (bone == otherPivot ? 1 : 0) -
              (ownPivot == other ? 1 : 0);
          }
          if (factor != 0)
          {
            hessian.column.push_back(static_cast<std::int32_t>(o));
            hessian.value.push_back(factor * q.value[a]);
          }
        }
      }
      hessian.offset.push_back(static_cast<std::int64_t>(hessian.column.size()));
      right.push_back((this->Joint ? gradient[this->PairIndex[pivot[r]]] : 0.0) -
        gradient[this->PairIndex[unknowns[e]]]);
    }
  }
  std::vector<std::int32_t> all(count);
  std::iota(all.begin(), all.end(), 0);
  Values change(count);
  {
    SupernodalFactor<double> factor(hessian, all, EliminationOrder::Given);
    factor.Factorize(hessian, 0.0);
    std::vector<double> scratch;
    factor.AddSolution(right.data(), change.data(), 1, scratch);
  }
  return change;
}

void SkinWeightOptimizer::Polish(const ProgressCallback& progress)
{
  enum Status : char
  {
    AtZero,
    Free,
    AtOne
  };
  const SparseMatrix& q = this->System.energy;
  Values z = this->Weights;
  std::vector<char> status(this->Size);
  for (std::int64_t v = 0; v < this->Size; ++v)
  {
    status[v] = z[v] <= 0.0 ? AtZero : (!this->Joint && z[v] >= 1.0 ? AtOne : Free);
  }
  Values gradient(this->Size);
  this->Judge(z, gradient, false);
  // In Joint mode the greatest weight of a row follows from the others.
  std::vector<std::int64_t> pivot(q.rows, -1); // into the pairs
  const auto choosePivots = [&]
  {
    for (std::int64_t r = 0; this->Joint && r < q.rows; ++r)
    {
      pivot[r] = this->PairOffset[r];
      for (std::int64_t p = this->PairOffset[r]; p < this->PairOffset[r + 1]; ++p)
      {
        pivot[r] = z[this->PairIndex[p]] > z[this->PairIndex[pivot[r]]] ? p : pivot[r];
      }
    }
  };

  for (int step = 0; step < MostPolishSteps; ++step)
  {
    Report(progress, static_cast<double>(step) / MostPolishSteps);
    choosePivots();
    std::vector<std::int64_t> unknowns; // pairs
    std::vector<std::int64_t> offset(q.rows + 1, 0);
    for (std::int64_t r = 0; r < q.rows; ++r)
    {
      for (std::int64_t p = this->PairOffset[r]; p < this->PairOffset[r + 1]; ++p)
      {
        if (status[this->PairIndex[p]] == Free && p != pivot[r])
        {
          unknowns.push_back(p);
        }
      }
      offset[r + 1] = static_cast<std::int64_t>(unknowns.size());
    }
    const auto count = static_cast<std::int64_t>(unknowns.size());
    if (count == 0 || count > MostUnknowns)
    {
      return;
    }
    const Values change = this->NewtonStep(unknowns, offset, pivot, gradient);
    ++this->PolishSteps;
    // What leaves its bounds is held there in the next step.
    bool same = true;
    for (std::int64_t r = 0; r < q.rows; ++r)
    {
      double rest = 0.0;
      for (std::int64_t e = offset[r]; e < offset[r + 1]; ++e)
      {
        const std::int64_t v = this->PairIndex[unknowns[e]];
        const double value = z[v] + change[e];
        z[v] = std::clamp(value, 0.0, 1.0);
        if (value < -Rounding || (!this->Joint && value > 1.0 + Rounding))
        {
          status[v] = value < 0.0 ? AtZero : AtOne;
          same = false;
        }
      }
      if (this->Joint)
      {
        // Clipped weights may sum to more than 1.
        const std::int64_t last = this->PairIndex[pivot[r]];
        for (std::int64_t p = this->PairOffset[r]; p < this->PairOffset[r + 1]; ++p)
        {
          rest += p == pivot[r] ? 0.0 : z[this->PairIndex[p]];
        }
        if (rest > 1.0)
        {
          for (std::int64_t p = this->PairOffset[r]; p < this->PairOffset[r + 1]; ++p)
          {
            z[this->PairIndex[p]] /= rest;
          }
          rest = 1.0;
          same = false;
        }
        z[last] = 1.0 - rest;
      }
    }
    const Violation violation = this->Judge(z, gradient, false);
    if (violation.inside < this->Quality.inside)
    {
      this->Quality = violation;
      this->Weights = z;
    }
    for (std::int64_t r = 0; r < q.rows; ++r)
    {
      const double multiplier = this->Joint ? gradient[this->PairIndex[pivot[r]]] : 0.0;
      const double slack = 1e-9 * this->System.diagonal[r];
      for (std::int64_t p = this->PairOffset[r]; p < this->PairOffset[r + 1]; ++p)
      {
        const std::int64_t v = this->PairIndex[p];
        if ((status[v] == AtZero && gradient[v] < multiplier - slack) ||
          (status[v] == AtOne && gradient[v] > slack))
        {
          status[v] = Free;
          same = false;
        }
      }
    }
    if (same || this->Quality.inside <= Exact)
    {
      return;
    }
  }
}

void SkinWeightOptimizer::Describe(SkinWeights& result) const
{
  result.converged = this->Converged;
  result.iterations = this->Iterations;
  result.factorizations = this->Factorizations;
  result.polishSteps = this->PolishSteps;
  result.neighbourhood = this->Reach;
  result.penaltyParameter = this->Rho;
  result.residual = this->Quality.inside;
  result.residualEverywhere = this->Quality.everywhere;
  result.energy = this->Quality.energy;
  result.energyGap =
    this->Quality.energy > 0.0 ? this->Quality.gap / this->Quality.energy : this->Quality.gap;
  std::size_t maximum = 0;
  for (const Group& group : this->Groups)
  {
    maximum = std::max(maximum, group.rows.size());
  }
  result.maximumDomainShare = this->System.energy.rows == 0
    ? 1.0
    : static_cast<double>(maximum) / static_cast<double>(this->System.energy.rows);
}
}
