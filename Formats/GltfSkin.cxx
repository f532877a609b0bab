#include "GltfSkin.h"

#include "Base64.h"
#include "ByteOrder.h"
#include "Require.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;
using Pose = Eigen::Isometry3d;

constexpr double MetresOfMm = 0.001;
constexpr double NoLength = 1e-10; ///< metres: what rounding leaves of nothing

// Numbers of the specification.
constexpr int Float = 5126;
constexpr int UnsignedShort = 5123;
constexpr int UnsignedInt = 5125;
constexpr int VertexBuffer = 34962;
constexpr int IndexBuffer = 34963;

/// LPS to glTF's axes.
Vector3 Axes(const Vector3& v)
{
  return { v[0], v[2], -v[1] };
}

Vector3 Metres(const Vector3& mm)
{
  return MetresOfMm * Axes(mm);
}

Quaternion Axes(const Quaternion& q)
{
  const Vector3 v = Axes(Vector3(q.vec()));
  return { q.w(), v[0], v[1], v[2] };
}

/// Both ends of a bone's linear map: p -> origin + map (p - rest).
struct EndMap
{
  Matrix3 map;
  Vector3 rest;
  Vector3 origin;

  Vector3 operator()(const Vector3& p) const { return this->origin + this->map * (p - this->rest); }
};

/// 2 bone, 2 bone + 1: the maps of its first and of its second end.
std::vector<EndMap> EndMaps(
  const std::vector<RestBone>& bones, const std::vector<BoneTransform>& motion)
{
  std::vector<EndMap> maps;
  maps.reserve(2 * bones.size());
  for (std::size_t b = 0; b < bones.size(); ++b)
  {
    const BoneTransform& t = motion[b];
    const Vector3 axis = bones[b].tail - bones[b].head;
    const Vector3 d = axis.normalized();
    const Matrix3 along = d * d.transpose();
    const Matrix3 beside = Matrix3::Identity() - along;
    const Matrix3 rotation = t.rotation.toRotationMatrix();
    const Matrix3 twist = Eigen::AngleAxisd(t.twist, d).toRotationMatrix();
    maps.push_back({ rotation * (along + t.calibreFirst * beside), bones[b].head, t.posedHead });
    maps.push_back({ rotation * twist * (along + t.calibreSecond * beside), bones[b].tail,
      t.posedHead + t.stretch * (rotation * axis) });
  }
  return maps;
}

void CheckModel(const GltfModel& model)
{
  const CompactSkinWeights& weights = model.weights;
  const std::size_t entries =
    model.points.size() * static_cast<std::size_t>(std::max(0, weights.influences));
  Require(!model.points.empty(), "A glTF skin needs points");
  Require(
    weights.influences > 0 && weights.bone.size() == entries && weights.weight.size() == entries,
    "A glTF skin has " + std::to_string(model.points.size()) +
      " points and weights of another number");
  Require(!model.bones.empty() && model.bones.size() <= 32767,
    "A glTF skin takes 1 to 32767 bones, not " + std::to_string(model.bones.size()));
  for (std::size_t b = 0; b < model.bones.size(); ++b)
  {
    const RestBone& bone = model.bones[b];
    const double length = (bone.tail - bone.head).norm();
    Require(std::isfinite(length) && length > 0.0, "Bone " + std::to_string(b) + " has no length");
    Require(bone.parent >= -1 && bone.parent < static_cast<std::int64_t>(model.bones.size()),
      "Bone " + std::to_string(b) + " has a parent that does not exist");
  }
}

/// A node's number and what it has of a point.
using Share = std::pair<double, std::uint16_t>;

