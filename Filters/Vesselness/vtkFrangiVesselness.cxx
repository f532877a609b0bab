#include "vtkFrangiVesselness.h"

#include "ImageExtent.h"
#include "LargePages.h"
#include "MultiscaleVesselness.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"

#include "vtkArrayDispatch.h"
#include "vtkDataArrayRange.h"
#include "vtkDoubleArray.h"
#include "vtkExtentTranslator.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationIntegerRequestKey.h"
#include "vtkInformationVector.h"
#include "vtkMatrix3x3.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <utility>
#include <vector>

using coronary::Extent;
using coronary::IsEmpty;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

namespace
{
constexpr Extent EmptyExtent = { 0, -1, 0, -1, 0, -1 };

bool Contains(const Extent& outer, const Extent& inner)
{
  return IsEmpty(inner) ||
    (outer[0] <= inner[0] && outer[1] >= inner[1] && outer[2] <= inner[2] && outer[3] >= inner[3] &&
      outer[4] <= inner[4] && outer[5] >= inner[5]);
}

Extent Intersection(const Extent& a, const Extent& b)
{
  Extent e;
  for (int axis = 0; axis < 3; ++axis)
  {
    e[2 * axis] = std::max(a[2 * axis], b[2 * axis]);
    e[2 * axis + 1] = std::min(a[2 * axis + 1], b[2 * axis + 1]);
  }
  return IsEmpty(e) ? EmptyExtent : e;
}

Extent Grown(const Extent& e, const std::array<int, 3>& halo, const Extent& whole)
{
  if (IsEmpty(e))
  {
    return EmptyExtent;
  }
  Extent grown;
  for (int axis = 0; axis < 3; ++axis)
  {
    grown[2 * axis] = std::max(e[2 * axis] - halo[axis], whole[2 * axis]);
    grown[2 * axis + 1] = std::min(e[2 * axis + 1] + halo[axis], whole[2 * axis + 1]);
  }
  return grown;
}

std::int64_t RowLength(const Extent& e)
{
  return std::int64_t{ e[1] } - e[0] + 1;
}

std::int64_t Size(const Extent& e)
{
  return IsEmpty(e) ? 0 : RowLength(e) * (e[3] - e[2] + 1) * (e[5] - e[4] + 1);
}

Extent ExtentOf(vtkInformation* info, vtkInformationIntegerVectorKey* key)
{
  Extent e = EmptyExtent;
  if (info->Has(key))
  {
    info->Get(key, e.data());
  }
  return e;
}

Extent ExtentOf(vtkImageData* image)
{
  Extent e;
  image->GetExtent(e.data());
  return e;
}

/// The part of the update extent that RequestData will be asked for: of a piece request the
/// executive knows the extent only then.
Extent RequestedExtent(vtkInformation* outInfo)
{
  Extent e = ExtentOf(outInfo, SDDP::UPDATE_EXTENT());
  const int pieces = outInfo->Get(SDDP::UPDATE_NUMBER_OF_PIECES());
  if (pieces > 1)
  {
    const int mode = outInfo->Has(vtkExtentTranslator::UPDATE_SPLIT_MODE())
      ? outInfo->Get(vtkExtentTranslator::UPDATE_SPLIT_MODE())
      : vtkExtentTranslator::BLOCK_MODE;
    Extent part = EmptyExtent;
    vtkNew<vtkExtentTranslator> translator;
    translator->PieceToExtentThreadSafe(outInfo->Get(SDDP::UPDATE_PIECE_NUMBER()), pieces,
      outInfo->Get(SDDP::UPDATE_NUMBER_OF_GHOST_LEVELS()), e.data(), part.data(), mode, 0);
    e = part;
  }
  return e;
}

struct Geometry
{
  std::array<double, 3> origin = { 0.0, 0.0, 0.0 };
  std::array<double, 3> spacing = { 1.0, 1.0, 1.0 };
  std::array<double, 9> direction = { 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0 };

