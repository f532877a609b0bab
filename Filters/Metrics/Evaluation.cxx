#include "Evaluation.h"

#include "Median.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
using Measures = EvaluationMeasures;

constexpr double SampleDistance = 0.25; // mm

/// Lines cut into short pieces, and how far each is from other lines.
struct LineSamples
{
  std::vector<Vector3> middle;
  std::vector<std::size_t> line;  ///< number of the line that it is a piece of
  std::vector<double> length;     ///< mm
  std::vector<double> radius;     ///< infinite where none is known
  std::vector<double> confidence; ///< NaN where none is known
  std::vector<double> distance;   ///< of the middle from the other lines; infinite without any
  std::vector<double>
    otherRadius; ///< at the nearest place of the other lines; 0 where none is known
};

LineSamples SamplesOf(const Polylines& lines, const std::vector<double>& confidence)
{
  LineSamples samples;
  for (std::size_t number = 0; number < lines.lines.size(); ++number)
  {
    const auto& line = lines.lines[number];
    for (std::size_t i = 1; i < line.size(); ++i)
    {
      const auto a = static_cast<std::size_t>(line[i - 1]);
      const auto b = static_cast<std::size_t>(line[i]);
      const double length = (lines.points[b] - lines.points[a]).norm();
      const int parts = std::max(1, static_cast<int>(std::ceil(length / SampleDistance)));
      for (int part = 0; part < parts; ++part)
      {
        const double t = (part + 0.5) / parts;
        const auto between = [&](const std::vector<double>& values, double nothing)
        { return values.empty() ? nothing : (1.0 - t) * values[a] + t * values[b]; };
        samples.middle.emplace_back((1.0 - t) * lines.points[a] + t * lines.points[b]);
        samples.line.push_back(number);
        samples.length.push_back(length / parts);
        samples.radius.push_back(between(lines.radius, std::numeric_limits<double>::infinity()));
        samples.confidence.push_back(between(confidence, Measures::NaN));
      }
    }
  }
  return samples;
}

void MeasureDistances(LineSamples& samples, const Polylines& others)
{
  struct Segment
  {
    Vector3 a;
    Vector3 b;
    double radius;
  };
  std::vector<Segment> segments;
  for (const auto& line : others.lines)
  {
    for (std::size_t i = 1; i < line.size(); ++i)
    {
      const auto a = static_cast<std::size_t>(line[i - 1]);
      const auto b = static_cast<std::size_t>(line[i]);
      segments.push_back({ others.points[a], others.points[b],
        others.radius.empty() ? 0.0 : std::max(others.radius[a], others.radius[b]) });
    }
  }
  samples.distance.assign(samples.middle.size(), std::numeric_limits<double>::infinity());
  samples.otherRadius.assign(samples.middle.size(), 0.0);
  ParallelFor(static_cast<std::int64_t>(samples.middle.size()), 64,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t number = first; number < last; ++number)
      {
        const auto i = static_cast<std::size_t>(number);
        double minimum = std::numeric_limits<double>::infinity();
        for (const Segment& segment : segments)
        {
          const double squared =
            NearestOnSegment(samples.middle[i], segment.a, segment.b).squaredDistance;
          if (squared < minimum)
          {
            minimum = squared;
            samples.otherRadius[i] = segment.radius;
          }
        }
        samples.distance[i] = std::sqrt(minimum);
      }
    });
}

/// Of the truth: what of it was found, by radius, and how far the model's centerline is.
void MeasureFound(
  const LineSamples& truth, const EvaluationSettings& settings, EvaluationMeasures& m)
{
  const auto found = [&](double minimumRadius)
  {
    double length = 0.0;
    double covered = 0.0;
    for (std::size_t i = 0; i < truth.middle.size(); ++i)
    {
      if (truth.radius[i] >= minimumRadius)
      {
        // Without a radius the tolerance alone counts.
        const double radius = std::isfinite(truth.radius[i]) ? truth.radius[i] : 0.0;
        length += truth.length[i];
        covered += truth.distance[i] <= std::max(settings.branches.tolerance, radius)
          ? truth.length[i]
          : 0.0;
      }
    }
    return length > 0.0 ? covered / length : Measures::NaN;
  };
  m.found = found(0.0);
  m.foundHalf = found(0.5);
  m.foundWide = found(1.0);
  std::vector<double> distances;
  double sum = 0.0;
  double length = 0.0;
  for (std::size_t i = 0; i < truth.middle.size(); ++i)
  {
    if (truth.radius[i] >= settings.relevantRadius)
    {
      distances.push_back(truth.distance[i]);
      sum += truth.length[i] * truth.distance[i];
      length += truth.length[i];
    }
  }
  if (length > 0.0)
  {
    m.centerlineMean = sum / length;
    m.centerline95 = InclusiveQuantileOf(std::move(distances), 0.95);
  }
}

