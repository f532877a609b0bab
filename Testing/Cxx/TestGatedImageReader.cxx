// vtkGatedImageReader through the pipeline, with files by VTK's own writers, and real data.
#include "FormatTestFiles.h"
#include "ParallelFor.h"

#include "vtkGatedImageReader.h"

#include "vtkCallbackCommand.h"
#include "vtkCommand.h"
#include "vtkExecutive.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkMatrix3x3.h"
#include "vtkMatrix4x4.h"
#include "vtkMetaImageWriter.h"
#include "vtkNIFTIImageWriter.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkShortArray.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkXMLImageDataWriter.h"

#include <gdcmImageReader.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace TestGatedImageReader
{
using namespace formattest;

namespace
{
using Pipeline = vtkStreamingDemandDrivenPipeline;

/// A reader whose errors and warnings are collected instead of printed.
class Reader
{
public:
  Reader()
  {
    this->Observer->SetClientData(this);
    this->Observer->SetCallback(
      [](vtkObject*, unsigned long event, void* self, void* text)
      {
        auto* reader = static_cast<Reader*>(self);
        (event == vtkCommand::ErrorEvent ? reader->Errors : reader->Warnings)
          .emplace_back(static_cast<const char*>(text));
      });
    this->Object->AddObserver(vtkCommand::ErrorEvent, this->Observer);
    this->Object->AddObserver(vtkCommand::WarningEvent, this->Observer);
    // After every failed request VTK's executive adds "returned failure", whatever the algorithm said.
    this->Ignored->SetCallback([](vtkObject*, unsigned long, void*, void*) {});
    this->Object->GetExecutive()->AddObserver(vtkCommand::ErrorEvent, this->Ignored);
  }

  vtkGatedImageReader* operator->() { return this->Object; }

  vtkImageData* At(double time)
  {
    this->Object->UpdateTimeStep(time);
    return this->Object->GetOutput();
  }

  std::vector<double> TimeSteps()
  {
    this->Object->UpdateInformation();
    vtkInformation* info = this->Object->GetOutputInformation(0);
    const double* steps = info->Get(Pipeline::TIME_STEPS());
    return { steps, steps + info->Length(Pipeline::TIME_STEPS()) };
  }

  // The one error of an update that must fail.
  std::string Error()
  {
    this->Errors.clear();
    this->Object->Update();
    EXPECT_EQ(this->Errors.size(), 1u);
    EXPECT_EQ(this->Object->GetOutput()->GetNumberOfPoints(), 0);
    return this->Errors.empty() ? "" : this->Errors.front();
  }

  vtkNew<vtkGatedImageReader> Object;
  vtkNew<vtkCallbackCommand> Observer;
  vtkNew<vtkCallbackCommand> Ignored;
  std::vector<std::string> Errors;
  std::vector<std::string> Warnings;
};

double FieldValue(vtkDataObject* object, const char* name)
{
  return object->GetFieldData()->GetArray(name)->GetTuple1(0);
}

vtkSmartPointer<vtkImageData> ObliqueImage(int phase)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(4, 3, 2);
  image->SetOrigin(10, 20, 30);
  image->SetSpacing(0.5, 0.75, 1.5);
  image->SetDirectionMatrix(0.6, -0.8, 0, 0.8, 0.6, 0, 0, 0, 1);
  image->AllocateScalars(VTK_SHORT, 1);
  for (int k = 0; k < 2; ++k)
  {
    for (int j = 0; j < 3; ++j)
    {
      for (int i = 0; i < 4; ++i)
      {
        *static_cast<short*>(image->GetScalarPointer(i, j, k)) = Value(i, j, k, phase);
      }
    }
  }
  return image;
}

void ExpectOblique(vtkImageData* image, int phase)
{
  ASSERT_EQ(image->GetNumberOfPoints(), 24);
  ASSERT_EQ(image->GetScalarType(), VTK_SHORT);
  EXPECT_STREQ(image->GetPointData()->GetScalars()->GetName(), "HU");
  EXPECT_EQ(image->GetScalarComponentAsDouble(3, 2, 1, 0), Value(3, 2, 1, phase));
  double world[3];
  image->TransformIndexToPhysicalPoint(3, 2, 1, world);
  EXPECT_NEAR(world[0], 10 + 0.6 * 1.5 - 0.8 * 1.5, 1e-6);
  EXPECT_NEAR(world[1], 20 + 0.8 * 1.5 + 0.6 * 1.5, 1e-6);
  EXPECT_NEAR(world[2], 31.5, 1e-6);
}

void WriteVti(const std::string& path, vtkImageData* image)
{
  vtkNew<vtkXMLImageDataWriter> writer;
  writer->SetInputData(image);
  writer->SetFileName(path.c_str());
  ASSERT_EQ(writer->Write(), 1);
}

std::string Data(const std::string& name)
{
  return std::string(DYNAMICCORONARY_DATA_DIR) + "/" + name;
}

bool HaveData(const std::string& name)
{
  return std::filesystem::exists(Data(name));
}
}

