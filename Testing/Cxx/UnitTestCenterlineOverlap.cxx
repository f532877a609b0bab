// The measures of CAT08 against closed forms, an exhaustive search, and a published pair of lines.

#include "CenterlineOverlap.h"
#include "CoronaryPhantom.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <limits>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>

namespace UnitTestCenterlineOverlap
{
using namespace coronary;

namespace
{
/// From x = first to last, at a height y.
OverlapLine Straight(double first, double last, double y = 0.0, double radius = 1.5)
{
  OverlapLine line;
  const int steps = 40;
  for (int i = 0; i <= steps; ++i)
  {
    line.points.emplace_back(first + (last - first) * i / steps, y, 0.0);
    line.radius.push_back(radius);
  }
  return line;
}

OverlapLine Join(OverlapLine a, const OverlapLine& b)
{
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  a.radius.insert(a.radius.end(), b.radius.begin(), b.radius.end());
  return a;
}

void AddLine(Polylines& set, const OverlapLine& line)
{
  set.lines.emplace_back();
  for (std::size_t i = 0; i < line.points.size(); ++i)
  {
    set.lines.back().push_back(static_cast<std::int64_t>(set.points.size()));
    set.points.push_back(line.points[i]);
    set.radius.push_back(line.radius[i]);
  }
}

OverlapLine Between(const Vector3& a, const Vector3& b, double radiusA, double radiusB)
{
  OverlapLine line;
  const int steps = 30;
  for (int i = 0; i <= steps; ++i)
  {
    const double f = static_cast<double>(i) / steps;
    line.points.emplace_back((1.0 - f) * a + f * b);
    line.radius.push_back((1.0 - f) * radiusA + f * radiusB);
  }
  return line;
}

/// A trunk of 20 mm and two daughters of 30 mm; the second is thinner than the relevant radius but
/// for its first third.
Polylines Fork(bool second = true)
{
  Polylines set;
  const Vector3 fork(20.0, 0.0, 0.0);
  AddLine(set, Between(Vector3::Zero(), fork, 2.0, 2.0));
  AddLine(set, Between(fork, fork + 30.0 * Vector3(0.6, 0.8, 0.0), 1.5, 1.5));
  if (second)
  {
    AddLine(set, Between(fork, fork + 30.0 * Vector3(0.6, -0.8, 0.0), 0.9, 0.45));
  }
  return set;
}

std::string Complaint(const std::function<void()>& call)
{
  try
  {
    call();
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "";
}

std::vector<std::vector<double>> ReadNumbers(const std::string& name)
{
  std::vector<std::vector<double>> rows;
  std::ifstream file(name);
  for (std::string text; std::getline(file, text);)
  {
    std::istringstream words(text);
    rows.emplace_back();
    for (double value = 0.0; words >> value;)
    {
      rows.back().push_back(value);
    }
    if (rows.back().empty())
    {
      rows.pop_back();
    }
  }
  return rows;
}
}

TEST(CenterlineOverlap, ALineIsLikeItself)
{
  const OverlapLine line = Straight(0.0, 60.0);
  const LineOverlap overlap = CompareCenterlines(line, line);
  const CenterlineOverlapMeasures& m = overlap.measures;
  EXPECT_EQ(m.foundReference, 2001);
  EXPECT_EQ(m.missedReference, 0);
  EXPECT_EQ(m.rightResult, 2001);
  EXPECT_EQ(m.falseResult, 0);
  EXPECT_DOUBLE_EQ(m.overlap, 1.0);
  EXPECT_DOUBLE_EQ(m.overlapToFirstError, 1.0);
  EXPECT_DOUBLE_EQ(m.overlapRelevant, 1.0);
  // Every second connection is of length 0, the others of one step.
  EXPECT_NEAR(m.distance, 0.03 * 2000.0 / 4001.0, 1e-9);
  EXPECT_NEAR(m.distanceInside, m.distance, 1e-12);
  EXPECT_NEAR(m.radiusError, 0.0, 1e-12);
  EXPECT_NEAR(m.referenceLength, 60.0, 1e-9);
  for (const CenterlinePointMatch& match : overlap.reference)
  {
    EXPECT_EQ(match.match, CenterlineMatch::TruePositive);
    EXPECT_NEAR(match.distance, 0.0, 1e-9);
  }
  EXPECT_TRUE(std::isnan(overlap.scores.overlap));
}

TEST(CenterlineOverlap, ParallelLines)
{
  const OverlapLine reference = Straight(0.0, 60.0);
  for (const double offset : { 0.2, 1.4, 1.6, 5.0 })
  {
    const CenterlineOverlapMeasures m =
      CompareCenterlines(reference, Straight(0.0, 60.0, offset)).measures;
    const bool inside = offset < 1.5;
    EXPECT_DOUBLE_EQ(m.overlap, inside ? 1.0 : 0.0) << offset;
    EXPECT_DOUBLE_EQ(m.overlapToFirstError, inside ? 1.0 : 0.0);
    EXPECT_DOUBLE_EQ(m.overlapRelevant, inside ? 1.0 : 0.0);
    const double expected = (2001.0 * offset + 2000.0 * std::hypot(offset, 0.03)) / 4001.0;
    EXPECT_NEAR(m.distance, expected, 1e-9);
    EXPECT_NEAR(m.distanceRelevant, expected, 1e-9);
    if (inside)
    {
      EXPECT_NEAR(m.distanceInside, expected, 1e-9);
    }
    else
    {
      EXPECT_TRUE(std::isnan(m.distanceInside));
    }
  }
}

TEST(CenterlineOverlap, AResultThatEndsEarly)
{
  // What lies within a radius of its end is still found.
  const LineOverlap overlap = CompareCenterlines(Straight(0.0, 60.0), Straight(0.0, 30.0));
  const CenterlineOverlapMeasures& m = overlap.measures;
  EXPECT_EQ(m.foundReference, 1051);
  EXPECT_EQ(m.missedReference, 950);
  EXPECT_EQ(m.rightResult, 1001);
  EXPECT_EQ(m.falseResult, 0);
  EXPECT_NEAR(m.overlap, 2052.0 / 3002.0, 1e-12);
  EXPECT_NEAR(m.overlapRelevant, 2052.0 / 3002.0, 1e-12);
  EXPECT_NEAR(m.overlapToFirstError, 1051.0 / 2001.0, 1e-12);
  // Mean of the lengths beyond the end is half of them.
  EXPECT_NEAR(m.distance, 30.0 * 15.0 / 90.0, 0.05);
  EXPECT_EQ(overlap.reference.back().match, CenterlineMatch::FalseNegative);
  EXPECT_NEAR(overlap.reference.back().distance, 30.0, 1e-9);
  EXPECT_EQ(overlap.result.back().match, CenterlineMatch::TruePositive);
}

TEST(CenterlineOverlap, AResultThatRunsOnIsNotHeldAgainstTheRelevantPart)
{
  const CenterlineOverlapMeasures m =
    CompareCenterlines(Straight(0.0, 30.0), Straight(0.0, 60.0)).measures;
  EXPECT_EQ(m.falseResult, 950);
  EXPECT_NEAR(m.overlap, 2052.0 / 3002.0, 1e-12);
  EXPECT_DOUBLE_EQ(m.overlapToFirstError, 1.0);
  EXPECT_DOUBLE_EQ(m.overlapRelevant, 1.0);
  EXPECT_LT(m.distanceRelevant, 0.03);
  EXPECT_GT(m.distance, 4.0);
}

TEST(CenterlineOverlap, RelevantUpToTheLastWideRadius)
{
  // 1.5 mm to 0.5 mm over 60 mm: 0.75 mm at 45 mm. The result leaves at 48 mm.
  OverlapLine reference = Straight(0.0, 60.0);
  for (std::size_t i = 0; i < reference.radius.size(); ++i)
  {
    reference.radius[i] = 1.5 - reference.points[i].x() / 60.0;
  }
  const OverlapLine result = Join(Straight(0.0, 48.0), Straight(48.0, 70.0, 3.0));
  const CenterlineOverlapMeasures m = CompareCenterlines(reference, result).measures;
  EXPECT_LT(m.overlap, 0.85);
  EXPECT_DOUBLE_EQ(m.overlapRelevant, 1.0);
  EXPECT_LT(m.distanceRelevant, 0.03);
  EXPECT_NEAR(m.overlapToFirstError, 48.0 / 60.0, 0.02);
  CenterlineOverlapSettings settings;
  settings.relevantRadius = 0.5;
  EXPECT_NEAR(
    CompareCenterlines(reference, result, settings).measures.overlapRelevant, m.overlap, 0.2);
  EXPECT_LT(CompareCenterlines(reference, result, settings).measures.overlapRelevant, 0.9);
  settings.relevantRadius = 2.0;
  EXPECT_TRUE(std::isnan(CompareCenterlines(reference, result, settings).measures.overlapRelevant));
}

TEST(CenterlineOverlap, ErrorsInTheFirstMillimetresDoNotEndOF)
{
  const OverlapLine reference = Straight(0.0, 60.0);
  const OverlapLine late = Join(Straight(0.0, 4.0, 6.0), Straight(4.0, 60.0));
  CenterlineOverlapSettings settings;
  EXPECT_DOUBLE_EQ(CompareCenterlines(reference, late, settings).measures.overlapToFirstError, 1.0);
  settings.startLength = 0.0;
  EXPECT_LT(CompareCenterlines(reference, late, settings).measures.overlapToFirstError, 0.1);
  settings.startLength = 5.0;
  const OverlapLine later = Join(Straight(0.0, 8.0, 6.0), Straight(8.0, 60.0));
  EXPECT_NEAR(
    CompareCenterlines(reference, later, settings).measures.overlapToFirstError, 5.0 / 60.0, 0.002);
}

TEST(CenterlineOverlap, TheStartInTheAortaIsCutOff)
{
  const OverlapLine reference = Straight(0.0, 60.0);
  const OverlapLine result = Straight(-10.0, 60.0, 0.5);
  const LineOverlap cut = CompareCenterlines(reference, result);
  EXPECT_DOUBLE_EQ(cut.measures.overlap, 1.0);
  EXPECT_NEAR(cut.measures.resultLength, 60.0, 0.031);
  EXPECT_EQ(cut.result.front().match, CenterlineMatch::NotCompared);
  EXPECT_TRUE(std::isnan(cut.result.front().distance));
  CenterlineOverlapSettings settings;
  settings.clipStart = false;
  EXPECT_LT(CompareCenterlines(reference, result, settings).measures.overlap, 0.95);
  // A line that passes beyond the disc is not cut.
  const OverlapLine beside = Straight(-10.0, 60.0, 3.2);
  EXPECT_NEAR(CompareCenterlines(reference, beside).measures.resultLength, 70.0, 1e-9);
}

TEST(CenterlineOverlap, TheLeastSumOfAllCorrespondences)
{
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int test = 0; test < 40; ++test)
  {
    // Steps of 1, so that samples are the points.
    const auto walk = [&](int count)
    {
      OverlapLine line;
      Vector3 p(uniform(random), uniform(random), uniform(random));
      for (int i = 0; i < count; ++i)
      {
        line.points.push_back(p);
        line.radius.push_back(1.0);
        p[static_cast<int>(3.0 * uniform(random)) % 3] += 1.0;
      }
      return line;
    };
    const OverlapLine a = walk(6);
    const OverlapLine b = walk(5);
    const std::function<double(int, int)> minimum = [&](int i, int j) -> double
    {
      const double here = (a.points[i] - b.points[j]).norm();
      if (i == 0 && j == 0)
      {
        return here;
      }
      double before = std::numeric_limits<double>::infinity();
      before = i > 0 ? std::min(before, minimum(i - 1, j)) : before;
      before = j > 0 ? std::min(before, minimum(i, j - 1)) : before;
      return before + here;
    };
    CenterlineOverlapSettings settings;
    settings.spacing = 1.0;
    settings.clipStart = false;
    EXPECT_NEAR(CompareCenterlines(a, b, settings).measures.distance * 10.0, minimum(5, 4), 1e-9);
  }
}

TEST(CenterlineOverlap, PublishedScores)
{
  const std::string folder = std::string(DYNAMICCORONARY_DATA_DIR) + "/cat08/";
  const std::vector<std::vector<double>> referenceRows = ReadNumbers(folder + "reference.txt");
  const std::vector<std::vector<double>> resultRows = ReadNumbers(folder + "infer.txt");
  if (referenceRows.empty() || resultRows.empty())
  {
    GTEST_SKIP() << "no " << folder << "reference.txt and infer.txt (DYNAMICCORONARY_DATA_DIR)";
  }
  OverlapLine reference;
  OverlapLine result;
  ObserverAgreement observers;
  for (const std::vector<double>& row : referenceRows)
  {
    ASSERT_EQ(row.size(), 5U);
    reference.points.emplace_back(row[0], row[1], row[2]);
    reference.radius.push_back(row[3]);
    observers.distance.push_back(row[4]);
  }
  for (const std::vector<double>& row : resultRows)
  {
    ASSERT_EQ(row.size(), 3U);
    result.points.emplace_back(row[0], row[1], row[2]);
  }
  // Dataset 1, vessel 0.
  for (const std::vector<double>& row : ReadNumbers(folder + "observerscores.txt"))
  {
    if (row[0] == 1.0 && row[1] == 0.0)
    {
      observers.overlap = row[2];
      observers.overlapToFirstError = row[3];
      observers.overlapRelevant = row[4];
    }
  }
  const LineOverlap overlap = CompareCenterlines(reference, result, {}, observers);
  const CenterlineOverlapMeasures& m = overlap.measures;
  EXPECT_NEAR(m.overlap, 0.988593, 1e-3);
  EXPECT_NEAR(m.overlapToFirstError, 0.999866, 1e-3);
  EXPECT_NEAR(m.overlapRelevant, 1.0, 1e-3);
  EXPECT_NEAR(m.distance, 0.365915, 1e-3);
  EXPECT_NEAR(m.distanceInside, 0.333389, 1e-3);
  EXPECT_NEAR(m.distanceRelevant, 0.333210, 1e-3);
  EXPECT_TRUE(std::isnan(m.radiusError));
  EXPECT_NEAR(overlap.scores.overlap, 49.5687, 0.05);
  EXPECT_NEAR(overlap.scores.overlapToFirstError, 100.0, 1e-9);
  EXPECT_NEAR(overlap.scores.overlapRelevant, 100.0, 1e-9);
  EXPECT_NEAR(overlap.scores.distance, 34.3251, 0.05);
  EXPECT_NEAR(overlap.scores.distanceInside, 34.6081, 0.05);
  EXPECT_NEAR(overlap.scores.distanceRelevant, 34.5691, 0.05);
  std::printf("OV %.6f OF %.6f OT %.6f AD %.6f AI %.6f AT %.6f; scores %.4f %.4f %.4f %.4f %.4f "
              "%.4f\n",
    m.overlap, m.overlapToFirstError, m.overlapRelevant, m.distance, m.distanceInside,
    m.distanceRelevant, overlap.scores.overlap, overlap.scores.overlapToFirstError,
    overlap.scores.overlapRelevant, overlap.scores.distance, overlap.scores.distanceInside,
    overlap.scores.distanceRelevant);
}

TEST(CenterlineOverlap, ScoresAreFiftyForAnObserver)
{
  const OverlapLine reference = Straight(0.0, 60.0);
  ObserverAgreement observers;
  observers.distance.assign(reference.points.size(), 0.4);
  const CenterlineOverlapScores equal =
    CompareCenterlines(reference, Straight(0.0, 60.0, 0.4), {}, observers).scores;
  EXPECT_NEAR(equal.distance, 50.0, 0.2);
  EXPECT_TRUE(std::isnan(equal.overlap));
  EXPECT_NEAR(
    CompareCenterlines(reference, Straight(0.0, 60.0, 0.1), {}, observers).scores.distance, 87.5,
    0.5);
  EXPECT_NEAR(
    CompareCenterlines(reference, Straight(0.0, 60.0, 0.8), {}, observers).scores.distance, 25.0,
    0.2);
  observers.overlap = 2052.0 / 3002.0;
  EXPECT_NEAR(
    CompareCenterlines(reference, Straight(0.0, 30.0), {}, observers).scores.overlap, 50.0, 1e-9);
  observers.overlap = 0.5;
  EXPECT_NEAR(CompareCenterlines(reference, Straight(0.0, 30.0), {}, observers).scores.overlap,
    50.0 + 50.0 * (2052.0 / 3002.0 - 0.5) / 0.5, 1e-9);
}

TEST(CenterlineOverlap, RadiusErrors)
{
  const CenterlineOverlapMeasures m =
    CompareCenterlines(Straight(0.0, 60.0), Straight(0.0, 60.0, 0.2, 1.2)).measures;
  EXPECT_NEAR(m.radiusError, 0.3, 1e-9);
  EXPECT_NEAR(m.radiusBias, -0.3, 1e-9);
}

TEST(CenterlineOverlap, NothingOnOneSide)
{
  const OverlapLine line = Straight(0.0, 60.0);
  for (const OverlapLine& nothing : { OverlapLine(), OverlapLine{ { Vector3::Zero() }, { 1.0 } },
         OverlapLine{ { Vector3::Ones(), Vector3::Ones() }, { 1.0, 1.0 } } })
  {
    const CenterlineOverlapMeasures missed = CompareCenterlines(line, nothing).measures;
    EXPECT_EQ(missed.missedReference, 2001);
    EXPECT_DOUBLE_EQ(missed.overlap, 0.0);
    EXPECT_DOUBLE_EQ(missed.overlapToFirstError, 0.0);
    EXPECT_DOUBLE_EQ(missed.overlapRelevant, 0.0);
    EXPECT_TRUE(std::isnan(missed.distance));
    const CenterlineOverlapMeasures none = CompareCenterlines(nothing, line).measures;
    EXPECT_TRUE(std::isnan(none.overlap));
    EXPECT_EQ(none.foundReference + none.missedReference, 0);
  }
  EXPECT_TRUE(std::isnan(CompareCenterlineTrees({}, {}).total.overlap));
  EXPECT_TRUE(std::isnan(CompareCenterlinePaths({}, {}).total.overlap));
  const TreeOverlap strays = CompareCenterlineTrees({}, Fork());
  EXPECT_DOUBLE_EQ(strays.total.overlap, 0.0);
  EXPECT_NEAR(strays.longestFalse, 50.0, 0.05);
  const TreeOverlap missed = CompareCenterlineTrees(Fork(), {});
  EXPECT_DOUBLE_EQ(missed.total.overlap, 0.0);
  EXPECT_DOUBLE_EQ(missed.total.overlapToFirstError, 0.0);
  EXPECT_TRUE(std::isnan(missed.total.distance));
  EXPECT_NEAR(missed.longestMissed, 50.0, 0.05);
  EXPECT_DOUBLE_EQ(CompareCenterlinePaths(Fork(), {}).total.overlap, 0.0);
}

TEST(CenterlineTreeOverlap, ATreeIsLikeItself)
{
  const Polylines tree = Fork();
  for (const TreeOverlap& overlap :
    { CompareCenterlineTrees(tree, tree), CompareCenterlinePaths(tree, tree) })
  {
    EXPECT_DOUBLE_EQ(overlap.total.overlap, 1.0);
    EXPECT_DOUBLE_EQ(overlap.total.overlapToFirstError, 1.0);
    EXPECT_DOUBLE_EQ(overlap.total.overlapRelevant, 1.0);
    EXPECT_LT(overlap.total.distance, 0.03);
    EXPECT_EQ(overlap.longestFalse, 0.0);
    EXPECT_EQ(overlap.longestMissed, 0.0);
    for (const CenterlinePointMatch& match : overlap.result)
    {
      EXPECT_EQ(match.match, CenterlineMatch::TruePositive);
    }
  }
  EXPECT_EQ(CompareCenterlineTrees(tree, tree).rows.size(), 3U);
  const TreeOverlap paths = CompareCenterlinePaths(tree, tree);
  ASSERT_EQ(paths.rows.size(), 2U);
  EXPECT_EQ(paths.rows[0].lines, (std::vector<std::int64_t>{ 0, 1 }));
  EXPECT_EQ(paths.rows[1].lines, (std::vector<std::int64_t>{ 0, 2 }));
  EXPECT_EQ(paths.rows[1].resultLines, (std::vector<std::int64_t>{ 0, 2 }));
  EXPECT_NEAR(paths.rows[0].measures.referenceLength, 50.0, 1e-6);
}

TEST(CenterlineTreeOverlap, AMissingBranch)
{
  const TreeOverlap overlap = CompareCenterlineTrees(Fork(), Fork(false));
  ASSERT_EQ(overlap.rows.size(), 3U);
  // 667 + 1 samples of the trunk, 1001 of each daughter; of the missing one only what lies within
  // its own radius of the others: s sin(53 deg) < r up to s = 1.1 mm or so (before the other
  // daughter's and the trunk's end turn away).
  EXPECT_DOUBLE_EQ(overlap.rows[0].measures.overlap, 1.0);
  EXPECT_DOUBLE_EQ(overlap.rows[1].measures.overlap, 1.0);
  const CenterlineOverlapMeasures& missing = overlap.rows[2].measures;
  EXPECT_EQ(missing.foundReference + missing.missedReference, 1001);
  EXPECT_NEAR(static_cast<double>(missing.foundReference) * 0.03, 0.9, 0.2);
  EXPECT_EQ(overlap.total.falseResult, 0);
  const double expected = 1.0 -
    static_cast<double>(missing.missedReference) /
      static_cast<double>(668 + 1001 + 1001 + 668 + 1001);
  EXPECT_NEAR(overlap.total.overlap, expected, 1e-12);
  EXPECT_NEAR(overlap.longestMissed, 29.1, 0.2);
  // Reached from the root: everything but the missing branch.
  EXPECT_NEAR(overlap.total.overlapToFirstError,
    1.0 - static_cast<double>(missing.missedReference) / (668.0 + 2002.0), 1e-12);
  // Of the thin daughter the first third is relevant.
  EXPECT_GT(overlap.total.overlapRelevant, overlap.total.overlap);
  EXPECT_EQ(overlap.reference.back().match, CenterlineMatch::FalseNegative);
  // Paths: the second path is compared with the first one's, and only the trunk agrees.
  const TreeOverlap paths = CompareCenterlinePaths(Fork(), Fork(false));
  ASSERT_EQ(paths.rows.size(), 2U);
  EXPECT_DOUBLE_EQ(paths.rows[0].measures.overlap, 1.0);
  EXPECT_NEAR(paths.rows[1].measures.overlap, 0.42, 0.03);
  EXPECT_EQ(paths.rows[1].resultLines, (std::vector<std::int64_t>{ 0, 1 }));
}

TEST(CenterlineTreeOverlap, AFalseBranch)
{
  Polylines result = Fork();
  // Upwards from the middle of the trunk: 2 mm of it are in the lumen.
  AddLine(result, Between(Vector3(10.0, 0.0, 0.0), Vector3(10.0, 0.0, 12.0), 1.0, 1.0));
  const TreeOverlap overlap = CompareCenterlineTrees(Fork(), result);
  EXPECT_NEAR(static_cast<double>(overlap.total.falseResult) * 0.03, 10.0, 0.05);
  EXPECT_EQ(overlap.rows[0].measures.falseResult, overlap.total.falseResult);
  EXPECT_EQ(overlap.total.missedReference, 0);
  EXPECT_DOUBLE_EQ(overlap.total.overlapToFirstError, 1.0);
  EXPECT_LT(overlap.total.overlapRelevant, 0.95);
  EXPECT_NEAR(overlap.longestFalse, 10.0, 0.05);
  EXPECT_EQ(overlap.result.back().match, CenterlineMatch::FalsePositive);
  EXPECT_NEAR(overlap.result.back().distance, 12.0, 1e-6);
  // No path of the reference goes there.
  EXPECT_DOUBLE_EQ(CompareCenterlinePaths(Fork(), result).total.overlap, 1.0);
}

TEST(CenterlineTreeOverlap, AFalseWayRunsOverSeveralLines)
{
  Polylines result = Fork();
  const Vector3 start(10.0, 0.0, 0.0);
  const Vector3 middle(10.0, 0.0, 6.0);
  AddLine(result, Between(start, middle, 1.0, 1.0));
  AddLine(result, Between(middle, Vector3(10.0, 0.0, 12.0), 1.0, 1.0));
  AddLine(result, Between(middle, Vector3(10.0, 4.0, 6.0), 1.0, 1.0));
  EXPECT_NEAR(CompareCenterlineTrees(Fork(), result).longestFalse, 10.0, 0.05);
}

TEST(CenterlineTreeOverlap, RowsAddUpToTheTotal)
{
  Polylines result = Fork();
  for (Vector3& p : result.points)
  {
    p += Vector3(0.3, 0.4, 0.5);
  }
  for (double& radius : result.radius)
  {
    radius += 0.1;
  }
  const TreeOverlap overlap = CompareCenterlineTrees(Fork(), result);
  std::int64_t reference = 0;
  std::int64_t right = 0;
  double length = 0.0;
  for (const TreeOverlapRow& row : overlap.rows)
  {
    reference += row.measures.foundReference + row.measures.missedReference;
    right += row.measures.rightResult;
    length += row.measures.resultLength;
  }
  EXPECT_EQ(reference, overlap.total.foundReference + overlap.total.missedReference);
  EXPECT_EQ(right, overlap.total.rightResult);
  EXPECT_NEAR(length, 80.0, 0.01);
  EXPECT_NEAR(overlap.total.resultLength, length, 1e-9);
  // Along the trunk the offset is seen from the side.
  EXPECT_NEAR(overlap.rows[0].measures.distance, std::hypot(0.4, 0.5), 0.02);
  EXPECT_NEAR(overlap.total.radiusBias, 0.1, 0.03);
}

TEST(CenterlineTreeOverlap, ThinEndsAreNotRelevant)
{
  // The thin daughter is relevant for 10 of its 30 mm; the result ends after 12.
  Polylines result = Fork(false);
  const Vector3 fork(20.0, 0.0, 0.0);
  AddLine(result, Between(fork, fork + 12.0 * Vector3(0.6, -0.8, 0.0), 0.9, 0.8));
  const TreeOverlap overlap = CompareCenterlineTrees(Fork(), result);
  EXPECT_DOUBLE_EQ(overlap.total.overlapRelevant, 1.0);
  EXPECT_LT(overlap.total.overlap, 0.95);
  // A result that runs on beyond the reference's end is false, but not in the relevant part.
  Polylines longer = Fork(false);
  AddLine(longer, Between(fork, fork + 12.0 * Vector3(0.6, -0.8, 0.0), 0.9, 0.8));
  const TreeOverlap beyond = CompareCenterlineTrees(result, Fork());
  EXPECT_DOUBLE_EQ(beyond.total.overlapRelevant, 1.0);
  EXPECT_GT(beyond.total.falseResult, 0);
}

TEST(CenterlineTreeOverlap, ThinVesselsCanBeLeftOut)
{
  CenterlineOverlapSettings settings;
  settings.minimumRadius = 0.75;
  // The thin daughter counts for 10 of its 30 mm, and is missing.
  const TreeOverlap missing = CompareCenterlineTrees(Fork(), Fork(false), settings);
  EXPECT_NEAR(missing.rows[2].measures.referenceLength, 10.0, 0.1);
  EXPECT_NEAR(missing.total.referenceLength, 60.0, 0.1);
  EXPECT_NEAR(missing.longestMissed, 9.0, 0.3);
  EXPECT_EQ(missing.reference.back().match, CenterlineMatch::NotCompared);
  // What is off the course there is neither right nor wrong; elsewhere it is.
  Polylines result = Fork();
  const Vector3 thin = result.points[result.lines[2][25]];
  const Vector3 wide = result.points[result.lines[1][25]];
  AddLine(result, Between(thin, thin + Vector3(0.0, 0.0, 12.0), 0.5, 0.5));
  EXPECT_DOUBLE_EQ(CompareCenterlineTrees(Fork(), result, settings).total.overlap, 1.0);
  EXPECT_EQ(CompareCenterlineTrees(Fork(), result, settings).longestFalse, 0.0);
  AddLine(result, Between(wide, wide + Vector3(0.0, 0.0, 12.0), 0.5, 0.5));
  EXPECT_LT(CompareCenterlineTrees(Fork(), result, settings).total.overlap, 0.95);
  EXPECT_NEAR(CompareCenterlineTrees(Fork(), result, settings).longestFalse, 10.5, 0.05);
  settings.minimumRadius = -1.0;
  EXPECT_NE(Complaint([&] { CompareCenterlineTrees({}, {}, settings); }).find("the least radius"),
    std::string::npos);
}

TEST(CenterlineTreeOverlap, LinesHangTogetherByIndexAndByPosition)
{
  // The fork with shared points, its daughters one after the other from the middle of a line.
  Polylines shared;
  for (int i = 0; i <= 50; ++i)
  {
    shared.points.emplace_back(i, 0.0, 0.0);
  }
  for (int i = 1; i <= 20; ++i)
  {
    shared.points.emplace_back(20.0, i, 0.0);
  }
  shared.radius.assign(shared.points.size(), 1.0);
  shared.lines.resize(2);
  for (int i = 0; i <= 50; ++i)
  {
    shared.lines[0].push_back(i);
  }
  shared.lines[1].push_back(20);
  for (int i = 51; i <= 70; ++i)
  {
    shared.lines[1].push_back(i);
  }
  Polylines split;
  AddLine(split, Between({ 20.0, 0.0, 0.0 }, { 50.0, 0.0, 0.0 }, 1.0, 1.0));
  AddLine(split, Between({ 20.0, 0.0, 0.0 }, { 20.0, 20.0, 0.0 }, 1.0, 1.0));
  AddLine(split, Between({ 0.0, 0.0, 0.0 }, { 20.0, 0.0, 0.0 }, 1.0, 1.0));
  const TreeOverlap there = CompareCenterlinePaths(shared, split);
  const TreeOverlap back = CompareCenterlinePaths(split, shared);
  ASSERT_EQ(there.rows.size(), 2U);
  ASSERT_EQ(back.rows.size(), 2U);
  EXPECT_DOUBLE_EQ(there.total.overlap, 1.0);
  EXPECT_DOUBLE_EQ(back.total.overlap, 1.0);
  EXPECT_EQ(there.rows[1].lines, (std::vector<std::int64_t>{ 0, 1 }));
  EXPECT_EQ(there.rows[1].resultLines, (std::vector<std::int64_t>{ 2, 1 }));
  EXPECT_NEAR(there.rows[1].measures.referenceLength, 40.0, 1e-9);
  EXPECT_NEAR(back.rows[0].measures.resultLength, 50.0, 1e-9);
  EXPECT_DOUBLE_EQ(CompareCenterlineTrees(shared, split).total.overlap, 1.0);
}

TEST(CenterlineTreeOverlap, WholePathsOnTopOfEachOther)
{
  // VMTK's form: one line a path. Lines that begin in each other must not hang up the search.
  Polylines paths;
  const Polylines fork = Fork();
  for (const int daughter : { 1, 2 })
  {
    paths.lines.emplace_back();
    for (const int line : { 0, daughter })
    {
      for (const std::int64_t point : fork.lines[line])
      {
        paths.lines.back().push_back(static_cast<std::int64_t>(paths.points.size()));
        paths.points.push_back(fork.points[point]);
        paths.radius.push_back(fork.radius[point]);
      }
    }
  }
  const TreeOverlap overlap = CompareCenterlinePaths(fork, paths);
  EXPECT_DOUBLE_EQ(overlap.total.overlap, 1.0);
  ASSERT_EQ(overlap.rows.size(), 2U);
  EXPECT_EQ(overlap.rows[1].resultLines, (std::vector<std::int64_t>{ 1 }));

  Polylines ring;
  const auto corner = [](double angle)
  { return Vector3(10.0 * std::cos(angle), 10.0 * std::sin(angle), 0.0); };
  AddLine(ring, Between(corner(0.0), corner(2.0), 1.0, 1.0));
  AddLine(ring, Between(corner(2.0), corner(4.0), 1.0, 1.0));
  AddLine(ring, Between(corner(4.0), corner(0.0), 1.0, 1.0));
  EXPECT_DOUBLE_EQ(CompareCenterlineTrees(ring, ring).total.overlap, 1.0);
  EXPECT_NO_THROW(CompareCenterlinePaths(ring, ring));
}

TEST(CenterlineTreeOverlap, PhantomTreesAndTheUnit)
{
  PhantomSettings settings;
  settings.seed = 3;
  const Polylines truth = LinesOf(CoronaryPhantom(settings).Tree(0.75));
  settings.centerlineSpacing = 1.0;
  const Polylines coarse = LinesOf(CoronaryPhantom(settings).Tree(0.75));
  const TreeOverlap overlap = CompareCenterlineTrees(truth, coarse);
  EXPECT_GT(overlap.total.overlap, 0.9999);
  EXPECT_LT(overlap.total.distance, 0.05);
  EXPECT_LT(overlap.total.radiusError, 0.02);
  EXPECT_EQ(overlap.rows.size(), truth.lines.size());

  // The same in metres, turned and shifted, on one thread.
  const auto move = [](Polylines set)
  {
    const Matrix3 turn = Eigen::AngleAxisd(1.1, Vector3(1.0, 2.0, -1.0).normalized()).matrix();
    for (Vector3& p : set.points)
    {
      p = 1e-3 * (turn * p + Vector3(500.0, -300.0, 200.0));
    }
    for (double& radius : set.radius)
    {
      radius *= 1e-3;
    }
    return set;
  };
  CenterlineOverlapSettings metres;
  metres.spacing *= 1e-3;
  metres.relevantRadius *= 1e-3;
  metres.startLength *= 1e-3;
  Polylines shifted = coarse;
  for (Vector3& p : shifted.points)
  {
    p += Vector3(0.7, 0.0, 0.0);
  }
  const TreeOverlap original = CompareCenterlineTrees(truth, shifted);
  SetNumberOfThreads(1);
  const TreeOverlap single = CompareCenterlineTrees(truth, shifted);
  SetNumberOfThreads(0);
  EXPECT_EQ(original.total.foundReference, single.total.foundReference);
  EXPECT_EQ(original.total.distance, single.total.distance);
  const TreeOverlap moved = CompareCenterlineTrees(move(truth), move(shifted), metres);
  EXPECT_LT(original.total.overlap, 0.95);
  EXPECT_NEAR(moved.total.overlap, original.total.overlap, 1e-4);
  EXPECT_NEAR(1e3 * moved.total.distance, original.total.distance, 1e-4);
}

TEST(CenterlineOverlap, WhatCanNotBeUsedIsNamed)
{
  const OverlapLine line = Straight(0.0, 10.0);
  const auto expect = [](const std::string& part, const std::function<void()>& call)
  { EXPECT_NE(Complaint(call).find(part), std::string::npos) << Complaint(call); };
  for (const double bad : { 0.0, -1.0, std::numeric_limits<double>::quiet_NaN() })
  {
    CenterlineOverlapSettings settings;
    settings.spacing = bad;
    expect("the spacing must be positive", [&] { CompareCenterlines(line, line, settings); });
    expect("the spacing must be positive", [&] { CompareCenterlineTrees({}, {}, settings); });
  }
  CenterlineOverlapSettings settings;
  settings.relevantRadius = -0.1;
  expect(
    "the relevant radius must be 0 or more", [&] { CompareCenterlines(line, line, settings); });
  settings = {};
  settings.spacing = 1e-8;
  expect("spacing", [&] { CompareCenterlines(line, line, settings); });
  settings.spacing = 1e-5;
  expect("take a larger spacing", [&] { CompareCenterlines(line, line, settings); });
  OverlapLine bad = line;
  bad.radius.pop_back();
  expect("the reference has 40 radii for 41 points", [&] { CompareCenterlines(bad, line); });
  bad = line;
  bad.radius[3] = -1.0;
  expect("radius of point 3 of the result", [&] { CompareCenterlines(line, bad); });
  bad = line;
  bad.points[5].y() = std::numeric_limits<double>::infinity();
  expect("point 5 of the reference is not finite", [&] { CompareCenterlines(bad, line); });
  ObserverAgreement observers;
  observers.distance = { 1.0 };
  expect("observer distances", [&] { CompareCenterlines(line, line, {}, observers); });
  Polylines set = Fork();
  set.lines[1][4] = 4711;
  expect("line 1 of the result refers to point 4711", [&] { CompareCenterlineTrees(Fork(), set); });
  expect("line 1 of the reference", [&] { CompareCenterlinePaths(set, Fork()); });
}

TEST(CenterlineOverlap, Cancel)
{
  const OverlapLine line = Straight(0.0, 60.0);
  const auto stop = [](double fraction) { return fraction < 0.3; };
  EXPECT_THROW(CompareCenterlines(line, line, {}, {}, stop), Cancelled);
  EXPECT_THROW(CompareCenterlineTrees(Fork(), Fork(), {}, stop), Cancelled);
  EXPECT_THROW(CompareCenterlinePaths(Fork(), Fork(), {}, stop), Cancelled);
  double last = 0.0;
  CompareCenterlineTrees(Fork(), Fork(), {},
    [&](double fraction)
    {
      EXPECT_GE(fraction, last);
      last = fraction;
      return true;
    });
  EXPECT_EQ(last, 1.0);
}
}