/// Of the model: what of it is no vessel.
void MeasureFalse(
  const LineSamples& model, const EvaluationInput& input, double tolerance, PhaseEvaluation& phase)
{
  EvaluationMeasures& m = phase.measures;
  m.falseLength = 0.0;
  m.falseConfident = input.modelConfidence.empty() ? Measures::NaN : 0.0;
  struct Sum
  {
    double length = 0.0;
    double wrong = 0.0;
    double confidence = 0.0;
  };
  std::vector<Sum> sums(input.modelTree.lines.size());
  for (std::size_t i = 0; i < model.middle.size(); ++i)
  {
    const double radius = std::isfinite(model.radius[i]) ? model.radius[i] : 0.0;
    const bool wrong = model.distance[i] > std::max({ tolerance, radius, model.otherRadius[i] });
    Sum& sum = sums[model.line[i]];
    sum.length += model.length[i];
    sum.confidence += model.length[i] * model.confidence[i];
    if (wrong)
    {
      sum.wrong += model.length[i];
      m.falseLength += model.length[i];
      m.falseConfident += model.confidence[i] < ConfidentFrom ? 0.0 : model.length[i];
    }
  }
  for (std::size_t line = 0; line < sums.size(); ++line)
  {
    const Sum& sum = sums[line];
    if (sum.wrong > 0.5 * sum.length)
    {
      FalseBranch branch;
      branch.group = input.modelTree.groups.empty() ? static_cast<std::int64_t>(line)
                                                    : input.modelTree.groups[line];
      const auto label = input.modelLabels.find(branch.group);
      branch.label = label == input.modelLabels.end() ? std::string() : label->second;
      branch.length = sum.length;
      branch.confidence = sum.confidence / sum.length;
      phase.falseBranches.push_back(branch);
    }
  }
}

EvaluationMeasures PaperMeasures(double hd, double msd, double bcr, double bcs)
{
  EvaluationMeasures m;
  m.hausdorff = hd;
  m.msd = msd;
  m.completenessRatio = bcr;
  m.continuityScore = bcs;
  return m;
}

/// A number with so many digits behind the point; nothing where there is none.
std::string Number(double value, int digits, const char* nothing = "")
{
  if (!std::isfinite(value))
  {
    return nothing;
  }
  char text[64];
  std::snprintf(text, sizeof(text), "%.*f", digits, value);
  return text;
}

std::string Csv(const std::string& text)
{
  std::string quoted = "\"";
  for (const char c : text)
  {
    quoted += c == '"' ? "\"\"" : std::string(1, c);
  }
  return quoted + "\"";
}

