/**
 * @file vtkAortaData.h
 * @brief The aorta's wall and centerline as poly data.
 *
 * Both have the point array `Measured` (unsigned char: 1 seen in the image, 0 completed), and the field data
 * `AortaSource` (string: what was seen, and what was completed and how) and `AortaLengths` (double, 4 values, mm of axis:
 * seen, completed ascending aorta, arch, descending aorta).
 */
#ifndef vtkAortaData_h
#define vtkAortaData_h

#include "AorticModel.h"

#include "vtkSmartPointer.h"

#include <string>

class vtkPolyData;

namespace coronary
{
/// What of an aorta was seen and what completed, in words. @param ending  how the seen part ends: "the image's border"
std::string DescribeAorta(const AorticModel& aorta, const std::string& ending);

/// The closed wall, outwards.
vtkSmartPointer<vtkPolyData> AorticSurface(const AorticModel& aorta, const std::string& words);

/// One polyline from the valve to the diaphragm, with `MaximumInscribedSphereRadius`.
vtkSmartPointer<vtkPolyData> AorticCenterline(const AorticModel& aorta, const std::string& words);
}

#endif
