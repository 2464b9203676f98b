#pragma once
#include "geometry/cloud.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct CloudParams {
  int outlier_neighbours = 16;
  double outlier_sigmas = 2.5;
  double voxel_m = 0.002;
  int normal_neighbours = 24;
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& f);
};

/// A cloud without outliers, thinned to one point a voxel, with outward unit normals: towards each point's
/// sensor where it is known, else by consistent propagation. Views, origins and support are kept; metrics
/// tell what was dropped. Errors: UserError (geometry) when fewer than 50 points are left.
geometry::PointCloud cloud(const CloudParams& params, pipeline::Run& run, const geometry::PointCloud& raw);

inline constexpr pipeline::Stage cloud_stage{"cloud", 1, &cloud};

}  // namespace geocage::stages
