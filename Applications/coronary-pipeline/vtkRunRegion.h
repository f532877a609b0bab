/**
 * @file vtkRunRegion.h
 * @brief The heart's part of the reference phase: the rest of a chest is not looked at.
 */
#ifndef DynamicCoronary_vtkRunRegion_h
#define DynamicCoronary_vtkRunRegion_h

#include "vtkRunStages.h"

#include "vtkSmartPointer.h"

#include <nlohmann/json.hpp>

class vtkImageData;

namespace coronary
{
/// Images with fewer values between the least and the greatest are in another unit than HU.
constexpr double MinimumRangeOfHU = 400.0;

/// The least and the greatest value; VTK's own way to them took more than a second of a run.
void RangeOf(vtkImageData* image, double range[2]);

/// Ostia that are all less sure than this are none: nine such runs of ten go through something else.
constexpr double MinimumOstialConfidence = 0.1;

/**
 * Ends a run whose ostia were looked for and can not be believed.
 * @param confidences  of the ostia that were found
 * @throws std::runtime_error naming the image, what may be wrong with it and what helps
 */
void RequireOstia(const RunStep& step, const std::vector<double>& confidences);

/**
 * The aorta and the ostia of the reference phase, into the input, unless they are there already or the image can not have them: no
 * HU, or what FindCoronaryOstia refuses (who needs the image says what is wrong with it).
 * @throws Cancelled
 */
void FindOstia(const RunStep& step, const std::function<void(double)>& progress = {});

/**
 * The ostia of the reference phase and the region around them, into the input; no region where the ostia are not sure, where
 * seeds or a mask are given, or where the image is not HU.
 * @throws Cancelled
 */
void FindHeart(RunStep& step);

/// The region as a mask on the reference phase, the same on all ranks; null: the whole image counts.
vtkSmartPointer<vtkImageData> HeartMask(RunStep& step);

/// What the report says of it.
nlohmann::ordered_json DescribeRegion(const RunStep& step);
}

#endif
