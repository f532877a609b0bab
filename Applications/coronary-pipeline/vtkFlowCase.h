/**
 * @file vtkFlowCase.h
 * @brief From a run to case folders of OpenFOAM: a tree of vessels each, with a mesh that flow is simulated in.
 */
#ifndef vtkFlowCase_h
#define vtkFlowCase_h

#include "FoamCase.h"

#include <functional>
#include <string>
#include <vector>

class vtkMessageTrap;
class vtkPolyData;
class vtkSkinDeformation;
class vtkUnstructuredGrid;

namespace coronary
{
class StagedFolder;

struct FlowCaseSettings
{
  int tree = -1;     ///< TreeIds: 0 left, 1 right; -1: all
  double edge = 0.3; ///< of the wall, in local radii
  int layers = 5;
  double extension = 1.0; ///< of each end, in its diameters
  double meanFlow = 0.0;  ///< mL/s into a tree; 0: from the inlet's section
  BloodModel blood = BloodModel::Newtonian;
  bool rest = false;   ///< walls that stand still, at time 0
  double cycles = 3.0; ///< see FoamCase
  int steps = 1000;    ///< a cycle
  int frames = 100;    ///< of the motion a cycle
  double cycle = 1.0;  ///< s
};

/// What a run has left, and what moves it.
struct FlowCaseInput
{
  vtkPolyData* trees = nullptr;              ///< named centerlines with radii
  vtkUnstructuredGrid* mesh = nullptr;       ///< tetrahedra with weights
  vtkPolyData* rest = nullptr;               ///< the skeleton
  vtkSkinDeformation* deformation = nullptr; ///< has poses and skeleton; its mesh is replaced
};

/**
 * Writes NAME_openfoam_VESSEL/ for each tree, and NAME_openfoam.json, the list of their files. Those of an older list go.
 * @param output  the folder of `folder`
 * @return a sentence for each case
 * @throws std::runtime_error  a case folder has results of a solver; std::invalid_argument, MesherFailure, Cancelled
 */
std::vector<std::string> WriteFlowCases(const FlowCaseInput& input,
  const FlowCaseSettings& settings, const std::string& output, const std::string& name,
  StagedFolder& folder, vtkMessageTrap& messages, const std::function<void(double)>& progress);
}

#endif
