#pragma once
#include <Eigen/Geometry>

namespace geocage::motion {

using Eigen::Matrix3d;
using Vec3 = Eigen::Vector3d;

/// [w]x: cross_matrix(w) v = w x v.
Matrix3d cross_matrix(const Vec3& w);
/// Rotation by |w| about w.
Matrix3d exponential(const Vec3& w);
/// Its inverse, with |w| in [0, pi].
Vec3 logarithm(const Matrix3d& R);
/// Left Jacobian of SO(3): exp(w + dw) = exp(J dw) exp(w) to first order.
Matrix3d left_jacobian(const Vec3& w);
/// Its inverse: log(exp(dw) exp(w)) = w + J^-1 dw to first order. Precondition: |w| < 2 pi.
Matrix3d inverse_left_jacobian(const Vec3& w);

}  // namespace geocage::motion
