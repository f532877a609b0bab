/**
 * @class vtkTGFReader
 * @brief Reads a skeleton in Trivial Graph Format (.tgf, libigl and Blender) as centerlines and as bones.
 *
 * @par Output ports:
 * vtkPolyData, both with a point for each joint, in the order of the file (joints without bones are
 * points without a line). A root is a joint at which bones only begin; where bones go both ways, the
 * first joint that is an end. Point data `MaximumInscribedSphereRadius` (double, mm): `Radius`
 * everywhere, as the format has none; `Abscissas` (double, mm from the root).
 * - 0, the tree: a polyline for each way between roots, forks and ends. Cell data `GroupIds`,
 *   `ParentGroupIds`, `TreeIds` (int), `Length` (double, mm), `Tortuosity` (double)
 * - 1, the skeleton: a line of two points for each bone, in the order of the file, as of
 *   vtkCenterlineSkeleton. Point data `ParentJoint` (vtkIdType, -1 at a root); cell data `BoneId` (int,
 *   the place in the file, from 0), `GroupIds`, `TreeIds` (int, those of the tree), `Length` (double, mm)
 *
 * The outputs are whole in piece 0 and empty in every other piece.
 *
 * @par Time:
 * The file has no time, nor has the output.
 *
 * @par Failure:
 * A file that can not be opened, a line that can not be read, a bone without its joints, a loop: one
 * error that names the file and the line, joint or bone, and no output.
 *
 * @par Python:
 * @code{.py}
 * skeleton = TGFSkeletonReader(FileName="tree.tgf", Radius=1.5)
 * skeleton.UpdatePipeline()
 * print(skeleton["Tree"].GetDataInformation().GetNumberOfCells(), "vessels")
 * @endcode
 *
 * @sa vtkTGFWriter, coronary::ReadTgf
 */
#ifndef vtkTGFReader_h
#define vtkTGFReader_h

#include "vtkCoronaryReadersModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

class VTKCORONARYREADERS_EXPORT vtkTGFReader : public vtkPolyDataAlgorithm
{
public:
  static vtkTGFReader* New();
  vtkTypeMacro(vtkTGFReader, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /// The file. Default: none.
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  ///@{
  /// Radius that all points get, mm, 0 or more. Default 1.
  vtkSetMacro(Radius, double);
  vtkGetMacro(Radius, double);
  ///@}

  enum OutputPorts
  {
    TreePort = 0,
    SkeletonPort = 1
  };

protected:
  vtkTGFReader();
  ~vtkTGFReader() override;

  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkTGFReader(const vtkTGFReader&) = delete;
  void operator=(const vtkTGFReader&) = delete;

  char* FileName = nullptr;
  double Radius = 1.0;
};

#endif
