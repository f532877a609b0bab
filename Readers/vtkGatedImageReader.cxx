#include "vtkGatedImageReader.h"

#include "GatedSeries.h"
#include "LargePages.h"
#include "TextWords.h"
#include "VolumeFile.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"

#include "vtkCallbackCommand.h"
#include "vtkCellArray.h"
#include "vtkCommand.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkExecutive.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkShortArray.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkXMLImageDataReader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <limits>
#include <new>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace
{
namespace fs = std::filesystem;

// The direction matrix as VTK's information keys have it: row by row.
std::array<double, 9> RowMajor(const coronary::Matrix3& direction)
{
  std::array<double, 9> values{};
  for (int row = 0; row < 3; ++row)
  {
    for (int column = 0; column < 3; ++column)
    {
      values[static_cast<std::size_t>(3 * row + column)] = direction(row, column);
    }
  }
  return values;
}

/// A VTK XML image as a source of voxels: VTK reads that format best.
class VtiSource : public coronary::VolumeSource
{
public:
  explicit VtiSource(const std::string& path)
  {
    this->Header.path = path;
    this->Header.format = "VTK XML image";
    this->Header.phaseNames = { fs::path(path).filename().string() };
    this->Observer->SetCallback(
      [](vtkObject*, unsigned long, void* clientData, void* text)
      {
        auto* message = static_cast<std::string*>(clientData);
        *message = text ? static_cast<const char*>(text) : "";
      });
    this->Observer->SetClientData(&this->Message);
    const vtkSmartPointer<vtkXMLImageDataReader> reader = this->NewReader();
    if (!reader->CanReadFile(path.c_str()))
    {
      throw std::runtime_error("'" + path + "' is not a VTK XML image file.");
    }
    reader->UpdateInformation();
    this->Check();
    this->SetHeader(*reader->GetOutputInformation(0));
  }

protected:
  void ReadPlane(int /*phase*/, int k, Plane& plane, const coronary::Poll& poll) override
  {
    poll();
    if (!this->Image)
    {
      const vtkSmartPointer<vtkXMLImageDataReader> reader = this->NewReader();
      reader->Update();
      this->Check();
      this->Image = reader->GetOutput();
    }
    vtkDataArray* scalars = this->Image->GetPointData()->GetScalars();
    const std::array<int, 6>& extent = this->Header.grid.extent;
    const std::size_t size = static_cast<std::size_t>(extent[1] + 1) *
      static_cast<std::size_t>(extent[3] + 1) * coronary::VoxelBytes(this->Type);
    if (!scalars || scalars->GetDataType() != this->VtkType ||
      static_cast<std::size_t>(scalars->GetNumberOfValues()) * coronary::VoxelBytes(this->Type) !=
        size * static_cast<std::size_t>(extent[5] + 1))
    {
      throw std::runtime_error(
        "'" + this->Header.path + "' is truncated: its voxels are not all there.");
    }
    plane.type = this->Type;
    plane.bytes.resize(size);
    std::memcpy(plane.bytes.data(),
      static_cast<const unsigned char*>(scalars->GetVoidPointer(0)) +
        size * static_cast<std::size_t>(k),
      size);
  }

  void EndOfVolume() override { this->Image = nullptr; }

private:
  vtkSmartPointer<vtkXMLImageDataReader> NewReader()
  {
    auto reader = vtkSmartPointer<vtkXMLImageDataReader>::New();
    reader->AddObserver("ErrorEvent", this->Observer);
    reader->AddObserver("WarningEvent", this->Observer);
    reader->GetExecutive()->AddObserver("ErrorEvent", this->Observer);
    reader->SetReaderErrorObserver(this->Observer);
    reader->SetParserErrorObserver(this->Observer);
    reader->SetFileName(this->Header.path.c_str());
    return reader;
  }

  // VTK reports by events; here a failure is an exception.
  void Check()
  {
    if (!this->Message.empty())
    {
      throw std::runtime_error("'" + this->Header.path + "' is truncated or damaged.");
    }
  }

  void SetHeader(vtkInformation& info)
  {
    const std::string& path = this->Header.path;
    vtkInformation* scalars = vtkDataObject::GetActiveFieldInformation(
      &info, vtkDataObject::FIELD_ASSOCIATION_POINTS, vtkDataSetAttributes::SCALARS);
    if (!scalars)
    {
      throw std::runtime_error("'" + path + "' has no point scalars.");
    }
    const int components = scalars->Get(vtkDataObject::FIELD_NUMBER_OF_COMPONENTS());
    if (components != 1)
    {
      throw std::runtime_error(
        "'" + path + "': image has " + std::to_string(components) + " components; one is needed.");
    }
    this->VtkType = scalars->Get(vtkDataObject::FIELD_ARRAY_TYPE());
    this->SetType();

    coronary::ImageGrid& grid = this->Header.grid;
    std::array<int, 6> extent{};
    info.Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent.data());
    double voxels = 1.0;
    for (int axis = 0; axis < 3; ++axis)
    {
      const double count = double(extent[2 * axis + 1]) - double(extent[2 * axis]) + 1.0;
      if (!(count >= 1.0))
      {
        throw std::runtime_error("'" + path + "' has no voxels.");
      }
      voxels *= count;
    }
    // Compressors of constant images reach some thousands.
    std::error_code error;
    const auto fileSize = static_cast<double>(fs::file_size(path, error));
    if (error ||
      voxels * static_cast<double>(coronary::VoxelBytes(this->Type)) > 10000.0 * fileSize)
    {
      throw std::runtime_error(
        "'" + path + "' is truncated: its header promises more voxels than the file can hold.");
    }
    coronary::Vector3 origin = coronary::Vector3::Zero();
    info.Get(vtkDataObject::ORIGIN(), origin.data());
    info.Get(vtkDataObject::SPACING(), grid.spacing.data());
    if (info.Has(vtkDataObject::DIRECTION()))
    {
      std::array<double, 9> direction{};
      info.Get(vtkDataObject::DIRECTION(), direction.data());
      grid.direction =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(direction.data());
    }
    if (!origin.allFinite() || !grid.spacing.allFinite() || !(grid.spacing.minCoeff() > 0.0))
    {
      throw std::runtime_error(
        "'" + path + "': origin and spacing must be finite, and the spacing positive.");
    }
    grid.direction = coronary::Orthonormalised(grid.direction, path);
    grid.origin = origin;
    grid.origin = grid.IndexToWorld(extent[0], extent[2], extent[4]);
    grid.extent = { 0, extent[1] - extent[0], 0, extent[3] - extent[2], 0, extent[5] - extent[4] };
    this->Header.fitsShort = coronary::VoxelBytes(this->Type) <= 2;
  }

  void SetType()
  {
    switch (this->VtkType)
    {
      vtkTemplateMacro(this->Type = coronary::VoxelTypeOf<VTK_TT>());
      default:
        throw std::runtime_error("'" + this->Header.path + "': its scalars are no numbers.");
    }
  }

  vtkNew<vtkCallbackCommand> Observer;
  std::string Message;
  vtkSmartPointer<vtkImageData> Image;
  coronary::VoxelType Type = coronary::VoxelType::Int16;
  int VtkType = VTK_SHORT;
};

