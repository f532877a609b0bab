#include "SweepSurface.h"

#include "AdaptiveRemesher.h"
#include "Numbers.h"
#include "Require.h"
#include "SweepRescue.h"
#include "SweptFirstMesh.h"
#include "SweptLumen.h"
#include "TriangleIntersections.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <stdexcept>

namespace coronary
{
namespace
{
/// Retreat of the edges between vessels with which remeshing begins, in radii.
constexpr double BluntRetreat = 0.6;
/// Smaller angles are repaired, degrees: a little more than what is promised.
constexpr double MinimumCornerAngle = 12.0;
constexpr int Repairs = 3;
constexpr std::size_t Heap = 2000; ///< faulty triangles
constexpr int RemeshingAttempts = 3;
constexpr double MaximumSmoothing = 4.0; ///< of the axes, radii
constexpr double MinimumBlending = 0.1;
constexpr int FaultReliefs = 1;    ///< times that faults of the finished mesh are relieved
constexpr double FaultReach = 4.0; ///< of such a relief, in radii
constexpr int Sweeps = 64;         ///< at most, with what each one could not mesh relieved
/// Angles of triangles that were replaced, degrees: such a mesh is taken at once; or in need.
constexpr double FairAngle = 5.0;
constexpr double NeedAngle = 0.5;
/// Around a fault so many radii of a branch are left out.
constexpr double CutReach = 2.0;
constexpr double CutGrowth = 3.0;
/// Below, the areas of triangles vanish in what the angles are made of; mm.
constexpr double MinimumRadius = 1e-6;
constexpr double MostTriangles = 2e7;

/// A wall too fine or too large for any mesh: wrong units, mostly. The branches are checked already.
void CheckSize(const VesselTree& tree, const SweepSettings& settings)
{
  double triangles = 0.0;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (std::size_t i = 0; i < branch.points.size(); ++i)
    {
      const std::int64_t p = branch.points[i];
      const double radius = tree.radius[p];
      if (radius < MinimumRadius)
      {
        std::ostringstream text;
        text << "SweepVesselTree: radius " << radius << " mm at point " << p << ", it must be "
             << MinimumRadius << " mm or more";
        throw std::invalid_argument(text.str());
      }
      if (i > 0)
      {
        const double edge = SweptEdgeLength(settings, 1.0 / radius, radius);
        const double length = (tree.points[p] - tree.points[branch.points[i - 1]]).norm();
        triangles += 2.0 * Pi * radius * length / (std::sqrt(3.0) / 4.0 * edge * edge);
      }
    }
  }
  if (!(triangles <= MostTriangles))
  {
    std::ostringstream text;
    text.precision(3);
    text << "SweepVesselTree: the wall needs about " << triangles << " triangles, at most "
         << MostTriangles << " are possible; lengths are in mm, maximumEdgeLength is "
         << settings.maximumEdgeLength << " mm";
    throw std::invalid_argument(text.str());
  }
}

/// The swept wall as the remesher sees it.
class Wall : public RemeshSurface
{
public:
  Wall(SweptLumen& lumen, const SweepSettings& settings)
    : Lumen(lumen)
    , Settings(settings)
  {
  }

  void Project(RemeshVertex& vertex) const override
  {
    SweptLumen::Sample sample;
    SweptLumen::Site site{ vertex.part, vertex.piece };
    if (vertex.patch >= 0)
    {
      this->Lumen.ProjectToTip(vertex.position, site, sample, vertex.patch, vertex.rim);
      vertex.normal = vertex.rim ? Vector3(sample.gradient.normalized())
                                 : this->Lumen.Tips()[vertex.patch].normal;
    }
    else
    {
      this->Lumen.Project(vertex.position, site, sample);
      vertex.normal = sample.gradient.normalized();
    }
    vertex.part = site.part;
    vertex.piece = site.piece;
    vertex.size = SweptEdgeLength(this->Settings, sample.curvature, sample.radius);
  }

