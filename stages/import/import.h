#pragma once
#include "geometry/cloud.h"
#include "geometry/mesh.h"
#include "geometry/source_file.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct ImportParams {
  std::string unit = "m";
  double timeout_s = 10;
  double memory_gib = 4;
  std::string repair = "repair";
  std::string scene = "auto";
  int cluster = 0;
  double plane_tolerance_m = 0.008;
  double table_share = 0.3;
  double above_min_m = 0.01;
  double above_max_m = 0.5;
  double cluster_gap_m = 0.015;
  int cluster_points = 300;
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& f);
};

/// A foreign mesh, read in a worker process, in metres, outward; mended to a solid (geometry/repair.h) unless
/// `repair` says otherwise: metrics `repair_*` tell what was done. Errors: UserError (input) naming the file:
/// unreadable, crashed or hung its reader, not finite, a size no hand can hold, no solid (triangles named).
geometry::TriangleMesh import_mesh(const ImportParams& params, pipeline::Run& run,
                                   const geometry::SourceFile& file);

/// A foreign cloud, read in a worker process. Of a table scene the plane is found by RANSAC, what stands on
/// it is parted into Euclidean clusters, and one of them is kept, with the plane as its support. Errors: as
/// import_mesh; no plane, no such cluster.
geometry::PointCloud import_cloud(const ImportParams& params, pipeline::Run& run,
                                  const geometry::SourceFile& file);

inline constexpr pipeline::Stage import_mesh_stage{"import", 2, &import_mesh};
inline constexpr pipeline::Stage import_cloud_stage{"import", 1, &import_cloud};

}  // namespace geocage::stages
