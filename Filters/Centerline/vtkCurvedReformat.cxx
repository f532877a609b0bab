#include "vtkCurvedReformat.h"

#include "CurvedReformat.h"
#include "VesselChains.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCompositeDataSet.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkStructuredGrid.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace names = vtkCoronaryArrayNames;
using coronary::GreyPicture;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkCurvedReformat);

namespace
{
/// Points with their places in the patient, as lines.
struct Drawing
{
  std::vector<Vector3> flat;
  std::vector<Vector3> world;
  std::vector<double> arc;
  std::vector<std::vector<vtkIdType>> lines;

  void BeginLine() { this->lines.emplace_back(); }
  void Add(const Vector3& onPicture, const Vector3& inPatient, double at)
  {
    this->lines.back().push_back(static_cast<vtkIdType>(this->flat.size()));
    this->flat.push_back(onPicture);
    this->world.push_back(inPatient);
    this->arc.push_back(at);
  }
};

vtkSmartPointer<vtkPoints> PointsOf(const std::vector<Vector3>& places)
{
  auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(places.size()));
  for (std::size_t n = 0; n < places.size(); ++n)
  {
    points->SetPoint(static_cast<vtkIdType>(n), places[n].data());
  }
  return points;
}

void AddPlaces(vtkDataSet* data, const std::vector<Vector3>& world, const std::vector<double>& arc)
{
  vtkCoronary::AddVectors(data->GetPointData(), names::WorldPosition, world);
  vtkCoronary::AddArray<vtkDoubleArray>(data->GetPointData(), names::Abscissas, arc);
}

vtkSmartPointer<vtkPolyData> PolyDataOf(const Drawing& drawing, bool inPatient)
{
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(PointsOf(inPatient ? drawing.world : drawing.flat));
  vtkNew<vtkCellArray> lines;
  for (const std::vector<vtkIdType>& line : drawing.lines)
  {
    if (line.size() > 1)
    {
      lines->InsertNextCell(static_cast<vtkIdType>(line.size()), line.data());
    }
  }
  data->SetLines(lines);
  AddPlaces(data, drawing.world, drawing.arc);
  return data;
}

void SetBlock(vtkMultiBlockDataSet* output, const char* name, vtkDataObject* data)
{
  const unsigned int block = output->GetNumberOfBlocks();
  output->SetBlock(block, data);
  output->GetMetaData(block)->Set(vtkCompositeDataSet::NAME(), name);
}

std::size_t NearestPlace(const std::vector<Vector3>& places, const Vector3& point)
{
  return static_cast<std::size_t>(
    std::min_element(places.begin(), places.end(),
      [&](const Vector3& a, const Vector3& b) { return (a - point).norm() < (b - point).norm(); }) -
    places.begin());
}

/// A picture's rows go down, an image's up.
template <typename Value>
std::vector<Value> Upwards(const std::vector<Value>& rows, int width, int height)
{
  std::vector<Value> turned;
  turned.reserve(rows.size());
  for (int row = height - 1; row >= 0; --row)
  {
    const auto begin = rows.begin() + static_cast<std::ptrdiff_t>(row) * width;
    turned.insert(turned.end(), begin, begin + width);
  }
  return turned;
}
}

/// The outputs, out of the algorithm's results.
class vtkCurvedReformat::Writer
{
public:
  coronary::VesselReformat reformat;
  coronary::VesselBoundaries boundaries;
  std::vector<double> radius; ///< of each place of the axis, mm
  coronary::SlabPlane plane;
  GreyPicture section;
  std::size_t place = 0; ///< of the section
  std::string array;     ///< name of the values

  void WriteReformat(vtkMultiBlockDataSet* output) const
  {
    const GreyPicture& picture = this->reformat.picture;
    SetBlock(output, "Picture", this->Image(picture, this->reformat.spacing, 0.0, this->Sheet()));
    SetBlock(output, "Axis", PolyDataOf(this->AxisLine(), false));
    Drawing lumen;
    Drawing outer;
    for (const double side : { 1.0, -1.0 })
    {
      lumen.BeginLine();
      outer.BeginLine();
      for (std::size_t n = 0; n < this->radius.size(); ++n)
      {
        this->AddBeside(n, side * this->radius[n], lumen);
        const double away = this->OuterBeside(n, side);
        if (std::isnan(away))
        {
          outer.BeginLine();
        }
        else
        {
          this->AddBeside(n, side * away, outer);
        }
      }
    }
    SetBlock(output, "Lumen", PolyDataOf(lumen, false));
    SetBlock(output, "Outer Boundary", PolyDataOf(outer, false));
    Drawing column;
    column.BeginLine();
    const double reach = this->HalfWidth();
    this->AddBeside(this->place, reach, column);
    this->AddBeside(this->place, -reach, column);
    SetBlock(output, "Place", PolyDataOf(column, false));
  }

