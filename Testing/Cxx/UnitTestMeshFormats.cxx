// .dmat, .obj, .off and .mesh: what libigl and others write, round trips, damage.

#include "FormatTestFiles.h"
#include "MatrixFile.h"
#include "MeshFile.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace UnitTestMeshFormats
{
using namespace coronary;
using namespace formattest;

namespace
{
FileMesh Tetrahedron()
{
  FileMesh mesh;
  mesh.points = { { 0.1, -1e-300, 1.0 / 3.0 }, { 1e20, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };
  mesh.triangles = { { 0, 2, 1 }, { 0, 1, 3 }, { 1, 2, 3 }, { 0, 3, 2 } };
  return mesh;
}
}

TEST(MatrixFile, ReadsWhatLibiglWrites)
{
  const TemporaryFolder folder;
  // writeDMAT: columns and rows, then column by column with 17 digits.
  WriteText(folder / "w.dmat", "3 2\n0.10000000000000001\n2\n-3e-05\n4\nnan\n-inf\n");
  const Eigen::MatrixXd text = ReadMatrixFile(folder / "w.dmat");
  ASSERT_EQ(text.rows(), 2);
  ASSERT_EQ(text.cols(), 3);
  EXPECT_EQ(text(0, 0), 0.1);
  EXPECT_EQ(text(1, 0), 2.0);
  EXPECT_EQ(text(0, 1), -3e-5);
  EXPECT_TRUE(std::isnan(text(0, 2)));
  EXPECT_TRUE(std::isinf(text(1, 2)));
  // Binary: an empty head, the head, doubles. A value may look like an end of line.
  Bytes values(6 * sizeof(double));
  const double numbers[6] = { 1.5, 2.5, 3.5, 4.5, 5.5, 6.5 };
  std::memcpy(values.data(), numbers, sizeof(numbers));
  values[0] = '\n';
  WriteBytes(folder / "b.dmat", Concatenated("0 0\n2 3\n", values));
  const Eigen::MatrixXd binary = ReadMatrixFile(folder / "b.dmat");
  ASSERT_EQ(binary.rows(), 3);
  ASSERT_EQ(binary.cols(), 2);
  EXPECT_EQ(binary(1, 0), 2.5);
  EXPECT_EQ(binary(2, 1), 6.5);
  WriteText(folder / "e.dmat", "0 0\n");
  EXPECT_EQ(ReadMatrixFile(folder / "e.dmat").size(), 0);
}

TEST(MatrixFile, RoundTripsBitByBit)
{
  const TemporaryFolder folder;
  Eigen::MatrixXd matrix(7, 5);
  for (Eigen::Index n = 0; n < matrix.size(); ++n)
  {
    matrix.data()[n] =
      std::sin(static_cast<double>(n)) * std::pow(10.0, static_cast<double>(n % 60 - 30));
  }
  matrix(3, 3) = std::numeric_limits<double>::denorm_min();
  matrix(4, 3) = -0.0;
  for (const bool binary : { false, true })
  {
    for (const auto& [rows, columns] :
      { std::pair(7, 5), std::pair(1, 5), std::pair(7, 0), std::pair(0, 0) })
    {
      const Eigen::MatrixXd part = matrix.topLeftCorner(rows, columns);
      WriteMatrixFile(folder / "m.dmat", part, binary);
      const Eigen::MatrixXd back = ReadMatrixFile(folder / "m.dmat");
      ASSERT_EQ(back.rows(), part.rows());
      ASSERT_EQ(back.cols(), part.cols());
      EXPECT_EQ(
        part.size() == 0 ? 0 : std::memcmp(back.data(), part.data(), part.size() * sizeof(double)),
        0);
    }
  }
}

TEST(MatrixFile, RefusesWithTheFileAndTheReason)
{
  const TemporaryFolder folder;
  const auto refuse = [&](const std::string& text, const std::string& part)
  {
    WriteText(folder / "bad.dmat", text);
    ExpectError([&] { ReadMatrixFile(folder / "bad.dmat"); }, "bad.dmat", part);
  };
  refuse("", "ends too early");
  refuse("2 x\n", "line 1: 'x' is no integer");
  refuse("2 -1\n", "no number of rows");
  refuse("2 2\n1\n2\n", "too short");
  refuse("2 2\n1\n2\n3e-7\n", "ends too early");
  refuse("2 2\n1\n2\n3\n4\n5\n", "more values");
  refuse("2 2\n1\n2\nthree\n4\n", "line 4: 'three' is no number");
  refuse("1000000 1000000\n1\n", "too short");
  refuse("999999999999 999999999999\n1\n", "too short");
  refuse("0 0\n2 2\n1234567", "too short");
  refuse("0 0\n1 1\n123456789", "9 bytes");
  refuse("0 0\n1 1 12345678", "do not end with the line");
  ExpectError([&] { ReadMatrixFile(folder / "none.dmat"); }, "none.dmat", "No such file");
  ExpectError([&]
    { WriteMatrixFile((folder / "bad.dmat") + "/w.dmat", Eigen::MatrixXd::Zero(1, 1)); },
    "w.dmat", "Cannot write");
}

TEST(MeshFile, RoundTripsBitByBit)
{
  const TemporaryFolder folder;
  for (const std::string name : { "t.obj", "t.off", "t.mesh" })
  {
    FileMesh mesh = Tetrahedron();
    if (name == "t.mesh")
    {
      mesh.tetrahedra = { { 0, 1, 2, 3 } };
    }
    WriteMeshFile(folder / name, mesh);
    const FileMesh back = ReadMeshFile(folder / name);
    EXPECT_EQ(back.points, mesh.points) << name;
    EXPECT_EQ(back.triangles, mesh.triangles) << name;
    EXPECT_EQ(back.tetrahedra, mesh.tetrahedra) << name;
    WriteMeshFile(folder / name, {});
    EXPECT_TRUE(ReadMeshFile(folder / name).points.empty()) << name;
  }
}

TEST(MeshFile, ReadsObjOfOthers)
{
  const TemporaryFolder folder;
  WriteText(folder / "a.obj",
    "# a comment\r\nmtllib a.mtl\nv 0 0 0 1.0\nv 1 0 0\nv 1 1 0 0.5 0.5 0.5\nvt 0 0\nvn 0 0 1\n"
    "v 0 1 0\ng wall\nusemtl red\nf 1/1/1 2//1 3/1 \\\n 4\nf -4 -3 -2\nl 1 2\ns off\n\nv 2 2 2");
  const FileMesh mesh = ReadMeshFile(folder / "a.obj");
  EXPECT_EQ(mesh.points.size(), 5U);
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{ { 0, 1, 2 }, { 0, 2, 3 }, { 0, 1, 2 } }));
}

