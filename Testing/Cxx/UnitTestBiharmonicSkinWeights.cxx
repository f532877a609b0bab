// Skin weights: against a dense interior-point method, closed forms, symmetry, invariance, bad input.

#include "BiharmonicSkinWeights.h"
#include "LibiglReferenceWeights.h"
#include "TetrahedronTestMeshes.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <stdexcept>

namespace UnitTestBiharmonicSkinWeights
{
using namespace coronary;

namespace
{
SkinWeightSettings Settings(SkinWeightMode mode, double neighbourhood = 0.0)
{
  SkinWeightSettings settings;
  settings.mode = mode;
  settings.neighbourhood = neighbourhood;
  return settings;
}

Eigen::MatrixXd Dense(const SkinWeights& weights)
{
  const auto points = static_cast<Eigen::Index>(weights.offset.size()) - 1;
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(points, weights.bones);
  for (Eigen::Index i = 0; i < points; ++i)
  {
    for (std::int64_t e = weights.offset[i]; e < weights.offset[i + 1]; ++e)
    {
      dense(i, weights.bone[e]) = weights.weight[e];
    }
  }
  return dense;
}

/// The bi-Laplacian by another road: gradients from the inverse of each tetrahedron's matrix.
Eigen::MatrixXd DenseBilaplacian(const SkinWeightInput& input)
{
  const auto n = static_cast<Eigen::Index>(input.points.size());
  Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(n);
  for (const auto& t : input.tetrahedra)
  {
    Eigen::Matrix4d m;
    for (int a = 0; a < 4; ++a)
    {
      m.row(a) << 1.0, input.points[t[a]].transpose();
    }
    const double volume = std::abs(m.determinant()) / 6.0;
    const Eigen::Matrix4d inverse = m.inverse();
    for (int a = 0; a < 4; ++a)
    {
      mass[t[a]] += volume / 4.0;
      for (int b = 0; b < 4; ++b)
      {
        stiffness(t[a], t[b]) += volume * inverse.col(a).tail<3>().dot(inverse.col(b).tail<3>());
      }
    }
  }
  return stiffness * mass.cwiseInverse().asDiagonal() * stiffness;
}

struct FixedPoints
{
  std::vector<Eigen::Index> free;
  Eigen::MatrixXd values; ///< points x bones, of the fixed points
};

/// Points on bones, in a way of our own.
FixedPoints Constraints(const SkinWeightInput& input)
{
  FixedPoints fixed;
  fixed.values = Eigen::MatrixXd::Zero(
    static_cast<Eigen::Index>(input.points.size()), static_cast<Eigen::Index>(input.bones.size()));
  for (std::size_t i = 0; i < input.points.size(); ++i)
  {
    const auto row = static_cast<Eigen::Index>(i);
    for (std::size_t b = 0; b < input.bones.size(); ++b)
    {
      if (DistanceToSegment(input.points[i], input.joints[input.bones[b].first],
            input.joints[input.bones[b].second]) < 1e-9)
      {
        fixed.values(row, static_cast<Eigen::Index>(b)) = 1.0;
      }
    }
    const double sum = fixed.values.row(row).sum();
    if (sum > 0.0)
    {
      fixed.values.row(row) /= sum;
    }
    else
    {
      fixed.free.push_back(row);
    }
  }
  return fixed;
}

/**
 * min 1/2 x'Hx + c'x with A x = b and x >= 0, by a primal-dual interior-point method (Mehrotra's
 * step length, fixed centring): nothing in common with what is tested.
 */
Eigen::VectorXd InteriorPoint(const Eigen::MatrixXd& h, const Eigen::VectorXd& c,
  const Eigen::MatrixXd& a, const Eigen::VectorXd& b)
{
  const Eigen::Index n = c.size();
  const Eigen::Index m = b.size();
  const double scale = h.diagonal().mean();
  Eigen::VectorXd x = Eigen::VectorXd::Constant(n, 0.3);
  Eigen::VectorXd s = Eigen::VectorXd::Constant(n, scale);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(m);
  for (int iteration = 0; iteration < 100; ++iteration)
  {
    const double mu = x.dot(s) / static_cast<double>(n);
    const Eigen::VectorXd dual = h * x + c - a.transpose() * y - s;
    const Eigen::VectorXd primal = a * x - b;
    if (mu < 1e-13 * scale && primal.norm() < 1e-11 && dual.norm() < 1e-11 * scale)
    {
      break;
    }
    const Eigen::VectorXd centre = x.cwiseProduct(s).array() - 0.1 * mu;
    Eigen::MatrixXd kkt = Eigen::MatrixXd::Zero(n + m, n + m);
    kkt.topLeftCorner(n, n) = h;
    kkt.topLeftCorner(n, n).diagonal() += s.cwiseQuotient(x);
    kkt.topRightCorner(n, m) = -a.transpose();
    kkt.bottomLeftCorner(m, n) = a;
    Eigen::VectorXd right(n + m);
    right << -dual - centre.cwiseQuotient(x), -primal;
    const Eigen::VectorXd step = kkt.partialPivLu().solve(right);
    const Eigen::VectorXd dx = step.head(n);
    const Eigen::VectorXd ds = -(centre + s.cwiseProduct(dx)).cwiseQuotient(x);
    double length = 1.0;
    for (Eigen::Index i = 0; i < n; ++i)
    {
      length = dx[i] < 0.0 ? std::min(length, -0.99 * x[i] / dx[i]) : length;
      length = ds[i] < 0.0 ? std::min(length, -0.99 * s[i] / ds[i]) : length;
    }
    x += length * dx;
    s += length * ds;
    y += length * step.tail(m);
  }
  return x;
}

double Energy(const Eigen::MatrixXd& q, const Eigen::MatrixXd& weights)
{
  return 0.5 * (weights.transpose() * q * weights).trace();
}

/// Eigen 5 has `all` elsewhere than Eigen 3.
template <typename Rows>
Eigen::MatrixXd RowsOf(const Eigen::MatrixXd& matrix, const Rows& rows)
{
  return matrix(rows, Eigen::seqN(0, matrix.cols()));
}

/// All bones at once, sums 1: the reference of Joint.
Eigen::MatrixXd JointReference(const SkinWeightInput& input, const Eigen::MatrixXd& q)
{
  const FixedPoints fixed = Constraints(input);
  const auto n = static_cast<Eigen::Index>(fixed.free.size());
  const Eigen::Index bones = fixed.values.cols();
  const Eigen::MatrixXd inner = q(fixed.free, fixed.free);
  const Eigen::MatrixXd outer = RowsOf(q, fixed.free) * fixed.values;
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(n * bones, n * bones);
  Eigen::VectorXd c(n * bones);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n * bones);
  for (Eigen::Index b = 0; b < bones; ++b)
  {
    h.block(b * n, b * n, n, n) = inner;
    c.segment(b * n, n) = outer.col(b);
    a.block(0, b * n, n, n).setIdentity();
  }
  const Eigen::VectorXd x = InteriorPoint(h, c, a, Eigen::VectorXd::Ones(n));
  Eigen::MatrixXd weights = fixed.values;
  for (Eigen::Index b = 0; b < bones; ++b)
  {
    weights(fixed.free, b) = x.segment(b * n, n);
  }
  return weights;
}

/// Each bone alone, with 1 - w >= 0 as slacks; not normalised.
Eigen::MatrixXd IndependentReference(const SkinWeightInput& input, const Eigen::MatrixXd& q)
{
  const FixedPoints fixed = Constraints(input);
  const auto n = static_cast<Eigen::Index>(fixed.free.size());
  Eigen::MatrixXd weights = fixed.values;
  const Eigen::MatrixXd outer = RowsOf(q, fixed.free) * fixed.values;
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  h.topLeftCorner(n, n) = q(fixed.free, fixed.free);
  Eigen::MatrixXd a(n, 2 * n);
  a << Eigen::MatrixXd::Identity(n, n), Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index b = 0; b < weights.cols(); ++b)
  {
    Eigen::VectorXd c = Eigen::VectorXd::Zero(2 * n);
    c.head(n) = outer.col(b);
    weights(fixed.free, b) = InteriorPoint(h, c, a, Eigen::VectorXd::Ones(n)).head(n);
  }
  return weights;
}

