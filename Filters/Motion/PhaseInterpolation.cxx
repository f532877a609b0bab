#include "PhaseInterpolation.h"

#include "Dual.h"
#include "HarmonicFit.h"
#include "PeriodicSpline.h"
#include "Require.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

// Linear, Eq. 8: P(t) = (1 - s) P_1 + s P_2 between the two phases around, s from 0 to 1.
// Low noise: P_i(t) = c_i + sum over r of U_ir g_r(t): few spatial modes U, each with a Fourier series g of few
// harmonics, and a ridge on harmonic m of (m^4 - 1) times a factor. The numbers of modes and harmonics and the factor
// are those that best predict each phase when it is left out (of equally good ones, the smallest). With equal
// confidences the modes are those of the singular value decomposition; else weighted alternating least squares begin
// there. Samples below a confidence of 0.05 do not count.
// Rotations: q_k = q exp(v_k / 2) with q their mean (Markley et al. 2007); the vectors v_k are interpolated like
// positions.
// Cross-sections, Eq. 10 and 11: pi a b = A0 (1 + eps_r). The wanted factor c of the radius comes from CalibreFactor,
// else from the ellipses' area, else from a radius that changes with time; its logarithm is interpolated; eps_r = c^2 -
// 1, limited.
// Repeated phases at times t_k are moved to their mean t along the velocity v between the neighbouring phases: P' = P -
// (t_k - t) v.