  void WriteSection(vtkMultiBlockDataSet* output) const
  {
    const std::vector<double> arc(
      this->section.values.size(), double(this->place) * this->reformat.axis.step);
    const Places places{ this->SectionPlaces(), arc };
    const double half = 0.5 * (this->section.width - 1) * this->plane.spacing;
    SetBlock(output, "Picture", this->Image(this->section, this->plane.spacing, half, places));
    SetBlock(output, "Lumen", PolyDataOf(this->Ring(Rings::Lumen), false));
    SetBlock(output, "Edge", PolyDataOf(this->Ring(Rings::Edge), false));
    SetBlock(output, "Outer Boundary", PolyDataOf(this->Ring(Rings::Outer), false));
    const auto add = [&](const char* name, double value)
    {
      vtkCoronary::AddArray<vtkDoubleArray>(
        output->GetFieldData(), name, std::vector<double>{ value });
    };
    // Not NaN, which readers of XML files complain about.
    const auto area = [&](const std::vector<double>& of)
    {
      const double found = this->boundaries.Area(of, this->place);
      return std::isnan(found) ? -1.0 : found;
    };
    add(names::SectionPosition, arc.front());
    add(names::LumenDiameter, 2.0 * this->radius[this->place]);
    add(names::EdgeArea, area(this->boundaries.lumen));
    add(names::OuterArea, area(this->boundaries.outer));
  }

  void WriteInPlace(vtkMultiBlockDataSet* output) const
  {
    SetBlock(output, "Sheet", this->Grid(this->reformat.picture, this->Sheet()));
    const std::vector<double> arc(
      this->section.values.size(), double(this->place) * this->reformat.axis.step);
    SetBlock(output, "Section", this->Grid(this->section, { this->SectionPlaces(), arc }));
    SetBlock(output, "Axis", PolyDataOf(this->AxisLine(), true));
    SetBlock(output, "Lumen", PolyDataOf(this->Ring(Rings::Lumen), true));
    SetBlock(output, "Edge", PolyDataOf(this->Ring(Rings::Edge), true));
    SetBlock(output, "Outer Boundary", PolyDataOf(this->Ring(Rings::Outer), true));
  }

private:
  /// Of a picture's pixels, row by row from the top.
  struct Places
  {
    std::vector<Vector3> world;
    std::vector<double> arc;
  };
  enum class Rings
  {
    Lumen,
    Edge,
    Outer
  };

  double HalfWidth() const { return 0.5 * (this->section.width - 1) * this->plane.spacing; }

  Places Sheet() const
  {
    Places places{ this->reformat.place, {} };
    const GreyPicture& picture = this->reformat.picture;
    for (int row = 0; row < picture.height; ++row)
    {
      for (int x = 0; x < picture.width; ++x)
      {
        places.arc.push_back(this->reformat.ArcAt(static_cast<std::size_t>(x)));
      }
    }
    return places;
  }

  std::vector<Vector3> SectionPlaces() const
  {
    std::vector<Vector3> places;
    for (int row = 0; row < this->section.height; ++row)
    {
      for (int x = 0; x < this->section.width; ++x)
      {
        places.emplace_back(this->plane.corner +
          this->plane.spacing * (x * this->plane.right + row * this->plane.down));
      }
    }
    return places;
  }

  /// @param left  mm that the first column is left of x = 0
  vtkSmartPointer<vtkImageData> Image(
    const GreyPicture& picture, double spacing, double left, const Places& places) const
  {
    auto image = vtkSmartPointer<vtkImageData>::New();
    image->SetDimensions(picture.width, picture.height, 1);
    image->SetSpacing(spacing, spacing, spacing);
    image->SetOrigin(-left, -0.5 * (picture.height - 1) * spacing, 0.0);
    this->AddValues(image, picture, places);
    return image;
  }

