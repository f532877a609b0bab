#include "HiddenMouths.h"

#include "CheapestFirst.h"
#include "CrossFrame.h"
#include "DistanceTransform.h"
#include "VoxelLattice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>

namespace coronary
{
namespace
{
constexpr float Infinite = std::numeric_limits<float>::infinity();

/// A voxel on a shortest path, and where it came from.
struct Reached
{
  std::int64_t voxel;
  float distance;      ///< mm, or cost
  std::int32_t before; ///< place in the list, -1 at the start
};

/// An end of a piece.
struct PieceEnd
{
  std::int64_t voxel;
  Vector3 position;
  Vector3 outwards; ///< unit
  double radius;    ///< mm, of the piece behind it
};

class MouthSearch
{
public:
  MouthSearch(const MouthImage& image, double longest, double shortest)
    : I(image)
    , L(image.volume.Grid())
    , Hidden(longest)
    , Longest(longest + Stump)
    , Shortest(shortest)
  {
    std::vector<unsigned char> outside(image.body.size());
    for (std::size_t p = 0; p < outside.size(); ++p)
    {
      outside[p] = image.body[p] == 2 ? 0 : 1;
    }
    this->Best.assign(image.body.size(), Infinite);
    this->Away = SquaredDistanceTransform(
      outside.data(), image.volume.size, Vector3::Constant(image.volume.spacing));
  }

  std::vector<HiddenMouth> Run();

private:
  static constexpr double Stump = 8.0;       ///< mm of vessel before the lesion that may be seen
  static constexpr float MinimumTube = 0.3F; ///< of a clear tube's, that a piece has
  static constexpr float VisibleTube = 0.2F; ///< the same, that a thin lumen has

  bool Orphaned(std::int64_t p) const
  {
    return this->I.body[p] == 0 && this->I.reached[p] < 0.0F && this->I.likeness[p] > 0.5F &&
      this->Tube(p) >= MinimumTube;
  }
  float Tube(std::int64_t p) const { return this->I.tubeness[p] / this->I.clearTube; }
  float Seen(std::int64_t p) const { return std::clamp(this->Tube(p) / VisibleTube, 0.0F, 1.0F); }
  Vector3 World(std::int64_t p) const { return this->I.volume.World(this->I.volume.Place(p)); }

  /// Where paths go from a voxel.
  enum class Onwards
  {
    Everywhere,
    NotHere,
    Nowhere ///< all paths end
  };
  /**
   * Shortest paths from a voxel, nearest first.
   * @param cost    of a step (to a voxel, mm), infinite where it does not go
   * @param arrive  called for each voxel; says where paths go from there
   */
  template <typename Cost, typename Arrive>
  std::vector<Reached> Paths(
    std::int64_t start, float reach, const Cost& cost, const Arrive& arrive);
  /// Distances within the piece of a voxel.
  std::vector<Reached> Within(std::int64_t start, float reach)
  {
    return this->Paths(
      start, reach,
      [this](std::int64_t q, float step) { return this->Number[q] != 0 ? step : Infinite; },
      [](const Reached&) { return Onwards::Everywhere; });
  }
  std::vector<std::vector<std::int64_t>> Pieces();
  bool InLung(const std::vector<std::int64_t>& piece) const;
  std::vector<PieceEnd> EndsOf(const std::vector<Reached>& piece);
  std::optional<PieceEnd> EndAt(std::int64_t voxel);
  std::optional<HiddenMouth> MouthOf(const PieceEnd& end);
  void Follow(HiddenMouth& mouth);

