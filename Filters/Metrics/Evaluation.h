/**
 * @file Evaluation.h
 * @brief A moving model held against the truth, phase by phase: Table 1 of the paper.
 *
 * The paper's protocol: a model is tracked in the even phases of a series only, the odd ones are
 * interpolated; surfaces are compared in all of them, and the mean over the interpolated phases is
 * reported. Part A of its Table 1 has a row a phase of one case, Part B a row a case.
 */
#ifndef DynamicCoronary_Evaluation_h
#define DynamicCoronary_Evaluation_h

#include "BranchMetrics.h"
#include "MeshDistance.h"

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace coronary
{
/// The measures of a phase, or their means. Lengths in mm; NaN: not known.
struct EvaluationMeasures
{
  static constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

  // What a model that lacks a vessel, or has one too many, can not make look well.
  double found = NaN;          ///< share of the true tree's length that the model has
  double foundHalf = NaN;      ///< the same of what is 0.5 mm in radius or more
  double foundWide = NaN;      ///< of what is 1 mm in radius or more
  double assd = NaN;           ///< ASSD: mean distance of the surfaces, area-weighted, both ways
  double hausdorff95 = NaN;    ///< HD95
  double centerlineMean = NaN; ///< from the truth's centerline to the model's, see relevantRadius
  double centerline95 = NaN;   ///< 95th percentile of the same distances
  double falseLength = NaN;    ///< of the model's tree, where the truth has no vessel
  double falseConfident = NaN; ///< of that what the model is confident of

  // The paper's.
  double hausdorff = NaN;         ///< HD, Eq. 15
  double msd = NaN;               ///< MSD, Eq. 16: from the model's vertices to the truth
  double completenessRatio = NaN; ///< BCR, Eq. 17
  double continuityScore = NaN;   ///< BCS, Eq. 17

  double boundedCompleteness = NaN; ///< share of the truth's branches that are detected
};

/// One of the measures: what tables and plots call it, and where it is.
struct EvaluationColumn
{
  const char* key;  ///< in files, "HD95"
  bool brief;       ///< also in tables for people
  const char* unit; ///< "mm", or "" for a ratio
  double EvaluationMeasures::*value;
  double best; ///< 0 for distances, 1 for ratios
};

/// All measures, in the order of the tables.
const std::vector<EvaluationColumn>& EvaluationColumns();

/// A branch of the truth in one phase.
struct BranchEvaluation
{
  std::int64_t group = -1;
  std::string label;                           ///< SCCT name; empty: not known
  double length = EvaluationMeasures::NaN;     ///< mm
  double covered = EvaluationMeasures::NaN;    ///< share of its length that the model has
  double continuity = EvaluationMeasures::NaN; ///< bounded
  double hausdorff = EvaluationMeasures::NaN;  ///< of its surface from the model, mm
  double mean = EvaluationMeasures::NaN;       ///< area-weighted, mm
};

/// A line of the model that is no vessel of the truth for more than half of its length.
struct FalseBranch
{
  std::int64_t group = -1;
  std::string label;                           ///< what the model calls it; empty: not named
  double length = EvaluationMeasures::NaN;     ///< mm
  double confidence = EvaluationMeasures::NaN; ///< mean along it; NaN: the model has none
};

struct PhaseEvaluation
{
  int phase = 0;             ///< number in the series, from 0
  double fraction = 0.0;     ///< of the R-R interval
  bool interpolated = false; ///< not tracked, by choice
  bool lost = false;         ///< to be tracked, but more than half of the tree was not to be seen
  EvaluationMeasures measures;
  std::vector<BranchEvaluation> branches;
  std::vector<FalseBranch> falseBranches;
};

/// From this confidence on a model says that it is sure of a vessel.
constexpr double ConfidentFrom = 0.5;

/// A branch of which the model has less than this share of its length is lost.
constexpr double LostBelow = 0.5;

struct CaseEvaluation
{
  std::string name;
  std::vector<PhaseEvaluation> phases;
  std::vector<std::string> warnings; ///< a sentence each
};

struct EvaluationSettings
{
  MeshDistanceSettings distance;
  BranchMetricsSettings branches;

  /// Distances of centerlines are taken where the truth's radius is this large; mm, 0 or more.
  double relevantRadius = 0.75;
};

/// What is compared in one phase. Trees may be empty: their measures are then not known.
struct EvaluationInput
{
  SurfaceMesh model;
  SurfaceMesh truth;
  Polylines modelTree;
  Polylines truthTree;
  std::vector<double> modelConfidence; ///< 0 to 1, one a point of modelTree; empty: not known
  std::map<std::int64_t, std::string> labels;      ///< names of the truth's groups
  std::map<std::int64_t, std::string> modelLabels; ///< of the model's
};

/**
 * Fills the measures and branches of a phase. A place of the truth is found where the model's centerline is within the
 * true radius, or `branches.tolerance` where that is more; a place of the model is false that is further than the tolerance
 * and than either radius from every true centerline.
 * @param warnings  sentences are added
 * @throws as CompareSurfaces and CompareBranches; std::invalid_argument if relevantRadius is out of range
 */
void EvaluatePhase(const EvaluationInput& input, const EvaluationSettings& settings,
  PhaseEvaluation& phase, std::vector<std::string>& warnings,
  const ProgressCallback& progress = {});

/// Mean and standard deviation (with n - 1, as the paper's table) of a list of measures; values that are NaN do
/// not count. The deviation of a single value is NaN.
struct MeasureSummary
{
  EvaluationMeasures mean;
  EvaluationMeasures deviation;
  std::int64_t count = 0;
};
MeasureSummary Summarize(const std::vector<EvaluationMeasures>& list);

/// A branch of the truth over all phases.
struct BranchSummary
{
  std::int64_t group = -1;
  std::string label;                          ///< empty: not known
  double length = EvaluationMeasures::NaN;    ///< mean, mm
  double found = EvaluationMeasures::NaN;     ///< mean share of its length that the model has
  double minimum = EvaluationMeasures::NaN;   ///< that of the worst phase
  int worstPhase = -1;                        ///< its number
  double mean = EvaluationMeasures::NaN;      ///< of its surface's distance from the model, mm
  double hausdorff = EvaluationMeasures::NaN; ///< the greatest, mm
};

/// In the order of their groups.
std::vector<BranchSummary> SummarizeBranches(const CaseEvaluation& one);

/// A sentence for each branch of the truth that is lost in some phase, and each false one of the model.
std::vector<std::string> FindingsOf(const CaseEvaluation& one);

/// Of the phases that are interpolated, or tracked.
MeasureSummary SummarizePhases(const CaseEvaluation& one, bool interpolated);

/// Over the cases, of their means over the interpolated phases: the last row of Part B.
MeasureSummary SummarizeCases(const std::vector<CaseEvaluation>& cases);

/// "interpolated", "tracked" or "lost".
const char* KindOf(const PhaseEvaluation& phase);

/// The paper's Table 1: HD, MSD, BCR and BCS only. Phases of Part A have no fractions there: NaN.
const CaseEvaluation& PaperPartA();

/// What the paper has for an interpolated phase of the same number; else NaN.
EvaluationMeasures PaperMeasuresOf(const PhaseEvaluation& phase);

/// Name and means over the interpolated phases of its five cases.
struct PaperCase
{
  const char* name;
  EvaluationMeasures mean;
};
const std::vector<PaperCase>& PaperPartB();

/// Means and deviations as printed there (of the rows above they would be 0.04 off).
const MeasureSummary& PaperSummaryA();
const MeasureSummary& PaperSummaryB();

/// Part A of every case and Part B over all, as fields separated by commas.
std::string EvaluationCsv(const std::vector<CaseEvaluation>& cases);

/// The truth's branches: a row each in every phase, as fields separated by commas.
std::string BranchCsv(const std::vector<CaseEvaluation>& cases);

/// A LaTeX document's part: two tabular environments like the paper's Table 1.
std::string EvaluationLatex(const std::vector<CaseEvaluation>& cases);

/// For a terminal: Part A and B, beside the paper's.
std::string EvaluationText(const std::vector<CaseEvaluation>& cases);
}

#endif
