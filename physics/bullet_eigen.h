#pragma once
#include <LinearMath/btTransform.h>

#include "geometry/pose.h"

namespace geocage::physics {

inline btVector3 bullet(const geometry::Vec3& p) {
  return {p.x(), p.y(), p.z()};
}
inline geometry::Vec3 eigen(const btVector3& p) {
  return {p.x(), p.y(), p.z()};
}

inline btMatrix3x3 bullet(const Eigen::Matrix3d& R) {
  return {R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)};
}
inline btTransform bullet(const geometry::Pose& X) {
  return btTransform(bullet(Eigen::Matrix3d(X.linear())), bullet(geometry::Vec3(X.translation())));
}

inline geometry::Pose eigen(const btTransform& X) {
  geometry::Pose pose = geometry::Pose::Identity();
  for (int row = 0; row < 3; ++row) pose.linear().row(row) = eigen(X.getBasis().getRow(row)).transpose();
  pose.translation() = eigen(X.getOrigin());
  return pose;
}

}  // namespace geocage::physics
