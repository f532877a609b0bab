#include "PhantomDisease.h"

#include "CoronaryPhantom.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
std::string Join(const std::vector<std::string>& names)
{
  std::string text;
  for (const std::string& name : names)
  {
    text += (text.empty() ? "" : ", ") + name;
  }
  return text;
}

std::string Short(double value)
{
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  return text.back() == '.' ? text.substr(0, text.size() - 1) : text;
}

PhantomLesion Make(const char* kind, const char* vessel, double position, double length,
  double degree, const std::function<void(PhantomLesion&)>& change = {})
{
  PhantomLesion lesion = UsualLesion(kind);
  lesion.vessel = vessel;
  lesion.position = position;
  lesion.length = length;
  lesion.degree = degree;
  if (change)
  {
    change(lesion);
  }
  return lesion;
}

using L = PhantomLesion;

void Eccentric(L& lesion)
{
  lesion.eccentricity = 0.8;
  lesion.remodelling = 1.15;
  lesion.lipid = 0.45;
}

void Calcium(L& lesion, double arc, double thickness, double length)
{
  lesion.calciumArc = arc;
  lesion.calciumThickness = thickness;
  lesion.calciumLength = length;
}

std::vector<PhantomLesion> Stenosed()
{
  return { Make("plaque", "LAD", 30.0, 12.0, 0.7, Eccentric),
    Make("plaque", "RCA", 45.0, 15.0, 0.5,
      [](L& l)
      {
        Eccentric(l);
        l.angle = 180.0;
        l.twist = 4.0;
      }),
    Make("plaque", "LCx", 20.0, 8.0, 0.9,
      [](L& l)
      {
        l.eccentricity = 0.5;
        l.angle = 90.0;
      }) };
}

std::vector<PhantomLesion> Calcified()
{
  return { Make("calcification", "LAD", 24.0, 14.0, 0.0, [](L& l) { Calcium(l, 110, 1.2, 0); }),
    Make("plaque", "LAD", 50.0, 12.0, 0.5,
      [](L& l)
      {
        Eccentric(l);
        Calcium(l, 80, 0.9, 6.0);
      }),
    Make("calcification", "RCA", 30.0, 20.0, 0.0,
      [](L& l)
      {
        Calcium(l, 200, 1.0, 0);
        l.angle = 120.0;
        l.twist = 5.0;
      }),
    Make("calcification", "RCA", 58.0, 3.0, 0.0, [](L& l) { Calcium(l, 40, 1.0, 0); }),
    Make("plaque", "LCx", 22.0, 10.0, 0.4,
      [](L& l)
      {
        Eccentric(l);
        l.angle = 180.0;
        Calcium(l, 120, 1.1, 0);
      }) };
}

std::vector<PhantomLesion> Mixed()
{
  // Medina 1,1,1 at the first diagonal's origin, and a mixed plaque in the right artery.
  return { Make("plaque", "LAD", 36.0, 16.0, 0.5,
             [](L& l)
             {
               Eccentric(l);
               l.remodelling = 1.25;
               Calcium(l, 70, 0.9, 5.0);
             }),
    Make("plaque", "D1", 4.0, 7.0, 0.5,
      [](L& l)
      {
        l.eccentricity = 0.5;
        l.remodelling = 1.2;
      }),
    Make("plaque", "RCA", 40.0, 20.0, 0.6,
      [](L& l)
      {
        Eccentric(l);
        l.remodelling = 1.2;
        l.twist = 6.0;
        Calcium(l, 90, 1.0, 8.0);
      }) };
}

PhantomLesion NapkinRing()
{
  return Make("plaque", "LAD", 40.0, 14.0, 0.4,
    [](L& l)
    {
      l.eccentricity = 1.0;
      l.remodelling = 1.35;
      l.lipid = 0.8;
      l.lipidValue = 0.0;
      l.rim = 0.25;
      l.rimValue = 130.0;
      l.fibrousValue = 110.0;
    });
}

std::vector<PhantomLesion> Stented()
{
  return { Make("stent", "LAD", 38.0, 18.0, 0.0), Make("stent", "RCA", 40.0, 24.0, 0.5) };
}

std::vector<PhantomLesion> Occluded()
{
  return { Make("occlusion", "RCA", 50.0, 22.0, 0.0,
             [](L& l)
             {
               Calcium(l, 150, 1.0, 8.0);
               l.lipid = 0.3;
             }),
    Make("occlusion", "LCx", 40.0, 12.0, 0.0) };
}

