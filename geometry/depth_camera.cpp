#include "geometry/depth_camera.h"

#include <cmath>

namespace geocage::geometry {

Pose look_at(const Vec3& from_O, const Vec3& at_O) {
  Pose X_OS = Pose::Identity();
  X_OS.linear() = frame_from_z((at_O - from_O).normalized());
  X_OS.translation() = from_O;
  return X_OS;
}

Vec3 lattice_direction(int k, int n) {
  const double z = 1 - (2 * k + 1.0) / n, angle = k * M_PI * (3 - std::sqrt(5.0)), r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

}  // namespace geocage::geometry
