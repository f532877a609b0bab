#include "SweptLumen.h"

#include "SweepRescue.h"
#include "SweptEnds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <sstream>
#include <stdexcept>
#include <tuple>

namespace coronary
{
namespace
{
constexpr double Pi = 3.14159265358979323846;
constexpr int RingSamples = 16;
/// Tubes bent more than this (radius times curvature) are not meshed ring by ring.
constexpr double GreatestBend = 0.75;
/// Cosine of the angle by which a vessel may bend where others leave it: a tube that bends more has
/// a fold on its inner side, and is taken as two that meet.
constexpr double LeastStraightness = 0.7;
/// What being next in the input counts against straightness and even radii, when it is asked which
/// vessel goes on where several leave.
constexpr double FirstPreference = 0.1;
/// A free end whose chord is shorter than this share of its length, within so many radii, is a
/// hairpin.
constexpr double HairpinRatio = 0.5;
constexpr double HairpinReach = 6.0;
/// Times that a free end is mended at most.
constexpr int EndRounds = 3;
/// A junction's arms are cut where other walls are a fillet's radius and this many radii away.
constexpr double CutMargin = 0.45;
/// Fillets end this many radii of the greater and of the smaller vessel away from the node, and
/// begin to fade at 60 % of it: vessels that part in an acute angle get no web along their sides.
constexpr double FilletReachGreater = 1.5;
constexpr double FilletReachSmaller = 2.5;
/// Radius of the fillet that is left where others have faded, in radii of the smaller vessel.
constexpr double LeastFillet = 0.12;
/// Where two walls face each other, a rounded minimum of radius k lies this many k above both.
const double RoundedDepth = 1.0 - std::sqrt(0.5);

double SmoothStep(double x)
{
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

std::string Where(const Vector3& p)
{
  std::ostringstream text;
  text.precision(6);
  text << "(" << p[0] << ", " << p[1] << ", " << p[2] << ")";
  return text.str();
}

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

/// A piece of a branch between two places where branches join or end.
struct Link
{
  std::vector<std::int64_t> points;
  int group;
  bool alive = true;
};

struct Incidence
{
  int link;
  bool atStart;
};
}

/// The construction, step by step.
struct SweptLumen::Build
{
  const SweepTree& input;
  const SweepSettings& settings;
  const std::vector<SweepRelief>& reliefs;
  SweptLumen& self;

  std::vector<Vector3> points;
  std::vector<double> radius;
  std::vector<Link> links;
  std::map<std::int64_t, std::vector<Incidence>> incidences;
  std::map<std::int64_t, int> treeOfNode;
  std::vector<std::int64_t> extended;          ///< end points that were moved outwards
  std::set<std::tuple<int, bool, int>> mended; ///< group, at its start, round
  /// Where vessels meet: numbers and arc lengths of the vessels, one for each first junction.
  struct Node
  {
    Vector3 point;
    std::vector<std::pair<int, double>> vessels;
  };
  std::vector<Node> nodes;

  Build(const SweepTree& tree, const SweepSettings& s, const std::vector<SweepRelief>& places,
    SweptLumen& lumen)
    : input(tree)
    , settings(s)
    , reliefs(places)
    , self(lumen)
    , points(tree.points)
    , radius(tree.radius)
  {
  }