  void Begin(double done) override
  {
    // From blunt edges between vessels, which any mesh can follow, to sharp ones.
    const double share = std::min(1.0, done / 0.75);
    this->Lumen.SetEdgeRetreat(
      BluntRetreat * std::pow(this->Settings.edgeRetreat / BluntRetreat, share));
  }

private:
  SweptLumen& Lumen;
  const SweepSettings& Settings;
};

std::vector<SweepPatches> MakePatches(const SweptLumen& lumen, const SweepSettings& settings)
{
  std::vector<SweepPatches> result;
  for (const SweptLumen::Vessel& vessel : lumen.Vessels())
  {
    const VesselAxis& axis = *vessel.axis;
    double from = 0.0;
    for (std::size_t g = 0; g < vessel.group.size(); ++g)
    {
      const double to = vessel.groupEnd[g];
      SweepPatches patches;
      patches.groupId = vessel.group[g];
      patches.samples = settings.patchSamples;
      // Even in radii.
      constexpr int samples = 200;
      std::vector<double> sum(1, 0.0);
      for (int i = 0; i < samples; ++i)
      {
        const double s = from + (to - from) * (i + 0.5) / samples;
        sum.push_back(
          sum.back() + (to - from) / samples / (settings.patchSpacing * axis.At(s).radius));
      }
      const int count = std::max(1, static_cast<int>(std::lround(sum.back())));
      std::size_t row = 0;
      for (int k = 0; k <= count; ++k)
      {
        double s = to;
        if (k < count)
        {
          const double wanted = sum.back() * k / count;
          while (row + 2 < sum.size() && sum[row + 1] < wanted)
          {
            ++row;
          }
          const double part = (wanted - sum[row]) / std::max(1e-12, sum[row + 1] - sum[row]);
          s = from + (to - from) * (static_cast<double>(row) + part) / samples;
        }
        patches.centres.push_back(axis.At(s));
        patches.abscissa.push_back(vessel.abscissa + s);
        for (int i = 0; i < settings.patchSamples; ++i)
        {
          patches.contours.push_back(axis.WallPoint(s, 2.0 * Pi * i / settings.patchSamples));
        }
      }
      result.push_back(std::move(patches));
      from = to;
    }
  }
  return result;
}

std::vector<Vector3> PointsOf(const std::vector<RemeshVertex>& vertices)
{
  std::vector<Vector3> points;
  points.reserve(vertices.size());
  for (const RemeshVertex& vertex : vertices)
  {
    points.push_back(vertex.position);
  }
  return points;
}

/// Triangles that cut others or have too small an angle.
std::vector<std::int64_t> FindFaults(const AdaptiveRemesher& mesh)
{
  const std::vector<Vector3> points = PointsOf(mesh.Vertices());
  const std::vector<Triangle> triangles = mesh.Triangles();
  std::vector<std::int64_t> faults;
  // More at one place are a heap that repairs do not untie.
  constexpr std::size_t most = 1000;
  for (const auto& pair : FindSelfIntersections(points, triangles, most))
  {
    faults.push_back(pair.first);
    faults.push_back(pair.second);
  }
  const double maximum = std::cos(MinimumCornerAngle * Pi / 180.0);
  for (std::size_t t = 0; t < triangles.size(); ++t)
  {
    for (int c = 0; c < 3; ++c)
    {
      const Vector3& p = points[triangles[t][c]];
      const Vector3 u = points[triangles[t][(c + 1) % 3]] - p;
      const Vector3 v = points[triangles[t][(c + 2) % 3]] - p;
      if (!(u.dot(v) < maximum * u.norm() * v.norm()))
      {
        faults.push_back(static_cast<std::int64_t>(t));
        break;
      }
    }
  }
  std::sort(faults.begin(), faults.end());
  faults.erase(std::unique(faults.begin(), faults.end()), faults.end());
  return faults;
}

/// What is changed where the tree cannot be meshed as it is.
struct Reliefs
{
  std::vector<SweepRelief> places;
  std::vector<std::string> reasons; ///< one a place
  std::vector<int> groups;          ///< one a place
  std::vector<SweepOmission> leftOut;

  /// More at this place. @return false when no more is to be had
  bool Add(const Vector3& centre, double reach, const SweepSettings& settings,
    const std::string& reason, int group)
  {
    std::size_t i = 0;
    while (i < this->places.size() &&
      (this->places[i].centre - centre).norm() > std::max(this->places[i].reach, reach))
    {
      ++i;
    }
    if (i == this->places.size())
    {
      this->places.push_back({ centre, reach, settings.smoothing, settings.blending });
      this->reasons.push_back(reason);
      this->groups.push_back(group);
    }
    SweepRelief& place = this->places[i];
    if (place.smoothing >= MaximumSmoothing)
    {
      return false;
    }
    place.reach = std::max(place.reach, reach + (place.centre - centre).norm());
    place.smoothing = std::clamp(2.0 * place.smoothing, 1.0, MaximumSmoothing);
    place.blending = std::max(MinimumBlending, 0.7 * place.blending);
    return true;
  }