std::unique_ptr<coronary::VolumeSource> OpenVti(const std::string& path)
{
  return coronary::LowerCase(fs::path(path).extension().string()) == ".vti"
    ? std::make_unique<VtiSource>(path)
    : nullptr;
}

// The mark of DICOM files, behind 128 bytes that are free.
bool HasDicomMark(const fs::path& path)
{
  std::ifstream file(path, std::ios::binary);
  std::array<char, 132> start{};
  return file.read(start.data(), start.size()) && std::memcmp(start.data() + 128, "DICM", 4) == 0;
}

// What changes when a file does: names, sizes and times of all files that the paths stand for.
std::string StampOf(const std::vector<std::string>& paths)
{
  std::string stamp;
  const auto add = [&stamp](const fs::path& path)
  {
    std::error_code error;
    const auto size = fs::file_size(path, error);
    const auto time = fs::last_write_time(path, error);
    stamp += path.string() + '|' + std::to_string(size) + '|' +
      std::to_string(time.time_since_epoch().count()) + '\n';
  };
  for (const std::string& path : paths)
  {
    std::error_code error;
    if (!fs::is_directory(path, error))
    {
      add(path);
      continue;
    }
    std::vector<fs::path> entries;
    fs::recursive_directory_iterator entry(
      path, fs::directory_options::skip_permission_denied, error);
    for (const fs::recursive_directory_iterator end; !error && entry != end; entry.increment(error))
    {
      entries.push_back(entry->path());
    }
    std::sort(entries.begin(), entries.end());
    for (const fs::path& file : entries)
    {
      add(file);
    }
  }
  return stamp;
}