  vtkSmartPointer<vtkStructuredGrid> Grid(const GreyPicture& picture, const Places& places) const
  {
    auto grid = vtkSmartPointer<vtkStructuredGrid>::New();
    grid->SetDimensions(picture.width, picture.height, 1);
    grid->SetPoints(PointsOf(Upwards(places.world, picture.width, picture.height)));
    this->AddValues(grid, picture, places);
    return grid;
  }

  void AddValues(vtkDataSet* data, const GreyPicture& picture, const Places& places) const
  {
    vtkCoronary::AddArray<vtkFloatArray>(
      data->GetPointData(), this->array, Upwards(picture.values, picture.width, picture.height));
    data->GetPointData()->SetActiveScalars(this->array.c_str());
    AddPlaces(data, Upwards(places.world, picture.width, picture.height),
      Upwards(places.arc, picture.width, picture.height));
  }

  /// To the left of the axis' course on the sheet.
  void AddBeside(std::size_t n, double distance, Drawing& drawing) const
  {
    const coronary::PicturePlace at = this->reformat.Beside(n, distance);
    drawing.Add(
      { at[0], at[1], 0.0 }, this->reformat.WorldOf(at), double(n) * this->reformat.axis.step);
  }

  const Vector3& UpAt(std::size_t n) const
  {
    const auto column =
      static_cast<std::size_t>(std::lround(this->reformat.track[n][0] / this->reformat.spacing));
    return this->reformat.up[std::min(column, this->reformat.up.size() - 1)];
  }

  double OuterBeside(std::size_t n, double side) const
  {
    const Vector3& up = this->UpAt(n);
    const coronary::FramedCurve& axis = this->reformat.axis;
    const double degrees =
      std::atan2(side * up.dot(axis.binormal[n]), side * up.dot(axis.normal[n])) * 180.0 / M_PI;
    return this->boundaries.At(this->boundaries.outer, n, degrees);
  }

  Drawing AxisLine() const
  {
    Drawing line;
    line.BeginLine();
    for (std::size_t n = 0; n < this->reformat.track.size(); ++n)
    {
      line.Add({ this->reformat.track[n][0], this->reformat.track[n][1], 0.0 },
        this->reformat.axis.position[n], double(n) * this->reformat.axis.step);
    }
    return line;
  }

  /// Around the section; open where it is not seen.
  Drawing Ring(Rings kind) const
  {
    constexpr int Sides = 96;
    Drawing ring;
    ring.BeginLine();
    const coronary::FramedCurve& axis = this->reformat.axis;
    for (int side = 0; side <= Sides; ++side)
    {
      const double degrees = 360.0 * side / Sides;
      const double away = kind == Rings::Lumen
        ? this->radius[this->place]
        : this->boundaries.At(kind == Rings::Edge ? this->boundaries.lumen : this->boundaries.outer,
            this->place, degrees);
      if (std::isnan(away))
      {
        ring.BeginLine();
        continue;
      }
      const double turn = degrees * M_PI / 180.0;
      const Vector3 world = axis.position[this->place] +
        away *
          (std::cos(turn) * axis.normal[this->place] + std::sin(turn) * axis.binormal[this->place]);
      const Vector3 from = world - axis.position[this->place];
      ring.Add({ from.dot(this->plane.right), -from.dot(this->plane.down), 0.0 }, world,
        double(this->place) * axis.step);
    }
    return ring;
  }
};

vtkCurvedReformat::vtkCurvedReformat()
{
  this->SetNumberOfInputPorts(2);
  this->SetNumberOfOutputPorts(3);
}

int vtkCurvedReformat::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), port == 0 ? "vtkImageData" : "vtkPolyData");
  return 1;
}

int vtkCurvedReformat::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  return 1;
}

int vtkCurvedReformat::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, 2, outputs);
  vtkInformation* image = inputs[0]->GetInformationObject(0);
  if (image->Has(SDDP::WHOLE_EXTENT()))
  {
    int whole[6];
    image->Get(SDDP::WHOLE_EXTENT(), whole);
    image->Set(SDDP::UPDATE_EXTENT(), whole, 6);
  }
  return 1;
}

