/**
 * @file DistanceIntegral.h
 * @brief Integrals and percentiles of the distance over a surface.
 */
#ifndef DynamicCoronary_DistanceIntegral_h
#define DynamicCoronary_DistanceIntegral_h

#include "ComparedSide.h"

namespace coronary
{
/// A part of a triangle, with the distances of its corners and its centroid.
struct DistancePart
{
  double area = 0.0; ///< 0: replaced by its quarters
  std::array<double, 3> corner{};
  double centroid = 0.0;
  std::int32_t triangle = 0;
  std::int32_t cell = 0; ///< of the grid on the triangle, or in the list of quarters

  double Mean() const
  {
    return (this->corner[0] + this->corner[1] + this->corner[2]) / 12.0 + 0.75 * this->centroid;
  }
  double MeanSquare() const
  {
    return (this->corner[0] * this->corner[0] + this->corner[1] * this->corner[1] +
             this->corner[2] * this->corner[2]) /
      12.0 +
      0.75 * this->centroid * this->centroid;
  }
  double Unevenness() const
  {
    return this->area *
      std::abs(this->centroid - (this->corner[0] + this->corner[1] + this->corner[2]) / 3.0);
  }
};

using PartCorners = std::array<Vector3, 3>;

using PartCorners = std::array<Vector3, 3>;

/// The integral of the distance over one surface.
class DistanceIntegral
{
public:
  DistanceIntegral(ComparedSide& side, const TriangleBvh& other)
    : From(side)
    , To(other)
  {
  }

  void Compute(double errorBound, const ProgressCallback& progress);

  const std::vector<DistancePart>& Parts() const { return this->All; }
  double Error() const { return this->EstimatedError; }

private:
  PartCorners PlaceOf(const DistancePart& part) const;
  double DistanceAt(const Vector3& p, std::int64_t hint) const
  {
    return this->To.Closest(p, std::numeric_limits<double>::infinity(), hint).distance;
  }
  std::array<DistancePart, 4> Quarters(
    const DistancePart& part, std::array<PartCorners, 4>* places) const;
  void Start(const ProgressCallback& progress);
  void Estimate();
  bool Refine();

  ComparedSide& From;
  const TriangleBvh& To;
  std::vector<DistancePart> All;
  std::vector<std::int32_t> Grid;         ///< edges along each triangle's side
  std::vector<PartCorners> QuarterPlaces; ///< of the parts after the first `Gridded`
  std::int64_t Gridded = 0;
  double EstimatedError = 0.0;
};

/// Fills the area measures from some of the parts.
void FillAreaMeasures(const std::vector<const DistancePart*>& parts, SideDistance& result);
}

#endif