  explicit Geometry(vtkImageData* image)
  {
    image->GetOrigin(this->origin.data());
    image->GetSpacing(this->spacing.data());
    std::copy_n(image->GetDirectionMatrix()->GetData(), 9, this->direction.data());
  }

  coronary::Matrix3 Direction() const
  {
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(this->direction.data());
  }

  /// What an empty piece knows of its image it knows from the pipeline.
  Geometry(vtkImageData* image, vtkInformation* info)
    : Geometry(image)
  {
    if (info->Has(vtkDataObject::ORIGIN()) && info->Has(vtkDataObject::SPACING()))
    {
      info->Get(vtkDataObject::ORIGIN(), this->origin.data());
      info->Get(vtkDataObject::SPACING(), this->spacing.data());
    }
    if (info->Has(vtkDataObject::DIRECTION()))
    {
      info->Get(vtkDataObject::DIRECTION(), this->direction.data());
    }
  }
};

template <std::size_t N>
bool Near(const std::array<double, N>& a, const std::array<double, N>& b, double tolerance)
{
  return std::equal(a.begin(), a.end(), b.begin(),
    [=](double x, double y) { return std::abs(x - y) <= tolerance; });
}

/// visit(value, index of the voxel in `part`), rows in parallel.
template <typename Array, typename Visit>
void ForEachVoxel(Array* array, const Extent& image, const Extent& part, const Visit& visit)
{
  const auto values = vtk::DataArrayValueRange<1>(array);
  const std::int64_t width = RowLength(part);
  const std::int64_t rows = part[3] - part[2] + 1;
  coronary::ParallelFor(rows * (part[5] - part[4] + 1), 64,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t row = first; row < last; ++row)
      {
        const std::int64_t k = part[4] + row / rows - image[4];
        const std::int64_t j = part[2] + row % rows - image[2];
        const vtkIdType source =
          (k * (image[3] - image[2] + 1) + j) * RowLength(image) + part[0] - image[0];
        for (vtkIdType i = 0; i < width; ++i)
        {
          visit(values[source + i], row * width + i);
        }
      }
    });
}

struct ToFloat
{
  template <typename Array>
  void operator()(Array* array, const Extent& image, const Extent& part, float* to) const
  {
    ForEachVoxel(
      array, image, part, [=](auto value, std::int64_t at) { to[at] = static_cast<float>(value); });
  }
};

struct ToMask
{
  template <typename Array>
  void operator()(Array* array, const Extent& image, const Extent& part, unsigned char* to) const
  {
    ForEachVoxel(array, image, part,
      [=](auto value, std::int64_t at)
      {
        const auto v = static_cast<double>(value);
        to[at] = v != 0.0 && !std::isnan(v);
      });
  }
};

template <typename Worker, typename Value>
void Convert(vtkDataArray* array, const Extent& image, const Extent& part, Value* to)
{
  const Worker worker;
  if (!vtkArrayDispatch::Dispatch::Execute(array, worker, image, part, to))
  {
    worker(array, image, part, to);
  }
}

/// Voxels as float: the image's own if they are, else a copy of the part.
struct FloatBlock
{
  FloatBlock(vtkImageData* image, vtkDataArray* array, const Extent& part)
  {
    if (auto* floats = vtkArrayDownCast<vtkFloatArray>(array))
    {
      this->Block = { floats->GetPointer(0), ExtentOf(image) };
      return;
    }
    this->Storage.reset(new float[Size(part)]);
    Convert<ToFloat>(array, ExtentOf(image), part, this->Storage.get());
    this->Block = { this->Storage.get(), part };
  }

  coronary::VoxelBlock Block;

private:
  std::unique_ptr<float[]> Storage;
};

vtkSmartPointer<vtkFloatArray> NewArray(
  vtkImageData* output, const std::string& name, int components)
{
  auto array = vtkSmartPointer<vtkFloatArray>::New();
  array->SetName(name.c_str());
  array->SetNumberOfComponents(components);
  if (!array->Resize(output->GetNumberOfPoints()))
  {
    throw std::bad_alloc();
  }
  array->SetNumberOfTuples(output->GetNumberOfPoints());
  coronary::PreferLargePages(
    array->GetPointer(0), sizeof(float) * static_cast<std::size_t>(array->GetNumberOfValues()));
  output->GetPointData()->AddArray(array);
  return array;
}