TEST(MeshFile, ReadsOffOfOthers)
{
  const TemporaryFolder folder;
  WriteText(folder / "a.off",
    "COFF # with colours\n\n# counts\n4 2 0\n0 0 0 255 0 0 255\n1 0 0 0 0 0 1\n1 1 0 1 1 1 1\n0 1 "
    "0 "
    "0 0 0 0\n4 0 1 2 3 0.5 0.5 0.5\n3 0 1 2\n");
  const FileMesh mesh = ReadMeshFile(folder / "a.off");
  EXPECT_EQ(mesh.points[2], Vector3(1, 1, 0));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{ { 0, 1, 2 }, { 0, 2, 3 }, { 0, 1, 2 } }));
}

TEST(MeshFile, ReadsMeshOfOthers)
{
  const TemporaryFolder folder;
  WriteText(folder / "a.mesh",
    "MeshVersionFormatted 1\n# TetGen\nDimension\n3\n\nVertices\n5\n0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 "
    "1 "
    "1\n1 1 1 7\nEdges 1\n1 2 0\nTriangles\n1\n1 3 2 5\nQuadrilaterals 1\n1 2 3 4 "
    "0\nCorners\n2\n1\n2\n"
    "Tetrahedra\n2\n1 2 3 4 3\n2 3 4 5 0\nEnd\nwhatever");
  const FileMesh mesh = ReadMeshFile(folder / "a.mesh");
  EXPECT_EQ(mesh.points.size(), 5U);
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{ { 0, 2, 1 }, { 0, 1, 2 }, { 0, 2, 3 } }));
  ASSERT_EQ(mesh.tetrahedra.size(), 2U);
  EXPECT_EQ(mesh.tetrahedra[1], (std::array<std::int64_t, 4>{ 1, 2, 3, 4 }));
}

