#include "TetrahedralMesh.h"

#include "MeshQuality.h"
#include "MeshingPieces.h"
#include "PartialProgress.h"
#include "Require.h"
#include "TetrahedralBoundary.h"
#include "TriangleIntersections.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include <unistd.h>

namespace coronary
{
namespace
{
using Edge = std::pair<std::int64_t, std::int64_t>;

/// When a flatter tetrahedron is left, it is tried once more; radians (5 degrees).
constexpr double flatAngle = 0.0873;

const char* WorkerName(TetrahedralBackend backend)
{
  return backend == TetrahedralBackend::Cgal ? "coronary-cgal-worker" : "coronary-tetgen-worker";
}

/// Everything between the input and the mesh.
class Maker
{
public:
  Maker(const TetrahedralMeshInput& input, const TetrahedralMeshSettings& settings,
    const ProgressCallback& progress)
    : Input(input)
    , Settings(settings)
    , Progress(progress)
  {
  }

  TetrahedralMesh Run()
  {
    this->Settings.Validate();
    this->CheckSkeletonLists();
    this->Surface = CheckSurface(this->Input.points, this->Input.triangles);
    this->Mesh.warnings = this->Surface.warnings;
    this->ChooseBackend();
    this->Radii = std::make_unique<LocalRadius>(this->Input, this->Surface);
    Report(this->Progress, 0.02);
    try
    {
      CheckSelfIntersections(this->Surface);
    }
    catch (const SurfaceError& error)
    {
      if (!this->Settings.repair || !this->Repair(error.cells))
      {
        throw;
      }
    }
    Report(this->Progress, 0.05);
    this->MakePieces();
    Report(this->Progress, 0.08);
    std::vector<MesherAnswer> answers;
    try
    {
      answers = this->RunBackend(PartOf(this->Progress, 0.08, 0.7));
    }
    catch (const MesherFailure& failure)
    {
      if (!this->Settings.repair || this->Mesh.tries > 1 || !this->Repair({}))
      {
        throw;
      }
      this->Mesh.warnings.push_back(
        "the first try failed (" + std::string(failure.what()) + "), the second one succeeded");
      this->MakePieces();
      answers = this->RunBackend(PartOf(this->Progress, 0.4, 0.7));
    }
    this->Assemble(answers);
    this->TryAgainWhenFlat();
    this->CheckVolumes();
    Report(this->Progress, 1.0);
    return std::move(this->Mesh);
  }

private:
  /// The retry when a tetrahedron stayed flat: the surface beside it moves within the repair limit.
  void TryAgainWhenFlat()
  {
    if (!this->Settings.improve || this->MinimumDihedral() >= flatAngle)
    {
      return;
    }
    const std::vector<std::int64_t> cells = this->SurfaceBesideFlat();
    if (this->Settings.repair && this->Mesh.tries == 1 && !cells.empty())
    {
      const double before = this->MinimumDihedral();
      TetrahedralMesh first = std::move(this->Mesh);
      this->Mesh = {};
      this->Mesh.backend = first.backend;
      this->Mesh.warnings = this->Surface.warnings;
      bool better = false;
      try
      {
        if (HasInnerSkeleton(first) ? this->Lift(cells) : this->Repair(cells))
        {
          this->MakePieces();
          this->Assemble(this->RunBackend({}));
          better = this->MinimumDihedral() > before;
        }
      }
      catch (const MesherFailure&)
      {
        better = false;
      }
      catch (const std::invalid_argument&)
      {
        better = false; // the skeleton leaves the surface that was moved
      }
      if (!better)
      {
        this->Mesh = std::move(first);
      }
    }
    const auto flattest =
      std::min_element(this->Mesh.minimumDihedral.begin(), this->Mesh.minimumDihedral.end());
    if (*flattest < flatAngle)
    {
      const Tetrahedron& t = this->Mesh.tetrahedra[flattest - this->Mesh.minimumDihedral.begin()];
      char text[160];
      std::snprintf(text, sizeof text,
        "a flat tetrahedron is left at %s: least dihedral angle %.3g degrees",
        Describe(this->Mesh.points[t[0]]).c_str(), *flattest * 180.0 / M_PI);
      this->Mesh.warnings.emplace_back(text);
    }
  }