  /// What was done at a place.
  std::string Words(std::size_t i) const
  {
    std::ostringstream text;
    text.precision(3);
    text << "axes less than " << this->places[i].reach << " mm away are smoothed over "
         << this->places[i].smoothing << " radii and fillets have " << this->places[i].blending
         << " radii";
    return text.str();
  }

  std::vector<std::string> Remarks() const
  {
    std::vector<std::string> remarks;
    for (std::size_t i = 0; i < this->places.size(); ++i)
    {
      remarks.push_back(this->reasons[i] + "; for that reason " + this->Words(i));
    }
    return remarks;
  }
};

/// A part of the mesh that has faults.
struct Fault
{
  Vector3 position;
  double radius; ///< of the vessel
  int group;
};

/// What one sweep gives.
struct Sweep
{
  SweptSurface surface;
  std::vector<Fault> faults; ///< left; none: the surface may be handed out
};

Sweep SweepOnce(const VesselTree& tree, const SweepSections& sections,
  const SweepSettings& settings, const Reliefs& reliefs, bool last,
  const ProgressCallback& progress);
}

void SweepSettings::Validate() const
{
  constexpr RequireOf require{ "SweepSettings" };
  require(std::isfinite(this->minimumEdgeLength) && this->minimumEdgeLength > 0.0,
    "minimumEdgeLength must be positive");
  require(
    std::isfinite(this->maximumEdgeLength) && this->maximumEdgeLength >= this->minimumEdgeLength,
    "maximumEdgeLength must be at least minimumEdgeLength");
  require(std::isfinite(this->curvatureWeight) && this->curvatureWeight >= 0.0,
    "curvatureWeight must be at least 0");
  require(Within(this->edgeLengthPerRadius, 0.1, 0.7), "edgeLengthPerRadius must be 0.1 to 0.7");
  require(Within(this->sharpestBend, 0.05, 1.0), "sharpestBend must be 0.05 to 1");
  require(Within(this->gradation, 0.05, 1.0), "gradation must be 0.05 to 1");
  require(Within(this->blending, 0.1, 1.0), "blending must be 0.1 to 1");
  require(Within(this->edgeRetreat, 0.1, 2.0), "edgeRetreat must be 0.1 to 2");
  require(Within(this->smoothing, 0.0, MaximumSmoothing), "smoothing must be 0 to 4");
  require(Within(this->clearance, 0.0, 0.5), "clearance must be 0 to 0.5");
  require(this->patchSamples >= 6 && this->patchSamples <= 360, "patchSamples must be 6 to 360");
  require(Within(this->patchSpacing, 0.1, 4.0), "patchSpacing must be 0.1 to 4");
}

namespace
{
/// Sweeps until nothing fails, changing and leaving out ever more where something does.
class Sweeper
{
public:
  Sweeper(const VesselTree& tree, const SweepSections& sections, const SweepSettings& settings,
    const ProgressCallback& progress)
    : Input(tree)
    , Sections(sections)
    , Tree(tree)
    , Settings(settings)
    , Progress(progress)
  {
  }

  SweptSurface Run()
  {
    for (int sweep = 1;; ++sweep)
    {
      this->Last = sweep >= Sweeps;
      try
      {
        Sweep result = SweepOnce(this->Tree, this->Sections, this->Settings, this->Relief,
          this->FaultSweeps >= FaultReliefs, Progress);
        if (result.faults.empty())
        {
          return this->Finished(std::move(result.surface));
        }
        if (!this->RelieveFaults(result.faults))
        {
          this->CutFaults(result.faults);
        }
      }
      catch (const Unresolved& unresolved)
      {
        this->Resolve(unresolved);
      }
      catch (const SweepCollision& collision)
      {
        this->CutMinimum({ { collision.groups[0], collision.places[0] },
                           { collision.groups[1], collision.places[1] } },
          collision.reach, "it runs through another vessel without joining it");
      }
      if (this->Tree.branches.empty())
      {
        throw std::runtime_error("SweepVesselTree: no vessel of the tree can be swept; " +
          (this->Remarks.empty() ? std::string("nothing is left") : this->Remarks.front()));
      }
    }
  }

private:
  using Choice = std::pair<int, Vector3>; ///< group and place

