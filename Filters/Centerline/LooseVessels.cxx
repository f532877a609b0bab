#include "LooseVessels.h"

#include "CheapestFirst.h"
#include "CurveGeometry.h"
#include "LumenMeasurement.h"
#include "Median.h"
#include "ParallelFor.h"
#include "SegmentAtlas.h"
#include "TreeLinks.h"
#include "VoxelLattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr double MinimumLength = 8.0; ///< mm
constexpr double Margin = 20.0;       ///< mm around the tree: half the way between its branches
/// Vesselness of a piece's voxels, in that on the axes of thin arteries: it falls so far towards their walls.
constexpr double MinimumTube = 0.2;
constexpr double MinimumShare = 0.15;  ///< of the contrast between muscle and blood
constexpr double TooBright = 1.6;      ///< the same: bone
constexpr double Thin = 1.2;           ///< mm, radius
constexpr double Step = 1.0;           ///< mm between sections
constexpr double BeyondWall = 1.5;     ///< mm beyond the wall of the tree's vessels
constexpr double SeenConfidence = 0.5; ///< of a section with a lumen all around
/// Great cardiac, middle and marginal veins run in the grooves and beside branches, some millimetres off the artery.
constexpr double BesideReach = 10.0; ///< mm
constexpr double BesideCosine = 0.7; ///< of the angle between both
/// Contrast of arteries that were missed and of veins, over that of arteries of their calibre: mean and spread. Behind lesions
/// it is less; veins fill after the arteries, some hearts' nearly as much.
constexpr double ArteryContrast[] = { 0.95, 0.2 };
constexpr double VeinContrast[] = { 0.55, 0.15 };
/// mm, half-maximum radii: arteries end thinner than the one, veins go on into wider ones than the other.
constexpr double ThinEnd[] = { 0.55, 0.75 };
/// The same: a stretch between two lesions of a trunk may end as wide as the one; ribs and great vessels as the other.
constexpr double WideEnd[] = { 1.2, 1.8 };
constexpr double EndLength = 3.0; ///< mm over which an end's radius is taken
/// What begins ahead of a tip of the tree and goes on in its direction is the rest of that artery: a lesion parts them.
constexpr double OnwardGap = 15.0;    ///< mm from the tip
constexpr double OnwardCosine = 0.75; ///< of the angles between the tip, the gap and what goes on
constexpr double OnwardOdds = 2.0;
constexpr double SideCosine = 0.5;    ///< the same, of what comes from the side of a vessel
constexpr double MinimumOnward = 5.0; ///< mm of either
/// Mean distance of true arteries from those of the mean heart is less; beyond it grows doubt.
constexpr double UsualAway = 10.0; ///< mm of the mean heart

/// Whether a segment is of the artery that a course of the mean heart is called by: "LAD" has three.
bool IsOf(int segment, const std::string& course)
{
  return SegmentName(segment) == course ||
    (course == "LAD" && segment >= ProximalLAD && segment <= DistalLAD) ||
    (course == "LCx" && (segment == ProximalLCx || segment == DistalLCx)) ||
    (course == "RCA" && segment >= ProximalRCA && segment <= DistalRCA);
}

/// Logarithm of a normal distribution's density, but for a constant.
double LogDensity(double value, const double (&usual)[2])
{
  const double off = (value - usual[0]) / usual[1];
  return -0.5 * off * off - std::log(usual[1]);
}

/// Of an artery rather than a vein, as a logarithm.
/// @param brightness  over that of arteries of the same calibre
double ArteryOdds(double brightness)
{
  return LogDensity(brightness, ArteryContrast) - LogDensity(brightness, VeinContrast);
}

