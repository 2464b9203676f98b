#include "stages/reconstruct/reconstruct.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "geometry/repair.h"
#include "geometry/wrap.h"
#include "pipeline/error.h"
#include "pipeline/worker.h"
#include "stages/reconstruct/handles.h"
#include "stages/reconstruct/observed.h"
#include "stages/reconstruct/own_frame.h"
#include "stages/reconstruct/surfaces.h"
#include "stages/reconstruct/unseen.h"
#include "stages/reconstruct/walls.h"

namespace geocage::stages {

using geometry::PointCloud;
using geometry::TriangleMesh;
using geometry::Vec3;

void ReconstructParams::visit(pipeline::Fields& f) {
  f("method", method, {"poisson", "cgal_poisson", "advancing_front", "alpha_wrap"},
    "tried first; then Poisson, then an alpha wrap");
  f("depth", depth, {4, 10}, "of Poisson's octree: cells are 1.1 x the longest side / 2^depth");
  f("samples_per_node", samples_per_node, {1, 20},
    "points that Poisson wants in a cell; more of them smooth noise");
  f("close_unseen", close_unseen,
    "end the surface at the table and behind a single view instead of letting it balloon");
  f("open_cavities", open_cavities,
    "of several views: what rays passed over a rim stays open, down to where none went");
  f("unseen_step_m", unseen_step_m, {0.0005, 0.1},
    "distance of the points that end it there, at least 1/200 of the cloud's diagonal");
  f("observed_m", observed_m, {0.0001, 0.1},
    "surface this near to a point counts as observed, at twice this distance no longer");
  f("wall_m", wall_m, {0, 0.1}, "walls that were seen from both sides become at least so thick");
  f("handle_m", handle_m, {0, 1},
    "handles thinner and holes narrower than this round about are noise: they are cut off or filled");
  f("most_growth", most_growth, {1, 100},
    "an answer is refused when its box is so many times larger than the cloud's");
  f("wrap_alpha", wrap_alpha, {0.005, 1},
    "alpha wrap: size of the openings it closes, in diagonals of the cloud");
  f("timeout_s", timeout_s, {1, 3600}, "processor time that each method may take");
  f("memory_gib", memory_gib, {0.1, 64}, "how much memory each method may take");
  f("seed", seed, "of CGAL's random source");
}

namespace {

double diagonal_of(const std::vector<Vec3>& points) {
  Vec3 low = points.front(), high = points.front();
  for (const Vec3& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).norm();
}

/// Points and normals in the order of their coordinates: PCL's Poisson answers differently by up to a
/// twentieth of a cell when points come in another order. Views are kept.
PointCloud in_order(const PointCloud& cloud) {
  std::vector<std::size_t> order(cloud.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](std::size_t i) {
    const Vec3 &p = cloud.points[i], &n = cloud.normals[i];
    return std::array{p.x(), p.y(), p.z(), n.x(), n.y(), n.z()};
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return key(i) < key(j); });
  PointCloud sorted = cloud;
  for (std::size_t k = 0; k < order.size(); ++k) {
    sorted.points[k] = cloud.points[order[k]];
    sorted.normals[k] = cloud.normals[order[k]];
    if (!cloud.view.empty()) sorted.view[k] = cloud.view[order[k]];
  }
  return sorted;
}

PointCloud moved(PointCloud cloud, const geometry::Pose& X_CO) {
  for (auto* list : {&cloud.points, &cloud.sensor_origins})
    for (Vec3& p : *list) p = X_CO * p;
  for (Vec3& n : cloud.normals) n = X_CO.linear() * n;
  if (cloud.support) {
    const Vec3 normal = X_CO.linear() * cloud.support->normal;
    cloud.support = geometry::Plane{normal, cloud.support->offset_m + normal.dot(X_CO.translation())};
  }
  return cloud;
}

/// The method asked for, then those that take its place: Poisson, and at last a wrap, which always answers.
std::vector<std::string> chain_of(const std::string& method) {
  std::vector<std::string> chain = {method};
  for (const char* next : {"poisson", "alpha_wrap"})
    if (std::count(chain.begin(), chain.end(), next) == 0) chain.emplace_back(next);
  return chain;
}

double number_of(const std::string& method) {
  const std::vector<std::string> names = {"poisson", "alpha_wrap", "cgal_poisson", "advancing_front"};
  return static_cast<double>(std::find(names.begin(), names.end(), method) - names.begin());
}

TriangleMesh surface_by(const std::string& method, const ReconstructParams& params,
                        const PointCloud& points) {
  if (method == "poisson") return poisson_surface(points, params.depth, params.samples_per_node);
  if (method == "cgal_poisson") return cgal_poisson_surface(points, mean_spacing_m(points), params.seed);
  if (method == "advancing_front") return advancing_front_surface(points, params.seed);
  const double alpha = params.wrap_alpha * diagonal_of(points.points);
  return geometry::wrapped_surface({points.points, {}}, alpha, alpha / 20, params.seed);
}

/// An answer, or why there is none.
struct Attempt {
  geometry::Repair repair;
  std::string why;
};

/// The surface of one method, made in a worker process and mended.
Attempt attempt(const std::string& method, const ReconstructParams& params, const PointCloud& points) {
  Attempt made;
  try {
    const auto surface = pipeline::contained<TriangleMesh>(
        {.seconds = params.timeout_s, .memory_gib = params.memory_gib, .patience = 20}, "reconstruct",
        [&] { return surface_by(method, params, points); });
    made.repair = geometry::repair_mesh(surface, {.parts = "largest", .seed = params.seed});
  } catch (const pipeline::UserError& error) {
    made.why = error.sentence();
    return made;
  }
  if (made.repair.outcome == geometry::RepairOutcome::rejected) {
    made.why = made.repair.reason;
    return made;
  }
  const double growth = geometry::check_mesh(made.repair.mesh).diagonal_m() / diagonal_of(points.points);
  if (method != "alpha_wrap" && growth > params.most_growth)
    made.why = fmt::format("its box is {:.2f} times as large as the cloud's", growth);
  return made;
}

double share_of_area(const TriangleMesh& mesh, const std::vector<double>& values) {
  const auto areas = geometry::vertex_areas_m2(mesh);
  double sum = 0, all = 0;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    sum += areas[v] * values[v];
    all += areas[v];
  }
  return sum / all;
}

}  // namespace

