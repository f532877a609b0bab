/**
 * @file MesherMessage.h
 * @brief What the host and a mesher's worker process say to each other.
 *
 * A message is a magic number, the fields in a fixed order (numbers in the machine's byte order, a
 * list as its length and its entries), and a checksum of all bytes before it. Both ends run on one
 * machine and come from one build.
 */
#ifndef DynamicCoronary_MesherMessage_h
#define DynamicCoronary_MesherMessage_h

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/// A surface and what lies inside, for a worker. Lengths in the caller's unit.
struct MesherRequest
{
  double radiusEdgeRatio = 0.0; ///< bound
  double minimumDihedral = 0.0; ///< degrees
  double timeLimit = 0.0;       ///< seconds of CPU time after which the worker gives up
  double memoryLimit = 0.0;     ///< bytes; 0: none
  double distance = 0.0;        ///< greatest distance to the surface, in local sizes; CGAL only
  std::vector<double> points;   ///< x, y, z
  std::vector<double> sizes;    ///< wanted edge length at each point
  std::vector<std::int64_t> triangles; ///< three points each
  std::vector<std::int64_t> segments;  ///< two points each: edges to keep inside
  std::vector<std::int64_t> rims;      ///< two points each: edges of the surface to keep
};

enum class MesherStatus : std::int32_t
{
  Done = 0,
  // TetGen's own numbers.
  OutOfMemory = 1,
  InternalError = 2,
  Intersection = 3,
  SmallFeature = 4,
  CloseFacets = 5,
  BadInput = 10,
  // Ours.
  BadRequest = 20,
  TimeLimit = 21
};

/// A worker's answer.
struct MesherAnswer
{
  MesherStatus status = MesherStatus::InternalError;
  std::string message;
  std::vector<double> points;             ///< x, y, z; the request's points first (TetGen)
  std::vector<std::int64_t> tetrahedra;   ///< four points each
  std::vector<std::int64_t> segmentEdges; ///< two points and the number of the segment they are of
};

std::string Encode(const MesherRequest& request);
std::string Encode(const MesherAnswer& answer);

/// @throws std::runtime_error for bytes that are not such a message, with the reason.
MesherRequest DecodeMesherRequest(const std::string& bytes);
MesherAnswer DecodeMesherAnswer(const std::string& bytes);
}

#endif
