#pragma once
#include <vector>

#include <Eigen/Core>

namespace geocage::motion {

/// Of every coordinate of a state, per second; 0 is no limit.
struct MotionLimits {
  Eigen::VectorXd speed, acceleration;
};

/// The shortest step of equal steps along the waypoints that keeps every speed and acceleration (differences
/// of neighbouring steps), starting and ending at rest.
double shortest_step_s(const std::vector<Eigen::VectorXd>& path, const MotionLimits& limits);

/// The same polyline with as many waypoints elsewhere on it, so that equal steps take less time: the fast
/// parts get fewer. Times between waypoints are stretched until speeds and accelerations hold, then waypoints
/// are spread evenly in time by a monotone cubic (Fritsch and Carlson 1980). Corners between new waypoints
/// are cut: prove it again. `place[k]` is where waypoint k lies on the old path, 2.5 halfway from 2 to 3.
/// Ends stay.
struct Respaced {
  std::vector<Eigen::VectorXd> path;
  std::vector<double> place;
};
Respaced evened_in_time(const std::vector<Eigen::VectorXd>& path, const MotionLimits& limits);

/// What a motion in equal steps takes, in units of the state.
struct Efficiency {
  double cost = 0;    ///< of the search that found it; 0 where none did
  double effort = 0;  ///< integral of |acceleration|^2 [1/s^3], rest before and after
  double duration_s = 0;
  double length = 0;      ///< sum of |x_{t+1} - x_t|
  double smoothness = 0;  ///< integral of |jerk|^2 [1/s^5]
};
Efficiency efficiency_of(const std::vector<Eigen::VectorXd>& path, double step_s);

}  // namespace geocage::motion
