#include "stages/remesh/remesh.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "geometry/crossings.h"
#include "geometry/soup.h"
#include "geometry/surface_distance.h"
#include "geometry/wrap.h"
#include "pipeline/error.h"
#include "pipeline/worker.h"
#include "stages/remesh/isotropic.h"
#include "stages/remesh/remesher.h"

namespace geocage::stages {

using geometry::MeshReport;
using geometry::SurfaceDistance;
using geometry::TriangleMesh;
using pipeline::Fault;
using pipeline::UserError;

void RemeshParams::visit(pipeline::Fields& f) {
  f("size_by", size_by, {"edge_length", "vertices"}, "which of the next two is asked for");
  f("edge_length_m", edge_length_m, {0.0002, 1}, "wanted edge length").only_with("size_by", {"edge_length"});
  f("vertices", vertices, {20, 2000000}, "wanted number of vertices").only_with("size_by", {"vertices"});
  f("sweeps", sweeps, {1, 100}, "rounds of split, collapse, flip, smooth, project");
  f("least_angle_deg", least_angle_deg, {0, 35},
    "a net with a smaller angle is not answered: a wrap's takes its place, or it is refused");
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

/// The triangle with the smallest angle, and where it is.
std::string slimmest(const TriangleMesh& mesh, double edge_m) {
  int worst = 0;
  double least = M_PI;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto& [a, b, c] = mesh.triangles[f];
    const double angle = least_angle(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
    if (angle >= least) continue;
    least = angle;
    worst = static_cast<int>(f);
  }
  const auto& p = mesh.vertices[mesh.triangles[worst][0]];
  return fmt::format(
      "triangle {} near ({:.4g}, {:.4g}, {:.4g}) m has an angle of {:.1f} degrees: a neck, handle or wall "
      "there is thinner than the {:.3g} m edges can follow",
      worst, p.x(), p.y(), p.z(), least * 180 / M_PI, edge_m);
}

/// What keeps a net from being what was promised; empty if nothing does.
std::string flaw_of_net(int euler_before, double least_angle_deg, const MeshReport& report,
                        const TriangleMesh& mesh) {
  if (!report.closed_manifold())
    return "the remeshed surface is not a closed manifold: " + geometry::flaw(report);
  if (report.euler != euler_before)
    return fmt::format("the Euler characteristic went from {} to {}", euler_before, report.euler);
  const auto crossings = geometry::crossing_triangles(mesh);
  if (crossings.empty())
    return report.min_angle_rad * 180 / M_PI < least_angle_deg ? slimmest(mesh, report.mean_edge_m) : "";
  const auto [f, g] = crossings.front();
  const auto& p = mesh.vertices[mesh.triangles[f][0]];
  return fmt::format(
      "triangles {} and {} cut each other near ({:.4g}, {:.4g}, {:.4g}) m ({} such pairs): walls or handles "
      "there are thinner than the {:.3g} m edges can follow",
      f, g, p.x(), p.y(), p.z(), crossings.size(), report.mean_edge_m);
}

/// The surface without folds, gaps and walls that edges can't follow: an alpha wrap. Empty where that fails.
TriangleMesh coarser(const TriangleMesh& mesh, double alpha_m, double offset_m) {
  TriangleMesh wrap;
  try {
    wrap = pipeline::contained<TriangleMesh>({.seconds = 60, .memory_gib = 4, .patience = 20}, "remesh", [&] {
      return geometry::wrapped_surface({mesh.vertices, mesh.triangles}, alpha_m, offset_m, 1);
    });
  } catch (const UserError&) {  // it ran out of time or memory: as if there were none
    return {};
  }
  geometry::RepairCounts counts;
  geometry::drop_parts(wrap, 0, true, counts);
  geometry::orient_outward(wrap);
  return wrap;
}

/// A net on the surface, or on a coarser one where its triangles can't follow.
struct Net {
  TriangleMesh mesh;
  MeshReport report;
  int wanted = 0;
  double alpha_m = 0;  ///< of the wrap that it lies on; 0 of the surface itself
};

Net net_on(const RemeshParams& params, pipeline::Run& run, const TriangleMesh& surface) {
  const MeshReport before = geometry::check_mesh(surface);
  Net net;
  std::string why;
  const auto attempt = [&](const TriangleMesh& source, const MeshReport& report) {
    net.wanted = wanted_vertices(params, report);
    net.mesh = isotropic(source, net.wanted, params.sweeps,
                         [&](std::size_t done, std::size_t total) { run.progress(done, total); });
    net.report = geometry::check_mesh(net.mesh);
    return flaw_of_net(report.euler, params.least_angle_deg, net.report, net.mesh);
  };
  why = attempt(surface, before);
  const double edge_m = std::sqrt(before.area_m2 / net.wanted / area_per_vertex);
  for (double alpha : {0.5, 1.0, 2.0}) {
    if (why.empty()) return net;
    const TriangleMesh source = coarser(surface, alpha * edge_m, alpha * edge_m / 4);
    const MeshReport report = geometry::check_mesh(source);
    if (!report.closed_manifold()) continue;
    if (!attempt(source, report).empty()) continue;
    net.alpha_m = alpha * edge_m;
    run.log(fmt::format("{}; a wrap of {:.3g} m takes its place", why, net.alpha_m));
    return net;
  }
  if (!why.empty())
    throw UserError(
        Fault::geometry, "remesh", why,
        "take a shorter remesh.edge_length_m, smooth more by reconstruct.samples_per_node, or, for a "
        "slim angle alone, a smaller remesh.least_angle_deg");
  return net;
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

void tell_metrics(pipeline::Run& run, const Net& net, const geometry::Deviation& lost,
                  const geometry::Deviation& added) {
  const MeshReport& report = net.report;
  run.metric("vertices", report.vertices);
  run.metric("vertices_wanted", net.wanted);
  run.metric("wrap_alpha_m", net.alpha_m);
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
  Net net = net_on(params, run, mesh);
  const SurfaceDistance to_input(mesh);
  net.mesh.observed = carried_over(mesh, to_input, net.mesh);
  const double spacing_m = net.report.mean_edge_m / 3;
  tell_metrics(run, net, deviation(mesh, SurfaceDistance(net.mesh), spacing_m),
               deviation(net.mesh, to_input, spacing_m));
  return std::move(net.mesh);
}

}  // namespace geocage::stages
