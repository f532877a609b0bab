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
  Vector3 to;
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
double DistanceTo(const ThoraxPart& part, const Vector3& p);

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

/// Where everything is. Heights z are world mm; lateral distances are from the midline.
class ThoraxAnatomy
{
public:
  explicit ThoraxAnatomy(const ThoraxSettings& settings);

  // The chest wall: where ribs run.
  double MidX(double z) const;   ///< the patient's midline, world x
  double SpineY(double z) const; ///< centre of the vertebral bodies, world y
  double FrontY(double z) const; ///< of the chest wall at the sternum
  double BackY(double z) const;  ///< of the chest wall beside the spine
  double HalfWidth(double z) const;
  /// The wall at an angle from the back (0) over the side (pi / 2) to the front (pi); side -1 right, 1 left.
  Vector3 OnWall(double angle, double z, int side) const;
  /// Distance from the wall, first order, mm; negative inside.
  double WallDistance(const Vector3& p) const;
  /// Distance from the skin, first order, mm; negative inside.
  double SkinDistance(const Vector3& p) const;
  /// Height of the diaphragm at a place, world z.
  double DiaphragmHeight(const Vector3& p) const;
  /// Top of the lung over a place.
  double LungTop(const Vector3& p) const;
  /// Distance from what is between the lungs, mm; negative inside.
  double MediastinumDistance(const Vector3& p) const;
  /// 1 inside the ventricles, 0 outside; in the fat around them between: first order distance of the epicardium, mm.
  double HeartDistance(const Vector3& p) const;

  std::vector<ThoraxTissue> vessels; ///< of mediastinum and lungs
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

  double Level(const Vector3& p, double& radius) const;
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
  std::vector<ThoraxPart> Mediastinum;
};
}

#endif
