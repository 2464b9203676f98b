#pragma once
#include <functional>

#include "motion/problem.h"
#include "topology/polyline.h"

namespace geocage::motion {

/// Points p_1 .. p_m [m] of a chain that moves with the state, and unless null their Jacobian, 3 m x dim, one
/// block of three rows below the other.
using MovingChain =
    std::function<void(const Eigen::VectorXd& x, topology::Polyline& points_m, Eigen::MatrixXd* jacobian)>;
/// y*_t of a task at step t.
using TargetOf = std::function<Eigen::VectorXd(int t)>;

TargetOf constant_target(const Eigen::VectorXd& target);
/// From `first` at step 0 to `last` at step T in a straight line.
TargetOf interpolated_target(const Eigen::VectorXd& first, const Eigen::VectorXd& last, int horizon);

/// Signed turns of the chain around `center` in the plane with the unit `normal` (thesis 3.2): one error.
Task winding_task(const MovingChain& chain, const topology::Vec3& center, const topology::Vec3& normal,
                  const TargetOf& target, std::vector<double> precision);

enum class WritheForm {
  scalar,  ///< Gauss linking integral, the sum over 4 pi: 1 error
  sums,    ///< w_j = sum_i Omega_ij [sr] for each segment of the fixed chain
  matrix,  ///< Omega_ij [sr], the moving chain's segments one after the other
};

/// How the moving chain winds round a fixed one (thesis 3.1). Where they touch it jumps: add a clearance
/// task.
Task writhe_task(const MovingChain& chain, const topology::Polyline& fixed, WritheForm form,
                 const TargetOf& target, std::vector<double> precision);

}  // namespace geocage::motion
