/**
 * @file MeshSequenceReport.h
 * @brief What was written of a moving mesh, and how good its elements are at every phase: JSON and CSV.
 */
#ifndef DynamicCoronary_MeshSequenceReport_h
#define DynamicCoronary_MeshSequenceReport_h

#include "MeshQuality.h"

#include <string>
#include <utility>
#include <vector>

namespace coronary
{
struct MeshSequenceReport
{
  struct Face
  {
    int id = 1; ///< CellEntityIds
    std::string name;
    std::int64_t triangles = 0;
  };

  struct Phase
  {
    double time = 0.0;
    TetrahedraQuality tetrahedra; ///< without the values of single tetrahedra
    TrianglesQuality surface;
    std::vector<std::pair<std::string, std::string>> files; ///< kind, path
  };

  std::int64_t points = 0;
  std::int64_t tetrahedra = 0; ///< 0: a surface alone
  std::int64_t surfacePoints = 0;
  std::int64_t triangles = 0;
  double poorAngle = PoorDihedralAngle; ///< radians
  std::vector<Face> faces;
  std::vector<Phase> phases;
  std::vector<std::pair<std::string, std::string>> files; ///< of all phases: kind, path
  std::string prefix; ///< what the files' names begin with; may be empty
};

/// Angles in degrees; what is not finite is null.
std::string MeshSequenceJson(const MeshSequenceReport& report);

/// One line a phase; ids are separated by spaces.
std::string MeshSequenceCsv(const MeshSequenceReport& report);

/**
 * The files that a report in JSON stands for, itself the last, relative to its folder; none when it is not
 * there, or no such report. Names of another form than such a report's are left out: without the report's
 * prefix (that of a report which has none is its own name), and with an empty prefix, without a kind of file
 * before `_` or `.`.
 */
std::vector<std::string> MeshSequenceFiles(const std::string& path);
}

#endif
