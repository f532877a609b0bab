/**
 * @file vtkRunMask.h
 * @brief `run` of a mask without an image: of a network, or of 3D Slicer.
 */
#ifndef vtkRunMask_h
#define vtkRunMask_h

#include "vtkRunStages.h"

namespace coronary
{
/**
 * The stage `segmentation` of a mask alone: the aorta cut off, the places where trees begin, doubts about the voxel size.
 * Writes mask.mha, ostia.vtp and an empty aorta.vtp.
 * @return what the report tells of it @throws std::runtime_error naming the file, Cancelled
 */
nlohmann::ordered_json MakeGivenMask(RunStep& step);

/// The mask of that stage, from memory or from the folder.
void NeedGivenMask(const RunStep& step);
}

#endif