/// A bone's weight is shared between its ends by the place along it.
void Collect(const GltfModel& model, std::size_t point, std::vector<Share>& shares)
{
  shares.clear();
  const auto count = static_cast<std::size_t>(model.weights.influences);
  const Vector3& p = model.points[point];
  Require(p.allFinite(), "Point " + std::to_string(point) + " of a glTF skin is not finite");
  double sum = 0.0;
  for (std::size_t k = point * count; k < (point + 1) * count; ++k)
  {
    const double weight = model.weights.weight[k];
    if (weight == 0.0)
    {
      continue;
    }
    const std::int32_t bone = model.weights.bone[k];
    Require(std::isfinite(weight) && weight > 0.0 && bone >= 0 &&
        bone < static_cast<std::int64_t>(model.bones.size()),
      "Point " + std::to_string(point) + " of a glTF skin has a weight that can not be");
    const RestBone& rest = model.bones[static_cast<std::size_t>(bone)];
    const double place = NearestOnSegment(p, rest.head, rest.tail).fraction;
    shares.emplace_back(weight * (1.0 - place), static_cast<std::uint16_t>(2 * bone));
    shares.emplace_back(weight * place, static_cast<std::uint16_t>(2 * bone + 1));
    sum += weight;
  }
  Require(sum > 0.0, "Point " + std::to_string(point) + " of a glTF skin has no weight");
  for (Share& share : shares)
  {
    share.first /= sum;
  }
  std::sort(shares.begin(), shares.end(),
    [](const Share& a, const Share& b)
    { return a.first != b.first ? a.first > b.first : a.second < b.second; });
}

/// One binary buffer, the views into it and their accessors.
class Buffer
{
public:
  /// Everything until the next view is in this one.
  void BeginView(int target)
  {
    Json view = { { "buffer", 0 }, { "byteOffset", this->Bytes.size() }, { "byteLength", 0 } };
    if (target != 0)
    {
      view["target"] = target;
    }
    this->Views.push_back(std::move(view));
  }

  /// @param bounds  whether `min` and `max` are wanted
  /// @return number of the accessor
  std::size_t Floats(const std::vector<float>& values, std::size_t components, bool bounds)
  {
    Json accessor = this->Accessor(Float, values.size() / components, TypeOf(components));
    if (bounds)
    {
      std::vector<float> minimum(components, std::numeric_limits<float>::max());
      std::vector<float> maximum(components, std::numeric_limits<float>::lowest());
      for (std::size_t n = 0; n < values.size(); ++n)
      {
        float& low = minimum[n % components];
        float& high = maximum[n % components];
        low = std::min(low, values[n]);
        high = std::max(high, values[n]);
      }
      accessor["min"] = minimum;
      accessor["max"] = maximum;
    }
    return this->Add(values, std::move(accessor));
  }

  std::size_t Indices(const std::vector<std::uint32_t>& values)
  {
    Json accessor = this->Accessor(UnsignedInt, values.size(), "SCALAR");
    return this->Add(values, std::move(accessor));
  }

  std::size_t JointSets(const std::vector<std::uint16_t>& values)
  {
    Json accessor = this->Accessor(UnsignedShort, values.size() / 4, "VEC4");
    return this->Add(values, std::move(accessor));
  }

  std::string Bytes;
  Json Views = Json::array();
  Json Accessors = Json::array();

private:
  static const char* TypeOf(std::size_t components)
  {
    return components == 1 ? "SCALAR"
      : components == 3    ? "VEC3"
      : components == 4    ? "VEC4"
                           : "MAT4";
  }

  Json Accessor(int componentType, std::size_t count, const char* type) const
  {
    const std::size_t begin = this->Views.back()["byteOffset"].get<std::size_t>();
    return { { "bufferView", this->Views.size() - 1 }, { "byteOffset", this->Bytes.size() - begin },
      { "componentType", componentType }, { "count", count }, { "type", type } };
  }

  template <typename Value>
  std::size_t Add(const std::vector<Value>& values, Json accessor)
  {
    for (const Value value : values)
    {
      AppendLittleEndian(this->Bytes, value);
    }
    this->Bytes.resize((this->Bytes.size() + 3) / 4 * 4, '\0');
    Json& view = this->Views.back();
    view["byteLength"] = this->Bytes.size() - view["byteOffset"].get<std::size_t>();
    this->Accessors.push_back(std::move(accessor));
    return this->Accessors.size() - 1;
  }
};

void Push(std::vector<float>& values, const Vector3& v)
{
  for (int k = 0; k < 3; ++k)
  {
    values.push_back(static_cast<float>(v[k]));
  }
}

