// Edits by hand: what each does to a tree, what is drawn in an image, and what can not be done.

#include "TreeEdits.h"

#include "CoronaryAnatomy.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace UnitTestTreeEdits
{
using namespace coronary;

namespace
{
constexpr double Trunk = 1.6; // mm, radius
constexpr double Side = 0.9;
constexpr double Fork = 12.0; // mm along the trunk
constexpr double Length = 40.0;
constexpr double Step = 0.5;

/// The trunk goes along x; a side branch leaves it at 35 degrees and bends on, in an arc of 40 mm.
Vector3 SideAt(double s)
{
  const double angle = 35.0 * M_PI / 180.0;
  const double turned = s / 40.0;
  return { Fork + 40.0 * (std::sin(angle + turned) - std::sin(angle)),
    40.0 * (std::cos(angle) - std::cos(angle + turned)), 0.0 };
}

/// @param along  mm from the fork
double DistanceToSide(const Vector3& p, double* along = nullptr)
{
  double best = 0.0;
  const auto search = [&](double from, double to, double step)
  {
    double least = std::numeric_limits<double>::infinity();
    for (double s = std::max(0.0, from); s <= to; s += step)
    {
      const double away = (p - SideAt(s)).norm();
      best = away < least ? s : best;
      least = std::min(least, away);
    }
    return least;
  };
  search(0.0, 30.0, 1.0);
  const double least = search(best - 1.0, best + 1.0, 0.05);
  if (along)
  {
    *along = best;
  }
  return least;
}

/// Tubes of 400 HU in 0 HU, blurred as a scanner does.
struct Scene
{
  static constexpr double Blur = 0.4;
  ImageGrid grid;
  std::vector<float> values;
  std::vector<float> tubes; ///< as a vesselness: bright on the axes
  ScalarImage image;

  /// @param gapFrom, gapTo  mm along the side branch without contrast medium
  Scene(double gapFrom, double gapTo)
  {
    this->grid.spacing = Vector3(0.5, 0.5, 0.6);
    this->grid.extent = { 0, 109, 0, 79, 0, 33 };
    this->grid.origin = Vector3(-6.0, -10.0, -10.0);
    for (int k = 0; k <= 33; ++k)
    {
      for (int j = 0; j <= 79; ++j)
      {
        for (int i = 0; i <= 109; ++i)
        {
          const Vector3 p = this->grid.IndexToWorld(i, j, k);
          const auto inside = [](double wall)
          { return 0.5 * std::erfc(wall / (std::sqrt(2.0) * Blur)); };
          const double trunk = std::hypot(p[1], p[2]);
          double s = 0.0;
          const double side = DistanceToSide(p, &s);
          const bool gap = s > gapFrom && s < gapTo;
          const double bright = std::max(inside(trunk - Trunk), gap ? 0.0 : inside(side - Side));
          this->values.push_back(static_cast<float>(400.0 * bright));
          this->tubes.push_back(static_cast<float>(
            std::max(std::exp(-trunk * trunk / 2.0), gap ? 0.0 : std::exp(-side * side))));
        }
      }
    }
    this->image = { this->values.data(), this->grid };
  }

  EditScene Edits() const { return { &this->image, this->tubes.data(), Blur }; }
};

/// Without a gap.
const Scene& Clear()
{
  static const Scene scene(1e9, 1e9);
  return scene;
}

struct Line
{
  int group;
  int parent;
  int segment;
  double from; ///< mm along the course
  double to;
  std::function<Vector3(double)> course;
  double radius;
};

/// Branches that touch: the first point of a daughter is the nearest one of its parent.
VesselTree TreeOf(const std::vector<Line>& lines)
{
  VesselTree tree;
  for (const Line& line : lines)
  {
    VesselTree::Branch branch;
    branch.groupId = line.group;
    branch.parentGroupId = line.parent;
    branch.segmentId = line.segment;
    double s = line.from;
    if (line.parent >= 0)
    {
      const Vector3 first = line.course(line.from);
      for (const VesselTree::Branch& other : tree.branches)
      {
        if (other.groupId == line.parent)
        {
          branch.points.push_back(*std::min_element(other.points.begin(), other.points.end(),
            [&](std::int64_t a, std::int64_t b)
            { return (tree.points[a] - first).norm() < (tree.points[b] - first).norm(); }));
        }
      }
      s += Step;
    }
    for (; s <= line.to + 1e-9; s += Step)
    {
      branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
      tree.points.push_back(line.course(s));
      tree.radius.push_back(line.radius);
    }
    tree.branches.push_back(branch);
  }
  return tree;
}

Vector3 TrunkAt(double s)
{
  return { s, 0.0, 0.0 };
}

VesselTree OnlyTrunk()
{
  return TreeOf({ { 0, -1, ProximalLCx, 0.0, Length, TrunkAt, Trunk } });
}

/// pLCx, dLCx behind the fork, OM1, and OM2 on OM1.
VesselTree WholeTree()
{
  return TreeOf({ { 0, -1, ProximalLCx, 0.0, Fork, TrunkAt, Trunk },
    { 1, 0, DistalLCx, Fork, Length, TrunkAt, Trunk },
    { 2, 0, FirstObtuseMarginal, 0.0, 24.0, SideAt, Side },
    { 3, 2, SecondObtuseMarginal, 0.0, 10.0,
      [](double s) { return Vector3(SideAt(14.0) + Vector3(0.0, 0.0, s)); }, Side } });
}

double LengthOf(const VesselTree& tree, int segment = -1)
{
  double length = 0.0;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    length += segment < 0 || branch.segmentId == segment ? branch.length : 0.0;
  }
  return length;
}

TreeEdit Edit(EditKind kind, const std::vector<Vector3>& points, const std::string& name = {},
  const std::string& newName = {}, double radius = 0.0)
{
  TreeEdit edit;
  edit.kind = kind;
  edit.points = points;
  edit.name = name;
  edit.newName = newName;
  edit.radius = radius;
  return edit;
}

/// Everything that a tree says is the same, bit by bit.
void ExpectSame(const EditedTree& a, const EditedTree& b)
{
  ASSERT_EQ(a.tree.points.size(), b.tree.points.size());
  for (std::size_t p = 0; p < a.tree.points.size(); ++p)
  {
    EXPECT_EQ(a.tree.points[p], b.tree.points[p]);
  }
  EXPECT_EQ(a.tree.radius, b.tree.radius);
  EXPECT_EQ(a.tree.confidence, b.tree.confidence);
  EXPECT_EQ(a.tree.bridged, b.tree.bridged);
  EXPECT_EQ(a.tree.segmentId, b.tree.segmentId);
  EXPECT_EQ(a.edit, b.edit);
  EXPECT_EQ(a.source, b.source);
  ASSERT_EQ(a.tree.branches.size(), b.tree.branches.size());
  for (std::size_t n = 0; n < a.tree.branches.size(); ++n)
  {
    EXPECT_EQ(a.tree.branches[n].points, b.tree.branches[n].points);
    EXPECT_EQ(a.tree.branches[n].segmentId, b.tree.branches[n].segmentId);
  }
}

/// Of points that were drawn and are `from` mm or more from the trunk's axis: from the side branch's, greatest and mean.
struct Errors
{
  double greatest = 0.0;
  double mean = 0.0;
  double radius = 0.0; ///< mean
  int count = 0;
};

Errors ErrorsOf(const EditedTree& result, double from, double to = 1e9)
{
  Errors errors;
  for (std::size_t p = 0; p < result.tree.points.size(); ++p)
  {
    double s = 0.0;
    const double away = DistanceToSide(result.tree.points[p], &s);
    if (result.source[p] < 0 && result.tree.points[p][1] > from && s < to)
    {
      errors.greatest = std::max(errors.greatest, away);
      errors.mean += away;
      errors.radius += result.tree.radius[p];
      ++errors.count;
    }
  }
  errors.mean /= std::max(errors.count, 1);
  errors.radius /= std::max(errors.count, 1);
  return errors;
}

TEST(TreeEdits, NothingChangesWithoutEdits)
{
  const VesselTree tree = WholeTree();
  const EditedTree result = EditTree(tree, {});
  EXPECT_NEAR(LengthOf(result.tree), 40.0 + 24.0 + 10.0, 1.0);
  EXPECT_EQ(result.tree.points.size(), tree.points.size());
  EXPECT_EQ(result.tree.branches.size(), 5U); // OM1 is split where OM2 leaves
  EXPECT_TRUE(result.notes.empty());
  EXPECT_EQ(*std::max_element(result.edit.begin(), result.edit.end()), 0);
}

TEST(TreeEdits, AddsABranchByClicksBesideItsAxis)
{
  const Scene& scene = Clear();
  // Upstream of the mouth, and 0.8 mm beside the axis.
  const EditedTree result = EditTree(OnlyTrunk(),
    { Edit(EditKind::AddBranch,
      { Vector3(Fork - 3.0, 0.6, 0.5), SideAt(22.0) + Vector3(0.0, 0.0, 0.8) }, "OM1") },
    scene.Edits());
  const Errors errors = ErrorsOf(result, 2.5);
  EXPECT_GT(errors.count, 40);
  EXPECT_LT(errors.mean, 0.12);
  EXPECT_LT(errors.greatest, 0.5);
  EXPECT_NEAR(errors.radius, Side, 0.1 * Side);
  ASSERT_EQ(result.notes.size(), 1U);
  EXPECT_NEAR(result.notes[0].place[0], Fork, 1.0); // where it leaves, not where was clicked
  EXPECT_GT(result.notes[0].seen, 0.85);
  EXPECT_NEAR(LengthOf(result.tree, FirstObtuseMarginal), 22.0, 1.5);
  EXPECT_NEAR(LengthOf(result.tree, ProximalLCx), Length, 0.1);
  EXPECT_EQ(result.tree.branches.size(), 3U);
  for (std::size_t p = 0; p < result.edit.size(); ++p)
  {
    EXPECT_EQ(result.edit[p], result.source[p] < 0 ? 1 : 0);
  }
}

TEST(TreeEdits, OneClickAtTheTipFindsTheWayToTheTree)
{
  const Scene& scene = Clear();
  const EditedTree result =
    EditTree(OnlyTrunk(), { Edit(EditKind::AddBranch, { SideAt(20.0) }, "OM1") }, scene.Edits());
  EXPECT_NEAR(result.notes.at(0).place[0], Fork, 1.0);
  EXPECT_LT(ErrorsOf(result, 2.5).greatest, 0.5);
  EXPECT_NEAR(LengthOf(result.tree, FirstObtuseMarginal), 20.0, 1.5);
}

TEST(TreeEdits, ADarkGapIsCrossedAndMarked)
{
  const Scene scene(8.0, 14.0);
  const EditedTree result = EditTree(OnlyTrunk(),
    { Edit(EditKind::AddBranch, { TrunkAt(Fork), SideAt(23.0) }, "OM1") }, scene.Edits());
  EXPECT_LT(ErrorsOf(result, 2.5).greatest, 1.0);
  double bridged = 0.0;
  double seen = 0.0;
  for (std::size_t p = 0; p < result.tree.points.size(); ++p)
  {
    double s = 0.0;
    DistanceToSide(result.tree.points[p], &s);
    if (result.source[p] < 0 && s > 9.5 && s < 12.5)
    {
      bridged += result.tree.bridged[p];
      seen += 1.0;
    }
    if (result.source[p] < 0 && s > 16.0 && s < 21.0)
    {
      EXPECT_EQ(result.tree.bridged[p], 0) << s;
    }
    EXPECT_EQ(result.tree.bridgeConfidence[p], 1.0);
  }
  EXPECT_GT(bridged / seen, 0.9);
  EXPECT_LT(result.notes.at(0).seen, 0.9);
}

TEST(TreeEdits, ATipGoesOn)
{
  const Scene& scene = Clear();
  VesselTree tree = OnlyTrunk();
  tree.branches[0].points.resize(41); // up to 20 mm
  const EditedTree result =
    EditTree(tree, { Edit(EditKind::AddBranch, { TrunkAt(19.5), TrunkAt(36.0) }) }, scene.Edits());
  EXPECT_NEAR(LengthOf(result.tree, ProximalLCx), 36.0, 1.0); // the name goes on too
  EXPECT_NE(result.notes.at(0).what.find("going on from pLCx"), std::string::npos);
  for (const Vector3& point : result.tree.points)
  {
    EXPECT_LT(std::hypot(point[1], point[2]), 0.3);
  }
}

TEST(TreeEdits, WithoutAnImageVesselsAreStraight)
{
  const EditedTree result = EditTree(OnlyTrunk(),
    { Edit(EditKind::AddBranch, { TrunkAt(12.0), Vector3(12.0, 10.0, 0.0) }, "OM1", {}, 0.7) });
  EXPECT_NEAR(LengthOf(result.tree, FirstObtuseMarginal), 10.0, 1e-9);
  EXPECT_EQ(result.tree.radius.back(), 0.7);
  ExpectRefusal(
    []
    {
      EditTree(
        OnlyTrunk(), { Edit(EditKind::AddBranch, { TrunkAt(12.0), Vector3(12.0, 10.0, 0.0) }) });
    },
    "edit 1 (add-branch)", "radius", "(12.0, 10.0, 0.0)");
}

TEST(TreeEdits, CutTakesAllBehindAPlace)
{
  const EditedTree result =
    EditTree(WholeTree(), { Edit(EditKind::Cut, { SideAt(10.0) + Vector3(0.0, 0.0, 1.0) }) });
  EXPECT_NEAR(LengthOf(result.tree, FirstObtuseMarginal), 10.0, 0.6);
  EXPECT_EQ(LengthOf(result.tree, SecondObtuseMarginal), 0.0);
  EXPECT_NEAR(LengthOf(result.tree, DistalLCx), Length - Fork, 1e-9);
  EXPECT_NEAR(result.notes.at(0).length, 24.0, 0.6);
  EXPECT_EQ(std::count(result.edit.begin(), result.edit.end(), 1), 1);
}

TEST(TreeEdits, DeleteByNameAndByPlace)
{
  const EditedTree byName = EditTree(WholeTree(), { Edit(EditKind::Delete, {}, "OM1") });
  EXPECT_EQ(LengthOf(byName.tree, FirstObtuseMarginal), 0.0);
  EXPECT_EQ(LengthOf(byName.tree, SecondObtuseMarginal), 0.0); // hung on it
  EXPECT_NEAR(LengthOf(byName.tree), Length, 1e-9);
  const EditedTree byPlace =
    EditTree(WholeTree(), { Edit(EditKind::Delete, { SideAt(14.0) + Vector3(0.0, 0.0, 6.0) }) });
  EXPECT_EQ(LengthOf(byPlace.tree, SecondObtuseMarginal), 0.0);
  EXPECT_NEAR(LengthOf(byPlace.tree, FirstObtuseMarginal), 24.0, 0.6);
}

TEST(TreeEdits, RenameWholeVesselsOrOneBranch)
{
  const EditedTree whole = EditTree(WholeTree(), { Edit(EditKind::Rename, {}, "OM1", "D1") });
  EXPECT_NEAR(LengthOf(whole.tree, FirstDiagonal), 24.0, 0.6);
  EXPECT_EQ(LengthOf(whole.tree, FirstObtuseMarginal), 0.0);
  const EditedTree part =
    EditTree(WholeTree(), { Edit(EditKind::Rename, { SideAt(20.0) }, {}, "") });
  EXPECT_NEAR(LengthOf(part.tree, 0), 10.0, 0.6);
  EXPECT_NEAR(LengthOf(part.tree, FirstObtuseMarginal), 14.0, 0.6);
}

TEST(TreeEdits, MoveTakesTheSurroundingsAlong)
{
  TreeEdit edit = Edit(EditKind::Move, { TrunkAt(30.0), TrunkAt(30.0) + Vector3(0.0, 0.0, 3.0) });
  edit.reach = 8.0;
  const EditedTree result = EditTree(WholeTree(), { edit });
  for (std::size_t p = 0; p < result.tree.points.size(); ++p)
  {
    const Vector3& point = result.tree.points[p];
    const double s = std::abs(point[0] - 30.0);
    const bool trunk = std::abs(point[1]) < 1e-9;
    const double wanted = trunk && s < 8.0 ? 1.5 * (1.0 + std::cos(M_PI * s / 8.0)) : 0.0;
    if (trunk)
    {
      EXPECT_NEAR(point[2], wanted, 1e-9);
      EXPECT_EQ(result.edit[p], wanted > 0.0 ? 1 : 0);
    }
  }
  // A fork moves with all that leaves it.
  const EditedTree fork = EditTree(
    WholeTree(), { Edit(EditKind::Move, { TrunkAt(Fork), TrunkAt(Fork) + Vector3(0, 0, 2) }) });
  EXPECT_EQ(fork.tree.branches.size(), 5U);
  EXPECT_NEAR(fork.tree.points[fork.tree.branches[0].points.back()][2], 2.0, 1e-9);
}

TEST(TreeEdits, JoinFeedsAVesselFromAnotherPlace)
{
  // OM2 hung on OM1; its tip is what the dLCx goes on into: it is turned.
  const Vector3 tip = SideAt(14.0) + Vector3(0.0, 0.0, 10.0);
  const EditedTree result =
    EditTree(WholeTree(), { Edit(EditKind::Join, { TrunkAt(Length), tip }, {}, {}, 0.8) });
  ASSERT_EQ(result.notes.size(), 1U);
  const VesselTree& tree = result.tree;
  // One way from the root to where OM2 began, through the joint.
  const auto last = std::find_if(tree.branches.begin(), tree.branches.end(),
    [&](const VesselTree::Branch& branch)
    {
      return (tree.points[branch.points.back()] - SideAt(14.0)).norm() < 1.6 &&
        branch.segmentId == SecondObtuseMarginal;
    });
  ASSERT_NE(last, tree.branches.end());
  double length = 0.0;
  for (const VesselTree::Branch* at = &*last; at;)
  {
    length += at->length;
    const auto parent = std::find_if(tree.branches.begin(), tree.branches.end(),
      [&](const VesselTree::Branch& other) { return other.groupId == at->parentGroupId; });
    at = at->parentGroupId < 0 ? nullptr : &*parent;
  }
  EXPECT_NEAR(length, Length + (TrunkAt(Length) - tip).norm() + 10.0, 1.5);
  EXPECT_NEAR(LengthOf(tree, FirstObtuseMarginal), 24.0, 0.6); // as it was
  // In the middle: both halves hang on the place.
  const Vector3 middle = SideAt(14.0) + Vector3(0.0, 0.0, 5.0);
  const EditedTree halves =
    EditTree(WholeTree(), { Edit(EditKind::Join, { TrunkAt(Length), middle }, {}, {}, 0.8) });
  EXPECT_EQ(halves.tree.branches.size(), result.tree.branches.size() + 1);
}

TEST(TreeEdits, JoinAcrossAGapInTheImage)
{
  const Scene scene(9.0, 12.0);
  // What lies behind the gap hangs on the trunk's end, wrongly.
  const VesselTree tree = TreeOf({ { 0, -1, ProximalLCx, 0.0, Length, TrunkAt, Trunk },
    { 1, 0, FirstObtuseMarginal, 0.0, 8.5, SideAt, Side },
    { 2, 0, SecondObtuseMarginal, 0.0, 11.5,
      [](double s) { return s < 0.25 ? TrunkAt(Length) : SideAt(24.5 - s); }, Side } });
  const EditedTree result =
    EditTree(tree, { Edit(EditKind::Join, { SideAt(8.5), SideAt(13.0) }) }, scene.Edits());
  EXPECT_LT(ErrorsOf(result, 2.5).greatest, 0.8);
  EXPECT_EQ(result.tree.branches.size(), 5U);
  double length = 0.0;
  for (const VesselTree::Branch& branch : result.tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      EXPECT_LT(
        (result.tree.points[branch.points[i]] - result.tree.points[branch.points[i - 1]]).norm(),
        1.2);
    }
    length += branch.length;
  }
  EXPECT_NEAR(length, Length + 24.0, 1.5);
}

