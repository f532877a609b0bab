#include "ScannedAnatomy.h"

#include "PartialProgress.h"
#include "PhantomMotion.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double MovingMargin = 25.0; ///< mm around the arteries: what else of the heart moves
constexpr double FadeWidth = 12.0;    ///< mm over which heart and chest replace each other
constexpr double HeightStep = 20.0;   ///< mm of the table for which one chest is rendered
constexpr double IodineStep = 0.02;   ///< change of the iodine for which it is rendered anew
}

ScannedPhantom::ScannedPhantom(const CoronaryPhantom& phantom)
  : Phantom(phantom)
{
  const ImageGrid around = phantom.DefaultGrid(1.0, MovingMargin);
  const std::array<int, 6>& e = around.extent;
  this->Heart = { around.IndexToWorld(e[0], e[2], e[4]), around.IndexToWorld(e[1], e[3], e[5]) };
}

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
      return this->Tissue.Calcified(hounsfield);
    case PhantomTissue::Metal:
      return this->Tissue.Metal();
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
  , Body(anatomy.Body())
  , Heart(anatomy.Moving())
{
  const double radius =
    0.5 * std::max(this->Body.high[0] - this->Body.low[0], this->Body.high[1] - this->Body.low[1]);
  this->Reach = 0.5 * settings.rows * settings.rowPitch * (settings.sourceToAxis + radius) /
      settings.sourceToDetector +
    settings.anatomySpacing;
}

/// Voxels that fill a box between two heights.
ImageGrid ScannedPatient::Grid(
  const CoronaryPhantom::Box& box, double low, double high, double spacing) const
{
  Vector3 centre = 0.5 * (box.low + box.high);
  Vector3 half = 0.5 * (box.high - box.low) + Vector3::Constant(spacing);
  centre[2] = 0.5 * (low + high);
  half[2] = 0.5 * (high - low) + spacing;
  ImageGrid grid;
  grid.spacing = Vector3::Constant(spacing);
  for (int axis = 0; axis < 3; ++axis)
  {
    const int steps = static_cast<int>(std::ceil(2.0 * half[axis] / spacing));
    grid.extent[2 * axis] = 0;
    grid.extent[2 * axis + 1] = steps;
    grid.origin[axis] = centre[axis] - 0.5 * steps * spacing;
  }
  return grid;
}

/// Takes the share of the heart's box, or of all else: together they are one everywhere.
void ScannedPatient::Fade(MaterialVolume& volume, bool inside) const
{
  const std::array<int, 6>& e = volume.grid.extent;
  const std::size_t slices = e[5] - e[4] + 1;
  std::size_t column = 0;
  for (int i = e[0]; i <= e[1]; ++i)
  {
    for (int j = e[2]; j <= e[3]; ++j, ++column)
    {
      const Vector3 at = volume.grid.IndexToWorld(i, j, e[4]);
      double share = 1.0;
      for (const int axis : { 0, 1 })
      {
        const double depth =
          std::min(at[axis] - this->Heart.low[axis], this->Heart.high[axis] - at[axis]);
        share *= SmoothStep(depth / FadeWidth);
      }
      const auto factor = static_cast<float>(inside ? share : 1.0 - share);
      if (factor < 1.0f)
      {
        for (std::vector<float>& map : volume.maps)
        {
          float* first = &map[column * slices];
          std::for_each(first, first + slices, [factor](float& amount) { amount *= factor; });
        }
      }
    }
  }
  volume.FindColumns();
}

void ScannedPatient::PrepareStill(double iodine, double height, const ProgressCallback& progress)
{
  // In steps, so that it does not depend on what was seen before.
  const std::array<int, 2> key{ static_cast<int>(std::floor(height / HeightStep)),
    static_cast<int>(std::lround(std::log(iodine) / std::log(1.0 - IodineStep))) };
  if (key == this->StillKey)
  {
    return;
  }
  this->StillKey = key;
  PatientState still;
  still.iodine = std::pow(1.0 - IodineStep, key[1]);
  this->Anatomy.Render(still,
    this->Grid(this->Body, key[0] * HeightStep - this->Reach,
      (key[0] + 1) * HeightStep + this->Reach, 2.0 * this->Settings.anatomySpacing),
    this->Still, progress);
  this->Fade(this->Still, false);
}

void ScannedPatient::Prepare(
  const PatientState& state, double height, const ProgressCallback& progress)
{
  this->PrepareStill(state.iodine, height, PartOf(progress, 0.0, 0.3));
  this->Anatomy.Render(state,
    this->Grid(
      this->Heart, height - this->Reach, height + this->Reach, this->Settings.anatomySpacing),
    this->Beating, PartOf(progress, 0.3, 1.0));
  this->Fade(this->Beating, true);
}

void ScannedPatient::Project(
  const ScannerView& view, const PatientState& state, ViewPaths& paths) const
{
  this->Projector.Clear(paths);
  this->Projector.Add(this->Still, view, paths);
  this->Projector.Add(this->Beating, view, paths);
  this->Projector.Add(this->Anatomy.Tubes(state), this->Anatomy.Balls(state), view, paths);
}
}
