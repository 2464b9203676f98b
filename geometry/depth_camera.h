#pragma once
#include "geometry/pose.h"

namespace geocage::geometry {

/// A pinhole camera. Image point (u, v) in pixels, u to the right and v down, the first pixel's centre at
/// (0.5, 0.5); the sensor frame S looks along its z, with x to the right and y down.
struct DepthCamera {
  int width = 640, height = 480;
  double fx_px = 525, fy_px = 525, cx_px = 320, cy_px = 240;
  Pose X_OS = Pose::Identity();

  /// The direction of image point (u, v) in S, with z = 1.
  Vec3 direction_S(double u_px, double v_px) const {
    return {(u_px - cx_px) / fx_px, (v_px - cy_px) / fy_px, 1};
  }
  Vec3 p_OS() const { return X_OS.translation(); }
};

/// A camera at `from_O` that looks at `at_O`. Precondition: the two differ.
Pose look_at(const Vec3& from_O, const Vec3& at_O);
/// The k-th of n directions spread evenly over the sphere (Fibonacci lattice).
Vec3 lattice_direction(int k, int n);

}  // namespace geocage::geometry
