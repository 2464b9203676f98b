#pragma once
#include <string>
#include <vector>

#include "geometry/cloud.h"
#include "geometry/distance_field.h"
#include "hands/grasp.h"
#include "pipeline/stage.h"
#include "topology/scores.h"

namespace geocage::stages {

struct PlaceParams {
  std::string object;
  std::vector<std::string> approaches = {"normal", "center"};
  std::vector<double> gaps_m = {0.02, 0.035};
  int rolls_winding = 2, rolls_curvature = 4;
  std::vector<double> spreads_rad = {0, 0.5};
  double opening_step_rad = 0.1;
  double open_clearance_m = 0.002;
  double support_clearance_m = 0.005;
  double max_lift_m = 0.05;
  double max_com_offset_m = 0.03;
  int min_fingers = 3;
  double max_penetration_m = 0.001;
  double min_blocked_share = 0.9;
  int max_per_candidate = 1;
  int max_grasps = 8;
  void visit(pipeline::Fields& fields);
};

/// Puts the hand at each candidate in every way the parameters list, opens it until it is free, closes it,
/// and keeps the poses that pass all rules: the best `max_per_candidate` of each candidate, the best
/// `max_grasps` of all, by blocked share + 0.3 closure margin (stages/place/README.md). Every other pose is
/// counted under the rule that turned it down, so poses = grasps + rejected. No grasp is a result, not an
/// error. `support_cloud` lends its support plane; without one the object floats. O(poses x closing).
hands::GraspSet place(const PlaceParams& params, pipeline::Run& run, const topology::Scores& scores,
                      const geometry::SignedDistanceField& field, const geometry::PointCloud& support_cloud,
                      const hands::Hand& hand);

inline constexpr pipeline::Stage place_stage{"place", 1, &place};

}  // namespace geocage::stages