  const MouthImage& I;
  const VoxelLattice L; ///< of the volume
  const double Hidden;  ///< mm that are not seen, at most
  const double Longest; ///< mm from the aorta
  const double Shortest;
  bool NearWall(std::int64_t p) const { return this->Away[p] <= this->Longest * this->Longest; }
  std::vector<char> Number; ///< 1: of a piece
  std::vector<float> Away;  ///< mm^2 from the aorta
  std::vector<float> Best;  ///< for Paths: the least so far, infinite between two calls
};

template <typename Cost, typename Arrive>
std::vector<Reached> MouthSearch::Paths(
  std::int64_t start, float reach, const Cost& cost, const Arrive& arrive)
{
  std::vector<Reached> reached;
  std::vector<std::int64_t> touched{ start };
  CheapestFirst queue;
  this->Best[start] = 0.0F;
  queue.push({ 0.0F, start, -1 });
  while (!queue.empty())
  {
    const WaitingVoxel top = queue.top();
    queue.pop();
    if (top.cost > this->Best[top.voxel])
    {
      continue;
    }
    this->Best[top.voxel] = -1.0F; // done
    const auto place = static_cast<std::int32_t>(reached.size());
    reached.push_back({ top.voxel, top.cost, top.before });
    const Onwards onwards = arrive(reached.back());
    if (onwards == Onwards::Nowhere)
    {
      break;
    }
    if (onwards == Onwards::NotHere)
    {
      continue;
    }
    this->L.Neighbours(top.voxel,
      [&](std::int64_t next, float step)
      {
        if (this->Best[next] < 0.0F)
        {
          return;
        }
        const float total = top.cost + cost(next, step);
        if (total <= reach && total < this->Best[next])
        {
          if (this->Best[next] == Infinite)
          {
            touched.push_back(next);
          }
          this->Best[next] = total;
          queue.push({ total, next, place });
        }
      });
  }
  for (const std::int64_t voxel : touched)
  {
    this->Best[voxel] = Infinite;
  }
  return reached;
}

/// Connected tubes that no path from the aorta reaches.
std::vector<std::vector<std::int64_t>> MouthSearch::Pieces()
{
  const auto voxels = static_cast<std::int64_t>(this->I.volume.values.size());
  this->Number.assign(static_cast<std::size_t>(voxels), 0);
  // A tube of two voxels' area and the least length has this many.
  const auto minimum = static_cast<std::size_t>(2.0 * this->Shortest / this->I.volume.spacing);
  std::vector<std::vector<std::int64_t>> pieces;
  for (std::int64_t p = 0; p < voxels; ++p)
  {
    std::vector<std::int64_t> piece = this->L.Connected(p,
      [&](std::int64_t next)
      {
        return this->Number[next] == 0 && this->Orphaned(next) &&
          std::exchange(this->Number[next], 1) == 0;
      });
    if (piece.size() >= minimum &&
      std::any_of(piece.begin(), piece.end(), [this](std::int64_t q) { return this->NearWall(q); }))
    {
      std::sort(piece.begin(), piece.end());
      pieces.push_back(std::move(piece));
    }
  }
  return pieces;
}

/// Vessels of the lung are as bright, and lie in air.
bool MouthSearch::InLung(const std::vector<std::int64_t>& piece) const
{
  constexpr double away = 4.0; // mm
  int lung = 0;
  int all = 0;
  const std::size_t stride = std::max<std::size_t>(1, piece.size() / 200);
  for (std::size_t n = 0; n < piece.size(); n += stride)
  {
    const Vector3 at = this->World(piece[n]);
    for (int axis = 0; axis < 3; ++axis)
    {
      for (const double side : { -away, away })
      {
        const float value = this->I.volume.At(at + side * this->I.volume.axes.col(axis));
        if (value > WorldVolume::Nothing)
        {
          ++all;
          lung += value < this->I.lung ? 1 : 0;
        }
      }
    }
  }
  return 3 * lung > all;
}

/// The end at a voxel, if it is one: what is near lies on one side.
std::optional<PieceEnd> MouthSearch::EndAt(std::int64_t voxel)
{
  constexpr double near = 2.0; // mm
  constexpr double middle = 5.0;
  constexpr double far = 10.0;
  // The two branches that a short stem parts into may be 100 degrees apart; a tube that goes on has 0.
  constexpr double oneSided = 0.64;
  PieceEnd end{ voxel, this->World(voxel), Vector3::Zero(), 0.0 };
  Vector3 inwards = Vector3::Zero();
  Vector3 first = Vector3::Zero();
  Vector3 second = Vector3::Zero();
  int firstCount = 0;
  int secondCount = 0;
  const std::vector<Reached> reached = this->Within(voxel, static_cast<float>(far));
  for (const Reached& r : reached)
  {
    const Vector3 offset = this->World(r.voxel) - end.position;
    if (r.distance >= near && r.distance < middle)
    {
      inwards += offset.normalized();
      first += offset;
      ++firstCount;
    }
    else if (r.distance >= middle)
    {
      second += offset;
      ++secondCount;
    }
  }
  if (firstCount < 3 || secondCount < 3 || inwards.norm() < oneSided * firstCount)
  {
    return std::nullopt;
  }
  first /= firstCount;
  second /= secondCount;
  end.outwards = (first - second).normalized();
  if (!end.outwards.allFinite())
  {
    return std::nullopt;
  }
  const double volume = static_cast<double>(reached.size()) * std::pow(this->I.volume.spacing, 3);
  end.radius = std::sqrt(volume / (M_PI * far));
  return end;
}

/// Ends are where the distance from the farthest place is greatest around.
/// @param piece  distances from there
std::vector<PieceEnd> MouthSearch::EndsOf(const std::vector<Reached>& piece)
{
  std::unordered_map<std::int64_t, float> away;
  away.reserve(2 * piece.size());
  for (const Reached& r : piece)
  {
    away[r.voxel] = r.distance;
  }
  std::vector<Reached> tips;
  for (const Reached& r : piece)
  {
    bool maximum = true;
    this->L.Neighbours(r.voxel,
      [&](std::int64_t next, float)
      {
        const auto other = away.find(next);
        maximum = maximum &&
          (other == away.end() || other->second < r.distance ||
            (other->second == r.distance && next > r.voxel));
      });
    if (maximum)
    {
      tips.push_back(r);
    }
  }
  tips.push_back(piece.front());
  std::sort(tips.begin(), tips.end(),
    [](const Reached& a, const Reached& b)
    { return a.distance != b.distance ? a.distance > b.distance : a.voxel < b.voxel; });
  constexpr double apart = 4.0; // mm
  std::vector<PieceEnd> ends;
  for (const Reached& tip : tips)
  {
    const Vector3 position = this->World(tip.voxel);
    if (!this->NearWall(tip.voxel) ||
      std::any_of(ends.begin(), ends.end(),
        [&](const PieceEnd& e) { return (e.position - position).norm() < apart; }))
    {
      continue;
    }
    const std::optional<PieceEnd> end = this->EndAt(tip.voxel);
    if (end)
    {
      ends.push_back(*end);
    }
  }
  return ends;
}

/// The place of the aorta's wall that an end points at, along what is visible on the way.
std::optional<HiddenMouth> MouthSearch::MouthOf(const PieceEnd& end)
{
  constexpr double widest = 1.2; // radians
  const auto cost = [this, &end](std::int64_t q, float step)
  {
    if (this->I.body[q] == 1 || (this->World(q) - end.position).norm() > this->Longest)
    {
      return Infinite;
    }
    const float seen = this->Seen(q);
    // Bright and no tube: the rim of a chamber.
    const bool rim =
      this->I.body[q] == 0 && this->I.likeness[q] > 0.5F && this->Tube(q) < MinimumTube;
    return step * (1.0F - 0.85F * seen + (rim ? 1.0F : 0.0F));
  };
  double minimum = std::numeric_limits<double>::infinity();
  std::int32_t best = -1;
  std::int32_t count = 0;
  HiddenMouth mouth;
  const std::vector<Reached> paths = this->Paths(end.voxel, Infinite, cost,
    [&](const Reached& here)
    {
      const std::int32_t place = count++;
      if (here.distance >= minimum)
      {
        return Onwards::Nowhere;
      }
      if (this->I.body[here.voxel] != 2)
      {
        return Onwards::Everywhere;
      }
      const Vector3 chord = this->World(here.voxel) - end.position;
      const double angle = UnitAngle(end.outwards, chord.normalized());
      const double total = here.distance * (1.0 + angle * angle);
      if (angle < widest && total < minimum)
      {
        minimum = total;
        best = place;
        mouth.turn = angle;
      }
      return Onwards::NotHere;
    });
  if (best < 0)
  {
    return std::nullopt;
  }
  for (std::int32_t at = best; at >= 0; at = paths[at].before)
  {
    const std::int64_t voxel = paths[at].voxel;
    if (!mouth.way.empty())
    {
      const double step = (this->World(voxel) - this->World(mouth.way.back())).norm();
      mouth.length += step;
      const double dark = step * (1.0 - static_cast<double>(this->I.likeness[voxel]));
      mouth.hidden += dark;
      mouth.unseen += dark * (1.0 - static_cast<double>(this->Seen(voxel)));
    }
    mouth.way.push_back(voxel);
  }
  mouth.radius = end.radius;
  return mouth;
}

/// The rest of what is behind a mouth's way.
void MouthSearch::Follow(HiddenMouth& mouth)
{
  const std::vector<Reached> piece = this->Within(mouth.way.back(), Infinite);
  mouth.length += piece.back().distance;
  mouth.volume = static_cast<double>(piece.size()) * std::pow(this->I.volume.spacing, 3);
  for (auto at = static_cast<std::int32_t>(piece.size()) - 1; at >= 0; at = piece[at].before)
  {
    mouth.along.push_back(piece[at].voxel);
  }
  std::reverse(mouth.along.begin(), mouth.along.end());
}

std::vector<HiddenMouth> MouthSearch::Run()
{
  std::vector<HiddenMouth> mouths;
  for (const std::vector<std::int64_t>& piece : this->Pieces())
  {
    const std::int64_t far = this->Within(piece.front(), Infinite).back().voxel;
    const std::vector<Reached> distances = this->Within(far, Infinite);
    const double length = distances.back().distance;
    const double volume = static_cast<double>(piece.size()) * std::pow(this->I.volume.spacing, 3);
    // A tube, not a lump.
    if (length < this->Shortest ||
      volume > M_PI * std::pow(0.6 * this->I.maximumVesselRadius, 2) * length ||
      this->InLung(piece))
    {
      continue;
    }
    // A vessel begins once.
    std::optional<HiddenMouth> best;
    for (const PieceEnd& end : this->EndsOf(distances))
    {
      std::optional<HiddenMouth> mouth = this->MouthOf(end);
      if (mouth && mouth->hidden <= this->Hidden && (!best || mouth->hidden < best->hidden))
      {
        best = std::move(mouth);
      }
    }
    if (best)
    {
      this->Follow(*best);
      mouths.push_back(std::move(*best));
    }
  }
  return mouths;
}
}

std::vector<HiddenMouth> FindHiddenMouths(const MouthImage& image, double longest, double shortest)
{
  return MouthSearch(image, longest, shortest).Run();
}
}
