/**
 * @class   vtkVesselEdits
 * @brief   Corrects a named tree or a mask by a list of edits: branches added, cut, deleted, joined, renamed, moved.
 *
 * The edits are those of a file (edits.json of a run), then those of a list, then one that is made of properties, as it
 * is pointed at in a view. They are in mm and names, and are applied in their order to what was found; so the last one is
 * undone by taking it from the list. A branch is added along the cheapest way between its points in the image, by fast
 * marching, and put on the axis and measured as all others are.
 *
 * Of a tree the edits of the tree count, of a mask those of the mask (balls that are painted or erased). So one list
 * corrects both: the filter stands behind the mask, and once more behind vtkCoronaryTreeTopology.
 *
 * @par Input ports:
 * - 0: vtkPolyData, a named tree as of vtkCoronaryTreeTopology: cell data `GroupIds`, `ParentGroupIds`, point data
 *   `MaximumInscribedSphereRadius`; or vtkImageData, a mask whose active scalars are not 0 in vessels.
 * - 1, optional: vtkImageData in which vessels are drawn (HU, active scalars). Without it they are straight lines
 *   between the points, with a given radius.
 * - 2, optional: vtkImageData on the voxels of input 1, greatest on the axes of vessels (vesselness).
 *
 * @par Output ports:
 * - 0, as input 0: the tree ordered, measured and named as by vtkCoronaryTreeTopology, with all arrays of the input; what
 *   is not known of new points is 0. What is named stays named; a branch that was added without a name gets the one that
 *   the whole tree gives it, if that is free. Point data `EditNumber` (int, the last edit that made, moved or named the
 *   point, from 1; 0: as found); `Bridged` is 1 where a drawn vessel is not seen, `Confidence` is what the image shows.
 *   Or the mask (unsigned char, 0 or 1).
 * - 1, vtkPolyData: the bifurcations of the tree, as of vtkCoronaryTreeTopology; empty for a mask.
 *
 * Field data of output 0: `EditNotes` (string, what each edit did), `EditNumbers` (int, of these), `EditPlaces`
 * (double[3], mm), `EditLengths` (double, mm of vessel that came, went or changed), `EditSeen` (double, share of an added
 * vessel that the image shows).
 * Without an edit of its kind the input goes on as it is.
 *
 * The output is whole in piece 0 and empty in every other piece.
 *
 * @par Time:
 * Passes through from input 0: edits are in the coordinates of one phase. Put vtkReferencePhase before it.
 *
 * @par Failure:
 * A file that can not be read or is none, an edit that can not be applied (no vessel near its place, a name that the tree
 * has not, a ball outside the image): one error that names the edit and the place, and no output. An empty input gives an
 * empty output. An aborted execution leaves an empty output and is started anew by the next request.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1)
 * tree = ReferencePhase(Input=phantom["Centerlines"], Automatic=0, Time=0.75)
 * named = CoronaryTreeTopology(Input=tree)
 * edits = VesselEdits(Input=named, Edits=['{"edit": "rename", "name": "D1", "new_name": "D2"}'])
 * edits.Edit, edits.VesselName = "Delete", "OM1"
 * edits.UpdatePipeline()
 * print(edits.PointData["EditNumber"].GetRange()[1], "edits")
 * @endcode
 *
 * @sa coronary::EditTree, vtkCoronaryTreeTopology, docs/editing.md
 */
#ifndef vtkVesselEdits_h
#define vtkVesselEdits_h

#include "vtkCoronaryCenterlineModule.h" // for the export macro
#include "vtkPassInputTypeAlgorithm.h"

#include <array>  // for std::array
#include <string> // for std::string
#include <vector> // for std::vector

class vtkDataObject;
class vtkImageData;
class vtkPolyData;

namespace coronary
{
struct TreeEdit;
}

