#include "VeinRejection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

namespace coronary
{
namespace
{
constexpr double Near = 20.0;       ///< mm from a fork that are compared
constexpr double LeastLength = 8.0; ///< mm: what is shorter shows too little
constexpr double LeastRadius = 2.0; ///< blurs: thinner lumens are darker for the blur alone

double Median(std::vector<double> values)
{
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class VeinFinder
{
public:
  VeinFinder(const CenterlineTree& tree, const ImageInterpolator& image,
    const LumenReference& reference, double blur)
    : Tree(tree)
    , Blur(blur)
    , Contrast(reference.lumen - reference.background)
  {
    CheckTree(tree);
    this->Value.resize(tree.points.size());
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      // What the blur took from a thin lumen is given back.
      const double r = tree.radius[p] / std::max(1e-9, blur);
      const double kept = std::max(0.3, 1.0 - std::exp(-0.5 * r * r));
      this->Value[p] =
        (image.At(tree.points[p]) - reference.background) / std::max(1e-9, this->Contrast) / kept;
    }
    for (std::size_t b = 0; b < tree.branches.size(); ++b)
    {
      this->Index[tree.branches[b].groupId] = b;
    }
  }

  std::vector<VeinBranch> Run();

private:
  /// Points along the tree from a fork on, with mm from it.
  using Course = std::vector<std::pair<std::size_t, double>>;
  Course Down(std::size_t branch, double reach) const;
  Course Up(std::size_t branch, double reach) const;
  std::vector<double> Values(const Course& run, double from) const;
  std::optional<VeinBranch> Describe(std::size_t branch, double& error) const;

  const CenterlineTree& Tree;
  double Blur;
  double Contrast;
  std::vector<double> Value; ///< share of the contrast at a point
  std::map<int, std::size_t> Index;
};

/// A branch and the widest that follow.
VeinFinder::Course VeinFinder::Down(std::size_t branch, double reach) const
{
  Course run;
  double passed = 0.0;
  for (;;)
  {
    const std::vector<std::int64_t>& points = this->Tree.branches[branch].points;
    for (std::size_t i = 1; i < points.size(); ++i)
    {
      passed += (this->Tree.points[static_cast<std::size_t>(points[i])] -
        this->Tree.points[static_cast<std::size_t>(points[i - 1])])
                  .norm();
      run.emplace_back(static_cast<std::size_t>(points[i]), passed);
      if (passed > reach)
      {
        return run;
      }
    }
    double widest = 0.0;
    std::size_t next = branch;
    for (std::size_t b = 0; b < this->Tree.branches.size(); ++b)
    {
      const std::vector<std::int64_t>& own = this->Tree.branches[b].points;
      const double radius = this->Tree.radius[static_cast<std::size_t>(own[own.size() / 2])];
      if (this->Tree.branches[b].parentGroupId == this->Tree.branches[branch].groupId &&
        radius > widest)
      {
        widest = radius;
        next = b;
      }
    }
    if (next == branch)
    {
      return run;
    }
    branch = next;
  }
}

/// From a branch's first point towards the root.
VeinFinder::Course VeinFinder::Up(std::size_t branch, double reach) const
{
  Course run;
  double passed = 0.0;
  int parent = this->Tree.branches[branch].parentGroupId;
  while (parent >= 0)
  {
    const CenterlineTree::Branch& up = this->Tree.branches[this->Index.at(parent)];
    for (std::size_t i = up.points.size() - 1; i > 0; --i)
    {
      passed += (this->Tree.points[static_cast<std::size_t>(up.points[i])] -
        this->Tree.points[static_cast<std::size_t>(up.points[i - 1])])
                  .norm();
      run.emplace_back(static_cast<std::size_t>(up.points[i - 1]), passed);
      if (passed > reach)
      {
        return run;
      }
    }
    parent = up.parentGroupId;
  }
  return run;
}

std::vector<double> VeinFinder::Values(const Course& run, double from) const
{
  std::vector<double> values;
  for (const auto& [point, passed] : run)
  {
    if (passed >= from && this->Tree.radius[point] >= LeastRadius * this->Blur &&
      (this->Tree.bridged.empty() || this->Tree.bridged[point] == 0))
    {
      values.push_back(this->Value[point]);
    }
  }
  return values;
}

/// @param error  of the brightness, by noise, share of the contrast
std::optional<VeinBranch> VeinFinder::Describe(std::size_t branch, double& error) const
{
  const Course down = this->Down(branch, 40.0);
  const Course up = this->Up(branch, Near);
  if (down.empty() || up.empty() || down.back().second < LeastLength)
  {
    return std::nullopt;
  }
  // Behind a lesion blood may be thinner, and the vessel wider.
  const std::size_t first = down.front().first;
  if (!this->Tree.bridgeConfidence.empty() && this->Tree.bridgeConfidence[first] < 1.0)
  {
    return std::nullopt;
  }
  double widest = 0.0;
  for (const auto& [point, passed] : up)
  {
    widest = std::max(widest, this->Tree.radius[point]);
  }
  // The fork itself belongs to both.
  const double mouth = std::min(widest, 3.0) + 1.0;
  const std::vector<double> own = this->Values(down, mouth);
  const std::vector<double> before = this->Values(up, mouth);
  if (own.size() < 8 || before.size() < 8)
  {
    return std::nullopt;
  }
  VeinBranch result;
  result.groupId = this->Tree.branches[branch].groupId;
  result.brightness = Median(own) - Median(before);
  // Noise by the differences of neighbours; samples within about 1 mm are not independent.
  const auto spread = [](const std::vector<double>& values)
  {
    std::vector<double> off;
    const double middle = Median(values);
    off.reserve(values.size());
    for (const double value : values)
    {
      off.push_back(std::abs(value - middle));
    }
    return 1.4826 * Median(off) /
      std::sqrt(std::max(1.0, static_cast<double>(values.size()) / 4.0));
  };
  error = std::hypot(spread(own), spread(before));
  std::vector<double> early;
  std::vector<double> last;
  for (const auto& [point, passed] : down)
  {
    if (passed >= mouth && passed < mouth + 8.0)
    {
      early.push_back(this->Tree.radius[point]);
    }
    if (passed >= down.back().second - 8.0 && passed >= mouth)
    {
      last.push_back(this->Tree.radius[point]);
    }
  }
  if (!early.empty() && !last.empty())
  {
    result.calibre = Median(early) / std::max(1e-9, widest);
    // Behind a narrow begin any artery is wider again: only what becomes wider than the artery before counts.
    result.growth = Median(last) / std::max({ 1e-9, Median(early), 0.9 * widest });
  }
  // Beside another vessel: within 6 mm of one, and not of the fork.
  std::size_t beside = 0;
  std::size_t counted = 0;
  const std::vector<std::int64_t>& points = this->Tree.branches[branch].points;
  for (const auto& [point, passed] : down)
  {
    if (passed < 10.0)
    {
      continue;
    }
    ++counted;
    bool near = false;
    for (const CenterlineTree::Branch& other : this->Tree.branches)
    {
      const bool same = other.groupId == result.groupId || other.points.front() == points.back() ||
        other.points.back() == points.back();
      for (std::size_t i = 0; !near && !same && i < other.points.size(); i += 3)
      {
        const auto q = static_cast<std::size_t>(other.points[i]);
        const double reach = 3.0 + this->Tree.radius[q] + this->Tree.radius[point];
        near = (this->Tree.points[q] - this->Tree.points[point]).squaredNorm() < reach * reach;
      }
    }
    beside += near ? 1 : 0;
  }
  result.beside = counted > 0 ? static_cast<double>(beside) / static_cast<double>(counted) : 0.0;
  return result;
}

std::vector<VeinBranch> VeinFinder::Run()
{
  std::vector<VeinBranch> all;
  std::vector<double> errors;
  std::vector<double> steps;
  for (std::size_t b = 0; b < this->Tree.branches.size(); ++b)
  {
    double error = 0.0;
    if (std::optional<VeinBranch> one = this->Describe(b, error))
    {
      all.push_back(*one);
      errors.push_back(error);
      steps.push_back(one->brightness);
    }
  }
  if (all.empty())
  {
    return {};
  }
  // Most branches are arteries: how these differ is the measure.
  const double usual = std::clamp(Median(steps), -0.1, 0.0);
  std::vector<double> off;
  off.reserve(steps.size());
  for (const double step : steps)
  {
    off.push_back(std::abs(step - usual));
  }
  const double natural = std::max(0.01, 1.4826 * Median(off));
  std::vector<VeinBranch> veins;
  for (std::size_t n = 0; n < all.size(); ++n)
  {
    VeinBranch& one = all[n];
    const double darker = (usual - one.brightness) / std::hypot(errors[n], natural);
    double odds = -3.5;
    odds += std::min(4.0, std::max(0.0, darker - 1.5));
    odds += std::min(4.0, 8.0 * std::max(0.0, one.calibre - 1.15));
    odds += std::min(4.0, 8.0 * std::max(0.0, one.growth - 1.15));
    odds += 1.5 * std::max(0.0, one.beside - 0.3);
    one.probability = 1.0 / (1.0 + std::exp(-odds));
    // No sign but the brightness can tell a vein from an artery behind a lesion.
    if (odds >= 0.0 && darker > 1.0)
    {
      veins.push_back(one);
    }
  }
  return veins;
}
}

std::vector<VeinBranch> FindVeins(const CenterlineTree& tree, const ImageInterpolator& image,
  const LumenReference& reference, double blur)
{
  return VeinFinder(tree, image, reference, blur).Run();
}
}
