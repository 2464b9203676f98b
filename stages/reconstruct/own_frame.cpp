#include "stages/reconstruct/own_frame.h"

#include <cmath>

#include <Eigen/Eigenvalues>

namespace geocage::stages {

using geometry::Vec3;

namespace {

constexpr double least_gap = 0.02, least_skew = 0.02;

/// The axis towards its longer tail; where both are alike, along O's axis that is nearest.
Vec3 with_sense(const Vec3& axis, const std::vector<Vec3>& points, const Vec3& mean) {
  double squares = 0, cubes = 0;
  for (const Vec3& p : points) {
    const double t = axis.dot(p - mean);
    squares += t * t;
    cubes += t * t * t;
  }
  const auto count = static_cast<double>(points.size());
  const double skew = squares > 0 ? cubes / count / std::pow(squares / count, 1.5) : 0;
  if (std::abs(skew) > least_skew) return skew > 0 ? axis : Vec3(-axis);
  int most = 0;
  axis.cwiseAbs().maxCoeff(&most);
  return axis[most] > 0 ? axis : Vec3(-axis);
}

/// O's x or, near to it, y, made perpendicular to `axis`.
Vec3 beside(const Vec3& axis) {
  const Vec3 other = std::abs(axis.x()) < 0.8 ? Vec3::UnitX() : Vec3::UnitY();
  return (other - axis.dot(other) * axis).normalized();
}

}  // namespace

geometry::Pose own_frame(const std::vector<Vec3>& points) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Vec3& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> moments(scatter);
  const Vec3& size = moments.eigenvalues();
  const bool low = size[1] - size[0] > least_gap * size[2], high = size[2] - size[1] > least_gap * size[2];
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns: of C, in O
  if (low || high) {
    const Vec3 first = with_sense(moments.eigenvectors().col(high ? 2 : 0), points, mean);
    const Vec3 second = low && high ? with_sense(moments.eigenvectors().col(1), points, mean) : beside(first);
    axes << first, second, first.cross(second);
  }
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.4, Vec3(3, 1, 2).normalized()).toRotationMatrix();
  geometry::Pose X_CO = geometry::Pose::Identity();
  X_CO.linear() = turn * axes.transpose();
  X_CO.translation() = -(X_CO.linear() * mean);
  return X_CO;
}

}  // namespace geocage::stages
