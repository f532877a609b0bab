// The sparse Cholesky factor against a dense one: both precisions, every set of inner loops, kinds of matrices.

#include "CounterRandom.h"
#include "KernelChoice.h"
#include "SupernodalFactor.h"
#include "SupernodalKernels.h"

#include <Eigen/Cholesky>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>

namespace UnitTestSupernodalFactor
{
using namespace coronary;

namespace
{
SparseMatrix SparseOf(const Eigen::MatrixXd& dense)
{
  SparseMatrix sparse;
  sparse.rows = dense.rows();
  sparse.offset.push_back(0);
  for (Eigen::Index i = 0; i < dense.rows(); ++i)
  {
    for (Eigen::Index j = 0; j < dense.cols(); ++j)
    {
      if (dense(i, j) != 0.0)
      {
        sparse.column.push_back(static_cast<std::int32_t>(j));
        sparse.value.push_back(dense(i, j));
      }
    }
    sparse.offset.push_back(static_cast<std::int64_t>(sparse.column.size()));
  }
  return sparse;
}

/// A graph's Laplacian with random weights, plus a share of its diagonal.
Eigen::MatrixXd MatrixOf(
  Eigen::Index size, const std::function<void(const std::function<void(int, int)>&)>& edges)
{
  RandomStream random(7);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
  edges(
    [&](int i, int j)
    {
      const double weight = random.Uniform(0.2, 3.0);
      dense(i, j) -= weight;
      dense(j, i) -= weight;
      dense(i, i) += weight;
      dense(j, j) += weight;
    });
  // Rows of very different size: the factor scales them.
  Eigen::VectorXd scale(size);
  for (Eigen::Index i = 0; i < size; ++i)
  {
    scale[i] = std::pow(10.0, random.Uniform(-2.0, 2.0));
  }
  dense.diagonal() = 1.1 * dense.diagonal() + Eigen::VectorXd::Constant(size, 0.05);
  return scale.asDiagonal() * dense * scale.asDiagonal();
}

Eigen::MatrixXd Grid(int n, bool squared)
{
  const auto at = [n](int i, int j, int k) { return i + n * (j + n * k); };
  const Eigen::MatrixXd plain = MatrixOf(n * n * n,
    [&](const auto& edge)
    {
      for (int k = 0; k < n; ++k)
      {
        for (int j = 0; j < n; ++j)
        {
          for (int i = 0; i < n; ++i)
          {
            if (i > 0)
            {
              edge(at(i - 1, j, k), at(i, j, k));
            }
            if (j > 0)
            {
              edge(at(i, j - 1, k), at(i, j, k));
            }
            if (k > 0)
            {
              edge(at(i, j, k - 1), at(i, j, k));
            }
          }
        }
      }
    });
  if (!squared)
  {
    return plain;
  }
  // The pattern of a bi-Laplacian.
  const Eigen::VectorXd size = plain.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = size.asDiagonal() * plain * size.asDiagonal();
  Eigen::MatrixXd product = scaled * scaled;
  product.diagonal() *= 1.05;
  return product;
}

std::vector<std::pair<const char*, Eigen::MatrixXd>> Matrices()
{
  const auto none = [](const auto&) {};
  return {
    { "one row", MatrixOf(1, none) },
    { "diagonal", MatrixOf(37, none) },
    { "chain",
      MatrixOf(100,
        [](const auto& edge)
        {
          for (int i = 1; i < 100; ++i)
            edge(i - 1, i);
        }) },
    { "star",
      MatrixOf(90,
        [](const auto& edge)
        {
          for (int i = 1; i < 90; ++i)
            edge(0, i);
        }) },
    { "star, its middle last",
      MatrixOf(90,
        [](const auto& edge)
        {
          for (int i = 0; i < 89; ++i)
            edge(89, i);
        }) },
    { "tree",
      MatrixOf(127,
        [](const auto& edge)
        {
          for (int i = 1; i < 127; ++i)
            edge((i - 1) / 2, i);
        }) },
    { "dense",
      MatrixOf(61,
        [](const auto& edge)
        {
          for (int i = 0; i < 61; ++i)
          {
            for (int j = 0; j < i; ++j)
            {
              edge(i, j);
            }
          }
        }) },
    { "random",
      MatrixOf(150,
        [](const auto& edge)
        {
          RandomStream random(3);
          for (int n = 0; n < 400; ++n)
          {
            const int i = static_cast<int>(random.Uniform(0.0, 149.99));
            const int j = static_cast<int>(random.Uniform(0.0, 149.99));
            if (i != j)
            {
              edge(i, j);
            }
          }
        }) },
    { "grid", Grid(8, false) },
    { "grid, bi-Laplacian", Grid(7, true) },
  };
}

/// Entries of the exact factor in an order, by elimination of a graph.
std::int64_t ExactEntries(const Eigen::MatrixXd& dense, const std::vector<std::int32_t>& order)
{
  const auto size = static_cast<int>(order.size());
  std::vector<std::set<int>> below(size);
  for (int i = 0; i < size; ++i)
  {
    for (int j = 0; j < i; ++j)
    {
      if (dense(order[i], order[j]) != 0.0)
      {
        below[j].insert(i);
      }
    }
  }
  std::int64_t entries = 0;
  for (int j = 0; j < size; ++j)
  {
    entries += 1 + static_cast<std::int64_t>(below[j].size());
    if (!below[j].empty())
    {
      const int parent = *below[j].begin();
      below[parent].insert(std::next(below[j].begin()), below[j].end());
    }
  }
  return entries;
}

std::int64_t StoredEntries(const SupernodalPattern& pattern)
{
  std::int64_t entries = 0;
  for (std::int32_t s = 0; s < pattern.Supernodes(); ++s)
  {
    const std::int64_t width = pattern.Width(s);
    entries += width * (width + 1) / 2 + width * (pattern.Height(s) - width);
  }
  return entries;
}

template <typename Real>
void ExpectSolutions(double tolerance)
{
  for (const auto& [name, whole] : Matrices())
  {
    SCOPED_TRACE(name);
    const SparseMatrix sparse = SparseOf(whole);
    for (const EliminationOrder order : { EliminationOrder::FillReducing, EliminationOrder::Given })
    {
      for (const bool all : { true, false })
      {
        // All rows, or a part of them.
        std::vector<std::int32_t> rows;
        for (std::int32_t i = 0; i < whole.rows(); ++i)
        {
          if (all || i % 3 != 1)
          {
            rows.push_back(i);
          }
        }
        const auto size = static_cast<Eigen::Index>(rows.size());
        Eigen::MatrixXd dense(size, size);
        for (Eigen::Index i = 0; i < size; ++i)
        {
          for (Eigen::Index j = 0; j < size; ++j)
          {
            dense(i, j) = whole(rows[i], rows[j]);
          }
        }
        const double shift = all ? 0.0 : 0.3;
        dense.diagonal() *= 1.0 + shift;
        SupernodalFactor<Real> factor(sparse, rows, order);
        factor.Factorize(sparse, shift);
        EXPECT_GE(factor.Entries(), size);
        std::vector<Real> scratch;
        for (const int columns : { 1, 3, 8 })
        {
          const Eigen::MatrixXd right = Eigen::MatrixXd::Random(size, columns);
          Eigen::MatrixXd solution = Eigen::MatrixXd::Constant(size, columns, 2.0);
          factor.AddSolution(right.data(), solution.data(), columns, scratch);
          solution.array() -= 2.0;
          const Eigen::MatrixXd expected = dense.llt().solve(right);
          // In the scaling of the factor, as the rows differ.
          const Eigen::VectorXd scale = dense.diagonal().cwiseSqrt();
          const double error = (scale.asDiagonal() * (solution - expected)).norm();
          // What was there is added to: its rounding.
          const double most = tolerance * (scale.asDiagonal() * expected).norm() +
            1e-15 * 2.0 * scale.norm() * std::sqrt(columns);
          EXPECT_LT(error, most) << columns;
        }
      }
    }
  }
}
}

TEST(SupernodalPattern, IsAnOrderAndHoldsTheFactor)
{
  for (const auto& [name, dense] : Matrices())
  {
    SCOPED_TRACE(name);
    const SparseMatrix sparse = SparseOf(dense);
    std::vector<std::int32_t> rows(dense.rows());
    std::iota(rows.begin(), rows.end(), 0);
    for (const EliminationOrder order : { EliminationOrder::FillReducing, EliminationOrder::Given })
    {
      const SupernodalPattern pattern = FindSupernodes(sparse, rows, order);
      std::vector<std::int32_t> sorted = pattern.order;
      std::sort(sorted.begin(), sorted.end());
      ASSERT_EQ(sorted, rows);
      ASSERT_EQ(pattern.first.front(), 0);
      ASSERT_EQ(pattern.first.back(), dense.rows());
      for (std::int32_t s = 0; s < pattern.Supernodes(); ++s)
      {
        const std::int32_t* list = pattern.RowsOf(s);
        ASSERT_TRUE(std::is_sorted(list, list + pattern.Height(s)));
        for (std::int64_t i = 0; i < pattern.Width(s); ++i)
        {
          ASSERT_EQ(list[i], pattern.first[s] + i);
        }
      }
      // The postorder changes no entry, and merged columns store few zeros (in tiny factors more).
      const std::int64_t exact = ExactEntries(dense, pattern.order);
      if (order == EliminationOrder::Given)
      {
        EXPECT_EQ(exact, ExactEntries(dense, rows));
      }
      EXPECT_GE(StoredEntries(pattern), exact);
      const bool large = std::string(name) == "grid, bi-Laplacian" || std::string(name) == "dense";
      EXPECT_LT(StoredEntries(pattern), (large ? 1.3 : 5.0) * static_cast<double>(exact) + 10.0);
    }
    EXPECT_EQ(ExactEntries(dense, FillReducingOrder(sparse)),
      ExactEntries(dense, FindSupernodes(sparse, rows).order));
  }
  // It does reduce the fill: a star with its middle first has all entries, one with its middle last none.
  const Eigen::MatrixXd star = Matrices()[3].second;
  EXPECT_EQ(ExactEntries(star, FillReducingOrder(SparseOf(star))), 2 * 90 - 1);
  // Nothing at all.
  EXPECT_EQ(FindSupernodes(SparseMatrix{ 0, { 0 }, {}, {} }, {}).Supernodes(), 0);
}

TEST(SupernodalFactor, SolvesInBothPrecisionsWithEveryLoop)
{
  for (const Instructions instructions : { Instructions::Baseline, Instructions::Avx2 })
  {
    SCOPED_TRACE(instructions == Instructions::Avx2 ? "AVX2" : "baseline");
    if (SupernodalKernelChoice().Select(instructions))
    {
      ExpectSolutions<double>(1e-12);
      ExpectSolutions<float>(2e-4);
    }
  }
}

/// As the loops want a finished panel: SupernodalRows rows at a time.
template <typename Matrix>
std::vector<typename Matrix::Scalar> InRowBlocks(const Matrix& panel, Eigen::Index width)
{
  std::vector<typename Matrix::Scalar> packed;
  for (Eigen::Index i = 0; i < panel.rows();)
  {
    const Eigen::Index end = i < width ? width : panel.rows();
    const Eigen::Index rows = std::min<Eigen::Index>(SupernodalRows, end - i);
    for (Eigen::Index k = 0; k < width; ++k)
    {
      for (Eigen::Index r = 0; r < rows; ++r)
      {
        packed.push_back(panel(i + r, k));
      }
    }
    i += rows;
  }
  return packed;
}

TEST(SupernodalFactor, LoopsAgreeWithPlainOnes)
{
  for (const SupernodalKernels* kernels : {
         &SupernodalKernelsBaseline,
#if defined(__x86_64__)
           ProcessorHas(Instructions::Avx2) ? &SupernodalKernelsAvx2 : nullptr
#endif
       })
  {
    if (kernels == nullptr)
    {
      continue;
    }
    const auto check = [](const auto& loops, auto zero, double tolerance)
    {
      using Real = decltype(zero);
      using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
      using Lanes = Eigen::Matrix<Real, Eigen::Dynamic, SupernodalColumns, Eigen::RowMajor>;
      for (const int width : { 1, 3, 4, 7, 8, 9, 16, 21 })
      {
        for (const int height : { width, width + 1, width + 7, width + 8, width + 25, width + 67 })
        {
          SCOPED_TRACE(std::to_string(height) + " x " + std::to_string(width));
          const Matrix a = Matrix::Random(height, width);
          const Matrix b = Matrix::Random(width, width);
          Matrix c = Matrix::Random(height, width);
          const Matrix difference = c - a * b.transpose();
          loops.subtractProduct(
            a.data(), height, b.data(), width, height, width, width, c.data(), height);
          EXPECT_LT((c - difference).norm(), tolerance * difference.norm());

          Matrix panel = Matrix::Random(height, width);
          const Matrix square = Matrix::Random(width, width);
          panel.topRows(width) =
            square * square.transpose() + Real(width) * Matrix::Identity(width, width);
          const Matrix top = panel.topRows(width);
          const Matrix low = top.llt().matrixL();
          Matrix lower(height, width);
          lower.topRows(width) = low;
          // Eigen's solves with and products of empty matrices take references through null.
          if (height > width)
          {
            const Matrix rest = panel.bottomRows(height - width);
            lower.bottomRows(height - width) =
              low.template triangularView<Eigen::Lower>().solve(rest.transpose()).transpose();
          }
          ASSERT_TRUE(loops.factorPanel(panel.data(), height, width));
          for (int j = 0; j < width; ++j)
          {
            EXPECT_NEAR(panel(j, j) * lower(j, j), 1.0, tolerance);
            for (int i = j + 1; i < height; ++i)
            {
              EXPECT_NEAR(panel(i, j), lower(i, j), tolerance * lower.norm());
            }
          }
          const std::vector<Real> packed = InRowBlocks(panel, width);
          // The panel's rows, with others in between; only those below the triangle need not follow each other.
          std::vector<std::int32_t> list(height);
          for (int i = 0; i < height; ++i)
          {
            list[i] = i < width ? 2 + i : 2 * i + 5;
          }
          const Lanes before = Lanes::Random(2 * height + 9, SupernodalColumns);
          const auto below = [&](const Lanes& all)
          {
            Matrix rows(height - width, SupernodalColumns);
            for (int i = width; i < height; ++i)
            {
              rows.row(i - width) = all.row(list[i]);
            }
            return rows;
          };
          Lanes after = before;
          loops.forward(packed.data(), height, width, list.data(), after.data());
          const Matrix right = before.middleRows(2, width);
          const Matrix solved = low.template triangularView<Eigen::Lower>().solve(right);
          EXPECT_LT((after.middleRows(2, width) - solved).norm(), tolerance * solved.norm());
          Matrix minuend = right;
          if (height > width)
          {
            const Matrix under = below(before) - lower.bottomRows(height - width) * solved;
            EXPECT_LE((below(after) - under).norm(), tolerance * under.norm());
            minuend -= lower.bottomRows(height - width).transpose() * below(before);
          }
          const auto othersStay = [&](bool belowMoves)
          {
            for (int i = 0; i < before.rows(); ++i)
            {
              const auto place = std::find(list.begin(), list.end(), i);
              if (place == list.end() || (!belowMoves && place - list.begin() >= width))
              {
                EXPECT_EQ(after.row(i), before.row(i)) << i;
              }
            }
          };
          othersStay(true);
          after = before;
          loops.backward(packed.data(), height, width, list.data(), after.data());
          const Matrix back =
            low.transpose().template triangularView<Eigen::Upper>().solve(minuend);
          EXPECT_LT((after.middleRows(2, width) - back).norm(), tolerance * back.norm());
          othersStay(false);
        }
      }
      Matrix indefinite = Matrix::Identity(12, 12);
      indefinite(9, 9) = Real(-1);
      EXPECT_FALSE(loops.factorPanel(indefinite.data(), 12, 12));
      indefinite(9, 9) = std::numeric_limits<Real>::quiet_NaN();
      EXPECT_FALSE(loops.factorPanel(indefinite.data(), 12, 12));
    };
    check(kernels->single, 0.0F, 1e-4);
    check(kernels->twice, 0.0, 1e-12);
  }
}

TEST(SupernodalFactor, IsTheSameOnEveryRunAndRefusesWhatIsNotDefinite)
{
  SupernodalKernelChoice().Select(Instructions::Widest);
  Eigen::MatrixXd dense = Grid(6, true);
  std::vector<std::int32_t> rows(dense.rows());
  std::iota(rows.begin(), rows.end(), 0);
  const Eigen::VectorXd right = Eigen::VectorXd::Random(dense.rows());
  Eigen::VectorXd first;
  for (int time = 0; time < 3; ++time)
  {
    const SparseMatrix sparse = SparseOf(dense);
    SupernodalFactor<float> factor(sparse, rows);
    factor.Factorize(sparse, 0.1);
    factor.Factorize(sparse, 0.02); // a second time, with another shift
    Eigen::VectorXd solution = Eigen::VectorXd::Zero(dense.rows());
    std::vector<float> scratch;
    factor.AddSolution(right.data(), solution.data(), 1, scratch);
    first = time == 0 ? solution : first;
    EXPECT_EQ(solution, first);
  }
  dense(20, 20) = 1e-9 * dense(20, 20);
  const SparseMatrix sparse = SparseOf(dense);
  SupernodalFactor<double> factor(sparse, rows);
  EXPECT_THROW(factor.Factorize(sparse, 0.0), std::runtime_error);
  dense(20, 20) = -1.0;
  EXPECT_THROW(factor.Factorize(SparseOf(dense), 0.0), std::runtime_error);
}
}