// The files behind the paths, where a description stands for its images.
std::vector<std::string> FilesBehind(const std::vector<std::string>& paths)
{
  std::vector<std::string> files = paths;
  if (paths.size() == 1 && fs::path(paths.front()).extension() == ".json")
  {
    try
    {
      for (const auto& phase : coronary::ReadSeriesDescription(paths.front()).phases)
      {
        files.push_back(coronary::ResolveSeriesPath(paths.front(), phase.image));
      }
    }
    catch (const std::exception&)
    {
      // Opening the series gives the message.
      return files;
    }
  }
  return files;
}
}

struct vtkGatedImageReader::Internals
{
  std::vector<std::string> FileNames;
  std::vector<double> Fractions;

  std::unique_ptr<coronary::GatedSeries> Series;
  std::string Stamp;           ///< of the files of Series
  vtkMTimeType SeriesTime = 0; ///< of the properties of Series

  // The voxels of the last output, shared with it: asking again for them costs no reading.
  vtkSmartPointer<vtkDataArray> Values;
  int ValuesPhase = -1;
  std::array<int, 6> ValuesExtent{};

  void Forget()
  {
    this->Values = nullptr;
    this->ValuesPhase = -1;
  }
};

vtkStandardNewMacro(vtkGatedImageReader);

vtkGatedImageReader::vtkGatedImageReader()
  : State(std::make_unique<Internals>())
{
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(2);
}

vtkGatedImageReader::~vtkGatedImageReader()
{
  delete[] this->SeriesInstanceUID;
}

void vtkGatedImageReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileNames: " << this->State->FileNames.size() << "\n";
  for (const std::string& name : this->State->FileNames)
  {
    os << indent.GetNextIndent() << name << "\n";
  }
  os << indent
     << "SeriesInstanceUID: " << (this->SeriesInstanceUID ? this->SeriesInstanceUID : "(none)")
     << "\n"
     << indent << "CycleLength: " << this->CycleLength << "\n"
     << indent << "PhaseFractions: " << this->State->Fractions.size() << "\n"
     << indent << "Number Of Phases: " << this->GetNumberOfPhases() << "\n";
}

int vtkGatedImageReader::CanReadFile(const char* name)
{
  if (name == nullptr)
  {
    return 0;
  }
  std::error_code error;
  if (!fs::is_directory(name, error))
  {
    return coronary::IsVolumeFileName(name) || fs::path(name).extension() == ".json" ? 1 : 0;
  }
  // Of a large archive not all files are opened.
  constexpr int TriedFiles = 64;
  int tried = 0;
  for (fs::recursive_directory_iterator file(name, error), end; file != end && tried < TriedFiles;
       file.increment(error))
  {
    if (file->is_regular_file(error))
    {
      ++tried;
      if (HasDicomMark(file->path()))
      {
        return 1;
      }
    }
  }
  return 0;
}

void vtkGatedImageReader::AddFileName(const char* name)
{
  if (name && name[0] != '\0')
  {
    this->State->FileNames.emplace_back(name);
    this->Modified();
  }
}

void vtkGatedImageReader::RemoveAllFileNames()
{
  if (!this->State->FileNames.empty())
  {
    this->State->FileNames.clear();
    this->Modified();
  }
}

int vtkGatedImageReader::GetNumberOfFileNames()
{
  return static_cast<int>(this->State->FileNames.size());
}

