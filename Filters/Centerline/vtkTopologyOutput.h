/**
 * @file vtkTopologyOutput.h
 * @brief Ordered trees as poly data: what all filters that make trees give.
 */
#ifndef vtkTopologyOutput_h
#define vtkTopologyOutput_h

#include "CenterlineTopology.h"
#include "SegmentLabeling.h"
#include "TreeCheck.h"

#include <vector>

class vtkPolyData;

namespace vtkCoronary
{
/// The outputs, out of the algorithm's result. Both must outlive it.
class TopologyOutput
{
public:
  /// @param input           whose point arrays go on by the tree's `source`, and whose field data do
  /// @param murrayExponent  of the tree's bifurcations
  TopologyOutput(
    vtkPolyData* input, const coronary::CenterlineTopology& tree, double murrayExponent);

  void WriteTree(vtkPolyData* output) const;
  void WriteBifurcations(vtkPolyData* output) const;
  void WriteLoops(vtkPolyData* output) const;
  /// What checks say of the tree, and which of its branches the input's `VeinProbability` doubts.
  std::vector<coronary::TreeWarning> Warnings(const coronary::LabelingResult& labels) const;
  void WriteWarnings(vtkPolyData* output, const std::vector<coronary::TreeWarning>& warnings) const;
  /// @param labels  null: no names were looked for
  void WriteFieldData(vtkPolyData* output, const coronary::LabelingResult* labels) const;

private:
  vtkPolyData* Input;
  const coronary::CenterlineTopology& Tree;
  double MurrayExponent;
};
}

#endif
