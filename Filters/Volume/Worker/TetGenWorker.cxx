// Constrained Delaunay tetrahedralization of one request by TetGen, in a process of its own.
// With TetGen's licence (AGPL), and so not part of the libraries.
#include "WorkerMain.h"

#define TETLIBRARY // errors are thrown, as in the library
#include <tetgen.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <new>
#include <stdexcept>

using coronary::MesherAnswer;
using coronary::MesherRequest;
using coronary::MesherStatus;

namespace
{
template <typename T>
T* CopyOf(const std::vector<T>& values)
{
  T* copy = new T[values.size()]; // tetgenio's destructor frees it
  std::copy(values.begin(), values.end(), copy);
  return copy;
}

std::vector<int> Narrow(const std::vector<std::int64_t>& indices)
{
  return { indices.begin(), indices.end() };
}

MesherAnswer Mesh(const MesherRequest& request)
{
  if (request.points.size() / 3 + request.triangles.size() >
    static_cast<std::size_t>(std::numeric_limits<int>::max()) / 4)
  {
    throw std::runtime_error("too many points for TetGen");
  }
  tetgenio in;
  in.firstnumber = 0;
  in.numberofpoints = static_cast<int>(request.points.size() / 3);
  in.pointlist = CopyOf(request.points);
  const bool sized =
    std::any_of(request.sizes.begin(), request.sizes.end(), [](double s) { return s > 0.0; });
  if (sized)
  {
    in.numberofpointmtrs = 1;
    in.pointmtrlist = CopyOf(request.sizes);
  }
  const std::vector<int> triangles = Narrow(request.triangles);
  in.numberoffacets = static_cast<int>(triangles.size() / 3);
  in.facetlist = new tetgenio::facet[in.numberoffacets];
  in.facetmarkerlist = new int[in.numberoffacets];
  for (int i = 0; i < in.numberoffacets; ++i)
  {
    tetgenio::facet& facet = in.facetlist[i];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    tetgenio::polygon& polygon = facet.polygonlist[0];
    tetgenio::init(&polygon);
    polygon.numberofvertices = 3;
    polygon.vertexlist = new int[3];
    std::copy_n(triangles.begin() + 3 * static_cast<std::ptrdiff_t>(i), 3, polygon.vertexlist);
    in.facetmarkerlist[i] = i + 1;
  }
  constexpr int firstSegment = 1000; // below are markers that TetGen gives by itself
  if (!request.segments.empty())
  {
    in.numberofedges = static_cast<int>(request.segments.size() / 2);
    in.edgelist = CopyOf(Narrow(request.segments));
    in.edgemarkerlist = new int[in.numberofedges];
    for (int i = 0; i < in.numberofedges; ++i)
    {
      in.edgemarkerlist[i] = firstSegment + i;
    }
  }

  // p: a surface; Y: it is kept as it is; O, o: flips and smoothing against blunt dihedral angles.
  char text[128];
  std::snprintf(text, sizeof text, "pYq%.6f/%.6fO9/7o/150%sQ", request.radiusEdgeRatio,
    request.minimumDihedral, sized ? "m" : "");
  tetgenbehavior behavior;
  MesherAnswer answer;
  tetgenio out;
  try
  {
    if (!behavior.parse_commandline(text))
    {
      throw std::runtime_error(std::string("TetGen does not take ") + text);
    }
    tetrahedralize(&behavior, &in, &out);
  }
  catch (const int code)
  {
    answer.status = static_cast<MesherStatus>(code);
    return answer;
  }
  if (out.numberoftetrahedra <= 0)
  {
    answer.message = "TetGen made no tetrahedra";
    return answer;
  }
  answer.status = MesherStatus::Done;
  answer.points.assign(out.pointlist, out.pointlist + 3 * std::size_t(out.numberofpoints));
  answer.tetrahedra.assign(out.tetrahedronlist,
    out.tetrahedronlist + 4 * static_cast<std::size_t>(out.numberoftetrahedra));
  if (out.edgemarkerlist != nullptr)
  {
    for (int i = 0; i < out.numberofedges; ++i)
    {
      if (out.edgemarkerlist[i] >= firstSegment)
      {
        const int* edge = out.edgelist + 2 * std::size_t(i);
        answer.segmentEdges.insert(
          answer.segmentEdges.end(), { edge[0], edge[1], out.edgemarkerlist[i] - firstSegment });
      }
    }
  }
  return answer;
}
}

int main()
{
  return coronary::WorkerMain(Mesh);
}