/// The occluded arteries with what fills them: septal channels from the LAD, an epicardial one beside the circumflex.
void AddCollateralised(PhantomSettings& s)
{
  const std::vector<L> lesions = Occluded();
  s.disease.lesions.insert(s.disease.lesions.end(), lesions.begin(), lesions.end());
  // Without a posterior descending branch of the right artery its acute marginal is filled.
  const bool leftDominant = s.dominance == Dominance::Left;
  const std::string behind = leftDominant ? "AM1" : "R-PDA";
  s.disease.collaterals.push_back({ "SC1", "S1", behind, 0.95, 0.4, 0.6, !leftDominant });
  s.disease.collaterals.push_back({ "SC2", "S2", behind, 0.95, 0.7, 0.4, !leftDominant });
  s.disease.collaterals.push_back({ "EC1", "OM1", "OM3", 0.7, 0.6, 0.5, false });
}

using Change = std::function<void(PhantomSettings&)>;

Change Adds(std::vector<PhantomLesion> lesions)
{
  return [lesions = std::move(lesions)](PhantomSettings& s)
  { s.disease.lesions.insert(s.disease.lesions.end(), lesions.begin(), lesions.end()); };
}

Change Begins(CoronaryOrigin origin)
{
  return [origin](PhantomSettings& s) { s.disease.origin = origin; };
}

const std::vector<std::pair<std::string, Change>>& Presets()
{
  static const std::vector<std::pair<std::string, Change>> presets = {
    { "stenosed", Adds(Stenosed()) },
    { "calcified", Adds(Calcified()) },
    { "mixed", Adds(Mixed()) },
    { "napkin-ring", Adds({ NapkinRing() }) },
    { "diffuse",
      Adds({ Make("plaque", "LAD", 65.0, 70.0, 0.4, [](L& l) { l.remodelling = 1.0; }),
        Make("plaque", "RCA", 36.0, 64.0, 0.35, [](L& l) { l.eccentricity = 0.4; }) }) },
    { "occluded", Adds(Occluded()) },
    { "collateral", AddCollateralised },
    { "stented", Adds(Stented()) },
    { "graft",
      [](PhantomSettings& s)
      {
        s.disease.lesions.push_back(Make("occlusion", "LAD", 40.0, 15.0, 0.0));
        s.disease.lesions.push_back(Make("plaque", "RCA", 45.0, 12.0, 0.8, Eccentric));
        s.disease.grafts.push_back({ "LIMA", true, "LAD", 75.0, 2.4 });
        s.disease.grafts.push_back({ "SVG1", false, "RCA", 66.0, 3.6 });
        s.disease.grafts.push_back({ "SVG2", false, "OM1", 25.0, 3.4 });
      } },
    { "anomalous", Begins(CoronaryOrigin::CircumflexFromRight) },
    { "high-right", Begins(CoronaryOrigin::HighRight) },
    { "single-ostium", Begins(CoronaryOrigin::SingleRight) },
    { "bridge", Adds({ Make("bridge", "LAD", 62.0, 25.0, 0.6) }) },
    { "aneurysm",
      Adds({ Make("ectasia", "RCA", 45.0, 20.0, 0.9), Make("ectasia", "LAD", 30.0, 12.0, 0.6) }) },
    { "bright-veins", [](PhantomSettings& s) { s.veinHU = 0.85 * s.lumenHU; } },
    { "leads", [](PhantomSettings& s) { s.disease.leads = true; } },
    { "obese",
      [](PhantomSettings& s)
      {
        s.disease.bodyFat = 45.0;
        s.noise = 60.0;
      } },
  };
  return presets;
}
}

const std::vector<LesionNumber>& AllLesionNumbers()
{
  static const std::vector<LesionNumber> numbers = {
    { "length_mm", &L::length, 0.5, 150.0 },
    { "degree", &L::degree, 0.0, 2.0 },
    { "angle_deg", &L::angle, -360.0, 360.0 },
    { "twist_deg_per_mm", &L::twist, -30.0, 30.0 },
    { "eccentricity", &L::eccentricity, 0.0, 1.0 },
    { "remodelling", &L::remodelling, 0.7, 2.0 },
    { "lipid", &L::lipid, 0.0, 1.0 },
    { "rim_mm", &L::rim, 0.0, 1.0 },
    { "calcium_arc_deg", &L::calciumArc, 0.0, 360.0 },
    { "calcium_mm", &L::calciumThickness, 0.0, 3.0 },
    { "calcium_length_mm", &L::calciumLength, 0.0, 150.0 },
    { "fibrous_hu", &L::fibrousValue, -100.0, 300.0 },
    { "lipid_hu", &L::lipidValue, -100.0, 300.0 },
    { "rim_hu", &L::rimValue, -100.0, 300.0 },
    { "calcium_hu", &L::calciumValue, 130.0, 3000.0 },
    { "fill", &L::fill, 0.0, 1.0 },
    { "strut_mm", &L::strut, 0.04, 0.3 },
    { "metal_hu", &L::metalValue, 1000.0, 60000.0 },
  };
  return numbers;
}

const std::vector<std::string>& PhantomLesionKinds()
{
  static const std::vector<std::string> names = { "stenosis", "plaque", "calcification", "spot",
    "occlusion", "stent", "ectasia", "bridge" };
  return names;
}