/// What a vessel of the mean heart is called.
std::string NameOf(const SegmentAtlas::Point& point)
{
  const std::string number = point.number > 0 ? std::to_string(point.number) : "";
  switch (point.vessel)
  {
    case Vessel::LeftMain:
      return SegmentName(LeftMain);
    case Vessel::AnteriorDescending:
      return "LAD";
    case Vessel::Circumflex:
      return "LCx";
    case Vessel::Ramus:
      return SegmentName(RamusIntermedius);
    case Vessel::Diagonal:
      return "D" + number;
    case Vessel::Septal:
      return "S" + number;
    case Vessel::ObtuseMarginal:
      return "OM" + number;
    case Vessel::LeftPosterolateral:
      return SegmentName(LeftPLB);
    case Vessel::LeftPosteriorDescending:
      return SegmentName(LeftPDA);
    case Vessel::RightCoronary:
      return "RCA";
    case Vessel::RightVentricular:
      return SegmentName(RightVentricularBranch);
    case Vessel::AcuteMarginal:
      return SegmentName(AcuteMarginal);
    case Vessel::RightPosteriorDescending:
      return SegmentName(RightPDA);
    case Vessel::RightPosterolateral:
      return SegmentName(RightPLB);
    case Vessel::InferiorRight:
      return SegmentName(InferiorRightBranch);
    case Vessel::Other:
      break;
  }
  return "";
}

/// A point of the tree with its course, and what the image shows there.
struct Sample
{
  Vector3 position;
  Vector3 tangent;
  int segment = 0;
  double radius = 0.0;     ///< mm, half-maximum
  double contrast = 0.0;   ///< of its lumen, share of that of blood
  double vesselness = 0.0; ///< greatest around
};

/// Where a branch of the tree ends.
struct Tip
{
  Vector3 position;
  Vector3 ahead; ///< unit
};

/// Ends of branches without daughters, with the direction of their last millimetres.
std::vector<Tip> TipsOf(const VesselTree& tree)
{
  std::vector<Tip> tips;
  const TreeLinks links(tree);
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    if (!links.IsTip(b))
    {
      continue;
    }
    const VesselTree::Branch& branch = tree.branches[b];
    const Vector3& tip = tree.points[branch.points.back()];
    std::size_t back = branch.points.size() - 1;
    while (back > 0 && (tree.points[branch.points[back]] - tip).norm() < 2.0 * EndLength)
    {
      --back;
    }
    const Vector3 ahead = (tip - tree.points[branch.points[back]]).normalized();
    if (ahead.norm() > 0.5)
    {
      tips.push_back({ tip, ahead });
    }
  }
  return tips;
}

class Search
{
public:
  explicit Search(const LooseVesselInput& input)
    : I(input)
    , L(input.image.grid)
    , Interpolator(input.image)
    , Tips(TipsOf(input.tree))
  {
    this->Lumen.reference.lumen = input.blood;
    this->Lumen.reference.background = input.tissue;
  }
  std::vector<LooseVessel> Run();

private:
  double Share(std::int64_t voxel) const
  {
    const double value = std::visit(
      [&](const auto* values) { return static_cast<double>(values[voxel]); }, this->I.image.values);
    return (value - this->I.tissue) / (this->I.blood - this->I.tissue);
  }
  Sample Measure(const Vector3& position, const Vector3& tangent, double guess, double* seen) const;
  void MeasureTree();
  std::vector<std::vector<std::int64_t>> Pieces() const;
  bool IsOnHeart(const std::vector<std::int64_t>& piece) const;
  double Away(const Vector3& position, std::string* name) const;
  std::vector<Vector3> Axis(const std::vector<std::int64_t>& piece) const;
  struct Section
  {
    Sample sample;
    bool seen; ///< a lumen all around
    double
      odds; ///< of an artery's rather than a vein's, as a logarithm, -1 to 1; -1 where nothing is seen
  };
  template <typename Take>
  void AddPiece(
    std::int64_t first, const Take& take, std::vector<std::vector<std::int64_t>>& pieces) const;
  double UsualContrast(double radius) const;
  bool GoesOn(const std::vector<Vector3>& axis) const;
  bool ComesFromASide(const std::vector<Vector3>& axis) const;
  std::vector<Section> Sections(const std::vector<Vector3>& axis) const;
  static std::pair<std::size_t, std::size_t> BestInterval(const std::vector<Section>& sections);
  bool Describe(
    const std::vector<Vector3>& whole, std::vector<Section> sections, LooseVessel& vessel) const;
  std::vector<std::vector<std::int64_t>> Rest(const std::vector<std::int64_t>& piece,
    const std::vector<Vector3>& axis, const std::vector<Section>& sections) const;
  std::vector<LooseVessel> VesselsOf(std::vector<std::int64_t> piece) const;

