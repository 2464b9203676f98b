#pragma once
#include <vector>

#include "geometry/mesh.h"

namespace geocage::topology {

using geometry::Vec3;

/// The piece of a ball's cut that is measured, as points in order; a ring repeats none.
struct Section {
  std::vector<Vec3> path;
  bool closed = false;
};

/// Cuts triangles with the plane through `center` with unit normal `axis`: the connected piece that comes
/// nearest to p. Empty when the plane meets no triangle. A vertex on the plane counts as above it. O(n log n)
/// for n cut triangles.
Section cut(const geometry::TriangleMesh& mesh, const std::vector<int>& triangles, const Vec3& p,
            const Vec3& center, const Vec3& axis);

/// Winding angle W in [pi, 2 pi] of a section around `center` (thesis 3.5): the angle that the path runs
/// through, at least half a turn and at most a full one; 2 pi for a ring. NaN for an empty one.
double winding_angle_rad(const Section& section, const Vec3& center, const Vec3& axis);

}  // namespace geocage::topology
