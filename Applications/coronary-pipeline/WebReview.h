/**
 * @file WebReview.h
 * @brief The report of an evaluation, or of a run: one HTML file in which the beating model is turned and compared.
 *
 * The page needs no other file and no network. Its shapes are numbers: positions of 16 bits in the box around all
 * phases, distances of 16 bits, both as differences that deflate well.
 */
#ifndef DynamicCoronary_WebReview_h
#define DynamicCoronary_WebReview_h

#include "Evaluation.h"
#include "EvaluationPlots.h"

#include <nlohmann/json.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
/// A name that is written beside a point.
struct ReviewLabel
{
  std::string text;
  std::uint32_t point = 0;
};

/// What is connected with what. Phases of a moving mesh share one.
struct ReviewTopology
{
  static constexpr std::uint8_t NoBranch = 255;

  std::uint32_t points = 0;
  std::vector<std::uint32_t> cells; ///< point indices: three a triangle, two a piece of a line
  std::vector<std::uint8_t>
    branches; ///< of each point: index of ReviewSeries::branches, or NoBranch
  std::vector<ReviewLabel> labels;
};

struct ReviewFrame
{
  std::size_t topology = 0;
  std::vector<float> positions; ///< x, y, z of each point; mm, LPS
  std::vector<float>
    distances; ///< of each point, mm, negative: inside; NaN: not known; empty: none
};

/// A surface, or a tree of lines, over the phases.
struct ReviewSeries
{
  int corners = 3; ///< of a cell: 3 triangles, 2 pieces of lines
  std::vector<std::string> branches;
  std::vector<ReviewTopology> topologies;
  std::vector<ReviewFrame> frames; ///< one a phase; empty: there is none

  std::int64_t originalCells = 0; ///< in the phase with the most, before the surface was reduced
  double deviation = 0.0;         ///< greatest Hausdorff distance from the original, mm
};

/// A case to look at.
struct ReviewCase
{
  ReviewSeries model;
  ReviewSeries truth;
  ReviewSeries modelLines;
  ReviewSeries truthLines;
  ReviewSeries guessedLines; ///< dashes where the model's lines were guessed across gaps

  // Where the page looks from at first: PictureView of the case's pictures.
  double leftAnterior = 0.0; ///< degrees
  double cranial = 0.0;      ///< degrees
  std::array<double, 3> centre = { 0.0, 0.0, 0.0 };
  double height = 100.0; ///< mm
  double aspect = 1.0;   ///< width over height that the height is right for
  double range = 1.0;    ///< of the colours of distances, mm
};

/// Shapes as bytes, and where in them what is.
struct PackedShapes // NOLINT(bugprone-exception-escape): as CohortCase
{
  nlohmann::ordered_json layout;
  std::string bytes;
};

/**
 * Positions become whole numbers of 0 to 65535 between `low` and `low + 65535 * step`, so they are at most half a step
 * off along each axis; distances whole multiples of `distance_step`, -32768: not known.
 * @throws std::invalid_argument for numbers that do not fit together or positions that are not finite
 */
PackedShapes PackShapes(const ReviewCase& shapes);

/// As many triangles a surface as keep a page of so many phases, over all cases, small and quick.
std::int64_t DefaultReviewTriangles(std::int64_t phases);

/// What the page says of how it was made, and what lies beside it.
struct ReviewOrigin
{
  std::string version;
  std::string command;
  std::vector<std::pair<std::string, std::string>> settings; ///< name, value
  std::vector<std::pair<std::string, std::string>> inputs;   ///< model and truth of each case
  std::vector<std::string> warnings;                         ///< besides those of the cases
  std::vector<std::string> files; ///< that lie beside the page, relative to it
};

/// Collects cases and writes the page.
class WebReview
{
public:
  /// A case without truth and lines without a surface are taken too.
  /// @throws as PackShapes; std::invalid_argument for a series with neither no frame nor one a phase
  void Add(const CaseEvaluation& evaluation, const ReviewCase& shapes);

  /// A PNG file that the page has in it. @return its number, for `run`
  std::size_t AddPicture(const std::string& png);

  /// A picture of the last case that was added. @param file  where it is beside the page, too
  void AddIllustration(const std::string& png, const std::string& file, const std::string& title);

  /**
   * What a run says of its last case that was added: its vessels with their pictures, warnings, findings.
   * docs/evaluation.md has the form.
   */
  void SetRun(nlohmann::ordered_json run);

  /// Drawings of the measures, all cases in each.
  void SetPlots(const std::vector<EvaluationPlot>& plots) { this->Plots = plots; }

  /// The page, the same bytes of the same input. Every text in it is escaped.
  std::string Html(const ReviewOrigin& origin) const;

private:
  std::vector<CaseEvaluation> Evaluations;
  std::vector<nlohmann::ordered_json> Cases;
  std::vector<std::string> Blocks;   ///< deflated, in base 64
  std::vector<std::string> Pictures; ///< in base 64
  std::vector<EvaluationPlot> Plots;
};
}

#endif