  void Check() const
  {
    if (this->points.size() != this->radius.size())
    {
      throw std::invalid_argument("SweepVesselTree: " + std::to_string(this->points.size()) +
        " points but " + std::to_string(this->radius.size()) + " radii");
    }
    for (std::size_t b = 0; b < this->input.branches.size(); ++b)
    {
      const SweepBranch& branch = this->input.branches[b];
      const std::string name = "SweepVesselTree: branch " + std::to_string(b) + " (group " +
        std::to_string(branch.groupId) + ")";
      for (const std::int64_t p : branch.points)
      {
        if (p < 0 || p >= static_cast<std::int64_t>(this->points.size()))
        {
          throw std::invalid_argument(name + " names point " + std::to_string(p) + " of " +
            std::to_string(this->points.size()));
        }
        if (!this->points[p].allFinite() || !std::isfinite(this->radius[p]))
        {
          throw std::invalid_argument(
            name + ": point " + std::to_string(p) + " has a position or radius that is no number");
        }
        if (this->radius[p] <= 0.0)
        {
          throw std::invalid_argument(name + ": radius " + std::to_string(this->radius[p]) +
            " at point " + std::to_string(p) + ", it must be positive");
        }
      }
      double length = 0.0;
      for (std::size_t i = 1; i < branch.points.size(); ++i)
      {
        length += (this->points[branch.points[i]] - this->points[branch.points[i - 1]]).norm();
      }
      if (branch.points.size() < 2 || !(length > 1e-6 * this->radius[branch.points[0]]))
      {
        throw std::invalid_argument(name + " has no length");
      }
    }
    if (!this->input.endNormals.empty())
    {
      if (this->input.endNormals.size() != this->points.size())
      {
        throw std::invalid_argument("SweepVesselTree: " + std::to_string(this->points.size()) +
          " points but " + std::to_string(this->input.endNormals.size()) + " normals of ends");
      }
      for (std::size_t i = 0; i < this->input.endNormals.size(); ++i)
      {
        if (!this->input.endNormals[i].allFinite())
        {
          throw std::invalid_argument(
            "SweepVesselTree: normal of the end at point " + std::to_string(i) + " is no number");
        }
      }
    }
    if (this->input.contourSamples != 0)
    {
      const std::size_t n = this->points.size();
      if (this->input.contourSamples < 6 ||
        this->input.contours.size() != n * this->input.contourSamples ||
        this->input.contourNormals.size() != n)
      {
        throw std::invalid_argument(
          "SweepVesselTree: contours need at least 6 radii and one normal a point");
      }
      for (std::size_t i = 0; i < this->input.contours.size(); ++i)
      {
        if (!(this->input.contours[i] > 0.0) || !std::isfinite(this->input.contours[i]))
        {
          throw std::invalid_argument("SweepVesselTree: contour of point " +
            std::to_string(i / this->input.contourSamples) + " has a radius that is not positive");
        }
      }
    }
  }

  /// Branches cut where others join them.
  void FindLinks()
  {
    std::map<std::int64_t, int> degree;
    std::vector<std::vector<std::int64_t>> clean;
    for (const SweepBranch& branch : this->input.branches)
    {
      // Repeated points say nothing, but an end must stay where other branches join it.
      std::vector<std::int64_t> kept;
      for (const std::int64_t p : branch.points)
      {
        if (!kept.empty() &&
          (p == kept.back() ||
            (this->points[p] - this->points[kept.back()]).norm() < 1e-6 * this->radius[p]))
        {
          if (p == branch.points.back() && kept.size() > 1)
          {
            kept.back() = p;
          }
          continue;
        }
        kept.push_back(p);
      }
      for (std::size_t i = 0; i < kept.size(); ++i)
      {
        degree[kept[i]] += i == 0 || i + 1 == kept.size() ? 1 : 2;
      }
      clean.push_back(kept);
    }
    for (std::size_t b = 0; b < clean.size(); ++b)
    {
      for (int side = 0; side < 2; ++side)
      {
        // Both ends, one after the other.
        std::reverse(clean[b].begin(), clean[b].end());
        if (degree[clean[b].front()] == 1)
        {
          this->TrimHairpin(clean[b], degree, this->input.branches[b].groupId);
        }
      }
      Link link;
      link.group = this->input.branches[b].groupId;
      for (std::size_t i = 0; i < clean[b].size(); ++i)
      {
        link.points.push_back(clean[b][i]);
        if (i > 0 && i + 1 < clean[b].size() && degree[clean[b][i]] > 2)
        {
          this->links.push_back(link);
          link.points.assign(1, clean[b][i]);
        }
      }
      if (link.points.size() > 1)
      {
        this->links.push_back(link);
      }
    }
  }