/// A Y of square tubes with four bones: 120 points, with bounds that hold.
SkinWeightInput SmallY()
{
  return MeshOfComb(1, 2, 3, 1, 0.7);
}

void ExpectWeights(const SkinWeights& weights, double sumTolerance = 1e-9)
{
  for (std::size_t i = 0; i + 1 < weights.offset.size(); ++i)
  {
    double sum = 0.0;
    for (std::int64_t e = weights.offset[i]; e < weights.offset[i + 1]; ++e)
    {
      ASSERT_GE(weights.weight[e], 0.0) << "point " << i;
      ASSERT_LE(weights.weight[e], 1.0 + 1e-12) << "point " << i;
      sum += weights.weight[e];
    }
    ASSERT_NEAR(sum, 1.0, sumTolerance) << "point " << i;
  }
}

std::string Complaint(const SkinWeightInput& input, const SkinWeightSettings& settings = {})
{
  try
  {
    ComputeSkinWeights(input, settings);
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "";
}

bool Contains(const std::string& text, const std::string& part)
{
  return text.find(part) != std::string::npos;
}
}

TEST(BiharmonicSkinWeights, JointAgreesWithInteriorPoint)
{
  const SkinWeightInput input = SmallY();
  const Eigen::MatrixXd q = DenseBilaplacian(input);
  const Eigen::MatrixXd reference = JointReference(input, q);
  for (const bool polish : { false, true })
  {
    SkinWeightSettings settings = Settings(SkinWeightMode::Joint);
    settings.polish = polish;
    const SkinWeights weights = ComputeSkinWeights(input, settings);
    EXPECT_TRUE(weights.converged);
    EXPECT_LE(weights.residual, polish ? 1e-9 : 1e-6);
    EXPECT_LE(weights.residualEverywhere, polish ? 1e-9 : 1e-6);
    EXPECT_LE(weights.energyGap, polish ? 1e-6 : 1e-3);
    EXPECT_GE(weights.energyGap, -1e-9);
    ExpectWeights(weights);
    const Eigen::MatrixXd mine = Dense(weights);
    EXPECT_NEAR(Energy(q, mine) / Energy(q, reference), 1.0, polish ? 1e-8 : 1e-6);
    EXPECT_NEAR(weights.energy / Energy(q, reference), 1.0, polish ? 1e-8 : 1e-6);
    EXPECT_LT((mine - reference).cwiseAbs().maxCoeff(), polish ? 1e-5 : 1e-4);
  }
  // The case is worth the name: bounds hold, and matter.
  EXPECT_GT((reference.array() < 1e-6).count(), reference.size() / 4);
  const SkinWeights unbounded = ComputeSkinWeights(input, Settings(SkinWeightMode::Unbounded));
  EXPECT_LT(Dense(unbounded).minCoeff(), -0.01);
}

