/**
 * @file vtkRunStages.h
 * @brief The stages of `run`: each makes its files from those of the stages before it.
 *
 * What a stage hands to a later one are its files: a stage reads what it needs from the folder, whether that was
 * written just now or by an earlier run. Images alone are also kept in memory, as long as they are needed.
 */
#ifndef vtkRunStages_h
#define vtkRunStages_h

#include "RunReport.h"
#include "RunSettings.h"
#include "TreeEdits.h"

#include "vtkSmartPointer.h"

#include <nlohmann/json.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

class vtkGatedImageReader;
class vtkImageData;
class vtkMessageTrap;
class vtkPolyData;

namespace coronary
{
class StagedFolder;
class HeartRegion;
struct CoronaryOstia;

/// What the stages work on.
class RunInput
{
public:
  /// Opens the images, or nothing for a surface. @throws std::runtime_error naming the input
  RunInput(const RunSettings& settings, vtkMessageTrap& messages, std::vector<TreeEdit> edits);
  ~RunInput();

  /// A mask without images.
  bool IsMask() const { return this->Settings.input.empty(); }

  bool IsSurface() const { return this->Reader == nullptr && !this->IsMask(); }

  /// All files of which the input is, for DescribeInput().
  std::vector<std::string> Files() const;

  /// The segmentation that was given for a phase; empty: none.
  std::string MaskOf(int phase) const;

  /// Whether one was given for some phase.
  bool HasMasks() const;

  /// Why there is no motion in it; empty when there is.
  std::string ReasonWithoutMotion() const;

  const RunSettings& Settings;
  vtkMessageTrap& Messages;
  vtkSmartPointer<vtkGatedImageReader> Reader;
  std::vector<TreeEdit> Edits;    ///< by hand
  std::vector<double> Seeds;      ///< given points, three numbers each
  std::vector<std::string> Masks; ///< of a series.json, one a phase; empty: there are none

  ///@{
  /// What was found in the reference phase before anything else; null: not looked for, or not sure.
  std::shared_ptr<const CoronaryOstia> Ostia;
  std::shared_ptr<const HeartRegion> Region;
  ///@}

  /// The reference phase, from FindReference() or a report; nothing: not chosen yet, or there are no phases.
  std::optional<ReferencePhase> Chosen;

  ///@{
  /// Of the reference phase; null: not in memory.
  vtkSmartPointer<vtkImageData> Reference;
  vtkSmartPointer<vtkImageData> Vesselness;
  vtkSmartPointer<vtkImageData> Mask;
  ///@}
};

/// One stage at work.
struct RunStep
{
  RunInput& input;
  RunReport& report;               ///< of the stages before
  StagedFolder& folder;            ///< for the stage's files
  std::vector<std::string>& files; ///< names of those
  std::function<void(double)> progress;
  std::string summary;                    ///< a few words for the user
  std::vector<std::string> warnings = {}; ///< of the stage itself, beside those of filters

  /// Where to write a file of the stage.
  std::string Add(const std::string& name);
};

/// Where a file of the result is, made now or before.
std::string PathOf(const RunStep& step, const std::string& name);

///@{
/// Poly data of an earlier stage; the tree must not be empty. @throws std::runtime_error
vtkSmartPointer<vtkPolyData> ReadLines(const RunStep& step, const std::string& name);
vtkSmartPointer<vtkPolyData> ReadTree(const RunStep& step);
///@}

/// Whether all ranks work on a stage; else the first one alone.
bool IsShared(RunStage stage);

/// Chooses the reference phase, and loads its image.
void FindReference(RunStep& step);

/// Makes the files of a stage, those that are shared with all ranks. @return what the report tells of it, on the first
/// rank @throws std::runtime_error, Cancelled
nlohmann::ordered_json MakeStage(RunStage stage, RunStep& step);

/// Lets images go that the stages from `next` on do not need.
void ReleaseImages(RunInput& input, RunStage next);

/// Files that a stage and those after it may have left in a folder, with those of older versions of the program.
std::vector<std::string> UsualFiles(const std::string& folder, RunStage from);
}

#endif
