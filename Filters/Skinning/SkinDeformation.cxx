#include "SkinDeformation.h"

#include "KernelChoice.h"
#include "PartialProgress.h"
#include "Require.h"
#include "SkinKernels.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <new>
#include <numeric>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace coronary
{
namespace
{
constexpr std::int64_t BlockGrain = 64;
constexpr std::int64_t PointGrain = 4096;
constexpr int RepairSweeps = 400;
constexpr double MaximumOfMinimumRatio = 0.5;
constexpr double RepairMargin = 0.01;
constexpr double MinimumRepairStretch = 0.2;
constexpr int RepairPatience = 80; // sweeps

/// Memory in whole cache lines, as wide registers want it.
template <typename T>
struct LineAllocator
{
  using value_type = T;
  static constexpr std::align_val_t Line{ 64 };

  LineAllocator() = default;
  template <typename Other>
  explicit LineAllocator(const LineAllocator<Other>&)
  {
  }
  T* allocate(std::size_t count)
  {
    return static_cast<T*>(::operator new(count * sizeof(T), Line));
  }
  void deallocate(T* memory, std::size_t) { ::operator delete(memory, Line); }
  bool operator==(const LineAllocator&) const { return true; }
  bool operator!=(const LineAllocator&) const { return false; }
};

using Floats = std::vector<float, LineAllocator<float>>;

template <typename Scalar>
using Vector = Eigen::Matrix<Scalar, 3, 1>;

template <typename Scalar>
using Matrix = Eigen::Matrix<Scalar, 3, 3>;

/// A bone's motion in double precision, or with its derivative.
template <typename Scalar>
struct Motion
{
  Vector<Scalar> posedHead;
  Matrix<Scalar> rotation;
  Vector<Scalar>
    translation; ///< rotation and translation carry the bone's rest head to the posed one
  Eigen::Quaternion<Scalar> real;
  Eigen::Quaternion<Scalar> dual;
  Scalar stretch = 1.0; ///< 1 when bones are rigid
  Scalar twist = 0.0;
  Scalar calibreFirst = 1.0;
  Scalar calibreSecond = 1.0;
};

/// Everything but the rotation and translation, around one place of the bone at rest.
template <typename Scalar>
struct Local
{
  Vector<Scalar> point;
  Matrix3 gradient; ///< with calibre and twist as they are at the place; of positions only
};

/// Whether gradients are computed beside the places: they keep positions what they always were to the bit.
template <typename Scalar>
constexpr bool HasGradient = std::is_same_v<Scalar, double>;

Matrix3 CrossOf(const Vector3& axis)
{
  Matrix3 cross;
  cross << 0.0, -axis.z(), axis.y(), axis.z(), 0.0, -axis.x(), -axis.y(), axis.x(), 0.0;
  return cross;
}

template <typename Real>
Vector3 PointAt(const Real* values, std::int64_t index)
{
  const Real* at = values + 3 * index;
  return { static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2]) };
}

template <typename Real>
void StorePoint(Real* values, std::int64_t index, const Vector3& point)
{
  for (int c = 0; c < 3; ++c)
  {
    values[3 * index + c] = static_cast<Real>(point[c]);
  }
}

/// ParallelFor that allocates nothing for its body.
template <typename Body>
void For(std::int64_t count, std::int64_t grain, const Body& body, const ProgressCallback& progress)
{
  ParallelFor(count, ReportingGrain(progress, count, grain), std::ref(body), progress);
  // The thread that reports may have been asleep while the others did it all.
  Report(progress, 1.0);
}

/// Lists by rows: those of i are item[offset[i]] to item[offset[i + 1] - 1].
struct Rows
{
  std::vector<std::int64_t> offset;
  std::vector<std::int64_t> item;
};

/// Which cells a point is a corner of.
template <typename Cell>
Rows CellsOfPoints(
  const std::vector<Cell>& cells, std::int64_t points, const ProgressCallback& progress)
{
  const auto count = static_cast<std::int64_t>(cells.size());
  LoopReport report(progress, 2 * count);
  Rows rows;
  rows.offset.assign(points + 1, 0);
  for (std::int64_t n = 0; n < count; ++n)
  {
    report(n);
    for (const std::int64_t corner : cells[n])
    {
      ++rows.offset[corner + 1];
    }
  }
  std::partial_sum(rows.offset.begin(), rows.offset.end(), rows.offset.begin());
  rows.item.resize(rows.offset.back());
  std::vector<std::int64_t> next(rows.offset.begin(), rows.offset.end() - 1);
  for (std::int64_t n = 0; n < count; ++n)
  {
    report(count + n);
    for (const std::int64_t corner : cells[n])
    {
      rows.item[next[corner]++] = n;
    }
  }
  return rows;
}

template <typename Cell>
void RequireCorners(const std::vector<Cell>& cells, std::int64_t points, const char* what,
  const ProgressCallback& progress)
{
  LoopReport report(progress, static_cast<std::int64_t>(cells.size()));
  for (std::size_t n = 0; n < cells.size(); ++n)
  {
    report(static_cast<std::int64_t>(n));
    for (const std::int64_t corner : cells[n])
    {
      if (corner < 0 || corner >= points)
      {
        throw std::invalid_argument(std::string(what) + " " + std::to_string(n) +
          " has the corner " + std::to_string(corner) + ", there are " + std::to_string(points) +
          " points");
      }
    }
  }
}
}

KernelChoice<SkinKernels>& SkinKernelChoice()
{
#if defined(DYNAMICCORONARY_WIDE_KERNELS)
  static KernelChoice<SkinKernels> choice(
    SkinKernelsBaseline, &SkinKernelsAvx2, &SkinKernelsAvx512);
#else
  static KernelChoice<SkinKernels> choice(SkinKernelsBaseline);
#endif
  return choice;
}

