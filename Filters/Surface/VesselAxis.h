/**
 * @file VesselAxis.h
 * @brief A vessel's axis as a smooth curve with radius, cross-section and frame.
 */
#ifndef DynamicCoronary_VesselAxis_h
#define DynamicCoronary_VesselAxis_h

#include "Geometry.h"

namespace coronary
{
/// How the cross-sections' normal and binormal are chosen along an axis.
enum class SweepFrame : int
{
  Blended = 0,           ///< Frenet-Serret where the curve bends, least twist where it does not
  RotationMinimising = 1 ///< least twist everywhere
};

/**
 * Cubic B-spline through (or, where points lie closer than the vessel is wide, near) an axis.
 *
 * The spline's knots are never closer than `smoothing` times the radius: waves of the input that
 * are shorter than that are noise, not the course of a vessel of that width. It is sampled at
 * stations by arc length; between two stations all quantities are cubic.
 */
class VesselAxis
{
public:
  /// What lies at an arc length.
  struct Station
  {
    double s = 0.0; ///< arc length from the axis's start, mm
    Vector3 point = Vector3::Zero();
    Vector3 tangent = Vector3::UnitX();  ///< unit
    Vector3 curvature = Vector3::Zero(); ///< derivative of the tangent, 1/mm
    double radius = 1.0;                 ///< mm
    double slope = 0.0;                  ///< change of the radius per mm
    Vector3 normal = Vector3::UnitY();   ///< unit, of the sweep's frame
    Vector3 binormal = Vector3::UnitZ(); ///< tangent x normal
    double twist = 0.0;                  ///< of the frame against least twist, rad/mm
    double torsion = 0.0;                ///< of the curve, rad/mm; 0 where it is straight
  };

  /// A position seen from the axis.
  struct Sample
  {
    double distance = 0.0; ///< to the wall, mm, negative inside
    Vector3 gradient = Vector3::UnitX();
    double s = 0.0;      ///< arc length of the nearest axis point, mm; beyond an open end outside
                         ///< of 0..Length()
    double radius = 0.0; ///< of the wall in that direction, mm
    double curvature = 0.0;           ///< greatest principal curvature of the tube there, 1/mm
    Vector3 centre = Vector3::Zero(); ///< the nearest axis point
    int piece = 0;
  };

  /**
   * @param points      at least two different ones, mm
   * @param radius      one a point, mm
   * @param smoothing   least distance of knots in radii
   * @param startOpen   true: a free end, behind which the tube is thought to go on straight;
   *                    false: the start is rounded
   * @param endOpen     the same at the other end
   */
  VesselAxis(const std::vector<Vector3>& points, const std::vector<double>& radius,
    double smoothing, bool startOpen, bool endOpen);

  /// The same with a smoothing for each point.
  VesselAxis(const std::vector<Vector3>& points, const std::vector<double>& radius,
    const std::vector<double>& smoothing, bool startOpen, bool endOpen);

  /**
   * Turns the frames along the axis.
   * @param first  direction whose part normal to the axis is the normal at the start (with
   *               RotationMinimising) or decides between the two Frenet normals
   */
  void SetFrames(SweepFrame frame, const Vector3& first);

  /**
   * Cross-sections other than circles.
   * @param s           rising arc lengths at which contours are given, mm
   * @param contours    for each, `samples` radii in equal steps of the angle from the frame's
   *                    normal towards the binormal, mm
   */
  void SetContours(const std::vector<double>& s, const std::vector<std::vector<double>>& contours);

  double Length() const { return this->Stations.back().s; }
  const std::vector<Station>& AllStations() const { return this->Stations; }
  int Pieces() const { return static_cast<int>(this->Cubics.size()); }
  int PieceAt(double s) const;
  Station At(double s) const;

  /// Radius of the wall at an arc length and an angle from the normal towards the binormal, mm.
  double WallRadius(double s, double angle) const;
  Vector3 WallPoint(double s, double angle) const;
  bool IsRound() const { return this->ContourSize == 0; }

  /// The wall's distance, from the axis point that is nearest when one walks from piece `hint`.
  void Evaluate(const Vector3& position, int hint, Sample& sample) const;

  /// The piece of low..high whose wall is nearest by the straight chord, and a lower bound.
  int NearestPiece(const Vector3& position, int low, int high, double& distance) const;

  /// Arc length of the axis point nearest to a position.
  double NearestArcLength(const Vector3& position) const;

private:
  struct Cubic
  {
    Vector3 a, b, c, d; ///< a + b t + c t^2 + d t^3
    double r0, r1, r2, r3;
    double s;
    double ds;
  };

  double ContourAt(int piece, double t, double angle) const;
  void Frame(int piece, double t, const Vector3& tangent, Vector3& normal, Vector3& binormal) const;
  void Locate(const Vector3& position, int& piece, double& t) const;
  double Value(const Vector3& position, int& piece, double& t) const;

  std::vector<Station> Stations;
  std::vector<Cubic> Cubics;
  std::vector<double> Contours; ///< B-spline coefficients relative to the radius, a row a station
  int ContourSize = 0;
  bool StartOpen;
  bool EndOpen;
};
}

#endif
