#include "stages/import/import.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "geometry/boundary.h"
#include "geometry/cloud_files.h"
#include "geometry/mesh_files.h"
#include "geometry/repair.h"
#include "pipeline/error.h"
#include "pipeline/worker.h"
#include "stages/import/parts.h"
#include "stages/import/table.h"

namespace geocage::stages {

using geometry::PointCloud;
using geometry::Scene;
using geometry::TriangleMesh;
using pipeline::Fault;
using pipeline::UserError;

void ImportParams::visit(pipeline::Fields& f) {
  f("unit", unit, {}, "unit of the file: m, cm, mm, inch, or metres per unit");
  f("scale", scale, {0.01, 100}, "makes the object larger or smaller, after its unit");
  f("timeout_s", timeout_s, {0.1, 3600},
    "processor time of the reader, and six times that of the clock; with decimate, for each 10 MB");
  f("memory_gib", memory_gib, {0.1, 64}, "how much memory the reader may take");
  f("most_faces", most_faces, {4, 1e9}, "meshes with more faces are refused, or reduced");
  f("decimate", decimate, {0, 1e8}, "to about so many faces; 0 refuses them");
  f("repair", repair, {"repair", "check", "none"},
    "meshes that are not one closed part that doesn't cut itself: mend them, refuse them, or keep them");
  f("scene", scene, {"auto", "object", "table"},
    "clouds: one object, a table with objects, or look for a table");
  f("cluster", cluster, {}, "all objects, largest, a number (0 is the largest), or the label")
      .only_with("scene", {"auto", "table"});
  f("cluster_by", cluster_by, {"gap", "shape", "label"},
    "objects end at gaps, at hollow edges too (where the sensor's place is known), or at "
    "labels")
      .only_with("scene", {"auto", "table"});
  f("plane_tolerance_m", plane_tolerance_m, {1e-4, 0.1}, "distance of points that lie on the table")
      .only_with("scene", {"auto", "table"});
  f("table_share", table_share, {0, 1},
    "a plane with this share of the points is a table; in a room of 1.5 m any that carries something")
      .only_with("scene", {"auto"});
  f("above_min_m", above_min_m, {0, 1}, "objects begin this high above the table")
      .only_with("scene", {"auto", "table"});
  f("above_max_m", above_max_m, {0, 10}, "objects end this high above the table")
      .only_with("scene", {"auto", "table"});
  f("cluster_gap_m", cluster_gap_m, {1e-4, 1}, "objects are farther apart than this")
      .only_with("scene", {"auto", "table"});
  f("cluster_points", cluster_points, {4, 10000000}, "an object has at least this many points")
      .only_with("scene", {"auto", "table"});
  f("patch_m", patch_m, {1e-3, 0.2}, "size of the patches whose angles are compared")
      .only_with("cluster_by", {"shape"});
  f("concavity_deg", concavity_deg, {0, 180}, "a hollower angle than this is an object's end")
      .only_with("cluster_by", {"shape"});
  f("part_points", part_points, {4, 10000000}, "what touches others and has fewer points belongs to them")
      .only_with("cluster_by", {"shape"});
  f("one_thing", one_thing, {0, 1}, "pieces are joined that are one thing with at least this probability")
      .only_with("cluster_by", {"shape"});
  f("seed", seed, "of the search for the table");
}

void PartParams::visit(pipeline::Fields& f) {
  f("object", object, {0, 1e6}, "number of the object within its scene");
}

namespace {

pipeline::WorkerLimits limits_of(const ImportParams& params) {
  pipeline::WorkerLimits limits{params.timeout_s, params.memory_gib};
  limits.patience = 6;  // a busy machine refuses no file
  limits.hint =
      "if the file is sound, raise import.timeout_s or import.memory_gib; else write it anew with another "
      "tool";
  return limits;
}

/// The mesh of a file; what a decimation did goes to the log and to metrics.
TriangleMesh mesh_of_file(const ImportParams& params, pipeline::Run& run, const geometry::SourceFile& file) {
  const double scale = geometry::unit_factor(params.unit) * params.scale;
  const geometry::FaceGuard guard{static_cast<std::uint64_t>(params.most_faces),
                                  static_cast<std::uint64_t>(params.decimate)};
  pipeline::WorkerLimits limits = limits_of(params);
  std::error_code no_file;  // which the worker tells
  if (const auto bytes = file_size(file.path, no_file); params.decimate > 0 && !no_file)
    limits.seconds *= 1 + static_cast<double>(bytes) / 10e6;
  TriangleMesh mesh;
  std::optional<geometry::Decimation> decimated;
  pipeline::run_contained(
      limits, file.path.string(),
      [&](const std::filesystem::path& dir) {
        const auto read = geometry::read_mesh(file.path, scale, guard);
        save_artefact(read.mesh, dir);
        if (read.decimated) save(*read.decimated, dir / "decimated.json");
      },
      [&](const std::filesystem::path& dir) {
        load_artefact(mesh, dir);
        if (exists(dir / "decimated.json")) decimated = geometry::load_decimation(dir / "decimated.json");
      });
  if (decimated) tell(*decimated, run);
  return mesh;
}

/// By the label of the file; 0 means unlabelled. The order of names is that of labels.
std::vector<Scene::Object> labelled_objects(const ImportParams& params, const PointCloud& cloud,
                                            const std::vector<int>& standing) {
  std::map<int, std::vector<int>> points;
  for (int i : standing)
    if (cloud.label[i] != 0) points[cloud.label[i]].push_back(i);
  std::vector<Scene::Object> objects;
  for (auto& [label, indices] : points)
    if (static_cast<int>(indices.size()) >= params.cluster_points)
      objects.push_back({std::to_string(label), std::move(indices)});
  return objects;
}

std::vector<Scene::Object> separate_objects(const ImportParams& params, pipeline::Run& run,
                                            const PointCloud& cloud, const geometry::Plane& table,
                                            const std::vector<int>& standing) {
  std::optional<Sight> sight;  // by shape
  if (params.cluster_by == "shape" && cloud.sensor_origins.size() == 1) sight = sight_of(cloud);
  std::vector<std::vector<int>> parts;
  int doubtful = 0;
  const double gap_m = sight ? std::max(params.cluster_gap_m, most_gap_m) : params.cluster_gap_m;
  for (const auto& cluster : clusters_of(cloud, standing, gap_m, params.cluster_points)) {
    Parts pieces{{cluster}};
    if (sight)
      pieces = parts_by_shape(cloud, *sight, cluster, table,
                              {params.patch_m, params.concavity_deg, params.part_points, params.one_thing});
    parts.insert(parts.end(), pieces.points.begin(), pieces.points.end());
    doubtful += pieces.doubtful;
  }
  if (sight) run.metric("doubtful", doubtful);
  std::erase_if(parts,
                [&](const auto& part) { return static_cast<int>(part.size()) < params.cluster_points; });
  std::sort(parts.begin(), parts.end(),
            [](const auto& a, const auto& b) { return a.size() != b.size() ? a.size() > b.size() : a < b; });
  std::vector<Scene::Object> objects;
  objects.reserve(parts.size());
  for (auto& part : parts) objects.push_back({std::to_string(objects.size()), std::move(part)});
  return objects;
}

/// The objects on the table; none when there is no table, or nothing on it.
std::vector<Scene::Object> objects_on_table(const ImportParams& params, pipeline::Run& run, PointCloud& cloud,
                                            const std::string& file) {
  constexpr double largest_object_m = 1.5;  // what auto takes for one
  const auto [table, standing, in_room] = find_table(
      cloud,
      {params.plane_tolerance_m, params.above_min_m, params.above_max_m, params.cluster_points, params.seed});
  const double share = static_cast<double>(table.on.size()) / static_cast<double>(cloud.size());
  run.metric("plane_share", share);
  if (params.scene == "table" && table.on.empty())
    throw UserError(Fault::input, file, "no plane was found in this table scene",
                    "say import.scene = 'object'");
  run.metric("room", in_room);
  const bool is_table =
      share >= params.table_share || (in_room && geometry::diagonal_m(cloud.points) > largest_object_m);
  if (table.on.empty() || (params.scene == "auto" && !is_table)) return {};
  if (params.cluster_by == "label" && cloud.label.empty())
    throw UserError(Fault::input, file, "its points have no labels", "say import.cluster_by = 'gap'");
  auto objects = params.cluster_by == "label" ? labelled_objects(params, cloud, standing)
                                              : separate_objects(params, run, cloud, table.plane, standing);
  if (!objects.empty()) cloud.support = table.plane;
  run.metric("points_on_table", static_cast<double>(table.on.size()));
  run.metric("points_above_table", static_cast<double>(standing.size()));
  std::size_t kept = 0;
  for (const auto& object : objects) kept += object.points.size();
  run.metric("points_left_out", static_cast<double>(standing.size() - kept));
  return objects;
}

/// Which object of the scene `cluster` means.
int chosen_object(const ImportParams& params, const Scene& scene, const std::string& file) {
  const auto count = static_cast<int>(scene.objects.size());
  if (params.cluster == "largest" || (params.cluster == "all" && count == 1)) {
    const auto largest =
        std::max_element(scene.objects.begin(), scene.objects.end(),
                         [](const auto& a, const auto& b) { return a.points.size() < b.points.size(); });
    return static_cast<int>(largest - scene.objects.begin());
  }
  int number = 0;
  const char* end = params.cluster.data() + params.cluster.size();
  if (const auto read = std::from_chars(params.cluster.data(), end, number); read.ptr != end || number < 0)
    throw UserError(Fault::configuration, "import.cluster", "'" + params.cluster + "' names no single object",
                    "say largest or a number");
  for (int k = 0; k < count; ++k)
    if (scene.objects[k].name == params.cluster || (scene.objects[k].name.empty() && number == 0)) return k;
  std::string names;
  for (const auto& object : scene.objects) names += (names.empty() ? "" : ", ") + object.name;
  throw UserError(Fault::input, file,
                  fmt::format("object {} was asked for, but these stand on the table: {}", number, names),
                  "see import.cluster, import.cluster_points and import.above_min_m");
}

/// A mesh that is no solid is mended or refused.
TriangleMesh solid_of(const ImportParams& params, pipeline::Run& run, TriangleMesh mesh,
                      const std::string& name) {
  const auto refuse = [&](const std::string& why, const std::vector<int>& triangles) {
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
  auto mesh = mesh_of_file(params, run, file);
  const bool turned = geometry::orient_outward(mesh);
  geometry::guard_units(file.path.string(), geometry::check_mesh(mesh).diagonal_m());
  mesh = solid_of(params, run, std::move(mesh), file.path.string());
  const auto report = geometry::check_mesh(mesh);
  run.metric("vertices", report.vertices);
  run.metric("triangles", report.triangles);
  run.metric("euler", report.euler);
  run.metric("components", report.components);
  run.metric("boundary_edges", report.boundary_edges);
  run.metric("boundary_loops", geometry::boundary_loops(mesh));
  run.metric("turned_outward", turned);
  run.metric("closed_manifold", report.closed_manifold());
  return mesh;
}

Scene find_scene(const ImportParams& params, pipeline::Run& run, const geometry::SourceFile& file) {
  const double scale = geometry::unit_factor(params.unit) * params.scale;
  const std::string name = file.path.string();
  Scene scene;
  scene.cloud = pipeline::contained<PointCloud>(limits_of(params), name,
                                                [&] { return geometry::read_cloud(file.path, scale); });
  run.metric("points", static_cast<double>(scene.cloud.size()));
  if (params.scene != "object") scene.objects = objects_on_table(params, run, scene.cloud, name);
  if (params.scene == "table" && scene.objects.empty())
    throw UserError(Fault::input, name, "no object stands on the table",
                    "see import.cluster_points, import.above_min_m and import.unit");
  if (scene.objects.empty()) {
    scene.objects.emplace_back();
    for (std::size_t i = 0; i < scene.cloud.size(); ++i)
      scene.objects.back().points.push_back(static_cast<int>(i));
  }
  run.metric("clusters", static_cast<double>(scene.objects.size()));
  return scene;
}

PointCloud import_part(const PartParams& params, pipeline::Run& run, const Scene& scene) {
  const auto& object = scene.objects.at(static_cast<std::size_t>(params.object));
  PointCloud cloud = geometry::subset(scene.cloud, object.points);
  const std::string name = object.name.empty() ? "this cloud" : "object " + object.name + " of the scene";
  geometry::guard_units(name, geometry::diagonal_m(cloud.points));
  run.metric("kept", static_cast<double>(cloud.size()));
  return cloud;
}

PointCloud import_cloud(const ImportParams& params, pipeline::Run& run, const geometry::SourceFile& file) {
  const Scene scene = find_scene(params, run, file);
  const std::string name = file.path.string();
  PointCloud cloud = geometry::subset(scene.cloud, scene.objects[chosen_object(params, scene, name)].points);
  geometry::guard_units(name, geometry::diagonal_m(cloud.points));
  run.metric("kept", static_cast<double>(cloud.size()));
  return cloud;
}

}  // namespace geocage::stages
