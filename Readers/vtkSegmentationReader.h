/**
 * @class vtkSegmentationReader
 * @brief Reads segmentations of 3D Slicer (.seg.nrrd), or label maps, as masks: one file a cardiac phase.
 *
 * @par Output:
 * vtkImageData. Point data `VesselMask` (unsigned char, 0 or 1, the scalars, the union of the wanted segments). Field data
 * `PhaseTime` (double, R-R fraction of the phase). All phases have the voxels of the first file: masks on other voxels
 * are brought onto these (see coronary::ResampleMask), with a warning when a part of them lies outside.
 *
 * @par Time:
 * Pipeline time is the fraction of the R-R interval; a requested time is answered with the nearest phase, the earlier one of
 * two at the same distance. Without a requested time the first phase is read. World coordinates are LPS millimetres.
 *
 * @par Failure:
 * Wrong or damaged input gives one error that names the file, and no output.
 *
 * @par Python:
 * @code{.py}
 * mask = SegmentationReader(FileNames=["mask.mha"], Segments=["1"])
 * mask.UpdatePipeline()
 * print(mask.PointData["VesselMask"].GetRange())
 * @endcode
 *
 * @sa coronary::SegmentationFile, vtkGatedImageReader
 */
#ifndef vtkSegmentationReader_h
#define vtkSegmentationReader_h

#include "vtkCoronaryReadersModule.h" // for the export macro

#include "vtkImageAlgorithm.h"

#include <memory> // for the hidden state

class VTKCORONARYREADERS_EXPORT vtkSegmentationReader : public vtkImageAlgorithm
{
public:
  static vtkSegmentationReader* New();
  vtkTypeMacro(vtkSegmentationReader, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /// The files, in the order of the phases. Null and empty names are ignored. Default: none.
  void AddFileName(const char* name);
  void RemoveAllFileNames();
  ///@}

  /// Reads this file alone: RemoveAllFileNames(), then AddFileName().
  void SetFileName(const char* name);

  ///@{
  /// Names or IDs of the wanted segments. Default: none, all segments.
  void AddSegment(const char* name);
  void RemoveAllSegments();
  ///@}

  ///@{
  /// R-R fractions of the phases, strictly increasing, one a file. Default: none, phase p of n at p/n.
  void SetNumberOfPhaseFractions(int number);
  void SetPhaseFraction(int index, double fraction);
  void RemoveAllPhaseFractions();
  ///@}

protected:
  vtkSegmentationReader();
  ~vtkSegmentationReader() override;

  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkSegmentationReader(const vtkSegmentationReader&) = delete;
  void operator=(const vtkSegmentationReader&) = delete;

  struct Internals;
  std::unique_ptr<Internals> State;
};

#endif