TEST(GatedImageReader, TimeIsAnsweredWithTheNearestPhase)
{
  const TemporaryFolder folder;
  Reader reader;
  for (int p = 0; p < 4; ++p)
  {
    const std::string path = folder / ("p" + std::to_string(p) + ".vti");
    WriteVti(path, ObliqueImage(p));
    reader->AddFileName(path.c_str());
    reader->SetPhaseFraction(p, -0.05 + 0.25 * p);
  }
  reader->SetCycleLength(0.8);
  EXPECT_EQ(reader.TimeSteps(), std::vector<double>({ -0.05, 0.2, 0.45, 0.7 }));
  const double* range = reader->GetOutputInformation(0)->Get(Pipeline::TIME_RANGE());
  EXPECT_EQ(range[0], -0.05);
  EXPECT_EQ(range[1], 0.7);
  // Headers alone were read.
  EXPECT_EQ(reader->GetOutput()->GetNumberOfPoints(), 0);
  const std::vector<std::pair<double, int>> requests = { { 0.2, 1 }, { 0.31, 1 }, { 0.33, 2 },
    { -5.0, 0 }, { 9.0, 3 }, { 0.7, 3 } };
  for (const auto& [time, phase] : requests)
  {
    vtkImageData* image = reader.At(time);
    ExpectOblique(image, phase);
    EXPECT_EQ(FieldValue(image, "PhaseTime"), -0.05 + 0.25 * phase);
    EXPECT_EQ(FieldValue(image, "CycleLength"), 0.8);
    EXPECT_EQ(image->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), -0.05 + 0.25 * phase);
  }
  EXPECT_EQ(reader->GetNumberOfPhases(), 4);
  EXPECT_EQ(reader->GetPhaseTime(1), 0.2);
  EXPECT_TRUE(std::isnan(reader->GetPhaseTime(4)));
  EXPECT_EQ(reader->GetPhaseFileName(2), "p2.vti");
  EXPECT_NE(reader->GetSummary().find("Phases: 4"), std::string::npos);
  EXPECT_TRUE(reader.Errors.empty());
}

TEST(GatedImageReader, OneVolumeIsHeld)
{
  const TemporaryFolder folder;
  Reader reader;
  for (int p = 0; p < 2; ++p)
  {
    const std::string path = folder / ("p" + std::to_string(p) + ".vti");
    WriteVti(path, ObliqueImage(p));
    reader->AddFileName(path.c_str());
  }
  vtkSmartPointer<vtkDataArray> first = reader.At(0.0)->GetPointData()->GetScalars();
  // The same phase at another time is not read again.
  EXPECT_EQ(reader.At(0.01)->GetPointData()->GetScalars(), first);
  reader.At(0.5);
  EXPECT_EQ(first->GetReferenceCount(), 1) << "the reader still holds the volume before";
}