  SweptSurface Finished(SweptSurface surface) const
  {
    for (std::size_t i = 0; i < this->Relief.places.size(); ++i)
    {
      const SweepRelief& place = this->Relief.places[i];
      surface.repairs.push_back({ this->Relief.groups[i],
        VesselName(this->Input, this->Relief.groups[i]), this->Relief.Words(i), place.centre });
    }
    const std::vector<std::string> reliefs = this->Relief.Remarks();
    surface.remarks.insert(surface.remarks.end(), reliefs.begin(), reliefs.end());
    surface.remarks.insert(surface.remarks.end(), this->Remarks.begin(), this->Remarks.end());
    surface.leftOut.insert(surface.leftOut.end(), this->LeftOut.begin(), this->LeftOut.end());
    std::set<std::int64_t> missing;
    if (!surface.leftOut.empty())
    {
      for (const VesselTree::Branch& branch : this->Input.branches)
      {
        missing.insert(branch.points.begin(), branch.points.end());
      }
      for (const std::int64_t p : surface.leftOutPoints)
      {
        missing.erase(p);
      }
    }
    surface.leftOutPoints.assign(missing.begin(), missing.end());
    return surface;
  }

  /// Smoother axes and smaller fillets where triangles are bad. @return false when nothing changed
  bool RelieveFaults(const std::vector<Fault>& faults)
  {
    if (this->FaultSweeps >= FaultReliefs)
    {
      return false;
    }
    ++this->FaultSweeps;
    bool more = false;
    for (const Fault& fault : this->Apart(faults, FaultReach))
    {
      more = this->Relief.Add(fault.position, FaultReach * fault.radius, this->Settings,
               VesselName(this->Input, fault.group) + " at " + SweepPlace(fault.position) +
                 ": triangles were too thin or cut each other",
               fault.group) ||
        more;
    }
    return more;
  }

  /// One fault for each place.
  static std::vector<Fault> Apart(const std::vector<Fault>& faults, double reach)
  {
    std::vector<Fault> apart;
    for (const Fault& fault : faults)
    {
      if (std::none_of(apart.begin(), apart.end(),
            [&](const Fault& f)
            { return (f.position - fault.position).norm() < reach * fault.radius; }))
      {
        apart.push_back(fault);
      }
    }
    return apart;
  }

  void CutFaults(const std::vector<Fault>& faults)
  {
    for (const Fault& fault : this->Apart(faults, CutReach))
    {
      this->CutMinimum({ { fault.group, fault.position } }, CutReach * fault.radius,
        "no sound triangles could be made of its wall");
    }
    this->FaultSweeps = 0;
  }

  /// Cuts, of several branches, that with which the least is lost.
  void CutMinimum(const std::vector<Choice>& choices, double reach, const std::string& reason)
  {
    VesselTree best;
    SweepCut minimum;
    for (const Choice& choice : choices)
    {
      // Who fails again loses more.
      const auto before = this->Cuts.find(choice.first);
      const double more = before == this->Cuts.end() ? 1.0 : std::pow(CutGrowth, before->second);
      VesselTree tree = this->Tree;
      SweepCut cut = CutTree(tree, choice.first, choice.second, more * reach);
      // A tree without its inlet is worth less than any branch.
      if (!cut.parts.empty() &&
        (minimum.parts.empty() ||
          std::make_pair(cut.atRoot, cut.length) < std::make_pair(minimum.atRoot, minimum.length)))
      {
        minimum = std::move(cut);
        best = std::move(tree);
      }
    }
    for (const Choice& choice : choices)
    {
      ++this->Cuts[choice.first];
    }
    if (minimum.parts.empty())
    {
      // The group is gone already, with one that was cut before.
      if (this->Last)
      {
        this->Tree.branches.clear();
      }
      return;
    }
    for (std::size_t i = 0; i < minimum.parts.size(); ++i)
    {
      const SweepLeftOut& part = minimum.parts[i];
      if (part.length <= 0.0)
      {
        continue; // a point that was added to its end
      }
      AddLeftOut(this->LeftOut, this->Remarks, this->Input, part.groupId,
        i == 0 ? reason : "it comes from " + minimum.parts[0].vessel + ", which is left out",
        part.place, part.length);
    }
    this->Tree = std::move(best);
  }

