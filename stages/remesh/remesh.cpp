#include "stages/remesh/remesh.h"

#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Random.h>
#include <fmt/format.h>

#include "geometry/cgal_mesh.h"
#include "pipeline/error.h"

namespace geocage::stages {

namespace pmp = CGAL::Polygon_mesh_processing;
using geometry::MeshReport;
using geometry::TriangleMesh;
using pipeline::Fault;
using pipeline::UserError;

void RemeshParams::visit(pipeline::Fields& f) {
  f("edge_length_m", edge_length_m, {0.0002, 1}, "wanted edge length");
  f("sweeps", sweeps, {1, 100}, "rounds of split, collapse, flip, smooth, project");
  f("seed", seed, "of CGAL's random source");
}

namespace {

constexpr double most_vertices = 2e6;

void refuse_odd_sizes(const RemeshParams& params, const MeshReport& report) {
  const double h = params.edge_length_m;
  const double vertices = report.area_m2 / (h * h * std::sqrt(3.0) / 2);
  if (h > report.diagonal_m() / 4)
    throw UserError(
        Fault::configuration, "remesh.edge_length_m",
        fmt::format("{} m is too long for an object with a diagonal of {:.4g} m", h, report.diagonal_m()),
        "take at most a quarter of it");
  if (vertices > most_vertices)
    throw UserError(Fault::configuration, "remesh.edge_length_m",
                    fmt::format("{} m would give {:.0f} vertices on this object", h, vertices),
                    "take a longer edge");
}

void refuse_bad_result(const MeshReport& before, const MeshReport& after, const geometry::CgalMesh& mesh) {
  if (!after.closed_manifold())
    throw UserError(Fault::geometry, "remesh",
                    "the remeshed surface is not a closed manifold: " + geometry::flaw(after));
  if (after.euler != before.euler)
    throw UserError(Fault::geometry, "remesh",
                    fmt::format("the Euler characteristic went from {} to {}", before.euler, after.euler),
                    "take a shorter remesh.edge_length_m");
  std::vector<std::pair<geometry::CgalMesh::Face_index, geometry::CgalMesh::Face_index>> crossings;
  pmp::self_intersections(mesh, std::back_inserter(crossings));
  if (!crossings.empty())
    throw UserError(
        Fault::geometry, "remesh",
        fmt::format("triangles {} and {} cut each other ({} such pairs)", unsigned(crossings[0].first),
                    unsigned(crossings[0].second), crossings.size()),
        "take a shorter remesh.edge_length_m, or smooth more by reconstruct.samples_per_node");
}

}  // namespace

TriangleMesh remesh(const RemeshParams& params, pipeline::Run& run, const TriangleMesh& mesh) {
  const MeshReport before = geometry::check_mesh(mesh);
  if (!before.closed_manifold())
    throw UserError(Fault::geometry, "remesh",
                    "the surface is not a closed manifold: " + geometry::flaw(before));
  refuse_odd_sizes(params, before);
  CGAL::get_default_random() = CGAL::Random(static_cast<unsigned>(params.seed));  // its default is the clock
  geometry::CgalMesh work = geometry::to_cgal(mesh);
  pmp::isotropic_remeshing(work.faces(), params.edge_length_m, work,
                           pmp::parameters::number_of_iterations(static_cast<unsigned>(params.sweeps)));
  work.collect_garbage();
  TriangleMesh result = geometry::from_cgal(work);
  const MeshReport after = geometry::check_mesh(result);
  refuse_bad_result(before, after, work);
  run.metric("vertices", after.vertices);
  run.metric("mean_edge_m", after.mean_edge_m);
  run.metric("edge_cv", after.edge_cv);
  run.metric("min_angle_rad", after.min_angle_rad);
  run.metric("euler", after.euler);
  return result;
}

}  // namespace geocage::stages