  /// Whether a flat tetrahedron has a point of the skeleton that is not on the surface.
  static bool HasInnerSkeleton(const TetrahedralMesh& mesh)
  {
    std::vector<char> onSurface(mesh.points.size(), 0);
    for (const Triangle& t : mesh.boundary)
    {
      for (const std::int64_t corner : t)
      {
        onSurface[corner] = 1;
      }
    }
    for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i)
    {
      for (const std::int64_t point : mesh.tetrahedra[i])
      {
        if (mesh.minimumDihedral[i] < flatAngle && onSurface[point] == 0 &&
          mesh.skeletonPoint[point] >= 0)
        {
          return true;
        }
      }
    }
    return false;
  }

  /**
   * Moves the triangles' points outwards, away from a skeleton that grazes the wall: who is more than
   * 1 % of the radius below it is at twice that depth then. False when triangles would cut each other.
   */
  bool Lift(const std::vector<std::int64_t>& cells)
  {
    this->Mesh.tries = 2;
    std::vector<Vector3>& points = this->Surface.points;
    const std::vector<Vector3> before = points;
    std::vector<char> moves(points.size(), 0);
    for (const std::int64_t cell : cells)
    {
      for (const std::int64_t corner : this->Surface.triangles[cell])
      {
        moves[corner] = 1;
      }
    }
    std::vector<Vector3> normals(points.size(), Vector3::Zero());
    for (const Triangle& t : this->Surface.triangles)
    {
      const Vector3 normal = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
      for (const std::int64_t corner : t)
      {
        normals[corner] += normal;
      }
    }
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      if (moves[i] != 0)
      {
        const double distance = 0.99 * this->Settings.repairLimit * this->Radii->At(before[i]);
        points[i] += distance * normals[i].normalized();
      }
    }
    if (!FindSelfIntersections(points, this->Surface.triangles).empty())
    {
      points = before;
      return false;
    }
    this->SayRepaired(before);
    return true;
  }

  void SayRepaired(const std::vector<Vector3>& before)
  {
    double maximum = 0.0;
    for (std::size_t i = 0; i < before.size(); ++i)
    {
      maximum = std::max(maximum, (this->Surface.points[i] - before[i]).norm());
    }
    this->Mesh.repairDisplacement = maximum;
    this->Mesh.warnings.push_back(
      "the surface was repaired; no point moved farther than " + Millimetres(maximum));
  }

  double MinimumDihedral() const
  {
    return *std::min_element(this->Mesh.minimumDihedral.begin(), this->Mesh.minimumDihedral.end());
  }

  /// Triangles of the surface that have a point of a flat tetrahedron.
  std::vector<std::int64_t> SurfaceBesideFlat() const
  {
    std::vector<char> flat(this->Mesh.points.size(), 0);
    for (std::size_t i = 0; i < this->Mesh.tetrahedra.size(); ++i)
    {
      if (this->Mesh.minimumDihedral[i] < flatAngle)
      {
        for (const std::int64_t point : this->Mesh.tetrahedra[i])
        {
          flat[point] = 1;
        }
      }
    }
    std::vector<std::int64_t> cells;
    for (std::size_t i = 0; i < this->Mesh.boundary.size(); ++i)
    {
      const Triangle& t = this->Mesh.boundary[i];
      if (flat[t[0]] != 0 || flat[t[1]] != 0 || flat[t[2]] != 0)
      {
        cells.push_back(this->Mesh.boundaryCell[i]);
      }
    }
    return cells;
  }

