/**
 * @file DicomSeries.h
 * @brief A folder of DICOM files as one volume a cardiac phase.
 */
#ifndef DynamicCoronary_DicomSeries_h
#define DynamicCoronary_DicomSeries_h

#include "VolumeSource.h"

#include <memory>
#include <string>

namespace coronary
{
/**
 * Opens all DICOM images below a folder as one series of phases; reads headers only.
 *
 * Images are sorted by position along the slice normal, and at each position by time. Time is, in
 * this order, the first of these that tells the images of a position apart: trigger time (as a
 * fraction of the R-R interval: nominal interval, 60000 / heart rate, or number of phases times the
 * mean step), nominal percentage of the cardiac phase, a percentage in the series description, and
 * at last the order of acquisition, spread evenly over [0, 1).
 *
 * Several series become one when they share modality, frame of reference, matrix, spacing and
 * orientation, and either each is one slice position, or each is a whole stack at its own time.
 * Localizers, secondary captures, DICOMDIR and other files are skipped, which the notes say.
 * Slices that are not evenly spaced are put at their mean distance, with a warning that says how far
 * this puts them from their true positions.
 * The k axis goes along increasing position on the normal, so the axes are right-handed.
 *
 * @param folder             searched recursively
 * @param seriesInstanceUid  uses this series alone; empty: all
 * @param poll               called between the files
 * @throws std::runtime_error with one sentence: no such folder, no images, several series that do not
 *   belong together (lists them), a damaged file, a slice that is missing at a phase, slices that are
 *   shifted sideways, images of more than one component
 */
std::unique_ptr<VolumeSource> OpenDicomSeries(
  const std::string& folder, const std::string& seriesInstanceUid = {}, const Poll& poll = {});
}

#endif
