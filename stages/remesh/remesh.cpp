#include "stages/remesh/remesh.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "geometry/crossings.h"
#include "geometry/surface_distance.h"
#include "pipeline/error.h"
#include "stages/remesh/isotropic.h"

namespace geocage::stages {

using geometry::MeshReport;
using geometry::SurfaceDistance;
using geometry::TriangleMesh;
using pipeline::Fault;
using pipeline::UserError;

void RemeshParams::visit(pipeline::Fields& f) {
  f("size_by", size_by, {"edge_length", "vertices"}, "which of the next two is asked for");
  f("edge_length_m", edge_length_m, {0.0002, 1}, "wanted edge length");
  f("vertices", vertices, {20, 2000000}, "wanted number of vertices");
  f("sweeps", sweeps, {1, 100}, "rounds of split, collapse, flip, smooth, project");
}

namespace {

constexpr double most_vertices = 2e6;
const double area_per_vertex = std::sqrt(3.0) / 2;  // of a net of equilateral triangles with edges of 1

/// The wanted number of vertices, and refusal of sizes that don't suit the object.
int wanted_vertices(const RemeshParams& params, const MeshReport& report) {
  const bool by_edge = params.size_by == "edge_length";
  const double vertices = by_edge ? report.area_m2 / (std::pow(params.edge_length_m, 2) * area_per_vertex)
                                  : static_cast<double>(params.vertices);
  const double h = by_edge ? params.edge_length_m : std::sqrt(report.area_m2 / vertices / area_per_vertex);
  if (h > report.diagonal_m() / 4)
    throw UserError(
        Fault::configuration, by_edge ? "remesh.edge_length_m" : "remesh.vertices",
        by_edge ? fmt::format("{} m is too long for an object with a diagonal of {:.4g} m", h,
                              report.diagonal_m())
                : fmt::format("{} vertices are too few: edges would be {:.3g} m long on an object with a "
                              "diagonal of {:.4g} m",
                              params.vertices, h, report.diagonal_m()),
        "edges may be a quarter of the diagonal at most");
  if (vertices > most_vertices)
    throw UserError(Fault::configuration, "remesh.edge_length_m",
                    fmt::format("{} m would give {:.0f} vertices on this object", h, vertices),
                    "take a longer edge");
  return static_cast<int>(std::lround(vertices));
}

void refuse_bad_result(const MeshReport& before, const MeshReport& after, const TriangleMesh& mesh) {
  if (!after.closed_manifold())
    throw UserError(Fault::geometry, "remesh",
                    "the remeshed surface is not a closed manifold: " + geometry::flaw(after));
  if (after.euler != before.euler)
    throw UserError(Fault::geometry, "remesh",
                    fmt::format("the Euler characteristic went from {} to {}", before.euler, after.euler),
                    "take a shorter remesh.edge_length_m");
  const auto crossings = geometry::crossing_triangles(mesh);
  if (crossings.empty()) return;
  const auto [f, g] = crossings.front();
  const auto& p = mesh.vertices[mesh.triangles[f][0]];
  throw UserError(
      Fault::geometry, "remesh",
      fmt::format(
          "triangles {} and {} cut each other near ({:.4g}, {:.4g}, {:.4g}) m ({} such pairs): walls or "
          "handles there are thinner than the {:.3g} m edges can follow",
          f, g, p.x(), p.y(), p.z(), crossings.size(), after.mean_edge_m),
      "take a shorter remesh.edge_length_m, or smooth more by reconstruct.samples_per_node");
}

/// The input's values at the feet of the output's vertices, linear in each triangle.
std::vector<double> carried_over(const TriangleMesh& from, const SurfaceDistance& surface,
                                 const TriangleMesh& to) {
  std::vector<double> values;
  if (from.observed.empty()) return values;
  int nearest = 0;
  for (const auto& p : to.vertices) {
    const auto foot = surface.foot(p, nearest);  // sets `nearest`
    const auto weights = surface.barycentric(foot.point_O, nearest);
    double value = 0;
    for (int i = 0; i < 3; ++i) value += weights[i] * from.observed[from.triangles[nearest][i]];
    values.push_back(std::clamp(value, 0.0, 1.0));
  }
  return values;
}

void tell_metrics(pipeline::Run& run, const MeshReport& report, int wanted, const geometry::Deviation& lost,
                  const geometry::Deviation& added) {
  run.metric("vertices", report.vertices);
  run.metric("vertices_wanted", wanted);
  run.metric("mean_edge_m", report.mean_edge_m);
  run.metric("edge_cv", report.edge_cv);
  run.metric("min_angle_rad", report.min_angle_rad);
  run.metric("euler", report.euler);
  run.metric("hausdorff_m", std::max(lost.max_m, added.max_m));
  run.metric("distance_rms_m", std::sqrt((lost.rms_m * lost.rms_m + added.rms_m * added.rms_m) / 2));
}

}  // namespace

TriangleMesh remesh(const RemeshParams& params, pipeline::Run& run, const TriangleMesh& mesh) {
  const MeshReport before = geometry::check_mesh(mesh);
  if (!before.closed_manifold())
    throw UserError(Fault::geometry, "remesh",
                    "the surface is not a closed manifold: " + geometry::flaw(before));
  const int wanted = wanted_vertices(params, before);
  TriangleMesh result = isotropic(mesh, wanted, params.sweeps,
                                  [&](std::size_t done, std::size_t total) { run.progress(done, total); });
  const MeshReport after = geometry::check_mesh(result);
  refuse_bad_result(before, after, result);
  const SurfaceDistance to_input(mesh);
  result.observed = carried_over(mesh, to_input, result);
  const double spacing_m = after.mean_edge_m / 3;
  tell_metrics(run, after, wanted, deviation(mesh, SurfaceDistance(result), spacing_m),
               deviation(result, to_input, spacing_m));
  return result;
}

}  // namespace geocage::stages
