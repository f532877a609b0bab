#include "PopulationMotion.h"

#include "CyclicTime.h"
#include "Numbers.h"
#include "Require.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace coronary
{
namespace
{
enum Parameter
{
  RightExcursion,
  LeftExcursion,
  RootExcursion,
  FrontGradient,
  StrainGradient,
  ApexAscent,
  TowardsApex,
  WallInwards,
  ApexTwist,
  BaseTwist,
  VentricularPeak,
  LeftPeak,
  RightLag,
  AtrialShare
};

// Where several studies give a number, it is their mean with the inverse squares of their standard deviations as weights.
const std::array<PopulationParameter, NumberOfPopulationParameters> Table = { {
  { "right excursion", 22.1, 5.5, "mm",
    "tricuspid annulus 22.6+-7.3 mm (PubMed 17381643), TAPSE 17-30 mm, about 22" },
  { "left excursion", 13.8, 3.6, "mm",
    "mitral annulus 15.4+-4.5 mm (PubMed 17381643), AV plane 12-15 mm (Carlsson 2007)" },
  { "aortic root excursion", 7.1, 2.1, "mm",
    "sinotubular junction 5.8-6.7 mm, annulus 8.1-8.8 mm (PMC4338743), annulus 11.6+-2.9 mm "
    "(Plonek 2018); ostia lie 65-90 % of the way up (IJCAP 4(4):435)" },
  { "front over back", 0.0, 0.15, "per 40 mm", "spread only: the groove tilts as it goes down" },
  { "strain at the apex over that at the base", 0.15, 0.15, "",
    "long-axis strain -16.3 % (HUNT, PMC6802996), endocardial base/mid/apex -32/-33/-36 % "
    "(McVeigh 2018)" },
  { "apex ascent", 0.0, 2.0, "mm",
    "spread only: the apex stays nearly still, 1.6+-2.2 mm by tagging (Rogers 1991)" },
  { "towards the apex", 0.65, 0.3, "of the angle to the long axis",
    "echo measures along lines to the apex; the annuli shorten, the tricuspid one by 20-30 % of "
    "28-35 mm, the mitral one by 10-15 % of 30-35 mm (textbooks)" },
  { "walls inwards", 4.0, 1.2, "mm", "lateral epicardium 3-5 mm, outer volume -8 %" },
  { "twist of the apex", 4.5, 2.2, "degrees",
    "net twist 7.5+-3 degrees (van Dalen, Notomi), right ventricle 9.0+-6.6" },
  { "twist of the base", -3.0, 1.2, "degrees", "-3 to -4 degrees (van Dalen, Notomi)" },
  { "peak of the ventricles", 288.0, 30.0, "ms at 75 beats a minute",
    "shortest at 34 % R-R (McVeigh 2018), LAD best at 35+-4 % (Greuter 2007), systolic rest "
    "280-340 ms (Celeng 2015)" },
  { "peak of the left groove", 341.0, 35.0, "ms at 75 beats a minute",
    "mitral annulus lowest at 403+-52 ms (PubMed 17381643), LCx best at 44+-4 % (Greuter 2007), "
    "rest 280-340 ms (Celeng 2015)" },
  { "right after left", -4.0, 40.0, "ms",
    "tricuspid annulus lowest at 308+-50 ms (PubMed 17381643), RCA best at 45+-3 % (Greuter "
    "2007)" },
  { "atrial share", 0.31, 0.09, "",
    "atrial ascent 6.4 of 15.4 and 9.8 of 22.6 mm in mixed patients (PubMed 17381643); 20-30 % of "
    "the filling at rest (textbooks)" },
} };

/// Large hearts contract more everywhere.
constexpr double AmplitudeCorrelation = 0.5;

bool IsAmplitude(int n)
{
  return n == RightExcursion || n == LeftExcursion || n == RootExcursion || n == WallInwards ||
    n == ApexTwist || n == BaseTwist;
}

// The wave's shape, ms. Lengths of the rest at end systole and in mid-diastole follow from it (docs/motion.md).
constexpr double Onset = 30.0;         // after the R wave
constexpr double SystoleSlope = -2.05; // of the peak's time a beat a minute: that of QS2 (Weissler)
constexpr double UsualRate = 75.0;     // at which the peaks are given
constexpr double EarlyFilling = 220.0; // from the peak on
constexpr double EarlyShare = 0.7;     // of diastole, at fast rates
constexpr double AtrialLead = 140.0;   // of the atrial contraction before the R wave
constexpr double AtrialLength = 150.0;
constexpr double Drift = 0.3;       // of what filling gives back: slowly, over all of diastole
constexpr double FillingSkew = 0.7; // filling is fastest when it begins
constexpr double Skew = 0.6; // contraction is fastest in the first fifth of the cycle (Mao 2000)

// The field's shape.
constexpr double BeyondApex = 20.0;    // mm: where the lines of motion meet, where an echo probe is
constexpr double RootReach = 15.0;     // mm from the line between the ostia
constexpr double AboveReach = 50.0;    // mm above the groove
constexpr double NearAxis = 10.0;      // mm
constexpr double FrontDistance = 40.0; // mm

// What no such field can follow, mm: one standard deviation of a point's distance at end systole.
constexpr double ModelMisfit = 4.0;
constexpr double MisfitInTime = 0.8; // width of the part that is not in step with the contraction
constexpr double MisfitOutOfStep = 0.3; // share of that part
constexpr double MisfitReach = 3.0;     // nodes of a vessel that go off together
constexpr double SeenNodes = 10.0;      // mm
constexpr double SeenConfidence = 0.5;  // that the tracker calls tracked

constexpr double ConfidenceScale = 2.0; // mm
constexpr double HighestConfidence = 0.5;

double RaisedCosine(double u)
{
  return u <= 0.0 ? 0.0 : u >= 1.0 ? 1.0 : 0.5 * (1.0 - std::cos(Pi * u));
}

/// Contraction at `now` ms after the R wave.
double Contraction(double now, double cycle, double peak, double atrialShare)
{
  if (now >= Onset && now < peak)
  {
    return RaisedCosine(std::pow((now - Onset) / (peak - Onset), Skew));
  }
  const double after =
    now < Onset ? now + cycle : now; // before contraction begins, the last beat ends
  const double diastole = cycle - peak;
  const double early = RaisedCosine(std::pow(
    std::max(0.0, after - peak) / std::min(EarlyFilling, EarlyShare * diastole), FillingSkew));
  const double slow = RaisedCosine((after - peak) / diastole);
  const double atrial = RaisedCosine((after - cycle + AtrialLead) / AtrialLength);
  return 1.0 - (1.0 - atrialShare) * ((1.0 - Drift) * early + Drift * slow) - atrialShare * atrial;
}

/// max(0, u) without a corner.
double SoftPositive(double u)
{
  constexpr double width = 0.08;
  return u <= -width ? 0.0 : u >= width ? u : (u + width) * (u + width) / (4.0 * width);
}

PopulationVector MeanValues(double amplitude)
{
  PopulationVector values;
  for (int n = 0; n < NumberOfPopulationParameters; ++n)
  {
    values[n] = Table[static_cast<std::size_t>(n)].mean * (IsAmplitude(n) ? amplitude : 1.0);
  }
  return values;
}

PopulationMatrix PriorCovariance()
{
  PopulationMatrix covariance = PopulationMatrix::Zero();
  for (int n = 0; n < NumberOfPopulationParameters; ++n)
  {
    for (int m = 0; m < NumberOfPopulationParameters; ++m)
    {
      const double correlation = n == m    ? 1.0
        : IsAmplitude(n) && IsAmplitude(m) ? AmplitudeCorrelation
                                           : 0.0;
      // The base turns the other way: more twist is less of it.
      const double sign = (n == BaseTwist) != (m == BaseTwist) ? -1.0 : 1.0;
      covariance(n, m) = sign * correlation * Table[static_cast<std::size_t>(n)].deviation *
        Table[static_cast<std::size_t>(m)].deviation;
    }
  }
  return covariance;
}

/// The motion of one tree for given parameters, at given times.
class Mover
{
public:
  Mover(const PatientHeart& heart, double rate, double reference, const std::vector<double>& times,
    const PopulationVector& values)
    : Heart(heart)
    , Values(values)
    , Reference(PopulationClocksAt(reference, rate, values))
  {
    for (const double time : times)
    {
      this->Clocks.push_back(PopulationClocksAt(time, rate, values));
    }
  }

  /// Displacements from `position`, which is at the reference, at all times: one column a time.
  void Move(const Vector3& position, Eigen::Matrix3Xd& displacement) const
  {
    Vector3 rest = position;
    for (int iteration = 0; iteration < 50; ++iteration)
    {
      const Vector3 off =
        position - rest - PopulationDisplacement(this->Heart, rest, this->Reference, this->Values);
      rest += off;
      if (off.squaredNorm() < 1e-16)
      {
        break;
      }
    }
    displacement.resize(3, static_cast<Eigen::Index>(this->Clocks.size()));
    for (std::size_t k = 0; k < this->Clocks.size(); ++k)
    {
      displacement.col(static_cast<Eigen::Index>(k)) =
        rest + PopulationDisplacement(this->Heart, rest, this->Clocks[k], this->Values) - position;
    }
  }

private:
  const PatientHeart& Heart;
  PopulationVector Values;
  PopulationClocks Reference;
  std::vector<PopulationClocks> Clocks;
};

/// A mover and those beside it, one parameter changed by a tenth of its deviation: for derivatives.
class Movers
{
public:
  Movers(const PatientHeart& heart, double rate, double reference, const std::vector<double>& times,
    const PopulationVector& values)
    : Middle(heart, rate, reference, times, values)
  {
    for (int n = 0; n < NumberOfPopulationParameters; ++n)
    {
      PopulationVector beside = values;
      beside[n] += Step(n);
      this->Beside.emplace_back(heart, rate, reference, times, beside);
    }
  }

  void Move(const Vector3& position, Eigen::Matrix3Xd& displacement) const
  {
    this->Middle.Move(position, displacement);
  }

  /// @param derivative  three rows a time, one column a parameter
  void Move(const Vector3& position, Eigen::Matrix3Xd& displacement,
    Eigen::Matrix<double, Eigen::Dynamic, NumberOfPopulationParameters>& derivative) const
  {
    this->Middle.Move(position, displacement);
    derivative.resize(3 * displacement.cols(), NumberOfPopulationParameters);
    Eigen::Matrix3Xd other;
    for (int n = 0; n < NumberOfPopulationParameters; ++n)
    {
      this->Beside[static_cast<std::size_t>(n)].Move(position, other);
      other = (other - displacement) / Step(n);
      derivative.col(n) = Eigen::Map<const Eigen::VectorXd>(other.data(), other.size());
    }
  }

private:
  static double Step(int n) { return 0.1 * Table[static_cast<std::size_t>(n)].deviation; }

  Mover Middle;
  std::vector<Mover> Beside;
};

/// The phases of a tracked sequence that say something: without the reference's own, and each moment once.
struct SeenPhases
{
  std::vector<double> times;
  std::vector<std::size_t> phases; ///< their numbers in the sequence
};

SeenPhases PhasesThatCount(const std::vector<double>& times, double reference)
{
  SeenPhases seen;
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    const auto same = [&](double other) { return CyclicDistance(times[k], other) < SameMoment; };
    if (!same(reference) && std::none_of(seen.times.begin(), seen.times.end(), same))
    {
      seen.times.push_back(times[k]);
      seen.phases.push_back(k);
    }
  }
  return seen;
}

/// How the misfit of two moments hangs together: it follows the contraction, and partly does not.
double MisfitCovariance(double firstTime, double first, double secondTime, double second)
{
  const double apart = std::sin(Pi * (firstTime - secondTime)) / MisfitInTime;
  return ModelMisfit * ModelMisfit *
    ((1.0 - MisfitOutOfStep) * first * second + MisfitOutOfStep * std::exp(-2.0 * apart * apart));
}

/// The parameters, given what was tracked.
struct Bent
{
  PopulationVector values;
  PopulationMatrix covariance;
};

/// One vessel's place every SeenNodes mm.
std::vector<std::size_t> Nodes(const Polylines& lines)
{
  std::vector<std::size_t> nodes;
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    double way = SeenNodes;
    for (std::size_t n = 1; n < line.size(); ++n)
    {
      const auto here = static_cast<std::size_t>(line[n]);
      way += (lines.points[here] - lines.points[static_cast<std::size_t>(line[n - 1])]).norm();
      if (way >= SeenNodes)
      {
        nodes.push_back(here);
        way = 0.0;
      }
    }
  }
  return nodes;
}

