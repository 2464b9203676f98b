#pragma once
#include "motion/problem.h"

namespace geocage::motion {

/// phi(x) = x, target `goal`.
Task state_task(const Eigen::VectorXd& goal, std::vector<double> precision);

/// phi(x) = coordinates first, first + 1, ... of x, as many as `goal` has: the posture of some joints.
Task posture_task(const Eigen::VectorXd& goal, Eigen::Index first, std::vector<double> precision);

}  // namespace geocage::motion
