// Attenuation coefficients against xraylib's own numbers and NIST's printed ones.
#include "Attenuation.h"

#include "Refusals.h"
#include "XRayTestScenes.h"

#include <xraylib/xraylib.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>

using namespace coronary;

namespace
{
double Library(const char* formula, double energy)
{
  return CS_Total_CP(formula, energy, nullptr);
}
}

TEST(Attenuation, IsXraylibs)
{
  double worst = 0.0;
  for (const double energy : { 20.0, 33.0, 34.0, 45.5, 60.0, 80.0, 100.0, 150.0 })
  {
    const Attenuation attenuation(energy);
    for (const XRayMaterial material : AllXRayMaterials)
    {
      const XRayMaterialData& data = DataOf(material);
      double wanted = 0.0;
      double shares = 0.0;
      for (const auto& part : data.parts)
      {
        wanted += 0.1 * data.density * part.share * Library(part.formula, energy);
        shares += part.share;
      }
      EXPECT_NEAR(shares, 1.0, 1e-9) << data.name;
      worst = std::max(worst, std::abs(attenuation.Of(material) / wanted - 1.0));
    }
    const double medium = 0.1 * (Library("H2O", energy) + 0.35 * CS_Total(53, energy, nullptr));
    worst = std::max(worst, std::abs(attenuation.Of(XRayMaterial::ContrastMedium) / medium - 1.0));
    worst = std::max(worst, std::abs(attenuation.OfContrastMedium(350.0) / medium - 1.0));
    const double steel = 0.1 * 7.93 *
      (0.705 * CS_Total(26, energy, nullptr) + 0.19 * CS_Total(24, energy, nullptr) +
        0.095 * CS_Total(28, energy, nullptr) + 0.01 * CS_Total(25, energy, nullptr));
    worst = std::max(worst, std::abs(attenuation.Of(XRayMaterial::StainlessSteel) / steel - 1.0));
  }
  Row("mu: 15 materials, 8 energies against xraylib, greatest relative difference", 0.0, worst,
    "1e-6");
  EXPECT_LE(worst, 1e-6);
}

TEST(Attenuation, IsNistsAt60KiloElectronVolts)
{
  // Hubbell and Seltzer, NISTIR 5632, tables 3 and 4, cm^2/g.
  const Attenuation attenuation(60.0);
  const auto mass = [&](XRayMaterial material)
  { return 10.0 * attenuation.Of(material) / DataOf(material).density; };
  EXPECT_NEAR(mass(XRayMaterial::Water), 0.2059, 0.01 * 0.2059);
  EXPECT_NEAR(mass(XRayMaterial::SoftTissue), 0.2048, 0.01 * 0.2048);
  EXPECT_NEAR(mass(XRayMaterial::CorticalBone), 0.3148, 0.01 * 0.3148);
  EXPECT_NEAR(mass(XRayMaterial::Tungsten), 3.713, 0.02 * 3.713);
  EXPECT_NEAR(mass(XRayMaterial::Platinum), 4.339, 0.02 * 4.339);
  EXPECT_NEAR(mass(XRayMaterial::Gold), 4.528, 0.02 * 4.528);
  Row("mu: water at 60 keV, NIST, 1/mm", 0.02059, attenuation.Of(XRayMaterial::Water), "1 %");
  Row("mu: cortical bone at 60 keV, NIST, 1/mm", 0.1 * 1.92 * 0.3148,
    attenuation.Of(XRayMaterial::CorticalBone), "1 %");
}

TEST(Attenuation, IodineStandsOutAboveItsEdge)
{
  EXPECT_GT(Attenuation(34.0).Of(XRayMaterial::ContrastMedium),
    3.0 * Attenuation(33.0).Of(XRayMaterial::ContrastMedium));
  const Attenuation attenuation;
  EXPECT_DOUBLE_EQ(attenuation.OfContrastMedium(0.0), attenuation.Of(XRayMaterial::Water));
}

TEST(Attenuation, HounsfieldUnitsFollowTwoLines)
{
  for (const double energy : { 20.0, 60.0, 150.0 })
  {
    const Attenuation attenuation(energy);
    const double water = attenuation.Of(XRayMaterial::Water);
    EXPECT_DOUBLE_EQ(attenuation.OfHounsfield(0.0), water);
    EXPECT_NEAR(attenuation.OfHounsfield(-500.0), 0.5 * water, 1e-12);
    EXPECT_EQ(attenuation.OfHounsfield(-1000.0), 0.0);
    EXPECT_EQ(attenuation.OfHounsfield(-3024.0), 0.0);
    EXPECT_EQ(attenuation.OfHounsfield(NAN), 0.0);
    double before = -1.0;
    for (int hu = -1000; hu <= 3071; ++hu)
    {
      const double now = attenuation.OfHounsfield(hu);
      EXPECT_GT(now, before);
      before = now;
    }
  }
  // At the CT's own energy, bone's Hounsfield units are those by definition.
  const Attenuation atCt(70.0, 70.0);
  const double water = atCt.Of(XRayMaterial::Water);
  const double bone = atCt.Of(XRayMaterial::CorticalBone);
  const double hounsfield = 1000.0 * (bone - water) / water;
  EXPECT_NEAR(atCt.OfHounsfield(hounsfield), bone, 1e-12);
  EXPECT_NEAR(Attenuation(60.0, 70.0).OfHounsfield(hounsfield),
    Attenuation(60.0).Of(XRayMaterial::CorticalBone), 1e-12);
  Row("mu: cortical bone from its Hounsfield units at 60 keV, 1/mm",
    Attenuation(60.0).Of(XRayMaterial::CorticalBone),
    Attenuation(60.0, 70.0).OfHounsfield(hounsfield), "1e-12");
}

TEST(Attenuation, RefusesWhatXraysAreNot)
{
  ExpectRefusal([] { Attenuation(10.0); }, "effective energy");
  ExpectRefusal([] { Attenuation(NAN); }, "effective energy");
  ExpectRefusal([] { Attenuation(60.0, 200.0); }, "CT's effective energy");
  ExpectRefusal([] { Attenuation().OfContrastMedium(-1.0); }, "iodine");
}
