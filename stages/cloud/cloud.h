#pragma once
#include "geometry/cloud.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct CloudParams {
  std::string registration = "none";
  double icp_reach_m = 0.02;
  int icp_rounds = 15;
  int outlier_neighbours = 16;
  double outlier_sigmas = 2.5;
  double voxel_m = 0.002;
  std::string smooth = "none";
  double smooth_radius_m = 0.008;
  int normal_neighbours = 24;
  double grazing_deg = 90;
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& f);
};

/// A cloud without outliers, thinned to one point a voxel, with outward unit normals: towards each point's
/// sensor where it is known, else by consistent propagation. Views that don't fit may be registered first.
/// Views, origins and support are kept; labels are not. Metrics tell what was dropped and add up:
/// points_in = outliers + lonely + thinned + grazing + points. Turning the object or the order of its points
/// changes nothing but rounding, where the cloud's principal axes are distinct. Errors: UserError (geometry)
/// when fewer than 50 points are left.
geometry::PointCloud cloud(const CloudParams& params, pipeline::Run& run, const geometry::PointCloud& raw);

inline constexpr pipeline::Stage cloud_stage{"cloud", 2, &cloud};

}  // namespace geocage::stages