struct SkinDeformation::Internals
{
  SkinDeformationSettings Settings;
  SkeletonRig Rig;
  std::vector<Vector3> Points;

  // By points in the order given: the double precision path.
  std::vector<std::int64_t> Offset;
  std::vector<std::int32_t> Bone; ///< greatest weight first
  std::vector<double> Weight;

  // By blocks: the single precision path.
  Vector3 Centre = Vector3::Zero();
  Floats X;
  Floats Y;
  Floats Z;
  Floats BlockWeight;
  std::vector<std::int32_t> BlockOffset;
  std::vector<std::int32_t> BlockBone;
  std::vector<std::int32_t> Pivot;
  std::vector<std::int32_t> Point;
  SkinBlocks Blocks{};

  // Of the frame.
  double VolumeConservation = 0.0;
  SkeletonPose Now;
  std::vector<BoneTransform> Transforms;
  std::vector<MovingBoneTransform> MovingTransforms;
  std::vector<Motion<double>> Motions;
  std::vector<Motion<Dual>> MovingMotions;
  std::vector<SkinBone, LineAllocator<SkinBone>> Bones;
  std::vector<MovingSkinBone, LineAllocator<MovingSkinBone>> MovingBones;
  bool Sections = false;
  std::array<float, 3> FloatCentre{}; ///< of the posed bones
  Vector3 PosedCentre = Vector3::Zero();

  std::vector<Triangle> Triangles;
  Rows TrianglesOf;
  std::vector<Vector3> TriangleNormals;

  std::vector<std::array<std::int64_t, 4>> Tetrahedra;
  Rows TetrahedraOf;
  std::vector<double> RestVolume; ///< six times
  std::vector<double> Ratio;      ///< of the last check

  Internals(const std::vector<Vector3>& points, const CompactSkinWeights& weights,
    const Skeleton& rest, const SkinDeformationSettings& settings, const ProgressCallback& progress)
    : Settings(settings)
    , Rig(rest)
    , Points(points)
  {
    const WorkParts parts(progress, { 0.35, 0.65 });
    this->ReadWeights(weights, parts(0));
    this->MakeBlocks(parts(1));
  }

  void ReadWeights(const CompactSkinWeights& weights, const ProgressCallback& progress);
  void MakeBlocks(const ProgressCallback& progress);
  template <typename Scalar>
  void SetPose(const BasicSkeletonPose<Scalar>& pose,
    std::vector<BasicBoneTransform<Scalar>>& bones, std::vector<Motion<Scalar>>& motions);
  void SetPose(const MovingSkeletonPose& pose);
  template <typename Scalar>
  void SetMotions(
    const std::vector<BasicBoneTransform<Scalar>>& bones, std::vector<Motion<Scalar>>& motions);
  /// @param store  called with a number of the bone and what it is
  template <typename Scalar, typename Number, typename Store>
  void SetBone(std::size_t number, const Motion<Scalar>& motion, const Store& store,
    BasicSkinBone<Number>& bone) const;
  void SetCentre();
  template <typename Scalar>
  Local<Scalar> LocalAt(
    std::int64_t bone, const Motion<Scalar>& motion, const Vector3& point) const;
  template <typename Scalar>
  Vector<Scalar> PlaceOf(const std::vector<Motion<Scalar>>& motions, std::int64_t point) const;
  Vector3 Deformed(std::int64_t point) const { return this->PlaceOf(this->Motions, point); }

  void Deform(float* positions, const ProgressCallback& progress);
  void Deform(double* positions, const ProgressCallback& progress);
  void Deform(float* positions, float* velocities, const ProgressCallback& progress);
  void Deform(double* positions, double* velocities, const ProgressCallback& progress);

  template <typename Real>
  void DisplacementsOf(
    const Real* positions, Real* displacements, const ProgressCallback& progress) const;
  template <typename Real>
  void NormalsOf(const Real* positions, Real* normals, const ProgressCallback& progress);
  template <typename Real>
  double RatioOf(const Real* positions, std::int64_t tetrahedron) const;
  template <typename Real>
  void Check(const Real* positions, InversionReport& report, double minimumRatio,
    const ProgressCallback& progress);
  template <typename Real>
  void Repair(Real* positions, InversionReport& report, double minimumRatio,
    const ProgressCallback& progress);
  /// Gives one tetrahedron the nearest shape that has the wanted share of its volume at rest.
  template <typename Real>
  void Unfold(Real* positions, std::int64_t tetrahedron, double wantedRatio, double minimum) const;
};