std::string Tex(const std::string& text)
{
  std::string escaped;
  for (const char c : text)
  {
    switch (c)
    {
      case '\\':
        escaped += "\\textbackslash{}";
        break;
      case '~':
        escaped += "\\textasciitilde{}";
        break;
      case '^':
        escaped += "\\textasciicircum{}";
        break;
      case '#':
      case '$':
      case '%':
      case '&':
      case '_':
      case '{':
      case '}':
        escaped += '\\';
        escaped += c;
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

void AddCsvRow(std::string& table, const std::string& part, const std::string& name,
  const std::string& phase, const std::string& fraction, const std::string& kind,
  const EvaluationMeasures& measures)
{
  table += part + "," + Csv(name) + "," + phase + "," + fraction + "," + kind;
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    table += "," + Number(measures.*column.value, 6);
  }
  table += "\n";
}

/// What leads: the share that was found, the mean of both sides, HD95.
std::string LeadingTexCells(const EvaluationMeasures& m)
{
  return " & " + Number(m.found, 3, "--") + " & " + Number(m.assd, 2, "--") + " & " +
    Number(m.hausdorff95, 2, "--");
}

/// The four measures of the paper.
std::string TexCells(const EvaluationMeasures& m)
{
  return " & " + Number(m.hausdorff, 2, "--") + " & " + Number(m.msd, 2, "--") + " & " +
    Number(m.completenessRatio, 2, "--") + " & " + Number(m.continuityScore, 2, "--");
}

int WidthOf(const EvaluationColumn& column)
{
  return std::max(6, static_cast<int>(std::string(column.key).size()));
}

std::string TextCells(const EvaluationMeasures& m)
{
  std::string line;
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    if (column.brief)
    {
      char cell[32];
      std::snprintf(
        cell, sizeof(cell), " %*s", WidthOf(column), Number(m.*column.value, 3, "-").c_str());
      line += cell;
    }
  }
  return line;
}

std::string PaperCells(const EvaluationMeasures& m)
{
  char line[96];
  std::snprintf(line, sizeof(line), "   | %5s %5s %5s %5s", Number(m.hausdorff, 2, "-").c_str(),
    Number(m.msd, 2, "-").c_str(), Number(m.completenessRatio, 2, "-").c_str(),
    Number(m.continuityScore, 2, "-").c_str());
  return line;
}

std::string TextHead(const char* first)
{
  char cell[128];
  std::snprintf(cell, sizeof(cell), "%-28s", first);
  std::string line = cell;
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    if (column.brief)
    {
      std::snprintf(cell, sizeof(cell), " %*s", WidthOf(column), column.key);
      line += cell;
    }
  }
  return line + "   |    HD   MSD   BCR   BCS (paper)\n";
}

std::string TextRow(
  const std::string& name, const EvaluationMeasures& m, const EvaluationMeasures& paper)
{
  char cell[128];
  std::snprintf(cell, sizeof(cell), "%-28s", name.c_str());
  return cell + TextCells(m) + PaperCells(paper) + "\n";
}
}

void EvaluatePhase(const EvaluationInput& input, const EvaluationSettings& settings,
  PhaseEvaluation& phase, std::vector<std::string>& warnings, const ProgressCallback& progress)
{
  if (!(settings.relevantRadius >= 0.0))
  {
    throw std::invalid_argument("EvaluationSettings: relevantRadius must not be negative");
  }
  EvaluationMeasures& m = phase.measures;
  const MeshDistance distance = CompareSurfaces(input.model, input.truth, settings.distance,
    [&](double fraction) { return !progress || progress(0.6 * fraction); });
  m.hausdorff = distance.hausdorff;
  m.hausdorff95 = distance.hausdorff95;
  m.msd = distance.ab.vertexMean;
  m.assd = distance.mean;
  warnings.insert(warnings.end(), distance.warnings.begin(), distance.warnings.end());

  std::map<std::int64_t, BranchEvaluation> branches;
  for (const BranchDistance& one : distance.branches)
  {
    if (one.side == 1)
    {
      branches[one.group].hausdorff = one.distance.hausdorff;
      branches[one.group].mean = one.distance.mean;
    }
  }
  if (!input.truthTree.lines.empty() && !input.modelTree.lines.empty())
  {
    const BranchMetrics trees = CompareBranches(input.modelTree, input.truthTree, settings.branches,
      [&](double fraction) { return !progress || progress(0.6 + 0.3 * fraction); });
    m.completenessRatio = trees.completenessRatio;
    m.continuityScore = trees.continuityScore;
    m.boundedCompleteness = trees.boundedCompleteness;
    for (const BranchAgreement& row : trees.rows)
    {
      if (row.reference >= 0)
      {
        const TreeBranch& reference = trees.reference[static_cast<std::size_t>(row.reference)];
        BranchEvaluation& branch = branches[reference.group];
        // A group's line may be cut by forks: its parts together.
        const bool first = std::isnan(branch.length);
        const double length = (first ? 0.0 : branch.length) + reference.length;
        branch.covered =
          ((first ? 0.0 : branch.covered * branch.length) + row.covered * reference.length) /
          length;
        branch.continuity =
          ((first ? 0.0 : branch.continuity * branch.length) + row.continuity * reference.length) /
          length;
        branch.length = length;
      }
    }
    LineSamples truth = SamplesOf(input.truthTree, {});
    MeasureDistances(truth, input.modelTree);
    MeasureFound(truth, settings, m);
    LineSamples model = SamplesOf(input.modelTree, input.modelConfidence);
    MeasureDistances(model, input.truthTree);
    MeasureFalse(model, input, settings.branches.tolerance, phase);
  }
  for (auto& [group, branch] : branches)
  {
    branch.group = group;
    const auto label = input.labels.find(group);
    branch.label = label == input.labels.end() ? std::string() : label->second;
    phase.branches.push_back(branch);
  }
  if (progress && !progress(1.0))
  {
    throw Cancelled();
  }
}

