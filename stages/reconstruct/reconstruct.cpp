#include "stages/reconstruct/reconstruct.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <pcl/kdtree/kdtree_flann.h>

#include "pipeline/error.h"
#include "pipeline/worker.h"
#include "stages/reconstruct/surfaces.h"
#include "stages/reconstruct/unseen.h"

namespace geocage::stages {

using geometry::PointCloud;
using geometry::TriangleMesh;
using geometry::Vec3;

void ReconstructParams::visit(pipeline::Fields& f) {
  f("depth", depth, {4, 10}, "of Poisson's octree: cells are 1.1 x the longest side / 2^depth");
  f("samples_per_node", samples_per_node, {1, 20},
    "points that Poisson wants in a cell; more of them smooth noise");
  f("close_unseen", close_unseen,
    "end the surface at the table and behind a single view instead of letting it balloon");
  f("unseen_step_m", unseen_step_m, {0.0005, 0.1}, "distance of the points that end it there");
  f("most_hole_edges", most_hole_edges, {0, 10000},
    "holes of Poisson's surface with at most so many edges are filled");
  f("observed_m", observed_m, {0.0001, 0.1}, "surface this near to a point counts as observed");
  f("most_growth", most_growth, {1, 100},
    "Poisson's answer is refused when its box is so many times larger than the cloud's");
  f("wrap_alpha", wrap_alpha, {0.005, 1},
    "alpha wrap: size of the openings it closes, in diagonals of the cloud");
  f("timeout_s", timeout_s, {1, 3600}, "how long Poisson may take");
  f("memory_gib", memory_gib, {0.1, 64}, "how much memory Poisson may take");
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

/// The component with the most triangles, unused vertices dropped.
TriangleMesh largest_component(const TriangleMesh& mesh, int& dropped) {
  const auto neighbours = geometry::vertex_neighbours(mesh);
  std::vector<int> part(mesh.vertices.size(), -1), stack;
  int parts = 0;
  for (std::size_t seed = 0; seed < part.size(); ++seed) {
    if (part[seed] >= 0 || neighbours.size(static_cast<int>(seed)) == 0) continue;
    part[seed] = parts;
    for (stack = {static_cast<int>(seed)}; !stack.empty();) {
      const int v = stack.back();
      stack.pop_back();
      for (int i = neighbours.start[v]; i < neighbours.start[v + 1]; ++i)
        if (int& other = part[neighbours.items[i]]; other < 0) {
          other = parts;
          stack.push_back(neighbours.items[i]);
        }
    }
    ++parts;
  }
  std::vector<int> size(static_cast<std::size_t>(parts), 0);
  for (const auto& t : mesh.triangles) ++size[part[t[0]]];
  const int best = static_cast<int>(std::max_element(size.begin(), size.end()) - size.begin());
  dropped = std::max(0, parts - 1);

  TriangleMesh kept;
  std::vector<int> renamed(mesh.vertices.size(), -1);
  for (std::size_t v = 0; v < part.size(); ++v)
    if (part[v] == best) {
      renamed[v] = static_cast<int>(kept.vertices.size());
      kept.vertices.push_back(mesh.vertices[v]);
    }
  for (const auto& t : mesh.triangles)
    if (part[t[0]] == best) kept.triangles.push_back({renamed[t[0]], renamed[t[1]], renamed[t[2]]});
  return kept;
}

/// Why a surface is not taken; empty when it is.
std::string objection(const TriangleMesh& mesh, double cloud_diagonal, double most_growth) {
  const auto report = geometry::check_mesh(mesh);
  if (!report.closed_manifold()) return geometry::flaw(report);
  const double growth = report.diagonal_m() / cloud_diagonal;
  return growth <= most_growth ? "" : fmt::format("its box is {:.2f} times as large as the cloud's", growth);
}

/// Poisson's surface, made in a worker process: PCL's keeps global state, so that two at once in one process
/// crash.
TriangleMesh contained_poisson(const ReconstructParams& params, const PointCloud& points) {
  return pipeline::contained<TriangleMesh>({params.timeout_s, params.memory_gib}, "reconstruct", [&] {
    return poisson_surface(points, params.depth, params.samples_per_node);
  });
}

/// Share of the surface's area that lies within `near_m` of a point.
double observed_share(const TriangleMesh& mesh, const PointCloud& cloud, double near_m) {
  pcl::PointCloud<pcl::PointXYZ>::Ptr points(new pcl::PointCloud<pcl::PointXYZ>);
  for (const Vec3& p : cloud.points)
    points->emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()));
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(points);
  const auto areas = geometry::vertex_areas_m2(mesh);
  double observed = 0, all = 0;
  pcl::Indices nearest(1);
  std::vector<float> squared(1);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto p = mesh.vertices[v].cast<float>();
    tree.nearestKSearch({p.x(), p.y(), p.z()}, 1, nearest, squared);
    all += areas[v];
    if (squared[0] <= near_m * near_m) observed += areas[v];
  }
  return observed / all;
}

}  // namespace

TriangleMesh reconstruct(const ReconstructParams& params, pipeline::Run& run, const PointCloud& cloud) {
  if (cloud.normals.size() != cloud.size())
    throw pipeline::UserError(pipeline::Fault::geometry, "reconstruct", "the cloud has no normals");
  const PointCloud points = params.close_unseen ? closed_where_unseen(cloud, params.unseen_step_m) : cloud;
  const double diagonal = diagonal_of(points.points);

  int dropped = 0, holes = 0, answered_by = 0;
  TriangleMesh mesh;
  std::string why;
  try {
    mesh = largest_component(contained_poisson(params, points), dropped);
    holes = fill_holes(mesh, params.most_hole_edges);
    geometry::orient_outward(mesh);
    why = objection(mesh, diagonal, params.most_growth);
  } catch (const pipeline::UserError& error) {
    why = error.sentence();
  }
  if (!why.empty()) {
    run.log("Poisson's surface is not taken: " + why + "; an alpha wrap answers");
    answered_by = 1;
    const double alpha = params.wrap_alpha * diagonal;
    mesh = largest_component(wrapped_surface(points, alpha, alpha / 20, params.seed), dropped);
    geometry::orient_outward(mesh);
  }
  const auto report = geometry::check_mesh(mesh);
  if (!report.closed_manifold())
    throw pipeline::UserError(pipeline::Fault::geometry, "reconstruct",
                              "no closed surface was found: " + geometry::flaw(report),
                              "scan from more sides, or lower reconstruct.depth");
  run.metric("answered_by", answered_by);
  run.metric("components_dropped", dropped);
  run.metric("holes_filled", holes);
  run.metric("points_added", static_cast<double>(points.size() - cloud.size()));
  run.metric("vertices", report.vertices);
  run.metric("euler", report.euler);
  run.metric("observed_share", observed_share(mesh, cloud, params.observed_m));
  return mesh;
}

}  // namespace geocage::stages