/// What the tracked phases say, and how badly a set of parameters explains it.
class Conditioning
{
public:
  Conditioning(const Polylines& lines, const PatientHeart& heart, double rate, double reference,
    const PoseSequence& poses, const SeenPhases& seen)
    : Lines(lines)
    , Heart(heart)
    , Rate(rate)
    , Reference(reference)
    , Poses(poses)
    , Seen(seen)
    , Places(Nodes(lines))
  {
  }

  /// Gauss and Newton's iteration to the most probable parameters; its linear form is Gaussian conditioning.
  Bent Solve(const PopulationVector& mean, const PopulationMatrix& prior) const
  {
    const PopulationMatrix precision = prior.inverse();
    Bent bent{ mean, prior };
    double best = this->Objective(bent.values, mean, precision);
    for (int iteration = 0; iteration < 12; ++iteration)
    {
      PopulationMatrix normal = precision;
      PopulationVector right = -precision * (bent.values - mean);
      this->Accumulate(bent.values, normal, right);
      bent.covariance = normal.inverse();
      const PopulationVector step = bent.covariance * right;
      // Half the step, until it is none that makes it worse.
      constexpr int halvings = 5;
      double share = 2.0;
      double next = best;
      bool better = false;
      for (int n = 0; n < halvings && !better; ++n)
      {
        share *= 0.5;
        next = this->Objective(bent.values + share * step, mean, precision);
        better = next <= best;
      }
      if (!better)
      {
        break;
      }
      bent.values += share * step;
      const bool done = best - next < 1e-6 * (1.0 + best);
      best = next;
      if (done)
      {
        break;
      }
    }
    return bent;
  }

