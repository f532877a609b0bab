/**
 * @file SeriesDescription.h
 * @brief The small JSON file that lists the phases of a gated series.
 *
 * @code{.json}
 * {
 *   "cycle_ms": 1000,
 *   "phases": [
 *     { "fraction": -0.05, "image": "phase_00.mha", "mask": "phase_00.seg.nrrd",
 *       "truth": { "surface": "truth/surface_00.vtp", "centerline": "truth/centerline_00.vtp" } }
 *   ],
 *   "seeds": [ { "name": "LCA", "position": [12.5, -30.0, 41.0] } ]
 * }
 * @endcode
 * Only `phases`, and in each of them `fraction` and `image`, must be there. Further keys are allowed
 * and ignored.
 */
#ifndef DynamicCoronary_SeriesDescription_h
#define DynamicCoronary_SeriesDescription_h

#include "Geometry.h"

#include <string>
#include <vector>

namespace coronary
{
/// What the JSON file says. Paths stay as they are in the file: see ResolveSeriesPath().
struct SeriesDescription
{
  struct Phase
  {
    double fraction = 0.0;  ///< of the R-R interval; strictly increasing over the phases
    std::string image;      ///< a volume file, or a folder of DICOM files
    std::string surface;    ///< true lumen surface; empty if there is none
    std::string centerline; ///< true centerline tree; empty if there is none
    std::string mask = {};  ///< segmentation of the vessels; empty if there is none
  };

  struct Seed
  {
    std::string name;
    Vector3 position = Vector3::Zero(); ///< LPS world coordinates, mm
  };

  double cycleMs = 0.0; ///< length of the R-R interval in milliseconds; 0 when it is not given
  std::vector<Phase> phases;
  std::vector<Seed> seeds;
};

/**
 * Reads and checks a description; does not look at the files it names.
 * @throws std::runtime_error with one sentence that names the file and the entry at fault: a missing
 *   or empty file, no JSON, no phases, a fraction that is not finite or not above the one before, a
 *   seed position that is not three finite numbers, a cycle length that is not positive.
 */
SeriesDescription ReadSeriesDescription(const std::string& path);

/**
 * Writes a description atomically, after the checks of ReadSeriesDescription().
 * Numbers are written so that reading gives the same bits.
 * @throws std::runtime_error naming `path`.
 */
void WriteSeriesDescription(const std::string& path, const SeriesDescription& description);

/// The path to open for an entry: relative entries are relative to the description's folder.
std::string ResolveSeriesPath(const std::string& descriptionPath, const std::string& entry);
}

#endif
