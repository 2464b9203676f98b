#include "stages/import/import.h"

#include <fmt/format.h>

#include "geometry/cloud_files.h"
#include "geometry/mesh_files.h"
#include "geometry/repair.h"
#include "pipeline/error.h"
#include "pipeline/worker.h"
#include "stages/import/table.h"

namespace geocage::stages {

using geometry::PointCloud;
using geometry::TriangleMesh;
using geometry::Vec3;
using pipeline::Fault;
using pipeline::UserError;

void ImportParams::visit(pipeline::Fields& f) {
  f("unit", unit, {}, "unit of the file: m, cm, mm, inch, or metres per unit");
  f("timeout_s", timeout_s, {0.1, 3600}, "how long the reader may take");
  f("memory_gib", memory_gib, {0.1, 64}, "how much memory the reader may take");
  f("repair", repair, {"repair", "check", "none"},
    "meshes that are not one closed part that doesn't cut itself: mend them, refuse them, or keep them");
  f("scene", scene, {"auto", "object", "table"},
    "clouds: one object, a table with objects, or look for a table");
  f("cluster", cluster, {0, 1000}, "table scenes: which object to keep, the one with most points first");
  f("plane_tolerance_m", plane_tolerance_m, {1e-4, 0.1},
    "table scenes: distance of points that lie on the table");
  f("table_share", table_share, {0, 1}, "auto: a plane with this share of the points is a table");
  f("above_min_m", above_min_m, {0, 1}, "table scenes: objects begin this high above the table");
  f("above_max_m", above_max_m, {0, 10}, "table scenes: objects end this high above the table");
  f("cluster_gap_m", cluster_gap_m, {1e-4, 1}, "table scenes: objects are farther apart than this");
  f("cluster_points", cluster_points, {4, 10000000}, "table scenes: an object has at least this many points");
  f("seed", seed, "of the search for the table");
}

namespace {

pipeline::WorkerLimits limits_of(const ImportParams& params) {
  return {params.timeout_s, params.memory_gib};
}

double diagonal_of(const std::vector<Vec3>& points) {
  Vec3 low = points.front(), high = points.front();
  for (const Vec3& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).norm();
}

PointCloud pick(const PointCloud& cloud, const std::vector<int>& chosen) {
  PointCloud picked;
  picked.sensor_origins = cloud.sensor_origins;
  for (int i : chosen) {
    picked.points.push_back(cloud.points[i]);
    if (!cloud.view.empty()) picked.view.push_back(cloud.view[i]);
  }
  return picked;
}

PointCloud object_on_table(const ImportParams& params, pipeline::Run& run, const PointCloud& cloud,
                           const FoundPlane& table, const std::string& file) {
  const auto clusters = clusters_on(
      cloud, table, {params.above_min_m, params.above_max_m, params.cluster_gap_m, params.cluster_points});
  run.metric("points_on_table", static_cast<double>(table.on.size()));
  run.metric("clusters", static_cast<double>(clusters.size()));
  if (params.cluster >= static_cast<int>(clusters.size()))
    throw UserError(Fault::input, file,
                    fmt::format("cluster {} was asked for, but {} objects stand on the table", params.cluster,
                                clusters.size()),
                    "see import.cluster, import.cluster_points and import.above_min_m");
  PointCloud object = pick(cloud, clusters[params.cluster]);
  object.support = table.plane;
  return object;
}

/// A mesh that is no solid is mended or refused.
TriangleMesh solid_of(const ImportParams& params, pipeline::Run& run, TriangleMesh mesh,
                      const std::string& name) {
  const auto refuse = [&](const std::string& why, std::vector<int> triangles) {
    std::string at;
    for (int f : triangles) at += fmt::format("{}{}", at.empty() ? " (triangles " : ", ", f);
    throw UserError(Fault::input, name, "this is no solid: " + why + (at.empty() ? "" : at + ")"),
                    "mend the file, or say import.repair = 'none' to take it as it is");
  };
  if (params.repair == "check") {
    std::vector<int> triangles;
    if (const auto flaw = geometry::flaw_of_solid(mesh, &triangles); !flaw.empty()) refuse(flaw, triangles);
  }
  if (params.repair != "repair") return mesh;
  geometry::Repair repair = geometry::repair_mesh(mesh, {.seed = params.seed});
  if (repair.outcome == geometry::RepairOutcome::rejected) refuse(repair.reason, repair.triangles);
  geometry::tell(repair, run);
  return std::move(repair.mesh);
}

}  // namespace

TriangleMesh import_mesh(const ImportParams& params, pipeline::Run& run, const geometry::SourceFile& file) {
  const double scale = geometry::unit_factor(params.unit);
  auto mesh = pipeline::contained<TriangleMesh>(limits_of(params), file.path.string(),
                                                [&] { return geometry::read_mesh(file.path, scale); });
  const bool turned = geometry::orient_outward(mesh);
  geometry::guard_units(file.path.string(), geometry::check_mesh(mesh).diagonal_m());
  mesh = solid_of(params, run, std::move(mesh), file.path.string());
  const auto report = geometry::check_mesh(mesh);
  run.metric("vertices", report.vertices);
  run.metric("triangles", report.triangles);
  run.metric("euler", report.euler);
  run.metric("components", report.components);
  run.metric("boundary_edges", report.boundary_edges);
  run.metric("turned_outward", turned);
  run.metric("closed_manifold", report.closed_manifold());
  return mesh;
}

PointCloud import_cloud(const ImportParams& params, pipeline::Run& run, const geometry::SourceFile& file) {
  const double scale = geometry::unit_factor(params.unit);
  const std::string name = file.path.string();
  PointCloud cloud = pipeline::contained<PointCloud>(limits_of(params), name,
                                                     [&] { return geometry::read_cloud(file.path, scale); });
  run.metric("points", static_cast<double>(cloud.size()));
  if (params.scene != "object") {
    const FoundPlane table = find_plane(cloud, params.plane_tolerance_m, params.seed);
    const double share = static_cast<double>(table.on.size()) / static_cast<double>(cloud.size());
    run.metric("plane_share", share);
    const bool is_table = params.scene == "table" || share >= params.table_share;
    if (params.scene == "table" && table.on.empty())
      throw UserError(Fault::input, name, "no plane was found in this table scene",
                      "say import.scene = 'object'");
    if (is_table) cloud = object_on_table(params, run, cloud, table, name);
  }
  geometry::guard_units(name, diagonal_of(cloud.points));
  run.metric("kept", static_cast<double>(cloud.size()));
  return cloud;
}

}  // namespace geocage::stages
