/**
 * @file vtkEvaluationPictures.h
 * @brief The pictures of an evaluation: the paper's Figs. 5 and 6, distances in colours, the beating tree.
 *
 * All of them need a display, or a VTK that needs none: ask CanDraw (vtkDisplay.h) first.
 */
#ifndef vtkEvaluationPictures_h
#define vtkEvaluationPictures_h

#include "Evaluation.h"

#include "vtkSmartPointer.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

class vtkPolyData;

namespace coronary
{
struct PictureStore;
struct PictureView;

/// What is drawn. Indices are those of evaluation->phases.
struct EvaluationScene
{
  using Source = std::function<vtkSmartPointer<vtkPolyData>(int index)>;

  const CaseEvaluation* evaluation = nullptr;
  Source model; ///< closed surface, triangles, mm
  Source truth; ///< closed surface, triangles, mm
  Source
    centerline; ///< the model's tree: lines with the cell array GroupIds; empty, or returns null: there is none
  Source truthCenterline; ///< the same of the truth; pictures do without it

  /// Points, triangles and lines that were asked for already, in single precision: 4 MB a surface of
  /// 120000 triangles. Made with the first picture; pictures of one scene read each file once.
  mutable std::shared_ptr<PictureStore> store;
};

/**
 * Fig. 6: model (red) over truth (green) in every phase, seen from one place; dashed frames around interpolated
 * phases, solid ones around tracked; beneath, the lost phase with the greatest HD (the phase with the greatest HD where
 * none is lost) and its neighbours, magnified. PNG, at least 2400 pixels wide.
 * @throws std::invalid_argument for a scene without phases or without points; std::runtime_error naming a
 *         file that can not be written; what the scene's functions throw. So do all of the following.
 */
void DrawOverlayGrid(const EvaluationScene& scene, const std::string& path);

/// The model coloured by its distance from the truth in four phases, one of them that with the greatest HD. PNG.
void DrawDistances(const EvaluationScene& scene, const std::string& path);

/// Fig. 5: centerlines of all phases by branch, paths of points of the tree over the cycle, meshes of three phases.
/// Without centerlines only the last. PNG.
void DrawSequence(const EvaluationScene& scene, const std::string& path);

/**
 * The beating tree, a picture a phase, phases in the order of their fractions: `folder`/beating_NN.png, and
 * `folder`/beating.gif where the program was built with giflib.
 * @return the files' paths, in this order
 */
std::vector<std::string> DrawBeating(const EvaluationScene& scene, const std::string& folder);

///@{
/// What the pictures show, for others that show the same; none of it needs a display. Surfaces have points in single
/// precision, normals and triangles only. @throws as the pictures do.
vtkPolyData* ShownModel(const EvaluationScene& scene, int index);
vtkPolyData* ShownTruth(const EvaluationScene& scene, int index);
/// Of a tile of DrawOverlayGrid.
PictureView OverlayView(const EvaluationScene& scene, double& aspect);
/// Those of DrawDistances.
std::vector<int> DistancePhases(const EvaluationScene& scene);
/// Where the colours of DrawDistances end, mm. Distances may have a sign; what is not finite does not count.
double DistanceRange(const std::vector<double>& distances);
///@}
}

#endif
