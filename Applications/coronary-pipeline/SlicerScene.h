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

#include "NrrdSequenceWriter.h"

#include <array>
#include <string>
#include <vector>

namespace coronary
{
/// One thing that moves.
struct SlicerSequence
{
  std::string name;
  std::string file;               ///< its .seq.mrml or .seq.nrrd, relative to the scene
  std::vector<std::string> items; ///< model files relative to `file`; empty for volumes
  std::array<double, 3> color{ 1.0, 1.0, 1.0 };
  double opacity = 1.0;
  std::array<double, 2> window{ 800.0, 200.0 }; ///< of a volume: width and level

  bool IsVolume() const { return this->items.empty(); }
};

/// The inner scene of moving models. @throws std::invalid_argument when items and index values are not as many
std::string SequenceSceneText(const SlicerSequence& sequence, const SequenceIndex& index);

/**
 * The scene: a sequence node with its file and a node that is shown for each sequence, a browser for all of them, and a
 * list of points.
 * @param points  a .mrk.json with one markup, relative to the scene; empty: none
 * @param perCycle  seconds that one play of the cycle takes
 */
std::string SlicerSceneText(const std::vector<SlicerSequence>& sequences,
  const SequenceIndex& index, const std::string& points, double perCycle);
}

#endif