namespace coronary
{
namespace
{
using Rows = HarmonicRows;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Quaternion = Eigen::Quaterniond;

/// Columns that one task works on.
constexpr std::int64_t Grain = 8192;

double Apart(double a, double b)
{
  const double gap = std::abs(a - b);
  return std::min(gap, 1.0 - gap);
}

Vector3 Logarithm(Quaternion rotation)
{
  if (rotation.w() < 0.0)
  {
    rotation.coeffs() = -rotation.coeffs();
  }
  const double sine = rotation.vec().norm();
  if (sine < 1e-12)
  {
    return 2.0 * rotation.vec();
  }
  return 2.0 * std::atan2(sine, rotation.w()) / sine * rotation.vec();
}

template <typename Scalar>
Eigen::Quaternion<Scalar> Exponential(const Eigen::Matrix<Scalar, 3, 1>& vector)
{
  using std::cos;
  using std::sin;
  const Scalar angle = vector.norm();
  const Scalar share = angle < 1e-9 ? Scalar(0.5) : sin(Scalar(0.5) * angle) / angle;
  Eigen::Quaternion<Scalar> rotation;
  rotation.w() = cos(Scalar(0.5) * angle);
  rotation.vec() = share * vector;
  return rotation;
}

/// Of mean Exponential(tangent), about axes of the world.
Vector3 AngularVelocity(const Quaternion& mean, const Vector3& tangent, const Vector3& rate)
{
  const Eigen::Quaternion<Dual> turning = Exponential<Dual>(
    { Dual(tangent.x(), rate.x()), Dual(tangent.y(), rate.y()), Dual(tangent.z(), rate.z()) });
  const Quaternion now(turning.w().value, turning.x().value, turning.y().value, turning.z().value);
  const Quaternion change(turning.w().rate, turning.x().rate, turning.y().rate, turning.z().rate);
  return mean * Vector3(2.0 * (change * now.conjugate()).vec());
}
}

void PhaseInterpolationSettings::Validate() const
{
  Require(this->mode == PhaseInterpolationMode::Linear ||
      this->mode == PhaseInterpolationMode::PeriodicCubic ||
      this->mode == PhaseInterpolationMode::LowNoise,
    "mode must be linear, periodic cubic or low noise");
  Require(
    this->mergeTolerance >= 0.0 && this->mergeTolerance <= 0.1, "mergeTolerance must be 0 to 0.1");
  Require(this->maximumRank >= 1 && this->maximumRank <= 20, "maximumRank must be 1 to 20");
  Require(this->maximumOrder >= 1 && this->maximumOrder <= 20, "maximumOrder must be 1 to 20");
  Require(this->minimumConfidence >= 0.0 && this->minimumConfidence <= 1.0,
    "minimumConfidence must be 0 to 1");
}

PhaseInterpolation::PhaseInterpolation(const PoseSequence& sequence,
  const PhaseInterpolationSettings& settings, const ProgressCallback& progress)
  : Settings(settings)
{
  settings.Validate();
  CheckPoseSequence(sequence, sequence.points.empty() ? 0 : sequence.points.front().size());
  this->Merge(sequence);
  Report(progress, 0.1);

  const bool cubic = settings.mode == PhaseInterpolationMode::PeriodicCubic;
  if (cubic)
  {
    const MatrixXd second = SecondDerivatives(this->Knots_);
    Multiply(second, this->Points, this->PointsMore);
    Multiply(second, this->LogCalibre, this->LogCalibreMore);
    Multiply(second, this->Tangents, this->TangentsMore);
  }
  else if (settings.mode == PhaseInterpolationMode::LowNoise)
  {
    Rows weights = Rows::Ones(this->Points.rows(), this->Points.cols() / 3);
    if (this->Confidence.size() > 0)
    {
      weights =
        (this->Confidence.array() < settings.minimumConfidence).select(0.0, this->Confidence);
    }
    this->Fit_ =
      LowNoiseFitter(this->Knots_, this->Points, weights, settings, progress).Run(this->PointsMore);
    const MatrixXd fit = FourierFit(this->Knots_, this->Fit_.order, this->Fit_.ridge);
    Multiply(fit, this->LogCalibre, this->LogCalibreMore);
    Multiply(fit, this->Tangents, this->TangentsMore);
  }
  Report(progress, 1.0);
}

void PhaseInterpolation::Merge(const PoseSequence& sequence)
{
  this->GroupPhases(sequence);
  this->MergePositions(sequence);
  const auto knots = static_cast<Index>(this->Members.size());
  const auto points = static_cast<Index>(sequence.points.front().size());
  if (!sequence.confidence.empty())
  {
    this->Confidence = Rows::Zero(knots, points);
    for (Index k = 0; k < knots; ++k)
    {
      for (const std::size_t phase : this->Members[k])
      {
        this->Confidence.row(k) +=
          Eigen::Map<const Eigen::RowVectorXd>(sequence.confidence[phase].data(), points);
      }
      this->Confidence.row(k) /= static_cast<double>(this->Members[k].size());
    }
  }
  if (!sequence.calibre.empty())
  {
    this->LogCalibre = Rows::Zero(knots, points);
    for (Index k = 0; k < knots; ++k)
    {
      for (const std::size_t phase : this->Members[k])
      {
        for (Index n = 0; n < points; ++n)
        {
          this->LogCalibre(k, n) +=
            this->Share(sequence, k, n, phase) * std::log(sequence.calibre[phase][n]);
        }
      }
    }
  }
  this->MergeStatus(sequence);
  if (!sequence.rotation.empty())
  {
    this->MergeRotations(sequence);
  }
}

/// Repetitions are what is near in time around the cycle.
void PhaseInterpolation::GroupPhases(const PoseSequence& sequence)
{
  const std::size_t phases = sequence.NumberOfPhases();
  for (const double time : sequence.times)
  {
    this->Times.push_back(Modulo(time));
  }
  // Groups of phases around the cycle: the widest gap between two neighbours begins the first one.
  std::vector<std::size_t> order(phases);
  std::iota(order.begin(), order.end(), std::size_t{ 0 });
  std::stable_sort(order.begin(), order.end(),
    [&](std::size_t a, std::size_t b) { return this->Times[a] < this->Times[b]; });
  std::size_t start = 0;
  double widest = -1.0;
  for (std::size_t n = 0; n < phases; ++n)
  {
    const double gap = n == 0 ? this->Times[order[0]] + 1.0 - this->Times[order[phases - 1]]
                              : this->Times[order[n]] - this->Times[order[n - 1]];
    if (gap > widest)
    {
      widest = gap;
      start = n;
    }
  }
  std::rotate(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(start), order.end());
  const double origin = this->Times[order.front()];
  const auto since = [&](std::size_t phase) { return Modulo(this->Times[phase] - origin); };
  struct Group
  {
    double time = 0.0;
    std::vector<std::size_t> phases;
  };
  std::vector<Group> groups;
  for (const std::size_t phase : order)
  {
    // Against the group's first phase: a dense series does not collapse into one.
    if (groups.empty() ||
      since(phase) - since(groups.back().phases.front()) > this->Settings.mergeTolerance)
    {
      groups.emplace_back();
    }
    groups.back().phases.push_back(phase);
  }
  for (Group& group : groups)
  {
    double sum = 0.0;
    for (const std::size_t phase : group.phases)
    {
      sum += since(phase);
    }
    group.time = Modulo(origin + sum / static_cast<double>(group.phases.size()));
    std::sort(group.phases.begin(), group.phases.end());
  }
  std::sort(
    groups.begin(), groups.end(), [](const Group& a, const Group& b) { return a.time < b.time; });
  Require(groups.size() >= 2,
    "The sequence has fewer than two different phases: times that are nearer to each other than "
    "the "
    "tolerance, modulo one cycle, are one");
  for (const Group& group : groups)
  {
    this->Knots_.push_back(group.time);
    this->Members.push_back(group.phases);
  }
}

/// What a member counts for in the mean at a point.
double PhaseInterpolation::Share(
  const PoseSequence& sequence, Index k, Index point, std::size_t phase) const
{
  double sum = 0.0;
  for (const std::size_t member : this->Members[k])
  {
    sum += sequence.confidence.empty() ? 0.0 : sequence.confidence[member][point];
  }
  return sum > 0.0 ? sequence.confidence[phase][point] / sum
                   : 1.0 / static_cast<double>(this->Members[k].size());
}

/// Means first; then repetitions are moved to their common time along the velocity between the
/// neighbours, so that a steady motion is not changed by the merging.
void PhaseInterpolation::MergePositions(const PoseSequence& sequence)
{
  const auto knots = static_cast<Index>(this->Members.size());
  const auto points = static_cast<Index>(sequence.points.front().size());
  const auto position = [&](std::size_t phase)
  {
    return Eigen::Map<const Eigen::RowVectorXd>(
      points > 0 ? sequence.points[phase].front().data() : nullptr, 3 * points);
  };
  this->Points = Rows::Zero(knots, 3 * points);
  for (Index k = 0; k < knots; ++k)
  {
    for (const std::size_t phase : this->Members[k])
    {
      const auto at = position(phase);
      for (Index n = 0; n < points; ++n)
      {
        this->Points.row(k).segment<3>(3 * n) +=
          this->Share(sequence, k, n, phase) * at.segment<3>(3 * n);
      }
    }
  }
  const Rows means = this->Points;
  double squares = 0.0;
  double repeated = 0.0;
  for (Index k = 0; k < knots; ++k)
  {
    const std::vector<std::size_t>& members = this->Members[k];
    if (members.size() < 2)
    {
      continue;
    }
    Eigen::RowVectorXd velocity = Eigen::RowVectorXd::Zero(3 * points);
    if (knots > 2)
    {
      const Index before = (k + knots - 1) % knots;
      const Index after = (k + 1) % knots;
      const double gap = Modulo(this->Knots_[after] - this->Knots_[before]);
      velocity = (means.row(after) - means.row(before)) / gap;
    }
    std::vector<Eigen::RowVectorXd> moved;
    for (const std::size_t phase : members)
    {
      double late = this->Times[phase] - this->Knots_[k];
      late -= std::round(late);
      moved.emplace_back(position(phase) - late * velocity);
    }
    for (Index n = 0; n < points; ++n)
    {
      Vector3 mean = Vector3::Zero();
      for (std::size_t m = 0; m < members.size(); ++m)
      {
        mean += this->Share(sequence, k, n, members[m]) * moved[m].segment<3>(3 * n).transpose();
      }
      this->Points.row(k).segment<3>(3 * n) = mean.transpose();
      for (const Eigen::RowVectorXd& other : moved)
      {
        squares += (other.segment<3>(3 * n).transpose() - mean).squaredNorm();
        repeated += 1.0;
      }
    }
  }
  this->Repeatability_ = repeated > 0.0 ? std::sqrt(squares / repeated) : 0.0;
}

/// Of the repetition that is known best.
void PhaseInterpolation::MergeStatus(const PoseSequence& sequence)
{
  if (sequence.status.empty())
  {
    return;
  }
  const auto knots = static_cast<Index>(this->Members.size());
  const auto points = static_cast<Index>(sequence.points.front().size());
  for (Index k = 0; k < knots; ++k)
  {
    std::vector<TrackingStatus> status = sequence.status[this->Members[k].front()];
    for (Index n = 0; !sequence.confidence.empty() && n < points; ++n)
    {
      double best = -1.0;
      for (const std::size_t phase : this->Members[k])
      {
        if (sequence.confidence[phase][n] > best)
        {
          best = sequence.confidence[phase][n];
          status[n] = sequence.status[phase][n];
        }
      }
    }
    this->Status.push_back(std::move(status));
  }
}

void PhaseInterpolation::MergeRotations(const PoseSequence& sequence)
{
  const std::size_t phases = sequence.NumberOfPhases();
  const auto knots = static_cast<Index>(this->Members.size());
  const auto bones = static_cast<Index>(sequence.rotation.front().size());
  this->Tangents = Rows::Zero(knots, 3 * bones);
  for (Index bone = 0; bone < bones; ++bone)
  {
    // The rotation of the least sum of squared sines, sign of quaternions aside (Markley 2007).
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
    for (std::size_t phase = 0; phase < phases; ++phase)
    {
      const Eigen::Vector4d q = sequence.rotation[phase][bone].normalized().coeffs();
      sum += q * q.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(sum);
    Quaternion mean;
    mean.coeffs() = solver.eigenvectors().col(3);
    Index strongest = 0;
    mean.coeffs().cwiseAbs().maxCoeff(&strongest);
    if (mean.coeffs()[3] < 0.0 || (mean.coeffs()[3] == 0.0 && mean.coeffs()[strongest] < 0.0))
    {
      mean.coeffs() = -mean.coeffs();
    }
    mean.normalize();
    this->MeanRotation.push_back(mean);
    for (Index k = 0; k < knots; ++k)
    {
      Vector3 tangent = Vector3::Zero();
      for (const std::size_t phase : this->Members[k])
      {
        tangent += Logarithm(mean.conjugate() * sequence.rotation[phase][bone].normalized());
      }
      this->Tangents.row(k).segment<3>(3 * bone) =
        (tangent / static_cast<double>(this->Members[k].size())).transpose();
    }
  }
}

std::size_t PhaseInterpolation::NearestPhase(double time) const
{
  const double phase = Modulo(time);
  std::size_t nearest = 0;
  for (std::size_t k = 1; k < this->Times.size(); ++k)
  {
    if (Apart(this->Times[k], phase) < Apart(this->Times[nearest], phase))
    {
      nearest = k;
    }
  }
  return nearest;
}

void PhaseInterpolation::Evaluate(double time, InterpolatedPose& pose) const
{
  Require(std::isfinite(time), "The time must be finite");
  const KnotInterval interval = IntervalAt(this->Knots_, time);
  const double share = interval.share;
  const auto a = static_cast<Index>(interval.before);
  const auto b = static_cast<Index>(interval.after);
  const bool linear = this->Settings.mode == PhaseInterpolationMode::Linear;
  const bool cubic = this->Settings.mode == PhaseInterpolationMode::PeriodicCubic;
  const CubicWeights weights = CubicAt(interval);
  const VectorXd harmonics = linear || cubic ? VectorXd() : Harmonics(time, this->Fit_.order);
  const VectorXd rates = linear || cubic ? VectorXd() : HarmonicRates(time, this->Fit_.order);

  // Columns first .. first + count of what is interpolated, into `value` and its derivative into `rate`.
  const auto blend =
    [&](const Rows& values, const Rows& more, Index first, Index count, double* value, double* rate)
  {
    Eigen::Map<Eigen::RowVectorXd> v(value, count);
    const auto va = values.row(a).segment(first, count);
    const auto vb = values.row(b).segment(first, count);
    if (linear)
    {
      v = (1.0 - share) * va + share * vb;
      Eigen::Map<Eigen::RowVectorXd>(rate, count) = (vb - va) / interval.gap;
      return;
    }
    if (cubic)
    {
      const auto ma = more.row(a).segment(first, count);
      const auto mb = more.row(b).segment(first, count);
      v = weights.value[0] * va + weights.value[1] * vb + weights.value[2] * ma +
        weights.value[3] * mb;
      Eigen::Map<Eigen::RowVectorXd>(rate, count) =
        weights.rate[0] * va + weights.rate[1] * vb + weights.rate[2] * ma + weights.rate[3] * mb;
      return;
    }
    v = more.row(0).segment(first, count);
    for (Index m = 1; m < more.rows(); ++m)
    {
      v += harmonics[m] * more.row(m).segment(first, count);
    }
    Eigen::Map<Eigen::RowVectorXd> r(rate, count);
    r.setZero();
    for (Index m = 1; m < more.rows(); ++m)
    {
      r += rates[m] * more.row(m).segment(first, count);
    }
  };

  const Index points = this->Points.cols() / 3;
  pose.points.resize(static_cast<std::size_t>(points));
  pose.velocity.resize(static_cast<std::size_t>(points));
  ParallelFor(points, Grain,
    [&](std::int64_t first, std::int64_t last)
    {
      blend(this->Points, this->PointsMore, 3 * first, 3 * (last - first),
        pose.points[static_cast<std::size_t>(first)].data(),
        pose.velocity[static_cast<std::size_t>(first)].data());
    });
  pose.confidence.resize(static_cast<std::size_t>(this->Confidence.cols()));
  if (!pose.confidence.empty())
  {
    Eigen::Map<Eigen::RowVectorXd>(pose.confidence.data(), this->Confidence.cols()) =
      (1.0 - share) * this->Confidence.row(a) + share * this->Confidence.row(b);
  }
  pose.calibre.resize(static_cast<std::size_t>(this->LogCalibre.cols()));
  pose.calibreRate.resize(pose.calibre.size());
  if (!pose.calibre.empty())
  {
    blend(this->LogCalibre, this->LogCalibreMore, 0, this->LogCalibre.cols(), pose.calibre.data(),
      pose.calibreRate.data());
    for (std::size_t n = 0; n < pose.calibre.size(); ++n)
    {
      pose.calibre[n] = std::exp(pose.calibre[n]);
      pose.calibreRate[n] *= pose.calibre[n];
    }
  }
  if (this->Status.empty())
  {
    pose.status.clear();
  }
  else
  {
    pose.status = this->Status[share < 0.5 ? interval.before : interval.after];
  }
  const Index bones = this->Tangents.cols() / 3;
  pose.rotation.resize(static_cast<std::size_t>(bones));
  pose.angularVelocity.resize(pose.rotation.size());
  for (Index bone = 0; bone < bones; ++bone)
  {
    const Quaternion& mean = this->MeanRotation[bone];
    if (linear)
    {
      const Quaternion first =
        mean * Exponential<double>(this->Tangents.row(a).segment<3>(3 * bone).transpose());
      const Quaternion second =
        mean * Exponential<double>(this->Tangents.row(b).segment<3>(3 * bone).transpose());
      pose.rotation[bone] = first.slerp(share, second);
      pose.angularVelocity[bone] = Logarithm(second * first.conjugate()) / interval.gap;
    }
    else
    {
      Vector3 tangent;
      Vector3 rate;
      blend(this->Tangents, this->TangentsMore, 3 * bone, 3, tangent.data(), rate.data());
      pose.rotation[bone] = mean * Exponential(tangent);
      pose.angularVelocity[bone] = AngularVelocity(mean, tangent, rate);
    }
  }
}

EllipseSection CrossSection(double radius, double calibre, double axisRatio, double strainLimit)
{
  EllipseSection section;
  const double wanted = calibre * calibre - 1.0;
  section.areaStrain = std::clamp(wanted, -strainLimit, strainLimit);
  section.clamped = section.areaStrain != wanted;
  // a b = r^2 (1 + eps), b = ratio a.
  section.major = radius * std::sqrt((1.0 + section.areaStrain) / axisRatio);
  section.minor = section.major * axisRatio;
  return section;
}
}