TriangleMesh reconstruct(const ReconstructParams& params, pipeline::Run& run, const PointCloud& given) {
  if (given.size() < 4 || given.normals.size() != given.size())
    throw pipeline::UserError(pipeline::Fault::geometry, "reconstruct",
                              given.size() < 4 ? "a surface needs four points" : "the cloud has no normals");
  const PointCloud sorted = in_order(given);
  const geometry::Pose X_CO = own_frame(sorted.points);
  const PointCloud cloud = in_order(moved(sorted, X_CO));
  const double step_m = std::max(params.unseen_step_m, diagonal_of(cloud.points) / 200);
  PointCloud seen = cloud;
  const ThickenedWalls walls = thicken_walls(seen, params.wall_m);
  const PointCloud points =
      params.close_unseen ? closed_where_unseen(seen, step_m, params.open_cavities) : seen;

  Attempt made;
  std::string failures;
  int tried = 0;
  for (const std::string& method : chain_of(params.method)) {
    made = attempt(method, params, points);
    ++tried;
    if (made.why.empty()) {
      run.metric("answered_by", number_of(method));
      if (tried > 1) run.log(failures + method + " answers");
      break;
    }
    failures += method + "'s surface is not taken: " + made.why + "; ";
  }
  if (!made.why.empty())
    throw pipeline::UserError(pipeline::Fault::geometry, "reconstruct",
                              "no closed surface was found: " + failures.substr(0, failures.size() - 2),
                              "scan from more sides, or lower reconstruct.depth");
  TriangleMesh mesh = std::move(made.repair.mesh);
  const CutHandles cut = cut_small_handles(mesh, params.handle_m);
  run.metric("wall_points", static_cast<double>(walls.points));
  run.metric("wall_moved_m", walls.most_m);
  run.metric("handles_cut", cut.handles);
  run.metric("handles_moved_m", cut.moved_m);
  mesh.observed = observed_of(mesh, cloud, params.observed_m);
  for (Vec3& p : mesh.vertices) p = X_CO.inverse() * p;
  run.metric("methods_tried", tried);
  run.metric("points_added", static_cast<double>(points.size() - cloud.size()));
  const auto report = geometry::check_mesh(mesh);
  run.metric("vertices", report.vertices);
  run.metric("euler", report.euler);
  run.metric("observed_share", share_of_area(mesh, mesh.observed));
  geometry::tell(made.repair, run);
  return mesh;
}

}  // namespace geocage::stages
