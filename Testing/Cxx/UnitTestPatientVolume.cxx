// A patient's CT is made fit to be X-rayed: the table goes, and the contrast medium of the CT; all else stays.
#include "PatientVolume.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace UnitTestPatientVolume
{
using namespace coronary;

namespace
{
constexpr int Side = 130;
constexpr double Spacing = 1.5;
constexpr std::int16_t Outside = -1000;
constexpr std::int16_t Lung = -850;
constexpr std::int16_t Muscle = 45;
constexpr std::int16_t Enhanced = 400;
constexpr std::int16_t Board = -250;
constexpr std::int16_t Cable = 1200;

double Ball(const Vector3& p, const Vector3& centre, double radius)
{
  return (p - centre).norm() - radius;
}

/// A volume of what a function of the place says, mm from its middle.
HounsfieldVolume Paint(const std::function<std::int16_t(const Vector3&)>& value)
{
  HounsfieldVolume volume;
  volume.grid.extent = { 0, Side - 1, 0, Side - 1, 0, Side - 1 };
  volume.grid.spacing = Vector3::Constant(Spacing);
  volume.grid.origin = Vector3::Constant(-0.5 * Spacing * (Side - 1));
  for (int k = 0; k < Side; ++k)
  {
    for (int j = 0; j < Side; ++j)
    {
      for (int i = 0; i < Side; ++i)
      {
        volume.values.push_back(value(volume.grid.IndexToWorld(i, j, k)));
      }
    }
  }
  return volume;
}

std::int16_t At(const HounsfieldVolume& volume, const Vector3& p)
{
  const auto index = [&](int axis)
  { return std::lround((p[axis] - volume.grid.origin[axis]) / Spacing); };
  return volume.values[static_cast<std::size_t>((index(2) * Side + index(1)) * Side + index(0))];
}

/// To the axis' ellipse of the chest, 1 on its skin.
double Chest(const Vector3& p)
{
  return std::hypot(p.x() / 80.0, p.y() / 50.0);
}

/// A chest with a lung and a vessel in it; it lies on a board of carbon fibre with foam below, and a cable is before it.
std::int16_t ChestOnTable(const Vector3& p)
{
  if (Chest(p) < 1.0)
  {
    const bool lung = std::hypot(p.x() + 35.0, p.y()) < 30.0;
    const bool vessel = std::hypot(p.x() + 35.0, p.z()) < 2.5 && std::abs(p.y()) < 20.0;
    return lung && !vessel ? Lung : Muscle;
  }
  const bool board = p.y() > 49.0 && p.y() < 52.0;
  const bool foam = p.y() > 52.0 && p.y() < 70.0;
  const bool cable = std::hypot(p.x(), p.y() + 75.0) < 4.0;
  return board ? Board : foam ? -960 : cable ? Cable : Outside;
}

// A heart: ventricle and aorta, 3 mm from them an atrium, as far from it the descending aorta, and from that a vertebra of young bone.
const Vector3 Ventricle(0.0, 0.0, -30.0);
const Vector3 Root(0.0, 0.0, 22.0);
const Vector3 Ostium(12.0, 0.0, 22.0);
const Vector3 Atrium(0.0, 34.0, 0.0);
const Vector3 Descending(0.0, 66.0, 0.0); // of its axis
const Vector3 Vertebra(32.0, 66.0, 0.0);
const Vector3 Artery(40.0, -20.0, 0.0); // a lumen of 1.6 mm, along z
const Vector3 Twig(-50.0, 0.0, 0.0);    // of the lung, 2 mm, along z

std::int16_t Heart(const Vector3& p)
{
  if (Ball(p, Vertebra, 18.0) < 0.0)
  {
    return Ball(p, Vertebra, 15.0) < 0.0 ? 260 : 700;
  }
  if (std::hypot(p.x() - Artery.x(), p.y() - Artery.y()) < 1.6)
  {
    return p.z() > 20.0 && p.z() < 24.0 ? 900 : Enhanced;
  }
  const double flat = std::hypot(p.x(), p.y());
  const bool blood = Ball(p, Ventricle, 25.0) < 0.0 || (flat < 13.0 && p.z() > -2.0) ||
    Ball(p, Atrium, 18.0) < 0.0 || std::hypot(p.x(), p.y() - Descending.y()) < 11.0 ||
    std::hypot(p.x() - Twig.x(), p.y() - Twig.y()) < 2.0;
  return blood ? Enhanced : Muscle;
}

EnhancedBlood Levels()
{
  EnhancedBlood blood;
  blood.tissue = Muscle;
  blood.blood = Enhanced;
  blood.ostia = { Ostium };
  return blood;
}

std::vector<unsigned char> ArteryMask(const HounsfieldVolume& volume)
{
  const HounsfieldVolume artery = Paint([](const Vector3& p) -> std::int16_t
    { return std::hypot(p.x() - Artery.x(), p.y() - Artery.y()) < 1.6 ? 1 : 0; });
  EXPECT_EQ(artery.values.size(), volume.values.size());
  return std::vector<unsigned char>(artery.values.begin(), artery.values.end());
}
}

TEST(PatientVolume, TheTableGoesAndThePatientStays)
{
  HounsfieldVolume volume = Paint(ChestOnTable);
  const HounsfieldVolume before = volume;
  const std::int64_t gone = RemoveSurroundings(volume);
  std::int64_t changed = 0;
  std::int64_t touching = 0;
  std::int64_t board = 0;
  std::size_t n = 0;
  for (int k = 0; k < Side; ++k)
  {
    for (int j = 0; j < Side; ++j)
    {
      for (int i = 0; i < Side; ++i, ++n)
      {
        const std::int16_t was = before.values[n];
        changed += volume.values[n] != was ? 1 : 0;
        board += was == Board ? 1 : 0;
        if (was == Muscle || was == Lung)
        {
          ASSERT_EQ(volume.values[n], was) << "of the patient";
        }
        else if (was == Cable)
        {
          ASSERT_EQ(volume.values[n], Outside);
        }
        else if (was == Board && volume.values[n] == Board)
        {
          ++touching;
          // 2 mm, a block, and the corners of both.
          ASSERT_LT(Chest(volume.grid.IndexToWorld(i, j, k)), 1.1);
        }
      }
    }
  }
  EXPECT_EQ(gone, changed);
  EXPECT_GT(board, 20000);
  EXPECT_LT(touching, board / 3);
  EXPECT_LT(RemoveSurroundings(volume), board / 100) << "a second time";
}

TEST(PatientVolume, AVesselInALungThatTouchesNothingStays)
{
  HounsfieldVolume volume = Paint(
    [](const Vector3& p) -> std::int16_t
    {
      return Ball(p, { 60.0, 0.0, 0.0 }, 30.0) < 0.0 || Ball(p, { -40.0, 0.0, 0.0 }, 6.0) < 0.0
        ? Muscle
        : Lung;
    });
  EXPECT_EQ(RemoveSurroundings(volume), 0);
  EXPECT_EQ(At(volume, { -40.0, 0.0, 0.0 }), Muscle);
}

TEST(PatientVolume, BloodLosesItsContrastMediumAndBoneKeepsItsCalcium)
{
  HounsfieldVolume volume = Paint(Heart);
  const HounsfieldVolume before = volume;
  const std::int64_t changed = RemoveContrastMedium(volume, Levels(), ArteryMask(volume));
  for (const Vector3& place : { Ventricle, Root, Atrium, Descending, Artery })
  {
    EXPECT_EQ(At(before, place), Enhanced) << place.transpose();
    EXPECT_EQ(At(volume, place), Muscle) << place.transpose();
  }
  EXPECT_EQ(At(volume, Artery + Vector3(0.0, 0.0, 22.0)), 900) << "calcium of the artery";
  EXPECT_EQ(At(volume, Twig), Enhanced) << "thin vessels outside of the mask stay";
  std::int64_t differ = 0;
  std::int64_t bone = 0;
  std::int64_t left = 0;
  for (std::size_t n = 0; n < volume.values.size(); ++n)
  {
    differ += volume.values[n] != before.values[n] ? 1 : 0;
    bone += (before.values[n] == 260 || before.values[n] == 700) && volume.values[n] == Muscle;
    left += volume.values[n] == Enhanced ? 1 : 0;
  }
  EXPECT_EQ(differ, changed);
  EXPECT_EQ(bone, 0);
  // The lung's twig is 2.4 mL of it; edges of blocks are a little.
  EXPECT_LT(static_cast<double>(left) * std::pow(Spacing, 3), 3000.0);
}

TEST(PatientVolume, BloodWithoutAnOstiumNearItStays)
{
  HounsfieldVolume volume = Paint(Heart);
  EnhancedBlood blood = Levels();
  blood.ostia = { Vector3(-80.0, -80.0, 80.0) };
  EXPECT_EQ(RemoveContrastMedium(volume, blood, {}), 0);
}

TEST(PatientVolume, RefusesWhatIsNoBloodAndMasksOfOtherImages)
{
  HounsfieldVolume volume = Paint([](const Vector3&) { return Muscle; });
  EnhancedBlood blood = Levels();
  ExpectRefusal([&] { RemoveContrastMedium(volume, blood, { 1, 0 }); }, "another size");
  blood.blood = blood.tissue;
  ExpectRefusal([&] { RemoveContrastMedium(volume, blood, {}); }, "brighter");
  blood.blood = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal([&] { RemoveContrastMedium(volume, blood, {}); }, "brighter");
  blood = Levels();
  blood.ostia.clear();
  ExpectRefusal([&] { RemoveContrastMedium(volume, blood, {}); }, "ostium");
  EXPECT_THROW(RemoveSurroundings(volume, [](double) { return false; }), Cancelled);
}
}