void SkinDeformation::Internals::ReadWeights(
  const CompactSkinWeights& weights, const ProgressCallback& progress)
{
  const std::size_t count = this->Points.size();
  Require(count <= static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max() / SkinLanes),
    "The mesh has too many points");
  Require(weights.influences >= 1 || count == 0, "The skin weights have no bone a point");
  const auto width = static_cast<std::size_t>(std::max(0, weights.influences));
  Require(weights.bone.size() == count * width && weights.weight.size() == count * width,
    "The skin weights are " + std::to_string(weights.weight.size()) + " and their bones " +
      std::to_string(weights.bone.size()) + ", not " + std::to_string(width) + " for each of " +
      std::to_string(count) + " points");
  this->Offset.assign(1, 0);
  std::vector<std::pair<double, std::int32_t>> row;
  LoopReport report(progress, static_cast<std::int64_t>(count));
  for (std::size_t i = 0; i < count; ++i)
  {
    report(static_cast<std::int64_t>(i));
    const std::string name = "Point " + std::to_string(i);
    Require(this->Points[i].allFinite(), name + " has a coordinate that is not finite");
    double sum = 0.0;
    row.clear();
    for (std::size_t n = i * width; n < (i + 1) * width; ++n)
    {
      const double weight = static_cast<double>(weights.weight[n]);
      Require(std::isfinite(weight), name + " has a skin weight that is not finite");
      if (weight == 0.0)
      {
        continue;
      }
      Require(weights.bone[n] >= 0 && weights.bone[n] < this->Rig.NumberOfBones(),
        name + " hangs on bone " + std::to_string(weights.bone[n]) + ", the skeleton has " +
          std::to_string(this->Rig.NumberOfBones()));
      const auto same = std::find_if(
        row.begin(), row.end(), [&](const auto& entry) { return entry.second == weights.bone[n]; });
      if (same == row.end())
      {
        row.emplace_back(weight, weights.bone[n]);
      }
      else
      {
        same->first += weight;
      }
      sum += weight;
    }
    Require(sum > 1e-3, name + " has no skin weight: the sum must be 1");
    std::sort(row.begin(), row.end(),
      [](const auto& a, const auto& b)
      { return a.first != b.first ? a.first > b.first : a.second < b.second; });
    for (const auto& [weight, bone] : row)
    {
      this->Bone.push_back(bone);
      this->Weight.push_back(weight / sum);
    }
    this->Offset.push_back(static_cast<std::int64_t>(this->Bone.size()));
  }
}