  const LooseVesselInput& I;
  VoxelLattice L;
  ImageInterpolator Interpolator;
  LumenSettings Lumen;
  std::vector<Tip> Tips;
  std::vector<Sample> Samples; ///< of the tree, where it is seen
  double Tube = 0.0;           ///< vesselness of thin arteries
};

Sample Search::Measure(
  const Vector3& position, const Vector3& tangent, double guess, double* seen) const
{
  const LumenSection section =
    MeasureLumen(this->Interpolator, position, tangent, guess, this->Lumen);
  Sample sample;
  sample.position = position;
  sample.tangent = tangent;
  sample.radius = section.radius;
  // Thin vessels show less in fat than in muscle: what is around them decides what blood would show.
  const double behind = std::min(section.behind, this->I.tissue);
  sample.contrast = (section.lumen - behind) / (this->I.blood - behind);
  if (const auto at = this->L.Nearest(section.centre))
  {
    this->L.Ball(*at, 1.0,
      [&](std::int64_t voxel, const std::array<int, 3>&)
      {
        const double value = this->I.vesselness[voxel];
        sample.vesselness = std::max(sample.vesselness, value);
      });
  }
  *seen = section.confidence;
  return sample;
}

void Search::MeasureTree()
{
  const VesselTree& tree = this->I.tree;
  std::vector<double> thin;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (std::size_t i = 2; i + 2 < branch.points.size(); i += 2)
    {
      const std::int64_t p = branch.points[i];
      const Vector3 tangent =
        (tree.points[branch.points[i + 2]] - tree.points[branch.points[i - 2]]).normalized();
      double seen = 0.0;
      Sample sample = this->Measure(tree.points[p], tangent, tree.radius[p], &seen);
      sample.segment = tree.segmentId.empty() ? 0 : tree.segmentId[p];
      if (tangent.allFinite() && seen > SeenConfidence)
      {
        this->Samples.push_back(sample);
        if (sample.radius < Thin)
        {
          thin.push_back(sample.vesselness);
        }
      }
    }
  }
  this->Tube = MedianOf(thin);
}

/// What hangs together with a voxel, sorted, when it is long enough for a vessel.
/// @param take  whether a voxel was free; it is not any more
template <typename Take>
void Search::AddPiece(
  std::int64_t first, const Take& take, std::vector<std::vector<std::int64_t>>& pieces) const
{
  std::vector<std::int64_t> piece = this->L.Connected(first, take);
  if (static_cast<double>(piece.size()) * std::cbrt(this->L.VoxelVolume()) >= MinimumLength)
  {
    std::sort(piece.begin(), piece.end());
    pieces.push_back(std::move(piece));
  }
}

