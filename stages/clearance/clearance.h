#pragma once
#include "geometry/clearance.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct ClearanceParams {
  std::string unknown = "open";
  double pad_m = 0.05;
  void visit(pipeline::Fields& f);
};

/// How far planning may trust to be from what a map holds (geometry/clearance.h).
geometry::SignedDistanceField clearance(const ClearanceParams& params, pipeline::Run& run,
                                        const geometry::Occupancy& map);

inline constexpr pipeline::Stage clearance_stage{"clearance", 2, &clearance};

}  // namespace geocage::stages
