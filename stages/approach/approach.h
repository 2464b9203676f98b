#pragma once
#include "geometry/cloud.h"
#include "geometry/distance_field.h"
#include "hands/grasp.h"
#include "motion/aico.h"
#include "motion/trajectory.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct ApproachParams {
  double start_m = 0.3;
  double retreat_m = 0.12;
  int steps = 50;
  int closing_steps = 20;
  double margin_m = 0.012;
  double collision_precision = 0.5;
  double goal_precision = 1e4;
  double limits_precision = 10;
  double tolerance_m = 0.0005;
  double closing_tolerance_m = 0.003;
  double base_speed_m_s = 0.25;
  double base_turn_rad_s = 1;
  double base_acceleration_m_s2 = 1;
  double joint_acceleration_rad_s2 = 10;
  double damping = 0.01;
  int max_sweeps = 40;
  int rrt_iterations = 2000;
  void visit(pipeline::Fields& f);
};

/// The way of a floating hand to each grasp: open and far, along the approach axis (or a tilted one where
/// that collides, or as RRT-Connect finds it where all do) to the grasp's pose, then closing as `close_hand`
/// closes. The open part is smoothed by kinematic AICO. What answers is proven free all along
/// (motion::Prover): the open hand to `tolerance_m`, closing fingers to `closing_tolerance_m`; `planner` says
/// whose path it is. Where none is proven the outcome says why. Every grasp has an entry. Fingers against
/// each other are not looked at. The cloud lends its support plane.
motion::TrajectorySet approach(const ApproachParams& params, pipeline::Run& run,
                               const hands::GraspSet& grasps, const geometry::SignedDistanceField& field,
                               const geometry::PointCloud& support_cloud, const hands::Hand& hand);

inline constexpr pipeline::Stage approach_stage{"approach", 2, &approach};

}  // namespace geocage::stages
