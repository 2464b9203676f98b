#pragma once
#include "geometry/cloud.h"
#include "geometry/mesh.h"
#include "geometry/scene.h"
#include "geometry/source_file.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct ImportParams {
  std::string unit = "m";
  double scale = 1;
  double timeout_s = 10;
  double memory_gib = 4;
  int most_faces = 10'000'000;
  int decimate = 0;
  std::string repair = "repair";
  std::string scene = "auto";
  std::string cluster = "all";
  std::string cluster_by = "shape";
  double plane_tolerance_m = 0.008;
  double table_share = 0.3;
  double above_min_m = 0.01;
  double above_max_m = 0.5;
  double cluster_gap_m = 0.015;
  int cluster_points = 300;
  double patch_m = 0.015;
  double concavity_deg = 15;
  int part_points = 600;
  double one_thing = 0.5;
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& f);
};

/// A foreign mesh, read in a worker process, in metres, outward; reduced to about `decimate` faces when it
/// has more than `most_faces` (metrics `decimated_*`); mended to a solid (geometry/repair.h) unless `repair`
/// says otherwise: metrics `repair_*` tell what was done. Errors: UserError (input) naming the file:
/// unreadable, crashed or hung its reader, not finite, a size no hand can hold, no solid (triangles named).
geometry::TriangleMesh import_mesh(const ImportParams& params, pipeline::Run& run,
                                   const geometry::SourceFile& file);

/// A foreign cloud, read in a worker process, and the objects in it. Of a table scene the plane is found by
/// RANSAC, among the planes of a room if it is seen (room.h); what stands on it is parted into objects, by
/// gaps and hollow edges or by the file's labels, the one with most points first. A cloud without a table is
/// one object without a name. `cluster` is not looked at. Errors: as import_mesh; no plane, nothing on it, no
/// labels.
geometry::Scene find_scene(const ImportParams& params, pipeline::Run& run, const geometry::SourceFile& file);

struct PartParams {
  int object = 0;
  void visit(pipeline::Fields& f);
};
/// One object of a scene, with the table as its support. Errors: UserError (input) for a size no hand can
/// hold. Precondition: the scene has that object.
geometry::PointCloud import_part(const PartParams& params, pipeline::Run& run, const geometry::Scene& scene);

/// find_scene and import_part in one, where `cluster` names the object. Errors: of both; UserError
/// (configuration) for a `cluster` that is neither "largest", nor a number, nor "all" of a single object;
/// UserError (input) where the scene has no such object.
geometry::PointCloud import_cloud(const ImportParams& params, pipeline::Run& run,
                                  const geometry::SourceFile& file);

inline constexpr pipeline::Stage import_mesh_stage{"import", 4, &import_mesh, 1.0};
inline constexpr pipeline::Stage import_cloud_stage{"import", 13, &import_cloud, 1.0};
inline constexpr pipeline::Stage import_part_stage{"import", 4, &import_part};
inline constexpr pipeline::Stage scene_stage{"scene", 12, &find_scene, 1.0};

}  // namespace geocage::stages