TEST(BiharmonicSkinWeights, IndependentAgreesWithInteriorPoint)
{
  const SkinWeightInput input = SmallY();
  const Eigen::MatrixXd q = DenseBilaplacian(input);
  const Eigen::MatrixXd reference = IndependentReference(input, q);
  const SkinWeights weights = ComputeSkinWeights(input, Settings(SkinWeightMode::Independent));
  EXPECT_TRUE(weights.converged);
  EXPECT_NEAR(weights.energy / Energy(q, reference), 1.0, 1e-8);
  const Eigen::VectorXd sums = reference.rowwise().sum();
  EXPECT_NEAR(weights.maximumSum, std::max(1.0, sums.maxCoeff()), 1e-5);
  EXPECT_NEAR(weights.minimumSum, std::min(1.0, sums.minCoeff()), 1e-5);
  EXPECT_GT(weights.maximumSum, 1.001);
  const Eigen::MatrixXd normalized = sums.cwiseInverse().asDiagonal() * reference;
  EXPECT_LT((Dense(weights) - normalized).cwiseAbs().maxCoeff(), 1e-5);
  ExpectWeights(weights);
}

TEST(BiharmonicSkinWeights, WithoutBoundsAgreesWithDenseSolve)
{
  const SkinWeightInput input = SmallY();
  const Eigen::MatrixXd q = DenseBilaplacian(input);
  const FixedPoints fixed = Constraints(input);
  Eigen::MatrixXd reference = fixed.values;
  reference(fixed.free, Eigen::seqN(0, reference.cols())) =
    -q(fixed.free, fixed.free).llt().solve(Eigen::MatrixXd(RowsOf(q, fixed.free) * fixed.values));
  const SkinWeights weights = ComputeSkinWeights(input, Settings(SkinWeightMode::Unbounded));
  EXPECT_LT((Dense(weights) - reference).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(weights.energy / Energy(q, reference), 1.0, 1e-9);
  for (Eigen::Index i = 0; i < reference.rows(); ++i)
  {
    ASSERT_NEAR(Dense(weights).row(i).sum(), 1.0, 1e-9);
  }
}

TEST(BiharmonicSkinWeights, BarIsTheCubicOfABeam)
{
  // Between two short bones a long thin bar: w'''' = 0 with value and slope 0 at one bone, 1 and 0
  // at the other, so w = 3 t^2 - 2 t^3. The bones' inner ends fix one cross-section's middle only,
  // so the ends are clamped by a bone of two cells.
  SkinWeightInput input =
    MeshOfCells({ 0, -1, -1 }, { 60, 1, 1 }, 0.1, [](const Vector3&) { return true; });
  input.joints = { Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(5, 0, 0), Vector3(6, 0, 0) };
  input.bones = { { 0, 1 }, { 2, 3 } };
  for (const SkinWeightMode mode : { SkinWeightMode::Joint, SkinWeightMode::Independent })
  {
    const SkinWeights weights = ComputeSkinWeights(input, Settings(mode));
    EXPECT_TRUE(weights.converged);
    ExpectWeights(weights);
    const Eigen::MatrixXd dense = Dense(weights);
    double worst = 0.0;
    for (std::size_t i = 0; i < input.points.size(); ++i)
    {
      const double t = std::clamp((input.points[i][0] - 1.0) / 4.0, 0.0, 1.0);
      worst =
        std::max(worst, std::abs(dense(static_cast<Eigen::Index>(i), 1) - t * t * (3.0 - 2.0 * t)));
    }
    EXPECT_LT(worst, 0.03);
  }
  // Harmonic: a straight line.
  const Eigen::MatrixXd line = Dense(ComputeSkinWeights(input, Settings(SkinWeightMode::Harmonic)));
  for (std::size_t i = 0; i < input.points.size(); ++i)
  {
    const double t = std::clamp((input.points[i][0] - 1.0) / 4.0, 0.0, 1.0);
    ASSERT_NEAR(line(static_cast<Eigen::Index>(i), 1), t, 0.03);
  }
}

TEST(BiharmonicSkinWeights, SymmetricCaseGivesSymmetricWeights)
{
  SkinWeightInput input = MeshOfCells(
    { -6, -1, -1 }, { 6, 1, 1 }, 0.5, [](const Vector3&) { return true; }, CellSplit::Star);
  input.joints = { Vector3(-3, 0, 0), Vector3(-1, 0, 0), Vector3(1, 0, 0), Vector3(3, 0, 0) };
  input.bones = { { 0, 1 }, { 1, 2 }, { 2, 3 } };
  const Eigen::MatrixXd w = Dense(ComputeSkinWeights(input, Settings(SkinWeightMode::Joint)));
  const auto find = [&](const Vector3& p)
  {
    for (std::size_t i = 0; i < input.points.size(); ++i)
    {
      if ((input.points[i] - p).norm() < 1e-9)
      {
        return static_cast<Eigen::Index>(i);
      }
    }
    return Eigen::Index(-1);
  };
  for (std::size_t i = 0; i < input.points.size(); ++i)
  {
    const Vector3& p = input.points[i];
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Index mirrored = find({ -p[0], p[1], p[2] });
    const Eigen::Index turned = find({ p[0], p[2], -p[1] });
    ASSERT_GE(mirrored, 0);
    ASSERT_GE(turned, 0);
    ASSERT_NEAR(w(row, 0), w(mirrored, 2), 1e-7);
    ASSERT_NEAR(w(row, 1), w(mirrored, 1), 1e-7);
    ASSERT_LT((w.row(row) - w.row(turned)).cwiseAbs().maxCoeff(), 1e-7);
  }
}

TEST(BiharmonicSkinWeights, UnitsRotationAndOrderDoNotMatter)
{
  const SkinWeightInput input = SmallY();
  for (const SkinWeightMode mode : { SkinWeightMode::Joint, SkinWeightMode::Independent,
         SkinWeightMode::Unbounded, SkinWeightMode::Harmonic })
  {
    const Eigen::MatrixXd w = Dense(ComputeSkinWeights(input, Settings(mode)));
    SkinWeightInput other = input;
    const Matrix3 turn =
      Eigen::AngleAxisd(1.1, Vector3(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
    const auto count = static_cast<std::int64_t>(input.points.size());
    std::vector<std::int64_t> place(count);
    for (std::int64_t i = 0; i < count; ++i)
    {
      place[i] = (i * 71 + 5) % count;
    }
    ASSERT_EQ(std::gcd<std::int64_t>(71, count), 1);
    for (std::int64_t i = 0; i < count; ++i)
    {
      other.points[place[i]] = 1e-3 * (turn * input.points[i]) + Vector3(0.2, -0.1, 0.4);
    }
    for (Vector3& joint : other.joints)
    {
      joint = Vector3(1e-3 * (turn * joint) + Vector3(0.2, -0.1, 0.4));
    }
    for (auto& t : other.tetrahedra)
    {
      for (std::int64_t& i : t)
      {
        i = place[i];
      }
      std::swap(t[0], t[1]);
    }
    std::reverse(other.tetrahedra.begin(), other.tetrahedra.end());
    const Eigen::MatrixXd v = Dense(ComputeSkinWeights(other, Settings(mode)));
    for (std::int64_t i = 0; i < count; ++i)
    {
      ASSERT_LT((w.row(i) - v.row(place[i])).cwiseAbs().maxCoeff(), 1e-6)
        << "mode " << static_cast<int>(mode);
    }
  }
}

TEST(BiharmonicSkinWeights, NeighbourhoodChangesNothingThatMatters)
{
  const SkinWeightInput input = MeshOfComb(9, 4, 2, 1, 0.5);
  const SkinWeights everywhere = ComputeSkinWeights(input, Settings(SkinWeightMode::Joint, 0.0));
  SkinWeightSettings settings = Settings(SkinWeightMode::Joint, 1.75);
  const SkinWeights near = ComputeSkinWeights(input, settings);
  EXPECT_LT(near.maximumDomainShare, 0.9);
  EXPECT_TRUE(near.converged);
  EXPECT_LE(near.residualEverywhere, 10.0 * settings.tolerance);
  EXPECT_LT(near.energyGap, 1e-3);
  EXPECT_LT((Dense(near) - Dense(everywhere)).cwiseAbs().maxCoeff(), 1e-4);
  // Too small a neighbourhood must show, what is reported is what is lost,
  settings.neighbourhood = 0.5;
  settings.widen = false;
  const SkinWeights narrow = ComputeSkinWeights(input, settings);
  EXPECT_LT(narrow.maximumDomainShare, near.maximumDomainShare);
  EXPECT_GT(narrow.residualEverywhere, 100.0 * settings.tolerance);
  EXPECT_GT(narrow.energy, everywhere.energy * (1.0 + 1e-6));
  EXPECT_LE(narrow.energy - everywhere.energy, (narrow.energyGap + 1e-9) * narrow.energy);
  // and it is widened until it does not matter.
  settings.widen = true;
  const SkinWeights widened = ComputeSkinWeights(input, settings);
  EXPECT_LE(widened.residualEverywhere, 10.0 * settings.tolerance);
  EXPECT_LT((Dense(widened) - Dense(everywhere)).cwiseAbs().maxCoeff(), 1e-4);
  settings.mode = SkinWeightMode::Independent;
  const SkinWeights alone = ComputeSkinWeights(input, settings);
  EXPECT_GT(alone.neighbourhood, 0.5);
  EXPECT_LE(alone.residualEverywhere, 10.0 * settings.tolerance);
  EXPECT_LT(
    (Dense(alone) - Dense(ComputeSkinWeights(input, Settings(SkinWeightMode::Independent, 0.0))))
      .cwiseAbs()
      .maxCoeff(),
    1e-4);
}

TEST(BiharmonicSkinWeights, WeightsFindWhereTheyLive)
{
  // Bones shorter than the vessel is thick reach over several others, long ones not to the next but one.
  for (const auto& [branches, bones, cells, half] : { std::array<int, 4>{ 9, 3, 2, 2 },
         std::array<int, 4>{ 5, 4, 3, 2 }, std::array<int, 4>{ 4, 4, 8, 1 } })
  {
    const SkinWeightInput input = MovedComb(branches, bones, cells, half);
    const SkinWeights everywhere = ComputeSkinWeights(input, Settings(SkinWeightMode::Joint, 0.0));
    EXPECT_EQ(everywhere.maximumDomainShare, 1.0);
    for (const double neighbourhood : { 0.01, 0.5, 1.75 })
    {
      SCOPED_TRACE(std::to_string(cells) + " cells, " + std::to_string(neighbourhood));
      const SkinWeightSettings settings = Settings(SkinWeightMode::Joint, neighbourhood);
      const SkinWeights w = ComputeSkinWeights(input, settings);
      EXPECT_TRUE(w.converged);
      EXPECT_LE(w.residual, settings.tolerance);
      EXPECT_LE(w.residualEverywhere, 10.0 * settings.tolerance);
      EXPECT_LT(w.maximumDomainShare, cells == 8 ? 0.8 : 1.01);
      EXPECT_NEAR(w.energy, everywhere.energy, 2e-4 * everywhere.energy);
      EXPECT_LT((Dense(w) - Dense(everywhere)).cwiseAbs().maxCoeff(), 3e-4);
    }
  }
}

TEST(BiharmonicSkinWeights, IndependentModeIsLibigls)
{
  const SkinWeightInput input = MovedComb(2, 1, 4, 1);
  ASSERT_EQ(input.points.size(), std::size(LibiglReferenceWeights));
  for (const double neighbourhood : { 0.0, 1.75 })
  {
    const SkinWeights weights =
      ComputeSkinWeights(input, Settings(SkinWeightMode::Independent, neighbourhood));
    EXPECT_GT(weights.maximumSum, 1.01); // else the modes would not differ
    const Eigen::MatrixXd dense = Dense(weights);
    ASSERT_EQ(dense.cols(), 5);
    for (Eigen::Index i = 0; i < dense.rows(); ++i)
    {
      for (Eigen::Index b = 0; b < 5; ++b)
      {
        EXPECT_NEAR(dense(i, b), LibiglReferenceWeights[i][b], 1e-5) << i << " " << b;
      }
    }
  }
}

TEST(BiharmonicSkinWeights, BonesBetweenThePoints)
{
  SkinWeightInput input =
    MeshOfCells({ 0, -2, -2 }, { 24, 2, 2 }, 0.25, [](const Vector3&) { return true; });
  const Vector3 off(0.0, 0.11, 0.07);
  input.joints = { Vector3(0.3, 0, 0) + off, Vector3(3.04, 0, 0) + off, Vector3(5.71, 0, 0) + off };
  input.bones = { { 0, 1 }, { 1, 2 } };
  const SkinWeights weights = ComputeSkinWeights(input, Settings(SkinWeightMode::Joint));
  EXPECT_TRUE(weights.converged);
  EXPECT_EQ(weights.fixedPoints, 0);
  EXPECT_GT(weights.samples, 20);
  ExpectWeights(weights);
  EXPECT_LE(weights.lengthOutside[0], 0.0);
  // Away from the joint the weight on the bone is 1.
  const Eigen::MatrixXd w = Dense(weights);
  for (std::size_t i = 0; i < input.points.size(); ++i)
  {
    const Vector3& p = input.points[i];
    const auto row = static_cast<Eigen::Index>(i);
    if ((p - off - Vector3(p[0], 0, 0)).norm() < 0.2 && p[0] < 2.5)
    {
      EXPECT_GT(w(row, 0), 0.99);
    }
    if ((p - off - Vector3(p[0], 0, 0)).norm() < 0.2 && p[0] > 3.6)
    {
      EXPECT_GT(w(row, 1), 0.99);
    }
  }
  // A bone that leaves the mesh is measured.
  input.joints[2] = Vector3(7.71, 0, 0) + off;
  const SkinWeights longer = ComputeSkinWeights(input, Settings(SkinWeightMode::Joint));
  EXPECT_NEAR(longer.lengthOutside[1], 1.71, 0.15);
}

TEST(BiharmonicSkinWeights, SameBitsOnOneAndTwoThreads)
{
  const SkinWeightInput input = MeshOfComb(2, 2, 4, 1, 0.5);
  for (const double neighbourhood : { 0.0, 1.75 })
  {
    SetNumberOfThreads(1);
    const SkinWeights one =
      ComputeSkinWeights(input, Settings(SkinWeightMode::Joint, neighbourhood));
    for (int repeat = 0; repeat < 5; ++repeat)
    {
      SetNumberOfThreads(2 + repeat % 2);
      const SkinWeights two =
        ComputeSkinWeights(input, Settings(SkinWeightMode::Joint, neighbourhood));
      EXPECT_EQ(one.bone, two.bone);
      EXPECT_EQ(one.weight, two.weight);
      EXPECT_EQ(one.energy, two.energy);
    }
    SetNumberOfThreads(0);
  }
}

TEST(BiharmonicSkinWeights, Compact)
{
  const SkinWeights weights =
    ComputeSkinWeights(MeshOfComb(3, 2, 3, 1, 0.5), Settings(SkinWeightMode::Joint));
  for (const int influences : { 1, 2, 8 })
  {
    const CompactSkinWeights compact = CompactWeights(weights, influences);
    double maximum = 0.0;
    for (std::size_t i = 0; i + 1 < weights.offset.size(); ++i)
    {
      float sum = 0.0f;
      for (int k = 0; k < influences; ++k)
      {
        sum += compact.weight[i * influences + k];
        if (k > 0)
        {
          ASSERT_LE(compact.weight[i * influences + k], compact.weight[i * influences + k - 1]);
        }
      }
      ASSERT_NEAR(sum, 1.0f, 1e-6f);
      maximum = std::max(maximum, static_cast<double>(compact.dropped[i]));
      if (weights.offset[i + 1] - weights.offset[i] <= influences)
      {
        ASSERT_EQ(compact.dropped[i], 0.0f);
      }
    }
    EXPECT_NEAR(compact.maximumDropped, maximum, 1e-7);
    EXPECT_GT(compact.maximumDropped, influences < 3 ? 0.05 : -1.0);
  }
  EXPECT_THROW(CompactWeights(weights, 0), std::invalid_argument);
}

TEST(BiharmonicSkinWeights, ProgressAndAbort)
{
  const SkinWeightInput input = SmallY();
  double last = 0.0;
  ComputeSkinWeights(input, {},
    [&](double done)
    {
      EXPECT_GE(done, last - 1e-12);
      EXPECT_LE(done, 1.0);
      last = done;
      return true;
    });
  EXPECT_NEAR(last, 1.0, 1e-12);
  for (const double stop : { 0.0, 0.05, 0.12, 0.5, 0.9 })
  {
    EXPECT_THROW(
      ComputeSkinWeights(input, {}, [&](double done) { return done < stop; }), Cancelled);
  }
}

TEST(BiharmonicSkinWeights, BadInput)
{
  const auto damaged = [](const std::function<void(SkinWeightInput&)>& damage)
  {
    SkinWeightInput input = SmallY();
    damage(input);
    return Complaint(input);
  };
  EXPECT_EQ(Complaint(SmallY()), "");
  EXPECT_TRUE(Contains(damaged([](auto& i) { i.tetrahedra.clear(); }), "no tetrahedra"));
  EXPECT_TRUE(Contains(damaged([](auto& i) { i.bones.clear(); }), "no bones"));
  EXPECT_TRUE(Contains(damaged([](auto& i) { i.tetrahedra[3][1] = 100000; }), "tetrahedron 3"));
  EXPECT_TRUE(
    Contains(damaged([](auto& i) { i.tetrahedra[3][1] = i.tetrahedra[3][0]; }), "tetrahedron 3"));
  EXPECT_TRUE(Contains(damaged([](auto& i) { i.points[7][1] = NAN; }), "point 7"));
  EXPECT_TRUE(Contains(damaged([](auto& i) { i.joints[1][2] = INFINITY; }), "joint 1"));
  EXPECT_TRUE(Contains(damaged([](auto& i) { i.bones[1].second = 99; }), "bone 1"));
  EXPECT_TRUE(Contains(damaged([](auto& i) { i.bones[1].second = i.bones[1].first; }), "bone 1"));
  EXPECT_TRUE(Contains(damaged([](auto& i) { i.bones.push_back(i.bones[0]); }), "same joints"));
  EXPECT_TRUE(Contains(
    damaged([](auto& i) { i.points.emplace_back(50, 0, 0); }), "belongs to no tetrahedron"));
  EXPECT_TRUE(Contains(damaged(
                         [](auto& i)
                         {
                           i.joints.emplace_back(50, 0, 0);
                           i.joints.emplace_back(60, 0, 0);
                           i.bones.emplace_back(i.joints.size() - 2, i.joints.size() - 1);
                         }),
    "bone 4 at (50, 0, 0) lies outside of the mesh"));
  // Two bones over each other that do not meet in a joint.
  EXPECT_TRUE(Contains(damaged(
                         [](auto& i)
                         {
                           i.joints.push_back(i.joints[0] + Vector3(0.7, 0, 0));
                           i.joints.push_back(i.joints[0] + Vector3(1.4, 0, 0));
                           i.bones.emplace_back(i.joints.size() - 2, i.joints.size() - 1);
                         }),
    "runs through joint"));
  // A part without a bone.
  EXPECT_TRUE(Contains(damaged(
                         [](auto& i)
                         {
                           const auto n = static_cast<std::int64_t>(i.points.size());
                           for (const Vector3& p : { Vector3(20, 0, 0), Vector3(21, 0, 0),
                                  Vector3(20, 1, 0), Vector3(20, 0, 1) })
                           {
                             i.points.push_back(p);
                           }
                           i.tetrahedra.push_back({ n, n + 1, n + 2, n + 3 });
                         }),
    "has no bone in it: 4 points, one of them at (20, 0, 0)"));
  const auto refused = [](const std::function<void(SkinWeightSettings&)>& change)
  {
    SkinWeightSettings settings;
    change(settings);
    return Complaint(SmallY(), settings);
  };
  EXPECT_TRUE(Contains(refused([](auto& s) { s.tolerance = NAN; }), "tolerance"));
  EXPECT_TRUE(Contains(refused([](auto& s) { s.iterations = 0; }), "iterations"));
  EXPECT_TRUE(Contains(refused([](auto& s) { s.neighbourhood = -1; }), "neighbourhood"));
  EXPECT_TRUE(Contains(refused([](auto& s) { s.penalty = 0.0; }), "penalty"));
  EXPECT_TRUE(Contains(refused([](auto& s) { s.mode = static_cast<SkinWeightMode>(9); }), "mode"));
}
}
