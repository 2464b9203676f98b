#pragma once
#include "geometry/cloud.h"
#include "geometry/mesh.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct ReconstructParams {
  int depth = 7;
  double samples_per_node = 4;
  bool close_unseen = true;
  double unseen_step_m = 0.003;
  int most_hole_edges = 40;
  double observed_m = 0.004;
  double most_growth = 1.5;
  double wrap_alpha = 0.05;
  double timeout_s = 60;
  double memory_gib = 8;
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& f);
};

/// A closed, outward, manifold surface of one component through oriented points: Poisson reconstruction, or
/// an alpha wrap where Poisson's answer won't do. The metric `answered_by` says which (0 Poisson, 1 wrap),
/// the log why. Errors: UserError (geometry) when neither gives a closed manifold. About 3 s per 100k points.
geometry::TriangleMesh reconstruct(const ReconstructParams& params, pipeline::Run& run,
                                   const geometry::PointCloud& cloud);

inline constexpr pipeline::Stage reconstruct_stage{"reconstruct", 1, &reconstruct};

}  // namespace geocage::stages
