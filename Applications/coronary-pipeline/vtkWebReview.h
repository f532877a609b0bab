/**
 * @file vtkWebReview.h
 * @brief From the surfaces and centerlines of an evaluation, or of a run, to what its review page shows.
 */
#ifndef vtkWebReview_h
#define vtkWebReview_h

#include "ParallelFor.h"
#include "WebReview.h"
#include "vtkEvaluationPictures.h"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace coronary
{
/**
 * Surfaces are reduced, one choice of points for all phases of one connectivity; distances are those of the surfaces as
 * they were, to the other one as it was, negative inside of it. Branches are those of the arrays GroupIds, named as
 * the case's centerlines name them. The view and the range of the colours are those of the pictures.
 * @param scene      surfaces as in its pictures; files that these have read are not read again
 * @param triangles  a surface, at most about so many
 * @throws as the pictures do, and CompareSurfaces; Cancelled
 */
ReviewCase MakeReviewCase(
  const EvaluationScene& scene, std::int64_t triangles, const ProgressCallback& progress = {});

/// What a tree calls its groups; names that are there already stay.
void AddGroupNames(vtkPolyData* tree, std::map<std::int64_t, std::string>& names);

/// A result without a truth.
struct ResultScene
{
  int count = 1;                      ///< phases
  EvaluationScene::Source model;      ///< of each phase; empty: there are no surfaces
  EvaluationScene::Source centerline; ///< of each phase
  std::vector<double> guessed;        ///< of the lines' points: 1 across a gap; empty: none
};

/**
 * The same of a result. Lines are drawn as dashes where both ends of a piece, or one of them, are guessed.
 * @throws std::invalid_argument for a scene without points; what the scene's functions throw; Cancelled
 */
ReviewCase MakeResultCase(
  const ResultScene& scene, std::int64_t triangles, const ProgressCallback& progress = {});
}

#endif
