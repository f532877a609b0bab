/**
 * @file vtkWebReview.h
 * @brief From the surfaces and centerlines of an evaluation to what its review page shows.
 */
#ifndef vtkWebReview_h
#define vtkWebReview_h

#include "ParallelFor.h"
#include "WebReview.h"
#include "vtkEvaluationPictures.h"

#include <cstdint>

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
}

#endif