  /// Root mean square distance, mm.
  double Misfit(const PopulationVector& values) const
  {
    double sum = 0.0;
    double count = 0.0;
    this->ForEach(values,
      [&](const Vector3& off)
      {
        sum += off.squaredNorm();
        count += 1.0;
      });
    return count > 0.0 ? std::sqrt(sum / count) : std::numeric_limits<double>::quiet_NaN();
  }

  bool Empty() const
  {
    bool any = false;
    for (const std::size_t place : this->Places)
    {
      for (const std::size_t phase : this->Seen.phases)
      {
        any = any || this->Counts(place, phase);
      }
    }
    return !any;
  }

private:
  /// Of one coordinate of a node; neighbours go off together.
  static double Weight() { return 3.0 / (ModelMisfit * ModelMisfit * MisfitReach); }

  bool Counts(std::size_t place, std::size_t phase) const
  {
    return this->Poses.confidence.empty() || this->Poses.confidence[phase][place] >= SeenConfidence;
  }

  template <typename Visit>
  void ForEach(const PopulationVector& values, const Visit& visit) const
  {
    const Mover mover(this->Heart, this->Rate, this->Reference, this->Seen.times, values);
    Eigen::Matrix3Xd moved;
    for (const std::size_t place : this->Places)
    {
      mover.Move(this->Lines.points[place], moved);
      for (std::size_t k = 0; k < this->Seen.phases.size(); ++k)
      {
        if (this->Counts(place, this->Seen.phases[k]))
        {
          visit(Vector3(this->Poses.points[this->Seen.phases[k]][place] -
            this->Lines.points[place] - moved.col(static_cast<Eigen::Index>(k))));
        }
      }
    }
  }

