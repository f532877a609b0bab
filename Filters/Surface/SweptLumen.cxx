#include "SweptLumenBuild.h"

#include "CubicStep.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
/// Where two walls face each other, a rounded minimum of radius k lies this many k above both.
const double RoundedDepth = 1.0 - std::sqrt(0.5);

/// Intersection of two half-spaces' complements with a rounded edge: used where tubes give way.
struct RoundUnion
{
  RoundUnion(double a, double b, double k)
  {
    const double u = std::max(0.0, k - a);
    const double v = std::max(0.0, k - b);
    const double root = std::sqrt(u * u + v * v);
    this->value = std::max(k, std::min(a, b)) - root;
    this->shares[0] = root > 0.0 ? u / root : (a <= b ? 1.0 : 0.0);
    this->shares[1] = root > 0.0 ? v / root : (a <= b ? 0.0 : 1.0);
  }
  double value;
  double shares[2];
};
}

SweptLumen::SweptLumen(const VesselTree& tree, const SweepSections& sections,
  const SweepSettings& settings, const std::vector<SweepRelief>& reliefs,
  const std::vector<SweepOmission>& leftOut)
  : Clearance(settings.clearance)
{
  Build build(tree, sections, settings, reliefs, *this);
  build.Check();
  build.FindLinks();
  for (const SweepOmission& omission : leftOut)
  {
    build.LeaveOut(omission);
  }
  do
  {
    this->VesselList.clear();
    this->SpanList.clear();
    this->JunctionList.clear();
    this->TipList.clear();
    build.nodes.clear();
    build.Connect();
    build.MakeVessels();
  } while (!build.CutJunctions());
  for (const Build::Link& link : build.links)
  {
    if (link.alive)
    {
      this->SweptPointList.insert(
        this->SweptPointList.end(), link.points.begin(), link.points.end());
    }
  }
  std::sort(this->SweptPointList.begin(), this->SweptPointList.end());
  build.SplitFolds();
  build.FinishJunctions();
  build.LimitEnds();
  build.FindNeighbours();
}

int SweptLumen::GroupAt(int vessel, double s) const
{
  const Vessel& v = this->VesselList[vessel];
  std::size_t i = 0;
  while (i + 1 < v.group.size() && s > v.groupEnd[i])
  {
    ++i;
  }
  return v.group[i];
}

