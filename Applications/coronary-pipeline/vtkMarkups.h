/**
 * @file vtkMarkups.h
 * @brief Centerlines and seeds as markups of 3D Slicer, and back.
 */
#ifndef vtkMarkups_h
#define vtkMarkups_h

#include "MarkupsFile.h"

#include "vtkPolyData.h"
#include "vtkSmartPointer.h"

#include <string>
#include <vector>

namespace coronary
{
/**
 * A curve for each line, called as its segment (cell array `SegmentLabel`), else "Branch N"; a name that is there
 * already gets a number. Point arrays of one component are measurements; `MaximumInscribedSphereRadius` comes first and is called
 * "Radius", as in Slicer's own modules.
 * @throws std::runtime_error without lines
 */
std::vector<Markup> CurvesOf(vtkPolyData* tree);

/// One list of points, labelled by the point array `Name`, if there is one.
std::vector<Markup> FiducialsOf(vtkPolyData* points, const std::string& name);

/// Whether all markups are lists of points.
bool AreFiducials(const std::vector<Markup>& markups);

/// All points as vertices with `Name` and `Confidence` 1.
vtkSmartPointer<vtkPolyData> SeedsOf(const std::vector<Markup>& markups);

/**
 * Lines, curves and closed curves of at least two points as polylines, with the radius that they have as a measurement
 * ("Radius" or `MaximumInscribedSphereRadius`), and `SegmentLabel`. Points of Slicer's curves are joined by straight lines here.
 * @param radius  of curves without such a measurement, mm
 * @throws std::runtime_error naming `file` without any
 */
vtkSmartPointer<vtkPolyData> LinesOf(
  const std::vector<Markup>& markups, double radius, const std::string& file);

/**
 * Lines that meet, as a tree: ends that are nearer to a point of another line than `tolerance` are one with it. Loops are an error.
 * What does not meet is a tree of its own. Names of the lines go to the branches.
 * @throws std::invalid_argument naming the line
 */
vtkSmartPointer<vtkPolyData> TreeOfLines(vtkPolyData* lines, double tolerance);
}

#endif
