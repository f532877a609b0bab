/**
 * @file vtkRunMotion.h
 * @brief The last stage of `run`: the model at all moments, or at rest where there is nothing to track.
 */
#ifndef vtkRunMotion_h
#define vtkRunMotion_h

#include "vtkRunStages.h"

namespace coronary
{
/**
 * Tracks the tree through the phases and writes motion/. Where RunInput::ReasonWithoutMotion() names a reason, every
 * moment has the pose at rest, a warning says so, and the report has `at_rest`.
 * @return what the report tells of it, on the first rank @throws std::runtime_error, Cancelled
 */
nlohmann::ordered_json MakeMotion(RunStep& step);
}

#endif
