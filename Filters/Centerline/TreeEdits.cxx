#include "TreeEdits.h"

#include "CoronaryAnatomy.h"
#include "CurveSmoothing.h"
#include "GridIndex.h"
#include "PlaceText.h"
#include "Require.h"
#include "TreeEditor.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double LargestBall = 50.0;   ///< mm
constexpr double LargestReach = 200.0; ///< mm

/// Of a list of edits: how many points each kind takes.
struct PointCount
{
  std::size_t least;
  std::size_t most;
};

PointCount PointsOf(const TreeEdit& edit)
{
  switch (edit.kind)
  {
    case EditKind::AddBranch:
      return { 1, 1000 };
    case EditKind::Cut:
      return { 1, 1 };
    case EditKind::Delete:
    case EditKind::Rename:
      return { edit.name.empty() ? 1U : 0U, 1 };
    case EditKind::Join:
    case EditKind::Move:
      return { 2, 2 };
    case EditKind::Paint:
    case EditKind::Erase:
      return { 1, 1000 };
  }
  return { 0, 0 };
}
}

const char* EditKindName(EditKind kind)
{
  switch (kind)
  {
    case EditKind::AddBranch:
      return "add-branch";
    case EditKind::Cut:
      return "cut";
    case EditKind::Delete:
      return "delete";
    case EditKind::Join:
      return "join";
    case EditKind::Rename:
      return "rename";
    case EditKind::Move:
      return "move";
    case EditKind::Paint:
      return "paint";
    case EditKind::Erase:
      return "erase";
  }
  return "";
}

const std::vector<EditKind>& EditKinds()
{
  static const std::vector<EditKind> kinds = { EditKind::AddBranch, EditKind::Cut, EditKind::Delete,
    EditKind::Join, EditKind::Rename, EditKind::Move, EditKind::Paint, EditKind::Erase };
  return kinds;
}

void CheckEdit(const TreeEdit& edit)
{
  const std::string kind = EditKindName(edit.kind);
  const auto [least, most] = PointsOf(edit);
  const std::size_t count = edit.points.size();
  if (count < least || count > most)
  {
    const std::string wanted = least == most ? std::to_string(least)
      : count < least                        ? "at least " + std::to_string(least)
                                             : "at most " + std::to_string(most);
    throw std::invalid_argument(kind + " needs " + wanted +
      (wanted == "1" || wanted == "at least 1" ? " point" : " points") + ", not " +
      std::to_string(count) +
      (least == 1 && most == 1 && (edit.kind == EditKind::Delete || edit.kind == EditKind::Rename)
          ? ", or the name of a vessel"
          : ""));
  }
  for (const Vector3& point : edit.points)
  {
    Require(point.allFinite() && point.cwiseAbs().maxCoeff() <= 1e5,
      kind + ": a point is not three numbers of at most 1e5 mm");
  }
  const bool named = edit.kind == EditKind::AddBranch || edit.kind == EditKind::Cut ||
    edit.kind == EditKind::Delete || edit.kind == EditKind::Rename;
  Require(named || edit.name.empty(), kind + " has no use for a name");
  Require(
    edit.kind == EditKind::Rename || edit.newName.empty(), kind + " has no use for a new name");
  for (const std::string& name : { edit.name, edit.newName })
  {
    Require(name.empty() || SegmentOf(name) > 0,
      kind + ": '" + name + "' is no SCCT name; known are " + AllSegmentNames());
  }
  const bool ball = IsMaskEdit(edit.kind);
  Require(!ball || (edit.radius > 0.0 && edit.radius <= LargestBall),
    kind + ": the radius must be above 0 and at most 50 mm");
  Require(ball || (edit.radius >= 0.0 && edit.radius <= LargestBall),
    kind + ": the radius must be from 0 to 50 mm");
  Require(
    ball || edit.kind == EditKind::AddBranch || edit.kind == EditKind::Join || edit.radius == 0.0,
    kind + " has no use for a radius");
  Require(
    edit.reach >= 0.0 && edit.reach <= LargestReach, kind + ": the reach must be from 0 to 200 mm");
  Require(edit.kind == EditKind::Move || edit.reach == 0.0, kind + " has no use for a reach");
}

