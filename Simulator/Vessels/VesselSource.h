/**
 * @file VesselSource.h
 * @brief Where the vessels of a session are from, and how they move.
 */
#ifndef DynamicCoronary_VesselSource_h
#define DynamicCoronary_VesselSource_h

#include "ContractionMotion.h"
#include "CoronaryPhantom.h"

#include <string>

namespace coronary
{
enum class VesselMotion
{
  Automatic, ///< tracked if there is a tracked motion, else still
  Tracked,   ///< that of the run
  Still,
  Contraction ///< by formula
};

/// Where the vessels are from.
struct VesselSource
{
  enum class Kind
  {
    Phantom,
    Run,    ///< a folder of coronary-pipeline run
    Surface ///< a closed surface and its centerline tree
  };
  Kind kind = Kind::Phantom;
  std::string path;       ///< of Run and Surface; empty: the user has to say
  std::string centerline; ///< of Surface
  PhantomSettings phantom;
  VesselMotion motion = VesselMotion::Automatic;
  ContractionSettings contraction;
};
}

#endif