  /// Kinks that no tube of that width can follow are smoothed away, the more the worse they are, and
  /// fillets that run into each other made smaller. Where that does not help a branch has to go.
  void Resolve(const Unresolved& unresolved)
  {
    for (const JunctionFailure& place : unresolved.places)
    {
      const int group = place.groups.empty() ? 0 : place.groups.front();
      std::string vessels;
      for (const int g : std::set<int>(place.groups.begin(), place.groups.end()))
      {
        vessels += (vessels.empty() ? "" : ", ") + VesselName(this->Input, g);
      }
      if (!this->Last &&
        this->Relief.Add(place.centre, place.reach, this->Settings,
          vessels + " at " + SweepPlace(place.centre) + ": the wall could not be resolved", group))
      {
        continue;
      }
      if (!this->Last && place.thinnestEnd >= 0 &&
        std::none_of(this->Relief.leftOut.begin(), this->Relief.leftOut.end(),
          [&](const SweepOmission& omission) { return omission.end == place.thinnestEnd; }))
      {
        this->Relief.leftOut.push_back({ place.thinnestEnd, place.centre, place.reach });
        continue;
      }
      std::vector<Choice> choices;
      for (const int g : place.groups)
      {
        choices.emplace_back(g, place.centre);
      }
      this->CutMinimum(choices, this->Last ? 2.0 * place.reach : 0.5 * place.reach,
        "no wall can be resolved there");
    }
  }

  const VesselTree& Input;
  const SweepSections& Sections;
  VesselTree Tree;
  const SweepSettings& Settings;
  const ProgressCallback& Progress;
  Reliefs Relief;
  std::vector<SweepLeftOut> LeftOut;
  std::vector<std::string> Remarks;
  std::map<int, int> Cuts; ///< of each group
  int FaultSweeps = 0;
  bool Last = false;
};
}

SweptSurface SweepVesselTree(const VesselTree& tree, const SweepSettings& settings,
  const SweepSections& sections, const ProgressCallback& progress)
{
  settings.Validate();
  if (tree.branches.empty())
  {
    return {};
  }
  double reported = 0.0;
  ProgressCallback rising;
  if (progress)
  {
    rising = [&](double done)
    {
      reported = std::max(reported, done);
      return progress(reported);
    };
  }
  return Sweeper(tree, sections, settings, rising).Run();
}

