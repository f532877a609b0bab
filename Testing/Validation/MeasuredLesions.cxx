#include "MeasuredLesions.h"

#include "VesselPaths.h"

#include <cmath>
#include <limits>

namespace coronary
{
MeasuredLesions MeasureLesions(const VesselTree& tree, const ScalarImage& image, double blur)
{
  const std::vector<VesselPath> paths = VesselPaths(tree);
  MeasuredLesions measured{ MeasureTreeLumen(tree, paths, image, blur), {}, {} };
  const VesselTree& refined = measured.refined = WithLumen(tree, measured.lumen);
  MeasureCalcium(measured.calcium, refined, paths, image, measured.levels, blur);
  measured.grading = GradeStenoses(refined, paths, measured.lumen);
  return measured;
}

std::vector<LesionMatch> MatchLesions(const std::vector<PhantomStenosis>& truth,
  const std::vector<Vector3>& treePoints, const std::vector<Stenosis>& measured)
{
  constexpr double reach = 1.5;         // mm
  constexpr double matchDistance = 6.0; // mm
  std::vector<LesionMatch> matches;
  std::vector<char> used(measured.size(), 0);
  for (const PhantomStenosis& one : truth)
  {
    LesionMatch match;
    match.truth = one;
    for (const Vector3& point : treePoints)
    {
      match.reached = match.reached || (point - one.position).norm() <= reach;
    }
    match.distance = matchDistance;
    for (std::size_t l = 0; l < measured.size(); ++l)
    {
      const double distance = (measured[l].position - one.position).norm();
      if (used[l] == 0 && distance < match.distance)
      {
        match.distance = distance;
        match.lesion = static_cast<int>(l);
      }
    }
    match.error = -one.degree;
    if (match.lesion >= 0)
    {
      const Stenosis& lesion = measured[static_cast<std::size_t>(match.lesion)];
      used[static_cast<std::size_t>(match.lesion)] = 1;
      match.error = lesion.degree - one.degree;
      match.inRange = one.degree >= lesion.degreeLow && one.degree <= lesion.degreeHigh;
    }
    matches.push_back(match);
  }
  return matches;
}

void DegreeTally::Add(const LesionMatch& match)
{
  if (match.lesion < 0)
  {
    ++(match.reached ? this->unlisted : this->unreached);
    return;
  }
  ++this->listed;
  this->within += std::abs(match.error) <= MaximumError ? 1 : 0;
  this->inRange += match.inRange ? 1 : 0;
  this->sum += match.error;
}

void DegreeTally::Add(const DegreeTally& other)
{
  this->listed += other.listed;
  this->within += other.within;
  this->inRange += other.inRange;
  this->sum += other.sum;
  this->unreached += other.unreached;
  this->unlisted += other.unlisted;
}

std::string ShareText(int part, int whole)
{
  return whole > 0 ? std::to_string(std::lround(100.0 * part / whole)) + " %" : "-";
}
}