class VTKCORONARYCENTERLINE_EXPORT vtkVesselEdits : public vtkPassInputTypeAlgorithm
{
public:
  static vtkVesselEdits* New();
  vtkTypeMacro(vtkVesselEdits, vtkPassInputTypeAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum OutputPorts
  {
    EditedPort = 0,
    BifurcationPort = 1
  };

  enum EditKinds
  {
    NoEdit = -1,
    AddBranchEdit = 0,
    CutEdit = 1,
    DeleteEdit = 2,
    JoinEdit = 3,
    RenameEdit = 4,
    MoveEdit = 5,
    PaintEdit = 6,
    EraseEdit = 7
  };

  ///@{
  /**
   * Connections by name: the image (port 1), its vesselness (port 2).
   */
  void SetImageConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }
  void SetVesselnessConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(2, output); }
  ///@}

  ///@{
  /**
   * A file of edits, edits.json of a run. Default empty: none.
   */
  vtkSetStdStringFromCharMacro(FileName);
  vtkGetCharFromStdStringMacro(FileName);
  ///@}

  ///@{
  /**
   * Further edits, each as an entry of such a file: {"edit": "cut", "points": [[1, 2, 3]]}. Default none.
   */
  void AddEdit(const char* text);
  void RemoveAllEdits();
  int GetNumberOfEdits() { return static_cast<int>(this->Edits.size()); }
  const char* GetEdit(int index);
  ///@}

  ///@{
  /**
   * One more edit, that the next properties make: none, or what it does. Default none.
   */
  vtkSetClampMacro(Kind, int, NoEdit, EraseEdit);
  vtkGetMacro(Kind, int);
  ///@}

  ///@{
  /**
   * Its points, mm. Default none. An index that is not there is an error.
   */
  void SetPoint(int index, double x, double y, double z);
  void SetNumberOfPoints(int count);
  int GetNumberOfPoints() { return static_cast<int>(this->Points.size()); }
  ///@}

  ///@{
  /**
   * SCCT name of the vessel that it is about, or of a new one. Default empty.
   */
  vtkSetStdStringFromCharMacro(VesselName);
  vtkGetCharFromStdStringMacro(VesselName);
  ///@}

  ///@{
  /**
   * The name that a renamed vessel gets. Default empty: none.
   */
  vtkSetStdStringFromCharMacro(NewName);
  vtkGetCharFromStdStringMacro(NewName);
  ///@}

  ///@{
  /**
   * Radius of a ball; of a new vessel where the image shows none, mm, 0 to 50. Default 0: it has to show one.
   */
  vtkSetMacro(Radius, double);
  vtkGetMacro(Radius, double);
  ///@}

  ///@{
  /**
   * How much of the tree goes with a point that is moved, mm along it, 0 to 200. Default 0: 10 mm, and twice the way.
   */
  vtkSetMacro(Reach, double);
  vtkGetMacro(Reach, double);
  ///@}

  /// All edits together as the text of a file. Empty when one of them is none: Update() says why.
  const char* GetEditsText();

  /// The edit of the properties alone, as an entry of a file; empty: there is none, or it is none.
  const char* GetCurrentEdit();

  vtkPolyData* GetBifurcations();

protected:
  vtkVesselEdits();
  ~vtkVesselEdits() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;
  int RequestDataObject(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkVesselEdits(const vtkVesselEdits&) = delete;
  void operator=(const vtkVesselEdits&) = delete;

  /// Keeps a text that is made; empty when it can not be.
  template <typename Make>
  const char* Kept(const Make& make);
  /// @throws std::runtime_error, std::invalid_argument
  std::vector<coronary::TreeEdit> AllEdits() const;
  coronary::TreeEdit CurrentEdit() const;
  void EditPolyData(vtkPolyData* input, vtkInformationVector** inputs,
    const std::vector<coronary::TreeEdit>& edits, vtkPolyData* output, vtkPolyData* bifurcations);
  void EditImage(
    vtkImageData* input, const std::vector<coronary::TreeEdit>& edits, vtkImageData* output);

  std::string FileName;
  std::vector<std::string> Edits;
  int Kind = NoEdit;
  std::vector<std::array<double, 3>> Points;
  std::string VesselName;
  std::string NewName;
  double Radius = 0.0;
  double Reach = 0.0;
  std::string Text; ///< that was asked for last
};

#endif
