/**
 * @file GltfEvaluator.h
 * @brief What a viewer makes of a skinned .glb file, after the specification alone, for the tests.
 */
#ifndef DynamicCoronary_GltfEvaluator_h
#define DynamicCoronary_GltfEvaluator_h

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

class GltfEvaluator
{
public:
  explicit GltfEvaluator(const std::string& glb)
  {
    const auto word = [&](std::size_t at)
    {
      std::uint32_t value = 0;
      std::memcpy(&value, glb.data() + at, sizeof(value));
      return value;
    };
    if (glb.compare(0, 4, "glTF") != 0 || word(4) != 2 || word(8) != glb.size())
    {
      throw std::runtime_error("no .glb file");
    }
    this->Document = nlohmann::json::parse(glb.substr(20, word(12)));
    const std::size_t data = 20 + word(12);
    this->Data = glb.substr(data + 8, word(data));
  }

  nlohmann::json Document;
  std::string Data;

  /// All numbers of an accessor one after the other.
  std::vector<double> Values(std::size_t accessor) const
  {
    const auto& a = this->Document["accessors"][accessor];
    const auto& view = this->Document["bufferViews"][a["bufferView"].get<std::size_t>()];
    const std::string type = a["type"];
    const std::size_t components = type == "SCALAR" ? 1
      : type == "VEC3"                              ? 3
      : type == "VEC4"                              ? 4
                                                    : 16;
    const int kind = a["componentType"];
    const std::size_t size = kind == 5123 ? 2 : 4;
    std::size_t at = view["byteOffset"].get<std::size_t>() + a["byteOffset"].get<std::size_t>();
    std::vector<double> values(a["count"].get<std::size_t>() * components);
    for (double& value : values)
    {
      std::uint32_t bits = 0;
      std::memcpy(&bits, this->Data.data() + at, size);
      float number = 0.0F;
      std::memcpy(&number, &bits, sizeof(number));
      value = kind == 5126 ? static_cast<double>(number) : static_cast<double>(bits);
      at += size;
    }
    return values;
  }

  /// Seconds of the keys.
  std::vector<double> Times() const
  {
    return this->Values(this->Document["animations"][0]["samplers"][0]["input"]);
  }

  const nlohmann::json& Attributes(const std::string& mesh, std::size_t primitive = 0) const
  {
    for (const auto& each : this->Document["meshes"])
    {
      if (each["name"] == mesh)
      {
        return each["primitives"][primitive]["attributes"];
      }
    }
    throw std::runtime_error("no mesh " + mesh);
  }

  /// Vertices of a primitive at a key, moved by its skin, in LPS and mm; -1: at rest, without the skin.
  std::vector<Eigen::Vector3d> Vertices(
    const std::string& mesh, int key, std::size_t primitive = 0) const
  {
    const auto& attributes = this->Attributes(mesh, primitive);
    const std::vector<double> positions = this->Values(attributes["POSITION"]);
    std::vector<Eigen::Vector3d> result;
    std::vector<Eigen::Affine3d> joints;
    if (key >= 0)
    {
      joints = this->JointMatrices(static_cast<std::size_t>(key));
    }
    for (std::size_t n = 0; 3 * n < positions.size(); ++n)
    {
      result.emplace_back(positions[3 * n], positions[3 * n + 1], positions[3 * n + 2]);
    }
    std::vector<Eigen::Vector3d> moved(result.size(), Eigen::Vector3d::Zero());
    for (int set = 0; key >= 0 && attributes.contains("JOINTS_" + std::to_string(set)); ++set)
    {
      const std::vector<double> index = this->Values(attributes["JOINTS_" + std::to_string(set)]);
      const std::vector<double> weight = this->Values(attributes["WEIGHTS_" + std::to_string(set)]);
      for (std::size_t k = 0; k < index.size(); ++k)
      {
        moved[k / 4] += weight[k] * (joints.at(static_cast<std::size_t>(index[k])) * result[k / 4]);
      }
    }
    for (Eigen::Vector3d& p : key >= 0 ? moved : result)
    {
      p = 1000.0 * Eigen::Vector3d(p[0], -p[2], p[1]);
    }
    return key >= 0 ? moved : result;
  }

private:
  std::vector<Eigen::Affine3d> JointMatrices(std::size_t key) const
  {
    nlohmann::json nodes = this->Document["nodes"];
    const auto& animation = this->Document["animations"][0];
    for (const auto& channel : animation["channels"])
    {
      const std::string path = channel["target"]["path"];
      const std::size_t components = path == "rotation" ? 4 : 3;
      const std::vector<double> values =
        this->Values(animation["samplers"][channel["sampler"].get<std::size_t>()]["output"]);
      const auto* first = values.data() + components * key;
      nodes[channel["target"]["node"].get<std::size_t>()][path] =
        std::vector<double>(first, first + components);
    }
    std::vector<Eigen::Affine3d> global(nodes.size(), Eigen::Affine3d::Identity());
    this->Descend(nodes, this->Document["scenes"][0]["nodes"], Eigen::Affine3d::Identity(), global);
    const auto& skin = this->Document["skins"][0];
    const std::vector<double> inverse = this->Values(skin["inverseBindMatrices"]);
    std::vector<Eigen::Affine3d> result;
    for (const std::size_t joint : skin["joints"])
    {
      Eigen::Affine3d bind;
      bind.matrix() = Eigen::Map<const Eigen::Matrix4d>(inverse.data() + 16 * result.size());
      result.push_back(global[joint] * bind);
    }
    return result;
  }

  void Descend(const nlohmann::json& nodes, const nlohmann::json& children,
    const Eigen::Affine3d& parent, std::vector<Eigen::Affine3d>& global) const
  {
    for (const std::size_t n : children)
    {
      const auto t = nodes[n].value("translation", std::vector<double>{ 0, 0, 0 });
      const auto r = nodes[n].value("rotation", std::vector<double>{ 0, 0, 0, 1 });
      const auto s = nodes[n].value("scale", std::vector<double>{ 1, 1, 1 });
      global[n] = parent * Eigen::Translation3d(t[0], t[1], t[2]) *
        Eigen::Quaterniond(r[3], r[0], r[1], r[2]) * Eigen::Scaling(s[0], s[1], s[2]);
      this->Descend(nodes, nodes[n].value("children", nlohmann::json::array()), global[n], global);
    }
  }
};

#endif