/// Connected voxels of tubes that are not near the tree.
std::vector<std::vector<std::int64_t>> Search::Pieces() const
{
  const std::array<int, 3>& size = this->L.Size;
  std::array<int, 3> low = size;
  std::array<int, 3> high{ -1, -1, -1 };
  std::vector<char> taken(static_cast<std::size_t>(this->I.image.NumberOfVoxels()), 0);
  for (std::size_t p = 0; p < this->I.tree.points.size(); ++p)
  {
    const auto at = this->L.Nearest(this->I.tree.points[p]);
    if (!at)
    {
      continue;
    }
    for (int axis = 0; axis < 3; ++axis)
    {
      const int reach = static_cast<int>(Margin / this->L.Spacing[axis]);
      low[axis] = std::min(low[axis], std::max(0, (*at)[axis] - reach));
      high[axis] = std::max(high[axis], std::min(size[axis] - 1, (*at)[axis] + reach));
    }
    this->L.Ball(*at, this->I.tree.radius[p] + BeyondWall,
      [&](std::int64_t voxel, const std::array<int, 3>&) { taken[voxel] = 1; });
  }
  const double minimum = MinimumTube * this->Tube;
  const auto free = [&](std::int64_t voxel)
  {
    if (taken[voxel] != 0 || !(this->I.vesselness[voxel] >= minimum))
    {
      return false;
    }
    const double share = this->Share(voxel);
    return share >= MinimumShare && share <= TooBright;
  };
  const auto take = [&](std::int64_t voxel)
  {
    const bool was = free(voxel);
    taken[voxel] |= was ? 1 : 0;
    return was;
  };
  // All that are free, slice by slice; pieces are then taken in this order.
  std::vector<std::vector<std::int64_t>> slices(
    static_cast<std::size_t>(std::max(0, high[2] - low[2] + 1)));
  ParallelFor(static_cast<std::int64_t>(slices.size()), 4,
    [&](std::int64_t begin, std::int64_t end)
    {
      for (std::int64_t slice = begin; slice < end; ++slice)
      {
        for (int j = low[1]; j <= high[1]; ++j)
        {
          for (int i = low[0]; i <= high[0]; ++i)
          {
            const std::int64_t voxel = this->L.Index(i, j, low[2] + static_cast<int>(slice));
            if (free(voxel))
            {
              slices[slice].push_back(voxel);
            }
          }
        }
      }
    });
  std::vector<std::vector<std::int64_t>> pieces;
  for (const std::vector<std::int64_t>& slice : slices)
  {
    for (const std::int64_t first : slice)
    {
      this->AddPiece(first, take, pieces);
    }
  }
  return pieces;
}

/// mm of the mean heart from its nearest artery, and what that is called.
double Search::Away(const Vector3& position, std::string* name) const
{
  const SegmentAtlas& atlas = SegmentAtlas::Get();
  const Vector3 place = atlas.axes.transpose() * this->I.heart.ToHeart(position) + atlas.origin;
  double minimum = std::numeric_limits<double>::infinity();
  const SegmentAtlas::Point* nearest = nullptr;
  for (const SegmentAtlas::Point& point : atlas.points)
  {
    const double away = (point.position - place).squaredNorm();
    if (away < minimum)
    {
      minimum = away;
      nearest = &point;
    }
  }
  if (name != nullptr && nearest != nullptr)
  {
    *name = NameOf(*nearest);
  }
  return std::sqrt(minimum);
}

/// Whether most of a piece is where arteries run: vessels of the lung and ribs are many.
bool Search::IsOnHeart(const std::vector<std::int64_t>& piece) const
{
  const std::size_t stride = std::max<std::size_t>(1, piece.size() / 100);
  int all = 0;
  int near = 0;
  for (std::size_t n = 0; n < piece.size(); n += stride)
  {
    ++all;
    near += this->Away(this->L.World(this->L.Place(piece[n])), nullptr) < 2.0 * UsualAway ? 1 : 0;
  }
  return 2 * near > all;
}

/// The longest shortest way through a piece, smoothed, a step apart.
std::vector<Vector3> Search::Axis(const std::vector<std::int64_t>& piece) const
{
  std::vector<std::ptrdiff_t> before(piece.size());
  const auto farthest = [&](std::size_t from)
  {
    std::vector<float> distance(piece.size(), std::numeric_limits<float>::infinity());
    CheapestFirst queue;
    distance[from] = 0.0F;
    before[from] = -1;
    queue.push({ 0.0F, static_cast<std::int64_t>(from) });
    std::size_t last = from;
    while (!queue.empty())
    {
      const float length = queue.top().cost;
      const auto at = static_cast<std::size_t>(queue.top().voxel);
      queue.pop();
      if (length > distance[at])
      {
        continue;
      }
      last = at;
      this->L.Neighbours(piece[at],
        [&](std::int64_t voxel, float step)
        {
          const auto found = std::lower_bound(piece.begin(), piece.end(), voxel);
          if (found == piece.end() || *found != voxel)
          {
            return;
          }
          const auto next = found - piece.begin();
          // Through the middle of the tube.
          const double tube = this->I.vesselness[voxel] / this->Tube;
          const auto cost = static_cast<float>(step / std::clamp(tube, 0.3, 1.5));
          if (length + cost < distance[next])
          {
            distance[next] = length + cost;
            before[next] = static_cast<std::ptrdiff_t>(at);
            queue.push({ distance[next], next });
          }
        });
    }
    return last;
  };
  const std::size_t end = farthest(farthest(0));
  std::vector<Vector3> way;
  for (auto at = static_cast<std::ptrdiff_t>(end); at >= 0; at = before[at])
  {
    way.push_back(this->L.World(this->L.Place(piece[at])));
  }
  const auto reach = static_cast<std::size_t>(1.5 / this->L.Spacing.minCoeff()) + 1;
  std::vector<Vector3> axis;
  for (std::size_t n = 0; n < way.size(); ++n)
  {
    const std::size_t around = std::min({ reach, n, way.size() - 1 - n });
    Vector3 mean = Vector3::Zero();
    for (std::size_t m = n - around; m <= n + around; ++m)
    {
      mean += way[m] / static_cast<double>(2 * around + 1);
    }
    if (axis.empty() || (mean - axis.back()).norm() >= Step)
    {
      axis.push_back(mean);
    }
  }
  return axis;
}