void SkinDeformation::Internals::MakeBlocks(const ProgressCallback& progress)
{
  const WorkParts parts(progress, { 0.2, 0.55, 0.25 });
  const auto count = static_cast<std::int64_t>(this->Points.size());
  Vector3 low = Vector3::Zero();
  Vector3 high = Vector3::Zero();
  if (count > 0)
  {
    low = high = this->Points[0];
  }
  for (const Vector3& point : this->Points)
  {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  this->Centre = 0.5 * (low + high);

  // Points that hang on the same bones go into the same blocks.
  std::vector<std::int32_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  std::vector<std::vector<std::int32_t>> key(count);
  const ProgressCallback keyProgress = parts(0);
  LoopReport keyReport(keyProgress, count);
  for (std::int64_t i = 0; i < count; ++i)
  {
    keyReport(i);
    key[i].assign(this->Bone.begin() + this->Offset[i], this->Bone.begin() + this->Offset[i + 1]);
    std::sort(key[i].begin(), key[i].end());
    key[i].insert(key[i].begin(), this->Bone[this->Offset[i]]);
  }
  // A sort takes about n log n comparisons; what it takes beyond that is the end of its part.
  const ProgressCallback sortProgress = parts(1);
  LoopReport sortReport(sortProgress,
    static_cast<std::int64_t>(static_cast<double>(count) *
      std::log2(static_cast<double>(std::max<std::int64_t>(2, count)))));
  std::int64_t comparisons = 0;
  std::sort(order.begin(), order.end(),
    [&](std::int32_t a, std::int32_t b)
    {
      sortReport(++comparisons);
      return key[a] != key[b] ? key[a] < key[b] : a < b;
    });

  const std::int64_t blocks = (count + SkinLanes - 1) / SkinLanes;
  const std::int64_t padded = blocks * SkinLanes;
  this->X.assign(padded, 0.0F);
  this->Y.assign(padded, 0.0F);
  this->Z.assign(padded, 0.0F);
  this->Point.assign(padded, 0);
  this->Pivot.assign(padded, 0);
  this->BlockOffset.assign(1, 0);
  std::vector<std::int32_t> entryOf(this->Rig.NumberOfBones(), -1);
  const ProgressCallback blockProgress = parts(2);
  LoopReport blockReport(blockProgress, blocks);
  for (std::int64_t block = 0; block < blocks; ++block)
  {
    blockReport(block);
    const auto begin = static_cast<std::int32_t>(this->BlockBone.size());
    for (int lane = 0; lane < SkinLanes; ++lane)
    {
      const std::int64_t at = block * SkinLanes + lane;
      // What fills the last block is its last point, so that no lane divides by zero.
      const std::int64_t i = order[std::min(at, count - 1)];
      const Vector3 point = this->Points[i] - this->Centre;
      this->X[at] = static_cast<float>(point.x());
      this->Y[at] = static_cast<float>(point.y());
      this->Z[at] = static_cast<float>(point.z());
      this->Point[at] = static_cast<std::int32_t>(i);
      this->Pivot[at] = this->Bone[this->Offset[i]];
      for (std::int64_t n = this->Offset[i]; n < this->Offset[i + 1]; ++n)
      {
        std::int32_t& entry = entryOf[this->Bone[n]];
        if (entry < begin)
        {
          entry = static_cast<std::int32_t>(this->BlockBone.size());
          this->BlockBone.push_back(this->Bone[n]);
          this->BlockWeight.resize(this->BlockWeight.size() + SkinLanes, 0.0F);
        }
        this->BlockWeight[static_cast<std::size_t>(entry) * SkinLanes + lane] =
          static_cast<float>(this->Weight[n]);
      }
    }
    this->BlockOffset.push_back(static_cast<std::int32_t>(this->BlockBone.size()));
  }
  this->Blocks = { this->X.data(), this->Y.data(), this->Z.data(), this->BlockOffset.data(),
    this->BlockBone.data(), this->BlockWeight.data(), this->Pivot.data(), this->Point.data(),
    count };
}

template <typename Scalar>
void SkinDeformation::Internals::SetPose(const BasicSkeletonPose<Scalar>& pose,
  std::vector<BasicBoneTransform<Scalar>>& bones, std::vector<Motion<Scalar>>& motions)
{
  this->Rig.Transform(pose, bones);
  this->Rig.ConserveVolume(this->VolumeConservation, bones);
  this->SetMotions(bones, motions);
}

void SkinDeformation::Internals::SetPose(const MovingSkeletonPose& pose)
{
  PoseNow(pose, this->Now);
  this->SetPose(this->Now, this->Transforms, this->Motions);
  // The last one: what is 0 and changes is a section, too.
  this->SetPose(pose, this->MovingTransforms, this->MovingMotions);
}

template <typename Scalar>
void SkinDeformation::Internals::SetMotions(
  const std::vector<BasicBoneTransform<Scalar>>& bones, std::vector<Motion<Scalar>>& motions)
{
  if (static_cast<std::int64_t>(bones.size()) != this->Rig.NumberOfBones())
  {
    throw std::invalid_argument("There are " + std::to_string(bones.size()) +
      " moved bones, the rest skeleton has " + std::to_string(this->Rig.NumberOfBones()));
  }
  motions.resize(bones.size());
  this->Sections = false;
  for (std::size_t b = 0; b < bones.size(); ++b)
  {
    const BasicBoneTransform<Scalar>& bone = bones[b];
    Motion<Scalar>& motion = motions[b];
    const Vector<Scalar> head =
      this->Rig.Head(static_cast<std::int64_t>(b)).template cast<Scalar>();
    motion.posedHead = bone.posedHead;
    motion.rotation = bone.rotation.toRotationMatrix();
    motion.translation = bone.posedHead - motion.rotation * head;
    motion.real = bone.rotation;
    const Vector<Scalar> half = Scalar(0.5) * motion.translation;
    motion.dual =
      Eigen::Quaternion<Scalar>(Scalar(0.0), half.x(), half.y(), half.z()) * motion.real;
    motion.stretch = this->Settings.stretch ? bone.stretch : Scalar(1.0);
    motion.twist = bone.twist;
    motion.calibreFirst = bone.calibreFirst;
    motion.calibreSecond = bone.calibreSecond;
    this->Sections =
      this->Sections || bone.twist != 0.0 || bone.calibreFirst != 1.0 || bone.calibreSecond != 1.0;
  }
}

template <typename Scalar, typename Number, typename Store>
void SkinDeformation::Internals::SetBone(std::size_t number, const Motion<Scalar>& motion,
  const Store& store, BasicSkinBone<Number>& bone) const
{
  const auto storeAffine = [&store](
                             auto* to, const Matrix<Scalar>& linear, const Vector<Scalar>& shift)
  {
    for (int row = 0; row < 3; ++row)
    {
      for (int column = 0; column < 3; ++column)
      {
        store(to[4 * row + column], linear(row, column));
      }
      store(to[4 * row + 3], shift[row]);
    }
  };
  const auto b = static_cast<std::int64_t>(number);
  const bool dual = this->Settings.blend == SkinBlend::DualQuaternion;
  const Vector3& axis = this->Rig.Direction(b);
  const Vector3 restHead = this->Rig.Head(b) - this->Centre;
  const double length = this->Rig.Length(b);
  const Vector<Scalar> direction = axis.cast<Scalar>();
  const Vector<Scalar> head = restHead.cast<Scalar>();
  const Vector<Scalar> centre = this->Centre.cast<Scalar>();
  const Vector<Scalar> posed = this->PosedCentre.cast<Scalar>();
  // From the middle of the mesh at rest to the middle of the posed skeleton.
  const Vector<Scalar> shift = motion.translation + motion.rotation * centre - posed;
  const Vector<Scalar> stretch = (motion.stretch - 1.0) * length * direction;
  const Matrix3 restBeside = Matrix3::Identity() - axis * axis.transpose();
  const Matrix<Scalar> beside = restBeside.cast<Scalar>();
  const Matrix<Scalar> cross = CrossOf(axis).template cast<Scalar>();
  if (dual)
  {
    const Vector<Scalar> half = Scalar(0.5) * shift;
    const Eigen::Quaternion<Scalar> second =
      Eigen::Quaternion<Scalar>(Scalar(0.0), half.x(), half.y(), half.z()) * motion.real;
    const Scalar values[8] = { motion.real.w(), motion.real.x(), motion.real.y(), motion.real.z(),
      second.w(), second.x(), second.y(), second.z() };
    for (int n = 0; n < 8; ++n)
    {
      store(bone.rigid[n], values[n]);
    }
  }
  else
  {
    storeAffine(bone.rigid, motion.rotation, shift);
  }
  const Matrix<Scalar> to = dual ? Matrix<Scalar>(Matrix<Scalar>::Identity()) : motion.rotation;
  const Vector<Scalar> posedStretch = to * stretch;
  for (int c = 0; c < 3; ++c)
  {
    store(bone.stretch[c], posedStretch[c]);
    bone.along[c] = static_cast<float>(axis[c] / length);
  }
  bone.along[3] = static_cast<float>(-axis.dot(restHead) / length);
  storeAffine(bone.section, to * beside, -(to * beside * head));
  storeAffine(bone.turned, to * cross, -(to * cross * head));
  store(bone.calibre[0], motion.calibreFirst);
  store(bone.calibre[1], motion.calibreSecond - motion.calibreFirst);
  store(bone.twist, motion.twist);
}

/// Near to where the mesh will be: single precision is best around it.
void SkinDeformation::Internals::SetCentre()
{
  Vector3 centre = Vector3::Zero();
  for (const Motion<double>& motion : this->Motions)
  {
    centre += motion.posedHead / static_cast<double>(this->Motions.size());
  }
  this->FloatCentre = { static_cast<float>(centre.x()), static_cast<float>(centre.y()),
    static_cast<float>(centre.z()) };
  this->PosedCentre = Vector3(static_cast<double>(this->FloatCentre[0]),
    static_cast<double>(this->FloatCentre[1]), static_cast<double>(this->FloatCentre[2]));
}

template <typename Scalar>
Local<Scalar> SkinDeformation::Internals::LocalAt(
  std::int64_t bone, const Motion<Scalar>& motion, const Vector3& point) const
{
  using std::cos;
  using std::sin;
  const Vector3& axis = this->Rig.Direction(bone);
  const double length = this->Rig.Length(bone);
  const Vector3 arm = point - this->Rig.Head(bone);
  const double x = axis.dot(arm);
  const double t = std::clamp(x / length, 0.0, 1.0);
  const Vector3 beside = arm - x * axis;
  const Vector<Scalar> direction = axis.cast<Scalar>();
  Local<Scalar> local{ point.cast<Scalar>() + (motion.stretch - 1.0) * length * t * direction,
    Matrix3::Identity() };
  if constexpr (HasGradient<Scalar>)
  {
    if (x > 0.0 && x < length)
    {
      local.gradient += (motion.stretch - 1.0) * axis * axis.transpose();
    }
  }
  if (this->Sections)
  {
    const Scalar calibre = motion.calibreFirst + (motion.calibreSecond - motion.calibreFirst) * t;
    const Scalar along = calibre * cos(motion.twist * t) - 1.0;
    const Scalar across = calibre * sin(motion.twist * t);
    const Vector3 aside = axis.cross(beside);
    local.point += along * beside.cast<Scalar>() + across * aside.cast<Scalar>();
    if constexpr (HasGradient<Scalar>)
    {
      local.gradient +=
        along * (Matrix3::Identity() - axis * axis.transpose()) + across * CrossOf(axis);
    }
  }
  return local;
}

template <typename Scalar>
Vector<Scalar> SkinDeformation::Internals::PlaceOf(
  const std::vector<Motion<Scalar>>& motions, std::int64_t point) const
{
  const Vector3& rest = this->Points[point];
  const std::int64_t first = this->Offset[point];
  const std::int64_t last = this->Offset[point + 1];
  Matrix3 linear = Matrix3::Zero();
  Vector<Scalar> place = Vector<Scalar>::Zero();
  if (this->Settings.blend == SkinBlend::Linear)
  {
    for (std::int64_t n = first; n < last; ++n)
    {
      const Motion<Scalar>& motion = motions[this->Bone[n]];
      const Local<Scalar> local = this->LocalAt(this->Bone[n], motion, rest);
      if constexpr (HasGradient<Scalar>)
      {
        linear += this->Weight[n] * motion.rotation * local.gradient;
      }
      place += Scalar(this->Weight[n]) * (motion.rotation * local.point + motion.translation);
    }
  }
  else
  {
    using Coefficients = Eigen::Matrix<Scalar, 4, 1>;
    const Eigen::Quaternion<Scalar>& pivot = motions[this->Bone[first]].real;
    Coefficients real = Coefficients::Zero(); // x y z w
    Coefficients dual = Coefficients::Zero();
    for (std::int64_t n = first; n < last; ++n)
    {
      const Motion<Scalar>& motion = motions[this->Bone[n]];
      const Local<Scalar> local = this->LocalAt(this->Bone[n], motion, rest);
      if constexpr (HasGradient<Scalar>)
      {
        linear += this->Weight[n] * local.gradient;
      }
      place += Scalar(this->Weight[n]) * local.point;
      const Scalar weight = motion.real.dot(pivot) < 0.0 ? -this->Weight[n] : this->Weight[n];
      real += weight * motion.real.coeffs();
      dual += weight * motion.dual.coeffs();
    }
    const Scalar norm = real.norm();
    const Eigen::Quaternion<Scalar> turn(Coefficients(real / norm));
    // The translation is what a motion does to the origin.
    const Eigen::Quaternion<Scalar> shift =
      Eigen::Quaternion<Scalar>(Coefficients(dual / norm)) * turn.conjugate();
    const Matrix<Scalar> rotation = turn.toRotationMatrix();
    if constexpr (HasGradient<Scalar>)
    {
      linear = rotation * linear;
    }
    place = rotation * place + Scalar(2.0) * shift.vec();
  }
  if constexpr (HasGradient<Scalar>)
  {
    const Vector3 constant = place - linear * rest;
    return linear * rest + constant;
  }
  return place;
}

template <typename Real>
void SkinDeformation::Internals::DisplacementsOf(
  const Real* positions, Real* displacements, const ProgressCallback& progress) const
{
  const auto body = [&](std::int64_t first, std::int64_t last)
  {
    for (std::int64_t i = first; i < last; ++i)
    {
      StorePoint(displacements, i, PointAt(positions, i) - this->Points[i]);
    }
  };
  For(static_cast<std::int64_t>(this->Points.size()), PointGrain, body, progress);
}

template <typename Real>
void SkinDeformation::Internals::NormalsOf(
  const Real* positions, Real* normals, const ProgressCallback& progress)
{
  const auto ofTriangles = [&](std::int64_t first, std::int64_t last)
  {
    for (std::int64_t n = first; n < last; ++n)
    {
      const Vector3 a = PointAt(positions, this->Triangles[n][0]);
      const Vector3 b = PointAt(positions, this->Triangles[n][1]);
      const Vector3 c = PointAt(positions, this->Triangles[n][2]);
      this->TriangleNormals[n] = (b - a).cross(c - a);
    }
  };
  For(static_cast<std::int64_t>(this->Triangles.size()), PointGrain, ofTriangles,
    PartOf(progress, 0.0, 0.5));
  const auto ofPoints = [&](std::int64_t first, std::int64_t last)
  {
    for (std::int64_t i = first; i < last; ++i)
    {
      Vector3 sum = Vector3::Zero();
      if (!this->TrianglesOf.offset.empty())
      {
        for (std::int64_t n = this->TrianglesOf.offset[i]; n < this->TrianglesOf.offset[i + 1]; ++n)
        {
          sum += this->TriangleNormals[this->TrianglesOf.item[n]];
        }
      }
      StorePoint(normals, i, sum.stableNormalized());
    }
  };
  For(static_cast<std::int64_t>(this->Points.size()), PointGrain, ofPoints,
    PartOf(progress, 0.5, 1.0));
}

template <typename Real>
double SkinDeformation::Internals::RatioOf(const Real* positions, std::int64_t tetrahedron) const
{
  const std::array<std::int64_t, 4>& corners = this->Tetrahedra[tetrahedron];
  const Vector3 a = PointAt(positions, corners[0]);
  const double volume = (PointAt(positions, corners[1]) - a)
                          .cross(PointAt(positions, corners[2]) - a)
                          .dot(PointAt(positions, corners[3]) - a);
  return volume / this->RestVolume[tetrahedron];
}

template <typename Real>
void SkinDeformation::Internals::Check(const Real* positions, InversionReport& report,
  double minimumRatio, const ProgressCallback& progress)
{
  const auto body = [&](std::int64_t first, std::int64_t last)
  {
    for (std::int64_t n = first; n < last; ++n)
    {
      this->Ratio[n] = this->RatioOf(positions, n);
    }
  };
  const auto count = static_cast<std::int64_t>(this->Tetrahedra.size());
  For(count, PointGrain, body, progress);
  report.tetrahedra.clear();
  report.minimumRatio = count > 0 ? std::numeric_limits<double>::infinity() : 1.0;
  for (std::int64_t n = 0; n < count; ++n)
  {
    report.minimumRatio = std::min(report.minimumRatio, this->Ratio[n]);
    if (!(this->Ratio[n] > minimumRatio))
    {
      report.tetrahedra.push_back(n);
    }
  }
  report.found = static_cast<std::int64_t>(report.tetrahedra.size());
  report.movedPoints = 0;
  report.maximumMove = 0.0;
  report.sweeps = 0;
}

template <typename Real>
void SkinDeformation::Internals::Repair(
  Real* positions, InversionReport& report, double minimumRatio, const ProgressCallback& progress)
{
  Require(minimumRatio >= 0.0 && minimumRatio <= MaximumOfMinimumRatio,
    "The least ratio of volumes that a repair can reach is 0 to 0.5");
  this->Check(positions, report, minimumRatio, PartOf(progress, 0.0, 0.3));
  if (report.found == 0)
  {
    SkipProgress(progress, 0.3, 1.0);
    return;
  }
  // Rounding of the positions must not undo it.
  const double wanted = 1.05 * minimumRatio + RepairMargin;
  std::vector<char> moves(this->Points.size(), 0);
  std::vector<std::int64_t> moved;
  std::vector<char> queued(this->Tetrahedra.size(), 0);
  std::vector<std::int64_t> next = report.tetrahedra;
  while (!next.empty() && report.sweeps < RepairSweeps)
  {
    report.tetrahedra.swap(next);
    next.clear();
    for (const std::int64_t n : report.tetrahedra)
    {
      queued[n] = 0;
    }
    // What has come to no end by now turns each other over: less is asked of each.
    const double stretch =
      MinimumRepairStretch * std::pow(0.5, static_cast<double>(report.sweeps / RepairPatience));
    // How many sweeps it will be is not known: each one takes a tenth of what is left.
    const double left = 0.6 * std::pow(0.9, report.sweeps);
    const ProgressCallback sweepProgress = PartOf(progress, 0.9 - left, 0.9 - 0.9 * left);
    LoopReport sweepReport(sweepProgress, static_cast<std::int64_t>(report.tetrahedra.size()));
    for (std::size_t at = 0; at < report.tetrahedra.size(); ++at)
    {
      const std::int64_t n = report.tetrahedra[at];
      sweepReport(static_cast<std::int64_t>(at));
      if (this->RatioOf(positions, n) > minimumRatio)
      {
        continue; // a neighbour's repair was its own
      }
      this->Unfold(positions, n, wanted, stretch);
      for (const std::int64_t corner : this->Tetrahedra[n])
      {
        if (!moves[corner])
        {
          moves[corner] = 1;
          moved.push_back(corner);
        }
        for (std::int64_t k = this->TetrahedraOf.offset[corner];
             k < this->TetrahedraOf.offset[corner + 1]; ++k)
        {
          const std::int64_t near = this->TetrahedraOf.item[k];
          if (!queued[near])
          {
            queued[near] = 1;
            next.push_back(near);
          }
        }
      }
    }
    next.erase(std::remove_if(next.begin(), next.end(),
                 [&](std::int64_t n)
                 {
                   const bool fine = this->RatioOf(positions, n) > minimumRatio;
                   queued[n] = fine ? 0 : queued[n];
                   return fine;
                 }),
      next.end());
    ++report.sweeps;
  }
  SkipProgress(progress, 0.9 - 0.6 * std::pow(0.9, report.sweeps), 0.9);
  const std::int64_t found = report.found;
  const int sweeps = report.sweeps;
  this->Check(positions, report, minimumRatio, PartOf(progress, 0.9, 1.0));
  report.found = found;
  report.sweeps = sweeps;
  report.movedPoints = static_cast<std::int64_t>(moved.size());
  for (const std::int64_t i : moved)
  {
    report.maximumMove =
      std::max(report.maximumMove, (PointAt(positions, i) - this->Deformed(i)).norm());
  }
}

template <typename Real>
void SkinDeformation::Internals::Unfold(
  Real* positions, std::int64_t tetrahedron, double wantedRatio, double minimum) const
{
  const std::array<std::int64_t, 4>& corners = this->Tetrahedra[tetrahedron];
  Vector3 restCentre = Vector3::Zero();
  Vector3 centre = Vector3::Zero();
  for (const std::int64_t corner : corners)
  {
    restCentre += 0.25 * this->Points[corner];
    centre += 0.25 * PointAt(positions, corner);
  }
  Matrix3 restEdges;
  Matrix3 edges;
  for (int c = 0; c < 3; ++c)
  {
    restEdges.col(c) = this->Points[corners[c + 1]] - this->Points[corners[0]];
    edges.col(c) = PointAt(positions, corners[c + 1]) - PointAt(positions, corners[0]);
  }
  const Matrix3 deformation = edges * restEdges.inverse();
  if (!deformation.allFinite())
  {
    return;
  }
  const Eigen::JacobiSVD<Matrix3> svd(deformation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3 u = svd.matrixU();
  Vector3 stretches = svd.singularValues();
  if (u.determinant() * svd.matrixV().determinant() < 0.0)
  {
    // The least stretch is the one that is turned over.
    u.col(2) = -u.col(2);
    stretches[2] = -stretches[2];
  }
  Vector3 wanted = stretches.cwiseMax(minimum);
  while (wanted.prod() < wantedRatio)
  {
    minimum *= 1.1;
    wanted = stretches.cwiseMax(minimum);
  }
  const Matrix3 gradient = u * wanted.asDiagonal() * svd.matrixV().transpose();
  for (const std::int64_t corner : corners)
  {
    StorePoint(positions, corner, centre + gradient * (this->Points[corner] - restCentre));
  }
}

SkinDeformation::SkinDeformation(const std::vector<Vector3>& points,
  const CompactSkinWeights& weights, const Skeleton& rest, const SkinDeformationSettings& settings,
  const ProgressCallback& progress)
  : Data(std::make_unique<Internals>(points, weights, rest, settings, progress))
{
}

SkinDeformation::~SkinDeformation() = default;
SkinDeformation::SkinDeformation(SkinDeformation&&) noexcept = default;
SkinDeformation& SkinDeformation::operator=(SkinDeformation&&) noexcept = default;

const SkeletonRig& SkinDeformation::Rig() const
{
  return this->Data->Rig;
}

std::int64_t SkinDeformation::NumberOfPoints() const
{
  return static_cast<std::int64_t>(this->Data->Points.size());
}

void SkinDeformation::SetVolumeConservation(double share)
{
  Require(share >= 0.0 && share <= 1.0, "The share of the volume that is kept must be 0 to 1");
  this->Data->VolumeConservation = share;
}

const std::vector<BoneTransform>& SkinDeformation::Bones() const
{
  return this->Data->Transforms;
}

void SkinDeformation::Internals::Deform(float* positions, const ProgressCallback& progress)
{
  this->SetCentre();
  this->Bones.resize(this->Motions.size());
  const auto store = [](float& to, double value) { to = static_cast<float>(value); };
  for (std::size_t b = 0; b < this->Motions.size(); ++b)
  {
    this->SetBone(b, this->Motions[b], store, this->Bones[b]);
  }
  const bool dual = this->Settings.blend == SkinBlend::DualQuaternion;
  const SkinPositions kernel =
    SkinKernelChoice().Get().positions[dual ? 1 : 0][this->Sections ? 1 : 0];
  const auto body = [&](std::int64_t first, std::int64_t last)
  { kernel(this->Blocks, this->Bones.data(), this->FloatCentre.data(), first, last, positions); };
  For(static_cast<std::int64_t>(this->BlockOffset.size()) - 1, BlockGrain, body, progress);
}

void SkinDeformation::Internals::Deform(
  float* positions, float* velocities, const ProgressCallback& progress)
{
  this->SetCentre();
  this->MovingBones.resize(this->Motions.size());
  const auto storeValue = [](MovingFloat& to, double value)
  { to.value = static_cast<float>(value); };
  const auto storeRate = [](MovingFloat& to, const Dual& value)
  { to.rate = static_cast<float>(value.rate); };
  for (std::size_t b = 0; b < this->Motions.size(); ++b)
  {
    this->SetBone(b, this->Motions[b], storeValue, this->MovingBones[b]);
    this->SetBone(b, this->MovingMotions[b], storeRate, this->MovingBones[b]);
  }
  const bool dual = this->Settings.blend == SkinBlend::DualQuaternion;
  const SkinMotion kernel = SkinKernelChoice().Get().motion[dual ? 1 : 0][this->Sections ? 1 : 0];
  const auto body = [&](std::int64_t first, std::int64_t last)
  {
    kernel(this->Blocks, this->MovingBones.data(), this->FloatCentre.data(), first, last, positions,
      velocities);
  };
  For(static_cast<std::int64_t>(this->BlockOffset.size()) - 1, BlockGrain, body, progress);
}

void SkinDeformation::Internals::Deform(double* positions, const ProgressCallback& progress)
{
  const auto body = [&](std::int64_t first, std::int64_t last)
  {
    for (std::int64_t i = first; i < last; ++i)
    {
      StorePoint(positions, i, this->Deformed(i));
    }
  };
  For(static_cast<std::int64_t>(this->Points.size()), PointGrain, body, progress);
}

void SkinDeformation::Internals::Deform(
  double* positions, double* velocities, const ProgressCallback& progress)
{
  const auto body = [&](std::int64_t first, std::int64_t last)
  {
    for (std::int64_t i = first; i < last; ++i)
    {
      StorePoint(positions, i, this->Deformed(i));
      const Vector<Dual> place = this->PlaceOf(this->MovingMotions, i);
      StorePoint(velocities, i, Vector3(place.x().rate, place.y().rate, place.z().rate));
    }
  };
  For(static_cast<std::int64_t>(this->Points.size()), PointGrain, body, progress);
}

void SkinDeformation::Deform(
  const std::vector<BoneTransform>& bones, float* positions, const ProgressCallback& progress)
{
  this->Data->SetMotions(bones, this->Data->Motions);
  this->Data->Deform(positions, progress);
}

void SkinDeformation::Deform(
  const std::vector<BoneTransform>& bones, double* positions, const ProgressCallback& progress)
{
  this->Data->SetMotions(bones, this->Data->Motions);
  this->Data->Deform(positions, progress);
}

void SkinDeformation::Deform(
  const SkeletonPose& pose, float* positions, const ProgressCallback& progress)
{
  this->Data->SetPose(pose, this->Data->Transforms, this->Data->Motions);
  this->Data->Deform(positions, progress);
}

void SkinDeformation::Deform(
  const SkeletonPose& pose, double* positions, const ProgressCallback& progress)
{
  this->Data->SetPose(pose, this->Data->Transforms, this->Data->Motions);
  this->Data->Deform(positions, progress);
}

void SkinDeformation::Deform(const MovingSkeletonPose& pose, float* positions, float* velocities,
  const ProgressCallback& progress)
{
  this->Data->SetPose(pose);
  this->Data->Deform(positions, velocities, progress);
}

void SkinDeformation::Deform(const MovingSkeletonPose& pose, double* positions, double* velocities,
  const ProgressCallback& progress)
{
  this->Data->SetPose(pose);
  this->Data->Deform(positions, velocities, progress);
}

void SkinDeformation::Displacements(
  const float* positions, float* displacements, const ProgressCallback& progress) const
{
  this->Data->DisplacementsOf(positions, displacements, progress);
}

void SkinDeformation::Displacements(
  const double* positions, double* displacements, const ProgressCallback& progress) const
{
  this->Data->DisplacementsOf(positions, displacements, progress);
}

void SkinDeformation::SetTriangles(
  const std::vector<Triangle>& triangles, const ProgressCallback& progress)
{
  const WorkParts parts(progress, { 0.2, 0.8 });
  RequireCorners(triangles, this->NumberOfPoints(), "Triangle", parts(0));
  this->Data->TrianglesOf = CellsOfPoints(triangles, this->NumberOfPoints(), parts(1));
  this->Data->Triangles = triangles;
  this->Data->TriangleNormals.resize(triangles.size());
}

void SkinDeformation::NormalsOf(
  const float* positions, float* normals, const ProgressCallback& progress) const
{
  this->Data->NormalsOf(positions, normals, progress);
}

void SkinDeformation::NormalsOf(
  const double* positions, double* normals, const ProgressCallback& progress) const
{
  this->Data->NormalsOf(positions, normals, progress);
}

void SkinDeformation::SetTetrahedra(
  const std::vector<std::array<std::int64_t, 4>>& tetrahedra, const ProgressCallback& progress)
{
  const WorkParts parts(progress, { 0.1, 0.4, 0.5 });
  RequireCorners(tetrahedra, this->NumberOfPoints(), "Tetrahedron", parts(0));
  std::vector<double> volumes(tetrahedra.size());
  const ProgressCallback volumeProgress = parts(1);
  LoopReport report(volumeProgress, static_cast<std::int64_t>(tetrahedra.size()));
  for (std::size_t n = 0; n < tetrahedra.size(); ++n)
  {
    report(static_cast<std::int64_t>(n));
    const std::vector<Vector3>& points = this->Data->Points;
    const Vector3 a = points[tetrahedra[n][1]] - points[tetrahedra[n][0]];
    const Vector3 b = points[tetrahedra[n][2]] - points[tetrahedra[n][0]];
    const Vector3 c = points[tetrahedra[n][3]] - points[tetrahedra[n][0]];
    volumes[n] = a.cross(b).dot(c);
    if (!(std::abs(volumes[n]) > 1e-14 * a.norm() * b.norm() * c.norm()))
    {
      throw std::invalid_argument("Tetrahedron " + std::to_string(n) + " has no volume at rest");
    }
  }
  this->Data->TetrahedraOf = CellsOfPoints(tetrahedra, this->NumberOfPoints(), parts(2));
  this->Data->Tetrahedra = tetrahedra;
  this->Data->RestVolume = std::move(volumes);
  this->Data->Ratio.assign(tetrahedra.size(), 1.0);
}

void SkinDeformation::CheckTetrahedra(const float* positions, InversionReport& report,
  double minimumRatio, const ProgressCallback& progress) const
{
  this->Data->Check(positions, report, minimumRatio, progress);
}

void SkinDeformation::CheckTetrahedra(const double* positions, InversionReport& report,
  double minimumRatio, const ProgressCallback& progress) const
{
  this->Data->Check(positions, report, minimumRatio, progress);
}

void SkinDeformation::RepairTetrahedra(
  float* positions, InversionReport& report, double minimumRatio, const ProgressCallback& progress)
{
  this->Data->Repair(positions, report, minimumRatio, progress);
}

void SkinDeformation::RepairTetrahedra(
  double* positions, InversionReport& report, double minimumRatio, const ProgressCallback& progress)
{
  this->Data->Repair(positions, report, minimumRatio, progress);
}

const std::vector<double>& SkinDeformation::VolumeRatios() const
{
  return this->Data->Ratio;
}

double SkinDeformation::EntriesPerBlock() const
{
  const std::size_t blocks = this->Data->BlockOffset.size() - 1;
  return blocks == 0
    ? 0.0
    : static_cast<double>(this->Data->BlockBone.size()) / static_cast<double>(blocks);
}
}
