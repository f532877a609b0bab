#include "PatchMatching.h"

#include "Median.h"

#include <cmath>
#include <numeric>

namespace coronary
{
Patch::Patch(double radius, double spacing)
  : reach(static_cast<int>(radius / spacing))
  , step(spacing)
{
  for (int k = -this->reach; k <= this->reach; ++k)
  {
    for (int j = -this->reach; j <= this->reach; ++j)
    {
      for (int i = -this->reach; i <= this->reach; ++i)
      {
        const double apart = spacing * std::sqrt(i * i + j * j + k * k) / radius;
        if (apart <= 1.0)
        {
          this->places.push_back({ i, j, k });
          this->weights.push_back(static_cast<float>(std::exp(-1.5 * apart * apart)));
        }
      }
    }
  }
  const float sum = std::accumulate(this->weights.begin(), this->weights.end(), 0.0F);
  for (float& weight : this->weights)
  {
    weight /= sum;
  }
}

void SumsOfSquares(const std::vector<float>& block, int blockSide, const Patch& patch,
  const std::vector<float>& weights, const std::vector<float>& wanted, int labelReach,
  std::vector<float>& costs)
{
  const int side = 2 * labelReach + 1;
  const int first = blockSide / 2 - labelReach; // of the shifts, in the block, along each axis
  costs.assign(static_cast<std::size_t>(side) * side * side, 0.0F);
  for (std::size_t p = 0; p < patch.places.size(); ++p)
  {
    const std::array<int, 3>& place = patch.places[p];
    const float weight = weights[p];
    if (weight <= 0.0F)
    {
      continue;
    }
    const float value = wanted[p];
    const float* corner = block.data() +
      ((place[2] + first) * blockSide + place[1] + first) * blockSide + place[0] + first;
    for (int k = 0; k < side; ++k)
    {
      for (int j = 0; j < side; ++j)
      {
        const float* row = corner + (k * blockSide + j) * blockSide;
        float* out = costs.data() + (k * side + j) * side;
        for (int i = 0; i < side; ++i)
        {
          const float difference = row[i] - value;
          out[i] += weight * difference * difference;
        }
      }
    }
  }
}

void ToLikelihoods(
  std::vector<std::vector<float>>& costs, double independent, double limit, double floor)
{
  std::vector<float> minimum;
  minimum.reserve(costs.size());
  for (const std::vector<float>& one : costs)
  {
    minimum.push_back(*std::min_element(one.begin(), one.end()));
  }
  const float typical = std::max(MedianOf(minimum), static_cast<float>(floor));
  for (std::size_t n = 0; n < costs.size(); ++n)
  {
    const float scale = static_cast<float>(0.5 * independent) / std::max(minimum[n], typical);
    for (float& value : costs[n])
    {
      value = std::min((value - minimum[n]) * scale, static_cast<float>(limit));
    }
  }
}

double Correlation(const std::vector<float>& a, const std::vector<float>& b)
{
  const auto count = static_cast<double>(a.size());
  const double meanA = std::accumulate(a.begin(), a.end(), 0.0) / count;
  const double meanB = std::accumulate(b.begin(), b.end(), 0.0) / count;
  double aa = 0.0;
  double bb = 0.0;
  double ab = 0.0;
  for (std::size_t n = 0; n < a.size(); ++n)
  {
    aa += (a[n] - meanA) * (a[n] - meanA);
    bb += (b[n] - meanB) * (b[n] - meanB);
    ab += (a[n] - meanA) * (b[n] - meanB);
  }
  return ab / std::sqrt(std::max(aa * bb, 1e-9));
}

double SignalCurvature::NoiseOf(
  const std::vector<Matrix3>& curvatures, const std::vector<int>& averaged)
{
  std::vector<double> minimum;
  for (std::size_t n = 0; n < curvatures.size(); ++n)
  {
    if (curvatures[n].trace() > 0.0)
    {
      minimum.push_back(
        averaged[n] * Eigen::SelfAdjointEigenSolver<Matrix3>(curvatures[n]).eigenvalues()[0]);
    }
  }
  return std::max(QuantileOf(std::move(minimum), 1.0 / 3.0), 0.0);
}

Matrix3 Limited(const Matrix3& information, double deviation)
{
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(information);
  const Vector3 limited = eigen.eigenvalues().unaryExpr(
    [&](double value) { return value > 0.0 ? 1.0 / (1.0 / value + deviation * deviation) : 0.0; });
  return eigen.eigenvectors() * limited.asDiagonal() * eigen.eigenvectors().transpose();
}
}
