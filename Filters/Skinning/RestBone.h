/**
 * @file RestBone.h
 * @brief What a posed mesh needs to know of a bone at rest.
 */
#ifndef DynamicCoronary_RestBone_h
#define DynamicCoronary_RestBone_h

#include "Geometry.h"

#include <string>

namespace coronary
{
struct RestBone
{
  std::string name;               ///< may be empty
  Vector3 head = Vector3::Zero(); ///< joint on the root's side, mm
  Vector3 tail = Vector3::Zero(); ///< joint on the tips' side, mm
  std::int64_t parent = -1; ///< bone that ends in the head, -1: none; stands before its daughters
};
}

#endif