  double Objective(const PopulationVector& values, const PopulationVector& mean,
    const PopulationMatrix& precision) const
  {
    double sum = (values - mean).dot(precision * (values - mean));
    this->ForEach(values, [&](const Vector3& off) { sum += Weight() * off.squaredNorm(); });
    return sum;
  }

  void Accumulate(
    const PopulationVector& values, PopulationMatrix& normal, PopulationVector& right) const
  {
    const Movers movers(this->Heart, this->Rate, this->Reference, this->Seen.times, values);
    Eigen::Matrix3Xd moved;
    Eigen::Matrix<double, Eigen::Dynamic, NumberOfPopulationParameters> derivative;
    for (const std::size_t place : this->Places)
    {
      movers.Move(this->Lines.points[place], moved, derivative);
      for (std::size_t k = 0; k < this->Seen.phases.size(); ++k)
      {
        if (!this->Counts(place, this->Seen.phases[k]))
        {
          continue;
        }
        const auto rows = derivative.middleRows<3>(3 * static_cast<Eigen::Index>(k));
        const Vector3 off = this->Poses.points[this->Seen.phases[k]][place] -
          this->Lines.points[place] - moved.col(static_cast<Eigen::Index>(k));
        normal += Weight() * rows.transpose() * rows;
        right += Weight() * rows.transpose() * off;
      }
    }
  }