namespace
{
/// The surface's points and what belongs to each, where the wall is known.
void FillPoints(
  const SweptLumen& lumen, const std::vector<RemeshVertex>& vertices, SweptSurface& result)
{
  const std::size_t n = vertices.size();
  result.points.resize(n);
  result.normals.resize(n);
  result.edgeLength.resize(n);
  result.curvature.resize(n);
  result.radius.resize(n);
  result.abscissa.resize(n);
  result.groupId.resize(n);
  ParallelFor(static_cast<std::int64_t>(n), 1024,
    [&](std::int64_t begin, std::int64_t end)
    {
      for (std::int64_t v = begin; v < end; ++v)
      {
        const RemeshVertex& vertex = vertices[v];
        SweptLumen::Site site{ vertex.part, vertex.piece };
        SweptLumen::Sample sample;
        lumen.Evaluate(vertex.position, site, sample);
        const SweptLumen::Vessel& vessel = lumen.Vessels()[sample.vessel];
        const double s = std::clamp(sample.s, 0.0, vessel.axis->Length());
        result.points[v] = vertex.position;
        result.normals[v] = vertex.normal;
        result.edgeLength[v] = vertex.size;
        result.curvature[v] = sample.curvature;
        result.radius[v] = sample.radius;
        result.abscissa[v] = vessel.abscissa + s;
        result.groupId[v] = lumen.GroupAt(sample.vessel, s);
      }
    });
}

/// Takes the caps away, with their inner points.
void OpenEnds(SweptSurface& result)
{
  const std::size_t n = result.points.size();
  std::vector<std::int64_t> number(n, -1);
  std::vector<Triangle> triangles;
  for (std::size_t t = 0; t < result.triangles.size(); ++t)
  {
    if (result.entityId[t] == 1)
    {
      triangles.push_back(result.triangles[t]);
      for (const std::int64_t p : triangles.back())
      {
        number[p] = 0;
      }
    }
  }
  std::int64_t count = 0;
  for (std::int64_t& p : number)
  {
    p = p < 0 ? p : count++;
  }
  const auto keep = [&](auto& list)
  {
    for (std::size_t v = 0; v < list.size(); ++v)
    {
      if (number[v] >= 0)
      {
        list[number[v]] = list[v];
      }
    }
    list.resize(std::min<std::size_t>(list.size(), count));
  };
  keep(result.points);
  keep(result.normals);
  keep(result.edgeLength);
  keep(result.curvature);
  keep(result.radius);
  keep(result.abscissa);
  keep(result.groupId);
  keep(result.repaired);
  for (Triangle& t : triangles)
  {
    for (std::int64_t& p : t)
    {
      p = number[p];
    }
  }
  result.triangles = std::move(triangles);
  result.entityId.assign(result.triangles.size(), 1);
}

/// The vessels' places where triangles are bad.
std::vector<Fault> PlacesOf(const SweptLumen& lumen, const std::vector<RemeshVertex>& vertices,
  const std::vector<Triangle>& triangles, const std::vector<std::int64_t>& cells)
{
  std::vector<Fault> places;
  for (const std::int64_t t : cells)
  {
    const RemeshVertex& vertex = vertices[triangles[t][0]];
    SweptLumen::Site site{ vertex.part, vertex.piece };
    SweptLumen::Sample sample;
    lumen.Evaluate(vertex.position, site, sample);
    places.push_back(
      { vertex.position, sample.radius, lumen.GroupAt(sample.vessel, std::max(0.0, sample.s)) });
  }
  return places;
}

/// Whether vessels meet at some of these triangles: only there blunter edges help.
bool AnyInJunction(const AdaptiveRemesher& mesh, const std::vector<std::int64_t>& cells)
{
  const std::vector<Triangle> triangles = mesh.Triangles();
  return std::any_of(cells.begin(), cells.end(),
    [&](std::int64_t t) { return mesh.Vertices()[triangles[t][0]].part < 0; });
}

/// Triangles at edges that have not two of them, one each way: such a mesh can not be remeshed.
std::vector<std::int64_t> CellsOfBadEdges(const std::vector<Triangle>& triangles)
{
  std::map<std::pair<std::int64_t, std::int64_t>, std::int64_t> sides;
  std::set<std::int64_t> bad;
  for (std::size_t t = 0; t < triangles.size(); ++t)
  {
    for (int c = 0; c < 3; ++c)
    {
      const auto side = sides.emplace(
        std::make_pair(triangles[t][c], triangles[t][(c + 1) % 3]), static_cast<std::int64_t>(t));
      if (!side.second || triangles[t][c] == triangles[t][(c + 1) % 3])
      {
        bad.insert({ side.first->second, static_cast<std::int64_t>(t) });
      }
    }
  }
  for (const auto& side : sides)
  {
    if (sides.count({ side.first.second, side.first.first }) == 0)
    {
      bad.insert(side.second);
    }
  }
  return { bad.begin(), bad.end() };
}

/// Replaces bad triangles where they are. @return whether that gave a sound mesh
bool MendTriangles(const SweptLumen& lumen, const VesselTree& tree,
  const std::vector<Fault>& faults, double minimumAngle, RescueMesh& mesh, SweptSurface& result)
{
  if (!CleanSweptMesh(mesh, lumen.Trees(), minimumAngle))
  {
    return false;
  }
  std::set<int> said;
  for (const Fault& fault : faults)
  {
    if (said.insert(fault.group).second)
    {
      AddRepair(result.repairs, result.remarks, tree, fault.group,
        "triangles that were too thin or cut each other were replaced; the wall is not exact there",
        fault.position);
    }
  }
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
  {
    RemeshVertex& vertex = mesh.vertices[i];
    if (mesh.replaced[i] != 0 && vertex.patch < 0)
    {
      SweptLumen::Site site{ vertex.part, vertex.piece };
      SweptLumen::Sample sample;
      lumen.Evaluate(vertex.position, site, sample);
      vertex.normal = sample.gradient.normalized();
    }
  }
  return true;
}

/**
 * @param last  what stays bad is not relieved any more: triangles are replaced even by poor ones
 */
Sweep SweepOnce(const VesselTree& tree, const SweepSections& sections,
  const SweepSettings& settings, const Reliefs& reliefs, bool lastSweep,
  const ProgressCallback& progress)
{
  Sweep sweep;
  SweptSurface& result = sweep.surface;
  const auto part = [&](double from, double to) -> ProgressCallback
  {
    if (!progress)
    {
      return {};
    }
    return [&progress, from, to](double f) { return progress(from + (to - from) * f); };
  };
  SweptLumen lumen(tree, sections, settings, reliefs.places, reliefs.leftOut);
  CheckSize(tree, settings);
  lumen.SetEdgeRetreat(BluntRetreat);
  Report(progress, 0.05);
  result.remarks = lumen.Remarks();
  result.repairs = lumen.Repairs();
  result.leftOut = lumen.LeftOut();
  result.trees = lumen.Trees();
  result.leftOutPoints = lumen.SweptPoints(); // all others, in the end

  // Caps: roots first, then tips, both in the order of the input's branches.
  const auto& tips = lumen.Tips();
  std::map<std::int64_t, std::size_t> rank;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (const std::int64_t p : { branch.points.front(), branch.points.back() })
    {
      rank.emplace(p, rank.size());
    }
  }
  std::vector<int> order(tips.size());
  for (std::size_t i = 0; i < order.size(); ++i)
  {
    order[i] = static_cast<int>(i);
  }
  std::sort(order.begin(), order.end(),
    [&](int a, int b)
    {
      return tips[a].inlet != tips[b].inlet ? tips[a].inlet
                                            : rank[tips[a].point] < rank[tips[b].point];
    });
  std::vector<int> capEntity(tips.size());
  for (std::size_t i = 0; i < order.size(); ++i)
  {
    const SweptLumen::Tip& tip = tips[order[i]];
    capEntity[order[i]] = static_cast<int>(i) + 2;
    result.caps.push_back({ static_cast<int>(i) + 2, tip.group, tip.inlet, tip.point, tip.centre,
      tip.normal, tip.radius });
  }

