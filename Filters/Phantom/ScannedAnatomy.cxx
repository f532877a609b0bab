#include "ScannedAnatomy.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
MaterialAmounts ScannedPhantom::Amounts(
  PhantomTissue tissue, double hounsfield, double iodine) const
{
  MaterialAmounts amounts = MaterialAmounts::Zero();
  switch (tissue)
  {
    case PhantomTissue::Lung:
      return this->Tissue.Lung(hounsfield);
    case PhantomTissue::Fat:
      return this->Tissue.Fat(hounsfield);
    case PhantomTissue::Soft:
      return this->Tissue.Soft(hounsfield);
    case PhantomTissue::Calcified:
    case PhantomTissue::Metal:
      return this->Tissue.Calcified(hounsfield);
    case PhantomTissue::Muscle:
      amounts = this->Tissue.Muscle(hounsfield);
      break;
    case PhantomTissue::Blood:
      amounts = this->Tissue.Blood(hounsfield);
      break;
  }
  amounts[1] *= static_cast<float>(iodine);
  return amounts;
}

void ScannedPhantom::Render(const PatientState& state, const ImageGrid& grid,
  MaterialVolume& volume, const ProgressCallback& progress) const
{
  volume.SetGrid(grid);
  ImageGrid atRest = grid; // the patient is elsewhere: so are the places of the phantom
  atRest.origin -= state.shift;
  this->Phantom.RenderMaterials(
    atRest, state.phase,
    [&](PhantomTissue tissue, double hounsfield)
    {
      const MaterialAmounts amounts = this->Amounts(tissue, hounsfield, state.iodine);
      return std::array<float, 3>{ amounts[0], amounts[1], amounts[2] };
    },
    { volume.maps[0].data(), volume.maps[1].data(), volume.maps[2].data() }, progress);
  volume.FindColumns();
}

std::vector<ScannedTube> ScannedPhantom::Tubes(const PatientState& state) const
{
  const MaterialAmounts coats[2] = { this->Amounts(PhantomTissue::Fat,
                                       CoronaryPhantom::CoatValue(false), state.iodine),
    this->Amounts(PhantomTissue::Muscle, CoronaryPhantom::CoatValue(true), state.iodine) };
  std::vector<ScannedTube> tubes;
  for (const PhantomTube& tube : this->Phantom.Tubes(state.phase))
  {
    tubes.push_back({ tube.start + state.shift, tube.end + state.shift, tube.startRadius,
      tube.endRadius, tube.round,
      this->Amounts(tube.tissue, tube.value, state.iodine) - coats[tube.inMuscle ? 1 : 0] });
  }
  return tubes;
}

std::vector<ScannedBall> ScannedPhantom::Balls(const PatientState& state) const
{
  const MaterialAmounts coat =
    this->Amounts(PhantomTissue::Fat, CoronaryPhantom::CoatValue(false), state.iodine);
  std::vector<ScannedBall> balls;
  for (const PhantomPlaque& plaque : this->Phantom.Plaques(state.phase))
  {
    balls.push_back({ plaque.centre + state.shift, plaque.radius,
      this->Amounts(PhantomTissue::Calcified, plaque.value, state.iodine) - coat });
  }
  return balls;
}

ScannedPatient::ScannedPatient(const ScannedAnatomy& anatomy, const ScannerSettings& settings)
  : Anatomy(anatomy)
  , Settings(settings)
  , Projector(settings)
{
}

void ScannedPatient::Prepare(
  const PatientState& state, double height, const ProgressCallback& progress)
{
  const ScannerSettings& s = this->Settings;
  const CoronaryPhantom::Box body = this->Anatomy.Body();
  // Voxels around all that the rays meet.
  const double radius = 0.5 * std::max(body.high[0] - body.low[0], body.high[1] - body.low[1]);
  Vector3 half = 0.5 * (body.high - body.low);
  half[2] = 0.5 * s.rows * s.rowPitch * (s.sourceToAxis + radius) / s.sourceToDetector;
  Vector3 centre = 0.5 * (body.low + body.high) + state.shift;
  centre[2] = height;
  ImageGrid grid;
  grid.spacing = Vector3::Constant(s.anatomySpacing);
  for (int axis = 0; axis < 3; ++axis)
  {
    const int steps =
      static_cast<int>(std::ceil(2.0 * (half[axis] + s.anatomySpacing) / s.anatomySpacing));
    grid.extent[2 * axis] = 0;
    grid.extent[2 * axis + 1] = steps;
    grid.origin[axis] = centre[axis] - 0.5 * steps * s.anatomySpacing;
  }
  this->Anatomy.Render(state, grid, this->Volume, progress);
}

void ScannedPatient::Project(
  const ScannerView& view, const PatientState& state, ViewPaths& paths) const
{
  this->Projector.Clear(paths);
  this->Projector.Add(this->Volume, view, paths);
  this->Projector.Add(this->Anatomy.Tubes(state), this->Anatomy.Balls(state), view, paths);
}
}
