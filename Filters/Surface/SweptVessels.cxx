#include "SweptLumenBuild.h"

#include "Numbers.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace coronary
{
namespace
{
/// Cosine of the angle by which a vessel may bend where others leave it: a tube that bends more has
/// a fold on its inner side, and is taken as two that meet.
constexpr double MinimumStraightness = 0.7;
/// What being next in the input counts against straightness and even radii, when it is asked which
/// vessel goes on where several leave.
constexpr double FirstPreference = 0.1;
/// Times that a free end is mended at most.
constexpr int EndRounds = 3;
}

double SweptLumen::Build::SmoothingAt(const Vector3& x) const
{
  double smoothing = this->settings.smoothing;
  for (const SweepRelief& relief : this->reliefs)
  {
    if ((x - relief.centre).norm() < relief.reach)
    {
      smoothing = std::max(smoothing, relief.smoothing);
    }
  }
  return smoothing;
}

double SweptLumen::Build::BlendingAt(const Vector3& x) const
{
  double blending = this->settings.blending;
  for (const SweepRelief& relief : this->reliefs)
  {
    if ((x - relief.centre).norm() < relief.reach)
    {
      blending = std::min(blending, relief.blending);
    }
  }
  return blending;
}

void SweptLumen::Build::Look(const Incidence& at, double reach, Vector3& direction, double& r) const
{
  const std::vector<std::int64_t>& list = this->links[at.link].points;
  const std::size_t n = list.size();
  const auto index = [&](std::size_t i) { return at.atStart ? list[i] : list[n - 1 - i]; };
  const Vector3& origin = this->points[index(0)];
  std::size_t i = 1;
  while (i + 1 < n && (this->points[index(i)] - origin).norm() < reach)
  {
    ++i;
  }
  direction = (this->points[index(i)] - origin).normalized();
  r = this->radius[index(i)];
}

std::pair<int, int> SweptLumen::Build::PassThrough(
  std::int64_t node, const std::vector<Incidence>& arms) const
{
  if (arms.size() == 2)
  {
    return { 0, 1 };
  }
  std::vector<Vector3> direction(arms.size());
  std::vector<double> r(arms.size());
  for (std::size_t i = 0; i < arms.size(); ++i)
  {
    this->Look(arms[i], 2.0 * this->radius[node], direction[i], r[i]);
  }
  // Flow comes in through a link's end; with exactly one such link it is one of the two.
  int incoming = -1;
  int count = 0;
  for (std::size_t i = 0; i < arms.size(); ++i)
  {
    if (!arms[i].atStart)
    {
      incoming = static_cast<int>(i);
      ++count;
    }
  }
  std::pair<int, int> best{ -1, -1 };
  double bestScore = 0.0;
  for (int i = 0; i < static_cast<int>(arms.size()); ++i)
  {
    for (int j = i + 1; j < static_cast<int>(arms.size()); ++j)
    {
      if (count == 1 && i != incoming && j != incoming)
      {
        continue;
      }
      const double straight = -direction[i].dot(direction[j]);
      const double even = std::min(r[i], r[j]) / std::max(r[i], r[j]);
      if (straight < MinimumStraightness || (even < 0.5 && straight < 0.9))
      {
        continue;
      }
      // Of vessels that go on about equally well, the first of the input.
      const double score = straight + even - FirstPreference * (i + j);
      if (score > bestScore)
      {
        bestScore = score;
        best = { i, j };
      }
    }
  }
  return best;
}

void SweptLumen::Build::MakeVessels()
{
  // Partner of each link's end; -1 none.
  std::vector<std::array<int, 2>> partner(this->links.size(), { -1, -1 });
  for (const auto& node : this->incidences)
  {
    if (node.second.size() < 2)
    {
      continue;
    }
    const auto pair = this->PassThrough(node.first, node.second);
    if (pair.first >= 0)
    {
      const Incidence& a = node.second[pair.first];
      const Incidence& b = node.second[pair.second];
      partner[a.link][a.atStart ? 0 : 1] = b.link;
      partner[b.link][b.atStart ? 0 : 1] = a.link;
    }
  }
  // Away from the root: a tip from which flow starts, else any tip.
  std::vector<char> used(this->links.size(), 0);
  std::map<std::int64_t, double> abscissa;
  std::map<std::int64_t, int> junctionOfNode;
  std::map<std::int64_t, Vector3> normalOfNode;
  for (int tree = 0; tree < self.TreeCount; ++tree)
  {
    std::int64_t root = -1;
    for (const bool wantStart : { true, false })
    {
      for (const Link& link : this->links)
      {
        for (const std::int64_t end : { link.points.front(), link.points.back() })
        {
          if (root < 0 && link.alive && this->treeOfNode[end] == tree &&
            this->incidences[end].size() == 1 && (!wantStart || this->incidences[end][0].atStart))
          {
            root = end;
          }
        }
      }
    }
    abscissa[root] = 0.0;
    std::vector<std::int64_t> front{ root };
    for (std::size_t f = 0; f < front.size(); ++f)
    {
      const std::int64_t node = front[f];
      for (const Incidence& arm : this->incidences[node])
      {
        if (used[arm.link])
        {
          continue;
        }
        this->MakeVessel(arm, tree, partner, used, abscissa, junctionOfNode, normalOfNode, front);
      }
    }
  }
}

std::unique_ptr<VesselAxis> SweptLumen::Build::MakeAxis(
  SweptAxis course, bool startOpen, bool endOpen, int firstGroup, int lastGroup)
{
  const auto make = [&]()
  {
    return std::make_unique<VesselAxis>(
      course.points, course.radius, course.smoothing, startOpen, endOpen);
  };
  std::unique_ptr<VesselAxis> axis = make();
  for (const bool atStart : { true, false })
  {
    for (int round = 0; round < EndRounds && (atStart ? startOpen : endOpen); ++round)
    {
      Vector3 place = Vector3::Zero();
      const std::string done = MendEnd(course, *axis, atStart, place);
      if (done.empty())
      {
        break;
      }
      // Rounds, and vessels that are made anew when a stub was mended, say the same of an end: once is enough.
      const int group = atStart ? firstGroup : lastGroup;
      if (this->mended.insert({ group, atStart, done }).second)
      {
        this->Repaired(group, done, place);
      }
      axis = make();
    }
  }
  return axis;
}

void SweptLumen::Build::MakeVessel(Incidence arm, int tree,
  const std::vector<std::array<int, 2>>& partner, std::vector<char>& used,
  std::map<std::int64_t, double>& abscissa, std::map<std::int64_t, int>& junctionOfNode,
  std::map<std::int64_t, Vector3>& normalOfNode, std::vector<std::int64_t>& front)
{
  std::vector<std::int64_t> course;
  std::vector<std::size_t> nodeAt; // positions in the course of nodes
  std::vector<int> groups;         // between them
  for (;;)
  {
    used[arm.link] = 1;
    const Link& link = this->links[arm.link];
    std::vector<std::int64_t> list = link.points;
    if (!arm.atStart)
    {
      std::reverse(list.begin(), list.end());
    }
    if (course.empty())
    {
      course.push_back(list.front());
      nodeAt.push_back(0);
    }
    course.insert(course.end(), list.begin() + 1, list.end());
    nodeAt.push_back(course.size() - 1);
    groups.push_back(link.group);
    const int next = partner[arm.link][arm.atStart ? 1 : 0];
    if (next < 0)
    {
      break;
    }
    const bool atStart = this->links[next].points.front() == course.back();
    arm = { next, atStart };
  }
  const auto degree = [&](std::int64_t p) { return this->incidences[p].size(); };
  std::vector<Vector3> path;
  std::vector<double> r;
  std::vector<double> smoothing;
  for (const std::int64_t p : course)
  {
    path.push_back(this->points[p]);
    r.push_back(this->radius[p]);
    smoothing.push_back(this->SmoothingAt(this->points[p]));
  }
  if (degree(course.front()) > 1)
  {
    // The shared point carries the parent's radius.
    r[0] = r[1];
  }
  const int number = static_cast<int>(self.VesselList.size());
  Vessel vessel;
  vessel.tree = tree;
  vessel.abscissa = abscissa[course.front()];
  vessel.axis = this->MakeAxis({ path, r, smoothing }, degree(course.front()) == 1,
    degree(course.back()) == 1, groups.front(), groups.back());
  VesselAxis& axis = *vessel.axis;
  const auto seed = normalOfNode.find(course.front());
  axis.SetFrames(this->settings.frame,
    seed != normalOfNode.end() ? seed->second : axis.AllStations().front().normal);
  if (this->sections.contourSamples > 0)
  {
    this->AddContours(axis, course);
  }

  std::vector<double> s(nodeAt.size(), 0.0);
  for (std::size_t i = 1; i < nodeAt.size(); ++i)
  {
    s[i] = i + 1 == nodeAt.size() ? axis.Length()
                                  : axis.NearestArcLength(this->points[course[nodeAt[i]]]);
    s[i] = std::max(s[i], s[i - 1]);
  }
  std::size_t spanStart = 0;
  for (std::size_t i = 0; i + 1 < nodeAt.size(); ++i)
  {
    const std::int64_t end = course[nodeAt[i + 1]];
    vessel.groupEnd.push_back(s[i + 1]);
    vessel.group.push_back(groups[i]);
    abscissa[end] = vessel.abscissa + s[i + 1];
    normalOfNode[end] = axis.At(s[i + 1]).normal;
    if (degree(end) == 2)
    {
      continue;
    }
    Span span;
    span.vessel = number;
    span.from = s[spanStart];
    span.to = s[i + 1];
    span.cutFrom = span.from;
    span.cutTo = span.to;
    const auto junctionAt = [&](std::int64_t p)
    {
      const auto found = junctionOfNode.find(p);
      if (found != junctionOfNode.end())
      {
        return found->second;
      }
      const int index = static_cast<int>(self.JunctionList.size());
      junctionOfNode[p] = index;
      self.JunctionList.emplace_back();
      self.JunctionList.back().centre = this->points[p];
      self.JunctionList.back().members.assign(1, index);
      this->nodes.push_back({ this->points[p], {} });
      return index;
    };
    const auto meet = [&](int junction, double at)
    {
      auto& there = this->nodes[junction].vessels;
      if (there.empty() || there.back().first != number)
      {
        there.emplace_back(number, at);
      }
    };
    const int index = static_cast<int>(self.SpanList.size());
    const std::int64_t start = course[nodeAt[spanStart]];
    if (degree(start) > 2)
    {
      span.startJunction = junctionAt(start);
      self.JunctionList[span.startJunction].arms.push_back({ index, true, span.from });
      meet(span.startJunction, span.from);
    }
    else
    {
      span.startTip = static_cast<int>(self.TipList.size());
      const Station station = axis.At(0.0);
      self.TipList.push_back({ index, station.point, this->EndNormal(start, -station.tangent),
        station.radius, this->incidences[start][0].atStart, groups[spanStart], start, tree });
    }
    if (degree(end) > 2)
    {
      span.endJunction = junctionAt(end);
      self.JunctionList[span.endJunction].arms.push_back({ index, false, span.to });
      meet(span.endJunction, span.to);
      front.push_back(end);
    }
    else
    {
      span.endTip = static_cast<int>(self.TipList.size());
      const Station station = axis.At(axis.Length());
      self.TipList.push_back({ index, station.point, this->EndNormal(end, station.tangent),
        station.radius, this->incidences[end][0].atStart, groups[i], end, tree });
    }
    vessel.spans.push_back(index);
    self.SpanList.push_back(span);
    spanStart = i + 1;
  }
  self.VesselList.push_back(std::move(vessel));
}

void SweptLumen::Build::AddContours(VesselAxis& axis, const std::vector<std::int64_t>& course) const
{
  const int m = this->sections.contourSamples;
  std::vector<double> at;
  std::vector<std::vector<double>> contours;
  double last = -1.0;
  for (std::size_t i = 0; i < course.size(); ++i)
  {
    const std::int64_t p = course[i];
    const double s = i == 0    ? 0.0
      : i + 1 == course.size() ? axis.Length()
                               : axis.NearestArcLength(this->points[p]);
    // The first point of a side vessel belongs to its parent.
    const std::int64_t source =
      i == 0 && course.size() > 1 && this->incidences.at(p).size() > 1 ? course[1] : p;
    if (s <= last)
    {
      continue;
    }
    last = s;
    const Station station = axis.At(s);
    const Vector3& given = this->sections.contourNormals[source];
    const double turn = std::atan2(given.dot(station.binormal), given.dot(station.normal));
    std::vector<double> radii(m);
    for (int j = 0; j < m; ++j)
    {
      // Linear between the given angles: the spline is laid through the result.
      const double x = (2.0 * Pi * j / m - turn) / (2.0 * Pi) * m;
      const double floor = std::floor(x);
      const int k = ((static_cast<int>(floor) % m) + m) % m;
      const double* row = this->sections.contours.data() + source * m;
      radii[j] = (1.0 - (x - floor)) * row[k] + (x - floor) * row[(k + 1) % m];
    }
    at.push_back(s);
    contours.push_back(radii);
  }
  axis.SetContours(at, contours);
}
}