const char* vtkGatedImageReader::GetFileName(int index)
{
  return index >= 0 && index < this->GetNumberOfFileNames()
    ? this->State->FileNames[static_cast<std::size_t>(index)].c_str()
    : nullptr;
}

void vtkGatedImageReader::SetFileName(const char* name)
{
  const std::vector<std::string>& names = this->State->FileNames;
  if (name && names.size() == 1 && names.front() == name)
  {
    return;
  }
  this->RemoveAllFileNames();
  this->AddFileName(name);
}

void vtkGatedImageReader::SetNumberOfPhaseFractions(int number)
{
  const auto size = static_cast<std::size_t>(std::max(0, number));
  if (size != this->State->Fractions.size())
  {
    this->State->Fractions.resize(size, std::numeric_limits<double>::quiet_NaN());
    this->Modified();
  }
}

int vtkGatedImageReader::GetNumberOfPhaseFractions()
{
  return static_cast<int>(this->State->Fractions.size());
}

void vtkGatedImageReader::SetPhaseFraction(int index, double fraction)
{
  if (index < 0)
  {
    return;
  }
  if (index >= this->GetNumberOfPhaseFractions())
  {
    this->SetNumberOfPhaseFractions(index + 1);
  }
  double& value = this->State->Fractions[static_cast<std::size_t>(index)];
  if (value != fraction)
  {
    value = fraction;
    this->Modified();
  }
}

double vtkGatedImageReader::GetPhaseFraction(int index)
{
  return index >= 0 && index < this->GetNumberOfPhaseFractions()
    ? this->State->Fractions[static_cast<std::size_t>(index)]
    : 0.0;
}

void vtkGatedImageReader::RemoveAllPhaseFractions()
{
  this->SetNumberOfPhaseFractions(0);
}

int vtkGatedImageReader::GetNumberOfPhases()
{
  return this->State->Series ? this->State->Series->NumberOfPhases() : 0;
}

double vtkGatedImageReader::GetPhaseTime(int phase)
{
  return phase >= 0 && phase < this->GetNumberOfPhases() ? this->State->Series->Fraction(phase)
                                                         : std::numeric_limits<double>::quiet_NaN();
}

double vtkGatedImageReader::GetUsedCycleLength()
{
  return this->State->Series ? this->State->Series->CycleSeconds() : 0.0;
}

std::string vtkGatedImageReader::GetPhaseFileName(int phase)
{
  return phase >= 0 && phase < this->GetNumberOfPhases() ? this->State->Series->Name(phase)
                                                         : std::string();
}

std::string vtkGatedImageReader::GetSummary()
{
  return this->State->Series ? this->State->Series->Summary() : std::string();
}

int vtkGatedImageReader::FillOutputPortInformation(int port, vtkInformation* info)
{
  if (port == 1)
  {
    info->Set(vtkDataObject::DATA_TYPE_NAME(), "vtkPolyData");
    return 1;
  }
  return this->Superclass::FillOutputPortInformation(port, info);
}

