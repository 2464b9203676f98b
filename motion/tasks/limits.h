#pragma once
#include "motion/problem.h"

namespace geocage::motion {

/// e = how far each coordinate is beyond its limits; infinite limits are no limits.
Task limits_task(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, std::vector<double> precision);

}  // namespace geocage::motion
