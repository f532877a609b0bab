#include "CubicStep.h"
#include "KernelChoice.h"
#include "VesselWallData.h"
#include "WallKernels.h"

#include <utility>

namespace coronary
{
namespace
{
/// 0 below `from`, 1 above `to`, with level ends.
double Ramp(double x, double from, double to)
{
  return CubicStep((x - from) / (to - from));
}
}

KernelChoice<WallKernels>& WallKernelChoice()
{
#if defined(DYNAMICCORONARY_WIDE_KERNELS)
  static KernelChoice<WallKernels> choice(WallKernelsBaseline, &WallKernelsAvx2);
#else
  static KernelChoice<WallKernels> choice(WallKernelsBaseline);
#endif
  return choice;
}

WallHit VesselWall::Internals::ClosestTo(const Vector3& p, std::int32_t patch, std::int32_t hint)
{
  if (patch >= 0)
  {
    this->MarkAround(patch);
  }
  const Vector3 relative = p - this->Tree.Centre();
  const float padding = this->Padding(relative);
  WallHit best;
  double bestSquared = Infinity;
  float limit = std::numeric_limits<float>::max(); ///< squared, padded
  const auto offer = [&](std::int32_t triangle)
  {
    if (patch >= 0 && !this->IsMarked(triangle))
    {
      return;
    }
    const TrianglePoint on = this->Nearest(triangle, p);
    if (on.squaredDistance < bestSquared ||
      (on.squaredDistance == bestSquared && triangle < best.triangle))
    {
      best.triangle = triangle;
      best.on = on;
      bestSquared = on.squaredDistance;
      const float reach = static_cast<float>(std::sqrt(on.squaredDistance)) * 1.000001f + padding;
      limit = reach * reach;
    }
  };
  if (hint >= 0)
  {
    offer(hint);
  }
  const Eigen::Array3f at = relative.cast<float>();
  const auto f = static_cast<float>(this->Fraction);
  this->Tree.ForEach<true>(
    limit,
    [&](std::int32_t node, float* squared)
    {
      const BoxNode& now = this->BoxesNow[node];
      const BoxNode& next = this->BoxesNext[node];
      for (int k = 0; k < 3; ++k)
      {
        for (int lane = 0; lane < BoxNode::Width; ++lane)
        {
          const float low = now.low[k][lane] + f * (next.low[k][lane] - now.low[k][lane]) - at[k];
          const float high =
            at[k] - now.high[k][lane] - f * (next.high[k][lane] - now.high[k][lane]);
          const float out = std::max(0.0f, std::max(low, high));
          squared[lane] += out * out;
        }
      }
    },
    offer);
  best.distance = std::sqrt(bestSquared);
  return best;
}

template <typename Visit>
void VesselWall::Internals::ForEachNear(
  const Vector3& p, const Vector3& velocity, double window, double radius, const Visit& visit) const
{
  const Vector3 begin = p - this->Tree.Centre();
  const Vector3 end = begin + window * velocity;
  const float reach =
    static_cast<float>(radius) * 1.000001f + std::max(this->Padding(begin), this->Padding(end));
  const float limit = reach * reach;
  const Eigen::Array3f at = begin.cast<float>();
  const Eigen::Array3f to = end.cast<float>();
  const auto f = static_cast<float>(this->Fraction);
  const auto g = static_cast<float>((this->Time + window) / this->Seconds);
  // Beyond the next key frame, the far side of the box now is what counts against.
  const float past = 1.0f - g;
  this->Tree.ForEach<false>(
    limit,
    [&](std::int32_t node, float* squared)
    {
      const BoxNode& now = this->BoxesNow[node];
      const BoxNode& next = this->BoxesNext[node];
      for (int k = 0; k < 3; ++k)
      {
        const float* low0 = now.low[k];
        const float* high0 = now.high[k];
        const float* low1 = next.low[k];
        const float* high1 = next.high[k];
        const float* lowPast = past < 0.0f ? high0 : low0;
        const float* highPast = past < 0.0f ? low0 : high0;
        for (int lane = 0; lane < BoxNode::Width; ++lane)
        {
          const float low = std::min(low0[lane] + f * (low1[lane] - low0[lane]) - at[k],
            past * lowPast[lane] + g * low1[lane] - to[k]);
          const float high = std::max(high0[lane] + f * (high1[lane] - high0[lane]) - at[k],
            past * highPast[lane] + g * high1[lane] - to[k]);
          const float out = std::max(0.0f, std::max(low, -high));
          squared[lane] += out * out;
        }
      }
    },
    visit);
}

WallMemory& VesselWall::Internals::Of(std::int64_t index)
{
  const auto [known, isNew] = this->Memories.try_emplace(index);
  if (isNew)
  {
    known->second.index = index;
  }
  return known->second;
}

/// As one that was never seen, but for where it belongs.
void VesselWall::Internals::Place(std::int64_t index, std::int32_t patch, std::int32_t nearest)
{
  this->Memories.erase(index);
  WallMemory& memory = this->Of(index);
  memory.patch = patch;
  memory.nearest = nearest;
}

bool VesselWall::Internals::Valid(const WallMemory& memory, const Vector3& p, double& drift) const
{
  double passed = 0.0;
  double more = 0.0;
  if (memory.frame == this->Frame)
  {
    passed = this->Time - memory.begin;
  }
  else if (memory.frame == this->Frame - 1)
  {
    passed = memory.rest + this->Time;
    more = this->VelocityChange * this->Time;
  }
  else
  {
    return false;
  }
  if (!(passed >= 0.0 && passed <= memory.window))
  {
    return false;
  }
  drift = (p - memory.place - passed * memory.velocity).norm() + more;
  return true;
}

double VesselWall::Internals::Collect(
  WallMemory& memory, const WallHit& hit, const Vector3& p, double radius)
{
  memory.place = p;
  memory.velocity = this->VelocityAt(hit.triangle, hit.on.b, hit.on.c);
  memory.radius = radius;
  memory.clearance = radius;
  memory.list.Clear();
  double minimum = Infinity;
  this->MarkAround(memory.patch);
  this->ForEachNear(p, memory.velocity, memory.window, radius,
    [&](std::int32_t triangle)
    {
      if (!this->IsMarked(triangle))
      {
        return;
      }
      double fastest = 0.0;
      for (const std::int32_t v : this->Triangles[triangle].vertex)
      {
        fastest = std::max(fastest, (this->VelocityOf(v) - memory.velocity).squaredNorm());
      }
      const double speed = std::sqrt(fastest) * (1.0 + 1e-6) + 1e-6;
      const double further = radius + memory.window * speed + 1e-5;
      const double squared = this->Nearest(triangle, p, further).squaredDistance;
      if (squared < further * further)
      {
        const double distance = std::sqrt(squared) * (1.0 - 1e-6) - 1e-6;
        memory.list.Add(triangle, static_cast<float>(distance), static_cast<float>(speed));
        memory.clearance = std::min(memory.clearance, distance - memory.window * speed);
        minimum = std::min(minimum, distance);
      }
    });
  return minimum;
}

void VesselWall::Internals::RememberDistance(WallMemory& memory, const Vector3& p, double distance)
{
  memory.known = true;
  memory.knownAt = p;
  memory.knownDistance = distance;
  memory.knownTime = this->FrameBegin + this->Time;
}

WallSide VesselWall::Internals::SideSinceSeen(
  WallMemory& memory, const WallHit& hit, const Vector3& p)
{
  constexpr double Slack = 0.03; // mm, for what the wall near it moves unevenly
  WallSide side = this->SideOf(hit, p);
  if (side == WallSide::Outside && memory.known && memory.side == WallSide::Inside)
  {
    const double passed = this->FrameBegin + this->Time - memory.knownTime;
    const double moved = (p - memory.knownAt - passed * memory.velocity).norm();
    if (moved + Slack < memory.knownDistance + hit.distance)
    {
      side = WallSide::Inside;
    }
  }
  this->RememberDistance(memory, p, hit.distance);
  return side;
}

void VesselWall::Internals::Search(WallMemory& memory, const Vector3& p, double range)
{
  ++this->Searches;
  memory.frame = this->Frame;
  memory.begin = this->Time;
  memory.rest = this->Seconds - this->Time;
  // Samples are not all looked up in the first tick of a frame.
  const double later = static_cast<double>((static_cast<std::uint64_t>(memory.index) * 7) & 15);
  memory.window = memory.rest + this->Seconds * later / 32.0;
  const auto remember = [&](const WallHit& hit, const Vector3& from)
  {
    memory.nearest = hit.triangle;
    memory.patch = this->Triangles[hit.triangle].patch;
    memory.side = this->SideSinceSeen(memory, hit, from);
  };
  const double radius = range + this->Blend + this->Settings.margin;
  // Far from the wall it is not worth while to know which place is the nearest (in the middle of a vessel all its
  // walls are as near). The side is that of a place on the way to the wall, with nothing in between.
  if (memory.nearest >= 0)
  {
    WallHit known;
    known.triangle = memory.nearest;
    known.on = this->Nearest(memory.nearest, p);
    known.distance = std::sqrt(known.on.squaredDistance);
    const double empty = 0.6 * known.distance;
    if (empty > radius && this->Collect(memory, known, p, empty) >= empty)
    {
      const Vector3 nearer = p + 0.59 * (known.on.point - p);
      remember(this->ClosestTo(nearer, memory.patch, known.triangle), nearer);
      if (memory.side != WallSide::Outside)
      {
        return;
      }
    }
  }
  const WallHit nearest = this->ClosestTo(p, memory.patch, memory.nearest);
  remember(nearest, p);
  this->Collect(memory, nearest, p,
    memory.side == WallSide::Outside ? radius + std::max(0.0, nearest.distance - range)
                                     : std::max(radius, range + 0.5 * (nearest.distance - range)));
}

void VesselWall::Internals::Sift(const WallMemory& memory)
{
  const WallCandidates& list = memory.list;
  CandidateRun& run = this->Run;
  run.distance = list.distance.data();
  run.speed = list.speed.data();
  run.passed = list.passed.data();
  for (int k = 0; k < 3; ++k)
  {
    run.place[k] = list.place[k].data();
  }
  const std::size_t count = list.triangle.size();
  this->Sifted.resize(count);
  WallKernelChoice().Get().sift(run, static_cast<int>(count), this->Sifted.data());
  this->Now.clear();
  this->Later.clear();
  for (std::size_t i = 0; i < count; ++i)
  {
    if (this->Sifted[i] != Candidate::TooFar)
    {
      (this->Sifted[i] == Candidate::Now ? this->Now : this->Later)
        .push_back(static_cast<std::int32_t>(i));
    }
  }
}

template <typename Visit>
void VesselWall::Internals::Look(
  WallMemory& memory, const Vector3& p, const std::vector<std::int32_t>& which, const Visit& visit)
{
  const WallKernels& kernels = WallKernelChoice().Get();
  TriangleBatch& batch = this->Batch;
  for (std::size_t first = 0; first < which.size(); first += TriangleBatch::Size)
  {
    const int count =
      static_cast<int>(std::min<std::size_t>(TriangleBatch::Size, which.size() - first));
    for (int i = 0; i < count; ++i)
    {
      const WallCorners& t = this->Triangles[memory.list.triangle[which[first + i]]];
      for (int k = 0; k < 3; ++k)
      {
        const Vector3 corner = this->At(t.vertex[k]);
        batch.corner[3 * k][i] = corner[0];
        batch.corner[3 * k + 1][i] = corner[1];
        batch.corner[3 * k + 2][i] = corner[2];
      }
    }
    kernels.nearest(batch, count, p.data());
    for (int i = 0; i < count; ++i)
    {
      const std::int32_t candidate = which[first + i];
      WallHit hit;
      hit.triangle = memory.list.triangle[candidate];
      if (batch.feature[i] >= 0.0)
      {
        hit.on.point = Vector3(batch.point[0][i], batch.point[1][i], batch.point[2][i]);
        hit.on.squaredDistance = batch.squaredDistance[i];
        hit.on.b = batch.b[i];
        hit.on.c = batch.c[i];
        hit.on.feature = static_cast<TriangleFeature>(static_cast<int>(batch.feature[i]));
      }
      else
      {
        hit.on = this->Nearest(hit.triangle, p);
      }
      hit.distance = std::sqrt(hit.on.squaredDistance);
      const float atLeast = static_cast<float>(hit.distance) * 0.999999f - 2e-6f;
      memory.list.distance[candidate] = atLeast;
      memory.list.passed[candidate] = this->Run.now;
      for (int k = 0; k < 3; ++k)
      {
        memory.list.place[k][candidate] = this->Run.at[k];
      }
      visit(atLeast, hit);
    }
  }
}

bool VesselWall::Internals::Evaluate(
  WallMemory& memory, const Vector3& p, double range, WallHit& nearest)
{
  memory.seenFrame = this->Frame;
  memory.seenTime = this->Time;
  memory.seen = p;
  double drift = 0.0;
  if (!this->Valid(memory, p, drift) || drift + range + this->Blend > memory.radius)
  {
    this->Search(memory, p, range);
    drift = 0.0;
  }
  for (int attempt = 0;; ++attempt)
  {
    this->Hits.clear();
    nearest = WallHit();
    const bool stale = memory.frame != this->Frame;
    const double passed = stale ? memory.rest + this->Time : this->Time - memory.begin;
    const Vector3 offset = p - memory.place - passed * memory.velocity;
    CandidateRun& run = this->Run;
    std::copy(offset.data(), offset.data() + 3, run.at);
    run.now = static_cast<float>(passed);
    run.change = static_cast<float>(stale ? this->VelocityChange : 0.0);
    // What was nearest the last time tells how far one has to look.
    double known = Infinity;
    if (memory.nearest >= 0)
    {
      known = std::sqrt(this->Nearest(memory.nearest, p).squaredDistance);
    }
    const double wanted = memory.side == WallSide::Outside ? known : std::min(known, range);
    run.limit = static_cast<float>(wanted + this->Blend) * 1.00001f + 1e-5f;
    run.further = std::max(0.0f, static_cast<float>(range) * 1.00001f + 1e-5f - run.limit);
    this->Sift(memory);
    this->Look(memory, p, this->Now,
      [&](float atLeast, const WallHit& hit)
      {
        if (hit.distance < nearest.distance ||
          (hit.distance == nearest.distance && hit.triangle < nearest.triangle))
        {
          nearest = hit;
        }
        if (atLeast <= run.limit + run.further)
        {
          this->Hits.push_back(hit);
        }
      });
    const bool found = nearest.distance + drift <= memory.radius;
    if (found)
    {
      memory.side = this->SideSinceSeen(memory, nearest, p);
      memory.nearest = nearest.triangle;
      memory.patch = this->Triangles[nearest.triangle].patch;
    }
    // Outside, all that is almost as near has to be known.
    const bool complete = memory.side != WallSide::Outside ||
      (found && nearest.distance <= wanted &&
        nearest.distance + this->Blend + drift <= memory.radius);
    if (complete || attempt > 0)
    {
      return found && (memory.side == WallSide::Outside || nearest.distance <= range);
    }
    this->Search(memory, p, range);
    drift = 0.0;
  }
}

void VesselWall::Internals::EvaluateLater(
  WallMemory& memory, const Vector3& p, double range, const Vector3* first)
{
  const auto isAlike = [&](std::int32_t i)
  {
    const WallCorners& t = this->Triangles[memory.list.triangle[i]];
    // Where the corners' normals are within 60 degrees, those of all places between them are.
    return first != nullptr && t.wall && this->NormalAt(t.vertex[0]).dot(*first) > 0.5 &&
      this->NormalAt(t.vertex[1]).dot(*first) > 0.5 &&
      this->NormalAt(t.vertex[2]).dot(*first) > 0.5;
  };
  this->Later.erase(
    std::remove_if(this->Later.begin(), this->Later.end(), isAlike), this->Later.end());
  this->Look(memory, p, this->Later,
    [&](float, const WallHit& hit)
    {
      if (hit.distance <= range)
      {
        this->Hits.push_back(hit);
      }
    });
  this->Later.clear();
}

ContactPlane VesselWall::Internals::MakePlane(
  const ContactSample& sample, WallHit& hit, WallSide side, double limit, const Vector3* first)
{
  const WallCorners& triangle = this->Triangles[hit.triangle];
  const Vector3 reference = this->SmoothNormal(hit);
  // The mean over the triangles that are almost as near: each of its terms is continuous when the
  // sample moves, and so is the sum.
  const double width = std::max(1e-9, std::min(this->Blend, limit - hit.distance));
  Vector3 sum = Vector3::Zero();
  for (WallHit& other : this->Hits)
  {
    const double further = (other.distance - hit.distance) / width;
    if (further >= 1.0 || this->Triangles[other.triangle].open)
    {
      continue;
    }
    const Vector3& normal = this->SmoothNormal(other);
    const double weight = 1.0 - std::max(0.0, further);
    // A wall of another side is another plane.
    const double aside = first != nullptr ? 1.0 - Ramp(normal.dot(*first), 0.25, 0.5) : 1.0;
    sum += weight * weight * aside * Ramp(normal.dot(reference), 0.5, 0.766) * normal;
  }
  Vector3 normal = sum.norm() > 1e-6 ? Vector3(sum.normalized()) : reference;
  // On ridges (flow dividers) and flat parts beside them vertex normals are wrong: there the direction
  // to the nearest point is right, and smooth.
  Vector3 direct = Vector3::Zero();
  if (hit.on.feature == TriangleFeature::Face)
  {
    direct = -UnitOrZero(this->FaceNormal(hit.triangle));
  }
  else if (hit.distance > 0.0)
  {
    direct =
      (side == WallSide::Outside ? -1.0 : 1.0) / hit.distance * (sample.centre - hit.on.point);
  }
  constexpr double cos20 = 0.9397;
  constexpr double cos40 = 0.7660;
  const double share =
    (1.0 - Ramp(direct.dot(normal), cos40, cos20)) * std::min(1.0, hit.distance / 0.02);
  if (triangle.wall && share > 0.0 && direct != Vector3::Zero())
  {
    const Vector3 mixed = (1.0 - share) * normal + share * direct;
    if (mixed.norm() > 1e-3)
    {
      normal = mixed.normalized();
    }
  }
  ContactPlane plane;
  plane.normal = normal;
  plane.gap = (side == WallSide::Outside ? -hit.distance : hit.distance) - sample.radius;
  plane.wallVelocity = this->VelocityAt(hit.triangle, hit.on.b, hit.on.c);
  plane.friction = this->Settings.friction * sample.friction;
  plane.stiffness = this->Settings.stiffness;
  return plane;
}

WallPlace VesselWall::Internals::PlaceFrom(const WallHit& hit, WallSide side) const
{
  WallPlace place;
  if (hit.triangle < 0)
  {
    return place;
  }
  place.triangle = this->TriangleOf[hit.triangle];
  place.weights = Vector3(1.0 - hit.on.b - hit.on.c, hit.on.b, hit.on.c);
  place.point = hit.on.point;
  place.distance = side == WallSide::Inside ? hit.distance : -hit.distance;
  if (!this->Group.empty())
  {
    Eigen::Index corner = 0;
    place.weights.maxCoeff(&corner);
    place.branch = this->Group[this->Triangles[hit.triangle].vertex[corner]];
  }
  return place;
}

VesselWall::VesselWall(const WallTopology& topology, const std::vector<Vector3>& points,
  const VesselWallSettings& settings)
  : Data(std::make_unique<Internals>())
{
  settings.Validate();
  this->Data->Settings = settings;
  this->Data->Build(topology, points);
}

VesselWall::~VesselWall() = default;
VesselWall::VesselWall(VesselWall&&) noexcept = default;
VesselWall& VesselWall::operator=(VesselWall&&) noexcept = default;

void VesselWall::BeginFrame(const std::vector<Vector3>& next, double seconds)
{
  Internals& data = *this->Data;
  if (!(seconds > 0.0 && std::isfinite(seconds)))
  {
    throw std::invalid_argument(
      "a key frame of the wall lasts " + std::to_string(seconds) + " s, not a positive time");
  }
  RequireWallPoints(next, data.Vertices.size());
  std::swap(data.BoxesNow, data.BoxesNext);
  double change = 0.0;
  Eigen::Array4f extent = Eigen::Array4f::Zero();
  const double rate = 1.0 / seconds;
  const double oldRate = 1.0 / data.Seconds;
  for (std::size_t i = 0; i < next.size(); ++i)
  {
    const WallVertex& v = data.Vertices[i];
    const Vector3& p = next[data.VertexOf[i]];
    change = std::max(change, (rate * (p - v.next) - oldRate * (v.next - v.now)).squaredNorm());
    extent = extent.max(data.SetNext(i, p).abs());
  }
  data.ExtentNow = std::exchange(data.ExtentNext, extent.maxCoeff());
  data.VelocityChange = std::sqrt(change) * (1.0 + 1e-12) + 1e-12;
  data.FrameBegin += data.Seconds;
  data.Seconds = seconds;
  data.Rate = rate;
  data.Time = 0.0;
  data.Fraction = 0.0;
  ++data.Frame;
  data.Refit();
}

void VesselWall::SetTime(double seconds)
{
  Internals& data = *this->Data;
  data.Time = std::isfinite(seconds) ? std::clamp(seconds, 0.0, data.Seconds) : 0.0;
  data.Fraction = data.Time / data.Seconds;
}

void VesselWall::Find(const ContactSample& sample, double reach, SampleContacts& contacts)
{
  contacts.count = 0;
  Internals& data = *this->Data;
  const double range = sample.radius + reach;
  if (!UsableWallPoint(sample.centre) || !(sample.radius >= 0.0 && reach >= 0.0) ||
    !(range <= MaximumWallCoordinate))
  {
    return;
  }
  WallMemory& memory = data.Of(sample.index);
  memory.range = range;
  double drift = 0.0;
  if (data.Valid(memory, sample.centre, drift) && memory.side != WallSide::Outside &&
    drift + range < memory.clearance)
  {
    data.RememberDistance(memory, sample.centre, memory.clearance - drift);
    memory.planes = 0;
    return;
  }
  WallHit nearest;
  if (!data.Evaluate(memory, sample.centre, range, nearest) || memory.side == WallSide::Free)
  {
    memory.planes = 0;
    return;
  }
  const WallSide side = memory.side;
  const double limit = std::max(nearest.distance + data.Blend, range);
  if (data.Triangles[nearest.triangle].open)
  {
    // Before an open cap: the wall around it.
    data.EvaluateLater(memory, sample.centre, range, nullptr);
    nearest = WallHit();
    for (const WallHit& hit : data.Hits)
    {
      if (!data.Triangles[hit.triangle].open &&
        (hit.distance < nearest.distance ||
          (hit.distance == nearest.distance && hit.triangle < nearest.triangle)))
      {
        nearest = hit;
      }
    }
    if (nearest.triangle < 0 || nearest.distance > range)
    {
      memory.planes = 0;
      return;
    }
  }
  contacts.plane[0] = data.MakePlane(sample, nearest, side, limit, nullptr);
  contacts.count = 1;
  // Of another side: the direction to it has to be that of its normal (a nearest place, not one on
  // the way around), and of several the one that is most opposite.
  const Vector3 first = contacts.plane[0].normal;
  data.EvaluateLater(memory, sample.centre, range, &first);
  WallHit second;
  double best = Infinity;
  for (WallHit& hit : data.Hits)
  {
    const Vector3 away = sample.centre - hit.on.point;
    // Where the direction is within 30 degrees of the first normal, one of the two conditions fails.
    if (hit.distance > range || away.dot(first) > 0.8661 * hit.distance ||
      data.Triangles[hit.triangle].open || hit.triangle == nearest.triangle)
    {
      continue;
    }
    const Vector3& normal = data.SmoothNormal(hit);
    const double along = normal.dot(first);
    if (along > 0.5 || normal.dot(away) < 0.866 * hit.distance)
    {
      continue;
    }
    const double score = hit.distance + 0.05 * (0.5 + along);
    if (score < best || (score == best && hit.triangle < second.triangle))
    {
      best = score;
      second = hit;
    }
  }
  if (second.triangle >= 0)
  {
    contacts.plane[1] = data.MakePlane(sample, second, WallSide::Inside, limit, &first);
    contacts.count = 2;
  }
  // The identity of the former plane that is most alike, or the one that is not in use.
  int identity = -1;
  double alike = 0.5;
  for (int i = 0; i < memory.planes; ++i)
  {
    const double along = memory.normal[i].dot(first);
    if (along > alike)
    {
      alike = along;
      identity = memory.identity[i];
    }
  }
  if (identity < 0)
  {
    identity = memory.planes == 1 ? 1 - memory.identity[0] : 0;
  }
  memory.planes = contacts.count;
  for (int i = 0; i < contacts.count; ++i)
  {
    contacts.plane[i].identity = i == 0 ? identity : 1 - identity;
    memory.normal[i] = contacts.plane[i].normal;
    memory.identity[i] = contacts.plane[i].identity;
  }
}

bool VesselWall::Outside(const ContactSample& sample, WallPlace& place)
{
  Internals& data = *this->Data;
  place = WallPlace();
  if (!UsableWallPoint(sample.centre))
  {
    return false;
  }
  WallMemory& memory = data.Of(sample.index);
  if (memory.side != WallSide::Outside && memory.seenFrame == data.Frame &&
    memory.seenTime == data.Time && memory.seen == sample.centre)
  {
    return false;
  }
  double drift = 0.0;
  if (data.Valid(memory, sample.centre, drift) && memory.side != WallSide::Outside &&
    drift < memory.clearance)
  {
    return false;
  }
  WallHit nearest;
  if (!data.Evaluate(memory, sample.centre, memory.range, nearest) ||
    memory.side != WallSide::Outside)
  {
    return false;
  }
  place = data.PlaceFrom(nearest, WallSide::Outside);
  return true;
}

WallPlace VesselWall::Locate(const ContactSample& sample)
{
  Internals& data = *this->Data;
  if (!UsableWallPoint(sample.centre))
  {
    return {};
  }
  WallMemory& memory = data.Of(sample.index);
  const WallHit nearest = data.ClosestTo(sample.centre, memory.patch, memory.nearest);
  memory.nearest = nearest.triangle;
  memory.patch = data.Triangles[nearest.triangle].patch;
  return data.PlaceFrom(nearest, data.SideSinceSeen(memory, nearest, sample.centre));
}

void VesselWall::Place(std::int64_t sample, std::int64_t triangle)
{
  Internals& data = *this->Data;
  if (triangle < 0 || triangle >= static_cast<std::int64_t>(data.Triangles.size()))
  {
    throw std::invalid_argument("the wall has no triangle " + std::to_string(triangle));
  }
  const std::int32_t nearest = data.PlaceOf[triangle];
  data.Place(sample, data.Triangles[nearest].patch, nearest);
}

bool VesselWall::PlaceBeside(std::int64_t sample, std::int64_t neighbour)
{
  Internals& data = *this->Data;
  const auto known = data.Memories.find(neighbour);
  if (known == data.Memories.end() || known->second.patch < 0)
  {
    return false;
  }
  const auto [patch, nearest] = std::pair(known->second.patch, known->second.nearest);
  data.Place(sample, patch, nearest);
  return true;
}

void VesselWall::Forget(std::int64_t sample)
{
  this->Data->Memories.erase(sample);
}

WallPlace VesselWall::Closest(const Vector3& p)
{
  if (!UsableWallPoint(p))
  {
    return {};
  }
  const WallHit nearest = this->Data->ClosestTo(p, -1, -1);
  return this->Data->PlaceFrom(nearest, this->Data->SideOf(nearest, p));
}

void VesselWall::Within(const Vector3& p, double distance, std::vector<std::int64_t>& triangles)
{
  triangles.clear();
  const Internals& data = *this->Data;
  if (!UsableWallPoint(p) || !(distance >= 0.0))
  {
    return;
  }
  const double bound = std::min(distance, 4.0 * MaximumWallCoordinate);
  data.ForEachNear(p, Vector3::Zero(), 0.0, bound,
    [&](std::int32_t triangle)
    {
      if (data.Nearest(triangle, p).squaredDistance <= bound * bound)
      {
        triangles.push_back(data.TriangleOf[triangle]);
      }
    });
  std::sort(triangles.begin(), triangles.end());
}

const std::vector<Vector3>& VesselWall::Points()
{
  Internals& data = *this->Data;
  data.AllPoints.resize(data.Vertices.size());
  for (std::size_t i = 0; i < data.Vertices.size(); ++i)
  {
    data.AllPoints[data.VertexOf[i]] = data.At(static_cast<std::int32_t>(i));
  }
  return data.AllPoints;
}

const std::vector<Vector3>& VesselWall::Normals()
{
  Internals& data = *this->Data;
  data.AllNormals.resize(data.Vertices.size());
  for (std::size_t i = 0; i < data.Vertices.size(); ++i)
  {
    data.AllNormals[data.VertexOf[i]] = UnitOrZero(data.NormalAt(static_cast<std::int32_t>(i)));
  }
  return data.AllNormals;
}

Vector3 VesselWall::Velocity(const WallPlace& place) const
{
  const Internals& data = *this->Data;
  if (place.triangle < 0 || place.triangle >= static_cast<std::int64_t>(data.PlaceOf.size()))
  {
    return Vector3::Zero();
  }
  return data.VelocityAt(data.PlaceOf[place.triangle], place.weights[1], place.weights[2]);
}

std::uint64_t VesselWall::NumberOfSearches() const
{
  return this->Data->Searches;
}
}