  /// A branch's end is left out from the place on; all of it when little would stay.
  void LeaveOut(const SweepOmission& omission)
  {
    for (Link& link : this->links)
    {
      std::vector<std::int64_t>& list = link.points;
      const bool atStart = list.front() == omission.end;
      if (!link.alive || (!atStart && list.back() != omission.end))
      {
        continue;
      }
      if (atStart)
      {
        std::reverse(list.begin(), list.end());
      }
      std::size_t kept = 0;
      double length = 0.0;
      while (
        kept < list.size() && (this->points[list[kept]] - omission.centre).norm() > omission.reach)
      {
        length +=
          kept == 0 ? 0.0 : (this->points[list[kept]] - this->points[list[kept - 1]]).norm();
        ++kept;
      }
      link.alive = kept > 1 && kept < list.size() && length > 3.0 * this->radius[list[kept - 1]];
      const std::size_t from = link.alive ? kept - 1 : 0;
      AddLeftOut(self.LeftOutList, self.RemarkList, this->input, link.group,
        "where it begins no wall can be resolved", this->points[list[from]],
        this->LinkLength(link, from));
      if (link.alive)
      {
        list.resize(kept);
      }
      if (atStart)
      {
        std::reverse(list.begin(), list.end());
      }
    }
  }

  double SmoothingAt(const Vector3& x) const
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

  double BlendingAt(const Vector3& x) const
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

  /// A free start that turns back inside its own tube, as a fastest path from a point at the wall
  /// does, is left out up to the turn.
  void TrimHairpin(
    std::vector<std::int64_t>& list, const std::map<std::int64_t, int>& degree, int group)
  {
    std::size_t last = 0;
    double arc = 0.0;
    double widest = this->radius[list.front()];
    const Vector3 start = this->points[list.front()];
    for (std::size_t i = 1; i + 1 < list.size() && degree.at(list[i]) <= 2; ++i)
    {
      arc += (this->points[list[i]] - this->points[list[i - 1]]).norm();
      widest = std::max(widest, this->radius[list[i]]);
      if (arc > HairpinReach * widest)
      {
        break;
      }
      if (arc > 2.0 * widest && (this->points[list[i]] - start).norm() < HairpinRatio * arc &&
        (this->points[list[i]] - start).norm() < 2.0 * widest)
      {
        last = i;
      }
    }
    if (last == 0)
    {
      return;
    }
    std::size_t turn = 0;
    double farthest = 0.0;
    const Vector3 chord = (this->points[list[last]] - start).normalized();
    for (std::size_t i = 1; i < last; ++i)
    {
      const Vector3 offset = this->points[list[i]] - start;
      const double away = (offset - offset.dot(chord) * chord).norm();
      if (away > farthest)
      {
        farthest = away;
        turn = i;
      }
    }
    this->Repaired(
      group, "turns back inside itself; its end up to there is left out", this->points[list[turn]]);
    list.erase(list.begin(), list.begin() + static_cast<std::ptrdiff_t>(turn));
  }