void AddField(vtkDataObject* data, const char* name, const std::vector<double>& values)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  for (const double value : values)
  {
    array->InsertNextValue(value);
  }
  data->GetFieldData()->AddArray(array);
}

/// Results of a part, put into the place that it has in the output.
void Insert(
  const std::vector<float>& from, const Extent& part, vtkFloatArray* to, const Extent& out)
{
  const int components = to->GetNumberOfComponents();
  std::fill_n(to->GetPointer(0), to->GetNumberOfValues(), 0.0f);
  const std::int64_t width = RowLength(part) * components;
  const float* source = from.data();
  for (std::int64_t k = part[4]; k <= part[5] && !IsEmpty(part); ++k)
  {
    for (std::int64_t j = part[2]; j <= part[3]; ++j)
    {
      const vtkIdType voxel =
        ((k - out[4]) * (out[3] - out[2] + 1) + j - out[2]) * RowLength(out) + part[0] - out[0];
      std::copy_n(source, width, to->GetPointer(voxel * components));
      source += width;
    }
  }
}

void Rotate(const coronary::Matrix3& direction, float* vectors, std::int64_t count)
{
  const Eigen::Matrix3f rotation = direction.cast<float>();
  coronary::ParallelFor(count, 65536,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        Eigen::Map<Eigen::Vector3f> vector(vectors + 3 * n);
        vector = (rotation * vector).eval();
      }
    });
}

/// The algorithm's complaint, with the setting called by the property's name.
/// Name of the array that was chosen, empty: the active scalars.
/// All that the measured extremes depend on.
struct MeasurementKey
{
  vtkMTimeType image = 0;
  vtkMTimeType mask = 0;
  vtkCoronary::Moment moment;
  Extent region = EmptyExtent;
  Extent whole = EmptyExtent;
  std::array<double, 3> spacing{};
  std::string array;
  std::vector<double> sigmas;
  int method = 0;
  bool bright = false;

  bool operator==(const MeasurementKey& o) const
  {
    return this->image == o.image && this->mask == o.mask && this->moment == o.moment &&
      this->region == o.region && this->whole == o.whole && this->spacing == o.spacing &&
      this->array == o.array && this->sigmas == o.sigmas && this->method == o.method &&
      this->bright == o.bright;
  }
};
}

struct vtkFrangiVesselness::Internals
{
  vtkFrangiVesselness* Self;
  bool Measured = false;
  MeasurementKey Key;
  coronary::MultiscaleVesselness::Extremes Extremes;
  // Of the last warning, so that a series is not warned of at every step.
  std::pair<double, double> WarnedOfSigma = { 0.0, 0.0 };

  coronary::VesselnessSettings Settings() const;
  Extent RegionIn(const Extent& whole) const;
  vtkDataArray* ImageArray(vtkImageData* image) const
  {
    return vtkCoronary::VoxelArrayOf(
      image, vtkCoronary::ChosenPointArray(this->Self, "the image"), "the image");
  }
  vtkDataArray* MaskArray(vtkImageData* mask) const
  {
    return vtkCoronary::VoxelArrayOf(mask, this->Self->MaskArrayName, "the mask");
  }
  vtkImageData* Mask(
    vtkInformationVector** inputs, const Geometry& grid, const Extent& whole) const;
  void Measure(const MeasurementKey& key, const coronary::MultiscaleVesselness& vesselness,
    vtkInformationVector** inputs);
  bool SetScale(vtkInformationVector** inputs, const Geometry& grid, const Extent& whole,
    const Extent& region, coronary::VesselnessSettings& settings);
  void Prepare(vtkImageData* input, const Geometry& grid, const Extent& out,
    const coronary::VesselnessSettings& settings, vtkImageData* output) const;
  void Execute(vtkInformationVector** inputs, vtkInformation* outInfo);
  void WarnOfSigma(const Geometry& grid);
};

