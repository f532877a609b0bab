/**
 * @file PhantomDisease.h
 * @brief What a phantom's coronary arteries can suffer from, as a short list of things.
 */
#ifndef DynamicCoronary_PhantomDisease_h
#define DynamicCoronary_PhantomDisease_h

#include <string>
#include <vector>

namespace coronary
{
enum class PhantomLesionKind
{
  Stenosis,      ///< the lumen alone is narrow, like a Gaussian of width `length` at half its depth
  Plaque,        ///< the lumen is narrow, the outer wall has a course of its own
  Calcification, ///< a plaque that bulges outwards as far as its calcium needs, beside a wide lumen
  Spot,          ///< a ball of calcium of diameter `calciumThickness` on the lumen's wall
  Occlusion,     ///< no lumen over `length`; what lies behind it fills late, from its far end on
  Stent,         ///< rings of metal on the healthy lumen's wall; `degree` is narrowed again inside
  Ectasia,       ///< the lumen is wider by the factor 1 + `degree`
  Bridge         ///< runs in the muscle, which squeezes it in systole by `degree`
};

/**
 * Something about a stretch of a vessel. Along the vessel all but stenoses and spots have a plateau
 * with soft shoulders, `length` long between the places where it is at half of its height.
 *
 * In a cross section the lumen is a disc of radius r around the vessel's axis and the outer wall one
 * of radius R around a place that is off the axis by `eccentricity` (R - r) towards `angle`. Between
 * them there is fibrous tissue, in it a round core of lipid and an arc of calcium at the outer wall.
 * R is the healthy lumen's radius times `remodelling`.
 */
struct PhantomLesion
{
  PhantomLesionKind kind = PhantomLesionKind::Plaque;
  std::string vessel;    ///< "LAD" (with the left main), "LCx", "RCA", "D1", ..., a graft
  double position = 0.0; ///< of the middle, mm from the vessel's origin
  bool relative = false; ///< `position` is a share of the vessel's length
  double length = 10.0;  ///< between the places where it is at half of its height, mm, 0.5 to 150
  double degree = 0.0;   ///< share of the diameter that is gone, 0 to 0.99; Ectasia: 0 to 2
  double angle = 0.0;    ///< degrees about the axis: 0 away from the heart, 180 to the muscle
  double twist = 0.0;    ///< how it turns along the vessel, degrees a mm, -30 to 30
  double eccentricity = 0.0;   ///< 0 even all around, 1 all of it on one side
  double remodelling = 1.0;    ///< outer wall's diameter over the healthy lumen's, 0.7 to 2
  double lipid = 0.0;          ///< share of the thickness that the core takes, 0 to 1
  double rim = 0.0;            ///< around the core, mm, 0 to 1: napkin ring
  double calciumArc = 0.0;     ///< of the calcium along the outer wall, degrees; 0: one rod
  double calciumThickness = 0; ///< of the calcium, mm; 0: there is none
  double calciumLength = 0.0;  ///< of the calcium, mm; 0: as long as the lesion
  double fibrousValue = 90.0;  ///< of the plaque, HU: usual 30 to 130
  double lipidValue = 20.0;    ///< of the lipid core, HU: usual -30 to 60
  double rimValue = 130.0;     ///< of the rim, HU, -100 to 300
  double calciumValue = 850.0; ///< of the calcium, HU at 120 kV, 130 to 3000
  double fill = 0.6;           ///< Occlusion: contrast just behind it, share of that at the ostium
  double strut = 0.09;         ///< Stent: diameter of its wires, mm, 0.04 to 0.3
  double metalValue = 25000.0; ///< Stent: of its metal, HU at 120 kV, 1000 to 60000
};

/// A number of a lesion under the name that files have for it.
struct LesionNumber
{
  const char* name;
  double PhantomLesion::*member;
  double low;
  double high;
};
const std::vector<LesionNumber>& AllLesionNumbers();

///@{
/// "stenosis", "plaque", "calcification", "spot", "occlusion", "stent", "ectasia", "bridge".
const std::vector<std::string>& PhantomLesionKinds();
std::string PhantomLesionKindName(PhantomLesionKind kind);
///@}

/// A lesion with the usual numbers of its kind.
/// @throws std::invalid_argument for a kind that is not known
PhantomLesion UsualLesion(const std::string& kind);

/// A vessel that a surgeon has led to a coronary artery.
struct PhantomGraft
{
  std::string name;       ///< "LIMA", "SVG1", ...: unlike all other vessels
  bool mammary = false;   ///< from the left chest wall; else a vein from the ascending aorta
  std::string vessel;     ///< that it is sewn to
  double position = 40.0; ///< mm from that vessel's origin
  double diameter = 3.0;  ///< mm, 1 to 6
};

/// A thin winding vessel from one artery to what lies behind an occlusion of another.
struct PhantomCollateral
{
  std::string name;          ///< unlike all other vessels
  std::string from;          ///< the artery that it leaves
  std::string to;            ///< the artery that it fills
  double fromFraction = 0.9; ///< of that artery's length
  double toFraction = 0.7;
  double diameter = 0.5; ///< mm, 0.2 to 1.5
  bool septal = false;   ///< in the septum's muscle; else on the heart
};

/// Where the coronary arteries begin.
enum class CoronaryOrigin
{
  Usual,
  HighRight,           ///< the right one 15 mm above its sinus
  CircumflexFromRight, ///< the circumflex from the right one, behind the aorta
  SingleRight          ///< all from the right sinus: the left main passes behind the aorta
};

/// All disease of a heart; none by default.
struct PhantomDisease
{
  std::vector<PhantomLesion> lesions;
  std::vector<PhantomGraft> grafts;
  std::vector<PhantomCollateral> collaterals;
  CoronaryOrigin origin = CoronaryOrigin::Usual;
  bool leads = false;   ///< a pacemaker's, in the right atrium and ventricle
  double bodyFat = 0.0; ///< that the trunk is wider by all around, mm, 0 to 80

  /// @throws std::invalid_argument that names the first entry at fault
  void Validate() const;
};

///@{
/// "usual", "high-right", "circumflex-from-right", "single-right".
const std::vector<std::string>& OriginNames();
///@}

struct PhantomSettings;

/// "stenosed", "calcified", "occluded", ...: what AddDisease() knows.
const std::vector<std::string>& DiseasePresets();

/// Adds a usual case of a disease to what the settings have.
/// @throws std::invalid_argument for a name that is not known
void AddDisease(const std::string& preset, PhantomSettings& settings);
}

#endif
