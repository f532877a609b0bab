#include "WorldVolume.h"

namespace coronary
{
float WorldVolume::At(const Vector3& world) const
{
  const Vector3 index = this->ToIndex(world);
  return InterpolateKnown(this->values.data(), this->size, { index[0], index[1], index[2] });
}

WorldVolume ResampleToWorld(const ScalarImage& image, const Vector3& low, const Vector3& high,
  double spacing, const Matrix3& axes, const ProgressCallback& progress)
{
  WorldVolume result;
  result.corner = axes * low;
  result.axes = axes;
  result.spacing = spacing;
  for (int axis = 0; axis < 3; ++axis)
  {
    result.size[axis] =
      std::max(1, 1 + static_cast<int>(std::floor((high[axis] - low[axis]) / spacing + 1e-6)));
  }
  result.values.resize(static_cast<std::size_t>(result.size[0]) * result.size[1] * result.size[2]);
  const ImageGrid& grid = image.grid;
  const Matrix3 toIndex = grid.spacing.cwiseInverse().asDiagonal() * grid.direction.transpose();
  const Vector3 shift(grid.extent[0], grid.extent[2], grid.extent[4]);
  const std::array<int, 3> n = image.Dimensions();
  std::visit(
    [&](const auto* values)
    {
      ParallelFor(
        result.size[2], 1,
        [&](std::int64_t first, std::int64_t last)
        {
          for (int k = static_cast<int>(first); k < last; ++k)
          {
            for (int j = 0; j < result.size[1]; ++j)
            {
              for (int i = 0; i < result.size[0]; ++i)
              {
                const Vector3 centre = result.World(Vector3(i, j, k));
                float sum = 0.0f;
                int samples = 0;
                for (int corner = 0; corner < 8; ++corner)
                {
                  const Vector3 offset(corner & 1 ? 0.25 : -0.25, corner & 2 ? 0.25 : -0.25,
                    corner & 4 ? 0.25 : -0.25);
                  const Vector3 index =
                    toIndex * (centre + spacing * (axes * offset) - grid.origin) - shift;
                  const float value = InterpolateKnown(values, n, { index[0], index[1], index[2] });
                  if (value > WorldVolume::Nothing)
                  {
                    sum += value;
                    ++samples;
                  }
                }
                result.values[result.Index(i, j, k)] =
                  samples == 0 ? WorldVolume::Nothing : sum / samples;
              }
            }
          }
        },
        progress);
    },
    image.values);
  return result;
}

std::pair<Vector3, Vector3> BoundsAlong(const ImageGrid& grid, const Matrix3& axes)
{
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (int corner = 0; corner < 8; ++corner)
  {
    const Vector3 p = axes.transpose() *
      grid.IndexToWorld(grid.extent[corner & 1 ? 1 : 0], grid.extent[corner & 2 ? 3 : 2],
        grid.extent[corner & 4 ? 5 : 4]);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return { low, high };
}
}