int vtkGatedImageReader::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputVector)
{
  Internals& state = *this->State;
  const std::vector<std::string>& paths = state.FileNames;
  try
  {
    const std::string stamp = StampOf(FilesBehind(paths));
    if (!state.Series || state.SeriesTime != this->GetMTime() || state.Stamp != stamp)
    {
      state.Series.reset();
      state.Forget();
      coronary::GatedSeriesOptions options;
      options.fractions = state.Fractions;
      options.cycleSeconds = this->CycleLength;
      options.seriesInstanceUid = this->SeriesInstanceUID ? this->SeriesInstanceUID : "";
      options.openOther = OpenVti;
      const coronary::Poll poll = [this]
      {
        // Not CheckAbort: outside RequestData that still sees an abort of the update before.
        if (this->GetAbortExecute() != 0)
        {
          throw coronary::Cancelled();
        }
      };
      state.Series = std::make_unique<coronary::GatedSeries>(paths, options, poll);
      state.Stamp = stamp;
      state.SeriesTime = this->GetMTime();
      for (const std::string& warning : state.Series->Warnings())
      {
        vtkWarningMacro(<< warning);
      }
    }
  }
  catch (const coronary::Cancelled&)
  {
    return 0;
  }
  catch (const std::exception& error)
  {
    // What the outputs hold is of other files.
    for (int port = 0; port < 2; ++port)
    {
      if (vtkDataObject* output = vtkDataObject::GetData(outputVector, port))
      {
        output->Initialize();
      }
    }
    // ParaView asks for data even now, and the executive would complain of a missing extent.
    const std::array<int, 6> empty{ 0, -1, 0, -1, 0, -1 };
    outputVector->GetInformationObject(0)->Set(
      vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), empty.data(), 6);
    return vtkCoronary::ReportEmptied(this, error.what());
  }

  const coronary::GatedSeries& series = *state.Series;
  const coronary::ImageGrid& grid = series.Grid();
  vtkInformation* image = outputVector->GetInformationObject(0);
  image->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), grid.extent.data(), 6);
  image->Set(vtkDataObject::ORIGIN(), grid.origin.data(), 3);
  image->Set(vtkDataObject::SPACING(), grid.spacing.data(), 3);
  image->Set(vtkDataObject::DIRECTION(), RowMajor(grid.direction).data(), 9);
  image->Set(vtkAlgorithm::CAN_PRODUCE_SUB_EXTENT(), 1);
  vtkDataObject::SetPointDataActiveScalarInfo(image, series.FitsShort() ? VTK_SHORT : VTK_FLOAT, 1);
  outputVector->GetInformationObject(1)->Set(vtkAlgorithm::CAN_HANDLE_PIECE_REQUEST(), 1);

  std::vector<double> times;
  for (int phase = 0; phase < series.NumberOfPhases(); ++phase)
  {
    times.push_back(series.Fraction(phase));
  }
  const std::array<double, 2> range{ times.front(), times.back() };
  for (int port = 0; port < 2; ++port)
  {
    vtkInformation* info = outputVector->GetInformationObject(port);
    info->Set(
      vtkStreamingDemandDrivenPipeline::TIME_STEPS(), times.data(), static_cast<int>(times.size()));
    info->Set(vtkStreamingDemandDrivenPipeline::TIME_RANGE(), range.data(), 2);
  }
  return 1;
}

int vtkGatedImageReader::RequestData(
  vtkInformation* request, vtkInformationVector**, vtkInformationVector* outputVector)
{
  Internals& state = *this->State;
  if (!state.Series)
  {
    // RequestInformation has failed and said why: the outputs stay empty.
    return 1;
  }
  const coronary::GatedSeries& series = *state.Series;
  vtkInformation* imageInfo = outputVector->GetInformationObject(0);
  const int asked = std::max(0, request->Get(vtkDemandDrivenPipeline::FROM_OUTPUT_PORT()));
  vtkInformation* askedInfo = outputVector->GetInformationObject(asked);
  int phase = 0;
  if (askedInfo->Has(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP()))
  {
    phase =
      series.NearestPhase(askedInfo->Get(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP()));
  }
  std::array<int, 6> extent = series.Grid().extent;
  if (imageInfo->Has(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT()))
  {
    std::array<int, 6> wanted{};
    imageInfo->Get(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), wanted.data());
    // After a failed update the request may be of the image before.
    for (std::size_t i = 0; i < 6; ++i)
    {
      extent[i] = i % 2 == 0 ? std::max(extent[i], wanted[i]) : std::min(extent[i], wanted[i]);
    }
  }

  vtkImageData* image = vtkImageData::GetData(outputVector, 0);
  vtkPolyData* seeds = vtkPolyData::GetData(outputVector, 1);
  try
  {
    this->ReadImage(phase, extent.data(), image);
  }
  catch (const coronary::Cancelled&)
  {
    image->Initialize();
    return 1;
  }
  catch (const std::bad_alloc&)
  {
    image->Initialize();
    return vtkCoronary::ReportEmptied(this,
      "Not enough memory for phase " + std::to_string(phase) + " of '" + series.Name(phase) + "'.");
  }
  catch (const std::exception& error)
  {
    image->Initialize();
    return vtkCoronary::ReportEmptied(this, error.what());
  }

  vtkInformation* seedInfo = outputVector->GetInformationObject(1);
  if (!seedInfo->Has(vtkStreamingDemandDrivenPipeline::UPDATE_PIECE_NUMBER()) ||
    seedInfo->Get(vtkStreamingDemandDrivenPipeline::UPDATE_PIECE_NUMBER()) == 0)
  {
    this->FillSeeds(seeds);
  }
  for (vtkDataObject* output :
    { static_cast<vtkDataObject*>(image), static_cast<vtkDataObject*>(seeds) })
  {
    vtkNew<vtkDoubleArray> cycle;
    cycle->SetName(vtkCoronaryArrayNames::CycleLength);
    cycle->InsertNextValue(series.CycleSeconds());
    vtkNew<vtkDoubleArray> time;
    time->SetName(vtkCoronaryArrayNames::PhaseTime);
    time->InsertNextValue(series.Fraction(phase));
    output->GetFieldData()->AddArray(cycle);
    output->GetFieldData()->AddArray(time);
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), series.Fraction(phase));
  }
  return 1;
}