  void CheckSkeletonLists() const
  {
    const auto count = static_cast<std::int64_t>(this->Input.skeletonPoints.size());
    if (!this->Input.skeletonRadius.empty() &&
      static_cast<std::int64_t>(this->Input.skeletonRadius.size()) != count)
    {
      throw std::invalid_argument("the skeleton needs one radius for each point");
    }
    for (std::int64_t i = 0; i < count; ++i)
    {
      if (!this->Input.skeletonPoints[i].allFinite())
      {
        throw std::invalid_argument("skeleton point " + std::to_string(i) + " is not finite");
      }
      if (!this->Input.skeletonRadius.empty() &&
        !(this->Input.skeletonRadius[i] > 0.0 && std::isfinite(this->Input.skeletonRadius[i])))
      {
        throw std::invalid_argument(
          "the radius of skeleton point " + std::to_string(i) + " is not positive");
      }
    }
    for (std::size_t i = 0; i < this->Input.skeletonEdges.size(); ++i)
    {
      const auto& [a, b] = this->Input.skeletonEdges[i];
      if (a < 0 || b < 0 || a >= count || b >= count)
      {
        throw std::invalid_argument(
          "skeleton edge " + std::to_string(i) + " has a point that does not exist");
      }
    }
  }

  void ChooseBackend()
  {
    TetrahedralBackend backend = this->Settings.backend;
    if (backend == TetrahedralBackend::Automatic)
    {
      backend =
        FindMesher(WorkerName(TetrahedralBackend::TetGen), this->Settings.workerFolder).empty()
        ? TetrahedralBackend::Cgal
        : TetrahedralBackend::TetGen;
    }
    this->Executable = FindMesher(WorkerName(backend), this->Settings.workerFolder);
    if (this->Executable.empty())
    {
      const bool any = this->Settings.backend == TetrahedralBackend::Automatic;
      throw MesherFailure(any
          ? std::string(
              "neither coronary-tetgen-worker nor coronary-cgal-worker is there: the mesher "
              "was built without TetGen and without CGAL")
          : std::string(WorkerName(backend)) + " is not there: the mesher was built without " +
            (backend == TetrahedralBackend::Cgal ? "CGAL" : "TetGen"));
    }
    this->Mesh.backend = backend;
  }