  const Polylines& Lines;
  const PatientHeart& Heart;
  double Rate;
  double Reference;
  const PoseSequence& Poses;
  const SeenPhases& Seen;
  std::vector<std::size_t> Places;
};

/// What is the same for all points of one result.
struct Plan
{
  std::vector<double> times;    ///< of the result, then those that were seen
  std::vector<double> strength; ///< contraction at these, the mean of the clocks
  Eigen::MatrixXd misfit; ///< covariance of the field's misfit between these, zero at the reference
  std::size_t results = 0;
};

Plan MakePlan(double rate, double reference, const std::vector<double>& times,
  const std::vector<double>& seen, const PopulationVector& values)
{
  Plan plan;
  plan.results = times.size();
  plan.times = times;
  plan.times.insert(plan.times.end(), seen.begin(), seen.end());
  std::vector<double> all = plan.times;
  all.push_back(reference);
  for (const double time : all)
  {
    const PopulationClocks clocks = PopulationClocksAt(time, rate, values);
    plan.strength.push_back((clocks.left + clocks.right + clocks.ventricles) / 3.0);
  }
  const auto count = static_cast<Eigen::Index>(all.size());
  Eigen::MatrixXd free(count, count);
  for (Eigen::Index i = 0; i < count; ++i)
  {
    for (Eigen::Index j = 0; j < count; ++j)
    {
      const auto n = static_cast<std::size_t>(i);
      const auto m = static_cast<std::size_t>(j);
      free(i, j) = MisfitCovariance(all[n], plan.strength[n], all[m], plan.strength[m]);
    }
  }
  // Nothing is off at the reference, whose positions are given.
  const Eigen::Index rows = count - 1;
  plan.misfit = free.topLeftCorner(rows, rows) -
    free.topRightCorner(rows, 1) * free.bottomLeftCorner(1, rows) / free(rows, rows);
  return plan;
}

/// Positions and deviations of one point at all times.
struct MovedPoint
{
  Eigen::Matrix3Xd displacement;
  Eigen::VectorXd variance;
  Eigen::VectorXd logCalibre;
};

/// Of one point at the tracked phases that count.
struct SeenPoint
{
  std::vector<Vector3> places;
  std::vector<double> calibre; ///< factor of the radius
};