  const SweptFirstMesh first =
    MakeFirstMesh(lumen, settings, capEntity, reliefs.places, part(0.05, 0.25));
  const std::vector<std::int64_t> torn = CellsOfBadEdges(first.triangles);
  if (!torn.empty())
  {
    sweep.faults = PlacesOf(lumen, first.vertices, first.triangles, torn);
    return sweep;
  }
  // Edges between vessels that are too sharp for the mesh to follow are made blunter, all of them:
  // the same everywhere is easier to understand than some that differ.
  SweepSettings blunted = settings;
  RescueMesh mesh;
  for (int attempt = 0;; ++attempt)
  {
    Wall wall(lumen, blunted);
    AdaptiveRemesher remesher(
      wall, first.vertices, first.triangles, first.entity, settings.gradation);
    remesher.Run(part(attempt == 0 ? 0.25 : 0.9, 0.95));
    std::vector<std::int64_t> faults = FindFaults(remesher);
    // What is a heap of triangles only grows.
    for (int repair = 0; repair < Repairs && !faults.empty() && faults.size() < Heap; ++repair)
    {
      remesher.Repair(faults);
      faults = FindFaults(remesher);
    }
    mesh = { remesher.Vertices(), remesher.Triangles(), remesher.Entities(), {} };
    if (faults.empty())
    {
      // What the mesher would refuse all the same.
      faults = CellsThatFail(PointsOf(mesh.vertices), mesh.triangles);
      if (faults.empty())
      {
        break;
      }
    }
    const bool last =
      attempt + 1 == RemeshingAttempts || faults.size() >= Heap || !AnyInJunction(remesher, faults);
    if (last)
    {
      const std::vector<Fault> places = PlacesOf(lumen, mesh.vertices, mesh.triangles, faults);
      if (!MendTriangles(lumen, tree, places, FairAngle, mesh, result) &&
        !(lastSweep && MendTriangles(lumen, tree, places, NeedAngle, mesh, result)))
      {
        sweep.faults = places;
        return sweep;
      }
      break;
    }
    blunted.edgeRetreat = 2.0 * std::max(blunted.edgeRetreat, BluntRetreat);
    lumen.SetEdgeRetreat(blunted.edgeRetreat);
  }
  Report(progress, 0.95);
  FillPoints(lumen, mesh.vertices, result);
  result.triangles = std::move(mesh.triangles);
  result.entityId = std::move(mesh.entity);
  result.repaired = std::move(mesh.replaced);
  if (!settings.capped)
  {
    OpenEnds(result);
  }
  result.patches = MakePatches(lumen, settings);
  Report(progress, 1.0);
  return sweep;
}
}
}
