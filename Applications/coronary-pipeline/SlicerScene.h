/**
 * @file SlicerScene.h
 * @brief Scenes of 3D Slicer (.mrml) with things that move.
 *
 * Slicer keeps what moves in a sequence node: a scene of its own inside of the scene, with one data node for each value of an
 * index. In files that inner scene is a .seq.mrml (or, packed, a .seq.mrb); volumes are one .seq.nrrd. A sequence
 * browser plays sequences together: it copies the chosen item of each into a node that is shown.
 */
#ifndef DynamicCoronary_SlicerScene_h
#define DynamicCoronary_SlicerScene_h

#include "Geometry.h"
#include "NrrdSequenceWriter.h"

#include <array>
#include <string>
#include <vector>

namespace coronary
{
/// x -> matrix x + shift, LPS, mm.
struct AffineMotion
{
  Matrix3 matrix = Matrix3::Identity();
  Vector3 shift = Vector3::Zero();
  double left = 0.0; ///< mm that the points are off from it, root mean square
};

/// What stands still beside it: files relative to the scene; empty: none.
struct SlicerStill
{
  std::string points;       ///< a .mrk.json with one markup
  std::string segmentation; ///< a .seg.nrrd
};

/// One thing that moves.
struct SlicerSequence
{
  std::string name;
  std::string file;               ///< its .seq.mrml or .seq.nrrd, relative to the scene
  std::vector<std::string> items; ///< model files relative to `file`; empty for volumes
  std::array<double, 3> color{ 1.0, 1.0, 1.0 };
  double opacity = 1.0;
  std::array<double, 2> window{ 800.0, 200.0 }; ///< of a volume: width and level
  std::vector<AffineMotion> transforms; ///< of a moving transform, in place of files; else empty

  bool IsTransform() const { return !this->transforms.empty(); }
  bool IsVolume() const { return this->items.empty() && !this->IsTransform(); }
};

/**
 * The affine motion that brings points nearest to where they are now, least squares. In directions in which the points
 * have no extent nothing is stretched.
 * @throws std::invalid_argument: no points, or not as many as there are now
 */
AffineMotion FitAffineMotion(const std::vector<Vector3>& rest, const std::vector<Vector3>& now);

/// The inner scene of what moves. @throws std::invalid_argument when items and index values are not as many
std::string SequenceSceneText(const SlicerSequence& sequence, const SequenceIndex& index);

/**
 * The scene: a sequence node with its file and a node that is shown for each sequence, a browser for all of them, and
 * what stands still.
 * @param perCycle  seconds that one play of the cycle takes
 */
std::string SlicerSceneText(const std::vector<SlicerSequence>& sequences,
  const SequenceIndex& index, const SlicerStill& still, double perCycle);
}

#endif
