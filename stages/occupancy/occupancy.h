#pragma once
#include "geometry/occupancy.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct OccupancyParams {
  double resolution_m = 0.005, least_end_share = 0;
  void visit(pipeline::Fields& f);
};

/// Free, occupied and unknown space from the rays of a cloud (geometry/occupancy.h).
geometry::Occupancy occupancy(const OccupancyParams& params, pipeline::Run& run,
                              const geometry::PointCloud& cloud);

inline constexpr pipeline::Stage occupancy_stage{"occupancy", 1, &occupancy};

}  // namespace geocage::stages