  /**
   * Moves points of the given triangles (of thin and folded ones, when there are none) towards
   * their neighbours, by less than the limit. True when no triangles cut each other any more.
   */
  bool Repair(std::vector<std::int64_t> cells)
  {
    this->Mesh.tries = 2;
    const std::vector<Vector3> before = this->Surface.points;
    std::vector<Vector3>& points = this->Surface.points;
    std::vector<std::vector<std::int64_t>> neighbours(points.size());
    for (const Triangle& t : this->Surface.triangles)
    {
      for (int i = 0; i < 3; ++i)
      {
        neighbours[t[i]].push_back(t[(i + 1) % 3]);
      }
    }
    if (cells.empty())
    {
      for (std::size_t i = 0; i < this->Surface.triangles.size(); ++i)
      {
        const Triangle& t = this->Surface.triangles[i];
        double longest = 0.0;
        for (int k = 0; k < 3; ++k)
        {
          longest = std::max(longest, (points[t[k]] - points[t[(k + 1) % 3]]).squaredNorm());
        }
        const double area = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).norm();
        if (area < 0.1 * longest)
        {
          cells.push_back(static_cast<std::int64_t>(i));
        }
      }
    }
    bool clean = false;
    for (int round = 0; round < 30 && !clean; ++round)
    {
      std::vector<std::int64_t> moved;
      for (const std::int64_t cell : cells)
      {
        for (const std::int64_t corner : this->Surface.triangles[cell])
        {
          moved.push_back(corner);
          moved.insert(moved.end(), neighbours[corner].begin(), neighbours[corner].end());
        }
      }
      std::sort(moved.begin(), moved.end());
      moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
      std::vector<Vector3> places;
      for (const std::int64_t point : moved)
      {
        Vector3 mean = Vector3::Zero();
        for (const std::int64_t other : neighbours[point])
        {
          mean += points[other];
        }
        mean /= static_cast<double>(neighbours[point].size());
        const double limit = 0.99 * this->Settings.repairLimit * this->Radii->At(before[point]);
        Vector3 shift = points[point] + 0.5 * (mean - points[point]) - before[point];
        if (shift.norm() > limit)
        {
          shift *= limit / shift.norm();
        }
        places.emplace_back(before[point] + shift);
      }
      for (std::size_t i = 0; i < moved.size(); ++i)
      {
        points[moved[i]] = places[i];
      }
      cells.clear();
      for (const auto& [s, t] : FindSelfIntersections(points, this->Surface.triangles))
      {
        cells.push_back(s);
        cells.push_back(t);
      }
      clean = cells.empty();
    }
    if (!clean)
    {
      points = before;
      return false;
    }
    this->SayRepaired(before);
    return true;
  }

  void MakePieces()
  {
    MeshingPieces made =
      MakeMeshingPieces(this->Input, this->Settings, this->Surface, *this->Radii);
    this->Pieces = std::move(made.pieces);
    this->Origin = made.origin;
    this->Mesh.warnings.insert(
      this->Mesh.warnings.end(), made.warnings.begin(), made.warnings.end());
  }

  std::vector<MesherAnswer> RunBackend(const ProgressCallback& progress)
  {
    std::vector<MesherRequest> requests;
    for (const MeshingPiece& piece : this->Pieces)
    {
      MesherRequest request;
      request.radiusEdgeRatio = this->Settings.radiusEdgeRatio;
      request.minimumDihedral = this->Settings.minimumDihedral * 180.0 / M_PI;
      request.timeLimit = this->Settings.timeLimit;
      request.memoryLimit = 0.75 * static_cast<double>(::sysconf(_SC_PHYS_PAGES)) *
        static_cast<double>(::sysconf(_SC_PAGE_SIZE));
      request.distance = 0.05;
      for (const Vector3& p : piece.points)
      {
        request.points.insert(request.points.end(), p.data(), p.data() + 3);
      }
      const bool sized =
        this->Settings.sizeFactor > 0.0 || this->Mesh.backend == TetrahedralBackend::Cgal;
      request.sizes = sized ? piece.sizes : std::vector<double>(piece.points.size(), 0.0);
      for (const Triangle& t : piece.triangles)
      {
        request.triangles.insert(request.triangles.end(), t.begin(), t.end());
      }
      for (const auto& [a, b] : piece.segments)
      {
        request.segments.insert(request.segments.end(), { a, b });
      }
      if (this->Mesh.backend == TetrahedralBackend::Cgal)
      {
        AddRims(piece, request);
      }
      requests.push_back(std::move(request));
    }
    std::vector<MesherAnswer> answers =
      RunMeshers(this->Executable, requests, this->Settings.timeLimit, progress);
    for (std::size_t k = 0; k < answers.size(); ++k)
    {
      if (answers[k].status != MesherStatus::Done)
      {
        throw MesherFailure(this->Explain(answers[k], this->Pieces[k]));
      }
    }
    return answers;
  }

  /// Edges where the surface bends by more than 50 degrees.
  static void AddRims(const MeshingPiece& piece, MesherRequest& request)
  {
    std::map<Edge, Vector3> normals;
    for (const Triangle& t : piece.triangles)
    {
      const Vector3& a = piece.points[t[0]];
      const Vector3 normal = (piece.points[t[1]] - a).cross(piece.points[t[2]] - a).normalized();
      for (int i = 0; i < 3; ++i)
      {
        const Edge edge = std::minmax(t[i], t[(i + 1) % 3]);
        const auto [other, isNew] = normals.try_emplace(edge, normal);
        if (!isNew && other->second.dot(normal) < std::cos(50.0 * M_PI / 180.0))
        {
          request.rims.insert(request.rims.end(), { edge.first, edge.second });
        }
      }
    }
  }

  /// What a worker's status means, and the first place on the surface that it names.
  std::string Explain(const MesherAnswer& answer, const MeshingPiece& piece) const
  {
    const std::string name = WorkerName(this->Mesh.backend);
    std::string text;
    switch (answer.status)
    {
      case MesherStatus::OutOfMemory:
        text = " ran out of memory";
        break;
      case MesherStatus::Intersection:
        text = " found facets or segments that cut each other";
        break;
      case MesherStatus::SmallFeature:
        text = " found a feature that is too small";
        break;
      case MesherStatus::CloseFacets:
        text = " found two facets that are too close to each other";
        break;
      case MesherStatus::BadInput:
      case MesherStatus::BadRequest:
        text = " did not accept its input";
        break;
      case MesherStatus::TimeLimit:
        text = " ran out of time";
        break;
      default:
        text = " failed inside";
    }
    // TetGen names a facet by its marker: "#123".
    const std::size_t mark = answer.message.find('#');
    if (mark != std::string::npos)
    {
      const long facet = std::atol(answer.message.c_str() + mark + 1) - 1;
      if (facet >= 0 && facet < static_cast<long>(piece.triangles.size()))
      {
        text += "; the first is " +
          DescribeCells(
            { piece.sourceCell[facet] }, piece.points[piece.triangles[facet][0]] + this->Origin);
      }
    }
    if (!answer.message.empty())
    {
      text += "; it said: " + answer.message.substr(0, 300);
    }
    return name + text;
  }

  void Assemble(const std::vector<MesherAnswer>& answers)
  {
    struct ComponentMesh
    {
      std::vector<Vector3> points;
      std::vector<Tetrahedron> cells;
      std::vector<char> fixed;
      std::vector<Edge> edges;
      ImprovementCounts counts;
    };
    std::vector<ComponentMesh> parts(answers.size());
    for (std::size_t k = 0; k < answers.size(); ++k)
    {
      const MesherAnswer& answer = answers[k];
      const MeshingPiece& piece = this->Pieces[k];
      ComponentMesh& part = parts[k];
      for (std::size_t i = 0; i + 2 < answer.points.size(); i += 3)
      {
        part.points.emplace_back(answer.points[i], answer.points[i + 1], answer.points[i + 2]);
        if (!part.points.back().allFinite())
        {
          throw MesherFailure(
            std::string(WorkerName(this->Mesh.backend)) + " gave a point that is not finite");
        }
      }
      for (std::size_t i = 0; i + 3 < answer.tetrahedra.size(); i += 4)
      {
        Tetrahedron t{ answer.tetrahedra[i], answer.tetrahedra[i + 1], answer.tetrahedra[i + 2],
          answer.tetrahedra[i + 3] };
        if (TetrahedronVolume(
              part.points[t[0]], part.points[t[1]], part.points[t[2]], part.points[t[3]]) < 0.0)
        {
          std::swap(t[2], t[3]);
        }
        part.cells.push_back(t);
      }
      part.fixed.assign(part.points.size(), 0);
      for (std::size_t i = 0; i + 2 < answer.segmentEdges.size(); i += 3)
      {
        const std::int64_t a = answer.segmentEdges[i];
        const std::int64_t b = answer.segmentEdges[i + 1];
        const std::int64_t segment = answer.segmentEdges[i + 2];
        const auto count = static_cast<std::int64_t>(part.points.size());
        if (a < 0 || b < 0 || a >= count || b >= count || segment < 0 ||
          segment >= static_cast<std::int64_t>(piece.segments.size()))
        {
          throw MesherFailure(std::string(WorkerName(this->Mesh.backend)) +
            " gave an edge of the skeleton that does not exist");
        }
        part.edges.emplace_back(a, b);
        part.fixed[a] = 1;
        part.fixed[b] = 1;
      }
      if (this->Mesh.backend == TetrahedralBackend::TetGen)
      {
        if (part.points.size() < piece.points.size())
        {
          throw MesherFailure("coronary-tetgen-worker lost points of its input");
        }
        std::fill_n(part.fixed.begin(), piece.points.size(), 1);
      }
      for (const auto& [face, cell] : BoundaryFaces(part.cells))
      {
        for (const std::int64_t corner : face)
        {
          part.fixed[corner] = 1;
        }
      }
    }
    if (this->Settings.improve)
    {
      ImprovementSettings improvement;
      improvement.wantedSine = std::sin(std::max(this->Settings.minimumDihedral, 0.1));
      const double unit = this->Settings.unitLength;
      improvement.minimumVolume = this->Settings.minimumVolume / (unit * unit * unit);
      ParallelFor(
        static_cast<std::int64_t>(parts.size()), 1,
        [&](std::int64_t first, std::int64_t last)
        {
          for (std::int64_t k = first; k < last; ++k)
          {
            parts[k].counts = ImproveTetrahedra(
              parts[k].points, parts[k].cells, parts[k].fixed, parts[k].edges, improvement);
          }
        },
        PartOf(this->Progress, 0.7, 0.9));
    }
    for (std::size_t k = 0; k < parts.size(); ++k)
    {
      this->Append(
        answers[k], this->Pieces[k], parts[k].points, parts[k].cells, static_cast<int>(k));
      const ImprovementCounts& counts = parts[k].counts;
      this->Mesh.improvements.moves += counts.moves;
      this->Mesh.improvements.edgeRemovals += counts.edgeRemovals;
      this->Mesh.improvements.faceFlips += counts.faceFlips;
      this->Mesh.improvements.contractions += counts.contractions;
      this->Mesh.improvements.insertions += counts.insertions;
    }
    Report(this->Progress, 0.95);
    TetrahedraQuality quality = MeasureTetrahedra(this->Mesh.points, this->Mesh.tetrahedra);
    this->Mesh.volume = std::move(quality.volume);
    this->Mesh.minimumDihedral = std::move(quality.minimumDihedral);
    this->Mesh.radiusEdgeRatio = std::move(quality.radiusEdgeRatio);
  }

  void Append(const MesherAnswer& answer, const MeshingPiece& piece,
    const std::vector<Vector3>& points, const std::vector<Tetrahedron>& cells, int region)
  {
    const bool keepsSurface = this->Mesh.backend == TetrahedralBackend::TetGen;
    std::vector<std::int64_t> number(points.size(), -1);
    std::vector<char> used(points.size(), 0);
    for (const Tetrahedron& t : cells)
    {
      for (const std::int64_t corner : t)
      {
        used[corner] = 1;
      }
    }
    std::map<std::array<double, 3>, std::int64_t> places;
    if (!keepsSurface)
    {
      for (std::size_t i = 0; i < piece.points.size(); ++i)
      {
        if (piece.skeletonPoint[i] >= 0)
        {
          places[{ piece.points[i][0], piece.points[i][1], piece.points[i][2] }] =
            static_cast<std::int64_t>(i);
        }
      }
    }
    std::size_t found = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      if (used[i] == 0)
      {
        continue;
      }
      number[i] = static_cast<std::int64_t>(this->Mesh.points.size());
      std::int64_t origin = -1;
      if (keepsSurface)
      {
        origin = i < piece.points.size() ? static_cast<std::int64_t>(i) : -1;
      }
      else
      {
        const auto place = places.find({ points[i][0], points[i][1], points[i][2] });
        origin = place != places.end() ? place->second : -1;
      }
      const std::int64_t skeleton = origin >= 0 ? piece.skeletonPoint[origin] : -1;
      const std::int64_t surface = origin >= 0 && keepsSurface ? piece.surfacePoint[origin] : -1;
      found += skeleton >= 0 ? 1 : 0;
      Vector3 position = points[i] + this->Origin;
      // What was not moved has its own coordinates again, to the last bit.
      if (skeleton >= 0 &&
        piece.points[origin] == this->Input.skeletonPoints[skeleton] - this->Origin)
      {
        position = this->Input.skeletonPoints[skeleton];
      }
      else if (surface >= 0 && piece.points[origin] == this->Input.points[surface] - this->Origin)
      {
        position = this->Input.points[surface];
      }
      this->Mesh.points.push_back(position);
      this->Mesh.surfacePoint.push_back(surface);
      this->Mesh.skeletonPoint.push_back(skeleton);
    }
    const auto wanted = static_cast<std::size_t>(std::count_if(piece.skeletonPoint.begin(),
      piece.skeletonPoint.end(), [](std::int64_t id) { return id >= 0; }));
    if (found != wanted)
    {
      throw MesherFailure(std::string(WorkerName(this->Mesh.backend)) + " lost " +
        std::to_string(wanted - found) + " skeleton points");
    }
    const auto base = static_cast<std::int64_t>(this->Mesh.tetrahedra.size());
    for (const Tetrahedron& t : cells)
    {
      this->Mesh.tetrahedra.push_back({ number[t[0]], number[t[1]], number[t[2]], number[t[3]] });
      this->Mesh.region.push_back(region);
    }
    this->AppendBoundary(piece, points, cells, number, base);
    this->AppendSkeleton(answer, piece, cells, points.size(), number);
  }

  void AppendBoundary(const MeshingPiece& piece, const std::vector<Vector3>& points,
    const std::vector<Tetrahedron>& cells, const std::vector<std::int64_t>& number,
    std::int64_t base)
  {
    const bool keepsSurface = this->Mesh.backend == TetrahedralBackend::TetGen;
    std::map<Triangle, std::int64_t> source;
    std::unique_ptr<TriangleBvh> tree;
    if (keepsSurface)
    {
      for (std::size_t i = 0; i < piece.triangles.size(); ++i)
      {
        Triangle sorted = piece.triangles[i];
        std::sort(sorted.begin(), sorted.end());
        source[sorted] = piece.sourceCell[i];
      }
    }
    else
    {
      tree = std::make_unique<TriangleBvh>(piece.points, piece.triangles);
    }
    std::size_t kept = 0;
    for (const auto& [face, cell] : BoundaryFaces(cells))
    {
      std::int64_t origin = -1;
      if (keepsSurface)
      {
        Triangle sorted = face;
        std::sort(sorted.begin(), sorted.end());
        const auto known = source.find(sorted);
        if (known != source.end())
        {
          origin = known->second;
          ++kept;
        }
      }
      else
      {
        const Vector3 centre = (points[face[0]] + points[face[1]] + points[face[2]]) / 3.0;
        origin = piece.sourceCell[tree->Closest(centre).triangle];
        ++kept;
      }
      this->Mesh.boundary.push_back({ number[face[0]], number[face[1]], number[face[2]] });
      this->Mesh.boundaryCell.push_back(origin);
      this->Mesh.boundaryElement.push_back(base + cell);
    }
    if (keepsSurface && (kept != piece.triangles.size() || kept != this->CountFrom(base)))
    {
      throw MesherFailure("coronary-tetgen-worker changed the surface: " + std::to_string(kept) +
        " of " + std::to_string(piece.triangles.size()) + " triangles are left");
    }
  }

  std::size_t CountFrom(std::int64_t base) const
  {
    return static_cast<std::size_t>(std::count_if(this->Mesh.boundaryElement.begin(),
      this->Mesh.boundaryElement.end(), [base](std::int64_t cell) { return cell >= base; }));
  }

  void AppendSkeleton(const MesherAnswer& answer, const MeshingPiece& piece,
    const std::vector<Tetrahedron>& cells, std::size_t pointCount,
    const std::vector<std::int64_t>& number)
  {
    std::vector<char> onSkeleton(pointCount, 0);
    for (std::size_t i = 0; i + 2 < answer.segmentEdges.size(); i += 3)
    {
      onSkeleton[answer.segmentEdges[i]] = 1;
      onSkeleton[answer.segmentEdges[i + 1]] = 1;
    }
    std::vector<Edge> present;
    for (const Tetrahedron& t : cells)
    {
      for (int i = 0; i < 4; ++i)
      {
        for (int j = i + 1; j < 4; ++j)
        {
          if (onSkeleton[t[i]] != 0 && onSkeleton[t[j]] != 0)
          {
            present.emplace_back(std::minmax(t[i], t[j]));
          }
        }
      }
    }
    std::sort(present.begin(), present.end());
    std::vector<char> covered(piece.segments.size(), 0);
    for (std::size_t i = 0; i + 2 < answer.segmentEdges.size(); i += 3)
    {
      const std::int64_t a = answer.segmentEdges[i];
      const std::int64_t b = answer.segmentEdges[i + 1];
      const std::int64_t segment = answer.segmentEdges[i + 2];
      if (std::binary_search(present.begin(), present.end(), Edge(std::minmax(a, b))))
      {
        covered[segment] = 1;
        this->Mesh.skeletonEdges.push_back({ number[a], number[b], piece.segmentSource[segment] });
      }
      else
      {
        covered[segment] = 2;
      }
    }
    for (std::size_t i = 0; i < covered.size(); ++i)
    {
      if (covered[i] != 1)
      {
        const std::int64_t edge = piece.segmentSource[i];
        throw MesherFailure(std::string(WorkerName(this->Mesh.backend)) + " lost skeleton edge " +
          std::to_string(edge) + " at " +
          Describe(this->Input.skeletonPoints[this->Input.skeletonEdges[edge].first]));
      }
    }
  }

  void CheckVolumes() const
  {
    const TetrahedralMesh& mesh = this->Mesh;
    const auto minimum = std::min_element(mesh.volume.begin(), mesh.volume.end());
    const double unit = this->Settings.unitLength;
    if (!(*minimum * unit * unit * unit > this->Settings.minimumVolume))
    {
      const Tetrahedron& t = mesh.tetrahedra[minimum - mesh.volume.begin()];
      char text[160];
      std::snprintf(text, sizeof text,
        "a tetrahedron at %s has the volume %.3g mm^3, the least allowed is %.3g",
        Describe(mesh.points[t[0]]).c_str(), *minimum * unit * unit * unit,
        this->Settings.minimumVolume);
      throw MesherFailure(text);
    }
  }

  const TetrahedralMeshInput& Input;
  const TetrahedralMeshSettings& Settings;
  const ProgressCallback& Progress;
  ClosedSurface Surface;
  std::unique_ptr<LocalRadius> Radii;
  std::string Executable;
  Vector3 Origin = Vector3::Zero();
  std::vector<MeshingPiece> Pieces;
  TetrahedralMesh Mesh;
};
}

