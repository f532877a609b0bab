/**
 * @file VesselTestData.h
 * @brief A small result of `coronary-pipeline run`: a square bar around a chain of bones that bends to and fro.
 */
#ifndef DynamicCoronary_VesselTestData_h
#define DynamicCoronary_VesselTestData_h

#include "AtomicFile.h"
#include "FileSeries.h"
#include "SequenceTestData.h"

#include "vtkXMLPolyDataWriter.h"
#include "vtkXMLUnstructuredGridWriter.h"
#include "vtkXMLWriter.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

inline void Save(vtkXMLWriter* writer, vtkDataObject* data, const std::filesystem::path& path)
{
  writer->SetInputDataObject(data);
  writer->SetFileName(path.c_str());
  writer->SetDataModeToBinary();
  ASSERT_EQ(writer->Write(), 1);
}

/// One branch along the chain's axis.
inline vtkSmartPointer<vtkPolyData> ChainTree(int bones)
{
  auto tree = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkDoubleArray> radius;
  radius->SetName("MaximumInscribedSphereRadius");
  lines->InsertNextCell(5 * bones + 1);
  for (vtkIdType n = 0; n <= 5 * bones; ++n)
  {
    lines->InsertCellPoint(points->InsertNextPoint(0.0, 0.0, static_cast<double>(n)));
    radius->InsertNextValue(1.5);
  }
  const auto number = [&](const char* name, int value)
  {
    vtkNew<vtkIntArray> array;
    array->SetName(name);
    array->InsertNextValue(value);
    tree->GetCellData()->AddArray(array);
  };
  tree->SetPoints(points);
  tree->SetLines(lines);
  tree->GetPointData()->AddArray(radius);
  number("GroupIds", 7);
  number("ParentGroupIds", -1);
  vtkNew<vtkStringArray> label;
  label->SetName("SegmentLabel");
  label->InsertNextValue("pRCA");
  tree->GetCellData()->AddArray(label);
  return tree;
}

/// Where a joint is.
inline std::array<double, 3> ChainJoint(int joint, double time)
{
  return BendingChain::Bent(5.0 * joint, 0.2 * std::sin(2.0 * vtkMath::Pi() * time));
}

/// Makes the folder; poses at five moments.
inline void SaveChainRun(const std::filesystem::path& folder, int bones)
{
  std::filesystem::create_directories(folder / "motion");
  const auto volume = ChainVolume(bones);
  Save(vtkNew<vtkXMLUnstructuredGridWriter>(), volume, folder / "weights.vtu");
  Save(
    vtkNew<vtkXMLPolyDataWriter>(), ChainBoundary(volume, bones), folder / "volume_boundary.vtp");
  Save(vtkNew<vtkXMLPolyDataWriter>(), ChainSkeleton(bones), folder / "skeleton.vtp");
  Save(vtkNew<vtkXMLPolyDataWriter>(), ChainTree(bones), folder / "centerline.vtp");
  std::vector<coronary::TimedFile> files;
  for (int k = 0; k < 5; ++k)
  {
    const double time = 0.2 * k;
    auto pose = ChainSkeleton(bones);
    for (int j = 0; j <= bones; ++j)
    {
      pose->GetPoints()->SetPoint(j, ChainJoint(j, time).data());
    }
    vtkNew<vtkDoubleArray> cycle;
    cycle->SetName("CycleLength");
    cycle->InsertNextValue(0.96);
    pose->GetFieldData()->AddArray(cycle);
    const std::string name = "skeleton_0" + std::to_string(k) + ".vtp";
    Save(vtkNew<vtkXMLPolyDataWriter>(), pose, folder / "motion" / name);
    files.push_back({ name, time });
  }
  coronary::WriteFileAtomically(
    (folder / "motion/skeleton.vtp.series").string(), coronary::FileSeriesText(files));
}

#endif