/// What arteries of a radius usually show above muscle; 0 where the tree has none of about that radius.
double Search::UsualContrast(double radius) const
{
  std::vector<double> usual;
  for (const Sample& sample : this->Samples)
  {
    if (std::abs(sample.radius - radius) < 0.2 * radius)
    {
      usual.push_back(sample.contrast);
    }
  }
  return MedianOf(usual);
}

/// Whether one of an axis' ends is one that a condition takes.
/// @param takes  the end, and its direction into the axis
template <typename Takes>
bool AnyEnd(const std::vector<Vector3>& axis, const Takes& takes)
{
  const auto inside = std::min(axis.size() - 1, static_cast<std::size_t>(2.0 * EndLength / Step));
  const auto end = [&](const Vector3& begin, const Vector3& inwards)
  { return takes(begin, Vector3((inwards - begin).normalized())); };
  return end(axis.front(), axis[inside]) || end(axis.back(), axis[axis.size() - 1 - inside]);
}

/// Whether an axis, from one of its ends, goes on where the tree ends.
bool Search::GoesOn(const std::vector<Vector3>& axis) const
{
  return AnyEnd(axis,
    [&](const Vector3& begin, const Vector3& along)
    {
      return std::any_of(this->Tips.begin(), this->Tips.end(),
        [&](const Tip& tip)
        {
          const Vector3 gap = begin - tip.position;
          // Over a short gap its direction says nothing.
          const bool ahead =
            gap.norm() < BeyondWall || gap.dot(tip.ahead) > OnwardCosine * gap.norm();
          return gap.norm() < OnwardGap && ahead && along.dot(tip.ahead) > OnwardCosine;
        });
    });
}

/// Whether an axis, straight back from one of its ends, comes from the side of a vessel that flows its way.
bool Search::ComesFromASide(const std::vector<Vector3>& axis) const
{
  return AnyEnd(axis,
    [&](const Vector3& begin, const Vector3& along)
    {
      return std::any_of(this->Samples.begin(), this->Samples.end(),
        [&](const Sample& sample)
        {
          const Vector3 gap = begin - sample.position;
          return gap.norm() < OnwardGap && gap.dot(along) > SideCosine * gap.norm() &&
            along.dot(sample.tangent) > 0.0;
        });
    });
}

