/**
 * @file PatientVolume.h
 * @brief A patient's CT made fit to be X-rayed: what is not the patient goes, and the contrast medium of the CT with it.
 */
#ifndef DynamicCoronary_PatientVolume_h
#define DynamicCoronary_PatientVolume_h

#include "ThoraxPhantom.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// Blood of a CT with contrast medium.
struct EnhancedBlood
{
  double tissue = 0.0;        ///< HU of blood and muscle without the medium
  double blood = 0.0;         ///< HU of the aorta's blood, above it
  std::vector<Vector3> ostia; ///< of the coronary arteries, mm, at least one
};

/**
 * Makes air of what is solid (above -500 HU), thinner than 16 mm, and either lies apart in air (-970 HU in the mean, so that vessels
 * of the lung stay) or behind the back of a patient who lies on it, as a table does. Where it touches what is thicker 2 mm stay;
 * so does what is beside the patient, in lung or foam.
 * @param volume  HU, in LPS; slices across the body for the table
 * @return the voxels that became air
 * @throws Cancelled
 */
std::int64_t RemoveSurroundings(HounsfieldVolume& volume, const ProgressCallback& progress = {});

/**
 * Gives the blood of heart and great vessels the HU of tissue: bodies that hold a ball of 4.5 mm, are mostly as bright as the
 * aorta (a quarter less, or more), and begin at an ostium, or within 5 mm of one that does; and the mask's vessels. What is a
 * third brighter than the blood beside them, as calcium, stays; so do thinner vessels.
 * @param volume   HU
 * @param vessels  0 or not, one a voxel; empty: no mask
 * @return the voxels that were changed
 * @throws std::invalid_argument  blood that is not brighter than tissue, no ostium, a mask of another size; Cancelled
 */
std::int64_t RemoveContrastMedium(HounsfieldVolume& volume, const EnhancedBlood& blood,
  const std::vector<unsigned char>& vessels, const ProgressCallback& progress = {});
}

#endif