TEST(GatedImageReader, FilesOfVtkWriters)
{
  const TemporaryFolder folder;
  vtkNew<vtkImageData> image;
  image->DeepCopy(ObliqueImage(0));
  {
    vtkNew<vtkNIFTIImageWriter> writer;
    // The writer adds the image's origin to the matrix.
    vtkNew<vtkImageData> atOrigin;
    atOrigin->ShallowCopy(image);
    atOrigin->SetOrigin(0, 0, 0);
    writer->SetInputData(atOrigin);
    vtkNew<vtkMatrix4x4> ras;
    // What the same world positions are in RAS.
    const double elements[16] = { -0.6, 0.8, 0, -10, -0.8, -0.6, 0, -20, 0, 0, 1, 30, 0, 0, 0, 1 };
    ras->DeepCopy(elements);
    writer->SetSFormMatrix(ras);
    writer->SetQFormMatrix(ras);
    const std::string path = folder / "a.nii.gz";
    writer->SetFileName(path.c_str());
    writer->Write();
    Reader reader;
    reader->SetFileName(path.c_str());
    reader->Update();
    ExpectOblique(reader->GetOutput(), 0);
  }
  {
    // VTK's writer drops the direction.
    image->SetDirectionMatrix(1, 0, 0, 0, 1, 0, 0, 0, 1);
    vtkNew<vtkMetaImageWriter> writer;
    writer->SetInputData(image);
    const std::string path = folder / "a.mha";
    writer->SetFileName(path.c_str());
    writer->SetCompression(true);
    writer->Write();
    Reader reader;
    reader->SetFileName(path.c_str());
    reader->Update();
    vtkImageData* output = reader->GetOutput();
    ASSERT_EQ(output->GetNumberOfPoints(), 24);
    EXPECT_EQ(output->GetScalarComponentAsDouble(2, 1, 1, 0), Value(2, 1, 1));
    EXPECT_EQ(output->GetOrigin()[1], 20.0);
    EXPECT_EQ(output->GetSpacing()[2], 1.5);
  }
}

TEST(GatedImageReader, SeedsAreTheSecondOutput)
{
  const TemporaryFolder folder;
  WriteVti(folder / "a.vti", ObliqueImage(0));
  WriteText(folder / "series.json",
    R"({"cycle_ms":900,"phases":[{"fraction":0.4,"image":"a.vti"}],
      "seeds":[{"name":"LCA","position":[1,2,3]},{"name":"RCA","position":[4,5,6]}]})");
  Reader reader;
  reader->SetFileName((folder / "series.json").c_str());
  reader->Update();
  auto* seeds = vtkPolyData::SafeDownCast(reader->GetOutputDataObject(1));
  ASSERT_EQ(seeds->GetNumberOfPoints(), 2);
  EXPECT_EQ(seeds->GetNumberOfVerts(), 2);
  EXPECT_EQ(seeds->GetPoint(1)[2], 6.0);
  auto* names = vtkStringArray::SafeDownCast(seeds->GetPointData()->GetAbstractArray("Name"));
  ASSERT_NE(names, nullptr);
  EXPECT_EQ(names->GetValue(1), "RCA");
  EXPECT_DOUBLE_EQ(FieldValue(reader->GetOutput(), "CycleLength"), 0.9);
  reader->SetFileName((folder / "a.vti").c_str());
  reader->Update();
  EXPECT_EQ(seeds->GetNumberOfPoints(), 0);
  EXPECT_EQ(seeds->GetNumberOfVerts(), 0);
}

TEST(GatedImageReader, SubExtentsArePartsOfTheWhole)
{
  const TemporaryFolder folder;
  WriteVti(folder / "a.vti", ObliqueImage(0));
  Reader reader;
  reader->SetFileName((folder / "a.vti").c_str());
  const int extent[6] = { 1, 2, 0, 1, 1, 1 };
  reader->UpdateExtent(extent);
  vtkImageData* image = reader->GetOutput();
  ASSERT_EQ(image->GetNumberOfPoints(), 4);
  EXPECT_EQ(image->GetScalarComponentAsDouble(2, 1, 1, 0), Value(2, 1, 1));
  // Pieces, as the ranks of a parallel run ask for them.
  vtkIdType points = 0;
  for (int piece = 0; piece < 2; ++piece)
  {
    Reader rank;
    rank->SetFileName((folder / "a.vti").c_str());
    rank->UpdatePiece(piece, 2, 0);
    points += rank->GetOutput()->GetNumberOfPoints();
  }
  EXPECT_GE(points, 24);
  EXPECT_LT(points, 48);
}