/// glTF has x y z w.
void Push(std::vector<float>& values, const Quaternion& q)
{
  Push(values, Vector3(q.vec()));
  values.push_back(static_cast<float>(q.w()));
}

/// A node's place in its parent.
struct LocalPose
{
  Vector3 translation = Vector3::Zero(); ///< metres
  Quaternion rotation = Quaternion::Identity();
  Vector3 scale = Vector3::Ones();
};

/// @throws std::invalid_argument for bones in a ring
std::vector<std::size_t> ParentsFirst(const std::vector<RestBone>& bones)
{
  std::vector<std::size_t> order;
  std::vector<bool> known(bones.size(), false);
  std::vector<std::size_t> branch;
  for (std::size_t b = 0; b < bones.size(); ++b)
  {
    for (auto n = static_cast<std::int64_t>(b); n >= 0 && !known[static_cast<std::size_t>(n)];
         n = bones[static_cast<std::size_t>(n)].parent)
    {
      Require(branch.size() < bones.size(), "The bones of a glTF skin make a ring");
      branch.push_back(static_cast<std::size_t>(n));
    }
    for (; !branch.empty(); branch.pop_back())
    {
      known[branch.back()] = true;
      order.push_back(branch.back());
    }
  }
  return order;
}

/// Kinds of nodes of a bone. The last two carry the calibre, which must not reach the bones beyond.
enum NodeKinds
{
  HeadNode = 0,
  TailNode = 1,
  HeadCalibre = 2,
  TailCalibre = 3
};

/// Nodes of the bones: local poses at rest and at the keys.
class BoneNodes
{
public:
  BoneNodes(const GltfModel& model, bool calibre)
    : Bones(model.bones)
    , Kinds(calibre ? 4 : 2)
  {
    // The y axis of a node lies along its bone, turned as little as possible from bone to bone.
    this->Rest.resize(this->Bones.size());
    for (const std::size_t b : ParentsFirst(this->Bones))
    {
      const RestBone& bone = this->Bones[b];
      const Vector3 along = Axes(Vector3((bone.tail - bone.head).normalized()));
      const Quaternion before = bone.parent < 0 ? Quaternion::Identity()
                                                : this->Rest[static_cast<std::size_t>(bone.parent)];
      const Vector3 axis = before * Vector3::UnitY();
      this->Rest[b] = (ShortestRotation(axis, along) * before).normalized();
    }
  }

  std::size_t KindsPerBone() const { return this->Kinds; }

  std::vector<BoneTransform> RestMotion() const
  {
    std::vector<BoneTransform> motion(this->Bones.size());
    for (std::size_t b = 0; b < motion.size(); ++b)
    {
      motion[b].posedHead = this->Bones[b].head;
    }
    return motion;
  }

  /// Kinds nodes a bone.
  std::vector<LocalPose> Local(const std::vector<BoneTransform>& motion) const
  {
    std::vector<LocalPose> local(this->Kinds * this->Bones.size());
    for (std::size_t b = 0; b < this->Bones.size(); ++b)
    {
      const BoneTransform& t = motion[b];
      LocalPose* nodes = &local[this->Kinds * b];
      const Pose head = this->Head(t, b);
      Pose inParent = head;
      if (this->Bones[b].parent >= 0)
      {
        const auto parent = static_cast<std::size_t>(this->Bones[b].parent);
        inParent = this->Tail(motion[parent], parent).inverse() * head;
      }
      nodes[HeadNode].translation = inParent.translation();
      if (inParent.translation().norm() < NoLength)
      {
        nodes[HeadNode].translation.setZero();
      }
      nodes[HeadNode].rotation = Quaternion(inParent.linear()).normalized();
      nodes[TailNode].translation = { 0.0, this->Stretched(t, b), 0.0 };
      nodes[TailNode].rotation = Eigen::AngleAxisd(t.twist, Vector3::UnitY());
      if (this->Kinds > 2)
      {
        nodes[HeadCalibre].scale = { t.calibreFirst, 1.0, t.calibreFirst };
        nodes[TailCalibre].scale = { t.calibreSecond, 1.0, t.calibreSecond };
      }
    }
    return local;
  }