vtkStandardNewMacro(vtkFrangiVesselness);

vtkFrangiVesselness::vtkFrangiVesselness()
  : Data(new Internals)
{
  this->Data->Self = this;
  this->SetNumberOfInputPorts(2);
}

vtkFrangiVesselness::~vtkFrangiVesselness() = default;

vtkExecutive* vtkFrangiVesselness::CreateDefaultExecutive()
{
  return SDDP::New();
}

int vtkFrangiVesselness::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  if (port == 1)
  {
    info->Set(INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

coronary::VesselnessSettings vtkFrangiVesselness::Internals::Settings() const
{
  const vtkFrangiVesselness& self = *this->Self;
  vtkCoronary::Require(
    self.Method >= Frangi && self.Method <= Jerman, "Method must be Frangi, Sato or Jerman");
  vtkCoronary::Require(self.ScaleSpacing == Linear || self.ScaleSpacing == Logarithmic,
    "ScaleSpacing must be linear or logarithmic");
  vtkCoronary::Require(
    self.SigmaMin > 0.0 && std::isfinite(self.SigmaMin), "SigmaMin must be positive, in mm");
  vtkCoronary::Require(self.SigmaMax >= self.SigmaMin && self.SigmaMax <= 100.0,
    "SigmaMax must lie between SigmaMin and 100 mm");
  vtkCoronary::Require(
    self.NumberOfScales >= 1 && self.NumberOfScales <= 100, "NumberOfScales must be 1 to 100");
  vtkCoronary::Require(self.MeasurementBlockSize > 0, "MeasurementBlockSize must be positive");

  coronary::VesselnessSettings settings;
  settings.method = static_cast<coronary::VesselnessMethod>(self.Method);
  settings.sigmas = coronary::VesselnessScales(
    self.SigmaMin, self.SigmaMax, self.NumberOfScales, self.ScaleSpacing == Logarithmic);
  settings.bright = self.Bright;
  settings.alpha = self.Alpha;
  settings.beta = self.Beta;
  settings.tau = self.Tau;
  settings.c = self.AutomaticC ? 1.0 : self.C;
  settings.jermanMaxima.assign(settings.sigmas.size(), 0.0);
  settings.Validate();
  return settings;
}

Extent vtkFrangiVesselness::Internals::RegionIn(const Extent& whole) const
{
  if (!this->Self->UseRegion)
  {
    return whole;
  }
  Extent region;
  std::copy_n(this->Self->Region, 6, region.begin());
  const Extent inside = Intersection(region, whole);
  vtkCoronary::Require(
    !IsEmpty(inside) || IsEmpty(whole), "Region does not meet the extent of the image");
  return inside;
}

int vtkFrangiVesselness::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  vtkDataObject::SetPointDataActiveScalarInfo(outInfo, VTK_FLOAT, 1);
  outInfo->Set(CAN_PRODUCE_SUB_EXTENT(), 1);
  return 1;
}

int vtkFrangiVesselness::RequestUpdateExtent(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* inInfo = inputs[0]->GetInformationObject(0);
  vtkInformation* maskInfo = inputs[1]->GetInformationObject(0);
  const Extent whole = ExtentOf(inInfo, SDDP::WHOLE_EXTENT());
  try
  {
    Geometry grid(vtkImageData::GetData(inInfo), inInfo);
    const coronary::MultiscaleVesselness vesselness(
      this->Data->Settings(), Vector3(grid.spacing.data()), whole);
    const Extent part =
      Intersection(RequestedExtent(outputs->GetInformationObject(0)), this->Data->RegionIn(whole));
    vtkCoronary::SetRequest(inInfo, Grown(part, vesselness.Halo(), whole));
    if (maskInfo)
    {
      vtkCoronary::SetRequest(
        maskInfo, Intersection(part, ExtentOf(maskInfo, SDDP::WHOLE_EXTENT())));
    }
  }
  catch (const std::exception&)
  {
    // RequestData says it. Nothing is computed: nothing is needed.
    vtkCoronary::SetRequest(inInfo, EmptyExtent);
    if (maskInfo)
    {
      vtkCoronary::SetRequest(maskInfo, EmptyExtent);
    }
  }
  return 1;
}

vtkImageData* vtkFrangiVesselness::Internals::Mask(
  vtkInformationVector** inputs, const Geometry& grid, const Extent& whole) const
{
  vtkInformation* info = inputs[1]->GetInformationObject(0);
  if (!info)
  {
    return nullptr;
  }
  vtkImageData* mask = vtkImageData::GetData(info);
  const Geometry other(mask, info);
  const auto require = [](bool same, const char* what)
  {
    vtkCoronary::Require(
      same, std::string("the mask is on another grid than the image: ") + what + " differs");
  };
  const double voxel = *std::min_element(grid.spacing.begin(), grid.spacing.end());
  require(ExtentOf(info, SDDP::WHOLE_EXTENT()) == whole, "its extent");
  require(Near(grid.spacing, other.spacing, 1e-4 * voxel), "its spacing");
  require(Near(grid.origin, other.origin, 1e-2 * voxel), "its origin");
  require(Near(grid.direction, other.direction, 1e-4), "its direction");
  return mask;
}

void vtkFrangiVesselness::Internals::Measure(const MeasurementKey& key,
  const coronary::MultiscaleVesselness& vesselness, vtkInformationVector** inputs)
{
  this->Measured = false;
  vtkInformation* inInfo = inputs[0]->GetInformationObject(0);
  vtkInformation* maskInfo = inputs[1]->GetInformationObject(0);
  vtkCoronary::UpstreamRequest ofImage(inInfo, inInfo);
  vtkCoronary::UpstreamRequest ofMask(maskInfo ? maskInfo : inInfo, maskInfo ? maskInfo : inInfo);

  const Extent& region = key.region;
  const std::array<int, 3> halo = vesselness.Halo();
  Extent slice = region;
  slice[5] = slice[4];
  slice = Grown(slice, { halo[0], halo[1], 0 }, key.whole);
  // As many slices as fit beside their halo, at least one.
  const std::int64_t fitting =
    this->Self->MeasurementBlockSize / std::max<std::int64_t>(1, Size(slice));
  const int depth = region[5] - region[4] + 1;
  const int step = fitting >= depth
    ? depth
    : static_cast<int>(std::max<std::int64_t>(1, fitting - 2 * std::int64_t{ halo[2] }));

  const auto isThere = [&](vtkImageData* image, const Extent& part)
  {
    vtkInformation* info = image->GetInformation();
    return Contains(ExtentOf(image), part) &&
      (!key.moment.exists ||
        (info->Has(vtkDataObject::DATA_TIME_STEP()) &&
          info->Get(vtkDataObject::DATA_TIME_STEP()) == key.moment.time));
  };
  coronary::MultiscaleVesselness::Extremes extremes;
  for (int k = region[4]; k <= region[5]; k += step)
  {
    Extent slab = region;
    slab[4] = k;
    slab[5] = std::min(region[5], k + step - 1);
    const Extent block = Grown(slab, halo, key.whole);
    if (!isThere(vtkImageData::GetData(inInfo), block))
    {
      ofImage.Ask(&block, key.moment);
    }
    std::vector<unsigned char> inside;
    if (maskInfo)
    {
      if (!isThere(vtkImageData::GetData(maskInfo), slab))
      {
        ofMask.Ask(&slab, vtkCoronary::NearestMoment(maskInfo, false, key.moment.time));
      }
      vtkImageData* mask = vtkImageData::GetData(maskInfo);
      vtkDataArray* array = this->MaskArray(mask);
      vtkCoronary::Require(
        Contains(ExtentOf(mask), slab), "the mask lacks part of the requested extent");
      inside.resize(Size(slab));
      Convert<ToMask>(array, ExtentOf(mask), slab, inside.data());
    }
    vtkImageData* image = vtkImageData::GetData(inInfo);
    vtkDataArray* array = this->ImageArray(image);
    vtkCoronary::Require(
      Contains(ExtentOf(image), block), "the image lacks part of the requested extent");
    const FloatBlock floats(image, array, block);
    const double done = static_cast<double>(k - region[4]) / depth;
    const double after = static_cast<double>(slab[5] + 1 - region[4]) / depth;
    extremes.Merge(vesselness.Measure(floats.Block, slab, maskInfo ? inside.data() : nullptr,
      vtkCoronary::ProgressOf(this->Self, 0.4 * done, 0.4 * after)));
  }
  ofImage.Restore();
  if (maskInfo)
  {
    ofMask.Restore();
  }
  this->Extremes = extremes;
  this->Key = key;
  this->Measured = true;
}

void vtkFrangiVesselness::Internals::WarnOfSigma(const Geometry& grid)
{
  const double coarsest = *std::max_element(grid.spacing.begin(), grid.spacing.end());
  const std::pair<double, double> now(this->Self->SigmaMin, coarsest);
  if (this->Self->SigmaMin < 0.5 * coarsest && now != this->WarnedOfSigma)
  {
    vtkWarningWithObjectMacro(this->Self,
      "SigmaMin "
        << this->Self->SigmaMin << " mm is below half the largest voxel spacing (" << coarsest
        << " mm): the image does not resolve such vessels, so the smallest scales answer to noise, "
           "and differently along the axes. Use at least "
        << 0.5 * coarsest << " mm.");
    this->WarnedOfSigma = now;
  }
}

/// The scale of the structures, C or lambda 3, from a measurement of the image.
/// @return whether there are any
bool vtkFrangiVesselness::Internals::SetScale(vtkInformationVector** inputs, const Geometry& grid,
  const Extent& whole, const Extent& region, coronary::VesselnessSettings& settings)
{
  vtkFrangiVesselness& self = *this->Self;
  vtkInformation* inInfo = inputs[0]->GetInformationObject(0);
  vtkInformation* maskInfo = inputs[1]->GetInformationObject(0);
  MeasurementKey key;
  key.image = vtkCoronary::UpstreamTime(inInfo);
  key.mask = maskInfo ? vtkCoronary::UpstreamTime(maskInfo) : 0;
  key.moment = vtkCoronary::NearestMoment(inInfo, self.AutomaticReferenceTime, self.ReferenceTime);
  key.region = region;
  key.whole = whole;
  key.spacing = grid.spacing;
  key.array = vtkCoronary::ChosenPointArray(&self, "the image");
  key.sigmas = settings.sigmas;
  key.method = self.Method;
  key.bright = self.Bright;
  if (!this->Measured || !(key == this->Key))
  {
    this->Measure(
      key, coronary::MultiscaleVesselness(settings, Vector3(grid.spacing.data()), whole), inputs);
    if (!(this->Extremes.hessianNorm > 0.0))
    {
      vtkWarningWithObjectMacro(
        &self, "The image has no structure where C is measured: the vesselness is 0 everywhere.");
    }
  }
  const bool structured = this->Extremes.hessianNorm > 0.0;
  settings.jermanMaxima = this->Extremes.jermanMaxima;
  settings.jermanMaxima.resize(settings.sigmas.size());
  settings.c = structured ? 0.5 * this->Extremes.hessianNorm : 1.0;
  return structured;
}

/// Grid and field data of the output.
void vtkFrangiVesselness::Internals::Prepare(vtkImageData* input, const Geometry& grid,
  const Extent& out, const coronary::VesselnessSettings& settings, vtkImageData* output) const
{
  const vtkFrangiVesselness& self = *this->Self;
  output->Initialize();
  output->SetExtent(Extent(out).data());
  output->SetOrigin(grid.origin.data());
  output->SetSpacing(grid.spacing.data());
  output->SetDirectionMatrix(grid.direction.data());
  output->GetFieldData()->PassData(input->GetFieldData());
  if (input->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP()))
  {
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(),
      input->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()));
  }
  AddField(output, vtkCoronaryArrayNames::VesselnessSigmas, settings.sigmas);
  if (self.Method == Frangi)
  {
    AddField(output, vtkCoronaryArrayNames::VesselnessC, { self.UsedC });
  }
  else if (self.Method == Jerman)
  {
    AddField(output, vtkCoronaryArrayNames::VesselnessLambda3, settings.jermanMaxima);
  }
}

