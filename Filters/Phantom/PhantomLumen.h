/**
 * @file PhantomLumen.h
 * @brief The lumen of all arteries at one moment, as a signed distance.
 */
#ifndef DynamicCoronary_PhantomLumen_h
#define DynamicCoronary_PhantomLumen_h

#include "PhantomAnatomy.h"

#include <unordered_map>

namespace coronary
{
/**
 * Each vessel is a tube of varying radius around its axis, cut flat at the ostia and tips. Side
 * vessels are joined to their parent by a circular fillet around their common point only, so that
 * vessels that merely pass close never merge.
 */
class PhantomLumen
{
public:
  /// What lies at a position. Distances are in mm.
  struct Sample
  {
    double distance = 0.0;  ///< signed distance to the wall, negative inside, at most `reach`
    double radius = 0.0;    ///< of the nearest tube, mm
    std::int32_t step = -1; ///< index of the nearest axis step, -1 when none is within reach
    double fraction = 0.0;  ///< 0..1 along that step
  };

  /// A short list of the tube pieces that can matter inside a ball.
  struct Candidates
  {
    std::vector<std::int32_t> pieces;
    std::vector<std::int32_t> junctions;
    std::vector<std::int32_t> ends;
    bool Empty() const { return this->pieces.empty(); }
  };

  /**
   * @param points, radius  of the anatomy's tree at the moment in question
   * @param endNormals      outward unit normals of the flat ends, in the order of anatomy.ends
   * @param reach           distances beyond it are cut to it, mm
   * @param blocked         per point: no lumen there
   */
  PhantomLumen(const PhantomAnatomy& anatomy, const std::vector<Vector3>& points,
    const std::vector<double>& radius, const std::vector<Vector3>& endNormals, double reach,
    const std::vector<char>& blocked);

  Sample Evaluate(const Vector3& position) const;
  Sample Evaluate(const Vector3& position, const Candidates& candidates) const;

  /// Everything within `reach` of some point of the ball.
  void Collect(const Vector3& centre, double ballRadius, Candidates& candidates) const;

  /**
   * Moves a nearby point onto the wall.
   * @return the distance that is left, mm
   */
  double Project(Vector3& position, double tolerance) const;

  double Reach() const { return this->Limit; }

private:
  struct Piece
  {
    Vector3 start;
    Vector3 axis; ///< from start to end
    double inverseSquaredLength;
    double radius;
    double widening; ///< radius change to the end
    std::int32_t vessel;
    std::int32_t step;
  };
  struct Fillet
  {
    Vector3 centre;
    double range;
    double radius;
    int parentVessel;
    int childVessel;
  };
  struct Cut
  {
    Vector3 point;
    Vector3 normal; ///< outwards
    double range;
    int vessel;
  };

  std::vector<Piece> Pieces;
  std::vector<Fillet> Fillets;
  std::vector<Cut> Cuts;
  std::unordered_map<std::int64_t, std::vector<std::int32_t>> Bins;
  double Limit;
  double WidestRadius = 0.0;
};
}

#endif
