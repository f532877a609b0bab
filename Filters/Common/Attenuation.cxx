#include "Attenuation.h"

#include <xraylib/xraylib.h>

#include <cmath>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr double IodineOfContrastMedium = 350.0; // mg/mL
constexpr double BariumDensity = 4.5;            // g/cm^3, of the sulphate
constexpr double NylonDensity = 1.01;
constexpr double BariumShare = 0.4;
// Where Carney's two lines meet at 120 kV.
constexpr double BreakHounsfield = 47.0;

using Data = XRayMaterialData;

Data ContrastData()
{
  const double iodine = 1e-3 * IodineOfContrastMedium;
  return { "contrast medium", 1.0 + iodine,
    { { "H2O", 1.0 / (1.0 + iodine) }, { "I", iodine / (1.0 + iodine) } } };
}

const std::array<Data, AllXRayMaterials.size()>& Table()
{
  static const std::array<Data, AllXRayMaterials.size()> table{ {
    { "water", 1.0, { { "H2O", 1.0 } } },
    ContrastData(),
    { "stainless steel", 7.93,
      { { "Fe", 0.705 }, { "Cr", 0.19 }, { "Ni", 0.095 }, { "Mn", 0.01 } } },
    { "cobalt-chromium L605", 9.13,
      { { "Co", 0.52 }, { "Cr", 0.20 }, { "W", 0.15 }, { "Ni", 0.10 }, { "Fe", 0.015 },
        { "Mn", 0.015 } } },
    { "nitinol", 6.45, { { "Ni", 0.558 }, { "Ti", 0.442 } } },
    { "platinum", 21.45, { { "Pt", 1.0 } } },
    { "tungsten", 19.3, { { "W", 1.0 } } },
    { "gold", 19.32, { { "Au", 1.0 } } },
    { "cortical bone", 1.92,
      { { "H", 0.034 }, { "C", 0.155 }, { "N", 0.042 }, { "O", 0.435 }, { "Na", 0.001 },
        { "Mg", 0.002 }, { "P", 0.103 }, { "S", 0.003 }, { "Ca", 0.225 } } },
    { "soft tissue", 1.06,
      { { "H", 0.102 }, { "C", 0.143 }, { "N", 0.034 }, { "O", 0.708 }, { "Na", 0.002 },
        { "P", 0.003 }, { "S", 0.003 }, { "Cl", 0.002 }, { "K", 0.003 } } },
    { "lung", 0.26,
      { { "H", 0.103 }, { "C", 0.105 }, { "N", 0.031 }, { "O", 0.749 }, { "Na", 0.002 },
        { "P", 0.002 }, { "S", 0.003 }, { "Cl", 0.003 }, { "K", 0.002 } } },
    { "adipose tissue", 0.95,
      { { "H", 0.114 }, { "C", 0.598 }, { "N", 0.007 }, { "O", 0.278 }, { "Na", 0.001 },
        { "S", 0.001 }, { "Cl", 0.001 } } },
    { "blood", 1.06,
      { { "H", 0.102 }, { "C", 0.110 }, { "N", 0.033 }, { "O", 0.745 }, { "Na", 0.001 },
        { "P", 0.001 }, { "S", 0.002 }, { "Cl", 0.003 }, { "K", 0.002 }, { "Fe", 0.001 } } },
    { "PTFE", 2.2, { { "C2F4", 1.0 } } },
    { "nylon", NylonDensity, { { "C12H23NO", 1.0 } } },
    { "polymer with barium sulphate",
      1.0 / ((1.0 - BariumShare) / NylonDensity + BariumShare / BariumDensity),
      { { "C12H23NO", 1.0 - BariumShare }, { "BaSO4", BariumShare } } },
  } };
  return table;
}

void RequireEnergy(const char* which, double energy, double low, double high)
{
  if (!(energy >= low && energy <= high))
  {
    throw std::invalid_argument(std::string("attenuation: ") + which + " is " +
      std::to_string(energy) + " keV; it has to be within " + std::to_string(std::lround(low)) +
      " to " + std::to_string(std::lround(high)) + " keV");
  }
}
}

const XRayMaterialData& DataOf(XRayMaterial material)
{
  return Table().at(static_cast<std::size_t>(material));
}

double MassAttenuation(const char* formula, double energy)
{
  xrl_error* error = nullptr;
  const double value = CS_Total_CP(formula, energy, &error);
  if (error != nullptr)
  {
    const std::string reason = error->message;
    xrl_error_free(error);
    throw std::runtime_error(std::string("xraylib: attenuation of ") + formula + " at " +
      std::to_string(energy) + " keV: " + reason);
  }
  return value;
}

double LinearAttenuation(XRayMaterial material, double energy)
{
  const Data& data = DataOf(material);
  double sum = 0.0;
  for (const Data::Part& part : data.parts)
  {
    sum += part.share * MassAttenuation(part.formula, energy);
  }
  return 0.1 * data.density * sum;
}

Attenuation::Attenuation(double energy, double ctEnergy)
  : Energy_(energy)
  , Coefficients{}
{
  RequireEnergy("the effective energy", energy, 20.0, 150.0);
  RequireEnergy("the CT's effective energy", ctEnergy, 40.0, 120.0);
  for (std::size_t k = 0; k < AllXRayMaterials.size(); ++k)
  {
    this->Coefficients[k] = LinearAttenuation(AllXRayMaterials[k], energy);
  }
  this->Iodine = MassAttenuation("I", energy);
  const double water = LinearAttenuation(XRayMaterial::Water, ctEnergy);
  const double bone = LinearAttenuation(XRayMaterial::CorticalBone, ctEnergy);
  this->BoneHounsfield = 1000.0 * (bone - water) / water;
}

double Attenuation::Of(XRayMaterial material) const
{
  return this->Coefficients.at(static_cast<std::size_t>(material));
}

double Attenuation::OfContrastMedium(double iodine) const
{
  if (!(iodine >= 0.0 && iodine <= 1000.0))
  {
    throw std::invalid_argument("attenuation: the contrast medium has " + std::to_string(iodine) +
      " mg of iodine a mL; it has to be within 0 to 1000");
  }
  return this->Of(XRayMaterial::Water) + 0.1 * 1e-3 * iodine * this->Iodine;
}

double Attenuation::OfHounsfield(double hounsfield) const
{
  const double water = this->Of(XRayMaterial::Water);
  if (!(hounsfield > -1000.0))
  {
    return 0.0;
  }
  if (hounsfield <= BreakHounsfield)
  {
    return water * (1.0 + 1e-3 * hounsfield);
  }
  const double start = water * (1.0 + 1e-3 * BreakHounsfield);
  const double slope =
    (this->Of(XRayMaterial::CorticalBone) - start) / (this->BoneHounsfield - BreakHounsfield);
  return start + slope * (hounsfield - BreakHounsfield);
}
}