const std::vector<EvaluationColumn>& EvaluationColumns()
{
  static const std::vector<EvaluationColumn> columns = {
    { "found", true, "", &Measures::found, 1.0 },
    { "found_0.5", true, "", &Measures::foundHalf, 1.0 },
    { "found_1.0", false, "", &Measures::foundWide, 1.0 },
    { "ASSD", true, "mm", &Measures::assd, 0.0 },
    { "HD95", true, "mm", &Measures::hausdorff95, 0.0 },
    { "centerline_mean", true, "mm", &Measures::centerlineMean, 0.0 },
    { "centerline_p95", false, "mm", &Measures::centerline95, 0.0 },
    { "false_length", true, "mm", &Measures::falseLength, 0.0 },
    { "false_confident", false, "mm", &Measures::falseConfident, 0.0 },
    { "HD", true, "mm", &Measures::hausdorff, 0.0 },
    { "MSD", true, "mm", &Measures::msd, 0.0 },
    { "BCR", true, "", &Measures::completenessRatio, 1.0 },
    { "BCS", true, "", &Measures::continuityScore, 1.0 },
    { "BCR_bounded", false, "", &Measures::boundedCompleteness, 1.0 },
  };
  return columns;
}

MeasureSummary Summarize(const std::vector<EvaluationMeasures>& list)
{
  MeasureSummary summary;
  summary.count = static_cast<std::int64_t>(list.size());
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    double sum = 0.0;
    std::int64_t known = 0;
    for (const EvaluationMeasures& m : list)
    {
      if (!std::isnan(m.*column.value))
      {
        sum += m.*column.value;
        ++known;
      }
    }
    if (known == 0)
    {
      continue;
    }
    const double mean = sum / static_cast<double>(known);
    summary.mean.*column.value = mean;
    double squares = 0.0;
    for (const EvaluationMeasures& m : list)
    {
      const double value = m.*column.value;
      squares += std::isnan(value) ? 0.0 : (value - mean) * (value - mean);
    }
    if (known > 1)
    {
      summary.deviation.*column.value = std::sqrt(squares / static_cast<double>(known - 1));
    }
  }
  return summary;
}

std::vector<BranchSummary> SummarizeBranches(const CaseEvaluation& one)
{
  struct Sums
  {
    BranchSummary branch;
    double length = 0.0;
    double found = 0.0;
    double mean = 0.0;
    int compared = 0; ///< phases with a centerline
    int surfaces = 0; ///< phases with a surface
  };
  std::map<std::int64_t, Sums> all;
  for (const PhaseEvaluation& phase : one.phases)
  {
    for (const BranchEvaluation& branch : phase.branches)
    {
      Sums& sums = all[branch.group];
      sums.branch.group = branch.group;
      sums.branch.label = branch.label;
      if (std::isfinite(branch.covered))
      {
        sums.length += branch.length;
        sums.found += branch.covered;
        ++sums.compared;
        if (!(sums.branch.minimum <= branch.covered))
        {
          sums.branch.minimum = branch.covered;
          sums.branch.worstPhase = phase.phase;
        }
      }
      if (std::isfinite(branch.mean))
      {
        sums.mean += branch.mean;
        ++sums.surfaces;
        sums.branch.hausdorff = std::fmax(sums.branch.hausdorff, branch.hausdorff);
      }
    }
  }
  std::vector<BranchSummary> branches;
  for (auto& [group, sums] : all)
  {
    if (sums.compared > 0)
    {
      sums.branch.length = sums.length / sums.compared;
      sums.branch.found = sums.found / sums.compared;
    }
    if (sums.surfaces > 0)
    {
      sums.branch.mean = sums.mean / sums.surfaces;
    }
    branches.push_back(sums.branch);
  }
  return branches;
}

