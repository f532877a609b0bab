// Delaunay refinement of one request by CGAL's Mesh_3 (Rineau, Yvinec; protecting balls on features:
// Cheng, Dey, Ramos, SODA 2007), in a process of its own. With CGAL's licence (GPL), and so not part
// of the libraries.
#include "WorkerMain.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_domain_with_polyline_features_3.h>
#include <CGAL/Mesh_polyhedron_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polyhedral_mesh_domain_3.h>
#include <CGAL/Polyhedral_mesh_domain_with_features_3.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Search_traits_adapter.h>
#include <CGAL/make_mesh_3.h>
#include <CGAL/property_map.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <stdexcept>
#include <unordered_map>
#include <utility>
#include <vector>

using coronary::MesherAnswer;
using coronary::MesherRequest;
using coronary::MesherStatus;

namespace
{
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Polyhedron = CGAL::Mesh_polyhedron_3<Kernel>::type;
using Domain = CGAL::Polyhedral_mesh_domain_with_features_3<Kernel>;
// Its own function of that name makes each line a part of the surface.
using Lines = CGAL::Mesh_domain_with_polyline_features_3<
  CGAL::Polyhedral_mesh_domain_3<Polyhedron, Kernel, CGAL::Default, int, CGAL::Tag_true>>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex =
  CGAL::Mesh_complex_3_in_triangulation_3<Triangulation, Domain::Corner_index, Domain::Curve_index>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
using Polyline = std::vector<Point>;

/// The wanted edge length of the nearest point of the request, times a factor.
class Sizing
{
public:
  using FT = Kernel::FT;
  using Point_3 = Point;
  using Index = Domain::Index;

  Sizing(const std::vector<Point>& points, const std::vector<double>& sizes)
    : Points(points)
    , Sizes(sizes)
  {
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      this->Search.insert({ points[i], i });
    }
    this->Search.build();
  }

  double At(const Point& p) const
  {
    const Neighbours nearest(this->Search, p, 1);
    return this->Sizes[std::get<1>(nearest.begin()->first)];
  }

private:
  using Entry = std::tuple<Point, std::size_t>;
  using Traits = CGAL::Search_traits_adapter<Entry, CGAL::Nth_of_tuple_property_map<0, Entry>,
    CGAL::Search_traits_3<Kernel>>;
  using Neighbours = CGAL::Orthogonal_k_neighbor_search<Traits>;

  const std::vector<Point>& Points;
  const std::vector<double>& Sizes;
  Neighbours::Tree Search;
};

struct Field
{
  using FT = Kernel::FT;
  using Point_3 = Point;
  using Index = Domain::Index;

  const Sizing* sizing;
  double factor;

  FT operator()(const Point_3& p, int, const Index&) const
  {
    return this->factor * this->sizing->At(p);
  }
};

/// Each edge as a curve of its own: so its ends become vertices.
std::vector<Polyline> Curves(
  const std::vector<std::int64_t>& edges, const std::vector<Point>& points)
{
  std::vector<Polyline> curves;
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2)
  {
    curves.push_back({ points.at(edges[i]), points.at(edges[i + 1]) });
  }
  return curves;
}