void SweptLumen::EvaluateJunction(
  const Vector3& position, const Junction& junction, Sample& sample) const
{
  constexpr std::size_t most = 16;
  VesselAxis::Sample tubes[most];
  const std::size_t count = std::min(most, junction.ranges.size());
  std::size_t best = 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    const Range& range = junction.ranges[i];
    const VesselAxis& axis = *this->VesselList[range.vessel].axis;
    double distance = 0.0;
    const int piece = axis.NearestPiece(position, range.firstPiece, range.lastPiece, distance);
    axis.Evaluate(position, piece, tubes[i]);
    if (tubes[i].distance < tubes[best].distance)
    {
      best = i;
    }
  }
  sample.distance = tubes[best].distance;
  sample.gradient = tubes[best].gradient;
  sample.radius = tubes[best].radius;
  sample.curvature = tubes[best].curvature;
  sample.vessel = junction.ranges[best].vessel;
  sample.s = tubes[best].s;
  for (const Fillet& fillet : junction.fillets)
  {
    if (fillet.first >= static_cast<int>(count) || fillet.second >= static_cast<int>(count))
    {
      continue;
    }
    const VesselAxis::Sample& a = tubes[fillet.first];
    const VesselAxis::Sample& b = tubes[fillet.second];
    // A vessel and one that leaves its side: the union with a circular minimum,
    // k - |(k - a, k - b)|. In an acute wedge it is an ellipse with a sharp vertex; there the ball
    // that touches both walls, taken as planes, takes its place, with a radius that lets it begin
    // at the same depth. Of vessels that all end in the node none is wider there: always the ball.
    Vector3 fade = Vector3::Zero();
    const double round =
      std::min(fillet.RadiusAt(position, &fade), junction.maximumFillet * fillet.calibre);
    const double reach = std::max(round, MinimumFillet * fillet.calibre);
    if (std::max(a.distance, b.distance) > reach)
    {
      continue;
    }
    const double cosine = std::clamp(
      a.gradient.dot(b.gradient) / std::sqrt(a.gradient.squaredNorm() * b.gradient.squaredNorm()),
      -0.9998, 0.9998);
    const double sine = std::sqrt(0.5 * (1.0 + cosine)); // of half the angle between the walls
    const double bent = fillet.rounded ? std::min(0.0, cosine) : cosine;
    const double scale = 1.0 / (1.0 - bent * bent);
    const double widening = cosine < 0.0 ? RoundedDepth / (1.0 - sine) : 1.0;
    double k = widening * round;
    double minimum = MinimumFillet * fillet.calibre;
    if (cosine < 0.0)
    {
      minimum = std::min(minimum, this->EdgeRetreat * fillet.calibre * sine / (1.0 - sine));
    }
    if (minimum > k)
    {
      // Two walls that come close without meeting have no edge between them. Where the planes
      // meet, the walls must do so too.
      const double outside = std::max(a.distance, b.distance);
      double open = 1.0;
      if (outside > 0.01 * minimum)
      {
        const double toA = (a.distance - bent * b.distance) * scale;
        const double toB = (b.distance - bent * a.distance) * scale;
        const Vector3 edge = position - toA * a.gradient - toB * b.gradient;
        VesselAxis::Sample there;
        double gap = 0.0;
        for (const int side : { fillet.first, fillet.second })
        {
          this->VesselList[junction.ranges[side].vessel].axis->Evaluate(
            edge, tubes[side].piece, there);
          gap = std::max(gap, there.distance);
        }
        open = CubicStep((0.8 - gap / outside) / 0.35);
      }
      if (minimum * open > k)
      {
        k = minimum * open;
        fade.setZero();
      }
    }
    if (k <= 1e-3 * fillet.calibre)
    {
      continue;
    }
    const double u = k - a.distance;
    const double v = k - b.distance;
    const double p = (u - bent * v) * scale;
    const double q = (v - bent * u) * scale;
    if (p <= 0.0 || q <= 0.0)
    {
      continue;
    }
    const double away = std::sqrt(std::max(0.0, p * u + q * v));
    // Far inside, the two planes are no longer what is there.
    const double value = std::max(k - away, std::min(a.distance, b.distance) - k);
    if (value < sample.distance - 1e-12)
    {
      sample.distance = value;
      sample.gradient =
        (p * a.gradient + q * b.gradient) / away + (1.0 - (p + q) / away) * widening * fade;
      const double bend =
        bent < cosine ? (1.0 - cosine) / std::sqrt(1.0 + cosine) : 1.0; // a ball's is 1 / k
      sample.curvature = std::max(bend / k, std::min(a.curvature, b.curvature));
    }
  }
}

double SweptLumen::Fillet::RadiusAt(const Vector3& position, Vector3* gradient) const
{
  if (this->radius <= 0.0)
  {
    return 0.0;
  }
  const Vector3 offset = position - this->centre;
  const double distance = offset.norm();
  const double x = 2.5 * (1.0 - distance / this->reach);
  if (gradient != nullptr && x > 0.0 && x < 1.0)
  {
    *gradient = -this->radius * 6.0 * x * (1.0 - x) * 2.5 /
      (this->reach * std::max(1e-12, distance)) * offset;
  }
  return this->radius * CubicStep(x);
}

void SweptLumen::GiveWay(const Vector3& position, int part, Sample& sample) const
{
  const auto& ranges = this->Neighbours[part];
  if (ranges.empty())
  {
    return;
  }
  VesselAxis::Sample nearest;
  nearest.distance = std::numeric_limits<double>::max();
  for (const Range& range : ranges)
  {
    int low = range.firstPiece;
    int high = range.lastPiece;
    const VesselAxis& axis = *this->VesselList[range.vessel].axis;
    if (range.vessel == sample.vessel)
    {
      // Its own surroundings are no neighbour.
      const double own = 4.0 * sample.radius;
      if (sample.s - own < range.high && sample.s + own > range.low)
      {
        if (sample.s > 0.5 * (range.low + range.high))
        {
          high = std::min(high, axis.PieceAt(sample.s - own));
        }
        else
        {
          low = std::max(low, axis.PieceAt(sample.s + own));
        }
        if (high < low)
        {
          continue;
        }
      }
    }
    double distance = 0.0;
    const int piece = axis.NearestPiece(position, low, high, distance);
    if (distance < nearest.distance + 0.2 && distance < 1.5 * sample.radius)
    {
      VesselAxis::Sample tube;
      axis.Evaluate(position, piece, tube);
      if (tube.distance < nearest.distance)
      {
        nearest = tube;
      }
    }
  }
  if (nearest.distance > 1e100)
  {
    return;
  }
  const double smaller = std::min(sample.radius, nearest.radius);
  // The plane half way between both, rounded where it begins.
  const double k = 0.1 * smaller;
  const double half = 0.5 * (sample.distance - nearest.distance + this->Clearance * smaller);
  const RoundUnion both(-sample.distance, -half, k);
  if (-both.value > sample.distance + 1e-12)
  {
    sample.distance = -both.value;
    sample.gradient = both.shares[0] * sample.gradient +
      both.shares[1] * 0.5 * (sample.gradient - nearest.gradient);
  }
}

