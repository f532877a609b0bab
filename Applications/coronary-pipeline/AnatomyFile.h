/**
 * @file AnatomyFile.h
 * @brief A JSON file that tells which moving surfaces an anatomy is made of, and of what they are full.
 *
 * @code{.json}
 * {
 *   "cycle_ms": 1000,
 *   "trunk": { "material": "soft", "width_mm": 300, "depth_mm": 220, "centre": [0, 0] },
 *   "parts": [
 *     { "name": "muscle", "material": "muscle", "value": 110, "surfaces": ["muscle_0.stl", "muscle_1.stl"],
 *       "phases": [0, 0.4] },
 *     { "name": "lumen", "material": "blood", "value": 14, "unit": "mg/mL", "surfaces": "lumen.pvd", "truth": true },
 *     { "name": "spine", "material": "bone", "surfaces": "spine.ply", "still": true }
 *   ]
 * }
 * @endcode
 * docs/scanner.md has all keys. Paths are relative to the file's folder.
 */
#ifndef DynamicCoronary_AnatomyFile_h
#define DynamicCoronary_AnatomyFile_h

#include "MeshAnatomy.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

class vtkMessageTrap;

namespace coronary
{
struct AnatomyFile
{
  std::unique_ptr<MeshAnatomy> anatomy;
  std::vector<std::size_t> truth; ///< parts whose surfaces are the truth
  std::size_t parts = 0;
  bool trunkGiven = false;
  std::uint64_t digest = 0; ///< of all points and triangles
};

/**
 * Reads a file and all surfaces that it names.
 * @throws std::runtime_error: one sentence that names the file, and the part, entry or surface at fault
 */
AnatomyFile ReadAnatomyFile(const std::string& path, vtkMessageTrap& messages);
}

#endif