void TetrahedralMeshSettings::Validate() const
{
  Require(
    this->backend >= TetrahedralBackend::Automatic && this->backend <= TetrahedralBackend::Cgal,
    "there is no such backend");
  Require(this->outside == OutsidePolicy::Refuse || this->outside == OutsidePolicy::LeaveOut,
    "there is no such treatment of skeleton points outside");
  Require(this->radiusEdgeRatio >= 1.1 && this->radiusEdgeRatio <= 10.0,
    "the radius-edge ratio must be between 1.1 and 10");
  Require(this->minimumDihedral >= 0.0 && this->minimumDihedral <= 0.3491,
    "the minimum dihedral angle must be between 0 and 20 degrees");
  Require(this->minimumVolume >= 0.0 && std::isfinite(this->minimumVolume),
    "the minimum volume must not be negative");
  Require(this->unitLength > 0.0 && std::isfinite(this->unitLength),
    "the length of the unit must be positive");
  Require(this->sizeFactor == 0.0 || (this->sizeFactor >= 0.05 && this->sizeFactor <= 10.0),
    "the size factor must be 0 or between 0.05 and 10");
  Require(this->repairLimit > 0.0 && this->repairLimit <= 0.1,
    "the repair limit must be positive and at most 0.1");
  Require(
    this->timeLimit > 0.0 && std::isfinite(this->timeLimit), "the time limit must be positive");
}

bool HasTetrahedralBackend(TetrahedralBackend backend, const std::string& workerFolder)
{
  const auto has = [&](TetrahedralBackend b)
  { return !FindMesher(WorkerName(b), workerFolder).empty(); };
  return backend == TetrahedralBackend::Automatic
    ? has(TetrahedralBackend::TetGen) || has(TetrahedralBackend::Cgal)
    : has(backend);
}

TetrahedralMesh MakeTetrahedralMesh(const TetrahedralMeshInput& input,
  const TetrahedralMeshSettings& settings, const ProgressCallback& progress)
{
  return Maker(input, settings, progress).Run();
}
}
