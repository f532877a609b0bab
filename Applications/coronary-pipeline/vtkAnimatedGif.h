/**
 * @file vtkAnimatedGif.h
 * @brief Pictures as an animation that repeats for ever.
 */
#ifndef vtkAnimatedGif_h
#define vtkAnimatedGif_h

#include "vtkPictureCanvas.h"

#include <string>
#include <vector>

namespace coronary
{
/// Whether the program was built with giflib.
bool CanWriteGif();

/**
 * One palette of 256 colours for all frames.
 * @param delays  of each frame, hundredths of a second
 * @throws std::invalid_argument for frames of different sizes, or a number of delays that does not fit;
 *         std::runtime_error naming a file that can not be written, or without giflib
 */
void WriteAnimatedGif(const std::vector<PictureCanvas>& frames, const std::vector<int>& delays,
  const std::string& path);
}

#endif