MovedPoint MovePoint(const Movers& movers, const Plan& plan, const PopulationMatrix& covariance,
  double axisDeviation, const Vector3& place, const SeenPoint& seen)
{
  MovedPoint point;
  Eigen::Matrix<double, Eigen::Dynamic, NumberOfPopulationParameters> derivative;
  Eigen::Matrix3Xd moved;
  movers.Move(place, moved, derivative);
  const auto all = static_cast<Eigen::Index>(plan.times.size());
  const auto results = static_cast<Eigen::Index>(plan.results);
  const Eigen::Index known = all - results;

  // How the errors at two times hang together: of the parameters, the long axis' direction, and the field itself.
  Eigen::MatrixXd errors = plan.misfit;
  for (Eigen::Index i = 0; i < all; ++i)
  {
    const Eigen::Matrix<double, 3, NumberOfPopulationParameters> spread =
      derivative.middleRows<3>(3 * i) * covariance;
    for (Eigen::Index j = 0; j <= i; ++j)
    {
      const double together = spread.cwiseProduct(derivative.middleRows<3>(3 * j)).sum() +
        axisDeviation * axisDeviation * moved.col(i).dot(moved.col(j));
      errors(i, j) += together;
      errors(j, i) = i == j ? errors(i, i) : errors(i, j);
    }
  }
  point.displacement = moved.leftCols(results);
  point.variance = errors.diagonal().head(results);
  point.logCalibre = Eigen::VectorXd::Zero(results);
  if (known > 0)
  {
    // The tracked places are met exactly, and what they were off is off at other times as far as it hangs together.
    Eigen::MatrixXd between = errors.bottomRightCorner(known, known);
    between.diagonal().array() += 1e-9;
    const Eigen::MatrixXd weights =
      between.ldlt().solve(errors.bottomLeftCorner(known, results)); // known x results
    Eigen::Matrix3Xd off(3, known);
    for (Eigen::Index k = 0; k < known; ++k)
    {
      off.col(k) = seen.places[static_cast<std::size_t>(k)] - place - moved.col(results + k);
    }
    point.displacement += off * weights;
    Eigen::VectorXd logarithm(known);
    for (Eigen::Index k = 0; k < known; ++k)
    {
      logarithm[k] = std::log(seen.calibre[static_cast<std::size_t>(k)]);
    }
    point.logCalibre = weights.transpose() * logarithm;
    point.variance -=
      weights.cwiseProduct(errors.bottomLeftCorner(known, results)).colwise().sum().transpose();
  }
  point.variance = point.variance.cwiseMax(0.0);
  return point;
}

void CheckInput(const Polylines& lines, const PatientHeart& heart, double reference,
  const std::vector<double>& times, const PoseSequence* seen)
{
  CheckPolylines(lines);
  Require(std::isfinite(reference), "The reference time is not finite");
  Require(!times.empty(), "There are no times to move to");
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    Require(std::isfinite(times[k]), "A time to move to is not finite");
    Require(k == 0 || times[k] > times[k - 1], "The times to move to do not increase");
  }
  Require(
    heart.length > 0.0 && heart.rightWidth > 0.0, "The heart's length or width is not positive");
  if (seen != nullptr)
  {
    CheckPoseSequence(*seen, lines.points.size());
  }
}
}

const std::array<PopulationParameter, NumberOfPopulationParameters>& PopulationParameters()
{
  return Table;
}

void PopulationMotionSettings::Validate() const
{
  const RequireOf require{ "PopulationMotionSettings" };
  require.Range("heartRate", this->heartRate, 30.0, 180.0);
  require.Range("amplitude", this->amplitude, 0.0, 2.0);
}

PopulationClocks PopulationClocksAt(double time, double heartRate, const PopulationVector& values)
{
  const double cycle = 60000.0 / heartRate;
  const double now = Modulo(time) * cycle;
  const auto at = [&](double peak)
  {
    // However far a parameter is off, there is a systole and a diastole.
    const double limited =
      std::clamp(peak + SystoleSlope * (heartRate - UsualRate), 0.2 * cycle, 0.7 * cycle);
    return Contraction(now, cycle, std::max(limited, Onset + 50.0), values[AtrialShare]);
  };
  return { at(values[LeftPeak] + values[RightLag]), at(values[LeftPeak]),
    at(values[VentricularPeak]) };
}