TEST(GatedImageReader, ValuesBeyondShortGiveFloat)
{
  const TemporaryFolder folder;
  vtkNew<vtkImageData> image;
  image->SetDimensions(2, 2, 2);
  image->AllocateScalars(VTK_UNSIGNED_SHORT, 1);
  image->GetPointData()->GetScalars()->Fill(7);
  WriteVti(folder / "small.vti", image);
  image->GetPointData()->GetScalars()->SetTuple1(7, 65535);
  WriteVti(folder / "large.vti", image);
  Reader reader;
  reader->SetFileName((folder / "small.vti").c_str());
  reader->Update();
  EXPECT_EQ(reader->GetOutput()->GetScalarType(), VTK_SHORT);
  reader->SetFileName((folder / "large.vti").c_str());
  reader->Update();
  EXPECT_EQ(reader->GetOutput()->GetScalarType(), VTK_FLOAT);
  EXPECT_EQ(reader->GetOutput()->GetPointData()->GetScalars()->GetTuple1(7), 65535.0);
}

TEST(GatedImageReader, ChangedFilesAreReadAgain)
{
  const TemporaryFolder folder;
  const std::string path = folder / "a.vti";
  WriteVti(path, ObliqueImage(0));
  Reader reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  ExpectOblique(reader->GetOutput(), 0);
  WriteVti(path, ObliqueImage(1));
  std::filesystem::last_write_time(
    path, std::filesystem::last_write_time(path) + std::chrono::seconds(5));
  reader->Modified();
  reader->Update();
  ExpectOblique(reader->GetOutput(), 1);
}