int vtkCurvedReformat::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  vtkPolyData* lines = vtkPolyData::GetData(inputs[1]);
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  if (outputs->GetInformationObject(port)->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0 ||
    lines->GetNumberOfLines() == 0)
  {
    return 1;
  }
  try
  {
    using vtkCoronary::Require;
    Require(image != nullptr && image->GetNumberOfPoints() > 0, "The image has no voxels");
    vtkDataArray* values = vtkCoronary::VoxelArrayOf(image, this->ImageArrayName, "the image");
    std::vector<float> copy;
    const coronary::ImageInterpolator interpolator(vtkCoronary::ScalarImageOf(image, values, copy));
    const coronary::VesselTree tree = vtkCoronary::TreeOf(lines);
    std::vector<std::string> branches;
    for (const coronary::VesselTree::Branch& branch : tree.branches)
    {
      branches.push_back(branch.name);
    }
    const coronary::VesselChain vessel = coronary::FindVessel(tree, branches, this->Vessel);
    std::vector<Vector3> axis;
    std::vector<double> radius;
    bool inside = false;
    for (const std::int64_t point : vessel.points)
    {
      axis.push_back(tree.points[point]);
      radius.push_back(tree.radius[point]);
      inside = inside || interpolator.Contains(axis.back());
    }
    Require(inside, "The vessel lies outside of the image");
    Require(std::isfinite(this->Position), "Position must be finite");
    Require(Vector3(this->Point).allFinite(), "Point must be finite");

    Writer writer;
    writer.array = values->GetName() != nullptr ? values->GetName() : names::HounsfieldUnits;
    coronary::ReformatSettings settings;
    settings.kind = static_cast<coronary::ReformatKind>(this->Kind);
    settings.angle = this->Angle;
    settings.halfWidth = this->HalfWidth;
    settings.spacing = this->Spacing;
    settings.smoothing = this->Smoothing;
    writer.reformat = coronary::ReformatVessel(
      interpolator, axis, settings, vtkCoronary::ProgressOf(this, 0.0, 0.5));
    const coronary::FramedCurve& curve = writer.reformat.axis;
    writer.radius = curve.Interpolated(radius);
    coronary::BoundarySettings boundaries;
    boundaries.outerLevel = this->OuterLevel;
    writer.boundaries = coronary::TraceBoundaries(
      interpolator, curve, writer.radius, boundaries, vtkCoronary::ProgressOf(this, 0.5, 0.95));
    writer.place = this->FollowPoint
      ? NearestPlace(curve.position, Vector3(this->Point))
      : static_cast<std::size_t>(std::clamp(
          std::round(this->Position / curve.step), 0.0, double(curve.position.size() - 1)));
    // The section's upper side is the straightened sheet's.
    const double turned = this->Kind == Straightened ? this->Angle : 0.0;
    writer.plane =
      coronary::SectionPlane(curve, writer.place, turned, this->HalfWidth, this->Spacing);
    writer.section = coronary::ProjectSlab(interpolator, writer.plane, {}, 0.0);

    vtkMultiBlockDataSet* out[] = { vtkMultiBlockDataSet::GetData(outputs, ReformatPort),
      vtkMultiBlockDataSet::GetData(outputs, SectionPort),
      vtkMultiBlockDataSet::GetData(outputs, InPlacePort) };
    writer.WriteReformat(out[ReformatPort]);
    writer.WriteSection(out[SectionPort]);
    writer.WriteInPlace(out[InPlacePort]);
    std::vector<vtkStdString> pieces;
    for (const coronary::VesselPiece& piece : vessel.pieces)
    {
      pieces.emplace_back(piece.name);
    }
    vtkCoronary::AddArray<vtkStringArray>(
      out[ReformatPort]->GetFieldData(), names::VesselPieces, pieces);
    vtkCoronary::AddArray<vtkDoubleArray>(out[ReformatPort]->GetFieldData(), names::VesselLength,
      std::vector<double>{ vessel.Length() });
    this->UpdateProgress(1.0);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(
      this, outputs, "for the reformat", { "ReformatSettings: ", "BoundarySettings: " });
  }
}

void vtkCurvedReformat::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Vessel: " << this->Vessel << "\n";
  os << indent << "Kind: " << this->Kind << "\n";
  os << indent << "Angle: " << this->Angle << "\n";
  os << indent << "Position: " << this->Position << "\n";
  os << indent << "FollowPoint: " << this->FollowPoint << "\n";
  os << indent << "Point: " << this->Point[0] << " " << this->Point[1] << " " << this->Point[2]
     << "\n";
  os << indent << "HalfWidth: " << this->HalfWidth << "\n";
  os << indent << "Spacing: " << this->Spacing << "\n";
  os << indent << "OuterLevel: " << this->OuterLevel << "\n";
  os << indent << "Smoothing: " << this->Smoothing << "\n";
  os << indent << "ImageArrayName: " << this->ImageArrayName << "\n";
}
