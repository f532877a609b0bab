#include "SweptLumenBuild.h"

#include "Numbers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr int RingSamples = 16;
/// Tubes bent more than this (radius times curvature) are not meshed ring by ring.
constexpr double MaximumBend = 0.75;
/// A junction's arms are cut where other walls are a fillet's radius and this many radii away.
constexpr double CutMargin = 0.45;
/// Fillets end this many radii of the greater and of the smaller vessel away from the node, and
/// begin to fade at 60 % of it: vessels that part in an acute angle get no web along their sides.
constexpr double FilletReachGreater = 1.5;
constexpr double FilletReachSmaller = 2.5;

std::string Where(const Vector3& p)
{
  std::ostringstream text;
  text.precision(6);
  text << "(" << p[0] << ", " << p[1] << ", " << p[2] << ")";
  return text.str();
}
}

SweptLumen::Range SweptLumen::Build::MakeRange(int vessel, double low, double high) const
{
  const VesselAxis& axis = *self.VesselList[vessel].axis;
  low = std::max(0.0, low);
  high = std::min(axis.Length(), high);
  return { vessel, axis.PieceAt(low), axis.PieceAt(high), low, high };
}

double SweptLumen::Build::RangeDistance(const Range& range, const Vector3& x) const
{
  double distance = 0.0;
  self.VesselList[range.vessel].axis->NearestPiece(x, range.firstPiece, range.lastPiece, distance);
  return distance;
}

SweptLumen::Fillet SweptLumen::Build::FindFillet(
  const Junction& junction, int first, int second) const
{
  Fillet fillet{ -1, -1, 0.0, 0.0, junction.centre, 1.0, false };
  for (const int member : junction.members)
  {
    const Node& node = this->nodes[member];
    double calibre[2] = { 0.0, 0.0 };
    bool through[2] = { false, false };
    for (const auto& entry : node.vessels)
    {
      for (const int side : { 0, 1 })
      {
        if (entry.first == (side == 0 ? first : second))
        {
          const double length = self.VesselList[entry.first].axis->Length();
          calibre[side] = this->CalibreAt(entry.first, entry.second);
          through[side] = entry.second > 0.0 && entry.second < length;
        }
      }
    }
    if (calibre[0] <= 0.0 || calibre[1] <= 0.0)
    {
      continue;
    }
    // A side vessel's fillet has its own measure, even where it is wider than its parent.
    const double child = through[0] == through[1] ? std::min(calibre[0], calibre[1])
      : through[0]                                ? calibre[1]
                                                  : calibre[0];
    const double parent = calibre[0] + calibre[1] - child;
    // Vessels that come out of a third one are joined by it.
    fillet.rounded = through[0] != through[1];
    bool sides = !through[0] && !through[1];
    if (sides)
    {
      sides = std::any_of(node.vessels.begin(), node.vessels.end(),
        [&](const std::pair<int, double>& entry) {
          return entry.second > 0.0 && entry.second < self.VesselList[entry.first].axis->Length();
        });
    }
    fillet.calibre = child;
    fillet.radius = sides ? 0.0 : this->BlendingAt(node.point) * child;
    fillet.centre = node.point;
    fillet.reach = FilletReachGreater * parent + FilletReachSmaller * child;
  }
  return fillet;
}

double SweptLumen::Build::CalibreAt(int vessel, double s) const
{
  const VesselAxis& axis = *self.VesselList[vessel].axis;
  return axis.At(std::clamp(s, 0.0, axis.Length())).radius;
}

