// VTK's XML files of every appended form become readable; damaged ones are left to VTK's reader.
#include "CounterRandom.h"
#include "FilterMessages.h"
#include "Refusals.h"
#include "XmlDataFile.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkXMLPolyDataReader.h"
#include "vtkXMLPolyDataWriter.h"

#include <gtest/gtest.h>

#include <string>

namespace TestXmlDataFile
{
using coronary::ReadableXmlData;

namespace
{
/// Lines with arrays of several types; so many that the compressed forms have more than one block.
vtkSmartPointer<vtkPolyData> Lines()
{
  auto data = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkDoubleArray> radius;
  vtkNew<vtkStringArray> names;
  vtkNew<vtkIntArray> none;
  radius->SetName("Radius");
  names->SetName("Label");
  none->SetName("None");
  for (int i = 0; i < 5000; ++i)
  {
    points->InsertNextPoint(0.1 * i, i % 7, -i);
    radius->InsertNextValue(1.0 / (1 + i));
    if (i % 10 == 9)
    {
      lines->InsertNextCell(10);
      for (vtkIdType k = i - 9; k <= i; ++k)
      {
        lines->InsertCellPoint(k);
      }
      names->InsertNextValue("branch <" + std::to_string(i) + "_>");
    }
  }
  data->SetPoints(points);
  data->SetLines(lines);
  data->GetPointData()->AddArray(radius);
  data->GetCellData()->AddArray(names);
  data->GetFieldData()->AddArray(none);
  return data;
}

std::string Written(vtkPolyData* data, bool encoded, bool compressed, bool wide, bool bigEndian)
{
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(data);
  writer->SetDataModeToAppended();
  writer->SetEncodeAppendedData(encoded);
  if (!compressed)
  {
    writer->SetCompressorTypeToNone();
  }
  if (wide)
  {
    writer->SetHeaderTypeToUInt64();
  }
  else
  {
    writer->SetHeaderTypeToUInt32();
  }
  if (bigEndian)
  {
    writer->SetByteOrderToBigEndian();
  }
  else
  {
    writer->SetByteOrderToLittleEndian();
  }
  writer->WriteToOutputStringOn();
  writer->Write();
  return writer->GetOutputString();
}
}

TEST(XmlDataFile, EveryFormIsReadAsItWas)
{
  vtkSmartPointer<vtkPolyData> data = Lines();
  for (int form = 0; form < 16; ++form)
  {
    SCOPED_TRACE(form);
    const std::string text =
      Written(data, (form & 1) != 0, (form & 2) != 0, (form & 4) != 0, (form & 8) != 0);
    ASSERT_NE(text.find("<AppendedData"), std::string::npos);
    const std::string inlined = ReadableXmlData(text, "x.vtp");
    EXPECT_EQ(inlined.find("AppendedData"), std::string::npos);
    vtkNew<vtkXMLPolyDataReader> reader;
    reader->ReadFromInputStringOn();
    reader->SetInputString(inlined);
    Messages messages(reader);
    reader->Update();
    EXPECT_TRUE(messages.Errors.empty()) << messages.Errors.front();
    vtkPolyData* read = reader->GetOutput();
    ASSERT_EQ(read->GetNumberOfPoints(), data->GetNumberOfPoints());
    ASSERT_EQ(read->GetNumberOfLines(), data->GetNumberOfLines());
    auto* radius = vtkDoubleArray::SafeDownCast(read->GetPointData()->GetArray("Radius"));
    auto* names = vtkStringArray::SafeDownCast(read->GetCellData()->GetAbstractArray("Label"));
    ASSERT_TRUE(radius && names);
    ASSERT_TRUE(read->GetFieldData()->HasArray("None"));
    for (vtkIdType i = 0; i < read->GetNumberOfPoints(); ++i)
    {
      ASSERT_EQ(radius->GetValue(i), 1.0 / static_cast<double>(1 + i));
      ASSERT_EQ(read->GetPoint(i)[2], static_cast<double>(-i));
    }
    for (vtkIdType i = 0; i < read->GetNumberOfLines(); ++i)
    {
      ASSERT_EQ(names->GetValue(i), "branch <" + std::to_string(10 * i + 9) + "_>");
    }
  }
}

TEST(XmlDataFile, OtherTextsStayAsTheyAre)
{
  for (const char* text :
    { "<AppendedData encoding=\"raw\">_</AppendedData>", "<VTKFile type=\"PolyData\"></VTKFile>",
      "<VTKFile><AppendedData>_",
      "<VTKFile><DataArray format=\"appended\"/><AppendedData>_x</AppendedData></VTKFile>",
      "<VTKFile><DataArray format=\"appended\" offset=\"99999999999999999999999\"/>"
      "<AppendedData encoding=\"raw\">_x</AppendedData></VTKFile>",
      "<VTKFile compressor=\"z\"><DataArray format=\"appended\" offset=\"0\"/>"
      "<AppendedData encoding=\"raw\">_\xff\xff\xff\xff\xff\xff\xff\xff</AppendedData></VTKFile>" })
  {
    EXPECT_EQ(ReadableXmlData(text, "x.vtp"), text);
  }
  // Arrays that all lie in the same bytes: a file of a megabyte would become gigabytes.
  std::string many = "<VTKFile>";
  for (int n = 0; n < 100; ++n)
  {
    many += "<DataArray format=\"appended\" offset=\"0\"/>";
  }
  many +=
    "<AppendedData encoding=\"base64\">_" + std::string(20000, 'A') + "</AppendedData></VTKFile>";
  EXPECT_EQ(ReadableXmlData(many, "x.vtp"), many);
}

TEST(XmlDataFile, RefusesWhatNoSoundFileHas)
{
  const auto refuse = [](const std::string& text, const std::string& part)
  { ExpectError([&] { ReadableXmlData(text, "x.vtp"); }, "x.vtp", part); };
  const auto piece = [](const std::string& counts, const std::string& arrays = "")
  { return "<VTKFile>\n<Piece " + counts + ">" + arrays + "</Piece></VTKFile>"; };
  EXPECT_NO_THROW(ReadableXmlData(piece("NumberOfPoints=' 3 '"), "x.vtp"));
  refuse("", "line 1: is no XML");
  refuse("no XML", "line 1: is no XML");
  refuse("<VTKFile>\n<AppendedData", "line 2: is no XML");
  refuse("<VTKFile>\n\n<Piece>", "line 3: ends inside the element 'Piece'");
  refuse("<!DOCTYPE x [<!ENTITY a \"aa\"><!ENTITY b \"&a;&a;\">]><VTKFile>&b;</VTKFile>",
    "a document type or entities");
  for (const char* count : { "-1", "0.5", "", "x", "nan", "1\n2" })
  {
    refuse(piece("NumberOfPoints='" + std::string(count) + "'"), "line 2: ");
  }
  refuse(piece("NumberOfPoints='1000'"), "line 2: says more than it can hold: 1000 NumberOfPoints");
  refuse(piece("NumberOfPolys='50' NumberOfLines='50'"), "100 cells");
  refuse(piece("NumberOfPoints='50'",
           "<PointData><DataArray NumberOfComponents='5' format='ascii'/></PointData>"),
    "250 values in an array");
  EXPECT_NO_THROW(ReadableXmlData(
    "<VTKFile compressor='z'>\n<Piece NumberOfPoints='1000'></Piece></VTKFile>", "x.vtp"));
  std::string deep = "<VTKFile>";
  for (int n = 0; n < 40; ++n)
  {
    deep += "\n<a>";
  }
  refuse(deep, "line 33: has more than 32 elements in each other");
}

TEST(XmlDataFile, DamagedTextsDoNoHarm)
{
  vtkSmartPointer<vtkPolyData> data = Lines();
  coronary::RandomStream random(5);
  for (int form = 0; form < 4; ++form)
  {
    const std::string text = Written(data, (form & 1) != 0, (form & 2) != 0, false, false);
    const std::size_t head = std::min(text.size(), text.find("<AppendedData") + 200);
    for (int run = 0; run < 300; ++run)
    {
      std::string damaged = text;
      for (int k = 0; k < 4; ++k)
      {
        damaged[static_cast<std::size_t>(random.Uniform() * static_cast<double>(head))] =
          static_cast<char>(random.Uniform() * 256.0);
      }
      if (run % 3 == 0)
      {
        damaged.resize(
          static_cast<std::size_t>(random.Uniform() * static_cast<double>(text.size())));
      }
      try
      {
        EXPECT_LT(ReadableXmlData(damaged, "x.vtp").size(), 5 * text.size());
      }
      catch (const std::runtime_error& error)
      {
        EXPECT_EQ(std::string(error.what()).rfind("'x.vtp': line ", 0), 0U) << error.what();
      }
    }
  }
}
}
