#include "motion/rotation.h"

#include <cmath>

namespace geocage::motion {

Matrix3d cross_matrix(const Vec3& w) {
  Matrix3d W;
  W << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return W;
}

Matrix3d exponential(const Vec3& w) {
  const double angle = w.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix() : Matrix3d::Identity();
}

Vec3 logarithm(const Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}

Matrix3d left_jacobian(const Vec3& w) {
  const double a = w.norm();
  const Matrix3d W = cross_matrix(w);
  if (a < 1e-4) return Matrix3d::Identity() + W / 2 + W * W / 6;
  return Matrix3d::Identity() + (1 - std::cos(a)) / (a * a) * W + (a - std::sin(a)) / (a * a * a) * W * W;
}

Matrix3d inverse_left_jacobian(const Vec3& w) {
  const double a = w.norm();
  const Matrix3d W = cross_matrix(w);
  if (a < 1e-4) return Matrix3d::Identity() - W / 2 + W * W / 12;
  return Matrix3d::Identity() - W / 2 + (1 / (a * a) - (1 + std::cos(a)) / (2 * a * std::sin(a))) * W * W;
}

}  // namespace geocage::motion