/// Sections along an axis.
std::vector<Search::Section> Search::Sections(const std::vector<Vector3>& axis) const
{
  std::map<int, double> known; // by radius in tenths of mm
  std::vector<Section> sections;
  std::vector<double> brightness(axis.size(), 0.0);
  for (std::size_t n = 0; n < axis.size(); ++n)
  {
    const Vector3 tangent =
      (axis[std::min(n + 2, axis.size() - 1)] - axis[n < 2 ? 0 : n - 2]).normalized();
    double seen = 0.0;
    Section section{ this->Measure(axis[n], tangent, 0.8, &seen), false, -1.0 };
    section.seen = seen > SeenConfidence;
    if (section.seen)
    {
      const auto [usual, isNew] = known.emplace(std::lround(10.0 * section.sample.radius), 0.0);
      if (isNew)
      {
        usual->second = this->UsualContrast(section.sample.radius);
      }
      brightness[n] = section.sample.contrast / std::max(1e-9, usual->second);
    }
    sections.push_back(section);
  }
  // With its neighbours: noise is as large as the difference.
  for (std::size_t n = 0; n < sections.size(); ++n)
  {
    double sum = 0.0;
    int seen = 0;
    for (std::size_t m = n == 0 ? 0 : n - 1; m < std::min(n + 2, sections.size()); ++m)
    {
      sum += brightness[m];
      seen += sections[m].seen ? 1 : 0;
    }
    if (sections[n].seen)
    {
      sections[n].odds = std::clamp(ArteryOdds(sum / seen), -1.0, 1.0);
    }
  }
  return sections;
}

/// The stretch that looks most like an artery: an artery and a vein that touch are one piece of voxels.
std::pair<std::size_t, std::size_t> Search::BestInterval(const std::vector<Section>& sections)
{
  std::pair<std::size_t, std::size_t> best{ 0, 0 };
  double most = 0.0;
  double sum = 0.0;
  std::size_t begin = 0;
  for (std::size_t n = 0; n < sections.size(); ++n)
  {
    if (sum <= 0.0)
    {
      sum = 0.0;
      begin = n;
    }
    sum += sections[n].odds;
    if (sum > most)
    {
      most = sum;
      best = { begin, n + 1 };
    }
  }
  return best;
}

bool Search::Describe(
  const std::vector<Vector3>& whole, std::vector<Section> sections, LooseVessel& vessel) const
{
  const auto [first, last] = BestInterval(sections);
  sections.assign(sections.begin() + static_cast<std::ptrdiff_t>(first),
    sections.begin() + static_cast<std::ptrdiff_t>(last));
  vessel.points.assign(whole.begin() + static_cast<std::ptrdiff_t>(first),
    whole.begin() + static_cast<std::ptrdiff_t>(last));
  vessel.length = PolylineLength(vessel.points);
  vessel.goesOn = vessel.length >= MinimumOnward && this->GoesOn(vessel.points);
  const bool hangs =
    vessel.goesOn || (vessel.length >= MinimumOnward && this->ComesFromASide(vessel.points));
  if (vessel.length < MinimumLength && !hangs)
  {
    return false;
  }
  std::vector<double> radii;
  std::vector<double> contrasts;
  std::map<std::string, int> names;
  std::array<std::vector<double>, 2> ends;
  for (std::size_t n = 0; n < sections.size(); ++n)
  {
    const Sample& sample = sections[n].sample;
    if (sections[n].seen)
    {
      radii.push_back(sample.radius);
      contrasts.push_back(sample.contrast);
      for (const std::size_t end : { 0, 1 })
      {
        if (static_cast<double>(end == 0 ? n : sections.size() - 1 - n) * Step < EndLength)
        {
          ends[end].push_back(sample.radius);
        }
      }
    }
    const Sample* companion = &this->Samples.front();
    for (const Sample& other : this->Samples)
    {
      companion = (other.position - sample.position).squaredNorm() <
          (companion->position - sample.position).squaredNorm()
        ? &other
        : companion;
    }
    std::string name;
    vessel.away += this->Away(sample.position, &name);
    // Beside, not ahead of a tip.
    const Vector3 across = companion->position - sample.position;
    if (across.norm() < BesideReach &&
      std::abs(across.dot(sample.tangent)) < BesideCosine * across.norm() &&
      std::abs(companion->tangent.dot(sample.tangent)) > BesideCosine)
    {
      (IsOf(companion->segment, name) ? vessel.besideItsOwn : vessel.besideOther) += 1.0;
    }
    ++names[name];
  }
  const auto count = static_cast<double>(sections.size());
  vessel.besideItsOwn /= count;
  vessel.besideOther /= count;
  vessel.away /= count;
  vessel.seen = static_cast<double>(radii.size()) / count;
  vessel.radius = MedianOf(radii);
  const double usual = this->UsualContrast(vessel.radius);
  vessel.brightness = usual > 0.0 ? MedianOf(contrasts) / usual : 0.0;
  vessel.nearest = std::max_element(names.begin(), names.end(),
    [](const auto& one, const auto& other) {
      return one.second < other.second;
    })->first;
  vessel.thinEnd = vessel.radius;
  for (const std::vector<double>& end : ends)
  {
    vessel.thinEnd = end.empty() ? vessel.thinEnd : std::min(vessel.thinEnd, MedianOf(end));
  }
  // Where an artery usually runs and does, another one is its vein, the surer the longer it runs beside; where it does
  // not, it is the artery.
  const auto beyond = [&](const double(&from)[2])
  { return std::clamp((vessel.thinEnd - from[0]) / (from[1] - from[0]), 0.0, 1.0); };
  const double thick = beyond(ThinEnd) + beyond(WideEnd);
  const double companion = std::min(8.0, vessel.besideItsOwn * (2.0 + 0.1 * vessel.length));
  const double odds = ArteryOdds(vessel.brightness) + 1.0 - companion - 1.5 * vessel.besideOther +
    1.0 - 3.0 * thick + (vessel.goesOn ? OnwardOdds : 0.0);
  // What is short may be anything: two of three that are as long as this.
  constexpr double convincing = 5.0; // mm
  vessel.confidence = vessel.seen / (1.0 + std::exp(-odds)) *
    (1.0 - std::exp(-vessel.length / convincing)) *
    std::exp(-std::max(0.0, vessel.away - UsualAway) / UsualAway);
  return true;
}