std::string PhantomLesionKindName(PhantomLesionKind kind)
{
  return PhantomLesionKinds()[static_cast<std::size_t>(kind)];
}

const std::vector<std::string>& OriginNames()
{
  static const std::vector<std::string> names = { "usual", "high-right", "circumflex-from-right",
    "single-right" };
  return names;
}

PhantomLesion UsualLesion(const std::string& kind)
{
  const auto& kinds = PhantomLesionKinds();
  const auto found = std::find(kinds.begin(), kinds.end(), kind);
  Require(found != kinds.end(), "'" + kind + "' is none of " + Join(kinds));
  PhantomLesion lesion;
  lesion.kind = static_cast<PhantomLesionKind>(found - kinds.begin());
  switch (lesion.kind)
  {
    case PhantomLesionKind::Stenosis:
    case PhantomLesionKind::Plaque:
      lesion.degree = 0.5;
      break;
    case PhantomLesionKind::Calcification:
      lesion.calciumArc = 90.0;
      lesion.calciumThickness = 1.0;
      break;
    case PhantomLesionKind::Spot:
      lesion.calciumThickness = 1.6;
      lesion.length = lesion.calciumThickness;
      break;
    case PhantomLesionKind::Stent:
      lesion.length = 18.0;
      break;
    case PhantomLesionKind::Occlusion:
      lesion.length = 20.0;
      break;
    case PhantomLesionKind::Ectasia:
      lesion.degree = 0.8;
      break;
    case PhantomLesionKind::Bridge:
      lesion.length = 20.0;
      lesion.degree = 0.5;
      break;
  }
  return lesion;
}

void PhantomDisease::Validate() const
{
  for (std::size_t n = 0; n < this->lesions.size(); ++n)
  {
    const PhantomLesion& lesion = this->lesions[n];
    const std::string where = "PhantomSettings: lesions[" + std::to_string(n) + "] (" +
      PhantomLesionKindName(lesion.kind) + ") ";
    for (const LesionNumber& number : AllLesionNumbers())
    {
      const double value = lesion.*number.member;
      const bool narrows = number.member == &L::degree && lesion.kind != PhantomLesionKind::Ectasia;
      const double high = narrows ? 0.99 : number.high;
      Require(Within(value, number.low, high),
        where + number.name + " is " + Short(value) + ", it must lie in [" + Short(number.low) +
          ", " + Short(high) + "]");
    }
    const double last = lesion.relative ? 1.0 : 1000.0;
    Require(Within(lesion.position, 0.0, last),
      where + (lesion.relative ? "fraction" : "position_mm") + " is " + Short(lesion.position) +
        ", it must lie in [0, " + Short(last) + "]");
    Require(!lesion.vessel.empty(), where + "has no vessel");
  }
  for (std::size_t n = 0; n < this->grafts.size(); ++n)
  {
    const PhantomGraft& graft = this->grafts[n];
    const std::string where = "PhantomSettings: grafts[" + std::to_string(n) + "] ";
    Require(!graft.name.empty() && !graft.vessel.empty(), where + "needs a name and a vessel");
    Require(Within(graft.position, 0.0, 1000.0) && Within(graft.diameter, 1.0, 6.0),
      where + "needs a position_mm from 0 to 1000 and a diameter_mm from 1 to 6");
  }
  for (const PhantomCollateral& one : this->collaterals)
  {
    const std::string where = "PhantomSettings: collateral " + one.name + " ";
    Require(!one.name.empty() && !one.from.empty() && !one.to.empty(),
      where + "needs a name and the vessels from and to");
    Require(one.from != one.to, where + "leads from " + one.from + " to itself");
    Require(Within(one.fromFraction, 0.0, 1.0) && Within(one.toFraction, 0.0, 1.0) &&
        Within(one.diameter, 0.2, 1.5),
      where + "needs fractions from 0 to 1 and a diameter_mm from 0.2 to 1.5");
  }
  // The lumen's distances have room for so many vessels.
  Require(this->grafts.size() <= 6, "PhantomSettings: more than 6 grafts");
  Require(Within(this->bodyFat, 0.0, 80.0),
    "PhantomSettings: bodyFat is " + Short(this->bodyFat) + ", it must lie in [0, 80]");
}

const std::vector<std::string>& DiseasePresets()
{
  static const std::vector<std::string> names = []
  {
    std::vector<std::string> all;
    for (const auto& preset : Presets())
    {
      all.push_back(preset.first);
    }
    return all;
  }();
  return names;
}

void AddDisease(const std::string& name, PhantomSettings& settings)
{
  for (const auto& [preset, change] : Presets())
  {
    if (preset == name)
    {
      change(settings);
      return;
    }
  }
  throw std::invalid_argument("'" + name + "' is none of " + Join(DiseasePresets()));
}
}