std::vector<SweptLumen::Range> SweptLumen::Build::WideRanges(
  const Junction& junction, double reach) const
{
  std::map<int, std::pair<double, double>> extent;
  const auto grow = [&](int vessel, double low, double high)
  {
    const auto found = extent.find(vessel);
    if (found == extent.end())
    {
      extent[vessel] = { low, high };
    }
    else
    {
      found->second.first = std::min(found->second.first, low);
      found->second.second = std::max(found->second.second, high);
    }
  };
  for (const Arm& arm : junction.arms)
  {
    const Span& span = self.SpanList[arm.span];
    if (arm.atStart)
    {
      grow(span.vessel, span.from, std::min(span.to, span.from + reach));
    }
    else
    {
      grow(span.vessel, std::max(span.from, span.to - reach), span.to);
    }
  }
  for (const int s : junction.nodes)
  {
    const Span& span = self.SpanList[s];
    grow(span.vessel, span.from, span.to);
  }
  std::vector<Range> ranges;
  ranges.reserve(extent.size());
  for (const auto& e : extent)
  {
    ranges.push_back(this->MakeRange(e.first, e.second.first, e.second.second));
  }
  return ranges;
}

bool SweptLumen::Build::IsClear(const Span& span, double s, const Junction& junction,
  const std::vector<Range>& others, double share) const
{
  const VesselAxis& axis = *self.VesselList[span.vessel].axis;
  const Station station = axis.At(s);
  if (station.curvature.norm() * station.radius > MaximumBend)
  {
    return false;
  }
  // Nor may the ring lie in a fold of its own tube, whose inner side belongs to both of its legs.
  const int last = axis.PieceAt(std::min(axis.Length(), s + share * station.radius));
  for (int i = axis.PieceAt(std::max(0.0, s - share * station.radius)); i <= last; ++i)
  {
    const Station& near = axis.AllStations()[i];
    if (near.curvature.norm() * near.radius > MaximumBend)
    {
      return false;
    }
  }
  for (const Range& range : others)
  {
    if (range.vessel == span.vessel)
    {
      continue;
    }
    const double centre = this->RangeDistance(range, station.point);
    if (centre > 3.0 * station.radius)
    {
      continue;
    }
    const Fillet fillet = this->FindFillet(junction, span.vessel, range.vessel);
    for (int k = 0; k < RingSamples; ++k)
    {
      const Vector3 x = axis.WallPoint(s, 2.0 * Pi * k / RingSamples);
      double distance = 0.0;
      const VesselAxis& other = *self.VesselList[range.vessel].axis;
      const int piece = other.NearestPiece(x, range.firstPiece, range.lastPiece, distance);
      const double smaller = std::min(station.radius, other.AllStations()[piece].radius);
      const double rounding = std::max(MinimumFillet * smaller, fillet.RadiusAt(x));
      if (distance < share * (rounding + CutMargin * smaller))
      {
        return false;
      }
    }
  }
  return true;
}

double SweptLumen::Build::FindCut(const Span& span, bool atStart, const Junction& junction,
  const std::vector<Range>& others, double share, double away) const
{
  const double length = span.to - span.from;
  while (away < length)
  {
    const double s = atStart ? span.from + away : span.to - away;
    const double r = this->CalibreAt(span.vessel, s);
    if (this->IsClear(span, s, junction, others, share))
    {
      const double further = std::min(length, away + 0.4 * r);
      if (this->IsClear(
            span, atStart ? span.from + further : span.to - further, junction, others, share))
      {
        return away;
      }
    }
    away += 0.12 * r;
  }
  return -1.0;
}

double SweptLumen::Build::FindCut(const Arm& arm, const Junction& junction,
  const std::vector<Range>& others, double away, double& taken) const
{
  const Span& span = self.SpanList[arm.span];
  const bool toTip = arm.atStart ? span.endTip >= 0 : span.startTip >= 0;
  const double spare =
    toTip ? 0.25 * this->CalibreAt(span.vessel, arm.atStart ? span.to : span.from) : 0.0;
  for (const double share : { 1.0, 0.6, 0.3, 0.1 })
  {
    const double found = this->FindCut(span, arm.atStart, junction, others, share, away);
    if (found >= 0.0 && found < span.to - span.from - spare)
    {
      taken = share;
      return found;
    }
  }
  return -1.0;
}