  ///@{
  /// Of a bone's ends in the scene.
  Pose Head(const BoneTransform& t, std::size_t b) const
  {
    Pose pose = Pose::Identity();
    pose.translation() = Metres(t.posedHead);
    pose.linear() = (Axes(t.rotation) * this->Rest[b]).normalized().toRotationMatrix();
    return pose;
  }

  Pose Tail(const BoneTransform& t, std::size_t b) const
  {
    return this->Head(t, b) * Eigen::Translation3d(0.0, this->Stretched(t, b), 0.0) *
      Eigen::AngleAxisd(t.twist, Vector3::UnitY());
  }
  ///@}

private:
  double Stretched(const BoneTransform& t, std::size_t b) const
  {
    return MetresOfMm * t.stretch * (this->Bones[b].tail - this->Bones[b].head).norm();
  }

  const std::vector<RestBone>& Bones;
  std::size_t Kinds;
  std::vector<Quaternion> Rest; ///< per bone: from the y axis, in glTF's axes
};

bool HasCalibre(const GltfModel& model)
{
  for (const GltfKey& key : model.keys)
  {
    for (const BoneTransform& t : key.motion)
    {
      if (t.calibreFirst != 1.0 || t.calibreSecond != 1.0)
      {
        return true;
      }
    }
  }
  return false;
}

void CheckKeys(const GltfModel& model)
{
  Require(std::isfinite(model.cycleLength) && model.cycleLength > 0.0,
    "The cycle of a glTF animation must be positive");
  Require(std::isfinite(model.period) && model.period > 0.0,
    "The period of a glTF animation must be positive");
  for (std::size_t k = 0; k < model.keys.size(); ++k)
  {
    const GltfKey& key = model.keys[k];
    Require(key.motion.size() == model.bones.size(),
      "Key " + std::to_string(k) + " of a glTF animation has another number of bones");
    Require(std::isfinite(key.phase) && (k == 0 || key.phase > model.keys[k - 1].phase),
      "The phases of a glTF animation must be finite and increase");
  }
}

constexpr double SamePhase = 1e-9; ///< of a period

/// Those of one period where the animation loops, else all.
std::vector<GltfKey> KeysOf(const GltfModel& model)
{
  std::vector<GltfKey> keys = model.keys;
  while (model.loop && keys.size() > 1 &&
    keys.back().phase > keys.front().phase + model.period * (1.0 + SamePhase))
  {
    keys.pop_back();
  }
  return keys;
}

/// Unit normals of the points, weighted by the areas around.
std::vector<Vector3> NormalsOf(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  std::vector<Vector3> normals(points.size(), Vector3::Zero());
  const auto at = [](std::int64_t n) { return static_cast<std::size_t>(n); };
  for (const Triangle& t : triangles)
  {
    const Vector3 area =
      (points[at(t[1])] - points[at(t[0])]).cross(points[at(t[2])] - points[at(t[0])]);
    for (const std::int64_t corner : t)
    {
      normals[at(corner)] += area;
    }
  }
  for (Vector3& normal : normals)
  {
    const double length = normal.norm();
    normal = length > 0.0 ? Vector3(normal / length) : Vector3(Vector3::UnitZ());
  }
  return normals;
}

/// Puts the document together.
class Document
{
public:
  Document(const GltfModel& model, const GltfSkin& skin)
    : Model(model)
    , Skin(skin)
    , Keys(KeysOf(model))
    , Nodes(model, HasCalibre(model))
  {
    CheckKeys(model);
    this->Json_["asset"] = { { "version", "2.0" }, { "generator", "DynamicCoronary" } };
    this->Json_["scene"] = 0;
    this->Json_["scenes"] = Json::array();
    this->Json_["nodes"] = Json::array();
    this->AddBones();
    this->AddMaterials();
    std::vector<std::size_t> roots{ 0 };
    for (const bool cap : { false, true })
    {
      this->AddMesh(cap, roots);
    }
    Require(roots.size() > 1, "A glTF skin needs triangles");
    this->Json_["scenes"].push_back(
      { { "name", model.name }, { "nodes", roots }, { "extras", this->Extras() } });
    this->AddAnimation();
    Require(this->Data.Bytes.size() < std::numeric_limits<std::uint32_t>::max() / 2,
      "The data of a glTF file do not fit into 2 GiB");
    this->Json_["accessors"] = std::move(this->Data.Accessors);
    this->Json_["bufferViews"] = std::move(this->Data.Views);
    this->Json_["buffers"] = { { { "byteLength", this->Data.Bytes.size() } } };
  }