TEST(GatedImageReader, EveryFailureIsOneError)
{
  const TemporaryFolder folder;
  Reader reader;
  EXPECT_NE(reader.Error().find("No image file is given."), std::string::npos);
  reader->SetFileName((folder / "none.mha").c_str());
  EXPECT_NE(reader.Error().find("none.mha' does not exist."), std::string::npos);
  WriteText(folder / "bad.vti", "<VTKFile type=\"ImageData\" garbage");
  reader->SetFileName((folder / "bad.vti").c_str());
  EXPECT_NE(reader.Error().find("bad.vti"), std::string::npos);
  WriteVti(folder / "cut.vti", ObliqueImage(0));
  Bytes bytes = ReadBytes(folder / "cut.vti");
  bytes.resize(bytes.size() / 2);
  WriteBytes(folder / "cut.vti", bytes);
  reader->SetFileName((folder / "cut.vti").c_str());
  EXPECT_NE(reader.Error().find("cut.vti"), std::string::npos);
  // Damage that shows only when the voxels are read.
  NiftiOptions o;
  o.n = { 40, 40, 40 };
  o.sform = 1;
  bytes = Gzip(Nifti(o));
  bytes.resize(bytes.size() / 2);
  WriteBytes(folder / "cut.nii.gz", bytes);
  reader->SetFileName((folder / "cut.nii.gz").c_str());
  EXPECT_NE(
    reader.Error().find("cut.nii.gz' is truncated: expected 128352 bytes"), std::string::npos);
  reader->SetFileName((folder / "nowhere").c_str());
  EXPECT_NE(reader.Error().find("nowhere' does not exist"), std::string::npos);
  // What File > Open asks.
  EXPECT_EQ(reader->CanReadFile((folder / "cut.nii.gz").c_str()), 1);
  EXPECT_EQ(reader->CanReadFile((folder / "notes.txt").c_str()), 0);
  EXPECT_EQ(reader->CanReadFile((folder / ".").c_str()), 0);
  EXPECT_EQ(reader->CanReadFile(nullptr), 0);
  // And it recovers.
  WriteVti(folder / "a.vti", ObliqueImage(0));
  reader->SetFileName((folder / "a.vti").c_str());
  reader.Errors.clear();
  reader->Update();
  ExpectOblique(reader->GetOutput(), 0);
  EXPECT_TRUE(reader.Errors.empty()) << reader.Errors.front();
  reader->SetPhaseFraction(0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_NE(reader.Error().find("PhaseFractions[0] is not a finite number"), std::string::npos);
}

TEST(GatedImageReader, AbortAndProgress)
{
  const TemporaryFolder folder;
  NiftiOptions o;
  o.n = { 64, 64, 100 };
  o.sform = 1;
  WriteBytes(folder / "a.nii.gz", Gzip(Nifti(o)));
  struct Watch
  {
    int calls = 0;
    double last = 0.0;
    double maximumStep = 0.0;
    bool abort = false;
  } watch;
  vtkNew<vtkCallbackCommand> command;
  command->SetClientData(&watch);
  command->SetCallback(
    [](vtkObject* caller, unsigned long, void* data, void* amount)
    {
      auto* w = static_cast<Watch*>(data);
      const double now = *static_cast<double*>(amount);
      w->maximumStep = std::max(w->maximumStep, now - w->last);
      w->last = now;
      ++w->calls;
      if (w->abort && now > 0.3)
      {
        static_cast<vtkAlgorithm*>(caller)->SetAbortExecute(1);
      }
    });
  Reader reader;
  reader->SetFileName((folder / "a.nii.gz").c_str());
  reader->AddObserver(vtkCommand::ProgressEvent, command);
  reader->Update();
  EXPECT_GE(watch.calls, 50);
  EXPECT_LE(watch.maximumStep, 0.02);
  EXPECT_EQ(reader->GetOutput()->GetNumberOfPoints(), 64 * 64 * 100);
  watch = Watch();
  watch.abort = true;
  reader->Modified();
  reader->Update();
  EXPECT_LT(watch.calls, 45);
  EXPECT_EQ(reader->GetOutput()->GetNumberOfPoints(), 0);
  EXPECT_TRUE(reader.Errors.empty());
  watch.abort = false;
  reader->SetAbortExecute(0);
  reader->Modified();
  reader->Update();
  EXPECT_EQ(reader->GetOutput()->GetNumberOfPoints(), 64 * 64 * 100);
}

TEST(GatedImageReader, BasicObject)
{
  vtkNew<vtkGatedImageReader> reader;
  std::ostringstream text;
  reader->Print(text);
  EXPECT_NE(text.str().find("CycleLength: 1"), std::string::npos);
  EXPECT_EQ(reader->GetFileName(0), nullptr);
  reader->SetFileName("a");
  reader->AddFileName("b");
  reader->AddFileName(nullptr);
  reader->AddFileName("");
  EXPECT_EQ(reader->GetNumberOfFileNames(), 2);
  EXPECT_STREQ(reader->GetFileName(1), "b");
  const vtkMTimeType before = reader->GetMTime();
  reader->SetCycleLength(1.0);
  reader->SetNumberOfPhaseFractions(0);
  EXPECT_EQ(reader->GetMTime(), before);
  EXPECT_EQ(reader->GetNumberOfPhases(), 0);
  EXPECT_TRUE(reader->GetSummary().empty());
}

TEST(RealData, CineSeriesIsOneDatasetOf25PhasesAnd6Positions)
{
  if (!HaveData("biv-cine-dicom"))
  {
    GTEST_SKIP() << "no real data at " << Data("biv-cine-dicom");
  }
  Reader reader;
  EXPECT_EQ(reader->CanReadFile(Data("biv-cine-dicom").c_str()), 1);
  reader->SetFileName(Data("biv-cine-dicom").c_str());
  const std::vector<double> steps = reader.TimeSteps();
  ASSERT_EQ(steps.size(), 25u);
  for (std::size_t p = 0; p < steps.size(); ++p)
  {
    // Trigger time / nominal interval is p/25 at every position.
    EXPECT_NEAR(steps[p], 0.04 * static_cast<double>(p), 1e-5);
  }
  std::vector<short> values[2];
  for (const int threads : { 1, 4 })
  {
    coronary::SetNumberOfThreads(threads);
    reader->Modified();
    vtkImageData* image = reader.At(0.48);
    int dimensions[3];
    image->GetDimensions(dimensions);
    EXPECT_EQ(dimensions[0], 256);
    EXPECT_EQ(dimensions[1], 208);
    EXPECT_EQ(dimensions[2], 6);
    EXPECT_NEAR(image->GetSpacing()[0], 1.40625, 1e-6);
    EXPECT_NEAR(image->GetSpacing()[2], 17.7, 1e-3);
    // The mean of the six nominal intervals.
    EXPECT_NEAR(
      FieldValue(image, "CycleLength"), (860 + 863 + 829 + 776 + 814 + 831) / 6000.0, 1e-9);
    EXPECT_NEAR(image->GetDirectionMatrix()->Determinant(), 1.0, 1e-6);
    // The fifth position of six, as its header has it.
    double world[3];
    image->TransformIndexToPhysicalPoint(0, 0, 4, world);
    EXPECT_NEAR(world[0], -193.726, 1e-2);
    EXPECT_NEAR(world[1], -90.5545, 1e-2);
    EXPECT_NEAR(world[2], -81.5185, 1e-2);
    auto* scalars = vtkShortArray::SafeDownCast(image->GetPointData()->GetScalars());
    ASSERT_NE(scalars, nullptr);
    values[threads == 1 ? 0 : 1].assign(
      scalars->GetPointer(0), scalars->GetPointer(0) + scalars->GetNumberOfValues());
  }
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(values[0], values[1]);
  EXPECT_TRUE(reader.Errors.empty());
}

TEST(RealData, ChestCtAgreesWithGdcm)
{
  if (!HaveData("chest-ct-dicom"))
  {
    GTEST_SKIP() << "no real data at " << Data("chest-ct-dicom");
  }
  Reader reader;
  reader->SetFileName(Data("chest-ct-dicom").c_str());
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  int dimensions[3];
  image->GetDimensions(dimensions);
  EXPECT_EQ(dimensions[0], 512);
  EXPECT_EQ(dimensions[1], 512);
  EXPECT_EQ(dimensions[2], 51);
  EXPECT_EQ(image->GetScalarType(), VTK_SHORT);
  EXPECT_DOUBLE_EQ(image->GetSpacing()[0], 0.78125);
  EXPECT_EQ(image->GetOrigin()[0], -201.0);
  EXPECT_EQ(image->GetOrigin()[1], -59.0);
  EXPECT_NEAR(image->GetOrigin()[2], -670.800049, 1e-9);
  EXPECT_TRUE(image->GetDirectionMatrix()->IsIdentity());
  // The folder is a selection of slices: that is said.
  ASSERT_FALSE(reader.Warnings.empty());
  EXPECT_NE(reader.Warnings.back().find("1 to 17 mm apart"), std::string::npos);

  const std::vector<std::pair<std::string, int>> slices = { { "000082.dcm", 0 },
    { "000063.dcm", 1 }, { "000084.dcm", 49 }, { "000096.dcm", 50 } };
  for (const auto& [name, k] : slices)
  {
    gdcm::ImageReader slice;
    slice.SetFileName(Data("chest-ct-dicom/" + name).c_str());
    ASSERT_TRUE(slice.Read());
    std::vector<std::uint16_t> stored(512 * 512);
    ASSERT_TRUE(slice.GetImage().GetBuffer(reinterpret_cast<char*>(stored.data())));
    for (int v = 0; v < 512 * 512; v += 97)
    {
      ASSERT_EQ(image->GetScalarComponentAsDouble(v % 512, v / 512, k, 0), stored[v] - 1000.0);
    }
  }
}

TEST(RealData, CardiacCt)
{
  if (!HaveData("cardiac-cta-1p5mm"))
  {
    GTEST_SKIP() << "no real data at " << Data("cardiac-cta-1p5mm");
  }
  Reader reader;
  reader->SetFileName(Data("cardiac-cta-1p5mm/cardiac_cta_1p5mm.nii.gz").c_str());
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  int dimensions[3];
  image->GetDimensions(dimensions);
  EXPECT_EQ(dimensions[0], 122);
  EXPECT_EQ(dimensions[1], 102);
  EXPECT_EQ(dimensions[2], 112);
  // Read from the file's affine, with the first two rows negated.
  EXPECT_NEAR(image->GetOrigin()[0], -71.6582, 1e-3);
  EXPECT_NEAR(image->GetOrigin()[1], -255.658, 1e-3);
  EXPECT_NEAR(image->GetOrigin()[2], 576.2, 1e-3);
  EXPECT_NEAR(image->GetDirectionMatrix()->Determinant(), 1.0, 1e-6);
  double range[2];
  image->GetScalarRange(range);
  EXPECT_EQ(range[0], -1064);
  EXPECT_EQ(range[1], 3343);
  EXPECT_TRUE(reader.Errors.empty());
}
}
