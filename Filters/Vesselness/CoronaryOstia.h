/**
 * @file CoronaryOstia.h
 * @brief Finds the ascending aorta and the two coronary ostia in a contrast-enhanced cardiac CT.
 *
 * The aorta is a stack of bright circles in world-axial slices (Hough transform, then a chain over
 * the slices). From its wall a minimal-path search runs outwards through what is bright but not a
 * large body (chambers, great vessels). An ostium is where many millimetres of such vessel
 * hang on one place of the wall, or where such a vessel points at it from behind a lesion. docs/segmentation.md explains the steps and their limits.
 */
#ifndef DynamicCoronary_CoronaryOstia_h
#define DynamicCoronary_CoronaryOstia_h

#include "ParallelFor.h"
#include "ScalarImage.h"

#include <string>
#include <vector>

namespace coronary
{
struct CoronaryOstiaSettings
{
  double minimumAorticRadius = 8.0;  ///< radius, mm
  double maximumAorticRadius = 32.0; ///< radius, mm
  double maximumVesselRadius = 4.5; ///< coronary radius, mm; what is thicker counts as a large body
  double vesselLength = 40.0;       ///< mm that must hang on an ostium for full confidence
  double softTissue = 50.0;         ///< HU of muscle without contrast medium
  double minimumBlood = 150.0;      ///< HU below which the aorta would not be contrast-enhanced

  /// @throws std::invalid_argument that names the first setting that is out of range
  void Validate() const;
};

/// One cross-section of the aorta.
struct AorticSection
{
  Vector3 centre;                    ///< mm
  double radius;                     ///< mm
  Vector3 normal = Vector3::UnitZ(); ///< unit vector upwards, square to the section
};

struct AscendingAorta
{
  std::vector<AorticSection> sections; ///< upwards; empty: not found
  double mean = 0.0;                   ///< HU of the blood
  double deviation = 0.0;              ///< HU, its standard deviation (noise)
  double confidence = 0.0;             ///< 0 to 1
};

struct CoronaryOstium
{
  std::string name;        ///< "LCA" or "RCA"
  Vector3 position;        ///< mm, on the aortic wall
  Vector3 axis;            ///< unit vector into the vessel
  double radius = 0.0;     ///< mm, of the vessel a few millimetres from the wall
  double length = 0.0;     ///< mm of vessel followed from here, at most 80
  double confidence = 0.0; ///< 0 to 1; below 0.5 it needs a look
  /// mm behind the wall that show no vessel, at most 10: the place is the one that a vessel farther on points at.
  double hidden = 0.0;
};

struct CoronaryOstia
{
  AscendingAorta aorta;
  /// Of the descending aorta, upwards, as far as it stands upright behind the ascending one; empty: not seen.
  std::vector<AorticSection> descending;
  std::vector<CoronaryOstium> ostia; ///< left, then right, as far as found
  std::string doubt;                 ///< empty, or why the result is not sure
};

/**
 * @param image HU; patient coordinates must be LPS (the search uses left, anterior and up)
 * @throws Cancelled, and std::invalid_argument for settings or an image that cannot be used
 */
CoronaryOstia FindCoronaryOstia(const ScalarImage& image,
  const CoronaryOstiaSettings& settings = {}, const ProgressCallback& progress = {});
}

#endif
