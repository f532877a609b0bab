#include "PhantomVesselPlans.h"

#include <algorithm>

namespace coronary
{
namespace
{
Control At(double l, double p, double s, double diameter)
{
  return { Vector3(l, p, s), diameter };
}

/// A control point by azimuth (degrees) and height (mm) on the epicardium of the mean heart.
Control On(double azimuth, double height, double diameter)
{
  static const HeartFrame mean;
  return { mean.ToWorld(HeartFrame::OnEpicardium(azimuth, height)), diameter };
}
VesselPlan PlanCircumflex(Dominance dominance)
{
  const bool rightDominant = dominance == Dominance::Right;
  const bool leftDominant = dominance == Dominance::Left;
  VesselPlan circumflex{ "LCx", 0, "LAD", VesselDepth::Epicardial,
    { At(10.8, -2.1, 0.0, 3.4), At(13.7, -1.0, -2.9, 3.4), At(16.4, 1.1, -7.3, 3.4),
      At(18.4, 3.9, -11.3, 3.3), At(20.9, 6.4, -14.2, 2.8), At(22.3, 10.9, -18.7, 2.8),
      At(23.5, 13.6, -23.6, 2.7), At(23.5, 17.0, -29.0, 1.7), At(20.9, 20.9, -36.5, 1.6),
      At(19.0, 23.5, -44.8, 1.3) },
    ProximalLCx, { { "OM1", DistalLCx } } };
  if (rightDominant)
  {
    circumflex.controls.push_back(At(18.2, 18.6, -51.8, 1.1));
  }
  else
  {
    // The circumflex goes on around the groove, and is larger for it.
    const double larger = leftDominant ? 4.2 / 3.4 : 3.8 / 3.4;
    for (Control& control : circumflex.controls)
    {
      control.diameter = std::max(control.diameter * larger, leftDominant ? 2.6 : 2.3);
    }
    circumflex.controls.push_back(On(-50.0, 1.0, leftDominant ? 2.5 : 2.2));
    circumflex.controls.push_back(On(-68.0, 1.0, leftDominant ? 2.4 : 2.1));
    if (leftDominant)
    {
      for (const Control& control :
        { On(-88.0, 1.0, 2.3), On(-108.0, 2.0, 2.2), On(-124.0, 7.0, 2.1), On(-126.0, 20.0, 2.0),
          On(-120.0, 38.0, 1.7), On(-112.0, 59.0, 1.3), On(-106.0, 69.0, 1.0) })
      {
        circumflex.controls.push_back(control);
      }
      circumflex.changes.emplace_back("L-PLB", LeftPDA);
    }
    else
    {
      for (const Control& control :
        { On(-76.0, 8.0, 2.0), On(-78.0, 20.0, 1.7), On(-77.0, 34.0, 1.4), On(-76.0, 46.0, 1.0) })
      {
        circumflex.controls.push_back(control);
      }
      circumflex.changes.emplace_back("OM3", LeftPLB);
    }
  }
  return circumflex;
}

VesselPlan PlanRight(Dominance dominance)
{
  const bool rightDominant = dominance == Dominance::Right;
  const bool leftDominant = dominance == Dominance::Left;
  VesselPlan right{ "RCA", 1, "", VesselDepth::Epicardial,
    { At(-14.4, -30.9, -14.5, 4.0), At(-18.8, -32.4, -16.3, 4.0), At(-28.8, -36.7, -21.4, 3.9),
      At(-35.0, -40.0, -27.5, 3.8), At(-39.1, -40.3, -35.9, 3.5), At(-43.7, -40.4, -48.6, 3.4),
      At(-45.7, -38.1, -60.3, 3.2), At(-43.3, -33.9, -69.2, 3.2), At(-37.3, -30.5, -74.2, 3.1) },
    ProximalRCA, { { "RV1", MidRCA }, { "AM1", DistalRCA } } };
  if (leftDominant)
  {
    for (Control& control : right.controls)
    {
      control.diameter *= 2.8 / 4.0;
    }
    right.controls.back().diameter = 1.3;
    right.controls[right.controls.size() - 2].diameter = 1.7;
  }
  else
  {
    right.controls.push_back(At(-28.9, -16.9, -74.6, 2.9));
    right.changes.emplace_back("R-PDA", RightPLB);
    if (rightDominant)
    {
      for (const Control& control : { At(-14.8, -5.7, -71.1, 2.3), At(-9.6, 1.8, -67.5, 2.0),
             At(-5.0, 8.0, -67.6, 1.8), At(1.0, 10.0, -73.5, 1.7), At(11.3, 5.8, -80.8, 1.4),
             At(21.1, 1.7, -77.5, 1.1), At(36.0, -1.6, -75.0, 0.9) })
      {
        right.controls.push_back(control);
      }
    }
    else
    {
      right.changes.back().second = InferiorRightBranch;
      right.controls.push_back(At(-17.0, -6.5, -74.0, 1.7));
      right.controls.push_back(At(-8.0, -5.5, -79.5, 1.3));
      right.controls.push_back(At(2.7, -8.1, -84.9, 1.0));
    }
  }
  return right;
}

void PlanLeftTree(const PhantomSettings& settings, std::vector<VesselPlan>& plans)
{
  plans.push_back({ "LAD", 0, "", VesselDepth::Epicardial,
    { At(0.0, 0.0, 0.0, 4.5), At(6.9, -1.2, 0.5, 4.5), At(10.8, -2.1, 0.0, 4.4),
      At(15.0, -5.5, -0.8, 3.7), At(20.4, -10.4, -2.0, 3.6), At(25.6, -15.4, -2.6, 3.5),
      At(30.7, -24.9, -6.3, 2.9), At(36.0, -37.3, -11.0, 2.5), At(39.1, -48.3, -19.0, 2.3),
      At(40.1, -61.8, -31.3, 2.0), At(42.8, -74.2, -53.5, 1.7), At(46.6, -77.5, -75.8, 1.4),
      At(44.9, -71.9, -87.8, 1.3), At(42.2, -64.9, -89.1, 1.1), At(39.2, -58.2, -89.8, 0.9) },
    LeftMain, { { "LCx", ProximalLAD }, { "D1", MidLAD }, { "D3", DistalLAD } } });
  plans.push_back(PlanCircumflex(settings.dominance));
  if (settings.dominance == Dominance::Left)
  {
    plans.push_back({ "L-PLB", 0, "LCx", VesselDepth::Epicardial,
      { On(-68.0, 1.0, 1.9), On(-72.0, 10.0, 1.8), On(-74.0, 22.0, 1.6), On(-75.0, 35.0, 1.3),
        On(-76.0, 46.0, 1.0) },
      LeftPLB, {} });
  }

  plans.push_back({ "D1", 0, "LAD", VesselDepth::Epicardial,
    { At(27.7, -15.4, -4.5, 2.1), At(35.8, -19.8, -9.4, 1.9), At(49.9, -27.7, -24.2, 1.5),
      At(60.4, -33.8, -34.2, 1.2), At(64.8, -39.2, -45.0, 0.9) },
    FirstDiagonal, {} });
  plans.push_back({ "D2", 0, "LAD", VesselDepth::Epicardial,
    { At(35.1, -32.7, -10.2, 1.9), At(41.5, -38.7, -16.3, 1.7), At(53.1, -46.1, -31.3, 1.4),
      At(60.6, -52.2, -42.1, 1.1), At(63.0, -56.1, -53.2, 0.9) },
    SecondDiagonal, {} });
  plans.push_back({ "D3", 0, "LAD", VesselDepth::Epicardial,
    { At(41.2, -47.4, -20.4, 1.7), At(45.3, -52.1, -26.5, 1.6), At(55.2, -59.2, -39.5, 1.3),
      At(60.0, -63.5, -50.5, 0.9) },
    ThirdDiagonal, {} });
  plans.push_back({ "S1", 0, "LAD", VesselDepth::Intramural,
    { At(28.5, -20.5, -4.8, 1.4), At(25.3, -24.6, -13.0, 1.2), At(21.1, -30.2, -22.1, 1.0),
      At(18.5, -35.0, -30.0, 0.9) },
    FirstSeptal, {} });
  plans.push_back({ "S2", 0, "LAD", VesselDepth::Intramural,
    { At(36.3, -40.0, -12.5, 1.1), At(31.5, -42.6, -20.5, 1.0), At(27.5, -46.0, -28.0, 0.9) },
    SecondSeptal, {} });
  plans.push_back({ "S3", 0, "LAD", VesselDepth::Intramural,
    { At(39.6, -54.5, -24.5, 1.1), At(35.0, -55.5, -32.0, 1.0), At(31.5, -58.0, -39.0, 0.9) },
    ThirdSeptal, {} });
  plans.push_back({ "OM1", 0, "LCx", VesselDepth::Epicardial,
    { At(18.4, 3.9, -11.3, 2.1), At(30.3, 5.9, -16.4, 2.0), At(44.1, 0.8, -34.5, 1.5),
      At(53.6, -3.0, -46.4, 1.2), At(57.4, -10.3, -58.3, 0.9) },
    FirstObtuseMarginal, {} });
  plans.push_back({ "OM2", 0, "LCx", VesselDepth::Epicardial,
    { At(22.7, 12.0, -22.3, 2.0), At(28.4, 15.1, -30.0, 1.9), At(35.7, 12.3, -46.6, 1.4),
      At(38.9, 7.9, -57.8, 1.1), At(40.4, 0.7, -68.9, 0.9) },
    SecondObtuseMarginal, {} });
  plans.push_back({ "OM3", 0, "LCx", VesselDepth::Epicardial,
    { At(23.6, 19.8, -35.5, 1.5), At(25.4, 20.5, -41.8, 1.5), At(30.4, 16.2, -55.1, 1.3),
      At(32.0, 11.0, -64.5, 0.9) },
    ThirdObtuseMarginal, {} });
  if (settings.ramus)
  {
    plans.push_back({ "RI", 0, "LAD", VesselDepth::Epicardial,
      { At(10.8, -2.1, 0.0, 2.0), At(17.0, -4.0, -3.5, 1.9), On(34.0, 16.0, 1.8),
        On(26.0, 27.0, 1.6), On(18.0, 40.0, 1.3), On(11.0, 52.0, 1.0) },
      RamusIntermedius, {} });
  }
}

void PlanRightTree(const PhantomSettings& settings, std::vector<VesselPlan>& plans)
{
  plans.push_back(PlanRight(settings.dominance));
  plans.push_back({ "RV1", 1, "RCA", VesselDepth::Epicardial,
    { At(-35.0, -40.0, -27.5, 1.6), On(141.0, 9.0, 1.5), On(134.0, 21.0, 1.3),
      On(127.0, 34.0, 1.0) },
    RightVentricularBranch, {} });
  plans.push_back({ "AM1", 1, "RCA", VesselDepth::Epicardial,
    { At(-45.7, -38.1, -60.3, 1.9), On(183.0, 9.0, 1.8), On(177.0, 23.0, 1.6), On(169.0, 39.0, 1.2),
      On(163.0, 53.0, 0.9) },
    AcuteMarginal, {} });
  if (settings.dominance != Dominance::Left)
  {
    plans.push_back({ "R-PDA", 1, "RCA", VesselDepth::Epicardial,
      { At(-28.9, -16.9, -74.6, 2.2), On(-131.0, 9.0, 2.1), On(-126.0, 22.0, 2.0),
        On(-120.0, 38.0, 1.7), On(-112.0, 59.0, 1.3), On(-106.0, 69.0, 1.0) },
      RightPDA, {} });
  }
  if (settings.dominance == Dominance::Right)
  {
    plans.push_back({ "RI-inferior", 1, "RCA", VesselDepth::Epicardial,
      { At(-13.6, -4.0, -70.8, 1.5), At(-6.5, -4.5, -77.0, 1.5), At(2.7, -8.1, -84.9, 1.4),
        At(14.0, -14.0, -90.5, 0.9) },
      InferiorRightBranch, {} });
  }
}

/// From the right artery's beginning around the back of the aorta: between it and the left atrium.
std::vector<Control> BehindAorta(double diameter)
{
  return { At(-18.8, -32.4, -16.3, diameter), At(-26.0, -23.5, -18.0, diameter),
    At(-27.5, -8.5, -16.5, diameter), At(-19.5, 3.0, -12.0, diameter),
    At(-7.0, 7.5, -7.0, diameter) };
}

/// Moves a vessel's origin to the right artery, and its side vessels to the right tree.
void HangOnRight(const std::string& name, std::vector<VesselPlan>& plans)
{
  std::vector<std::string> moved{ name };
  for (VesselPlan& plan : plans)
  {
    if (plan.name == name)
    {
      plan.parent = "RCA";
      plan.tree = 1;
    }
    else if (std::find(moved.begin(), moved.end(), plan.parent) != moved.end())
    {
      // Parents come before their side vessels.
      plan.tree = 1;
      moved.push_back(plan.name);
    }
  }
}

void PlanOrigins(CoronaryOrigin origin, std::vector<VesselPlan>& plans)
{
  const auto planOf = [&](const char* name) -> VesselPlan&
  {
    return *std::find_if(
      plans.begin(), plans.end(), [=](const VesselPlan& plan) { return plan.name == name; });
  };
  VesselPlan& left = planOf("LAD");
  VesselPlan& circumflex = planOf("LCx");
  if (origin == CoronaryOrigin::CircumflexFromRight)
  {
    HangOnRight("LCx", plans);
    std::vector<Control> course = BehindAorta(3.0);
    course.push_back(At(5.0, 9.5, -8.0, 3.0));
    course.push_back(At(14.0, 9.0, -12.0, 3.0));
    // On in the groove.
    course.insert(course.end(), circumflex.controls.begin() + 4, circumflex.controls.end());
    circumflex.controls = course;
    // Without a fork there is no left main.
    left.segment = ProximalLAD;
    left.changes.erase(left.changes.begin());
  }
  else if (origin == CoronaryOrigin::SingleRight)
  {
    HangOnRight("LAD", plans);
    std::vector<Control> course = BehindAorta(3.4);
    course.push_back(At(3.0, 6.5, -2.0, 3.4));
    course.push_back(At(8.5, 1.5, 0.0, 3.4));
    course.insert(course.end(), left.controls.begin() + 2, left.controls.end());
    left.controls = course;
  }
}
}

std::vector<VesselPlan> PlanVessels(const PhantomSettings& settings)
{
  std::vector<VesselPlan> plans;
  PlanLeftTree(settings, plans);
  PlanRightTree(settings, plans);
  PlanOrigins(settings.disease.origin, plans);
  return plans;
}
}
