#pragma once
#include "geometry/clearance.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct ClearanceParams {
  std::string unknown = "open";
  double pad_m = 0.05;
  double near_cells = 1.5;
  double noise_deviations = 4;
  double noise_reach_m = 0.03;
  int least_cells = 4;
  void visit(pipeline::Fields& f);
};

/// Distance to what is in the way of a hand that comes to the object: what the map holds besides the object
/// (`field`), its support (of the cloud) and stray cells (geometry/clearance.h). A field without nodes when
/// that is nothing.
geometry::SignedDistanceField clearance(const ClearanceParams& params, pipeline::Run& run,
                                        const geometry::Occupancy& map, const geometry::PointCloud& cloud,
                                        const geometry::SignedDistanceField& field);

inline constexpr pipeline::Stage clearance_stage{"clearance", 3, &clearance};

}  // namespace geocage::stages
