// .stl and .ply files, and what damaged ones may not do.
#include "FormatTestFiles.h"
#include "MeshFile.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <cstring>
#include <stdexcept>

namespace UnitTestStlPly
{
using namespace coronary;
using formattest::TemporaryFolder;

namespace
{
std::string Floats(const std::vector<float>& values, bool bigEndian = false)
{
  std::string bytes;
  for (const float value : values)
  {
    std::string one(4, '\0');
    std::memcpy(&one[0], &value, 4);
    bytes += bigEndian ? std::string(one.rbegin(), one.rend()) : one;
  }
  return bytes;
}

std::string BinaryStl(std::uint8_t claimed)
{
  std::string bytes(80, ' ');
  bytes += std::string{ static_cast<char>(claimed), 0, 0, 0 };
  bytes += Floats({ 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0 }) + std::string(2, '\0');
  bytes += Floats({ 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, -0.0F }) + std::string(2, '\0');
  bytes += Floats({ 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 0 }) + std::string(2, '\0');
  return bytes;
}

std::string PlyHead(const std::string& form, const std::string& points = "3")
{
  return "ply\nformat " + form + " 1.0\ncomment made by hand\nelement vertex " + points +
    "\nproperty uchar red\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
}

class StlPly : public testing::Test
{
protected:
  FileMesh Read(const std::string& name, const std::string& bytes)
  {
    const std::string path = this->Folder / name;
    formattest::WriteText(path, bytes);
    return name.back() == 'l' ? ReadStlFile(path) : ReadPlyFile(path);
  }

  void Refuse(const std::string& name, const std::string& bytes, const std::string& part)
  {
    ExpectError([&] { this->Read(name, bytes); }, name, part);
  }

  const TemporaryFolder Folder;
};
}

TEST_F(StlPly, EqualCornersBecomeOnePoint)
{
  for (const FileMesh& mesh : { this->Read("a.stl", BinaryStl(3)),
         this->Read("b.stl",
           "solid a b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
           "endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\n"
           "vertex 0 1 -0.0\nendloop\nendfacet\nendsolid a b\n") })
  {
    EXPECT_EQ(mesh.points.size(), 4U);
    ASSERT_EQ(mesh.triangles.size(), 2U) << "the third triangle of the binary file has no area";
    EXPECT_EQ(mesh.triangles[1], (Triangle{ 1, 3, 2 }));
    EXPECT_EQ(mesh.points[3], Vector3(1, 1, 0));
  }
}

TEST_F(StlPly, BinaryThatBeginsAsText)
{
  std::string bytes = BinaryStl(3);
  bytes.replace(0, 5, "solid");
  EXPECT_EQ(this->Read("a.stl", bytes).triangles.size(), 2U);
}

TEST_F(StlPly, DamagedStlIsRefused)
{
  this->Refuse("a.stl", "", "shorter");
  this->Refuse("a.stl", std::string(80, '\0') + "\xff\xff\xff\xff" + std::string(50, '\0'),
    "4294967295 triangles, and has room for 1");
  this->Refuse("a.stl", BinaryStl(3).substr(0, 200), "room for 2");
  this->Refuse("a.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "endsolid");
  this->Refuse("a.stl", "solid x\nfacet\nvertex 0 0 nan\n", "not finite");
  this->Refuse("a.stl", "solid x\nfacet\nvertex 0 0 0\nendfacet\nendsolid\n", "1 corners");
}

TEST_F(StlPly, PlyInEveryForm)
{
  const std::string corners("\3\0\0\0\0\1\0\0\0\2\0\0\0", 13);
  const std::string reversed("\3\0\0\0\0\0\0\0\1\0\0\0\2", 13);
  const auto point = [](float x, float y, bool big) { return "\7" + Floats({ x, y, 0.5F }, big); };
  const auto points = [&](bool big)
  { return point(0, 0, big) + point(1, 0, big) + point(0, 1, big); };
  for (const FileMesh& mesh :
    { this->Read("a.ply", PlyHead("ascii") + "7 0 0 0.5\n7 1 0 0.5\n7 0 1 0.5\n3 0 1 2\n"),
      this->Read("b.ply", PlyHead("binary_little_endian") + points(false) + corners),
      this->Read("c.ply", PlyHead("binary_big_endian") + points(true) + reversed) })
  {
    ASSERT_EQ(mesh.points.size(), 3U);
    EXPECT_EQ(mesh.points[2], Vector3(0, 1, 0.5));
    ASSERT_EQ(mesh.triangles.size(), 1U);
    EXPECT_EQ(mesh.triangles[0], (Triangle{ 0, 1, 2 }));
  }
  EXPECT_EQ(
    this->Read("a.ply", PlyHead("ascii", "4") + "7 0 0 0\n7 1 0 0\n7 1 1 0\n7 0 1 0\n4 0 1 2 3\n")
      .triangles.size(),
    2U);
}

TEST_F(StlPly, DamagedPlyIsRefused)
{
  this->Refuse("a.ply", "", "begin with 'ply'");
  this->Refuse("a.ply", PlyHead("ascii", "1000000000") + "7 0 0 0\n", "1000000000 elements");
  this->Refuse("a.ply", PlyHead("ascii", "-5"), "-5 elements");
  this->Refuse("a.ply", PlyHead("ascii") + "7 0 0 0\n7 1 0 0\n7 0 1 0\n3 0 1 3\n", "corner");
  this->Refuse("a.ply", PlyHead("ascii") + "7 0 0 0\n7 1 0 0\n7 0 1 0\n3 0 1 -1\n", "corner");
  this->Refuse("a.ply", PlyHead("ascii") + "7 0 0 inf\n7 1 0 0\n7 0 1 0\n3 0 1 2\n", "not finite");
  this->Refuse(
    "a.ply", PlyHead("binary_little_endian") + std::string(39, '\0') + "\xff", "ends before");
  this->Refuse("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\n", "type");
  this->Refuse("a.ply",
    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", "without 'y'");
}
}
