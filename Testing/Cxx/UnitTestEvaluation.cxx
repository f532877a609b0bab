// A moving model against the truth: measures of a phase, means over phases and cases, the tables.

#include "Evaluation.h"
#include "Refusals.h"
#include "SurfaceTestMeshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace UnitTestEvaluation
{
using namespace coronary;

namespace
{
void AddLine(Polylines& tree, const Vector3& from, const Vector3& to, double radius)
{
  const int steps = static_cast<int>(std::lround((to - from).norm()));
  tree.groups.push_back(static_cast<std::int64_t>(tree.groups.size()));
  tree.lines.emplace_back();
  for (int i = 0; i <= steps; ++i)
  {
    tree.lines.back().push_back(static_cast<std::int64_t>(tree.points.size()));
    tree.points.emplace_back(from + (to - from) * i / steps);
    tree.radius.push_back(radius);
  }
}

/// A trunk of 20 mm along x and two branches; the model's lies `shift` mm higher.
Polylines Tree(double shift, bool complete)
{
  Polylines tree;
  const Vector3 up(0, 0, shift);
  AddLine(tree, Vector3(0, 0, 0) + up, Vector3(20, 0, 0) + up, 1.5);
  AddLine(tree, Vector3(20, 0, 0) + up, Vector3(50, 0, 0) + up, 1.2);
  if (complete)
  {
    AddLine(tree, Vector3(20, 0, 0) + up, Vector3(20, 25, 0) + up, 0.5);
  }
  return tree;
}

PhaseEvaluation Phase(int number, bool interpolated, double value)
{
  PhaseEvaluation phase;
  phase.phase = number;
  phase.fraction = 0.05 * number;
  phase.interpolated = interpolated;
  phase.measures.hausdorff = value;
  phase.measures.msd = 0.1 * value;
  phase.measures.completenessRatio = 1.0;
  return phase;
}

std::size_t LinesWith(const std::string& text, const std::string& part)
{
  std::istringstream stream(text);
  std::size_t count = 0;
  for (std::string line; std::getline(stream, line);)
  {
    count += line.find(part) != std::string::npos ? 1 : 0;
  }
  return count;
}
}

TEST(Evaluation, TwoSpheresAndShiftedTrees)
{
  EvaluationInput input;
  input.model = Sphere(10.0, 5);
  input.truth = Sphere(10.5, 5);
  input.modelTree = Tree(0.4, true);
  input.truthTree = Tree(0.0, true);
  input.labels = { { 0, "LM" }, { 2, "D1" } };
  PhaseEvaluation phase;
  std::vector<std::string> warnings;
  EvaluatePhase(input, {}, phase, warnings);
  const EvaluationMeasures& m = phase.measures;
  // Facets of 5 levels lie up to 0.01 mm inside of their sphere.
  EXPECT_NEAR(m.hausdorff, 0.5, 0.02);
  EXPECT_NEAR(m.hausdorff95, 0.5, 0.02);
  EXPECT_NEAR(m.msd, 0.5, 0.02);
  EXPECT_NEAR(m.assd, 0.5, 0.02);
  EXPECT_DOUBLE_EQ(m.completenessRatio, 1.0);
  EXPECT_NEAR(m.continuityScore, 1.0, 1e-9);
  EXPECT_DOUBLE_EQ(m.boundedCompleteness, 1.0);
  // All of the truth that is wide enough is 0.4 mm away.
  EXPECT_NEAR(m.centerlineMean, 0.4, 1e-12);
  EXPECT_NEAR(m.centerline95, 0.4, 1e-12);
  ASSERT_EQ(phase.branches.size(), 3u);
  EXPECT_EQ(phase.branches[0].label, "LM");
  EXPECT_EQ(phase.branches[1].label, "");
  EXPECT_NEAR(phase.branches[1].length, 30.0, 1e-9);
  EXPECT_NEAR(phase.branches[2].covered, 1.0, 1e-9);
  EXPECT_TRUE(warnings.empty());
}

TEST(Evaluation, MissingBranchesCount)
{
  EvaluationInput input;
  input.model = Sphere(10.0, 3);
  input.truth = input.model;
  input.modelTree = Tree(0.0, false);
  input.truthTree = Tree(0.0, true);
  PhaseEvaluation phase;
  std::vector<std::string> warnings;
  EvaluatePhase(input, {}, phase, warnings);
  EXPECT_NEAR(phase.measures.hausdorff, 0.0, 1e-12);
  // Without the side branch the other two are one.
  EXPECT_NEAR(phase.measures.completenessRatio, 1.0 / 3.0, 1e-12);
  EXPECT_LT(phase.measures.boundedCompleteness, 0.7);
  EXPECT_NEAR(phase.measures.found, 51.0 / 75.0, 0.004);
  EXPECT_NEAR(phase.measures.foundHalf, 51.0 / 75.0, 0.004);
  EXPECT_DOUBLE_EQ(phase.measures.foundWide, 1.0);
  EXPECT_DOUBLE_EQ(phase.measures.falseLength, 0.0);
  // The missing branch is thinner than what centerlines are compared at; all of it is when asked for.
  EXPECT_NEAR(phase.measures.centerlineMean, 0.0, 1e-12);
  EvaluationSettings settings;
  settings.relevantRadius = 0.4;
  PhaseEvaluation all;
  EvaluatePhase(input, settings, all, warnings);
  // 25 mm of 75, at 0 to 25 mm.
  EXPECT_NEAR(all.measures.centerlineMean, 25.0 / 75.0 * 12.5, 0.05);
}

TEST(Evaluation, FalseBranchesCountByTheirConfidence)
{
  EvaluationInput input;
  input.model = Sphere(10.0, 3);
  input.truth = input.model;
  input.truthTree = Tree(0.0, false);
  input.modelTree = Tree(0.0, true);
  input.modelLabels = { { 2, "D1" } };
  // Sure of the first half of the branch that is no vessel.
  for (const Vector3& point : input.modelTree.points)
  {
    input.modelConfidence.push_back(point.y() < 12.5 ? 0.9 : 0.1);
  }
  CaseEvaluation one;
  one.phases.resize(2);
  std::vector<std::string> warnings;
  for (PhaseEvaluation& phase : one.phases)
  {
    EvaluatePhase(input, {}, phase, warnings);
  }
  const EvaluationMeasures& m = one.phases[0].measures;
  EXPECT_DOUBLE_EQ(m.found, 1.0);
  // The branch is false where it has left the trunk's lumen of 1.5 mm.
  EXPECT_NEAR(m.falseLength, 23.5, 0.26);
  EXPECT_NEAR(m.falseConfident, 11.0, 0.51);
  ASSERT_EQ(one.phases[0].falseBranches.size(), 1u);
  EXPECT_NEAR(one.phases[0].falseBranches[0].length, 25.0, 1e-9);
  EXPECT_NEAR(one.phases[0].falseBranches[0].confidence, 0.5, 0.05);
  const std::vector<std::string> findings = FindingsOf(one);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_NE(findings[0].find("False: D1 (25.0 mm, confidence 0.5"), std::string::npos)
    << findings[0];
  EXPECT_NE(findings[0].find("in 2 of 2 phases"), std::string::npos);

  // The other way round a branch is lost, in one of the two phases.
  std::swap(input.modelTree, input.truthTree);
  input.modelConfidence.clear();
  input.labels = input.modelLabels;
  input.modelLabels.clear();
  CaseEvaluation other;
  other.phases.resize(2);
  other.phases[1].phase = 7;
  EvaluatePhase(input, {}, other.phases[1], warnings);
  EXPECT_TRUE(std::isnan(other.phases[1].measures.falseConfident));
  input.modelTree = input.truthTree;
  EvaluatePhase(input, {}, other.phases[0], warnings);
  const std::vector<BranchSummary> branches = SummarizeBranches(other);
  ASSERT_EQ(branches.size(), 3u);
  EXPECT_EQ(branches[2].worstPhase, 7);
  EXPECT_LT(branches[2].minimum, 0.1);
  EXPECT_NEAR(branches[2].found, 0.5 * (1.0 + branches[2].minimum), 1e-12);
  ASSERT_EQ(FindingsOf(other).size(), 1u);
  EXPECT_NE(FindingsOf(other)[0].find("Lost: D1 (25.0 mm) in 1 of 2 phases"), std::string::npos)
    << FindingsOf(other)[0];
}

TEST(Evaluation, WithoutTreesThereAreNoBranchMeasures)
{
  EvaluationInput input;
  input.model = Sphere(10.0, 3);
  input.truth = input.model;
  PhaseEvaluation phase;
  std::vector<std::string> warnings;
  EvaluatePhase(input, {}, phase, warnings);
  EXPECT_NEAR(phase.measures.hausdorff, 0.0, 1e-12);
  EXPECT_TRUE(std::isnan(phase.measures.completenessRatio));
  EXPECT_TRUE(std::isnan(phase.measures.centerlineMean));
  EXPECT_TRUE(std::isnan(phase.measures.found));
  EXPECT_TRUE(std::isnan(phase.measures.falseLength));
}

TEST(Evaluation, RefusesAndStops)
{
  EvaluationInput input;
  input.model = Sphere(10.0, 3);
  input.truth = input.model;
  PhaseEvaluation phase;
  std::vector<std::string> warnings;
  EvaluationSettings settings;
  settings.relevantRadius = std::nan("");
  ExpectRefusal([&] { EvaluatePhase(input, settings, phase, warnings); }, "relevantRadius");
  input.truth.triangles.clear();
  ExpectRefusal([&] { EvaluatePhase(input, {}, phase, warnings); }, "surface B");
  input.truth = input.model;
  EXPECT_THROW(EvaluatePhase(input, {}, phase, warnings, [](double) { return false; }), Cancelled);
}

TEST(Evaluation, MeansAndDeviations)
{
  CaseEvaluation one;
  one.phases = { Phase(0, false, 100.0), Phase(1, true, 2.0), Phase(2, false, 200.0),
    Phase(3, true, 4.0), Phase(5, true, 9.0) };
  const MeasureSummary odd = SummarizePhases(one, true);
  EXPECT_EQ(odd.count, 3);
  EXPECT_DOUBLE_EQ(odd.mean.hausdorff, 5.0);
  EXPECT_DOUBLE_EQ(odd.deviation.hausdorff, std::sqrt(13.0)); // (9 + 1 + 16) / 2
  EXPECT_TRUE(std::isnan(odd.mean.found));
  EXPECT_DOUBLE_EQ(SummarizePhases(one, false).mean.hausdorff, 150.0);
  one.phases.resize(2);
  EXPECT_TRUE(std::isnan(SummarizePhases(one, true).deviation.hausdorff));
  EXPECT_EQ(Summarize({}).count, 0);
}

TEST(Evaluation, ThePapersRowsHaveItsMeans)
{
  // Printed with two digits.
  const MeasureSummary a = SummarizePhases(PaperPartA(), true);
  EXPECT_EQ(a.count, 10);
  EXPECT_NEAR(a.mean.hausdorff, PaperSummaryA().mean.hausdorff, 0.006);
  EXPECT_NEAR(a.mean.msd, PaperSummaryA().mean.msd, 0.006);
  EXPECT_NEAR(a.mean.completenessRatio, PaperSummaryA().mean.completenessRatio, 0.006);
  EXPECT_NEAR(a.mean.continuityScore, PaperSummaryA().mean.continuityScore, 0.006);
  std::vector<EvaluationMeasures> cases;
  for (const PaperCase& one : PaperPartB())
  {
    cases.push_back(one.mean);
  }
  const MeasureSummary b = Summarize(cases);
  EXPECT_EQ(b.count, 5);
  EXPECT_NEAR(b.mean.hausdorff, PaperSummaryB().mean.hausdorff, 0.006);
  EXPECT_NEAR(b.mean.msd, PaperSummaryB().mean.msd, 0.006);
  EXPECT_NEAR(b.mean.completenessRatio, PaperSummaryB().mean.completenessRatio, 0.006);
  EXPECT_NEAR(b.mean.continuityScore, PaperSummaryB().mean.continuityScore, 0.006);
}

TEST(Evaluation, Tables)
{
  CaseEvaluation one;
  one.name = "patient_7, \"left\" & 50%";
  one.phases = { Phase(0, false, 1.25), Phase(1, true, 2.5), Phase(2, false, 3.0) };
  one.phases[2].lost = true;
  one.phases[1].branches.push_back({ 4, "pLAD", 12.5, 1.0, 1.0, 0.3, 0.1 });
  const std::vector<CaseEvaluation> cases = { one, one };

  const std::string csv = EvaluationCsv(cases);
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  const auto commas = std::count(line.begin(), line.end(), ',');
  EXPECT_NE(line.find("HD95_mm"), std::string::npos);
  while (std::getline(lines, line))
  {
    // One more in the quoted name, but for the row over all cases.
    EXPECT_EQ(std::count(line.begin(), line.end(), ','),
      commas + (line.find("patient_7") != std::string::npos ? 1 : 0))
      << line;
  }
  EXPECT_EQ(LinesWith(csv, "\"patient_7, \"\"left\"\" & 50%\""), 16u);
  EXPECT_EQ(LinesWith(csv, ",lost,,,,,,,,,,3.000000,"), 2u); // HD, after what leads
  EXPECT_EQ(LinesWith(csv, "B,"), 4u);
  EXPECT_EQ(csv.find("nan"), std::string::npos);

  const std::string tex = EvaluationLatex(cases);
  EXPECT_NE(tex.find("patient\\_7, \"left\" \\& 50\\%"), std::string::npos);
  EXPECT_EQ(LinesWith(tex, "\\begin{tabular}"), 3u);
  EXPECT_EQ(LinesWith(tex, "\\end{tabular}"), 3u);
  // The paper's phase 1 stands beside ours.
  EXPECT_EQ(LinesWith(tex, "2.50 & 0.25 & 1.00 & -- & 5.75 & 1.49 & 2.50 & 0.83"), 2u);

  const std::string text = EvaluationText(cases);
  EXPECT_EQ(LinesWith(text, "interpolated"), 5u); // two phases, two means, the heading of Part B
  EXPECT_EQ(LinesWith(text, "4.96  1.78  1.82  0.84"), 1u);

  EXPECT_EQ(LinesWith(BranchCsv(cases), ",4,\"pLAD\",12.5000,"), 2u);
}
}
