#include "geometry/pose.h"

namespace geocage::geometry {

Eigen::Matrix3d frame_from_z(const Vec3& z) {
  Vec3::Index least;
  z.cwiseAbs().minCoeff(&least);
  const Vec3 x = z.cross(Vec3::Unit(least)).normalized();
  Eigen::Matrix3d frame;
  frame << x, z.cross(x), z;
  return frame;
}

}  // namespace geocage::geometry
