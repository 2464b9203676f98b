#pragma once
#include <cstdint>
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
  std::vector<std::string> heuristics;
  int antipodal_places = 12;
  std::vector<std::string> approaches = {"normal", "center"};
  bool align_plane = true;
  std::vector<double> gaps_m = {0.02, 0.035};
  std::vector<double> straddle_m = {0.01, 0.02, 0.035};
  int rolls_winding = 2, rolls_curvature = 4;
  std::vector<double> spreads_rad = {0, 0.5};
  bool spread_by_shape = false;
  double opening_step_rad = 0.1, max_opening_rad = 3.2;
  double open_clearance_m = 0.002;
  int local_samples = 0;
  double local_offset_m = 0.015, local_tilt_rad = 0.35;
  int local_rolls = 8;
  std::vector<double> local_spreads_rad = {0, 0.5, 1.05}, local_openings_rad = {0, 0.5};
  std::string closing_order = "hand";
  double support_clearance_m = 0.005;
  double max_lift_m = 0.05;
  double max_com_offset_m = 0.03;
  double min_observed = 0.1;
  double max_reach_m = 0;
  std::vector<double> reach_from_m = {0, 0, 0};
  int min_fingers = 3;
  double max_penetration_m = 0.001;
  double escape_m = 0.06;
  double min_blocked_share = 0.9;
  std::string rank_by = "cage";
  double margin_weight = 0.3;
  int max_per_candidate = 1;
  int max_grasps = 8;
  bool measures = true;
  double friction_mu = 0.6;
  int friction_edges = 8;
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& fields);
};

/// Puts the hand at each candidate in every way the parameters list, opens it until it is free, closes it,
/// and keeps the poses that pass all rules: the best `max_per_candidate` of each candidate, the best
/// `max_grasps` of all (stages/place/README.md). What is kept is measured. Every other pose is
/// counted under the rule that turned it down, so poses = grasps + rejected. No grasp is a result, not an
/// error. `support_cloud` lends its support plane; without one the object floats. `others` is what else is in
/// the way (stage clearance); without nodes it forbids nothing. A net of points is laid over each candidate's
/// ball instead. O(poses x closing).
hands::GraspSet place(const PlaceParams& params, pipeline::Run& run, const topology::Scores& scores,
                      const geometry::SignedDistanceField& field, const geometry::PointCloud& support_cloud,
                      const geometry::SignedDistanceField& others, const hands::Hand& hand);

inline constexpr pipeline::Stage place_stage{"place", 5, &place};

}  // namespace geocage::stages