TEST(TreeEdits, TheLastOneIsUndoneByLeavingItOut)
{
  const Scene& scene = Clear();
  const std::vector<TreeEdit> edits = { Edit(EditKind::AddBranch, { TrunkAt(Fork), SideAt(22.0) },
                                          "OM1"),
    Edit(EditKind::Cut, { TrunkAt(30.0) }), Edit(EditKind::Rename, {}, "OM1", "OM2"),
    Edit(EditKind::Move, { SideAt(15.0), SideAt(15.0) + Vector3(0.0, 0.0, 0.4) }) };
  for (std::size_t count = 1; count < edits.size(); ++count)
  {
    const std::vector<TreeEdit> some(edits.begin(), edits.begin() + static_cast<long>(count));
    ExpectSame(
      EditTree(OnlyTrunk(), some, scene.Edits()), EditTree(OnlyTrunk(), some, scene.Edits()));
  }
  const EditedTree all = EditTree(OnlyTrunk(), edits, scene.Edits());
  EXPECT_EQ(all.notes.size(), 4U);
  EXPECT_NEAR(LengthOf(all.tree, SecondObtuseMarginal), 22.0, 1.5);
}

TEST(TreeEdits, MaskBalls)
{
  ImageGrid grid;
  grid.extent = { 3, 42, 0, 39, 0, 39 };
  grid.spacing = Vector3(0.5, 0.5, 0.5);
  grid.origin = Vector3(-10.0, -10.0, -10.0);
  std::vector<unsigned char> mask(40 * 40 * 40, 0);
  const auto count = [&] { return std::count(mask.begin(), mask.end(), 1); };
  std::vector<TreeEdit> edits = { Edit(
    EditKind::Paint, { Vector3(1.0, 0.0, 0.0), Vector3(3.0, 0.0, 0.0) }, {}, {}, 3.0) };
  EditMask(grid, mask.data(), edits);
  // Two balls that overlap, less what they share.
  const double wanted = 2.0 * 4.0 / 3.0 * M_PI * 27.0 - M_PI * (4.0 * 3.0 + 2.0) * 16.0 / 12.0;
  EXPECT_NEAR(0.125 * static_cast<double>(count()), wanted, 0.03 * wanted);
  const auto painted = mask;
  edits.push_back(Edit(EditKind::Erase, { Vector3(3.0, 0.0, 0.0) }, {}, {}, 3.0));
  std::fill(mask.begin(), mask.end(), 0);
  const std::vector<EditNote> notes = EditMask(grid, mask.data(), edits);
  EXPECT_EQ(notes.size(), 2U);
  EXPECT_EQ(notes[1].number, 2);
  EXPECT_LT(count(), std::count(painted.begin(), painted.end(), 1) - 800);
  // A ball smaller than a voxel is one voxel.
  std::fill(mask.begin(), mask.end(), 0);
  EditMask(grid, mask.data(), { Edit(EditKind::Paint, { Vector3(0.1, 0.1, 0.1) }, {}, {}, 0.05) });
  EXPECT_EQ(count(), 1);
  ExpectRefusal(
    [&]
    {
      EditMask(
        grid, mask.data(), { Edit(EditKind::Paint, { Vector3(50.0, 0.0, 0.0) }, {}, {}, 1.0) });
    },
    "edit 1 (paint)", "(50.0, 0.0, 0.0)", "outside");
  ExpectRefusal(
    [&]
    {
      EditMask(
        grid, mask.data(), { Edit(EditKind::Erase, { Vector3(6.0, 6.0, 6.0) }, {}, {}, 1.0) });
    },
    "edit 1 (erase)", "(6.0, 6.0, 6.0)");
}

