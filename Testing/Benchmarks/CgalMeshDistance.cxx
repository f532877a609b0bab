#include "CgalMeshDistance.h"

#include <CGAL/Kernel/global_functions_3.h> // for the next one
#include <CGAL/Polygon_mesh_processing/distance.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

#include <stdexcept>

namespace coronary
{
namespace
{
using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

Mesh MeshOf(const SurfaceMesh& surface)
{
  Mesh mesh;
  std::vector<Mesh::Vertex_index> vertices;
  for (const Vector3& p : surface.points)
  {
    vertices.push_back(mesh.add_vertex({ p[0], p[1], p[2] }));
  }
  for (const Triangle& t : surface.triangles)
  {
    if (mesh.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]) == Mesh::null_face())
    {
      throw std::runtime_error("CGAL does not take the surface: it is not manifold");
    }
  }
  return mesh;
}
}

double CgalHausdorffDistance(const SurfaceMesh& a, const SurfaceMesh& b, double errorBound)
{
  return CGAL::Polygon_mesh_processing::bounded_error_symmetric_Hausdorff_distance<
    CGAL::Sequential_tag>(MeshOf(a), MeshOf(b), errorBound);
}

double CgalOneSidedHausdorffDistance(const SurfaceMesh& a, const SurfaceMesh& b, double errorBound)
{
  return CGAL::Polygon_mesh_processing::bounded_error_Hausdorff_distance<CGAL::Sequential_tag>(
    MeshOf(a), MeshOf(b), errorBound);
}
}
