/**
 * @file vtkRunMeshes.h
 * @brief The surface and the tetrahedra of `run`, where something of the tree can not be meshed.
 */
#ifndef vtkRunMeshes_h
#define vtkRunMeshes_h

#include "vtkSmartPointer.h"

#include <nlohmann/json.hpp>

#include <functional>
#include <string>

class vtkMessageTrap;
class vtkPolyData;
class vtkTetrahedralMesher;

namespace coronary
{
/**
 * A tree in images that runs into a chamber has no wall that could be swept in finite time.
 * @param path           of the tree, for the message
 * @param maximumRadius  of a vessel, mm
 * @throws std::runtime_error naming the widest place
 */
void RequireVessels(vtkPolyData* tree, const std::string& path, double maximumRadius);

/// `repairs`: {vessel, what, place} and `left_out`: {vessel, reason, place, length_mm} of a swept surface.
void DescribeChanges(vtkPolyData* surface, nlohmann::ordered_json& numbers);

/// The tree without the points that its surface leaves out; the same tree when there are none.
vtkSmartPointer<vtkPolyData> SweptPart(vtkPolyData* tree, vtkPolyData* surface);

/// The name of the vessel nearest to a place, as "R-PDA (group 4)"; "" without any.
std::string NearestVessel(vtkPolyData* tree, const double place[3]);

/**
 * Has a mesher fill the surface. When it fails, the surface is cleaned and meshed once more, and then by the other
 * backend where that was built in; a warning says so.
 *
 * @param mesher  with its settings and its skeleton
 * @param update  brings the mesher up to date, and throws std::runtime_error when it failed
 * @return what was done apart from the usual: "", "cleaned" or "other backend"
 * @throws std::runtime_error naming the vessel, when nothing helps; Cancelled
 */
std::string FillSurface(vtkTetrahedralMesher* mesher, vtkPolyData* surface, vtkPolyData* tree,
  const std::function<void()>& update);
}

#endif
