// Vessels for the tests of flow and contrast medium.
#ifndef ContrastTestData_h
#define ContrastTestData_h

#include "CoronaryPhantom.h"
#include "TableRow.h"
#include "WallMotions.h"

#include <string>
#include <vector>

namespace coronary
{
/// A straight branch along `direction`, radius linear from `begin` to `end` mm; returns its index.
inline int AddBranch(WallTopology& topology, int parent, const Vector3& from,
  const Vector3& direction, double length, double begin, double end, int intervals,
  const std::string& name = "")
{
  topology.axis.emplace_back();
  topology.axisRadius.emplace_back();
  for (int k = 0; k <= intervals; ++k)
  {
    const double t = static_cast<double>(k) / intervals;
    topology.axis.back().push_back(from + t * length * direction.normalized());
    topology.axisRadius.back().push_back(begin + t * (end - begin));
  }
  topology.parent.push_back(parent);
  topology.groupName.push_back(name);
  return static_cast<int>(topology.axis.size()) - 1;
}

inline WallTopology Tube(double length, double begin, double end, int intervals)
{
  WallTopology topology;
  AddBranch(topology, -1, Vector3::Zero(), Vector3::UnitZ(), length, begin, end, intervals);
  return topology;
}

/// 40 mm of 2 mm radius, which parts into two branches of 60 mm in the plane of x and z.
inline WallTopology Fork(double radiusA, double radiusB)
{
  WallTopology topology;
  AddBranch(topology, -1, Vector3::Zero(), Vector3::UnitZ(), 40.0, 2.0, 2.0, 40);
  const Vector3 end(0.0, 0.0, 40.0);
  AddBranch(topology, 0, end, Vector3(1.0, 0.0, 1.0), 60.0, radiusA, radiusA, 60);
  AddBranch(topology, 0, end, Vector3(-1.0, 0.0, 1.0), 60.0, radiusB, radiusB, 60);
  return topology;
}

/// The axes of the phantom's vessels at rest.
inline WallTopology PhantomVessels(const PhantomSettings& settings)
{
  return PhantomAxes(CoronaryPhantom(settings));
}
}

#endif
