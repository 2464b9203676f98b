#pragma once
#include <algorithm>
#include <cmath>

#include "topology/polyline.h"

namespace geocage::topology {

// The differences between points of two segments ab and cd fill a parallelogram with the corners p = c - a,
// q = d - a, r = d - b, s = c - b: Omega is the solid angle that it fills for an eye at the origin. Pairs of
// segments beside each other share corners and sides.

/// A point of one chain less a point of the other [m].
struct WritheCorner {
  Vec3 at;
  double length;

  explicit WritheCorner(const Vec3& difference = Vec3::Zero()) : at(difference), length(difference.norm()) {}
};

/// Change of a polygon's solid angle with one of its sides: moving x of the side uv by dx sweeps
/// (dx x dl) . x / |x|^3 (the law of Biot and Savart). Integrated over the side, where dx runs linearly from
/// du to dv, that is du . n / |u| + dv . n / |v| with n = v x u / (|u| |v| + u . v): one term a side, and
/// infinite only where the side goes through the eye, which `apart` denies. From v to u all is negated.
struct WritheSide {
  Vec3 by_u, by_v;  ///< n / |u|, n / |v|
  double dot = 0;
  bool apart = false;

  WritheSide() = default;
  WritheSide(const WritheCorner& u, const WritheCorner& v) : dot(u.at.dot(v.at)) {
    const Vec3 across = v.at.cross(u.at);
    const double product = u.length * v.length, area2 = across.squaredNorm();
    apart = !(dot <= 0 && area2 <= 1e-30 * product * product);
    // Of opposite arrows the sum |u| |v| + u . v is a small difference: area^2 over the other sum is the
    // same.
    const double shrink = dot > 0 ? 1 / (product + dot) : (product - dot) / area2;
    by_u = shrink / u.length * across;
    by_v = shrink / v.length * across;
  }
};

}  // namespace geocage::topology