std::vector<std::string> FindingsOf(const CaseEvaluation& one)
{
  const std::string all = " of " + std::to_string(one.phases.size()) + " phases";
  std::vector<std::string> findings;
  for (const BranchSummary& branch : SummarizeBranches(one))
  {
    if (branch.minimum < LostBelow)
    {
      const auto lost = std::count_if(one.phases.begin(), one.phases.end(),
        [&](const PhaseEvaluation& phase)
        {
          return std::any_of(phase.branches.begin(), phase.branches.end(),
            [&](const BranchEvaluation& each)
            { return each.group == branch.group && each.covered < LostBelow; });
        });
      findings.push_back("Lost: " +
        (branch.label.empty() ? "branch " + std::to_string(branch.group) : branch.label) + " (" +
        Number(branch.length, 1) + " mm) in " + std::to_string(lost) + all + "; " +
        Number(100.0 * branch.minimum, 0) + " % of it found in phase " +
        std::to_string(branch.worstPhase));
    }
  }
  std::map<std::pair<std::int64_t, std::string>, std::vector<FalseBranch>> wrong;
  for (const PhaseEvaluation& phase : one.phases)
  {
    for (const FalseBranch& branch : phase.falseBranches)
    {
      wrong[{ branch.group, branch.label }].push_back(branch);
    }
  }
  for (const auto& [name, phases] : wrong)
  {
    double confidence = 0.0;
    double length = 0.0;
    for (const FalseBranch& branch : phases)
    {
      confidence += branch.confidence / static_cast<double>(phases.size());
      length += branch.length / static_cast<double>(phases.size());
    }
    findings.push_back(
      "False: " + (name.second.empty() ? "branch " + std::to_string(name.first) : name.second) +
      " (" + Number(length, 1) + " mm, confidence " + Number(confidence, 2, "not known") +
      ") is no vessel of the truth in " + std::to_string(phases.size()) + all);
  }
  return findings;
}

MeasureSummary SummarizePhases(const CaseEvaluation& one, bool interpolated)
{
  std::vector<EvaluationMeasures> list;
  for (const PhaseEvaluation& phase : one.phases)
  {
    if (phase.interpolated == interpolated)
    {
      list.push_back(phase.measures);
    }
  }
  return Summarize(list);
}

MeasureSummary SummarizeCases(const std::vector<CaseEvaluation>& cases)
{
  std::vector<EvaluationMeasures> means;
  for (const CaseEvaluation& one : cases)
  {
    const MeasureSummary summary = SummarizePhases(one, true);
    if (summary.count > 0)
    {
      means.push_back(summary.mean);
    }
  }
  return Summarize(means);
}

const char* KindOf(const PhaseEvaluation& phase)
{
  return phase.lost ? "lost" : phase.interpolated ? "interpolated" : "tracked";
}

EvaluationMeasures PaperMeasuresOf(const PhaseEvaluation& phase)
{
  for (const PhaseEvaluation& known : PaperPartA().phases)
  {
    if (known.phase == phase.phase && phase.interpolated)
    {
      return known.measures;
    }
  }
  return {};
}

const CaseEvaluation& PaperPartA()
{
  static const CaseEvaluation part = []
  {
    CaseEvaluation a;
    a.name = "Dataset #1 of the paper";
    const double rows[10][5] = { { 1, 5.75, 1.49, 2.5, 0.83 }, { 3, 7.70, 3.39, 1.66, 0.76 },
      { 5, 6.79, 2.75, 5.0, 0.71 }, { 7, 8.20, 2.97, 2.5, 0.75 }, { 9, 2.27, 0.93, 1.25, 0.89 },
      { 11, 5.88, 2.36, 1.0, 0.85 }, { 13, 5.00, 2.55, 1.66, 0.82 }, { 15, 0.79, 0.11, 1.0, 0.95 },
      { 17, 3.47, 0.97, 1.66, 0.87 }, { 19, 8.34, 2.39, 1.25, 0.77 } };
    for (const auto& row : rows)
    {
      PhaseEvaluation phase;
      phase.phase = static_cast<int>(row[0]);
      phase.fraction = EvaluationMeasures::NaN;
      phase.interpolated = true;
      phase.measures = PaperMeasures(row[1], row[2], row[3], row[4]);
      a.phases.push_back(phase);
    }
    return a;
  }();
  return part;
}

