/**
 * @file vtkRunEdits.h
 * @brief Edits by hand in the stage `centerline` of `run`: those of the mask before the marching, those of the tree after
 * the names.
 */
#ifndef vtkRunEdits_h
#define vtkRunEdits_h

#include "vtkRunStages.h"

#include "vtkSmartPointer.h"

#include <nlohmann/json.hpp>

#include <string>

class vtkImageData;
class vtkPolyData;

namespace coronary
{
/**
 * The step's mask, or with edits of the mask an edited copy of it, which is written as edited_mask.mha.
 * @param numbers  of the stage; what was done goes into its list `edits`
 * @throws std::runtime_error naming the edit that can not be applied
 */
vtkSmartPointer<vtkImageData> EditedMask(RunStep& step, nlohmann::ordered_json& numbers);

/// @throws std::runtime_error where there are edits of a mask, and the trees are made without one
void RequireMaskOfEdits(const RunStep& step);

/// Replaces a named tree and its bifurcations where there are edits of the tree. As EditedMask().
void EditTree(RunStep& step, vtkSmartPointer<vtkPolyData>& tree,
  vtkSmartPointer<vtkPolyData>& bifurcations, nlohmann::ordered_json& numbers);

/// What the last edit did, in a few words. @param edits  the list of the stage, not empty
std::string DescribeLastEdit(const nlohmann::ordered_json& edits);
}

#endif
