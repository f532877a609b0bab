/**
 * @class   vtkLumenVolume
 * @brief   Volume of each branch of a tree of centerlines.
 *
 * @par Input port:
 * - 0: vtkPolyData, polylines. Point data: radius in mm, RadiusArrayName.
 *
 * @par Output port:
 * - 0: vtkPolyData, the input. Cell data `LumenVolume` (double, mm^3).
 *
 * @par Time:
 * Passes through: every time step is computed by itself.
 *
 * @par Failure:
 * A radius array that is missing, negative or not finite: one error that names it, and no output. An
 * empty input gives an empty output.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1)
 * volumes = LumenVolume(Input=phantom["Centerlines"])
 * volumes.UpdatePipeline(0.75)
 * print(volumes.CellData["LumenVolume"].GetRange())
 * @endcode
 *
 * @sa coronary::LumenVolume
 */
#ifndef vtkLumenVolume_h
#define vtkLumenVolume_h

#include "vtkCoronaryLumenVolumeModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <string> // for std::string

class VTKCORONARYLUMENVOLUME_EXPORT vtkLumenVolume : public vtkPolyDataAlgorithm
{
public:
  static vtkLumenVolume* New();
  vtkTypeMacro(vtkLumenVolume, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /// Name of the point array with the radius, mm. Default `MaximumInscribedSphereRadius`.
  vtkSetMacro(RadiusArrayName, std::string);
  vtkGetMacro(RadiusArrayName, std::string);
  ///@}

protected:
  vtkLumenVolume();
  ~vtkLumenVolume() override = default;

  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkLumenVolume(const vtkLumenVolume&) = delete;
  void operator=(const vtkLumenVolume&) = delete;

  std::string RadiusArrayName;
};

#endif