MesherAnswer Mesh(const MesherRequest& request)
{
  std::vector<Point> points;
  for (std::size_t i = 0; i + 2 < request.points.size(); i += 3)
  {
    points.emplace_back(request.points[i], request.points[i + 1], request.points[i + 2]);
  }
  std::vector<std::vector<std::size_t>> triangles;
  std::vector<std::int64_t> number(points.size(), -1);
  std::vector<Point> corners;
  for (std::size_t i = 0; i + 2 < request.triangles.size(); i += 3)
  {
    std::vector<std::size_t> triangle;
    for (std::size_t k = i; k < i + 3; ++k)
    {
      std::int64_t& corner = number.at(request.triangles[k]);
      if (corner < 0)
      {
        corner = static_cast<std::int64_t>(corners.size());
        corners.push_back(points[request.triangles[k]]);
      }
      triangle.push_back(static_cast<std::size_t>(corner));
    }
    triangles.push_back(std::move(triangle));
  }
  Polyhedron surface;
  namespace Processing = CGAL::Polygon_mesh_processing;
  if (!Processing::is_polygon_soup_a_polygon_mesh(triangles))
  {
    throw std::runtime_error("the surface is not a manifold");
  }
  Processing::polygon_soup_to_polygon_mesh(corners, triangles, surface);
  CGAL::get_default_random() = CGAL::Random(0);
  Domain domain(surface, &CGAL::get_default_random());

  const std::vector<Polyline> rims = Curves(request.rims, points);
  domain.add_features(rims.begin(), rims.end());
  const std::vector<Polyline> segments = Curves(request.segments, points);
  std::vector<Domain::Curve_index> curves;
  static_cast<Lines&>(domain).add_features(
    segments.begin(), segments.end(), std::back_inserter(curves));
  std::map<Domain::Curve_index, std::int64_t> segmentOf;
  for (std::size_t i = 0; i < curves.size(); ++i)
  {
    segmentOf[curves[i]] = static_cast<std::int64_t>(i);
  }
  // Points that no segment ends in.
  std::vector<char> used(points.size(), 0);
  for (const std::int64_t point : request.segments)
  {
    used[point] = 1;
  }
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    if (used[i] == 0 && number[i] < 0)
    {
      domain.add_corner(points[i]);
    }
  }

  const Sizing sizing(points, request.sizes);
  namespace parameters = CGAL::parameters;
  const Field edge{ &sizing, 1.0 };
  const Field facet{ &sizing, 0.7 }; // radius of the circumscribed circle
  const Field cell{ &sizing, 0.9 };
  const Field distance{ &sizing, request.distance };
  const Criteria criteria(parameters::edge_size = edge, parameters::facet_angle = 25.0,
    parameters::facet_size = facet, parameters::facet_distance = distance,
    parameters::cell_radius_edge_ratio = std::max(2.0, request.radiusEdgeRatio),
    parameters::cell_size = cell);
  const Complex mesh = CGAL::make_mesh_3<Complex>(domain, criteria, parameters::manifold(),
    parameters::perturb(parameters::sliver_bound = request.minimumDihedral),
    parameters::exude(parameters::sliver_bound = request.minimumDihedral));

  MesherAnswer answer;
  if (mesh.number_of_cells_in_complex() == 0)
  {
    answer.message = "CGAL made no tetrahedra";
    return answer;
  }
  std::unordered_map<Triangulation::Vertex_handle, std::int64_t> vertices;
  const auto vertex = [&](Triangulation::Vertex_handle handle)
  {
    const auto [place, isNew] =
      vertices.try_emplace(handle, static_cast<std::int64_t>(vertices.size()));
    if (isNew)
    {
      const Point p =
        mesh.triangulation().geom_traits().construct_point_3_object()(handle->point());
      answer.points.insert(answer.points.end(), { p.x(), p.y(), p.z() });
    }
    return place->second;
  };
  for (auto c = mesh.cells_in_complex_begin(); c != mesh.cells_in_complex_end(); ++c)
  {
    for (int i = 0; i < 4; ++i)
    {
      answer.tetrahedra.push_back(vertex(c->vertex(i)));
    }
  }
  for (auto e = mesh.edges_in_complex_begin(); e != mesh.edges_in_complex_end(); ++e)
  {
    const auto segment = segmentOf.find(mesh.curve_index(*e));
    if (segment != segmentOf.end())
    {
      answer.segmentEdges.insert(answer.segmentEdges.end(),
        { vertex(e->first->vertex(e->second)), vertex(e->first->vertex(e->third)),
          segment->second });
    }
  }
  answer.status = MesherStatus::Done;
  return answer;
}
}

int main()
{
  return coronary::WorkerMain(Mesh);
}