TEST(TreeEdits, WhatCanNotBeDoneIsSaidWithThePlace)
{
  const auto refuse = [](const TreeEdit& edit, const auto&... parts)
  { ExpectRefusal([&] { EditTree(WholeTree(), { edit }); }, "edit 1", parts...); };
  refuse(Edit(EditKind::Cut, { Vector3(5.0, 0.0, 20.0) }), "(cut)", "(5.0, 0.0, 20.0)",
    "nearest is pLCx", "20 mm away");
  refuse(Edit(EditKind::Cut, { TrunkAt(Length) }), "tip of dLCx", "(40.0, 0.0, 0.0)");
  refuse(Edit(EditKind::Cut, { TrunkAt(0.0) }), "begin", "(0.0, 0.0, 0.0)");
  refuse(Edit(EditKind::Delete, {}, "D2"), "no D2", "pLCx", "OM1");
  refuse(Edit(EditKind::Delete, {}, "XYZ"), "'XYZ' is no SCCT name", "R-PDA");
  refuse(Edit(EditKind::Delete, {}, "pLCx"), "nothing would be left");
  refuse(Edit(EditKind::Rename, {}, "OM1", "OM1"), "already");
  refuse(Edit(EditKind::Move, { TrunkAt(5.0), Vector3(5.0, 0.0, 30.0) }, {}, {}, 1.0),
    "no use for a radius");
  TreeEdit far = Edit(EditKind::Move, { TrunkAt(5.0), Vector3(5.0, 0.0, 30.0) });
  far.reach = 10.0;
  refuse(far, "(5.0, 0.0, 0.0)", "30 mm", "fold");
  refuse(Edit(EditKind::Join, { SideAt(20.0), TrunkAt(5.0) }), "loop", "hangs on");
  refuse(Edit(EditKind::Join, { TrunkAt(5.0) }), "2 points, not 1");
  refuse(Edit(EditKind::Paint, { TrunkAt(5.0) }), "radius");
  refuse(Edit(EditKind::Cut, { Vector3(std::nan(""), 0.0, 0.0) }), "three numbers");
  const Scene& scene = Clear();
  const auto refuseDrawn = [&](const TreeEdit& edit, const auto&... parts)
  { ExpectRefusal([&] { EditTree(WholeTree(), { edit }, scene.Edits()); }, "edit 1", parts...); };
  refuseDrawn(Edit(EditKind::AddBranch, { TrunkAt(5.0), Vector3(5.0, 90.0, 0.0) }),
    "(5.0, 90.0, 0.0)", "outside the image");
  refuseDrawn(Edit(EditKind::AddBranch, { TrunkAt(5.0) }), "in pLCx already");
  refuseDrawn(Edit(EditKind::AddBranch, { TrunkAt(Fork), SideAt(20.0) }), "OM1", "already");
  refuseDrawn(Edit(EditKind::AddBranch, { TrunkAt(28.0), Vector3(28.0, -8.0, 5.0) }),
    "shows no vessel", "(28.0, -8.0, 5.0)");
}
}
}
