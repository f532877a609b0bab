/**
 * @file TubeImage.h
 * @brief A blurred tube of contrast in fat, for filters: its image as VTK data, and its centerline as a tree.
 */
#ifndef DynamicCoronary_Testing_TubeImage_h
#define DynamicCoronary_Testing_TubeImage_h

#include "BlurredDisc.h"
#include "CoronaryAnatomy.h"
#include "VesselTree.h"
#include "vtkVesselTree.h"

#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkShortArray.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace coronary
{
/// A tube along z with its axis through (0, 0), in fat.
struct TubeImage
{
  static constexpr double Lumen = 400.0; // HU
  static constexpr double Fat = -80.0;   // HU
  static constexpr double Blur = 0.4;    // mm
  static constexpr double Length = 60.0; // mm

  /// @param radius  mm, of the distance along the tube
  static void Render(const std::function<double(double)>& radius, vtkImageData* image)
  {
    constexpr double Spacing = 0.4;
    constexpr int Half = 18;
    const auto slices = static_cast<int>(Length / Spacing) + 21;
    image->SetDimensions(2 * Half + 1, 2 * Half + 1, slices);
    image->SetSpacing(Spacing, Spacing, Spacing);
    image->SetOrigin(-Half * Spacing, -Half * Spacing, -10 * Spacing);
    vtkNew<vtkShortArray> values;
    values->SetName("HU");
    values->SetNumberOfTuples(image->GetNumberOfPoints());
    for (vtkIdType n = 0; n < image->GetNumberOfPoints(); ++n)
    {
      double p[3];
      image->GetPoint(n, p);
      const double share =
        BlurredDisc(std::hypot(p[0], p[1]) / Blur, radius(std::clamp(p[2], 0.0, Length)) / Blur);
      values->SetValue(n, static_cast<short>(std::lround(Fat + share * (Lumen - Fat))));
    }
    image->GetPointData()->SetScalars(values);
  }

  /// One LAD along it, points 0.25 mm apart, with `ImageBlur`. @param radius  mm, everywhere
  static void Centerline(double radius, vtkPolyData* lines)
  {
    VesselTree tree;
    VesselTree::Branch branch;
    branch.segmentId = MidLAD;
    for (double z = 0.0; z <= Length; z += 0.25)
    {
      branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
      tree.points.emplace_back(0.0, 0.0, z);
      tree.radius.push_back(radius);
    }
    tree.branches.push_back(branch);
    MeasureTree(tree);
    vtkCoronary::SetTree(lines, tree, vtkCoronary::BranchArrays::Named);
    vtkNew<vtkDoubleArray> blur;
    blur->SetName("ImageBlur");
    blur->InsertNextValue(Blur);
    lines->GetFieldData()->AddArray(blur);
  }
};
}

#endif
