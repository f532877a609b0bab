// A user's CT as background: what is read, and what is refused with which message.
#include "BackgroundVolume.h"
#include "FormatTestFiles.h"
#include "MetaImageWriter.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace UnitTestBackgroundVolume
{
using namespace coronary;

namespace
{
constexpr int Side = 20;
constexpr double Spacing = 4.0;

ImageGrid Grid(int slices = Side)
{
  ImageGrid grid;
  grid.extent = { 0, Side - 1, 0, Side - 1, 0, slices - 1 };
  grid.spacing = Vector3::Constant(Spacing);
  grid.origin = Vector3(-30.0, 20.0, 100.0);
  return grid;
}

/// Air around a block of tissue with some bone.
std::vector<short> Chest(int slices = Side)
{
  std::vector<short> values(static_cast<std::size_t>(Side) * Side * slices, -1000);
  for (std::size_t i = 0; i < values.size(); ++i)
  {
    const std::size_t column = i % Side;
    values[i] = column > 5 && column < 15 ? 40 : values[i];
    values[i] = column == 10 ? 900 : values[i];
  }
  return values;
}

template <typename T>
std::string Write(
  const formattest::TemporaryFolder& folder, const ImageGrid& grid, const std::vector<T>& values)
{
  const std::string path = folder / "ct.mha";
  WriteMetaImage(path, grid, values.data(), false);
  return path;
}

void ExpectFailure(const std::string& path, const std::string& part)
{
  const std::string name = std::filesystem::path(path).filename().string();
  ExpectError([&] { ReadBackgroundVolume(path); }, name, part);
}

void WriteSeries(const formattest::TemporaryFolder& folder, const std::string& modality, int slices)
{
  const std::vector<short> values = Chest(slices);
  for (int k = 0; k < slices; ++k)
  {
    formattest::DicomOptions options;
    options.rows = Side;
    options.columns = Side;
    options.slice = k;
    options.modality = modality;
    options.spacing = "4\\4";
    options.position = "0\\0\\" + std::to_string(4 * k);
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(k) * Side * Side;
    options.values.assign(first, first + Side * Side);
    // Stored as scanners do.
    for (short& value : options.values)
    {
      value = static_cast<short>(value + 1024);
    }
    options.intercept = "-1024";
    formattest::WriteDicom(folder / ("s" + std::to_string(k) + ".dcm"), options);
  }
}
}

TEST(BackgroundVolume, readsAMetaImageAndPlacesIt)
{
  const formattest::TemporaryFolder folder;
  const std::vector<short> values = Chest();
  BackgroundOptions placement;
  placement.offset = Vector3(1.0, -2.0, 3.5);
  const HounsfieldVolume volume = ReadBackgroundVolume(Write(folder, Grid(), values), placement);
  EXPECT_EQ(volume.values, values);
  EXPECT_TRUE(volume.grid.origin.isApprox(Vector3(-29.0, 18.0, 103.5)));
  EXPECT_EQ(volume.grid.spacing, Vector3::Constant(Spacing));
  EXPECT_EQ(volume.View().NumberOfVoxels(), Side * Side * Side);
}

TEST(BackgroundVolume, limitsWhatIsBeyondHounsfield)
{
  const formattest::TemporaryFolder folder;
  const std::vector<short> chest = Chest();
  std::vector<float> values(chest.begin(), chest.end());
  values[0] = -3000.0F; // outside the scanner's circle
  values[1] = 5000.0F;  // metal
  values[2] = 12.6F;
  const HounsfieldVolume volume = ReadBackgroundVolume(Write(folder, Grid(), values));
  EXPECT_EQ(volume.values[0], -1024);
  EXPECT_EQ(volume.values[1], 3071);
  EXPECT_EQ(volume.values[2], 13);
}

TEST(BackgroundVolume, readsAFolderOfDicom)
{
  const formattest::TemporaryFolder folder;
  WriteSeries(folder, "CT", 18);
  const HounsfieldVolume volume = ReadBackgroundVolume(folder / "");
  EXPECT_EQ(volume.values, Chest(18));
  EXPECT_NEAR(volume.grid.spacing.z(), 4.0, 1e-9);
}

TEST(BackgroundVolume, refusesAnotherModality)
{
  const formattest::TemporaryFolder folder;
  WriteSeries(folder, "MR", 18);
  ExpectError([&] { ReadBackgroundVolume(folder / ""); }, "its modality is MR");
}

TEST(BackgroundVolume, refusesValuesThatAreNoHounsfieldUnits)
{
  const formattest::TemporaryFolder folder;
  const std::size_t count = static_cast<std::size_t>(Side) * Side * Side;
  std::vector<unsigned char> mask(count, 0);
  mask[5] = 255;
  ExpectFailure(Write(folder, Grid(), mask), "0 to 255, are no Hounsfield units");
  std::vector<short> magnetic(count);
  for (std::size_t i = 0; i < count; ++i)
  {
    magnetic[i] = static_cast<short>(i * 7919 % 4096);
  }
  ExpectFailure(Write(folder, Grid(), magnetic), "air or lung");
  ExpectFailure(Write(folder, Grid(), std::vector<short>(count, -1000)), "soft tissue");
  std::vector<float> broken(count, 40.0F);
  broken[100] = std::numeric_limits<float>::quiet_NaN();
  ExpectFailure(Write(folder, Grid(), broken), "1 of its values are no numbers");
  std::vector<float> large(count, 20000.0F);
  std::fill_n(large.begin(), count / 2, -1000.0F);
  std::fill_n(large.begin(), count / 4, 0.0F);
  ExpectFailure(Write(folder, Grid(), large), "above 4000");
}

TEST(BackgroundVolume, refusesWhatIsNotOneVolumeOfAPatient)
{
  const formattest::TemporaryFolder folder;
  ExpectFailure(folder / "none.mha", "is not there");
  ExpectFailure(folder / "nowhere/ct.nii.gz", "is not there");
  formattest::WriteText(folder / "notes.txt", "a CT");
  ExpectFailure(folder / "notes.txt", "no folder of DICOM");
  formattest::WriteText(folder / "broken.mha", "NDims = 3\nDimSize = 20 20 20\n");
  ExpectFailure(folder / "broken.mha", "broken.mha");
  ExpectFailure(Write(folder, Grid(8), Chest(8)), "8 voxels of 4");
  ImageGrid small = Grid();
  small.spacing.setConstant(1.0);
  ExpectFailure(Write(folder, small, Chest()), "50 mm are the least");
  ImageGrid wide = Grid();
  wide.spacing.setConstant(25.0);
  ExpectFailure(Write(folder, wide, Chest()), "10 mm are the most");
  // A folder without images: the formats' own message.
  std::filesystem::create_directories(folder / "empty");
  ExpectFailure(folder / "empty", "empty");

  formattest::NiftiOptions beating;
  beating.n = { 20, 20, 20 };
  beating.phases = 2;
  beating.pixdim = { 1, 4, 4, 4, 1, 0, 0, 0 };
  formattest::WriteBytes(folder / "beating.nii", formattest::Nifti(beating));
  ExpectFailure(folder / "beating.nii", "2 phases");
}

TEST(BackgroundVolume, doesNotAllocateWhatAHeaderPromises)
{
  const formattest::TemporaryFolder folder;
  formattest::WriteText(folder / "huge.mha",
    "ObjectType = Image\nNDims = 3\nDimSize = 60000 60000 60000\nElementType = MET_SHORT\n"
    "ElementSpacing = 1 1 1\nElementDataFile = LOCAL\n");
  ExpectFailure(folder / "huge.mha", "huge.mha");
}

TEST(BackgroundVolume, readsThePhaseNearestToATime)
{
  const formattest::TemporaryFolder folder;
  std::vector<short> values = Chest();
  const std::vector<short> early = values;
  WriteMetaImage(folder / "early.mha", Grid(), values.data(), false);
  values[0] = -900;
  WriteMetaImage(folder / "late.mha", Grid(), values.data(), false);
  const std::string path = folder / "series.json";
  formattest::WriteText(path,
    R"({"cycle_ms":800,"phases":[{"fraction":0.3,"image":"early.mha"},{"fraction":0.7,"image":"late.mha"}]})");
  BackgroundOptions options;
  options.time = 0.72;
  EXPECT_EQ(ReadBackgroundVolume(path, options).values, values);
  options.time = 0.1;
  EXPECT_EQ(ReadBackgroundVolume(path, options).values, early);
  ExpectFailure(path, "no folder of DICOM files"); // without a time it has to be one volume
}

TEST(BackgroundVolume, refusesPlacementsThatAreNone)
{
  const formattest::TemporaryFolder folder;
  const std::string path = Write(folder, Grid(), Chest());
  BackgroundOptions placement;
  placement.offset.x() = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal([&] { ReadBackgroundVolume(path, placement); }, "offset");
  EXPECT_THROW(ReadBackgroundVolume(path, {}, [](double) { return false; }), Cancelled);
}
}
