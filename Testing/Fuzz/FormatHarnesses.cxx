// Files of images, meshes, matrices, skeletons and lists of files.
#include "FuzzHarness.h"

#include "ByteStream.h"
#include "DicomFile.h"
#include "DicomStructure.h"
#include "EvaluationRecord.h"
#include "FileSeries.h"
#include "FormatTestFiles.h"
#include "GatedSeries.h"
#include "MarkupsFile.h"
#include "MatrixFile.h"
#include "MeshFile.h"
#include "MeshSequenceReport.h"
#include "MesherMessage.h"
#include "MetaImageWriter.h"
#include "MovingModel.h"
#include "SegmentationFile.h"
#include "SeriesDescription.h"
#include "SimVascularFile.h"
#include "SkinWeightCache.h"
#include "TgfSkeleton.h"
#include "VolumeFile.h"
#include "XmlDataFile.h"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <sstream>

using namespace coronary;

namespace fuzzing
{
namespace
{
constexpr std::size_t MostVoxels = 1
  << 20; ///< more are not read: that takes long, and tells nothing new

std::string Text(const formattest::Bytes& bytes)
{
  return { bytes.begin(), bytes.end() };
}

/// All voxels of all phases.
void ReadVoxels(VolumeSource& source)
{
  const VolumeInfo& info = source.Info();
  const std::array<int, 6>& e = info.grid.extent;
  double count = 1.0;
  for (int axis = 0; axis < 3; ++axis)
  {
    Require(e[2 * axis] == 0 && e[2 * axis + 1] >= 0, "an extent that is none");
    Require(std::isfinite(info.grid.origin[axis]) && info.grid.spacing[axis] > 0.0,
      "a grid that is none");
    count *= e[2 * axis + 1] + 1.0;
  }
  Require(info.phases >= 1, "no phases");
  if (count * info.phases > static_cast<double>(MostVoxels))
  {
    return;
  }
  std::vector<float> values(static_cast<std::size_t>(count));
  for (int phase = 0; phase < info.phases; ++phase)
  {
    source.Read(phase, e, values.data());
  }
}

void ReadVolume(const std::string& name, const std::string& bytes)
{
  ReadVoxels(*OpenVolumeFile(FileWith(name, bytes)));
}

// MetaImage -----------------------------------------------------------------------------------------------------------
void ReadMetaImage(const std::string& bytes)
{
  ReadVolume("image.mha", bytes);
}

std::vector<std::string> MetaImageSeeds()
{
  const std::string head = "ObjectType = Image\nNDims = 3\nBinaryData = True\n"
                           "BinaryDataByteOrderMSB = False\nOffset = 1 2 3\n"
                           "TransformMatrix = 1 0 0 0 1 0 0 0 1\nElementSpacing = 0.5 0.5 1\n"
                           "DimSize = 4 3 2\nElementType = MET_SHORT\nElementDataFile = LOCAL\n";
  const std::string series = "ObjectType = Image\nNDims = 4\nBinaryData = True\n"
                             "ElementByteOrderMSB = True\nCompressedData = False\n"
                             "ElementSpacing = 1 1 1 0.1\nDimSize = 4 3 2 2\n"
                             "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n";
  const std::string packed =
    "NDims = 3\nCompressedData = True\nCompressedDataSize = 20\nDimSize = 4 3 2\n"
    "ElementSpacing = 1 1 1\nElementType = MET_SHORT\nElementDataFile = LOCAL\n";
  const formattest::Bytes voxels = formattest::Voxels({ 4, 3, 2 });
  return { head + Text(voxels), series + std::string(192, '\1'),
    packed + Text(formattest::Gzip(voxels)) };
}

// NRRD ----------------------------------------------------------------------------------------------------------------
void ReadNrrd(const std::string& bytes)
{
  ReadVolume("image.nrrd", bytes);
}

std::vector<std::string> NrrdSeeds()
{
  const std::string space =
    "space: left-posterior-superior\n"
    "space directions: (0.5,0,0) (0,0.5,0) (0,0,1)\nspace origin: (1,2,3)\n";
  const std::string start = "NRRD0004\n# comment\ntype: short\nendian: little\n";
  const formattest::Bytes voxels = formattest::Voxels({ 4, 3, 2 });
  return {
    start + "encoding: raw\ndimension: 3\nsizes: 4 3 2\n" + space + "\n" + Text(voxels),
    start + "encoding: gzip\ndimension: 3\nsizes: 4 3 2\nkinds: domain domain domain\n" + space +
      "\n" + Text(formattest::Gzip(voxels)),
    start +
      "encoding: raw\ndimension: 4\nsizes: 4 3 2 2\nkinds: domain domain domain list\n"
      "space: RAS\nspace directions: (0.5,0,0) (0,0.5,0) (0,0,1) none\n"
      "space units: \"mm\" \"mm\" \"mm\"\nMultiVolume.FrameLabels:=0,50\n\n" +
      Text(formattest::Voxels({ 4, 3, 2 }, 2)),
    start +
      "encoding: raw\ndimension: 4\nsizes: 2 4 3 2\nkinds: list domain domain domain\n"
      "space: RAS\nspace directions: none (0.5,0,0) (0,0.5,0) (0,0,1)\n\n" +
      Text(formattest::VoxelsPhasesFirst({ 4, 3, 2 }, 2)),
  };
}

/// The header apart from its voxels, which are in a file that is there.
void ReadNrrdHeader(const std::string& bytes)
{
  FileWith("image.raw", Text(formattest::Voxels({ 4, 3, 2 })));
  ReadVolume("image.nhdr", bytes);
}

std::vector<std::string> NrrdHeaderSeeds()
{
  const std::string start =
    "NRRD0005\ntype: short\nendian: big\nencoding: raw\ndimension: 3\nsizes: 4 3 2\n"
    "spacings: 1 1 2\n";
  return { start + "data file: image.raw\n", start + "byte skip: -1\ndatafile: image.raw\n",
    start + "data file: LIST\nimage.raw\nimage.raw\n", start + "data file: image%01d.raw 0 1 1\n" };
}

// NIfTI ---------------------------------------------------------------------------------------------------------------
void ReadNifti(const std::string& bytes)
{
  ReadVolume("image.nii", bytes);
}

std::vector<std::string> NiftiSeeds()
{
  formattest::NiftiOptions plain;
  plain.sform = 1;
  formattest::NiftiOptions series;
  series.phases = 2;
  series.bigEndian = true;
  series.qform = 1;
  series.pixdim = { -1, 1, 1, 2, 0.5, 0, 0, 0 };
  series.quaternion = { 0.1, 0.2, 0.3, 1, 2, 3 };
  series.slope = 2.0;
  formattest::NiftiOptions second;
  second.version2 = true;
  second.sform = 1;
  return { Text(formattest::Nifti(plain)), Text(formattest::Nifti(series)),
    Text(formattest::Nifti(second)) };
}

void ReadPackedNifti(const std::string& bytes)
{
  ReadVolume("image.nii.gz", bytes);
}

std::vector<std::string> PackedNiftiSeeds()
{
  formattest::NiftiOptions plain;
  plain.sform = 1;
  return { Text(formattest::Gzip(formattest::Nifti(plain))) };
}

// Compressed bytes ------------------------------------------------------------------------------------------------------
void ReadCompressed(const std::string& bytes)
{
  ByteStream stream(FileWith("stream", bytes), 0, true);
  std::array<char, 1000> some{};
  std::size_t got = some.size();
  for (std::uint64_t at = 0; got == some.size() && at < MostVoxels; at += got)
  {
    got = stream.ReadSome(at, some.data(), some.size());
    Require(got <= some.size(), "more bytes than there is room for");
  }
  stream.ReadSome(3, some.data(), some.size());
}

std::vector<std::string> CompressedSeeds()
{
  const formattest::Bytes few = formattest::Gzip(formattest::Bytes(100, 'a'));
  const formattest::Bytes many = formattest::Gzip(formattest::Voxels({ 40, 30, 2 }));
  return { Text(few), Text(many), Text(few) + Text(many) };
}

// DICOM ---------------------------------------------------------------------------------------------------------------
void ReadDicomSlice(const std::string& bytes)
{
  const std::string path = FileWith("dicom/slice.dcm", bytes);
  const DicomStructure structure = ReadDicomStructure(path);
  Require(structure.pixelOffset + structure.pixelBytes <= bytes.size(), "pixels behind the file");
  Require(structure.header.size() <= bytes.size(), "more header than file");
  // GDCM's decoders of compressed pixels abort the process for some damage: they are not ours.
  if (structure.encapsulated || ReadDicomHeader(path).encapsulated)
  {
    return;
  }
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const GatedSeries series({ folder });
  for (int phase = 0; phase < series.NumberOfPhases(); ++phase)
  {
    ReadVoxels(series.Source(phase));
  }
}

std::vector<std::string> DicomSeeds()
{
  const formattest::TemporaryFolder folder;
  formattest::WriteDicom(folder / "slice.dcm", {});
  formattest::WriteDicom(folder / "packed.dcm", {});
  formattest::CompressDicom(folder / "packed.dcm", true);
  formattest::WriteEnhancedDicom(folder / "enhanced.dcm", 2, 2);
  return { Contents(folder / "slice.dcm"), Contents(folder / "packed.dcm"),
    Contents(folder / "enhanced.dcm") };
}

// Lists of files ------------------------------------------------------------------------------------------------------
void ReadDescription(const std::string& bytes)
{
  const std::string path = FileWith("series.json", bytes);
  const SeriesDescription description = ReadSeriesDescription(path);
  Require(!description.phases.empty(), "no phases");
  WriteSeriesDescription(FileWith("again.json", ""), description);
}

std::vector<std::string> DescriptionSeeds()
{
  return { R"({"cycle_ms":1000,"phases":[{"fraction":-0.05,"image":"phase_00.mha",)"
           R"("truth":{"surface":"truth/surface_00.vtp","centerline":"truth/centerline_00.vtp"}},)"
           R"({"fraction":0.5,"image":"phase_01.mha"}],)"
           R"("seeds":[{"name":"LCA","position":[12.5,-30.0,41.0]}]})",
    R"({"phases":[{"fraction":NaN,"image":"\u00e9\n"}]})" };
}

void ReadFileList(const std::string& bytes)
{
  double last = -HUGE_VAL;
  for (const TimedFile& file : ReadFileSeries(FileWith("list.pvd", bytes)))
  {
    Require(file.time > last, "times that do not increase");
    Require(!file.path.empty(), "a file without a name");
    last = file.time;
  }
}

std::vector<std::string> FileListSeeds()
{
  const std::vector<TimedFile> files = { { "a.vtp", 0.0 }, { "b & c.vtp", 0.25 } };
  return { PvdText(files), FileSeriesText(files),
    R"(<?xml version="1.0"?><!-- x --><VTKFile type="Collection"><Collection>)"
    R"(<DataSet timestep='1' part='0' file='a&#x41;&lt;.vtp'/></Collection></VTKFile>)" };
}

void ReadRunFolder(const std::string& bytes)
{
  const std::string path = FileWith("run/report.json", bytes);
  FileWith("run/motion.pvd", PvdText({ { "surface.vtp", 0.0 } }));
  FileWith("run/surface.vtp", "");
  FindMovingModel(std::filesystem::path(path).parent_path().string());
}

std::vector<std::string> RunFolderSeeds()
{
  return {
    R"({"motion":{"tracked_times":[0,0.5],"tracked_share":[1,0.9]},"stages":[{"name":"motion"}]})"
  };
}

void ReadSequenceReport(const std::string& bytes)
{
  for (const std::string& name : MeshSequenceFiles(FileWith("heart.json", bytes)))
  {
    Require(name == "heart.json" || name.rfind("heart_", 0) == 0 || name.find("..") != 0,
      "a file that is not of the report");
  }
}

std::vector<std::string> SequenceReportSeeds()
{
  MeshSequenceReport report;
  report.points = 4;
  report.prefix = "heart";
  report.faces = { { 1, "wall", 2 } };
  report.phases.resize(1);
  report.phases[0].files = { { "surface", "heart_surface_00.vtp" }, { "simvascular", "heart_sv" } };
  report.files = { { "surface", "heart_surface.pvd" } };
  return { MeshSequenceJson(report) };
}

// Meshes and matrices ---------------------------------------------------------------------------------------------------
void CheckMesh(const FileMesh& mesh)
{
  const auto count = static_cast<std::int64_t>(mesh.points.size());
  const auto check = [&](const auto& cells)
  {
    for (const auto& cell : cells)
    {
      for (const auto corner : cell)
      {
        Require(corner >= 0 && corner < count, "a corner that does not exist");
      }
    }
  };
  check(mesh.triangles);
  check(mesh.tetrahedra);
}

void ReadMesh(const std::string& name, const std::string& bytes)
{
  CheckMesh(ReadMeshFile(FileWith(name, bytes)));
}

void ReadStl(const std::string& bytes)
{
  CheckMesh(ReadStlFile(FileWith("mesh.stl", bytes)));
}

std::vector<std::string> StlSeeds()
{
  std::string binary(84 + 100, '\0');
  binary[80] = 2;
  for (std::size_t n = 0; n < 24; ++n)
  {
    const float value = static_cast<float>(n * n % 7);
    std::memcpy(&binary[84 + 4 * n + (n < 12 ? 0 : 2)], &value, 4);
  }
  return { binary,
    "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
    "1e-3\nendloop\n"
    "endfacet\nendsolid one\n" };
}

void ReadPly(const std::string& bytes)
{
  CheckMesh(ReadPlyFile(FileWith("mesh.ply", bytes)));
}

std::vector<std::string> PlySeeds()
{
  const auto head = [](const std::string& form)
  {
    return "ply\nformat " + form +
      " 1.0\ncomment x\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nelement edge 1\n"
      "property short a\nproperty list uint double b\nend_header\n";
  };
  std::string binary(39 + 13 + 6 + 8, '\0');
  binary[3] = 1;
  binary[39] = 3;
  binary[44] = 1;
  binary[48] = 2;
  binary[54] = 1;
  return { head("ascii") + "0 0 0 1\n1 0 0 2\n0 1 0 3\n3 0 1 2\n7 2 1.5 nan\n",
    head("binary_little_endian") + binary, head("binary_big_endian") + binary };
}

std::vector<std::string> MeshSeeds(
  const std::string& name, bool tetrahedra, const std::string& other)
{
  FileMesh mesh;
  mesh.points = { { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1e-3 } };
  mesh.triangles = { { 0, 1, 2 }, { 1, 2, 3 } };
  if (tetrahedra)
  {
    mesh.tetrahedra = { { 0, 1, 2, 3 } };
  }
  const std::string path = FileWith(name, "");
  WriteMeshFile(path, mesh);
  return { Contents(path), other };
}

void ReadObj(const std::string& bytes)
{
  ReadMesh("mesh.obj", bytes);
}

std::vector<std::string> ObjSeeds()
{
  return MeshSeeds("mesh.obj", false,
    "# x\nv 0 0 0\nv 1 0 0 0.5\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nf 1/1/1 2//1 -2/1 -1\n");
}

void ReadOff(const std::string& bytes)
{
  ReadMesh("mesh.off", bytes);
}

std::vector<std::string> OffSeeds()
{
  return MeshSeeds("mesh.off", false,
    "COFF\n# x\n3 1 0\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n0 1 0 1 1 1 1\n3 0 1 2 0.5\n");
}

void ReadMedit(const std::string& bytes)
{
  ReadMesh("mesh.mesh", bytes);
}

std::vector<std::string> MeditSeeds()
{
  return MeshSeeds("mesh.mesh", true,
    "MeshVersionFormatted 2\nDimension\n3\nVertices 4\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n"
    "Quadrilaterals 1\n1 2 3 4 0\nEdges 1\n1 2 0\nEnd\n");
}

void ReadMatrix(const std::string& bytes)
{
  const Eigen::MatrixXd matrix = ReadMatrixFile(FileWith("matrix.dmat", bytes));
  Require(static_cast<std::size_t>(matrix.size()) <= bytes.size(), "more values than bytes");
}

std::vector<std::string> MatrixSeeds()
{
  Eigen::MatrixXd matrix(2, 3);
  matrix << 1, -2.5, 1e-300, 0.1, HUGE_VAL, 7;
  const std::string path = FileWith("matrix.dmat", "");
  WriteMatrixFile(path, matrix);
  const std::string text = Contents(path);
  WriteMatrixFile(path, matrix, true);
  return { text, Contents(path) };
}

// Skeletons -------------------------------------------------------------------------------------------------------------
void ReadSkeleton(const std::string& bytes)
{
  std::istringstream stream(bytes);
  const TgfSkeleton skeleton = ReadTgf(stream);
  CheckTree(FromSkeleton(skeleton));
}

std::vector<std::string> SkeletonSeeds()
{
  return { "1 0 0 0\n2 1 0 0\n3 2 0 0\n4 2 1 0\n#\n1 2\n2 3\n2 4\n",
    "7 0 0 0\n3 1e3 0 -1e-9\n\n#\n7 3\n#\n1 0 0 0\n" };
}

/// Of a mesh of one tetrahedron and one bone.
const SkinWeightInput& OneTetrahedron()
{
  static const SkinWeightInput input{ { { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } },
    { { 0, 1, 2, 3 } }, { { 0, 0, 0 }, { 0, 0, 1 } }, { { 0, 1 } } };
  return input;
}

std::vector<std::string> WeightSeeds()
{
  SkinWeights weights;
  weights.offset = { 0, 1, 2, 3, 4 };
  weights.bone = { 0, 0, 0, 0 };
  weights.weight = { 1.0, 1.0, 1.0, 1.0 };
  weights.bones = 1;
  weights.lengthOutside = { 0.0 };
  const std::string path = FileWith("weights.bin", "");
  WriteSkinWeights(path, weights);
  return { Contents(path) };
}

void ReadWeights(const std::string& bytes)
{
  SkinWeights weights;
  ReadSkinWeights(FileWith("weights.bin", bytes), OneTetrahedron(), weights);
}

/// The same behind the checksum, which few damaged files pass.
void ReadSummedWeights(const std::string& bytes)
{
  ReadWeights(WithSkinWeightChecksum(bytes));
}

// Between the host and its meshers ----------------------------------------------------------------------------------------
/// With the checksum in place of the last bytes, as the meshers' messages end: FNV-1a over words, and bytes at the end.
std::string WithMesherChecksum(std::string bytes)
{
  if (bytes.size() < 8)
  {
    return bytes;
  }
  const std::size_t size = bytes.size() - 8;
  std::uint64_t sum = 0xcbf29ce484222325;
  for (std::size_t at = 0; at < size;)
  {
    const std::size_t width = at + 8 <= size ? 8 : 1;
    std::uint64_t word = 0;
    std::memcpy(&word, &bytes[at], width);
    sum = (sum ^ word) * 0x100000001b3;
    at += width;
  }
  std::memcpy(&bytes[size], &sum, 8);
  return bytes;
}

void ReadMesherMessages(const std::string& bytes)
{
  const bool request = !bytes.empty() && bytes.front() == 'q';
  const std::string message = WithMesherChecksum(bytes.substr(bytes.empty() ? 0 : 1));
  if (request)
  {
    DecodeMesherRequest(message);
  }
  else
  {
    DecodeMesherAnswer(message);
  }
}

std::vector<std::string> MesherSeeds()
{
  MesherRequest request;
  request.points = { 0, 0, 0, 1, 0, 0, 0, 1, 0 };
  request.sizes = { 1, 1, 1 };
  request.triangles = { 0, 1, 2 };
  MesherAnswer answer;
  answer.message = "done";
  answer.points = { 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  answer.tetrahedra = { 0, 1, 2, 3 };
  return { "q" + Encode(request), "a" + Encode(answer) };
}

// VTK's XML, before VTK reads it --------------------------------------------------------------------------------------------
void ReadXmlData(const std::string& bytes)
{
  Require(ReadableXmlData(bytes, "data.vtp").size() < 64 + 8 * bytes.size(),
    "text that grows without end");
}

std::vector<std::string> XmlDataSeeds()
{
  const std::string head =
    R"(<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt32">)"
    R"(<PolyData><Piece NumberOfPoints="1"><Points>)"
    R"(<DataArray type="Float32" NumberOfComponents="3" format="appended" offset="0"/>)"
    R"(</Points></Piece></PolyData>)";
  const std::string raw("\x0c\0\0\0abcdefghijkl", 16);
  const std::string packed = [&]
  {
    const std::string body = "aaaaaaaaaaaa";
    std::string bytes("\1\0\0\0\x0c\0\0\0\x0c\0\0\0\x14\0\0\0", 16);
    return bytes + body;
  }();
  const std::string tail = "</AppendedData></VTKFile>";
  return { head + "<AppendedData encoding=\"raw\">_" + raw + tail,
    head + "<AppendedData encoding=\"base64\">_DAAAAGFiY2RlZmdoaWprbA==" + tail,
    head.substr(0, 64) + R"( compressor="vtkZLibDataCompressor")" + head.substr(64) +
      "<AppendedData encoding=\"raw\">_" + packed + tail };
}

void CheckFinite(const std::vector<Vector3>& points)
{
  for (const Vector3& point : points)
  {
    Require(point.allFinite(), "a position that is no number");
  }
}

void ReadMarkups(const std::string& bytes)
{
  const std::vector<Markup> markups = ParseMarkups(bytes, "curves.mrk.json");
  for (const Markup& markup : markups)
  {
    for (const Markup::Point& point : markup.points)
    {
      Require(point.position.allFinite(), "a position that is no number");
    }
    for (const Markup::Measurement& measurement : markup.measurements)
    {
      Require(measurement.values.size() == markup.points.size(), "values that are no point's");
    }
  }
}

std::vector<std::string> MarkupsSeeds()
{
  Markup curve;
  curve.name = "LAD";
  curve.points.resize(2);
  curve.points[1].label = "second";
  curve.points[1].position = Vector3(1.0, 2.0, 3.0);
  curve.measurements = { { "Radius", "mm", { 1.5, 1.25 } } };
  return { MarkupsText({ curve }),
    R"({"markups":[{"type":"Fiducial","coordinateSystem":"RAS","coordinateUnits":"um",)"
    R"("controlPoints":[{"label":"a","position":[1,2,3]},{"positionStatus":"undefined"}]}]})" };
}

const std::string SegmentationHeader =
  "NRRD0004\ntype: unsigned char\ndimension: 4\nspace: left-posterior-superior\n"
  "sizes: 2 4 3 2\nspace directions: none (0.5,0,0) (0,0.5,0) (0,0,1)\n"
  "kinds: list domain domain domain\nencoding: raw\nspace origin: (10,-20,5)\n"
  "Segment0_ID:=Segment_1\nSegment0_Name:=Vessel\nSegment0_LabelValue:=1\n"
  "Segment0_Layer:=0\nSegment0_Extent:=0 3 0 2 0 1\n"
  "Segment1_ID:=Segment_2\nSegment1_Name:=Plaque\nSegment1_LabelValue:=2\n"
  "Segment1_Layer:=1\nSegment1_Extent:=1 1 1 1 0 0\n\n";

void ReadSegments(const std::string& bytes)
{
  for (const Segment& segment : ParseSegments(bytes, "mask.seg.nrrd"))
  {
    Require(segment.layer >= 0 && segment.value >= 0, "a segment without a layer or value");
  }
}

std::vector<std::string> SegmentsSeeds()
{
  return { SegmentationHeader };
}

/// The mask of all segments.
void ReadSegmentation(const std::string& bytes)
{
  const SegmentationFile file(FileWith("mask.seg.nrrd", bytes));
  double count = 1.0;
  for (int axis = 0; axis < 3; ++axis)
  {
    count *= file.Grid().extent[2 * axis + 1] + 1.0;
  }
  if (count * file.NumberOfLayers() > static_cast<double>(MostVoxels))
  {
    return;
  }
  const SegmentationMask mask = file.Mask({});
  Require(static_cast<double>(mask.voxels.size()) == count, "a mask of another size");
  Require(mask.count > 0, "a mask without voxels");
}

std::vector<std::string> SegmentationSeeds()
{
  std::string voxels(48, '\0');
  voxels[0] = 1;
  voxels[11] = 2;
  return { SegmentationHeader + voxels };
}

void ReadSimVascularPath(const std::string& bytes)
{
  const SimVascularPath path = ParseSimVascularPath(bytes, "path.pth");
  Require(!path.points.empty(), "a path without points");
  CheckFinite(path.controlPoints);
  for (const PathFrame& frame : path.points)
  {
    CheckFinite({ frame.position, frame.tangent, frame.rotation });
  }
}

std::vector<std::string> SimVascularPathSeeds()
{
  SimVascularPath path;
  path.controlPoints = { Vector3(0, 0, 0), Vector3(1, 0.5, 2) };
  path.points = { { 0, Vector3(0, 0, 0), Vector3::UnitZ(), Vector3::UnitX() },
    { 1, Vector3(1, 0.5, 2), Vector3::UnitZ(), Vector3::UnitX() } };
  return { SimVascularPathText(path) };
}

void ReadSimVascularContours(const std::string& bytes)
{
  const SimVascularContourGroup group = ParseSimVascularContours(bytes, "group.ctgr");
  for (const SimVascularContour& contour : group.contours)
  {
    CheckFinite(contour.controlPoints);
    CheckFinite(contour.contourPoints);
    Require(contour.Radius() >= 0.0, "a radius that is none");
  }
}

std::vector<std::string> SimVascularContourSeeds()
{
  SimVascularContour contour;
  contour.type = "Circle";
  contour.contourPoints = { Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(-1, -1, 0) };
  contour.controlPoints = { Vector3(0, 0, 0), Vector3(1, 0, 0) };
  SimVascularContourGroup group;
  group.pathName = "a <&> b";
  group.contours = { contour };
  return { SimVascularContourText(group) };
}

/// What is taken is written as it was read.
void ReadEvaluationRecord(const std::string& bytes)
{
  const std::string text = EvaluationRecord::Of(bytes).Text();
  Require(EvaluationRecord::Of(text).Text() == text, "a record that changes when it is written");
}

std::vector<std::string> EvaluationRecordSeeds()
{
  EvaluationRecord record;
  record.branches.resize(1);
  record.branches[0].label = "LAD";
  record.warnings = { "a mask without voxels" };
  return { EvaluationRecord().Text(), record.Text() };
}
}

std::vector<Harness> FormatHarnesses()
{
  return {
    { "metaimage", ReadMetaImage, MetaImageSeeds },
    { "nrrd", ReadNrrd, NrrdSeeds },
    { "nrrd-header", ReadNrrdHeader, NrrdHeaderSeeds },
    { "nifti", ReadNifti, NiftiSeeds },
    { "nifti-gz", ReadPackedNifti, PackedNiftiSeeds },
    { "gzip", ReadCompressed, CompressedSeeds },
    { "dicom", ReadDicomSlice, DicomSeeds },
    { "series-json", ReadDescription, DescriptionSeeds },
    { "file-series", ReadFileList, FileListSeeds },
    { "run-report", ReadRunFolder, RunFolderSeeds },
    { "sequence-report", ReadSequenceReport, SequenceReportSeeds },
    { "obj", ReadObj, ObjSeeds },
    { "off", ReadOff, OffSeeds },
    { "medit", ReadMedit, MeditSeeds },
    { "stl", ReadStl, StlSeeds },
    { "ply", ReadPly, PlySeeds },
    { "dmat", ReadMatrix, MatrixSeeds },
    { "tgf", ReadSkeleton, SkeletonSeeds },
    { "skin-weights", ReadWeights, WeightSeeds },
    { "skin-weights-summed", ReadSummedWeights, WeightSeeds },
    { "mesher-message", ReadMesherMessages, MesherSeeds },
    { "xml-data", ReadXmlData, XmlDataSeeds },
    { "markups", ReadMarkups, MarkupsSeeds },
    { "segments", ReadSegments, SegmentsSeeds },
    { "segmentation", ReadSegmentation, SegmentationSeeds },
    { "simvascular-path", ReadSimVascularPath, SimVascularPathSeeds },
    { "simvascular-contours", ReadSimVascularContours, SimVascularContourSeeds },
    { "evaluation-record", ReadEvaluationRecord, EvaluationRecordSeeds },
  };
}
}
