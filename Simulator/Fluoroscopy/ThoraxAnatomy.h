// The shapes that ThoraxPhantom puts into its voxels. Not installed.
#ifndef DynamicCoronary_ThoraxAnatomy_h
#define DynamicCoronary_ThoraxAnatomy_h

#include "ThoraxPhantom.h"

#include <array>
#include <variant>
#include <vector>

namespace coronary
{
/// A straight piece with elliptic cross-sections and round ends.
struct ThoraxRod
{
  Vector3 from;
  Vector3 forward;                       ///< unit, to the other end
  double length;                         ///< mm
  Vector3 across;                        ///< unit, first axis of the cross-section
  std::array<double, 2> radii{ 1, 1 };   ///< along `across` at both ends, mm
  std::array<double, 2> heights{ 1, 1 }; ///< along the other axis, mm
};

/// A vertebral body or disc: an elliptic cylinder with a waist.
struct ThoraxDrum
{
  Vector3 centre;
  Matrix3 axes;       ///< rows: left, back, up
  Vector3 half;       ///< mm
  double waist = 0.0; ///< how much narrower it is in the middle, fraction
};

/// A flat bone.
struct ThoraxPlate
{
  std::array<Vector3, 3> corners;
  double half = 1.0; ///< thickness, mm
};

using ThoraxPart = std::variant<ThoraxRod, ThoraxDrum, ThoraxPlate>;

/// Signed distance, negative inside, mm: exact at the surface, to first order near it.
double DistanceTo(const ThoraxRod& rod, const Vector3& p);
double DistanceTo(const ThoraxDrum& drum, const Vector3& p);
double DistanceTo(const ThoraxPlate& plate, const Vector3& p);

struct ThoraxBox
{
  Vector3 low{ Vector3::Constant(1e9) };
  Vector3 high{ Vector3::Constant(-1e9) };
  void Add(const ThoraxBox& other)
  {
    this->low = this->low.cwiseMin(other.low);
    this->high = this->high.cwiseMax(other.high);
  }
};

ThoraxBox BoxOf(const ThoraxPart& part);

/// Parts that have grown together, with a shell around them all.
struct ThoraxTissue
{
  std::vector<ThoraxPart> parts;
  double shell = 0.0;      ///< thickness, mm; 0: none
  float shellValue = 0.0F; ///< HU
  float coreValue = 0.0F;
};

/// One number for each height, between knots by cubic pieces without overshoot.
class HeightProfile
{
public:
  /// Knots of height and value, heights increasing.
  explicit HeightProfile(std::vector<std::array<double, 2>> knots);
  double operator()(double z) const;

private:
  std::vector<std::array<double, 2>> Knots;
};

/// The cross-section of chest and skin at a height, world mm.
struct ThoraxSlice
{
  double middleX; ///< the patient's midline
  double front;   ///< of the chest wall, where ribs run: y at the sternum
  double back;    ///< beside the spine
  double halfWidth;
  double skinFront;
  double skinBack;
  double skinHalfWidth;
};

/// Where everything is.
class ThoraxAnatomy
{
public:
  explicit ThoraxAnatomy(const ThoraxSettings& settings);

  ThoraxSlice Slice(double z) const;
  /// Distance from the skin, first order, mm; negative inside.
  static double SkinDistance(const ThoraxSlice& slice, const Vector3& p);
  /// 1 on the chest wall, below inside; `radius`: from its middle, mm.
  double WallLevel(const ThoraxSlice& slice, const Vector3& p, double& radius) const;
  /// Distance from the chest wall, first order, mm; negative inside.
  static double WallDistance(double level, double radius);
  /// Height of the diaphragm over or below a place, world z; some height below it for places far above.
  double DiaphragmHeight(const ThoraxSlice& slice, const Vector3& p) const;
  /// The same of the lungs' upper end.
  static double LungTop(double wallLevel);
  /// Distance from the epicardium of the ventricles, first order, mm.
  static double HeartDistance(const Vector3& p);

  std::vector<ThoraxPart> mediastinum; ///< what the lungs do not reach
  std::vector<ThoraxTissue> vessels;   ///< of mediastinum and lungs
  std::vector<ThoraxTissue> airways;
  std::vector<ThoraxTissue> bones;

private:
  struct Vertebra
  {
    Vector3 centre;
    Matrix3 axes;   ///< rows: left, back, up
    double spacing; ///< to the next one below, mm
    double disc;    ///< height, mm
    double halfWidth;
    double halfDepth;
    Vector3 At(double x, double y, double z) const
    {
      return this->centre + this->axes.transpose() * Vector3(x, y, z);
    }
    double HalfHeight() const { return 0.5 * (this->spacing - this->disc); }
  };

  double MidX(double z) const;
  double SpineY(double z) const; ///< centre of the vertebral bodies
  double FrontY(double z) const;
  /// The chest wall at an angle from the back (0) over the side (pi / 2) to the front (pi); side -1 right, 1 left.
  Vector3 OnWall(double angle, double z, int side) const;
  void MakeWall();
  void MakeVertebrae();
  void AddVertebra(int number);
  void AddRib(int number, int side);
  void AddCartilage(int number, int side, const Vector3& from);
  void AddSternum();
  void AddShoulder(int side);
  void AddGreatVessels();
  void AddLungVessels(int side);
  void Branch(ThoraxTissue& tissue, const Vector3& from, const Vector3& direction, double radius,
    int generation, class RandomStream& random) const;

  ThoraxSettings Settings;
  double Lateral = 1.0; ///< scales
  double Sagittal = 1.0;
  double RibSlope = 1.0;
  double Scoliosis = 0.0; ///< mm
  double Kyphosis = 1.0;
  HeightProfile HalfWidths;
  HeightProfile Fronts;
  HeightProfile SkinWidths;
  std::vector<float>
    WallRadii; ///< of the cross-section of size 1, over the angle from back to front
  std::vector<Vertebra> Vertebrae; ///< from C7 (0) to L2 (14)
};
}

#endif
