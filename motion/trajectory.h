#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/pose.h"
#include "motion/timing.h"

namespace geocage::motion {

/// One approach, the file format "geocage-trajectory 1": the hand's base and joints every dt_s. With an arm,
/// its joints come before the hand's.
struct Trajectory {
  double dt_s = 0.02;
  std::vector<std::string> joints;
  std::vector<std::vector<double>> q_rad;  ///< a row of joint values a step
  std::vector<geometry::Pose> X_OH;        ///< one a step
  double min_clearance_m = 0;              ///< of the open hand, proven
  bool certified = false;                  ///< all of the motion is proven free but for the fingers' contact
  std::string outcome;                     ///< "planned", or why there is none
  /// Who answered: "gauss_newton" or "aico", or "script" or "rrt_connect" where their version is not proven
  /// or not shorter. `seed` is what was improved.
  std::string planner, seed;
  int free_steps = 0;  ///< waypoints before closing's contact: proven to the tolerance of an open hand
  double self_clearance_m = 0;   ///< proven of the hand (and arm) with itself until then
  double likely_duration_s = 0;  ///< from the marginal likelihood; the motion takes at least as long
  Efficiency efficiency;
  std::string arm;                                   ///< empty: the hand floats
  geometry::Pose X_OB = geometry::Pose::Identity();  ///< where the arm stands
};

/// One trajectory a grasp, in the order of the grasps.
struct TrajectorySet {
  std::vector<Trajectory> trajectories;
};

/// For tables: `time_s`, then the hand's base (metres, quaternion w x y z) and all joints (radians).
std::string csv_of(const Trajectory& trajectory);
/// For execution: the fields of ROS's trajectory_msgs as YAML: `joint_trajectory` with positions, velocities
/// (central differences, 0 at the ends) and times; a floating base as `multi_dof_joint_trajectory`.
std::string joint_trajectory_of(const Trajectory& trajectory);

/// "trajectories": trajectory_N.json, and of planned ones trajectory_N.csv and trajectory_N_ros.yaml.
std::string_view artefact_kind(const TrajectorySet*);
void save_artefact(const TrajectorySet& set, const std::filesystem::path& dir);
void load_artefact(TrajectorySet& set, const std::filesystem::path& dir);

}  // namespace geocage::motion
