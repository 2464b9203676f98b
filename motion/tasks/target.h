#pragma once
#include <functional>

#include <Eigen/Core>

namespace geocage::motion {

/// y*_t of a task at step t.
using TargetOf = std::function<Eigen::VectorXd(int t)>;

inline TargetOf constant_target(const Eigen::VectorXd& target) {
  return [target](int) { return target; };
}
/// From `first` at step 0 to `last` at step T in a straight line.
inline TargetOf interpolated_target(const Eigen::VectorXd& first, const Eigen::VectorXd& last, int horizon) {
  return [=](int t) { return Eigen::VectorXd(first + double(t) / horizon * (last - first)); };
}

}  // namespace geocage::motion
