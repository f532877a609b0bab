#include "LabelPieces.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
// Millimetres of the mean heart.
constexpr double ChunkLength = 6.0;   ///< pieces that get one name
constexpr double SampleSpacing = 2.0; ///< points of a piece that are compared with the atlas
}

LabelPieces::LabelPieces(const CenterlineTopology& tree)
{
  this->Normalise(tree);
  this->Cut(tree);
}

void LabelPieces::Normalise(const CenterlineTopology& tree)
{
  // Power of ten that brings the extent and the calibre of the trees near those of a heart in mm.
  double weight = 0.0;
  for (const auto& branch : tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const Vector3& a = tree.points[branch.points[i - 1]];
      const Vector3& b = tree.points[branch.points[i]];
      this->centre += (b - a).norm() * 0.5 * (a + b);
      weight += (b - a).norm();
    }
  }
  this->centre /= weight;
  double spread = 0.0;
  double calibre = 0.0;
  for (const auto& branch : tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const Vector3& a = tree.points[branch.points[i - 1]];
      const Vector3& b = tree.points[branch.points[i]];
      const double step = (b - a).norm();
      spread += step / weight * (0.5 * (a + b) - this->centre).squaredNorm();
      calibre += step / weight * tree.radius[branch.points[i]];
    }
  }
  const double power = 0.5 * (std::log10(std::sqrt(spread) / 38.0) + std::log10(calibre / 0.95));
  this->unit = std::pow(10.0, std::round(power));
}

void LabelPieces::Cut(const CenterlineTopology& tree)
{
  const std::size_t count = tree.branches.size();
  this->bifurcationOf.assign(count, nullptr);
  for (const Bifurcation& bifurcation : tree.bifurcations)
  {
    this->bifurcationOf[bifurcation.parent] = &bifurcation;
  }
  int trees = 0;
  for (const auto& branch : tree.branches)
  {
    trees = std::max(trees, branch.treeId + 1);
  }
  this->roots.resize(trees);
  this->treeLength.assign(trees, 0.0);
  this->rootPosition.assign(trees, Vector3::Zero());
  std::vector<int> lastChunk(count, -1);
  for (std::size_t b = 0; b < count; ++b)
  {
    const auto& branch = tree.branches[b];
    const double length = branch.length / this->unit;
    this->treeLength[branch.treeId] += length;
    const int parts = std::max(1, static_cast<int>(std::lround(length / ChunkLength)));
    int parent = branch.parentGroupId < 0 ? -1 : lastChunk[branch.parentGroupId];
    if (parent < 0)
    {
      this->rootPosition[branch.treeId] =
        (tree.points[branch.points[0]] - this->centre) / this->unit;
    }
    std::size_t at = 0;
    double arc = 0.0;
    for (int piece = 0; piece < parts; ++piece)
    {
      LabelPiece chunk;
      chunk.branch = static_cast<int>(b);
      chunk.first = at;
      chunk.startsBranch = piece == 0;
      chunk.firstSample = this->samples.size();
      const double end = branch.length * (piece + 1) / parts;
      double sampled = arc - 0.5 * SampleSpacing * this->unit;
      const double start = arc;
      while (at + 1 < branch.points.size() && (arc < end || piece + 1 == parts))
      {
        const auto point = branch.points[at + 1];
        const double step = (tree.points[point] - tree.points[branch.points[at]]).norm();
        if (arc + 0.5 * step > end && piece + 1 < parts && at > chunk.first)
        {
          break;
        }
        arc += step;
        ++at;
        if (arc - sampled >= SampleSpacing * this->unit || at + 1 == branch.points.size())
        {
          const double calibre = tree.radius[point] / this->unit;
          this->samples.push_back(
            { (tree.points[point] - this->centre) / this->unit, tree.tangent[point],
              (arc - sampled) / this->unit * std::clamp(calibre, 0.5, 2.0), branch.treeId });
          sampled = arc;
        }
      }
      chunk.last = at;
      chunk.lastSample = this->samples.size();
      chunk.length = (arc - start) / this->unit;
      if (chunk.last == chunk.first)
      {
        continue;
      }
      if (chunk.firstSample == chunk.lastSample)
      {
        const auto point = branch.points[at];
        this->samples.push_back({ (tree.points[point] - this->centre) / this->unit,
          tree.tangent[point], chunk.length, branch.treeId });
        chunk.lastSample = this->samples.size();
      }
      const int index = static_cast<int>(this->pieces.size());
      chunk.parent = parent;
      if (parent >= 0)
      {
        this->pieces[parent].children.push_back(index);
      }
      else
      {
        this->roots[branch.treeId].push_back(index);
      }
      this->pieces.push_back(chunk);
      parent = index;
    }
    lastChunk[b] = parent;
  }
  this->below.assign(this->pieces.size(), 0.0);
  for (std::size_t c = this->pieces.size(); c-- > 0;)
  {
    this->below[c] += this->pieces[c].length;
    if (this->pieces[c].parent >= 0)
    {
      this->below[this->pieces[c].parent] += this->below[c];
    }
  }
}
}
