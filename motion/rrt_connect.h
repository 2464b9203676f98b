#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

namespace geocage::motion {

struct ConnectRule {
  double range = 0.3;         ///< of one extension, in units of the state
  double sample_every = 0.1;  ///< share of `range` between the states of an edge that are looked at
  int iterations = 3000;      ///< checks of the end condition: no clock decides, so answers repeat
  int shortcuts = 60;
  std::uint64_t seed = 1;
};

enum class ConnectOutcome { found, start_blocked, goal_blocked, gave_up };

struct Connection {
  ConnectOutcome outcome = ConnectOutcome::gave_up;
  std::vector<Eigen::VectorXd> path;  ///< corners from start to goal; empty unless found
};

/// RRT-Connect (Kuffner and LaValle 2000) of OMPL in the box [lower, upper], then shortcuts between random
/// corners. `free` answers for one state; edges are sampled, so the path wants a proof of its own. States
/// come from this call's own engine: the same answer whatever else runs. Precondition: start and goal within
/// the box.
Connection rrt_connect(const Eigen::VectorXd& start, const Eigen::VectorXd& goal,
                       const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                       const std::function<bool(const Eigen::VectorXd&)>& free, const ConnectRule& rule);

}  // namespace geocage::motion