bool SweptLumen::Build::CutJunctions()
{
  std::vector<int> owner(self.JunctionList.size());
  std::iota(owner.begin(), owner.end(), 0);
  for (;;)
  {
    bool merged = false;
    for (std::size_t j = 0; j < self.JunctionList.size(); ++j)
    {
      Junction& junction = self.JunctionList[j];
      if (junction.arms.empty())
      {
        continue;
      }
      double widest = 0.0;
      for (const Arm& arm : junction.arms)
      {
        const Span& span = self.SpanList[arm.span];
        widest = std::max(widest, this->CalibreAt(span.vessel, arm.atStart ? span.from : span.to));
      }
      const std::vector<Range> wide = this->WideRanges(junction, 15.0 * widest);
      // A thin vessel that leaves a thick one lies hidden in it at first: the thick one is not
      // clear before the place where the thin one has come out.
      std::vector<double> found;
      double share = 1.0;
      junction.share = 1.0;
      for (const Arm& arm : junction.arms)
      {
        found.push_back(this->FindCut(arm, junction, wide, 0.0, share));
      }
      for (std::size_t a = 0; a < junction.arms.size(); ++a)
      {
        Arm& arm = junction.arms[a];
        Span& span = self.SpanList[arm.span];
        const VesselAxis& axis = *self.VesselList[span.vessel].axis;
        double begin = std::max(0.0, found[a]);
        for (std::size_t b = 0; b < junction.arms.size() && found[a] >= 0.0; ++b)
        {
          const Arm& other = junction.arms[b];
          const Span& side = self.SpanList[other.span];
          if (side.vessel == span.vessel || found[b] < 0.0)
          {
            continue;
          }
          const VesselAxis& sideAxis = *self.VesselList[side.vessel].axis;
          for (double t = 0.0;; t += 0.3 * this->CalibreAt(side.vessel, side.from))
          {
            const double limited = std::min(t, found[b]);
            const double s = axis.NearestArcLength(
              sideAxis.At(other.atStart ? side.from + limited : side.to - limited).point);
            if (s > span.from && s < span.to)
            {
              begin = std::max(begin, arm.atStart ? s - span.from : span.to - s);
            }
            if (t >= found[b])
            {
              break;
            }
          }
        }
        double away = found[a] < 0.0 ? -1.0 : this->FindCut(arm, junction, wide, begin, share);
        junction.share = away < 0.0 ? junction.share : std::min(junction.share, share);
        const bool toTip = arm.atStart ? span.endTip >= 0 : span.startTip >= 0;
        if (away < 0.0 && toTip)
        {
          this->MendStub(arm, wide);
          return false;
        }
        if (away < 0.0)
        {
          away = span.to - span.from; // the junction at the other end is part of this one
        }
        arm.cut = arm.atStart ? span.from + away : span.to - away;
        (arm.atStart ? span.cutFrom : span.cutTo) = arm.cut;
      }
    }
    for (std::size_t i = 0; i < self.SpanList.size() && !merged; ++i)
    {
      Span& span = self.SpanList[i];
      if (span.inner || span.startJunction < 0 || span.endJunction < 0)
      {
        continue;
      }
      const double r =
        std::min(this->CalibreAt(span.vessel, span.from), this->CalibreAt(span.vessel, span.to));
      if (span.cutFrom + 0.6 * r > span.cutTo)
      {
        this->Merge(static_cast<int>(i));
        merged = true;
      }
    }
    if (!merged)
    {
      return true;
    }
  }
}