Vector3 PopulationDisplacement(const PatientHeart& heart, const Vector3& position,
  const PopulationClocks& clocks, const PopulationVector& values)
{
  const Vector3 q = heart.ToHeart(position);
  // 0 at the apex, 1 at the groove and above.
  const double raised = SoftPositive(1.0 - q[2] / heart.length);
  const double height = 1.0 - SoftPositive(1.0 - raised);
  const double above = q[2] < 0.0 ? std::exp(-q[2] * q[2] / (AboveReach * AboveReach)) : 1.0;
  const double rightness = heart.RightShare(q);
  const SegmentPlace root = NearestOnSegment(position, heart.leftOstium, heart.rightOstium);
  const double rootness = std::exp(-0.5 * root.squaredDistance / (RootReach * RootReach));

  const double downwards = height * (1.0 + values[StrainGradient] * (1.0 - height)) *
    (rightness * values[RightExcursion] * clocks.right +
      (1.0 - rightness) * values[LeftExcursion] * clocks.left) *
    (1.0 + values[FrontGradient] * q[1] / FrontDistance);
  const double along =
    (1.0 - rootness) * downwards * above + rootness * values[RootExcursion] * clocks.left;
  const Vector3 axis = heart.axes.row(2).transpose();
  const Vector3 towards = (heart.apex + BeyondApex * axis - position).normalized();
  const Vector3 direction = (axis + values[TowardsApex] * (towards - axis)).normalized();

  const Eigen::Vector2d across = q.head<2>();
  const double distance = std::sqrt(across.squaredNorm() + NearAxis * NearAxis);
  const double inwards =
    4.0 * height * (1.0 - height) * values[WallInwards] * clocks.ventricles * (1.0 - rootness);
  const double twist = (values[ApexTwist] + (values[BaseTwist] - values[ApexTwist]) * height) *
    Degree * clocks.ventricles * (1.0 - rootness) * above;
  const Eigen::Vector2d turned = Eigen::Rotation2Dd(twist) * across;
  const Eigen::Vector2d moved = turned - inwards / distance * turned - across;
  const double still = 1.0 - height;
  const double ascent = values[ApexAscent] * still * still * clocks.left;
  return along * direction + heart.axes.transpose() * Vector3(moved[0], moved[1], -ascent);
}