  std::string Binary() const
  {
    std::string json = Dump(this->Json_);
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const std::string& data = this->Data.Bytes;
    std::string file = "glTF";
    AppendLittleEndian(file, std::uint32_t{ 2 });
    AppendLittleEndian(file, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + data.size()));
    AppendLittleEndian(file, static_cast<std::uint32_t>(json.size()));
    file += "JSON" + json;
    AppendLittleEndian(file, static_cast<std::uint32_t>(data.size()));
    file += std::string("BIN\0", 4) + data;
    return file;
  }

  std::string Text() const
  {
    Json json = this->Json_;
    json["buffers"][0]["uri"] = "data:application/octet-stream;base64," + Base64(this->Data.Bytes);
    return Dump(json);
  }

private:
  /// Names come from users' files, which may hold anything.
  static std::string Dump(const Json& json)
  {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
  }

  std::size_t NodeOf(std::size_t bone, std::size_t kind) const
  {
    return 1 + this->Nodes.KindsPerBone() * bone + kind;
  }

  /// Names differ, also where those of the bones do not.
  std::vector<std::string> UniqueNames() const
  {
    std::map<std::string, int> uses;
    std::vector<std::string> result;
    for (std::size_t b = 0; b < this->Model.bones.size(); ++b)
    {
      const std::string& given = this->Model.bones[b].name;
      const std::string name = given.empty() ? "bone" + std::to_string(b) : given;
      const int before = uses[name]++;
      result.push_back(before == 0 ? name : name + "." + std::to_string(before));
    }
    return result;
  }

  void AddBones()
  {
    const std::size_t kinds = this->Nodes.KindsPerBone();
    const std::vector<BoneTransform> rest = this->Nodes.RestMotion();
    const std::vector<LocalPose> local = this->Nodes.Local(rest);
    const std::vector<std::string> names = this->UniqueNames();
    std::vector<Json> nodes(1 + kinds * names.size());
    nodes[0] = { { "name", "skeleton" }, { "children", Json::array() } };
    std::vector<std::size_t> joints;
    std::vector<float> inverse;
    constexpr const char* Ends[] = { "", " end", " calibre", " end calibre" };
    for (std::size_t b = 0; b < names.size(); ++b)
    {
      for (std::size_t kind = 0; kind < kinds; ++kind)
      {
        const LocalPose& pose = local[kinds * b + kind];
        Json node = { { "name", names[b] + Ends[kind] } };
        std::vector<float> translation;
        Push(translation, pose.translation);
        std::vector<float> rotation;
        Push(rotation, pose.rotation);
        node["translation"] = translation;
        node["rotation"] = rotation;
        node["extras"] = { { "bone", b }, { "segment", SegmentOf(names[b]) },
          { "end", kind == HeadNode || kind == HeadCalibre ? "first" : "second" } };
        nodes[this->NodeOf(b, kind)] = std::move(node);
      }
      for (const Pose& pose : { this->Nodes.Head(rest[b], b), this->Nodes.Tail(rest[b], b) })
      {
        joints.push_back(this->NodeOf(b, joints.size() % 2 + (kinds > 2 ? 2 : 0)));
        const Eigen::Matrix4d matrix = pose.inverse().matrix();
        for (Eigen::Index n = 0; n < matrix.size(); ++n)
        {
          inverse.push_back(static_cast<float>(matrix.data()[n])); // by columns, as glTF's
        }
      }
    }
    this->Connect(nodes);
    for (Json& node : nodes)
    {
      this->Json_["nodes"].push_back(std::move(node));
    }
    this->Data.BeginView(0);
    this->Json_["skins"] = { { { "name", this->Model.name }, { "skeleton", 0 },
      { "inverseBindMatrices", this->Data.Floats(inverse, 16, false) }, { "joints", joints } } };
  }

  /// Gives the nodes their children: a bone hangs on the end of the one before it.
  void Connect(std::vector<Json>& nodes) const
  {
    for (std::size_t b = 0; b < this->Model.bones.size(); ++b)
    {
      const std::int64_t parent = this->Model.bones[b].parent;
      const std::size_t ends = this->NodeOf(b, TailNode);
      nodes[this->NodeOf(b, HeadNode)]["children"].push_back(ends);
      if (this->Nodes.KindsPerBone() > 2)
      {
        nodes[this->NodeOf(b, HeadNode)]["children"].push_back(this->NodeOf(b, HeadCalibre));
        nodes[ends]["children"].push_back(this->NodeOf(b, TailCalibre));
      }
      const std::size_t above =
        parent < 0 ? 0 : this->NodeOf(static_cast<std::size_t>(parent), TailNode);
      nodes[above]["children"].push_back(this->NodeOf(b, HeadNode));
    }
  }

  /// "pLAD" of "pLAD-2".
  static std::string SegmentOf(const std::string& bone)
  {
    const std::size_t dash = bone.rfind('-');
    return dash == std::string::npos || dash == 0 ? bone : bone.substr(0, dash);
  }

  void AddMaterials()
  {
    const auto material = [](const char* name, const std::array<double, 4>& colour)
    {
      return Json{
        { "name", name }, { "doubleSided", true },
        { "pbrMetallicRoughness",
          { { "baseColorFactor", colour }, { "metallicFactor", 0.0 }, { "roughnessFactor", 0.5 } } }
      };
    };
    this->Json_["materials"] = { material("wall", { 0.65, 0.08, 0.07, 1.0 }),
      material("caps", { 0.8, 0.68, 0.45, 1.0 }) };
  }

  /// Faces of one kind.
  void AddMesh(bool caps, std::vector<std::size_t>& roots)
  {
    Json mesh = { { "name", caps ? "caps" : "wall" }, { "primitives", Json::array() } };
    for (const GltfFace& face : this->Model.faces)
    {
      if (face.cap == caps && !face.triangles.empty())
      {
        mesh["primitives"].push_back(this->Primitive(face));
      }
    }
    if (mesh["primitives"].empty())
    {
      return;
    }
    Json& meshes = this->Json_["meshes"];
    roots.push_back(this->Json_["nodes"].size());
    this->Json_["nodes"].push_back(
      { { "name", caps ? "caps" : "wall" }, { "mesh", meshes.size() }, { "skin", 0 } });
    meshes.push_back(std::move(mesh));
  }

  /// A face with vertices of its own: normals break where it meets the others.
  Json Primitive(const GltfFace& face)
  {
    constexpr auto None = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> local(this->Model.points.size(), None);
    for (const Triangle& t : face.triangles)
    {
      for (const std::int64_t corner : t)
      {
        Require(corner >= 0 && corner < static_cast<std::int64_t>(local.size()),
          "A triangle of a glTF skin has a corner that does not exist");
        local[static_cast<std::size_t>(corner)] = 0;
      }
    }
    std::vector<std::size_t> points;
    for (std::size_t n = 0; n < local.size(); ++n)
    {
      if (local[n] == 0)
      {
        local[n] = static_cast<std::uint32_t>(points.size());
        points.push_back(n);
      }
    }
    Json attributes = this->Attributes(points, NormalsOf(this->Model.points, face.triangles));
    std::vector<std::uint32_t> indices;
    for (const Triangle& t : face.triangles)
    {
      for (const std::int64_t corner : t)
      {
        indices.push_back(local[static_cast<std::size_t>(corner)]);
      }
    }
    this->Data.BeginView(IndexBuffer);
    return { { "attributes", std::move(attributes) }, { "indices", this->Data.Indices(indices) },
      { "material", face.cap ? 1 : 0 }, { "mode", 4 }, { "extras", { { "face", face.name } } } };
  }

  Json Attributes(const std::vector<std::size_t>& points, const std::vector<Vector3>& normals)
  {
    Json attributes = Json::object();
    std::vector<float> positions;
    std::vector<float> directions;
    for (const std::size_t n : points)
    {
      Push(positions, Metres(this->Model.points[n]));
      Push(directions, Axes(normals[n]));
    }
    this->Data.BeginView(VertexBuffer);
    attributes["POSITION"] = this->Data.Floats(positions, 3, true);
    this->Data.BeginView(VertexBuffer);
    attributes["NORMAL"] = this->Data.Floats(directions, 3, false);
    const auto count = static_cast<std::size_t>(this->Skin.Influences());
    for (std::size_t set = 0; 4 * set < count; ++set)
    {
      std::vector<std::uint16_t> joints;
      std::vector<float> weights;
      for (const std::size_t n : points)
      {
        for (std::size_t k = n * count + 4 * set; k < n * count + 4 * set + 4; ++k)
        {
          joints.push_back(this->Skin.Joints()[k]);
          weights.push_back(this->Skin.Weights()[k]);
        }
      }
      this->Data.BeginView(VertexBuffer);
      attributes["JOINTS_" + std::to_string(set)] = this->Data.JointSets(joints);
      this->Data.BeginView(VertexBuffer);
      attributes["WEIGHTS_" + std::to_string(set)] = this->Data.Floats(weights, 4, false);
    }
    return attributes;
  }

  /// Whether the first key has to come again at the end of the period.
  bool Closes() const
  {
    return this->Model.loop && this->Keys.size() > 1 &&
      this->Keys.back().phase < this->Keys.front().phase + this->Model.period * (1.0 - SamePhase);
  }

  /// Seconds of the keys, the last one that of the return to the first.
  std::vector<float> Times() const
  {
    std::vector<float> times;
    for (const GltfKey& key : this->Keys)
    {
      times.push_back(
        static_cast<float>((key.phase - this->Keys[0].phase) * this->Model.cycleLength));
    }
    if (this->Closes())
    {
      times.push_back(static_cast<float>(this->Model.period * this->Model.cycleLength));
    }
    return times;
  }

  void AddAnimation()
  {
    if (this->Keys.empty())
    {
      return;
    }
    std::vector<std::vector<LocalPose>> keys;
    for (const GltfKey& key : this->Keys)
    {
      keys.push_back(this->Nodes.Local(key.motion));
    }
    if (this->Closes())
    {
      keys.push_back(keys.front());
    }
    const std::vector<LocalPose> rest = this->Nodes.Local(this->Nodes.RestMotion());
    this->Data.BeginView(0);
    const std::size_t times = this->Data.Floats(this->Times(), 1, true);
    Json samplers = Json::array();
    Json channels = Json::array();
    this->Data.BeginView(0);
    const auto add = [&](std::size_t n, const char* path, bool always, const auto& valueOf)
    {
      std::vector<float> still;
      Push(still, valueOf(rest[n]));
      const std::size_t components = still.size();
      std::vector<float> values;
      bool moves = always;
      for (const std::vector<LocalPose>& key : keys)
      {
        const std::size_t begin = values.size();
        Push(values, valueOf(key[n]));
        moves = moves ||
          !std::equal(
            still.begin(), still.end(), values.begin() + static_cast<std::ptrdiff_t>(begin));
      }
      if (!moves)
      {
        return;
      }
      channels.push_back(
        { { "sampler", samplers.size() }, { "target", { { "node", n + 1 }, { "path", path } } } });
      samplers.push_back({ { "input", times }, { "interpolation", "LINEAR" },
        { "output", this->Data.Floats(values, components, false) } });
    };
    for (std::size_t n = 0; n < rest.size(); ++n)
    {
      AlignSigns(keys, n);
      add(n, "translation", false, [](const LocalPose& pose) { return pose.translation; });
      add(n, "rotation", false, [](const LocalPose& pose) { return pose.rotation; });
      add(n, "scale", false, [](const LocalPose& pose) { return pose.scale; });
    }
    if (channels.empty()) // an animation has one at least
    {
      add(0, "translation", true, [](const LocalPose& pose) { return pose.translation; });
    }
    this->Json_["animations"] = { { { "name", "heart cycle" }, { "channels", std::move(channels) },
      { "samplers", std::move(samplers) } } };
  }

  /// Of q and -q the one nearer to the key before: not all viewers look for the short way.
  static void AlignSigns(std::vector<std::vector<LocalPose>>& keys, std::size_t n)
  {
    Quaternion before = Quaternion::Identity();
    for (std::vector<LocalPose>& key : keys)
    {
      Quaternion& q = key[n].rotation;
      if (q.dot(before) < 0.0)
      {
        q.coeffs() = -q.coeffs();
      }
      before = q;
    }
  }

  Json Extras() const
  {
    Json phases = Json::array();
    Json deviations = Json::array();
    for (const GltfKey& key : this->Keys)
    {
      phases.push_back(key.phase);
      deviations.push_back(std::round(key.maximumDeviation * 1e6) / 1e6);
    }
    return { { "unit", "m" }, { "axes", "+X left, +Y superior, +Z anterior" },
      { "source_axes", "LPS" }, { "source_unit", "mm" }, { "from_source", "(x, z, -y) / 1000" },
      { "phases", std::move(phases) }, { "cycle_s", this->Model.cycleLength },
      { "cycle_known", this->Model.cycleLengthKnown }, { "closed", this->Closes() },
      { "influences", this->Skin.Influences() },
      { "largest_deviation_mm", std::move(deviations) } };
  }

  const GltfModel& Model;
  const GltfSkin& Skin;
  std::vector<GltfKey> Keys;
  BoneNodes Nodes;
  Json Json_;
  Buffer Data;
};
}

