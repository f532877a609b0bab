#include "DisplacementLabels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
/// min over q of f[q] + weight (p - q)^2, for all p of one line of candidates.
void LowerEnvelope(float* values, int count, int stride, float weight, std::vector<float>& copy,
  std::vector<int>& roots, std::vector<float>& bounds)
{
  for (int n = 0; n < count; ++n)
  {
    copy[n] = values[n * stride];
  }
  int last = 0;
  roots[0] = 0;
  bounds[0] = -std::numeric_limits<float>::infinity();
  bounds[1] = std::numeric_limits<float>::infinity();
  for (int q = 1; q < count; ++q)
  {
    const auto meet = [&](int r)
    {
      return ((copy[q] + weight * static_cast<float>(q * q)) -
               (copy[r] + weight * static_cast<float>(r * r))) /
        (2.0F * weight * static_cast<float>(q - r));
    };
    float at = meet(roots[last]);
    while (at <= bounds[last])
    {
      --last;
      at = meet(roots[last]);
    }
    ++last;
    roots[last] = q;
    bounds[last] = at;
    bounds[last + 1] = std::numeric_limits<float>::infinity();
  }
  int root = 0;
  for (int p = 0; p < count; ++p)
  {
    while (bounds[root + 1] < static_cast<float>(p))
    {
      ++root;
    }
    const auto away = static_cast<float>(p - roots[root]);
    values[p * stride] = copy[roots[root]] + weight * away * away;
  }
}

void Spread(std::vector<float>& values, int side, float weight)
{
  std::vector<float> copy(side);
  std::vector<int> roots(side);
  std::vector<float> bounds(side + 1);
  for (int a = 0; a < side; ++a)
  {
    for (int b = 0; b < side; ++b)
    {
      LowerEnvelope(values.data() + (a * side + b) * side, side, 1, weight, copy, roots, bounds);
    }
  }
  for (int a = 0; a < side; ++a)
  {
    for (int b = 0; b < side; ++b)
    {
      LowerEnvelope(values.data() + a * side * side + b, side, side, weight, copy, roots, bounds);
    }
  }
  for (int a = 0; a < side; ++a)
  {
    for (int b = 0; b < side; ++b)
    {
      LowerEnvelope(values.data() + a * side + b, side, side * side, weight, copy, roots, bounds);
    }
  }
}
}

std::vector<Vector3> BestDisplacements(const LineNodes& nodes, const LabelLattice& lattice,
  const std::vector<std::vector<float>>& costs, double stiffness)
{
  const int side = lattice.Side();
  const std::size_t count = nodes.size();
  // Up: what each node's branch below it costs, per candidate.
  std::vector<std::vector<float>> below = costs;
  std::vector<std::vector<float>> message(count);
  const auto weight = [&](int node)
  {
    return static_cast<float>(lattice.step * lattice.step /
      (2.0 * stiffness * stiffness * std::max(nodes.step[node], 0.05)));
  };
  for (auto node = nodes.order.rbegin(); node != nodes.order.rend(); ++node)
  {
    const int parent = nodes.parent[*node];
    if (parent < 0)
    {
      continue;
    }
    std::vector<float>& up = message[*node];
    up = below[*node];
    Spread(up, side, weight(*node));
    for (std::size_t n = 0; n < up.size(); ++n)
    {
      below[parent][n] += up[n];
    }
  }
  // Down: the least sum over everything, per candidate of every node.
  std::vector<Vector3> result(count, Vector3::Zero());
  for (const int node : nodes.order)
  {
    const int parent = nodes.parent[node];
    std::vector<float>& all = below[node];
    if (parent >= 0)
    {
      // The parent's sum holds this branch already.
      std::vector<float> rest = below[parent];
      for (std::size_t n = 0; n < rest.size(); ++n)
      {
        rest[n] -= message[node][n];
      }
      Spread(rest, side, weight(node));
      for (std::size_t n = 0; n < rest.size(); ++n)
      {
        all[n] += rest[n];
      }
      message[node] = {};
    }
    const auto best = static_cast<int>(std::min_element(all.begin(), all.end()) - all.begin());
    const int place[3] = { best % side, best / side % side, best / (side * side) };
    const int stride[3] = { 1, side, side * side };
    for (int axis = 0; axis < 3; ++axis)
    {
      double shift = 0.0;
      if (place[axis] > 0 && place[axis] + 1 < side)
      {
        const double low = all[best - stride[axis]];
        const double high = all[best + stride[axis]];
        const double bend = low + high - 2.0 * all[best];
        shift = bend > 1e-6 ? std::clamp(0.5 * (low - high) / bend, -0.5, 0.5) : 0.0;
      }
      result[node][axis] = (place[axis] - lattice.reach + shift) * lattice.step;
    }
  }
  return result;
}
}
