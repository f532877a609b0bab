// VTK's XML files of every appended form become readable; damaged ones are left to VTK's reader.
#include "AppendedXmlData.h"
#include "CounterRandom.h"
#include "FilterMessages.h"

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

using coronary::WithInlineXmlData;

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

TEST(AppendedXmlData, EveryFormIsReadAsItWas)
{
  vtkSmartPointer<vtkPolyData> data = Lines();
  for (int form = 0; form < 16; ++form)
  {
    SCOPED_TRACE(form);
    const std::string text =
      Written(data, (form & 1) != 0, (form & 2) != 0, (form & 4) != 0, (form & 8) != 0);
    ASSERT_NE(text.find("<AppendedData"), std::string::npos);
    const std::string inlined = WithInlineXmlData(text);
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

TEST(AppendedXmlData, OtherTextsStayAsTheyAre)
{
  for (const char* text :
    { "", "no XML", "<AppendedData encoding=\"raw\">_</AppendedData>",
      "<VTKFile type=\"PolyData\"></VTKFile>", "<VTKFile><AppendedData", "<VTKFile><AppendedData>_",
      "<VTKFile><DataArray format=\"appended\"/><AppendedData>_x</AppendedData></VTKFile>",
      "<VTKFile><DataArray format=\"appended\" offset=\"99999999999999999999999\"/>"
      "<AppendedData encoding=\"raw\">_x</AppendedData></VTKFile>",
      "<VTKFile compressor=\"z\"><DataArray format=\"appended\" offset=\"0\"/>"
      "<AppendedData encoding=\"raw\">_\xff\xff\xff\xff\xff\xff\xff\xff</AppendedData></VTKFile>" })
  {
    EXPECT_EQ(WithInlineXmlData(text), text);
  }
  // Arrays that all lie in the same bytes: a file of a megabyte would become gigabytes.
  std::string many = "<VTKFile>";
  for (int n = 0; n < 100; ++n)
  {
    many += "<DataArray format=\"appended\" offset=\"0\"/>";
  }
  many +=
    "<AppendedData encoding=\"base64\">_" + std::string(20000, 'A') + "</AppendedData></VTKFile>";
  EXPECT_EQ(WithInlineXmlData(many), many);
}

TEST(AppendedXmlData, DamagedTextsDoNoHarm)
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
      EXPECT_NO_THROW(WithInlineXmlData(damaged));
    }
  }
}
