#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/pose.h"

namespace geocage::motion {

/// One approach, the file format "geocage-trajectory 1": the hand's base and joints every dt_s.
struct Trajectory {
  double dt_s = 0.02;
  std::vector<std::string> joints;
  std::vector<std::vector<double>> q_rad;  ///< a row of joint values a step
  std::vector<geometry::Pose> X_OH;        ///< one a step
  double min_clearance_m = 0;              ///< of the open hand, proven
  bool certified = false;                  ///< all of the motion is proven free but for the fingers' contact
  std::string outcome;                     ///< "planned", or why there is none
  std::string planner;  ///< who answered: "aico"; "script" or "rrt_connect" where its version is not proven
};

/// One trajectory a grasp, in the order of the grasps.
struct TrajectorySet {
  std::vector<Trajectory> trajectories;
};

std::string_view artefact_kind(const TrajectorySet*);  ///< "trajectories": trajectory_<i>.json
void save_artefact(const TrajectorySet& set, const std::filesystem::path& dir);
void load_artefact(TrajectorySet& set, const std::filesystem::path& dir);

}  // namespace geocage::motion
