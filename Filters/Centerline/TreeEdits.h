/**
 * @file TreeEdits.h
 * @brief What a person corrects by hand in a tree and in its mask: a list of edits in physical coordinates and names.
 *
 * A list is applied from its beginning to the tree that was found; so the last one is undone by leaving it out. Nothing
 * of an edit depends on numbers of points or branches, which are others when the tree is made anew.
 */
#ifndef DynamicCoronary_TreeEdits_h
#define DynamicCoronary_TreeEdits_h

#include "Geometry.h"
#include "ParallelFor.h"
#include "ScalarImage.h"
#include "VesselTree.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
enum class EditKind
{
  AddBranch, ///< a vessel along the points, from the tree to its tip
  Cut,       ///< all behind a place goes
  Delete,    ///< a vessel goes, with all that hangs on it
  Join,      ///< the vessel at the first point goes on into the one at the second
  Rename,    ///< another SCCT name
  Move,      ///< the axis at the first point goes to the second, its surroundings with it
  Paint,     ///< balls that are added to the mask
  Erase      ///< balls that are taken out of it
};

/// "add-branch", "cut", ..
const char* EditKindName(EditKind kind);

/// All kinds, in their order.
const std::vector<EditKind>& EditKinds();

/// Whether it changes the mask, and not the tree.
inline bool IsMaskEdit(EditKind kind)
{
  return kind == EditKind::Paint || kind == EditKind::Erase;
}

struct TreeEdit
{
  EditKind kind = EditKind::AddBranch;
  std::vector<Vector3> points; ///< mm, LPS
  std::string name;            ///< SCCT name: of the vessel, or of a new one; may be empty
  std::string newName;         ///< of Rename; empty: no name
  double radius =
    0.0; ///< mm: of a ball; of a new vessel where the image does not tell, 0: it has to
  double reach = 0.0; ///< mm along the tree that move too; 0: 10 mm, and twice the way
};

/// @throws std::invalid_argument: points are too few or too many or not finite, a name is none of the SCCT model, a
///   length is out of range, or something is given that the kind has no use for
void CheckEdit(const TreeEdit& edit);

/// One line: "add-branch OM2 (1.0, 2.0, 3.0) (4.0, 5.0, 6.0)".
std::string DescribeEdit(const TreeEdit& edit);

/// Where vessels are looked for that a person draws. Not owned.
struct EditScene
{
  const ScalarImage* image = nullptr; ///< null: vessels are drawn straight, with a given radius
  /// On the image's voxels, greatest on axes; null: the image alone. With it ways do not cut through chambers.
  const float* vesselness = nullptr;
  double blur = 0.0; ///< standard deviation of the image's blur, mm; 0: 0.8 voxels
};

/// What an edit did.
struct EditNote
{
  int number = 0;                  ///< of the edit, from 1
  std::string what;                ///< a line: "OM2 added to pLCx: 31 mm, seen along 97 %"
  Vector3 place = Vector3::Zero(); ///< mm, where on the tree
  double length = 0.0;             ///< mm of vessel that came, went, moved or was renamed
  double seen = 1.0;               ///< share of an added vessel that the image shows, 0 to 1
};

struct EditedTree
{
  VesselTree tree; ///< split at its bifurcations; `bridged` where a drawn vessel is not seen
  std::vector<std::int64_t> source; ///< of each point: that of the given tree, -1: a new one
  std::vector<int>
    edit; ///< of each point: the last edit that made, moved or named it, from 1; 0: none
  std::vector<EditNote> notes; ///< one an edit of the tree
};

/**
 * Applies the edits of the tree one after the other; those of the mask do nothing here. Names are those of the branches'
 * segment ids; the first point of a daughter is its parent's. Deterministic, the same on any number of threads.
 * @param tree  a forest; `confidence`, `bridged`, `bridgeConfidence` and `segmentId` may be empty
 * @throws std::invalid_argument "edit N (KIND): ..", with the place: no vessel is near, a name is not in the tree, the
 *   image shows none, nothing would be left; as CheckEdit and CheckTree; Cancelled
 */
EditedTree EditTree(const VesselTree& tree, const std::vector<TreeEdit>& edits,
  const EditScene& scene = {}, const ProgressCallback& progress = {});

/**
 * Applies the edits of the mask, in their order: voxels whose centre lies in a ball.
 * @param mask  one value a voxel of the grid, 0: no vessel; painted voxels are 1
 * @return a note an edit of the mask
 * @throws std::invalid_argument "edit N (KIND): ..", with the place: a ball is outside the image, or changes nothing;
 *   as CheckEdit
 */
std::vector<EditNote> EditMask(
  const ImageGrid& grid, unsigned char* mask, const std::vector<TreeEdit>& edits);
}

#endif
