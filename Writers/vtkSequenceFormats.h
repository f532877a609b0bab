/**
 * @file vtkSequenceFormats.h
 * @brief The formats that a sequence of meshes can be written in.
 */
#ifndef vtkSequenceFormats_h
#define vtkSequenceFormats_h

#include "StagedFolder.h"
#include "vtkSequenceTopology.h"

#include <vtkPointSet.h>
#include <vtkSmartPointer.h>

#include <memory>
#include <mutex>
#include <utility>

namespace vtkMeshSequence
{
/// One phase, measured.
struct PhaseMesh
{
  vtkSmartPointer<vtkPointSet> mesh;
  std::size_t index = 0;
  double time = 0.0;
  coronary::TetrahedraQuality tetrahedra;
  coronary::TrianglesQuality surface;
};

/// What all formats write from.
class Files
{
public:
  /// @param ofReport its name, without its ending
  /// @param begin   what the names of files other than the report begin with
  /// @param to      where they are written to
  Files(std::string ofReport, std::string begin, int minimumDigits, std::size_t phaseCount,
    Topology same, std::vector<coronary::MeshSequenceReport::Face> named, bool weights,
    coronary::StagedFolder& to);

  std::string Number(std::size_t phase) const;
  /// From any thread.
  void Write(const std::string& file, const std::string& bytes);
  bool IsOwner() const { return this->Folder.IsOwner(); }

  const std::string name; ///< of the report, without its ending
  const std::string prefix;
  const Topology topology;
  const std::vector<coronary::MeshSequenceReport::Face> faces;
  const bool keepWeights; ///< whether the bones' weights go into the files
  const Patch surface;    ///< all of the boundary
  vtkSmartPointer<vtkCellArray> tetrahedra;

private:
  coronary::StagedFolder& Folder;
  std::mutex Adding; ///< to the folder
  std::size_t Phases;
  std::size_t Digits;
};

/// Phases are named in their order; then those that are written here are written, some beside each other.
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

  virtual void Write(const PhaseMesh& phase) = 0;

  /// Whether it needs the mesh at phases that are not written here.
  virtual bool NeedsAll() const { return false; }

  /// Of every phase, if that is so.
  virtual void Collect(vtkPointSet*, double) {}

  /// After the last phase: what is of all of them.
  virtual void Finish(coronary::MeshSequenceReport& report) = 0;

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

/// In the order of the report; those of all phases only where the owner of the folder is. @param mesh  at the first phase
std::vector<std::unique_ptr<Format>> MakeFormats(
  const FormatSettings& settings, Files& files, vtkPointSet* mesh);
}

#endif