void SweptLumen::Build::Merge(int spanIndex)
{
  Span& span = self.SpanList[spanIndex];
  span.inner = true;
  const int into = span.startJunction;
  const int from = span.endJunction;
  Junction& a = self.JunctionList[into];
  Junction& b = self.JunctionList[from];
  const auto isThis = [&](const Arm& arm) { return arm.span == spanIndex; };
  a.arms.erase(std::remove_if(a.arms.begin(), a.arms.end(), isThis), a.arms.end());
  b.arms.erase(std::remove_if(b.arms.begin(), b.arms.end(), isThis), b.arms.end());
  a.nodes.push_back(spanIndex);
  a.nodes.insert(a.nodes.end(), b.nodes.begin(), b.nodes.end());
  a.members.insert(a.members.end(), b.members.begin(), b.members.end());
  b.members.clear();
  a.arms.insert(a.arms.end(), b.arms.begin(), b.arms.end());
  b.arms.clear();
  b.nodes.clear();
  for (Span& other : self.SpanList)
  {
    other.startJunction = other.startJunction == from ? into : other.startJunction;
    other.endJunction = other.endJunction == from ? into : other.endJunction;
  }
}

void SweptLumen::Build::MendStub(const Arm& arm, const std::vector<Range>& others)
{
  const Span& span = self.SpanList[arm.span];
  const Vessel& vessel = self.VesselList[span.vessel];
  const VesselAxis& axis = *vessel.axis;
  const Tip& tip = self.TipList[arm.atStart ? span.endTip : span.startTip];
  bool hidden = true;
  for (int k = 0; k < RingSamples && hidden; ++k)
  {
    const Vector3 x = axis.WallPoint(arm.atStart ? span.to : span.from, 2.0 * Pi * k / RingSamples);
    double nearest = std::numeric_limits<double>::max();
    for (const Range& range : others)
    {
      if (range.vessel != span.vessel)
      {
        nearest = std::min(nearest, this->RangeDistance(range, x));
      }
    }
    hidden = nearest < 0.0;
  }
  const Incidence at = this->incidences[tip.point][0];
  const std::int64_t count = std::count(this->extended.begin(), this->extended.end(), tip.point);
  if (hidden || count >= 8)
  {
    this->links[at.link].alive = false;
    AddLeftOut(self.LeftOutList, self.RemarkList, this->input, tip.group,
      "it ends inside the vessel it comes from, or runs along it to its end",
      arm.atStart ? axis.At(span.from).point : axis.At(span.to).point, span.to - span.from);
    return;
  }
  if (count == 0)
  {
    this->Repaired(tip.group, "ends before it has left its parent; lengthened", tip.centre);
  }
  this->extended.push_back(tip.point);
  const Vector3 outward = arm.atStart ? axis.At(axis.Length()).tangent : -axis.At(0.0).tangent;
  this->points[tip.point] += 0.75 * tip.radius * outward;
}

Vector3 SweptLumen::Build::EndNormal(std::int64_t point, const Vector3& outward) const
{
  if (this->sections.endNormals.empty() || this->sections.endNormals[point].squaredNorm() == 0.0)
  {
    return outward;
  }
  Vector3 normal = this->sections.endNormals[point].normalized();
  normal *= normal.dot(outward) < 0.0 ? -1.0 : 1.0;
  if (normal.dot(outward) < 0.5)
  {
    throw std::invalid_argument("SweepVesselTree: the plane of the end at " +
      Where(this->points[point]) + " is " +
      std::to_string(static_cast<int>(std::lround(std::acos(normal.dot(outward)) * 180.0 / Pi))) +
      " degrees off the cross-section, at most 60 are possible");
  }
  return normal;
}

void SweptLumen::Build::LimitEnds()
{
  for (Tip& tip : self.TipList)
  {
    const Span& span = self.SpanList[tip.span];
    const VesselAxis& axis = *self.VesselList[span.vessel].axis;
    const bool atStart = span.startTip >= 0 && &self.TipList[span.startTip] == &tip;
    const Vector3 outward =
      atStart ? Vector3(-axis.At(span.from).tangent) : Vector3(axis.At(span.to).tangent);
    const double room = 0.6 * (span.cutTo - span.cutFrom);
    const double cosine = std::clamp(tip.normal.dot(outward), -1.0, 1.0);
    const double allowed = std::atan(room / tip.radius);
    const double angle = std::acos(cosine);
    if (angle > allowed)
    {
      const Vector3 side = (tip.normal - cosine * outward).normalized();
      tip.normal = std::cos(allowed) * outward + std::sin(allowed) * side;
      this->Repaired(tip.group,
        "the plane of its end would cut a junction; turned towards the cross-section", tip.centre);
    }
  }
}

