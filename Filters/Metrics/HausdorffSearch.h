/**
 * @file HausdorffSearch.h
 * @brief The Hausdorff distance of surfaces by branch and bound.
 */
#ifndef DynamicCoronary_HausdorffSearch_h
#define DynamicCoronary_HausdorffSearch_h

#include "DistanceIntegral.h"

namespace coronary
{
/// Branch and bound for the supremum of the distance over each group of a side.
class HausdorffSearch
{
public:
  HausdorffSearch(
    const ComparedSide& from, const ComparedSide& to, const MeshDistanceSettings& settings)
    : From(from)
    , To(to)
    , Settings(settings)
    , Best(from.groups.size())
    , Discarded(from.groups.size(), 0.0)
  {
  }

  struct Attained
  {
    double distance = -1.0;
    Vector3 at = Vector3::Zero();
    std::int32_t triangle = -1;
  };

  void Run(const std::vector<DistancePart>& parts, const ProgressCallback& progress);

  const std::vector<Attained>& Results() const { return this->Best; }

  /// How much greater the supremum over a group can be.
  double Error(std::size_t group) const
  {
    return std::max(0.0, this->Discarded[group] - this->Best[group].distance);
  }
  bool Complete() const { return this->Finished; }

private:
  /// Of a triangle, with a nearest triangle of each corner.
  struct Piece
  {
    PartCorners corner;
    std::array<double, 3> distance;
    std::array<std::int32_t, 3> nearest;
    double upper;
    std::int32_t triangle;
  };
  struct Cut
  {
    std::array<Piece, 4> quarters;
    std::array<double, 3> distance;
    std::array<Vector3, 3> middle;
  };

  Piece PieceOf(std::int64_t triangle) const;
  /// What is known already is attained.
  void OfferKnown(const std::vector<DistancePart>& parts);
  /// Triangles that are left over, with the true distances of their corners; ascending.
  std::vector<Piece> Correct(std::vector<double>& upper);
  /// Sorts out what can not be greater than what is attained.
  std::vector<Piece> Select(const std::vector<double>& upper, const std::vector<Piece>& corrected);
  Cut Quarter(const Piece& piece) const;
  void Discard(const Piece& piece);
  bool CanBeGreater(const Piece& piece) const;
  double UpperBound(const Piece& piece, std::int32_t extra, double enough) const;
  double FanBound(const Piece& piece) const;
  void Offer(std::size_t group, double distance, const Vector3& at, std::int32_t triangle)
  {
    if (distance > this->Best[group].distance)
    {
      this->Best[group] = { distance, at, triangle };
    }
  }

  const ComparedSide& From;
  const ComparedSide& To;
  const MeshDistanceSettings& Settings;
  std::vector<Attained> Best;
  std::vector<double> Discarded; ///< greatest upper bound of what was not looked at more closely
  bool Finished = true;
};
}

#endif