std::vector<double> PopulationTimes(
  double referenceTime, const std::vector<double>& seen, int count)
{
  Require(count >= 4, "The number of moments must be at least 4");
  Require(std::isfinite(referenceTime), "The reference time is not finite");
  std::vector<double> times = { referenceTime };
  for (const double time : PhasesThatCount(seen, referenceTime).times)
  {
    times.push_back(time);
  }
  const std::size_t fixed = times.size();
  for (int k = 0; k < count; ++k)
  {
    const double time = static_cast<double>(k) / count;
    if (std::none_of(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(fixed),
          [&](double other) { return CyclicDistance(time, other) < 0.4 / count; }))
    {
      times.push_back(time);
    }
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

PoseSequence MoveByPopulation(const Polylines& lines, const PatientHeart& heart,
  double referenceTime, const std::vector<double>& times, const PoseSequence* seen,
  const PopulationMotionSettings& settings, PopulationMotionReport* report,
  const ProgressCallback& progress)
{
  settings.Validate();
  CheckInput(lines, heart, referenceTime, times, seen);
  PopulationMotionReport own;
  PopulationMotionReport& told = report != nullptr ? *report : own;
  told = PopulationMotionReport();
  told.populationMisfit = told.bentMisfit = std::numeric_limits<double>::quiet_NaN();

  Bent bent{ MeanValues(settings.amplitude), PriorCovariance() };
  SeenPhases phases;
  if (seen != nullptr)
  {
    phases = PhasesThatCount(seen->times, referenceTime);
    const Conditioning conditioning(lines, heart, settings.heartRate, referenceTime, *seen, phases);
    if (phases.times.empty())
    {
      told.warnings.emplace_back("the tracked phases show no moment but that of the tree");
    }
    else if (conditioning.Empty())
    {
      told.warnings.emplace_back("no place was tracked: the tracked phases count for nothing");
      phases = {};
    }
    else
    {
      const PopulationVector mean = bent.values;
      bent = conditioning.Solve(mean, bent.covariance);
      told.populationMisfit = conditioning.Misfit(mean);
      told.bentMisfit = conditioning.Misfit(bent.values);
    }
  }
  told.phases = 1 + static_cast<int>(phases.times.size());
  told.mean = bent.values;
  told.deviation = bent.covariance.diagonal().cwiseSqrt();

  const Plan plan = MakePlan(settings.heartRate, referenceTime, times, phases.times, bent.values);
  const Movers movers(heart, settings.heartRate, referenceTime, plan.times, bent.values);
  // Who asks for another amplitude does not know more of the patient: the population's mean is that far off too.
  const Mover usual(heart, settings.heartRate, referenceTime, times, MeanValues(1.0));
  const bool asked = settings.amplitude != 1.0 && phases.times.empty();

  PoseSequence result;
  result.times = times;
  const std::size_t count = lines.points.size();
  result.points.assign(times.size(), lines.points);
  result.confidence.assign(times.size(), std::vector<double>(count, 1.0));
  result.status.assign(times.size(), std::vector<TrackingStatus>(count, TrackingStatus::Filled));
  result.calibre.assign(times.size(), std::vector<double>(count, 1.0));
  told.deviations.assign(times.size(), std::vector<double>(count, 0.0));
  // Per time: the reference itself, a tracked phase, or neither.
  std::vector<bool> isReference;
  std::vector<std::ptrdiff_t> tracked;
  for (const double time : times)
  {
    isReference.push_back(CyclicDistance(time, referenceTime) < 1e-9);
    tracked.push_back(-1);
    for (std::size_t k = 0; k < phases.times.size(); ++k)
    {
      tracked.back() = CyclicDistance(time, phases.times[k]) < 1e-9
        ? static_cast<std::ptrdiff_t>(phases.phases[k])
        : tracked.back();
    }
  }
  ParallelFor(static_cast<std::int64_t>(count), 64,
    [&](std::int64_t first, std::int64_t last)
    {
      Eigen::Matrix3Xd atUsual;
      for (std::int64_t n = first; n < last; ++n)
      {
        const auto i = static_cast<std::size_t>(n);
        SeenPoint places;
        for (const std::size_t phase : phases.phases)
        {
          places.places.push_back(seen->points[phase][i]);
          places.calibre.push_back(seen->calibre.empty() ? 1.0 : seen->calibre[phase][i]);
        }
        const MovedPoint point =
          MovePoint(movers, plan, bent.covariance, heart.axisDeviation, lines.points[i], places);
        if (asked)
        {
          usual.Move(lines.points[i], atUsual);
        }
        for (std::size_t k = 0; k < times.size(); ++k)
        {
          if (isReference[k])
          {
            result.status[k][i] = TrackingStatus::Tracked;
            continue;
          }
          const auto column = static_cast<Eigen::Index>(k);
          const double variance = point.variance[column] +
            (asked ? (atUsual.col(column) - point.displacement.col(column)).squaredNorm() : 0.0);
          const double deviation = std::sqrt(variance);
          told.deviations[k][i] = deviation;
          result.points[k][i] += point.displacement.col(column);
          result.calibre[k][i] = std::exp(point.logCalibre[column]);
          const double off = deviation / ConfidenceScale;
          result.confidence[k][i] = HighestConfidence / (1.0 + off * off);
          if (tracked[k] >= 0)
          {
            const auto phase = static_cast<std::size_t>(tracked[k]);
            result.points[k][i] = seen->points[phase][i];
            result.status[k][i] =
              seen->status.empty() ? TrackingStatus::Tracked : seen->status[phase][i];
            result.confidence[k][i] = seen->confidence.empty() ? 1.0 : seen->confidence[phase][i];
            result.calibre[k][i] = seen->calibre.empty() ? 1.0 : seen->calibre[phase][i];
          }
        }
      }
    });
  Report(progress, 1.0);
  return result;
}

std::string PopulationMotionStatement(int phases, double heartRate, double amplitude)
{
  char text[240];
  const std::string bent =
    phases > 1 ? ", bent to " + std::to_string(phases) + " phases of it" : "";
  const char* form =
    "motion not of this patient: the mean of a population%s, at %.0f beats a minute";
  int size = std::snprintf(text, sizeof text, form, bent.c_str(), heartRate);
  if (amplitude != 1.0)
  {
    std::snprintf(
      text + size, sizeof text - static_cast<std::size_t>(size), ", %.2f times as far", amplitude);
  }
  return text;
}
}
