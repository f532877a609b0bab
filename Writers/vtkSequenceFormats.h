/**
 * @file vtkSequenceFormats.h
 * @brief The formats that a sequence of meshes can be written in.
 */
#ifndef vtkSequenceFormats_h
#define vtkSequenceFormats_h

#include "StagedFolder.h"
#include "vtkSequenceTopology.h"

#include <memory>
#include <utility>

namespace vtkMeshSequence
{
/// One phase, measured.
struct PhaseMesh
{
  vtkPointSet* mesh = nullptr;
  double time = 0.0;
  coronary::TetrahedraQuality tetrahedra;
  coronary::TrianglesQuality surface;
};

/// What all formats write from.
class Files
{
public:
  /// @param path    of the report
  /// @param begin   what the names of files other than the report begin with
  Files(const std::string& path, std::string begin, int leastDigits, std::size_t phaseCount,
    Topology same, std::vector<coronary::MeshSequenceReport::Face> named, bool weights,
    coronary::RankGroup& ranks);

  std::string Number(std::size_t phase) const;
  void Write(const std::string& file, const std::string& bytes);

  const std::string name; ///< of the report, without its ending
  const std::string prefix;
  const Topology topology;
  const std::vector<coronary::MeshSequenceReport::Face> faces;
  const bool keepWeights; ///< whether the bones' weights go into the files
  const Patch surface;    ///< all of the boundary
  vtkSmartPointer<vtkCellArray> tetrahedra;
  coronary::StagedFolder folder;

private:
  std::size_t Phases;
  std::size_t Digits;
};

/// Phases come in their order. A rank names those of all and writes its own.
class Format
{
public:
  Format(Files& files)
    : Shared(files)
  {
  }
  virtual ~Format() = default;
  Format(const Format&) = delete;
  void operator=(const Format&) = delete;

  /// Adds the phase's files to its entry.
  virtual void Name(std::size_t phase, double time, coronary::MeshSequenceReport::Phase& entry) = 0;

  /// Of the phase that was named last.
  virtual void Write(const PhaseMesh& phase) = 0;

  /// Whether this rank needs the mesh at phases that it does not write.
  virtual bool NeedsAll() const { return false; }

  /// Of every phase, if that is so.
  virtual void Collect(vtkPointSet*, double) {}

  /// After the last phase: what is of all of them. @param write  on the first rank only
  virtual void Finish(bool write, coronary::MeshSequenceReport& report) = 0;

protected:
  Files& Shared;
};

/// Which formats, and what they are told.
struct FormatSettings
{
  bool series = false;
  bool simVascular = false;
  bool vmtk = false;
  bool obj = false;
  bool ply = false;
  bool stl = false;
  bool gltf = false;
  bool gltfJson = false;
  double simVascularUnit = 1.0; ///< mm
  int gltfInfluences = 4;
  double period = 1.0;
  bool gltfLoop = true;
};

/// In the order of the report. @param mesh  at the first phase
std::vector<std::unique_ptr<Format>> MakeFormats(
  const FormatSettings& settings, Files& files, vtkPointSet* mesh, bool firstRank);
}

#endif