const std::vector<PaperCase>& PaperPartB()
{
  static const std::vector<PaperCase> part = { { "#1", PaperMeasures(6.23, 2.16, 2.00, 0.81) },
    { "#2", PaperMeasures(3.89, 1.28, 1.50, 0.88) },
    { "#3", PaperMeasures(7.16, 2.89, 2.50, 0.75) },
    { "#4", PaperMeasures(4.57, 1.56, 1.80, 0.84) },
    { "#5", PaperMeasures(2.95, 0.99, 1.30, 0.90) } };
  return part;
}

const MeasureSummary& PaperSummaryA()
{
  static const MeasureSummary summary{ PaperMeasures(5.42, 1.99, 1.95, 0.82),
    PaperMeasures(2.60, 1.03, 1.18, 0.07), 10 };
  return summary;
}

const MeasureSummary& PaperSummaryB()
{
  static const MeasureSummary summary{ PaperMeasures(4.96, 1.78, 1.82, 0.84),
    PaperMeasures(1.78, 0.75, 0.46, 0.06), 5 };
  return summary;
}

std::string EvaluationCsv(const std::vector<CaseEvaluation>& cases)
{
  std::string table = "part,case,phase,fraction,kind";
  for (const EvaluationColumn& column : EvaluationColumns())
  {
    table += std::string(",") + column.key + (*column.unit ? "_" + std::string(column.unit) : "");
  }
  table += "\n";
  for (const CaseEvaluation& one : cases)
  {
    for (const PhaseEvaluation& phase : one.phases)
    {
      AddCsvRow(table, "A", one.name, std::to_string(phase.phase), Number(phase.fraction, 6),
        KindOf(phase), phase.measures);
    }
    for (const bool interpolated : { true, false })
    {
      const MeasureSummary summary = SummarizePhases(one, interpolated);
      if (summary.count > 0)
      {
        const char* kind = interpolated ? "interpolated" : "tracked";
        AddCsvRow(table, "A", one.name, "mean", "", kind, summary.mean);
        AddCsvRow(table, "A", one.name, "deviation", "", kind, summary.deviation);
      }
    }
  }
  for (const CaseEvaluation& one : cases)
  {
    const MeasureSummary summary = SummarizePhases(one, true);
    if (summary.count > 0)
    {
      AddCsvRow(table, "B", one.name, "", "", "interpolated", summary.mean);
    }
  }
  const MeasureSummary all = SummarizeCases(cases);
  AddCsvRow(table, "B", "all", "mean", "", "interpolated", all.mean);
  AddCsvRow(table, "B", "all", "deviation", "", "interpolated", all.deviation);
  return table;
}

std::string BranchCsv(const std::vector<CaseEvaluation>& cases)
{
  std::string table =
    "case,phase,fraction,kind,group,label,length_mm,covered,continuity,HD_mm,mean_mm\n";
  for (const CaseEvaluation& one : cases)
  {
    for (const PhaseEvaluation& phase : one.phases)
    {
      for (const BranchEvaluation& branch : phase.branches)
      {
        table += Csv(one.name) + "," + std::to_string(phase.phase) + "," +
          Number(phase.fraction, 6) + "," + KindOf(phase) + "," + std::to_string(branch.group) +
          "," + Csv(branch.label) + "," + Number(branch.length, 4) + "," +
          Number(branch.covered, 6) + "," + Number(branch.continuity, 6) + "," +
          Number(branch.hausdorff, 6) + "," + Number(branch.mean, 6) + "\n";
      }
    }
  }
  return table;
}