std::string DescribeEdit(const TreeEdit& edit)
{
  std::string text = EditKindName(edit.kind);
  if (!edit.name.empty())
  {
    text += " " + edit.name;
  }
  if (edit.kind == EditKind::Rename)
  {
    text += " to " + (edit.newName.empty() ? "no name" : edit.newName);
  }
  for (const Vector3& point : edit.points)
  {
    text += " " + PlaceText(point);
  }
  const auto length = [&](const char* what, double value)
  {
    char words[60];
    std::snprintf(words, sizeof(words), " %s %g mm", what, value);
    text += value > 0.0 ? words : "";
  };
  length("radius", edit.radius);
  length("reach", edit.reach);
  return text;
}

EditedTree EditTree(const VesselTree& tree, const std::vector<TreeEdit>& edits,
  const EditScene& scene, const ProgressCallback& progress)
{
  TreeEditor editor(tree, scene);
  for (std::size_t n = 0; n < edits.size(); ++n)
  {
    const auto share = [&](double fraction)
    { return 0.9 * (static_cast<double>(n) + fraction) / static_cast<double>(edits.size()); };
    Report(progress, share(0.0));
    editor.Apply(edits[n], static_cast<int>(n) + 1,
      progress ? [&](double fraction) { return progress(share(fraction)); } : ProgressCallback());
  }
  return editor.Finish(progress ? [&](double fraction) { return progress(0.9 + 0.1 * fraction); }
                                : ProgressCallback());
}

std::vector<EditNote> EditMask(
  const ImageGrid& grid, unsigned char* mask, const std::vector<TreeEdit>& edits)
{
  std::vector<EditNote> notes;
  for (std::size_t n = 0; n < edits.size(); ++n)
  {
    const TreeEdit& edit = edits[n];
    const int number = static_cast<int>(n) + 1;
    if (!IsMaskEdit(edit.kind))
    {
      continue;
    }
    CheckNumbered(edit, number);
    const bool paint = edit.kind == EditKind::Paint;
    std::int64_t changed = 0;
    for (const Vector3& centre : edit.points)
    {
      const Vector3 index = GridIndex(grid, centre);
      if (!IsInGrid(grid, index))
      {
        FailEdit(edit, number, PlaceText(centre) + " is outside the image");
      }
      // A ball smaller than a voxel is the voxel that its centre is in.
      const Vector3 nearest(std::round(index[0]), std::round(index[1]), std::round(index[2]));
      BoxAround(index,
        Vector3::Constant(edit.radius).cwiseQuotient(grid.spacing) + Vector3::Constant(0.5),
        grid.extent)
        .ForEach(
          [&](int i, int j, int k)
          {
            const Vector3 voxel(i, j, k);
            const double away = (voxel - index).cwiseProduct(grid.spacing).norm();
            unsigned char& value = mask[GridOffset(grid, i, j, k)];
            if ((away <= edit.radius || voxel == nearest) && (value != 0) != paint)
            {
              value = paint ? 1 : 0;
              ++changed;
            }
          });
    }
    if (changed == 0)
    {
      FailEdit(edit, number,
        paint ? "all around " + PlaceText(edit.points.front()) + " is vessel already"
              : "nothing of the mask is around " + PlaceText(edit.points.front()));
    }
    EditNote note;
    note.number = number;
    note.place = edit.points.front();
    char text[100];
    std::snprintf(text, sizeof(text), "%s %.1f mm^3 of the mask at ", paint ? "painted" : "erased",
      static_cast<double>(changed) * grid.spacing.prod());
    note.what = text + PlaceText(note.place);
    notes.push_back(note);
  }
  return notes;
}
}