void vtkFrangiVesselness::Internals::Execute(vtkInformationVector** inputs, vtkInformation* outInfo)
{
  vtkFrangiVesselness& self = *this->Self;
  vtkInformation* inInfo = inputs[0]->GetInformationObject(0);
  vtkInformation* maskInfo = inputs[1]->GetInformationObject(0);
  coronary::VesselnessSettings settings = this->Settings();
  const Extent whole = ExtentOf(inInfo, SDDP::WHOLE_EXTENT());
  vtkCoronary::Require(
    IsEmpty(whole) || (whole[0] < whole[1] && whole[2] < whole[3] && whole[4] < whole[5]),
    "the image has " + std::to_string(whole[1] - whole[0] + 1) + " x " +
      std::to_string(whole[3] - whole[2] + 1) + " x " + std::to_string(whole[5] - whole[4] + 1) +
      " voxels: a three-dimensional image is needed");
  const Geometry grid(vtkImageData::GetData(inInfo), inInfo);
  const coronary::Matrix3 direction = grid.Direction();
  vtkCoronary::Require(
    (direction * direction.transpose()).isApprox(coronary::Matrix3::Identity(), 1e-4),
    "the image's direction matrix is not orthonormal");
  const Extent region = this->RegionIn(whole);
  this->Mask(inputs, grid, whole);

  self.UsedC = 0.0;
  bool structured = true;
  if (!IsEmpty(whole))
  {
    this->WarnOfSigma(grid);
    const bool automatic = self.Method == Frangi ? self.AutomaticC : self.Method == Jerman;
    if (automatic)
    {
      structured = this->SetScale(inputs, grid, whole, region, settings);
    }
    self.UsedC = self.Method == Frangi && structured ? settings.c : 0.0;
  }

  // Only now: while C was measured the input may have been at another time and extent.
  vtkImageData* input = vtkImageData::GetData(inInfo);
  vtkImageData* output = vtkImageData::GetData(outInfo);
  Extent out = ExtentOf(outInfo, SDDP::UPDATE_EXTENT());
  out = IsEmpty(out) ? EmptyExtent : out;
  const Extent part = Intersection(out, region);
  this->Prepare(input, grid, out, settings, output);

  const vtkSmartPointer<vtkFloatArray> values =
    NewArray(output, vtkCoronaryArrayNames::Vesselness, 1);
  output->GetPointData()->SetActiveScalars(vtkCoronaryArrayNames::Vesselness);
  vtkSmartPointer<vtkFloatArray> scales;
  vtkSmartPointer<vtkFloatArray> directions;
  if (self.GenerateScale)
  {
    scales = NewArray(output, vtkCoronaryArrayNames::VesselScale, 1);
  }
  if (self.GenerateDirection)
  {
    directions = NewArray(output, vtkCoronaryArrayNames::VesselDirection, 3);
  }
  // In the place of the result if it is all of it.
  std::vector<float> parts[3];
  const bool direct = part == out;
  const auto place = [&](int n, vtkFloatArray* array) -> float*
  {
    if (!array || direct)
    {
      return array ? array->GetPointer(0) : nullptr;
    }
    parts[n].resize(Size(part) * array->GetNumberOfComponents());
    return parts[n].data();
  };
  const coronary::MultiscaleVesselness::Output to{ place(0, values), place(1, scales),
    place(2, directions) };

  if (!IsEmpty(part))
  {
    const coronary::MultiscaleVesselness vesselness(settings, Vector3(grid.spacing.data()), whole);
    const Extent block = Grown(part, vesselness.Halo(), whole);
    vtkDataArray* array = this->ImageArray(input);
    vtkCoronary::Require(
      Contains(ExtentOf(input), block), "the image lacks part of the requested extent");
    vtkImageData* mask = maskInfo ? vtkImageData::GetData(maskInfo) : nullptr;
    vtkDataArray* maskArray = mask ? this->MaskArray(mask) : nullptr;
    vtkCoronary::Require(
      !mask || Contains(ExtentOf(mask), part), "the mask lacks part of the requested extent");
    if (structured)
    {
      // In slabs: of other voxels than floats there need be a copy only of what is looked at.
      constexpr int depth = 32;
      for (int k = part[4]; k <= part[5]; k += depth)
      {
        Extent slab = part;
        slab[4] = k;
        slab[5] = std::min(part[5], k + depth - 1);
        std::vector<unsigned char> inside(mask ? Size(slab) : 0);
        if (mask)
        {
          Convert<ToMask>(maskArray, ExtentOf(mask), slab, inside.data());
        }
        const FloatBlock floats(input, array, Grown(slab, vesselness.Halo(), whole));
        const std::int64_t before = Size(part) / (part[5] - part[4] + 1) * (k - part[4]);
        const auto share = [&](int slice)
        { return 0.4 + 0.6 * (slice - part[4]) / (part[5] - part[4] + 1); };
        vesselness.Compute(floats.Block, slab, mask ? inside.data() : nullptr,
          { to.vesselness + before, to.scale ? to.scale + before : nullptr,
            to.direction ? to.direction + 3 * before : nullptr },
          vtkCoronary::ProgressOf(&self, share(k), share(slab[5] + 1)));
      }
    }
    else
    {
      std::fill_n(to.vesselness, Size(part), 0.0f);
      std::fill_n(to.scale, to.scale ? Size(part) : 0, 0.0f);
      std::fill_n(to.direction, to.direction ? 3 * Size(part) : 0, 0.0f);
    }
  }
  if (!direct)
  {
    vtkFloatArray* const arrays[] = { values, scales, directions };
    for (int n = 0; n < 3; ++n)
    {
      if (arrays[n])
      {
        Insert(parts[n], part, arrays[n], out);
      }
    }
  }
  if (directions)
  {
    Rotate(direction, directions->GetPointer(0), directions->GetNumberOfTuples());
  }
}

