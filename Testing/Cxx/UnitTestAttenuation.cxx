// Attenuation coefficients against the numbers that NIST prints.
#include "Attenuation.h"

#include "Refusals.h"
#include "XRayTestScenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace UnitTestAttenuation
{
using namespace coronary;

namespace
{
/// cm^2/g.
struct Printed
{
  const char* what;
  double energy; ///< keV
  double value;
};

// Hubbell and Seltzer, NISTIR 5632 (NIST Standard Reference Database 126, July 2004; https://physics.nist.gov/xaamdi),
// tables 3 (elements) and 4 (water; tissues of ICRU report 44), column mu / rho.
constexpr Printed NistElements[] = { { "I", 20.0, 25.43 }, { "I", 30.0, 8.561 },
  { "I", 40.0, 22.10 }, { "I", 50.0, 12.32 }, { "I", 60.0, 7.579 }, { "I", 80.0, 3.510 },
  { "I", 100.0, 1.942 }, { "I", 150.0, 0.6978 }, { "Fe", 20.0, 25.68 }, { "Fe", 30.0, 8.176 },
  { "Fe", 40.0, 3.629 }, { "Fe", 50.0, 1.958 }, { "Fe", 60.0, 1.205 }, { "Fe", 80.0, 0.5952 },
  { "W", 60.0, 3.713 }, { "Pt", 60.0, 4.339 }, { "Au", 60.0, 4.528 } };

struct PrintedTissue
{
  XRayMaterial material;
  double values[7]; ///< at NistEnergies
};
constexpr double NistEnergies[] = { 20.0, 30.0, 40.0, 50.0, 60.0, 80.0, 100.0 };
constexpr PrintedTissue NistTissues[] = {
  { XRayMaterial::Water, { 0.8096, 0.3756, 0.2683, 0.2269, 0.2059, 0.1837, 0.1707 } },
  { XRayMaterial::CorticalBone, { 4.001, 1.331, 0.6655, 0.4242, 0.3148, 0.2229, 0.1855 } },
  { XRayMaterial::Lung, { 0.8316, 0.3815, 0.2699, 0.2270, 0.2053, 0.1826, 0.1695 } },
  { XRayMaterial::Adipose, { 0.5677, 0.3063, 0.2396, 0.2123, 0.1974, 0.1800, 0.1688 } }
};
}

TEST(Attenuation, IsWhatNistPrints)
{
  double elements = 0.0;
  for (const Printed& printed : NistElements)
  {
    const double off = MassAttenuation(printed.what, printed.energy) / printed.value - 1.0;
    EXPECT_LE(std::abs(off), 0.001) << printed.what << " at " << printed.energy << " keV";
    elements = std::max(elements, std::abs(off));
  }
  double tissues = 0.0;
  for (const PrintedTissue& printed : NistTissues)
  {
    const XRayMaterialData& data = DataOf(printed.material);
    for (std::size_t n = 0; n < std::size(NistEnergies); ++n)
    {
      const double off = 10.0 * Attenuation(NistEnergies[n]).Of(printed.material) / data.density /
          printed.values[n] -
        1.0;
      EXPECT_LE(std::abs(off), 0.001) << data.name << " at " << NistEnergies[n] << " keV";
      tissues = std::max(tissues, std::abs(off));
    }
  }
  Row(
    "mu / rho: I, Fe, W, Pt, Au, 20 to 150 keV against NIST's tables, greatest relative difference",
    0.0, elements, "0.1 %");
  Row("mu / rho: water, bone, lung, fat, 20 to 100 keV against NIST's tables, greatest relative "
      "difference",
    0.0, tissues, "0.1 %");
}

TEST(Attenuation, MixturesAreTheSumOfTheirParts)
{
  for (const XRayMaterial material : AllXRayMaterials)
  {
    double shares = 0.0;
    for (const auto& part : DataOf(material).parts)
    {
      shares += part.share;
    }
    EXPECT_NEAR(shares, 1.0, 1e-9) << DataOf(material).name;
  }
  // From NIST's numbers at 60 keV: 350 mg of iodine in a mL of water, AISI 304 as iron (its neighbours differ by 20 %).
  const Attenuation attenuation(60.0);
  const double medium = 0.1 * (0.2059 + 0.35 * 7.579);
  EXPECT_NEAR(attenuation.Of(XRayMaterial::ContrastMedium), medium, 0.01 * medium);
  EXPECT_NEAR(attenuation.OfContrastMedium(350.0), medium, 0.01 * medium);
  const double iron = 0.1 * 7.93 * 1.205;
  EXPECT_NEAR(attenuation.Of(XRayMaterial::StainlessSteel), iron, 0.05 * iron);
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
}
