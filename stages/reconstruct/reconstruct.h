#pragma once
#include "geometry/cloud.h"
#include "geometry/mesh.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct ReconstructParams {
  std::string method = "poisson";
  int depth = 6;
  double samples_per_node = 4;
  bool close_unseen = true;
  bool open_cavities = false;
  double unseen_step_m = 0.003;
  double observed_m = 0.004;
  double wall_m = 0.005;
  double handle_m = 0.0125;
  double most_growth = 1.5;
  double wrap_alpha = 0.05;
  double timeout_s = 60;
  double memory_gib = 8;
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& f);
};

/// A solid's surface through oriented points (geometry/repair.h: one closed, 2-manifold, outward component
/// that doesn't cut itself), with the share that was observed at each vertex. The method asked for answers,
/// or the next of the chain method, poisson, alpha_wrap where its surface can't be mended or balloons away.
/// The metric `answered_by` says which (0 poisson, 1 alpha_wrap, 2 cgal_poisson, 3 advancing_front), the log
/// why. Errors: UserError (geometry) when none does, or without normals. About 3 s per 100k points.
geometry::TriangleMesh reconstruct(const ReconstructParams& params, pipeline::Run& run,
                                   const geometry::PointCloud& cloud);

inline constexpr pipeline::Stage reconstruct_stage{"reconstruct", 6, &reconstruct, 1.0};

}  // namespace geocage::stages
