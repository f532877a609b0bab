/**
 * @file PatientModel.h
 * @brief From a patient's images to the vessels of a session, by coronary-pipeline.
 */
#ifndef DynamicCoronary_PatientModel_h
#define DynamicCoronary_PatientModel_h

#include "ParallelFor.h"

#include <string>
#include <vector>

namespace coronary
{
/// What a series is called: its file's or folder's name without what ends it; of a series.json the folder's.
std::string NameOfSeries(const std::string& series);

/**
 * Makes a series' model by `coronary-pipeline run`, which lies beside this program; what is there of it already, with
 * whatever settings, stays as it is.
 * @param series    what that program takes: a folder of DICOM files, a series.json, a volume
 * @param folder    of the model
 * @param progress  0 to 1; false cancels
 * @return what the run warned of: what was not found, guessed or doubted, by name and place
 * @throws std::runtime_error in one sentence: nothing at `series`; a model of other images in `folder`; no coronary-pipeline; why it failed, in its own words
 * @throws Cancelled
 */
std::vector<std::string> MakePatientModel(
  const std::string& series, const std::string& folder, const ProgressCallback& progress = {});
}

#endif
