#pragma once
#include "geometry/cloud.h"
#include "geometry/distance_field.h"
#include "hands/grasp.h"
#include "motion/trajectory.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct ApproachParams {
  double start_m = 0.3;
  double retreat_m = 0.12;
  int steps = 32;
  int closing_steps = 20;
  double margin_m = 0.012;
  double self_margin_m = 0.004;
  double collision_precision = 0.5;
  double goal_precision = 1e4;
  double limits_precision = 10;
  double winding_precision = 0;
  double tolerance_m = 0.0005;
  double closing_tolerance_m = 0.003;
  double wrap_clearance_m = 0.002;
  double cut_clearance_m = 0.001;
  std::string search = "gauss_newton";
  double base_speed_m_s = 0.25;
  double base_turn_rad_s = 1;
  double base_acceleration_m_s2 = 1;
  double joint_acceleration_rad_s2 = 10;
  double effort_variance = 1;
  double damping = 0.1;
  int max_sweeps = 40;
  int rrt_iterations = 2000;
  int ways = 14;
  int candidates = 2;
  std::string arm = "none";
  double arm_distance_m = 0.55;
  double arm_below_m = 0.1;
  int arm_placements = 8;
  void visit(pipeline::Fields& f);
};

/// The way to each grasp: of a floating hand, or of one on an arm that stands beside the object. Open and far
/// to begin with, closing as `close_hand` closes at the end, smoothed between; several ways in are tried and
/// the shortest that is proven is kept (motion::ApproachPlanner). What answers is proven free all along
/// (motion::Prover) of the object, the support, what else the map holds, and of itself: to `tolerance_m`,
/// fingers that close to `closing_tolerance_m`; `planner` says whose path it is. Where none is proven the
/// outcome says why. Every grasp has an entry. The cloud lends its support plane; `others` is what else is in
/// the way (stage clearance), and may be without nodes. With an arm, `arm_placements` places around the
/// object are tried and the one that reaches most grasps is used for all.
motion::TrajectorySet approach(const ApproachParams& params, pipeline::Run& run,
                               const hands::GraspSet& grasps, const geometry::SignedDistanceField& field,
                               const geometry::PointCloud& support_cloud,
                               const geometry::SignedDistanceField& others, const hands::Hand& hand);

inline constexpr pipeline::Stage approach_stage{"approach", 7, &approach};

}  // namespace geocage::stages
