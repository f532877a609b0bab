/**
 * @file GltfSkin.h
 * @brief A beating surface on its bones as glTF 2.0: one mesh, a skin and an animation.
 *
 * Source: Khronos Group, "glTF 2.0 Specification" (ISO/IEC 12113:2022), chapters 3.7 (meshes, skins) and
 * 3.11 (animations). docs/exchange.md says how bones become nodes.
 *
 * glTF moves a point by the mean of matrices, weighted: linear blending. A bone that stretches is no one matrix,
 * since beyond its ends it is rigid. It is the mean of two, one that is rigid about its first joint and one about
 * its second, with the place along the bone as weight. So a bone has two nodes, and what hangs on it is shared
 * between them; positions at the keys are those of coronary::SkinDeformation's linear blend, also with factors of the
 * calibre. Twist along a bone is blended linearly, which is right for small angles.
 *
 * LPS (x, y, z) in mm becomes (x, z, -y) / 1000: metres, +Y superior, +Z anterior, +X left.
 */
#ifndef DynamicCoronary_GltfSkin_h
#define DynamicCoronary_GltfSkin_h

#include "BiharmonicSkinWeights.h"
#include "Geometry.h"
#include "RestBone.h"
#include "SkeletonPose.h"

#include <string>
#include <vector>

namespace coronary
{
/// Triangles that have a name. All that have the same `cap` become one mesh, each a primitive of it with its own vertices,
/// which are the points in their order as far as the face has them.
struct GltfFace
{
  std::string name;
  bool cap = false;
  std::vector<Triangle> triangles; ///< of GltfModel::points, outwards
};

/// A moment of the cycle.
struct GltfKey
{
  double phase = 0.0;                ///< in units of the cycle
  std::vector<BoneTransform> motion; ///< one a bone
  /// Of the nodes' blend from the moved surface, as GltfSkin::Deviation tells; goes into `extras`.
  double maximumDeviation = 0.0; ///< mm
};

struct GltfModel
{
  std::string name = "coronaries";
  std::vector<Vector3> points; ///< at rest, LPS, mm
  CompactSkinWeights weights;  ///< of the points; a point's are divided by their sum
  std::vector<RestBone> bones;
  std::vector<GltfFace> faces;
  std::vector<GltfKey> keys;    ///< by increasing phases
  double cycleLength = 1.0;     ///< seconds a unit of phase, > 0
  bool cycleLengthKnown = true; ///< else noted in `extras`
  double period = 1.0;          ///< of the motion in units of phase, > 0
  bool loop =
    true; ///< with two keys or more: the first one again after a period, unless there is one
};

/// The weights of nodes, and what they do.
class GltfSkin
{
public:
  /**
   * @param model       what follows from its points, weights and bones is found here
   * @param influences  nodes that a point may hang on: 4, 8, 12 or 16; the greatest weights stay, with sum 1
   * @throws std::invalid_argument: sizes that do not fit, an index that does not exist, a point without weight, a bone
   * without length, a value that is not finite, more than 32,767 bones, another number of influences
   */
  GltfSkin(const GltfModel& model, int influences);

  int Influences() const { return this->Count; }
  /// Per point: numbers of nodes, 2 bone (first joint) or 2 bone + 1 (second joint), greatest weight first; 0 if unused.
  const std::vector<std::uint16_t>& Joints() const { return this->Joint; }
  const std::vector<float>& Weights() const
  {
    return this->Weight;
  }                                                      ///< sum of a point 1; 0 if unused
  float MaximumDropped() const { return this->Dropped; } ///< sum of weights left out at a point

  /**
   * The greatest distance of the points, as the nodes place them, from given ones, mm.
   * @param motion  one a bone
   * @param moved   as many as the model's points, mm
   * @throws std::invalid_argument for other numbers of them
   */
  double Deviation(
    const std::vector<BoneTransform>& motion, const std::vector<Vector3>& moved) const;

private:
  const GltfModel& Model;
  int Count;
  std::vector<std::uint16_t> Joint;
  std::vector<float> Weight;
  float Dropped = 0.0F;
};

///@{
/**
 * The model as a file: .glb, or .gltf with its data inside (base64). The same model gives the same bytes.
 * @throws std::invalid_argument: no points or triangles, a key with another number of bones, phases that do
 * not increase, a cycle or period that is not positive, more than 4 GiB of data
 */
std::string GltfBinary(const GltfModel& model, const GltfSkin& skin);
std::string GltfText(const GltfModel& model, const GltfSkin& skin);
///@}
}

#endif