void vtkGatedImageReader::ReadImage(int phase, const int extent[6], vtkImageData* image)
{
  Internals& state = *this->State;
  const coronary::GatedSeries& series = *state.Series;
  const coronary::ImageGrid& grid = series.Grid();
  std::array<int, 6> wanted{};
  std::copy_n(extent, 6, wanted.begin());

  image->SetExtent(wanted[0], wanted[1], wanted[2], wanted[3], wanted[4], wanted[5]);
  image->SetOrigin(grid.origin.data());
  image->SetSpacing(grid.spacing.data());
  image->SetDirectionMatrix(RowMajor(grid.direction).data());
  if (wanted[0] > wanted[1] || wanted[2] > wanted[3] || wanted[4] > wanted[5])
  {
    // A piece without voxels, as a rank beyond the last slice gets it.
    return;
  }
  if (!state.Values || state.ValuesPhase != phase || state.ValuesExtent != wanted)
  {
    // Let go of the old volume before there is a new one.
    state.Forget();
    const vtkIdType voxels = image->GetNumberOfPoints();
    const auto progress = vtkCoronary::ProgressOf(this);
    coronary::VolumeSource& source = series.Source(phase);
    const int index = series.IndexInSource(phase);
    vtkSmartPointer<vtkDataArray> values;
    if (series.FitsShort())
    {
      vtkNew<vtkShortArray> shorts;
      shorts->SetNumberOfValues(voxels);
      coronary::PreferLargePages(
        shorts->GetPointer(0), sizeof(short) * static_cast<std::size_t>(voxels));
      if (source.Read(index, wanted, shorts->GetPointer(0), progress))
      {
        values = shorts.GetPointer();
      }
    }
    if (!values)
    {
      vtkNew<vtkFloatArray> floats;
      floats->SetNumberOfValues(voxels);
      coronary::PreferLargePages(
        floats->GetPointer(0), sizeof(float) * static_cast<std::size_t>(voxels));
      source.Read(index, wanted, floats->GetPointer(0), progress);
      values = floats.GetPointer();
    }
    values->SetName(vtkCoronaryArrayNames::HounsfieldUnits);
    state.Values = values;
    state.ValuesPhase = phase;
    state.ValuesExtent = wanted;
  }
  image->GetPointData()->SetScalars(state.Values);
}

void vtkGatedImageReader::FillSeeds(vtkPolyData* output)
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> vertices;
  vtkNew<vtkStringArray> names;
  names->SetName(vtkCoronaryArrayNames::Name);
  for (const auto& seed : this->State->Series->Seeds())
  {
    const vtkIdType id = points->InsertNextPoint(seed.position.data());
    vertices->InsertNextCell(1, &id);
    names->InsertNextValue(seed.name);
  }
  output->SetPoints(points);
  output->SetVerts(vertices);
  output->GetPointData()->AddArray(names);
}