void SweptLumen::Build::FinishJunctions()
{
  for (Junction& junction : self.JunctionList)
  {
    if (junction.arms.empty())
    {
      continue;
    }
    std::map<int, std::pair<double, double>> extent;
    junction.minimumRadius = std::numeric_limits<double>::max();
    const auto grow = [&](int vessel, double a, double b)
    {
      const double low = std::min(a, b);
      const double high = std::max(a, b);
      const auto found = extent.emplace(vessel, std::make_pair(low, high)).first;
      found->second.first = std::min(found->second.first, low);
      found->second.second = std::max(found->second.second, high);
    };
    std::map<int, std::vector<int>> vesselsAtNode;
    for (const Arm& arm : junction.arms)
    {
      const Span& span = self.SpanList[arm.span];
      const double r = this->CalibreAt(span.vessel, arm.cut);
      grow(span.vessel, arm.atStart ? span.from : span.to,
        arm.atStart ? arm.cut + 2.0 * r : arm.cut - 2.0 * r);
    }
    for (const int s : junction.nodes)
    {
      grow(self.SpanList[s].vessel, self.SpanList[s].from, self.SpanList[s].to);
    }
    junction.ranges.clear();
    for (const auto& e : extent)
    {
      junction.ranges.push_back(this->MakeRange(e.first, e.second.first, e.second.second));
      for (double s = e.second.first;; s += 0.3 * junction.minimumRadius)
      {
        const double at = std::min(s, e.second.second);
        const double r = this->CalibreAt(e.first, at);
        junction.minimumRadius = std::min(junction.minimumRadius, r);
        if (s >= e.second.second)
        {
          break;
        }
      }
    }
    // A fillet must end before the cuts, where the gap is known.
    junction.maximumFillet =
      std::max(0.02, 0.9 * junction.share * (this->settings.blending + CutMargin) - 0.05);
    junction.fillets.clear();
    for (int a = 0; a < static_cast<int>(junction.ranges.size()); ++a)
    {
      for (int b = a + 1; b < static_cast<int>(junction.ranges.size()); ++b)
      {
        Fillet fillet =
          this->FindFillet(junction, junction.ranges[a].vessel, junction.ranges[b].vessel);
        fillet.first = a;
        fillet.second = b;
        if (fillet.calibre <= 0.0)
        {
          fillet.calibre = std::min(this->SideCalibre(junction.ranges[a], junction.ranges[b]),
            this->SideCalibre(junction.ranges[b], junction.ranges[a]));
        }
        junction.fillets.push_back(fillet);
      }
    }
  }
}

double SweptLumen::Build::SideCalibre(const Range& range, const Range& other) const
{
  const VesselAxis& axis = *self.VesselList[range.vessel].axis;
  double best = std::numeric_limits<double>::max();
  double r = this->CalibreAt(range.vessel, range.low);
  for (int i = range.firstPiece; i <= range.lastPiece; ++i)
  {
    const Station& station = axis.AllStations()[i];
    const double off = std::abs(this->RangeDistance(other, station.point));
    if (off < best)
    {
      best = off;
      r = station.radius;
    }
  }
  return r;
}

