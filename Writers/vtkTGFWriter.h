/**
 * @class vtkTGFWriter
 * @brief Writes a skeleton in Trivial Graph Format (.tgf), as libigl and Blender read it.
 *
 * @par Input:
 * vtkPolyData, one of
 * - a skeleton, at rest or posed, as of vtkCenterlineSkeleton: lines of two points, with the point array
 *   `ParentJoint` or without any ids of centerlines. Joint n of the file is point n; bones stand in the
 *   order of the cell array `BoneId`, so that the place in the file is the id.
 * - a tree of centerlines (cell arrays `GroupIds`, `ParentGroupIds`), or VMTK's branches
 *   (`CenterlineIds`, `TractIds`, `GroupIds`). Every point becomes a joint, every step from point to
 *   point a bone.
 *
 * @par Files:
 * Parents stand first in their bones. Positions are written with all their digits and come back bit by
 * bit; radii, other ids and names have no place in the format.
 *
 * The file appears under its name when it is whole; an older one stays until then.
 *
 * @par Time:
 * The time that the pipeline is at is written.
 *
 * @par Failure:
 * Without a file name, without lines, for lines that are no tree (a loop), or when the file can not be
 * written: one error that names it, Write() returns 0.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1)
 * tree = ReferencePhase(Input=phantom["Centerlines"], Automatic=0, Time=0.75)
 * skeleton = CenterlineSkeleton(Centerlines=tree)
 * SaveData("bones.tgf", proxy=skeleton)
 * print(open("bones.tgf").readline())
 * @endcode
 *
 * @sa vtkTGFReader, coronary::WriteTgf
 */
#ifndef vtkTGFWriter_h
#define vtkTGFWriter_h

#include "vtkCoronaryWritersModule.h" // for the export macro
#include "vtkWriter.h"

class vtkPolyData;

class VTKCORONARYWRITERS_EXPORT vtkTGFWriter : public vtkWriter
{
public:
  static vtkTGFWriter* New();
  vtkTypeMacro(vtkTGFWriter, vtkWriter);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /// The file. Default: none.
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  ///@{
  /// How far apart the ends of VMTK's tracts may lie to be one joint, mm, 0 or more. Default 1e-6.
  vtkSetMacro(Tolerance, double);
  vtkGetMacro(Tolerance, double);
  ///@}

  /// @return 1, or 0 when the file was not written
  int Write() override;

protected:
  vtkTGFWriter() = default;
  ~vtkTGFWriter() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  void WriteData() override;

private:
  vtkTGFWriter(const vtkTGFWriter&) = delete;
  void operator=(const vtkTGFWriter&) = delete;

  char* FileName = nullptr;
  double Tolerance = 1e-6;
  bool Written = false;
};

#endif
