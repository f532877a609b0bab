/**
 * @file Attenuation.h
 * @brief How strongly materials attenuate X-rays of one energy.
 *
 * Mass attenuation coefficients (photoelectric effect, coherent and incoherent scattering) are xraylib's; source:
 * Schoonjans et al., "The xraylib library for X-ray-matter interactions", Spectrochimica Acta B 66 (2011) 776.
 */
#ifndef DynamicCoronary_Attenuation_h
#define DynamicCoronary_Attenuation_h

#include <array>
#include <vector>

namespace coronary
{
enum class XRayMaterial
{
  Water,
  ContrastMedium, ///< 350 mg of iodine a mL
  StainlessSteel, ///< AISI 304
  CobaltChromium, ///< L605
  Nitinol,        ///< Ni 55.8, Ti 44.2 % of mass
  Platinum,
  Tungsten,
  Gold,
  CorticalBone,
  SoftTissue,
  Lung, ///< inflated
  Adipose,
  Blood,
  Ptfe,
  Nylon,        ///< polyamide 12
  BariumPolymer ///< polyamide 12 with 40 % of its mass of barium sulphate
};

constexpr std::array<XRayMaterial, 16> AllXRayMaterials{ XRayMaterial::Water,
  XRayMaterial::ContrastMedium, XRayMaterial::StainlessSteel, XRayMaterial::CobaltChromium,
  XRayMaterial::Nitinol, XRayMaterial::Platinum, XRayMaterial::Tungsten, XRayMaterial::Gold,
  XRayMaterial::CorticalBone, XRayMaterial::SoftTissue, XRayMaterial::Lung, XRayMaterial::Adipose,
  XRayMaterial::Blood, XRayMaterial::Ptfe, XRayMaterial::Nylon, XRayMaterial::BariumPolymer };

/// What a material is made of.
struct XRayMaterialData
{
  struct Part
  {
    const char* formula; ///< chemical
    double share;        ///< of the mass, 0 to 1
  };
  const char* name; ///< English
  double density;   ///< g/cm^3
  std::vector<Part> parts;
};

/**
 * Tissues: ICRU report 44. The contrast medium is iodine in water, OfContrastMedium().
 */
const XRayMaterialData& DataOf(XRayMaterial material);

/// @param formula  chemical @param energy  keV @return cm^2/g
/// @throws std::runtime_error when xraylib has none
double MassAttenuation(const char* formula, double energy);

/// @param energy  keV @return 1/mm
double LinearAttenuation(XRayMaterial material, double energy);

/// Linear attenuation coefficients at one energy, which stands for a tube's spectrum.
class Attenuation
{
public:
  /// @param energy  effective energy of the X-rays, keV, 20 to 150
  /// @param ctEnergy  effective energy of the scanner that made the Hounsfield units, keV, 40 to 120; 120 kV: about 70
  /// @throws std::invalid_argument naming the energy
  explicit Attenuation(double energy = 60.0, double ctEnergy = 70.0);

  double Energy() const { return this->Energy_; } ///< keV

  /// @return 1/mm
  double Of(XRayMaterial material) const;

  /// Iodine dissolved in water of 1 g/cm^3. @param iodine  mg/mL, 0 to 1000 @return 1/mm
  /// @throws std::invalid_argument
  double OfContrastMedium(double iodine) const;

  /**
   * Attenuation of what a CT shows. Up to 47 HU as much of water as there is: mu_water (1 + HU / 1000), not negative.
   * Above, on the straight line from there to cortical bone, whose Hounsfield units follow from ctEnergy.
   * Source of the two lines and of the place where they meet at 120 kV: Carney et al., "Method for transforming CT
   * images for attenuation correction in PET/CT imaging", Medical Physics 33 (2006) 976; here their ends are
   * xraylib's. Iodine and metal in a CT are taken for bone.
   * @return 1/mm, 0 or more; HU that are not a number give 0
   */
  double OfHounsfield(double hounsfield) const;

private:
  double Energy_;
  std::array<double, AllXRayMaterials.size()> Coefficients; ///< 1/mm
  double Iodine;                                            ///< mass attenuation, cm^2/g
  double BoneHounsfield;                                    ///< of cortical bone in the CT
};
}

#endif