int vtkFrangiVesselness::RequestData(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  try
  {
    this->Data->Execute(inputs, outInfo);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(
      this, outputs, "for the vesselness of the requested extent", { "VesselnessSettings: " });
  }
}

void vtkFrangiVesselness::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  const auto print = [&](const char* name, const auto& value)
  { os << indent << name << ": " << value << "\n"; };
  print("SigmaMin", this->SigmaMin);
  print("SigmaMax", this->SigmaMax);
  print("NumberOfScales", this->NumberOfScales);
  print("ScaleSpacing", this->ScaleSpacing);
  print("Method", this->Method);
  print("Alpha", this->Alpha);
  print("Beta", this->Beta);
  print("AutomaticC", this->AutomaticC);
  print("C", this->C);
  print("UsedC", this->UsedC);
  print("AutomaticReferenceTime", this->AutomaticReferenceTime);
  print("ReferenceTime", this->ReferenceTime);
  print("MeasurementBlockSize", this->MeasurementBlockSize);
  print("Tau", this->Tau);
  print("Bright", this->Bright);
  print("GenerateScale", this->GenerateScale);
  print("GenerateDirection", this->GenerateDirection);
  print("UseRegion", this->UseRegion);
  os << indent << "Region:";
  std::for_each(this->Region, this->Region + 6, [&](int value) { os << ' ' << value; });
  os << "\n";
  print("MaskArrayName", this->MaskArrayName);
}
