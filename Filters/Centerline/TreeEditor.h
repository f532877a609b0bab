/**
 * @file TreeEditor.h
 * @brief A tree at which one edit after the other is made. Not installed: TreeEdits.h is what others call.
 */
#ifndef DynamicCoronary_TreeEditor_h
#define DynamicCoronary_TreeEditor_h

#include "TreeEdits.h"
#include "VesselDrawing.h"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
/// The segment id of an SCCT name; 0: there is none.
int SegmentOf(const std::string& name);

/// "pRCA, mRCA, ..."
std::string AllSegmentNames();

/// @throws std::invalid_argument  "edit N (KIND): WHAT"
[[noreturn]] void FailEdit(const TreeEdit& edit, int number, const std::string& what);

/// CheckEdit, whose message gets the number. @throws std::invalid_argument
void CheckNumbered(const TreeEdit& edit, int number);

class TreeEditor
{
public:
  /// @param scene  must outlive this @throws std::invalid_argument as CheckTree
  TreeEditor(const VesselTree& tree, const EditScene& scene);
  ~TreeEditor();
  TreeEditor(const TreeEditor&) = delete;
  TreeEditor& operator=(const TreeEditor&) = delete;

  /// @throws std::invalid_argument as EditTree
  void Apply(const TreeEdit& edit, int number, const ProgressCallback& progress);

  /// Measures what is new, and lets go what is not used any more.
  EditedTree Finish(const ProgressCallback& progress);

private:
  /// A point of a branch. A shared one is the parent's.
  struct Place
  {
    std::size_t branch = 0;
    std::size_t at = 0;
    double distance = 0.0; ///< mm from where it was asked for
  };

  [[noreturn]] void Fail(const std::string& what) const;
  std::string NameOf(std::size_t branch) const;
  std::int64_t PointOf(const Place& place) const;
  double LengthOf(std::size_t branch, std::size_t from = 0) const;
  bool IsTip(std::size_t branch) const;
  /// @param segment  of branches that count; 0: all
  Place Nearest(const Vector3& position, int segment) const;
  /// The nearest one, if it is near enough.
  Place Find(const Vector3& position, int segment = 0) const;
  /// Of a name that has to be in the tree; 0 of an empty one.
  int KnownSegment(const std::string& name) const;
  /// The branches that an edit means by name or by place.
  std::vector<std::size_t> Meant() const;

  void Cut();
  void Delete();
  void Rename();
  void Move();
  void Join(const ProgressCallback& progress);
  void AddBranch(const ProgressCallback& progress);

  /// Marks a branch and what hangs on it. @return mm
  double MarkBelow(std::size_t branch, std::vector<char>& marked) const;
  void Remove(const std::vector<char>& gone);
  std::vector<double> DistancesFrom(std::int64_t point) const;
  /// Point of the tree in whose lumen a place is; -1: none.
  std::int64_t LumenAt(const Vector3& place) const;
  VesselDrawing& Drawing();
  /// From A, perhaps not the right one, along the places. @param start  of the path on return: the tree's point
  /// @param goesOn  whether it goes on from a tip, as was known before and as it turned out
  MeasuredPath Draw(std::int64_t& start, bool& goesOn, const std::vector<Vector3>& places,
    const ProgressCallback& progress);
  MeasuredPath DrawStraight(std::int64_t start, const std::vector<Vector3>& places) const;
  /// @return whether it goes on from a tip
  bool JoinToParent(MeasuredPath& path, std::int64_t& start);
  /// A branch of new points. @param end  of the tree, -1: it ends by itself @return its group
  int Append(const MeasuredPath& path, std::int64_t start, std::int64_t end, int segment);
  /// The end that is meant by a place near it. @return whether it is a tip
  bool GoesOn(Place& place) const;
  /// Parents first, branches that touch at their ends only.
  void Normalise();
  void Note(const std::string& what, const Vector3& place, double length, double seen = 1.0);

  VesselTree Tree;
  std::vector<std::int64_t> Source;
  std::vector<int> Edits;
  std::vector<char> Fresh; ///< points whose radius is to be measured
  std::vector<char>
    Ends; ///< branches that a way leads to: it does not leave the tree there; empty: none
  std::vector<EditNote> Notes;
  const EditScene& Scene;
  std::unique_ptr<VesselDrawing> Drawer;
  const TreeEdit* Now = nullptr;
  int Number = 0;
};
}

#endif
