/**
 * @class vtkGatedImageReader
 * @brief Reads a gated image series as a time-dependent image in Hounsfield units.
 *
 * What it reads:
 * - a folder of DICOM files, sorted by series, slice position and time;
 * - a list of volumes, one a phase: .mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .vti;
 * - one 4-D NIfTI, NRRD or MetaImage file;
 * - a JSON file that lists images, R-R fractions, cycle length and seed points.
 *
 * World coordinates are LPS millimetres; the orientation is the image's direction matrix.
 *
 * Headers are read once, in RequestInformation, and again only when a file or a property changed.
 * One volume is in memory at a time: the one that is the output.
 *
 * @par Output ports:
 * - 0, vtkImageData: the phase. Point data `HU` (short or float, Hounsfield units; the scalars): short
 *   when the stored values are integers of at most 16 bits with an integral rescale (DICOM slope and
 *   intercept, NIfTI scl_slope, ...) and lie within short; float otherwise. The type announced before
 *   reading assumes that 16-bit values fit. Field data `CycleLength` (double, s) and `PhaseTime`
 *   (double, fraction of the R-R interval).
 * - 1, vtkPolyData: the seed points of a JSON file as vertices. Point data `Name` (string). Empty
 *   without seeds.
 *
 * @par Time:
 * Pipeline time is the fraction of the R-R interval. TIME_STEPS are the fractions of the phases,
 * strictly increasing; a requested time is answered with the nearest phase (the earlier one of two at
 * the same distance), also outside the range. Without a requested time the first phase is read.
 *
 * @par Failure:
 * Wrong or damaged input gives one error that names the file or property, and no output.
 *
 * @par Python:
 * @code{.py}
 * series = GatedImageReader(FileNames=["series.json"])
 * print(list(series.TimestepValues), series.UsedCycleLength)
 * series.UpdatePipeline(series.TimestepValues[-1])
 * print(series["Image"].PointData["HU"].GetRange())
 * @endcode
 *
 * @sa docs/readers.md
 */
#ifndef vtkGatedImageReader_h
#define vtkGatedImageReader_h

#include "vtkCoronaryReadersModule.h" // for the export macro

#include "vtkImageAlgorithm.h"

#include <memory> // for the hidden state
#include <string> // for the summary

class vtkImageData;
class vtkPolyData;

class VTKCORONARYREADERS_EXPORT vtkGatedImageReader : public vtkImageAlgorithm
{
public:
  static vtkGatedImageReader* New();
  vtkTypeMacro(vtkGatedImageReader, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The files, in the order of the phases; a folder of DICOM files (searched recursively), a JSON file or
   * a 4-D file stands alone. AddFileName ignores null and empty names. Default: none.
   */
  void AddFileName(const char* name);
  void RemoveAllFileNames();
  int GetNumberOfFileNames();
  /// Null when there is no such file name.
  const char* GetFileName(int index);
  ///@}

  /// Reads this file alone: RemoveAllFileNames(), then AddFileName().
  void SetFileName(const char* name);

  ///@{
  /// The DICOM series to read from a folder that holds several. Default: none, all of the folder.
  vtkSetStringMacro(SeriesInstanceUID);
  vtkGetStringMacro(SeriesInstanceUID);
  ///@}

  ///@{
  /**
   * R-R fractions of the phases, strictly increasing, one a phase. They replace those of the files.
   * Default: none; phases of files that give no fractions are then spread evenly over [0, 1), phase p
   * of n at p/n, and the phase of a single file is at 0.
   */
  void SetNumberOfPhaseFractions(int number);
  int GetNumberOfPhaseFractions();
  /// Grows the list as needed; a negative index is ignored.
  void SetPhaseFraction(int index, double fraction);
  /// 0 when there is no such value.
  double GetPhaseFraction(int index);
  void RemoveAllPhaseFractions();
  ///@}

  ///@{
  /// R-R interval in seconds, positive, for files that do not give it. Default: 1.
  vtkSetMacro(CycleLength, double);
  vtkGetMacro(CycleLength, double);
  ///@}

  /// 1 when the name is that of a volume or of a JSON file, or when a folder has a DICOM file among its first ones; else
  /// 0. For File > Open: nothing is promised.
  int CanReadFile(const char* name);

  /// Number of phases found; 0 before UpdateInformation(), or when that failed.
  int GetNumberOfPhases();

  /// R-R fraction of a phase; NaN when there is no such phase.
  double GetPhaseTime(int phase);

  /// R-R interval in seconds as the files say it, or CycleLength where they do not; 0 before UpdateInformation(), or
  /// when that failed.
  double GetUsedCycleLength();

  /// File (for DICOM: that of the first slice) of a phase; empty when there is no such phase.
  std::string GetPhaseFileName(int phase);

  /**
   * What was found, as lines of text: format, phases and their times, positions, spacing, series,
   * skipped files, warnings. Empty before UpdateInformation(), or when that failed.
   */
  std::string GetSummary();

protected:
  vtkGatedImageReader();
  ~vtkGatedImageReader() override;

  int FillOutputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;
  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

private:
  vtkGatedImageReader(const vtkGatedImageReader&) = delete;
  void operator=(const vtkGatedImageReader&) = delete;

  void ReadImage(int phase, const int extent[6], vtkImageData* image);
  void FillSeeds(vtkPolyData* output);

  struct Internals;
  std::unique_ptr<Internals> State;

  char* SeriesInstanceUID = nullptr;
  double CycleLength = 1.0;
};

#endif