TEST(MeshFile, RefusesWithTheFileAndTheLine)
{
  const TemporaryFolder folder;
  const auto refuse = [&](const std::string& name, const std::string& text, const std::string& part)
  {
    WriteText(folder / name, text);
    ExpectError([&] { ReadMeshFile(folder / name); }, name, part);
  };
  refuse("a.obj", "v 0 0 0\nv 1 nan 0\n", "line 2: a coordinate is not finite");
  refuse("a.obj", "v 0 0 0\nf 1 2 3\n", "line 2: a corner is point 1");
  refuse("a.obj", "v 0 0 0\nf 1 0 1\n", "line 2");
  refuse("a.obj", "v 0 0 0\nf -2 1 1\n", "a corner is point -1");
  refuse("a.obj", "v 0 0 0\nf 1 1\n", "fewer than three");
  refuse("a.obj", "v 0 0\n", "ends too early");
  refuse("a.off", "ply\n", "does not begin with OFF");
  refuse("a.off", "OFF BINARY\n", "binary");
  refuse("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "line 6: a corner is point 3");
  refuse("a.off", "OFF\n1000000000000 1 0\n", "too short");
  refuse("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n", "ends too early");
  refuse("a.mesh", "Dimension 3\n", "MeshVersionFormatted");
  refuse("a.mesh", "MeshVersionFormatted 2\nDimension 2\n", "line 2: the mesh is not of three");
  refuse("a.mesh", "MeshVersionFormatted 2\nTetrahedra 0\n", "come before the vertices");
  refuse("a.mesh", "MeshVersionFormatted 2\nVertices 1\n0 0 0 0\nTriangles 1\n1 0 1 0\n",
    "line 5: a corner is point -1");
  refuse("a.mesh", "MeshVersionFormatted 2\nBlobs 3\n", "line 2: a part of the mesh is not known");
  ExpectError([&] { ReadMeshFile(folder / "none.off"); }, "none.off", "No such file");
  ExpectError([&] { ReadMeshFile(folder / "a.stl"); }, "a.stl", "is no .obj");
  FileMesh mesh = Tetrahedron();
  mesh.tetrahedra = { { 0, 1, 2, 3 } };
  ExpectError([&] { WriteMeshFile(folder / "t.obj", mesh); }, "t.obj", "only .mesh");
  mesh.tetrahedra[0][2] = 4;
  ExpectError([&] { WriteMeshFile(folder / "t.mesh", mesh); }, "t.mesh", "tetrahedron 0");
  mesh.points[1].x() = std::numeric_limits<double>::infinity();
  ExpectError([&] { WriteMeshFile(folder / "t.off", mesh); }, "t.off", "point 1");
  EXPECT_FALSE(std::filesystem::exists(folder / "t.off"));
}

TEST(Fuzz, DamagedMeshesAndMatricesNeverCrash)
{
  const TemporaryFolder folder;
  std::map<std::string, Bytes> files;
  for (const std::string name : { "a.obj", "a.off", "a.mesh" })
  {
    FileMesh mesh = Tetrahedron();
    if (name == "a.mesh")
    {
      mesh.tetrahedra = { { 0, 1, 2, 3 } };
    }
    WriteMeshFile(folder / name, mesh);
    files[name] = ReadBytes(folder / name);
  }
  const Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(4, 3) / 3.0;
  WriteMatrixFile(folder / "t.dmat", matrix);
  files["t.dmat"] = ReadBytes(folder / "t.dmat");
  WriteMatrixFile(folder / "b.dmat", matrix, true);
  files["b.dmat"] = ReadBytes(folder / "b.dmat");

  std::uint64_t state = 4711;
  const auto random = [&state](std::size_t limit)
  {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::size_t>(state >> 33) % limit;
  };
  int refused = 0;
  int count = 0;
  for (const auto& [name, good] : files)
  {
    for (int round = 0; round < 200; ++round)
    {
      Bytes bytes = good;
      for (std::size_t changes = 1 + random(4); changes > 0 && !bytes.empty(); --changes)
      {
        const std::size_t at = random(bytes.size());
        switch (random(5))
        {
          case 0:
            bytes[at] = static_cast<unsigned char>(random(256));
            break;
          case 1:
            bytes[at] = static_cast<unsigned char>("0123456789-.eE\n \t#/"[random(19)]);
            break;
          case 2:
            bytes.resize(at);
            break;
          case 3:
            bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), 1 + random(20), '9');
            break;
          default:
            bytes[at] ^= static_cast<unsigned char>(1u << random(8));
            break;
        }
      }
      WriteBytes(folder / name, bytes);
      ++count;
      try
      {
        if (name.find(".dmat") != std::string::npos)
        {
          EXPECT_LE(ReadMatrixFile(folder / name).size(), static_cast<Eigen::Index>(bytes.size()));
        }
        else
        {
          const FileMesh mesh = ReadMeshFile(folder / name);
          for (const Triangle& triangle : mesh.triangles)
          {
            for (const std::int64_t corner : triangle)
            {
              EXPECT_TRUE(corner >= 0 && corner < static_cast<std::int64_t>(mesh.points.size()));
            }
          }
        }
      }
      catch (const std::runtime_error& error)
      {
        ++refused;
        EXPECT_NE(std::string(error.what()).find(name), std::string::npos);
      }
    }
  }
  EXPECT_GT(refused, count / 5);
  EXPECT_LT(refused, count);
}
}
