/**
 * @file vtkSessionFiles.h
 * @brief Instruments and wall of one moment as files for ParaView.
 */
#ifndef vtkSessionFiles_h
#define vtkSessionFiles_h

#include "Intervention.h"
#include "WallMotion.h"

#include "vtkSmartPointer.h"

#include <string>

class vtkMessageTrap;
class vtkPolyData;

namespace coronary
{
/**
 * Wire, catheter and, where there is one out of it, balloon catheter as polylines from their tips, stents from their ends near the
 * ostium. Point data: MaximumInscribedSphereRadius (that of the instrument, inside of a stent, mm), Abscissas (mm from the line's
 * beginning). Cell data: Instrument (0 wire, 1 catheter, 2 balloon, 3 stent, 4 second wire, 5 microcatheter). Field data:
 * Tick, PhaseTime, Inserted, and the forces of TickReport.
 * @throws std::runtime_error naming the file
 */
void WriteInstruments(const std::string& path, const Intervention& intervention,
  const GuideCatheter& catheter, vtkMessageTrap& messages);

/// The wall, written moment by moment with the same cells: CellEntityIds, and GroupIds of the points.
class vtkWallFiles
{
public:
  explicit vtkWallFiles(const WallTopology& topology);
  ~vtkWallFiles();
  vtkWallFiles(const vtkWallFiles&) = delete;
  vtkWallFiles& operator=(const vtkWallFiles&) = delete;

  /// @throws std::runtime_error naming the file
  void Write(
    const std::string& path, const std::vector<Vector3>& points, vtkMessageTrap& messages) const;

private:
  vtkSmartPointer<vtkPolyData> Cells;
};
}

#endif
