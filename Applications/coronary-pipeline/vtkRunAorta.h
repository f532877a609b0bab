/**
 * @file vtkRunAorta.h
 * @brief The aorta's wall, as part of the segmentation of `run`.
 */
#ifndef vtkRunAorta_h
#define vtkRunAorta_h

#include "vtkRunStages.h"

namespace coronary
{
/**
 * Writes aorta_wall.vtp and aorta_centerline.vtp. Where there is no aorta to be seen, or what is found is none, a warning
 * says so, and there are no such files.
 * @return what the report tells of it; null: it was not made
 */
nlohmann::ordered_json MakeAorta(RunStep& step);
}

#endif
