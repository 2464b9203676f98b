#pragma once
#include <Eigen/Geometry>

namespace geocage::geometry {

using Vec3 = Eigen::Vector3d;
/// Rigid motion X_AB: p_A = X_AB * p_B (docs/frames.md).
using Pose = Eigen::Isometry3d;

/// Plane { p : normal . p = offset_m }, unit normal.
struct Plane {
  Vec3 normal = Vec3::UnitZ();
  double offset_m = 0;
  double height_m(const Vec3& p) const { return normal.dot(p) - offset_m; }
};

/// Any rotation that takes z to the unit vector `z`; x and y are arbitrary but the same for the same `z`.
Eigen::Matrix3d frame_from_z(const Vec3& z);

}  // namespace geocage::geometry