/// What is left of a piece without the vessel along an axis: parts that may be a vessel.
std::vector<std::vector<std::int64_t>> Search::Rest(const std::vector<std::int64_t>& piece,
  const std::vector<Vector3>& axis, const std::vector<Section>& sections) const
{
  const double edge = std::cbrt(this->L.VoxelVolume());
  std::vector<char> taken(piece.size(), 0);
  for (std::size_t n = 0; n < axis.size(); ++n)
  {
    const double reach = std::clamp(sections[n].sample.radius, Step, WideEnd[1]) + edge;
    for (std::size_t v = 0; v < piece.size(); ++v)
    {
      const Vector3 place = this->L.World(this->L.Place(piece[v]));
      taken[v] |= (place - axis[n]).squaredNorm() < reach * reach ? 1 : 0;
    }
  }
  const auto take = [&](std::int64_t voxel)
  {
    const auto found = std::lower_bound(piece.begin(), piece.end(), voxel);
    if (found == piece.end() || *found != voxel)
    {
      return false;
    }
    char& known = taken[static_cast<std::size_t>(found - piece.begin())];
    const bool was = known == 0;
    known = 1;
    return was;
  };
  std::vector<std::vector<std::int64_t>> parts;
  for (const std::int64_t first : piece)
  {
    this->AddPiece(first, take, parts);
  }
  return parts;
}

/// Vessels that touch are one piece: the longest of it, then those of what is left.
std::vector<LooseVessel> Search::VesselsOf(std::vector<std::int64_t> piece) const
{
  constexpr int most = 8; // ways that are looked at
  std::vector<LooseVessel> vessels;
  std::vector<std::vector<std::int64_t>> parts{ std::move(piece) };
  for (int n = 0; n < most && !parts.empty(); ++n)
  {
    const auto maximum = std::max_element(
      parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
    const std::vector<std::int64_t> part = std::move(*maximum);
    parts.erase(maximum);
    if (!this->IsOnHeart(part))
    {
      continue;
    }
    const std::vector<Vector3> axis = this->Axis(part);
    const std::vector<Section> sections = this->Sections(axis);
    LooseVessel vessel;
    if (this->Describe(axis, sections, vessel))
    {
      vessels.push_back(std::move(vessel));
    }
    for (std::vector<std::int64_t>& rest : this->Rest(part, axis, sections))
    {
      parts.push_back(std::move(rest));
    }
  }
  return vessels;
}

std::vector<LooseVessel> Search::Run()
{
  this->MeasureTree();
  std::vector<LooseVessel> vessels;
  if (this->Samples.empty() || !(this->Tube > 0.0))
  {
    return vessels;
  }
  std::vector<std::vector<std::int64_t>> pieces = this->Pieces();
  std::vector<std::vector<LooseVessel>> found(pieces.size());
  ParallelFor(static_cast<std::int64_t>(pieces.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        found[n] = this->VesselsOf(std::move(pieces[n]));
      }
    });
  for (std::vector<LooseVessel>& some : found)
  {
    std::move(some.begin(), some.end(), std::back_inserter(vessels));
  }
  std::stable_sort(vessels.begin(), vessels.end(),
    [](const LooseVessel& a, const LooseVessel& b) { return a.length > b.length; });
  ExpectFewMissing(vessels);
  return vessels;
}
}