std::string EvaluationLatex(const std::vector<CaseEvaluation>& cases)
{
  const std::string head = "\\hline\n";
  std::string text =
    "% Made by coronary-pipeline evaluate. Paper: values of Table 1 of the paper.\n";
  const MeasureSummary& paperA = PaperSummaryA();
  for (const CaseEvaluation& one : cases)
  {
    text += "% Part A\n\\begin{tabular}{rrlrrrrrrrrrrr}\n\\hline\n"
            " & & & \\multicolumn{7}{c}{" +
      Tex(one.name) +
      "} & \\multicolumn{4}{c}{Paper, dataset \\#1} \\\\\n"
      "Phase & \\% R-R & & found & ASSD (mm) & HD95 (mm) & HD (mm) & MSD (mm) & BCR & BCS & HD "
      "(mm) & MSD (mm) & BCR & BCS \\\\\n" +
      head;
    for (const PhaseEvaluation& phase : one.phases)
    {
      const EvaluationMeasures paper = PaperMeasuresOf(phase);
      char first[64];
      std::snprintf(first, sizeof(first), "%02d & %s & %s", phase.phase,
        Number(100.0 * phase.fraction, 1).c_str(), KindOf(phase));
      text += first + LeadingTexCells(phase.measures) + TexCells(phase.measures) + TexCells(paper) +
        " \\\\\n";
    }
    text += head;
    const MeasureSummary interpolated = SummarizePhases(one, true);
    const MeasureSummary tracked = SummarizePhases(one, false);
    if (interpolated.count > 0)
    {
      text += "Mean & & interpolated" + LeadingTexCells(interpolated.mean) +
        TexCells(interpolated.mean) + TexCells(paperA.mean) + " \\\\\nSTD & & interpolated" +
        LeadingTexCells(interpolated.deviation) + TexCells(interpolated.deviation) +
        TexCells(paperA.deviation) + " \\\\\n";
    }
    if (tracked.count > 0)
    {
      text += "Mean & & tracked" + LeadingTexCells(tracked.mean) + TexCells(tracked.mean) +
        TexCells({}) + " \\\\\n";
    }
    text += "\\hline\n\\end{tabular}\n\n";
  }
  text += "% Part B: means over the interpolated phases\n\\begin{tabular}{lrrrrrrr}\n\\hline\n"
          "Dataset & found & ASSD (mm) & HD95 (mm) & HD (mm) & MSD (mm) & BCR & BCS \\\\\n" +
    head;
  for (const CaseEvaluation& one : cases)
  {
    const EvaluationMeasures mean = SummarizePhases(one, true).mean;
    text += Tex(one.name) + LeadingTexCells(mean) + TexCells(mean) + " \\\\\n";
  }
  const MeasureSummary all = SummarizeCases(cases);
  const MeasureSummary& paperB = PaperSummaryB();
  text += head + "Mean" + LeadingTexCells(all.mean) + TexCells(all.mean) + " \\\\\nSTD" +
    LeadingTexCells(all.deviation) + TexCells(all.deviation) +
    " \\\\\n\\hline\nPaper, mean of five" + LeadingTexCells({}) + TexCells(paperB.mean) +
    " \\\\\nPaper, STD" + LeadingTexCells({}) + TexCells(paperB.deviation) +
    " \\\\\n\\hline\n\\end{tabular}\n";
  return text;
}

std::string EvaluationText(const std::vector<CaseEvaluation>& cases)
{
  std::string text;
  const MeasureSummary& paperA = PaperSummaryA();
  for (const CaseEvaluation& one : cases)
  {
    text += "Table 1, Part A: " + one.name + "\n" + TextHead("phase");
    for (const PhaseEvaluation& phase : one.phases)
    {
      const EvaluationMeasures paper = PaperMeasuresOf(phase);
      char name[64];
      std::snprintf(name, sizeof(name), "%02d %6s %%  %s", phase.phase,
        Number(100.0 * phase.fraction, 1).c_str(), KindOf(phase));
      text += TextRow(name, phase.measures, paper);
    }
    const MeasureSummary interpolated = SummarizePhases(one, true);
    const MeasureSummary tracked = SummarizePhases(one, false);
    if (interpolated.count > 0)
    {
      text += TextRow("mean, interpolated", interpolated.mean, paperA.mean) +
        TextRow("deviation", interpolated.deviation, paperA.deviation);
    }
    if (tracked.count > 0)
    {
      text +=
        TextRow("mean, tracked", tracked.mean, {}) + TextRow("deviation", tracked.deviation, {});
    }
    for (const std::string& finding : FindingsOf(one))
    {
      text += finding + ".\n";
    }
    text += "\n";
  }
  const MeasureSummary all = SummarizeCases(cases);
  if (all.count == 0)
  {
    return text + "No phase is interpolated: there is no Part B.\n";
  }
  text += "Table 1, Part B: means over the interpolated phases\n" + TextHead("case");
  const std::vector<PaperCase>& paper = PaperPartB();
  for (std::size_t n = 0; n < cases.size(); ++n)
  {
    text += TextRow(cases[n].name, SummarizePhases(cases[n], true).mean,
      n < paper.size() ? paper[n].mean : EvaluationMeasures());
  }
  const MeasureSummary& paperB = PaperSummaryB();
  return text + TextRow("mean", all.mean, paperB.mean) +
    TextRow("deviation", all.deviation, paperB.deviation);
}
}