  void Connect()
  {
    this->incidences.clear();
    this->treeOfNode.clear();
    std::map<std::int64_t, std::int64_t> parent;
    const auto root = [&](std::int64_t p)
    {
      while (parent.count(p) != 0 && parent[p] != p)
      {
        p = parent[p];
      }
      return p;
    };
    for (std::size_t i = 0; i < this->links.size(); ++i)
    {
      const Link& link = this->links[i];
      if (!link.alive)
      {
        continue;
      }
      const std::int64_t a = root(link.points.front());
      std::int64_t b = root(link.points.back());
      if (a == b)
      {
        this->OpenLoop(this->links[i]);
        if (!link.alive)
        {
          continue;
        }
        b = link.points.back(); // an end of its own now
      }
      parent.emplace(a, a);
      parent[b] = a;
      this->incidences[link.points.front()].push_back({ static_cast<int>(i), true });
      this->incidences[link.points.back()].push_back({ static_cast<int>(i), false });
    }
    std::map<std::int64_t, int> number;
    for (const auto& node : this->incidences)
    {
      const std::int64_t r = root(node.first);
      number.emplace(r, 0);
    }
    // Trees in the order of the input.
    int next = 0;
    std::map<std::int64_t, bool> seen;
    for (const Link& link : this->links)
    {
      if (link.alive)
      {
        const std::int64_t r = root(link.points.front());
        if (!seen[r])
        {
          seen[r] = true;
          number[r] = next++;
        }
      }
    }
    self.TreeCount = next;
    for (const auto& node : this->incidences)
    {
      this->treeOfNode[node.first] = number[root(node.first)];
    }
  }

  double LinkLength(const Link& link, std::size_t from = 0) const
  {
    double length = 0.0;
    for (std::size_t i = from + 1; i < link.points.size(); ++i)
    {
      length += (this->points[link.points[i]] - this->points[link.points[i - 1]]).norm();
    }
    return length;
  }

  /// A link that closes a loop ends before the place where it would; or is left out.
  void OpenLoop(Link& link)
  {
    std::vector<std::int64_t>& list = link.points;
    const std::int64_t closing = list.back();
    const double reach =
      2.0 * (this->radius[closing] + (list.size() > 1 ? this->radius[list[list.size() - 2]] : 0.0));
    std::size_t kept = list.size() - 1;
    while (kept > 0 && (this->points[list[kept - 1]] - this->points[closing]).norm() < reach)
    {
      --kept;
    }
    Link head = link;
    head.points.resize(kept);
    link.alive = kept > 1 && this->LinkLength(head) > 3.0 * this->radius[list[kept - 1]];
    const std::size_t from = link.alive ? kept - 1 : 0;
    AddLeftOut(self.LeftOutList, self.RemarkList, this->input, link.group,
      "it would close a loop of branches", this->points[list[from]], this->LinkLength(link, from));
    if (link.alive)
    {
      list.resize(kept);
    }
  }

  void Repaired(int group, const std::string& what, const Vector3& place)
  {
    AddRepair(self.RepairList, self.RemarkList, this->input, group, what, place);
  }

  /// Direction and radius of a link as seen from one of its ends, `reach` away from it.
  void Look(const Incidence& at, double reach, Vector3& direction, double& r) const
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

  /// Which two links at a node are one vessel; -1, -1 for none.
  std::pair<int, int> PassThrough(std::int64_t node, const std::vector<Incidence>& arms) const
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
        if (straight < LeastStraightness || (even < 0.5 && straight < 0.9))
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

  void MakeVessels()
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

