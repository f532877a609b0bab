/**
 * @file vtkRunMotion.h
 * @brief The last stage of `run`: the model at all moments.
 */
#ifndef vtkRunMotion_h
#define vtkRunMotion_h

#include "vtkRunStages.h"

namespace coronary
{
/**
 * Tracks the tree through the phases and writes motion/. Where PlanMotion() says so, the motion is that of a population, or
 * every moment has the pose at rest; a warning and the report say which.
 * @return what the report tells of it, on the first rank @throws std::runtime_error, Cancelled
 */
nlohmann::ordered_json MakeMotion(RunStep& step);
}

#endif
