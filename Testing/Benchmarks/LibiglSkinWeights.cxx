#include "LibiglSkinWeights.h"

#include <igl/bbw.h>

#include <stdexcept>

namespace coronary
{
Eigen::MatrixXd LibiglSkinWeights(const SkinWeightInput& input,
  const std::vector<std::int64_t>& fixed, const Eigen::MatrixXd& values, int iterations)
{
  Eigen::MatrixXd v(input.points.size(), 3);
  for (std::size_t i = 0; i < input.points.size(); ++i)
  {
    v.row(static_cast<Eigen::Index>(i)) = input.points[i].transpose();
  }
  Eigen::MatrixXi tetrahedra(input.tetrahedra.size(), 4);
  for (std::size_t t = 0; t < input.tetrahedra.size(); ++t)
  {
    for (int a = 0; a < 4; ++a)
    {
      tetrahedra(static_cast<Eigen::Index>(t), a) = static_cast<int>(input.tetrahedra[t][a]);
    }
    // libigl wants one orientation.
    const auto row = static_cast<Eigen::Index>(t);
    const Eigen::RowVector3d p = v.row(tetrahedra(row, 0));
    const Eigen::RowVector3d a = v.row(tetrahedra(row, 1)) - p;
    const Eigen::RowVector3d b = v.row(tetrahedra(row, 2)) - p;
    const Eigen::RowVector3d c = v.row(tetrahedra(row, 3)) - p;
    if (a.dot(b.cross(c)) < 0.0)
    {
      std::swap(tetrahedra(row, 0), tetrahedra(row, 1));
    }
  }
  Eigen::VectorXi known(fixed.size());
  for (std::size_t i = 0; i < fixed.size(); ++i)
  {
    known[static_cast<Eigen::Index>(i)] = static_cast<int>(fixed[i]);
  }
  igl::BBWData data;
  data.verbosity = 0;
  data.active_set_params.max_iter = iterations;
  Eigen::MatrixXd weights;
  if (!igl::bbw(v, tetrahedra, known, values, data, weights))
  {
    throw std::runtime_error("igl::bbw failed");
  }
  return weights;
}
}