void ExpectFewMissing(std::vector<LooseVessel>& vessels)
{
  constexpr double most = 10.0; // of the arteries of a heart, about 30, a third
  const auto divided = [](double confidence, double factor)
  { return confidence / (confidence + factor * (1.0 - confidence)); };
  const auto together = [&](double factor)
  {
    double sum = 0.0;
    for (const LooseVessel& vessel : vessels)
    {
      sum += divided(vessel.confidence, factor);
    }
    return sum;
  };
  for (LooseVessel& vessel : vessels)
  {
    vessel.alone = vessel.confidence;
  }
  if (!(together(1.0) > most))
  {
    return;
  }
  // What is certain stays so: no factor may do.
  double low = 0.0;
  double high = 10.0; // logarithms
  for (int n = 0; n < 50; ++n)
  {
    const double middle = 0.5 * (low + high);
    (together(std::exp(middle)) > most ? low : high) = middle;
  }
  for (LooseVessel& vessel : vessels)
  {
    vessel.confidence = divided(vessel.confidence, std::exp(high));
  }
}

std::vector<LooseVessel> FindLooseVessels(const LooseVesselInput& input)
{
  if (!(input.blood > input.tissue) || input.vesselness == nullptr)
  {
    throw std::invalid_argument("loose vessels: blood must be above tissue, and vesselness given");
  }
  return Search(input).Run();
}

std::vector<TreeWarning> LooseVesselWarnings(const std::vector<LooseVessel>& vessels)
{
  constexpr double rather = 0.5;
  std::vector<TreeWarning> warnings;
  const LooseVessel* likeliest = nullptr; // of those that are too many
  int crowd = 0;
  for (const LooseVessel& vessel : vessels)
  {
    if (vessel.confidence < rather)
    {
      if (vessel.alone >= rather)
      {
        ++crowd;
        likeliest = likeliest && likeliest->alone >= vessel.alone ? likeliest : &vessel;
      }
      continue;
    }
    const Vector3& from = vessel.points.front();
    const Vector3& to = vessel.points.back();
    const Vector3& middle = vessel.points[vessel.points.size() / 2];
    std::array<char, 300> text;
    std::snprintf(text.data(), text.size(),
      "a vessel of %.0f mm between (%.1f, %.1f, %.1f) and (%.1f, %.1f, %.1f), by (%.1f, %.1f, "
      "%.1f), looks like an artery and is in no tree; nearest to it usually runs the %s",
      vessel.length, from[0], from[1], from[2], to[0], to[1], to[2], middle[0], middle[1],
      middle[2], vessel.nearest.c_str());
    warnings.push_back({ text.data(), vessel.nearest, middle, std::min(0.99, vessel.confidence) });
  }
  if (likeliest)
  {
    const Vector3& middle = likeliest->points[likeliest->points.size() / 2];
    std::array<char, 300> text;
    std::snprintf(text.data(), text.size(),
      "%d %svessels that are in no tree look like arteries one by one, the likeliest %.0f mm by "
      "(%.1f, %.1f, %.1f); no tree lacks so many: most are noise or veins, some may be arteries",
      crowd, warnings.empty() ? "" : "more ", likeliest->length, middle[0], middle[1], middle[2]);
    warnings.push_back({ text.data(), likeliest->nearest, middle, likeliest->confidence });
  }
  return warnings;
}
}