  /// The axis of a course, whose free ends are mended where no tube can follow them.
  std::unique_ptr<VesselAxis> MakeAxis(
    VesselCourse course, bool startOpen, bool endOpen, int firstGroup, int lastGroup)
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
        // The vessels are made anew when a stub was mended; what is said of an end is said once.
        const int group = atStart ? firstGroup : lastGroup;
        if (this->mended.insert({ group, atStart, round }).second)
        {
          this->Repaired(group, done, place);
        }
        axis = make();
      }
    }
    return axis;
  }

  void MakeVessel(Incidence arm, int tree, const std::vector<std::array<int, 2>>& partner,
    std::vector<char>& used, std::map<std::int64_t, double>& abscissa,
    std::map<std::int64_t, int>& junctionOfNode, std::map<std::int64_t, Vector3>& normalOfNode,
    std::vector<std::int64_t>& front)
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
    if (this->input.contourSamples > 0)
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

  void AddContours(VesselAxis& axis, const std::vector<std::int64_t>& course) const
  {
    const int m = this->input.contourSamples;
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
      const Vector3& given = this->input.contourNormals[source];
      const double turn = std::atan2(given.dot(station.binormal), given.dot(station.normal));
      std::vector<double> radii(m);
      for (int j = 0; j < m; ++j)
      {
        // Linear between the given angles: the spline is laid through the result.
        const double x = (2.0 * Pi * j / m - turn) / (2.0 * Pi) * m;
        const double floor = std::floor(x);
        const int k = ((static_cast<int>(floor) % m) + m) % m;
        const double* row = this->input.contours.data() + source * m;
        radii[j] = (1.0 - (x - floor)) * row[k] + (x - floor) * row[(k + 1) % m];
      }
      at.push_back(s);
      contours.push_back(radii);
    }
    axis.SetContours(at, contours);
  }

  // ---- junctions ----

  Range MakeRange(int vessel, double low, double high) const
  {
    const VesselAxis& axis = *self.VesselList[vessel].axis;
    low = std::max(0.0, low);
    high = std::min(axis.Length(), high);
    return { vessel, axis.PieceAt(low), axis.PieceAt(high), low, high };
  }

  double RangeDistance(const Range& range, const Vector3& x) const
  {
    double distance = 0.0;
    self.VesselList[range.vessel].axis->NearestPiece(
      x, range.firstPiece, range.lastPiece, distance);
    return distance;
  }

  /// The fillet between two vessels of a junction; without radius when they share no node.
  Fillet FindFillet(const Junction& junction, int first, int second) const
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

  /// A vessel's calibre beside a node.
  double CalibreAt(int vessel, double s) const
  {
    const VesselAxis& axis = *self.VesselList[vessel].axis;
    return axis.At(std::clamp(s, 0.0, axis.Length())).radius;
  }

  /// All tubes of a junction, each as far as it might matter for finding where the others leave.
  std::vector<Range> WideRanges(const Junction& junction, double reach) const
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

  /// Is a ring of a span clear of all other tubes by `share` of the normal margin?
  bool IsClear(const Span& span, double s, const Junction& junction,
    const std::vector<Range>& others, double share) const
  {
    const VesselAxis& axis = *self.VesselList[span.vessel].axis;
    const Station station = axis.At(s);
    if (station.curvature.norm() * station.radius > GreatestBend)
    {
      return false;
    }
    // Nor may the ring lie in a fold of its own tube, whose inner side belongs to both of its legs.
    const int last = axis.PieceAt(std::min(axis.Length(), s + share * station.radius));
    for (int i = axis.PieceAt(std::max(0.0, s - share * station.radius)); i <= last; ++i)
    {
      const Station& near = axis.AllStations()[i];
      if (near.curvature.norm() * near.radius > GreatestBend)
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
        const double rounding = std::max(LeastFillet * smaller, fillet.RadiusAt(x));
        if (distance < share * (rounding + CutMargin * smaller))
        {
          return false;
        }
      }
    }
    return true;
  }

  /**
   * @param away  distance from the node at which to begin
   * @return distance of the cut from the node, or a negative number when there is none
   */
  double FindCut(const Span& span, bool atStart, const Junction& junction,
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

  /// The same with smaller margins where the normal ones are not to be had.
  double FindCut(const Arm& arm, const Junction& junction, const std::vector<Range>& others,
    double away, double& taken) const
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

  /// Where each tube leaves its junctions; junctions too close to part become one.
  /// @return false when the input was changed and all must be built anew
  bool CutJunctions()
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
          widest =
            std::max(widest, this->CalibreAt(span.vessel, arm.atStart ? span.from : span.to));
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

  void Merge(int spanIndex)
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

  /// A branch that ends before it has left its parent: out when it cannot be seen, else longer.
  void MendStub(const Arm& arm, const std::vector<Range>& others)
  {
    const Span& span = self.SpanList[arm.span];
    const Vessel& vessel = self.VesselList[span.vessel];
    const VesselAxis& axis = *vessel.axis;
    const Tip& tip = self.TipList[arm.atStart ? span.endTip : span.startTip];
    bool hidden = true;
    for (int k = 0; k < RingSamples && hidden; ++k)
    {
      const Vector3 x =
        axis.WallPoint(arm.atStart ? span.to : span.from, 2.0 * Pi * k / RingSamples);
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

  /// The wanted normal of an end's plane, turned outwards.
  Vector3 EndNormal(std::int64_t point, const Vector3& outward) const
  {
    if (this->input.endNormals.empty() || this->input.endNormals[point].squaredNorm() == 0.0)
    {
      return outward;
    }
    Vector3 normal = this->input.endNormals[point].normalized();
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

  /// An oblique end must not reach into a junction.
  void LimitEnds()
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
          "the plane of its end would cut a junction; turned towards the cross-section",
          tip.centre);
      }
    }
  }

  void FinishJunctions()
  {
    for (Junction& junction : self.JunctionList)
    {
      if (junction.arms.empty())
      {
        continue;
      }
      std::map<int, std::pair<double, double>> extent;
      junction.smallestRadius = std::numeric_limits<double>::max();
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
        for (double s = e.second.first;; s += 0.3 * junction.smallestRadius)
        {
          const double at = std::min(s, e.second.second);
          const double r = this->CalibreAt(e.first, at);
          junction.smallestRadius = std::min(junction.smallestRadius, r);
          if (s >= e.second.second)
          {
            break;
          }
        }
      }
      // A fillet must end before the cuts, where the gap is known.
      junction.greatestFillet =
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

  /// Calibre of a vessel where it comes out of another.
  double SideCalibre(const Range& range, const Range& other) const
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

  /// Stretches that bend too much for rings become junctions of two arms.
  void SplitFolds()
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
        const bool folds = station.curvature.norm() * station.radius > GreatestBend;
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
      self.JunctionList.back().arms = { { static_cast<int>(i), false, low },
        { second, true, high } };
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

  // ---- neighbours that do not join ----

  int PartOf(int vessel, double s) const
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
      return s < span.cutFrom ? -1 - span.startJunction
        : s > span.cutTo      ? -1 - span.endJunction
                              : p;
    }
    return 0;
  }

  void FindNeighbours()
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
        beads.push_back({ 0.5 * (p.point + q.point), 0.5 * (q.s - p.s) + r, r, s,
          static_cast<int>(v), i, this->PartOf(static_cast<int>(v), s) });
      }
    }
    std::sort(beads.begin(), beads.end(),
      [](const Bead& a, const Bead& b)
      {
        return a.centre[0] != b.centre[0]
          ? a.centre[0] < b.centre[0]
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

  using Station = VesselAxis::Station;
};

SweptLumen::SweptLumen(const SweepTree& tree, const SweepSettings& settings,
  const std::vector<SweepRelief>& reliefs, const std::vector<SweepOmission>& leftOut)
  : Clearance(settings.clearance)
{
  Build build(tree, settings, reliefs, *this);
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
  for (const Link& link : build.links)
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
      std::min(fillet.RadiusAt(position, &fade), junction.greatestFillet * fillet.calibre);
    const double reach = std::max(round, LeastFillet * fillet.calibre);
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
    double least = LeastFillet * fillet.calibre;
    if (cosine < 0.0)
    {
      least = std::min(least, this->EdgeRetreat * fillet.calibre * sine / (1.0 - sine));
    }
    if (least > k)
    {
      // Two walls that come close without meeting have no edge between them. Where the planes
      // meet, the walls must do so too.
      const double outside = std::max(a.distance, b.distance);
      double open = 1.0;
      if (outside > 0.01 * least)
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
        open = SmoothStep((0.8 - gap / outside) / 0.35);
      }
      if (least * open > k)
      {
        k = least * open;
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
  return this->radius * SmoothStep(x);
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