void SweptLumen::Build::SplitFolds()
{
  for (std::size_t i = 0; i < self.SpanList.size(); ++i)
  {
    if (self.SpanList[i].inner)
    {
      continue;
    }
    const int v = self.SpanList[i].vessel;
    const VesselAxis& axis = *self.VesselList[v].axis;
    double low = -1.0;
    double high = -1.0;
    const Span span = self.SpanList[i];
    for (const Station& station : axis.AllStations())
    {
      if (station.s <= span.cutFrom || station.s >= span.cutTo)
      {
        continue;
      }
      const bool folds = station.curvature.norm() * station.radius > MaximumBend;
      if (folds && low < 0.0)
      {
        low = station.s - station.radius;
      }
      if (folds)
      {
        high = station.s + station.radius;
      }
      else if (low >= 0.0 && station.s > high)
      {
        break;
      }
    }
    if (low < 0.0)
    {
      continue;
    }
    const double r = this->CalibreAt(v, 0.5 * (low + high));
    const bool atTipStart = span.startTip >= 0 && low < span.cutFrom + 0.5 * r;
    const bool atTipEnd = span.endTip >= 0 && high > span.cutTo - 0.5 * r;
    if (atTipStart)
    {
      low = span.cutFrom + 0.3 * r;
    }
    if (atTipEnd)
    {
      high = span.cutTo - 0.3 * r;
    }
    if (high - low < 0.3 * r)
    {
      continue;
    }
    const auto moveArm = [&](int junction, bool atStart, double cut)
    {
      for (Arm& arm : self.JunctionList[junction].arms)
      {
        if (arm.span == static_cast<int>(i) && arm.atStart == atStart)
        {
          arm.cut = cut;
        }
      }
    };
    if (span.startJunction >= 0 && low < span.cutFrom + 0.5 * r)
    {
      if (span.endJunction >= 0 && high > span.cutTo - 0.5 * r)
      {
        continue; // nothing straight is left between two junctions; rings have to do
      }
      if (!(high > span.cutFrom))
      {
        continue; // what is left before the tip is too short to be cut
      }
      moveArm(span.startJunction, true, high);
      self.SpanList[i].cutFrom = high;
      --i;
      continue;
    }
    if (span.endJunction >= 0 && high > span.cutTo - 0.5 * r)
    {
      if (!(low < span.cutTo))
      {
        continue;
      }
      moveArm(span.endJunction, false, low);
      self.SpanList[i].cutTo = low;
      --i;
      continue;
    }
    const int junction = static_cast<int>(self.JunctionList.size());
    const int second = static_cast<int>(self.SpanList.size());
    Span tail = span;
    tail.from = 0.5 * (low + high);
    tail.startJunction = junction;
    tail.startTip = -1;
    tail.cutFrom = high;
    Span& head = self.SpanList[i];
    head.to = 0.5 * (low + high);
    head.endJunction = junction;
    head.endTip = -1;
    head.cutTo = low;
    self.SpanList.push_back(tail);
    self.JunctionList.emplace_back();
    self.JunctionList.back().centre = axis.At(0.5 * (low + high)).point;
    self.JunctionList.back().arms = { { static_cast<int>(i), false, low }, { second, true, high } };
    if (tail.endJunction >= 0)
    {
      for (Arm& arm : self.JunctionList[tail.endJunction].arms)
      {
        if (arm.span == static_cast<int>(i) && !arm.atStart)
        {
          arm.span = second;
        }
      }
    }
    if (tail.endTip >= 0)
    {
      self.TipList[tail.endTip].span = second;
    }
  }
}

int SweptLumen::Build::PartOf(int vessel, double s) const
{
  for (std::size_t i = 0; i < self.SpanList.size(); ++i)
  {
    const Span& span = self.SpanList[i];
    if (span.vessel != vessel || s < span.from || s > span.to)
    {
      continue;
    }
    const int p = static_cast<int>(i);
    if (span.inner)
    {
      return -1 - span.startJunction;
    }
    return s < span.cutFrom ? -1 - span.startJunction : s > span.cutTo ? -1 - span.endJunction : p;
  }
  return 0;
}