void SweptLumen::Evaluate(const Vector3& position, Site& site, Sample& sample) const
{
  for (int move = 0;; ++move)
  {
    if (site.part >= 0)
    {
      const Span& span = this->SpanList[site.part];
      VesselAxis::Sample tube;
      this->VesselList[span.vessel].axis->Evaluate(position, site.piece, tube);
      site.piece = tube.piece;
      sample.distance = tube.distance;
      sample.gradient = tube.gradient;
      sample.radius = tube.radius;
      sample.curvature = tube.curvature;
      sample.vessel = span.vessel;
      sample.s = tube.s;
      if (move < 4)
      {
        if (tube.s < span.cutFrom && span.startJunction >= 0)
        {
          site.part = -1 - span.startJunction;
          continue;
        }
        if (tube.s > span.cutTo && span.endJunction >= 0)
        {
          site.part = -1 - span.endJunction;
          continue;
        }
      }
      this->GiveWay(position, site.part, sample);
      return;
    }
    const int index = -1 - site.part;
    const Junction& junction = this->JunctionList[index];
    this->EvaluateJunction(position, junction, sample);
    bool moved = false;
    if (move < 4)
    {
      for (const Arm& arm : junction.arms)
      {
        const Span& span = this->SpanList[arm.span];
        if (span.vessel == sample.vessel &&
          (arm.atStart ? sample.s > arm.cut && sample.s < span.to + 1e-9
                       : sample.s < arm.cut && sample.s > span.from - 1e-9))
        {
          site.part = arm.span;
          site.piece = this->VesselList[span.vessel].axis->PieceAt(sample.s);
          moved = true;
          break;
        }
      }
    }
    if (!moved)
    {
      this->GiveWay(position, static_cast<int>(this->SpanList.size()) + index, sample);
      return;
    }
  }
}

void SweptLumen::EvaluateJunctionAt(const Vector3& position, int junction, Sample& sample) const
{
  this->EvaluateJunction(position, this->JunctionList[junction], sample);
  this->GiveWay(position, static_cast<int>(this->SpanList.size()) + junction, sample);
}

double SweptLumen::Project(Vector3& position, Site& site, Sample& sample) const
{
  this->Evaluate(position, site, sample);
  for (int iteration = 0; iteration < 12; ++iteration)
  {
    if (std::abs(sample.distance) < 1e-7 * sample.radius)
    {
      break;
    }
    const double square = sample.gradient.squaredNorm();
    if (square < 1e-4)
    {
      break;
    }
    Vector3 move = sample.gradient * (-sample.distance / square);
    const double length = move.norm();
    const double limit = 0.4 * sample.radius;
    if (length > limit)
    {
      move *= limit / length;
    }
    position += move;
    this->Evaluate(position, site, sample);
  }
  return std::abs(sample.distance);
}

double SweptLumen::ProjectToTip(
  Vector3& position, Site& site, Sample& sample, int tip, bool rim) const
{
  const Tip& end = this->TipList[tip];
  position -= (position - end.centre).dot(end.normal) * end.normal;
  this->Evaluate(position, site, sample);
  if (!rim)
  {
    return 0.0;
  }
  for (int iteration = 0; iteration < 12; ++iteration)
  {
    if (std::abs(sample.distance) < 1e-7 * sample.radius)
    {
      break;
    }
    const Vector3 within = sample.gradient - sample.gradient.dot(end.normal) * end.normal;
    const double square = within.squaredNorm();
    if (square < 1e-4)
    {
      break;
    }
    position -= sample.distance / square * within;
    position -= (position - end.centre).dot(end.normal) * end.normal;
    this->Evaluate(position, site, sample);
  }
  return std::abs(sample.distance);
}
}
