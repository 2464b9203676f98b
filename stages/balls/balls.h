#pragma once
#include "pipeline/stage.h"
#include "topology/balls.h"

namespace geocage::stages {

struct BallsParams {
  std::vector<double> radii_m;
  std::string metric = "hop";
  double eigenvalue_ratio = 1.1;
  std::string section = "plane";
  void visit(pipeline::Fields& f);
};

/// The geodesic ball of every vertex at each radius, and what it says (topology/balls.h).
/// Errors: UserError (configuration) without radii; UserError (geometry) when the mesh is not a closed
/// manifold.
topology::BallSet balls(const BallsParams& params, pipeline::Run& run, const geometry::TriangleMesh& mesh);

inline constexpr pipeline::Stage balls_stage{"balls", 6, &balls};

}  // namespace geocage::stages