void SweptLumen::Build::FindNeighbours()
{
  struct Bead
  {
    Vector3 centre;
    double reach; // half the piece's length and the radius
    double radius;
    double s;
    int vessel;
    int piece;
    int part;
  };
  std::vector<Bead> beads;
  for (std::size_t v = 0; v < self.VesselList.size(); ++v)
  {
    const VesselAxis& axis = *self.VesselList[v].axis;
    for (int i = 0; i < axis.Pieces(); ++i)
    {
      const Station& p = axis.AllStations()[i];
      const Station& q = axis.AllStations()[i + 1];
      const double r = std::max(p.radius, q.radius);
      const double s = 0.5 * (p.s + q.s);
      beads.push_back({ 0.5 * (p.point + q.point), 0.5 * (q.s - p.s) + r, r, s, static_cast<int>(v),
        i, this->PartOf(static_cast<int>(v), s) });
    }
  }
  std::sort(beads.begin(), beads.end(),
    [](const Bead& a, const Bead& b)
    {
      return a.centre[0] != b.centre[0] ? a.centre[0] < b.centre[0]
                                        : std::tie(a.vessel, a.piece) < std::tie(b.vessel, b.piece);
    });
  double widest = 0.0;
  for (const Bead& bead : beads)
  {
    widest = std::max(widest, bead.reach);
  }
  const int spans = static_cast<int>(self.SpanList.size());
  const auto slot = [&](int part) { return part >= 0 ? part : spans - 1 - part; };
  std::vector<std::map<int, std::vector<int>>> found(
    spans + self.JunctionList.size()); // vessel to pieces
  const auto joined = [&](const Bead& a, const Bead& b)
  {
    if (a.vessel == b.vessel && std::abs(a.s - b.s) < 6.0 * std::max(a.radius, b.radius))
    {
      return true;
    }
    for (const Bead* bead : { &a, &b })
    {
      if (bead->part >= 0)
      {
        continue;
      }
      const Bead& other = bead == &a ? b : a;
      for (const Range& range : self.JunctionList[-1 - bead->part].ranges)
      {
        if (range.vessel == other.vessel && other.s > range.low - other.radius &&
          other.s < range.high + other.radius)
        {
          return true;
        }
      }
    }
    return false;
  };
  for (std::size_t i = 0; i < beads.size(); ++i)
  {
    const Bead& a = beads[i];
    for (std::size_t j = i + 1; j < beads.size(); ++j)
    {
      const Bead& b = beads[j];
      const double slack = (self.Clearance + 0.5) * std::min(a.radius, b.radius);
      if (b.centre[0] - a.centre[0] > a.reach + widest + slack)
      {
        break;
      }
      const double distance = (a.centre - b.centre).norm();
      if (distance > a.reach + b.reach + slack || joined(a, b))
      {
        continue;
      }
      const double smaller = std::min(a.radius, b.radius);
      if (distance < std::abs(a.radius - b.radius) + (self.Clearance + 0.1) * smaller)
      {
        throw SweepCollision{ { self.GroupAt(a.vessel, a.s), self.GroupAt(b.vessel, b.s) },
          { a.centre, b.centre }, a.radius + b.radius };
      }
      found[slot(a.part)][b.vessel].push_back(b.piece);
      found[slot(b.part)][a.vessel].push_back(a.piece);
    }
  }
  self.Neighbours.assign(found.size(), {});
  for (std::size_t part = 0; part < found.size(); ++part)
  {
    for (auto& entry : found[part])
    {
      std::vector<int>& pieces = entry.second;
      std::sort(pieces.begin(), pieces.end());
      const VesselAxis& axis = *self.VesselList[entry.first].axis;
      for (std::size_t i = 0; i < pieces.size();)
      {
        std::size_t j = i;
        while (j + 1 < pieces.size() && pieces[j + 1] <= pieces[j] + 3)
        {
          ++j;
        }
        const int low = std::max(0, pieces[i] - 3);
        const int high = std::min(axis.Pieces() - 1, pieces[j] + 3);
        self.Neighbours[part].push_back(
          { entry.first, low, high, axis.AllStations()[low].s, axis.AllStations()[high + 1].s });
        i = j + 1;
      }
    }
  }
}
}