GltfSkin::GltfSkin(const GltfModel& model, int influences)
  : Model(model)
  , Count(influences)
{
  Require(influences >= 4 && influences <= 16 && influences % 4 == 0,
    "The influences of a glTF skin must be 4, 8, 12 or 16, not " + std::to_string(influences));
  CheckModel(model);
  const auto count = static_cast<std::size_t>(influences);
  this->Joint.assign(model.points.size() * count, 0);
  this->Weight.assign(model.points.size() * count, 0.0F);
  std::vector<Share> shares;
  for (std::size_t n = 0; n < model.points.size(); ++n)
  {
    Collect(model, n, shares);
    shares.resize(std::min(shares.size(), count));
    double sum = 0.0;
    for (const Share& share : shares)
    {
      sum += share.first;
    }
    this->Dropped = std::max(this->Dropped, static_cast<float>(1.0 - sum));
    for (std::size_t k = 0; k < shares.size(); ++k)
    {
      const auto weight = static_cast<float>(shares[k].first / sum);
      // The validator wants joint 0 where the weight is 0.
      this->Joint[n * count + k] = weight > 0.0F ? shares[k].second : 0;
      this->Weight[n * count + k] = weight;
    }
  }
}

double GltfSkin::Deviation(
  const std::vector<BoneTransform>& motion, const std::vector<Vector3>& moved) const
{
  Require(motion.size() == this->Model.bones.size() && moved.size() == this->Model.points.size(),
    "The deviation of a glTF skin needs as many bones and points as it has");
  const std::vector<EndMap> maps = EndMaps(this->Model.bones, motion);
  const auto count = static_cast<std::size_t>(this->Count);
  double maximumDistance = 0.0;
  for (std::size_t n = 0; n < moved.size(); ++n)
  {
    Vector3 position = Vector3::Zero();
    for (std::size_t k = n * count; k<(n + 1) * count&& this->Weight[k]> 0.0F; ++k)
    {
      position +=
        static_cast<double>(this->Weight[k]) * maps[this->Joint[k]](this->Model.points[n]);
    }
    maximumDistance = std::max(maximumDistance, (position - moved[n]).norm());
  }
  return maximumDistance;
}

std::string GltfBinary(const GltfModel& model, const GltfSkin& skin)
{
  return Document(model, skin).Binary();
}

std::string GltfText(const GltfModel& model, const GltfSkin& skin)
{
  return Document(model, skin).Text();
}
}
