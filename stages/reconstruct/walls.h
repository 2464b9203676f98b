#pragma once
#include "geometry/cloud.h"

namespace geocage::stages {

struct ThickenedWalls {
  std::size_t points = 0;  ///< moved
  double most_m = 0;       ///< that one was moved by
};

/// Moves the two sides of thin walls apart along their normals until they are `wall_m` thick: noise mixes
/// their points, and normals that cancel leave a surface with holes or none. Opposite points are those
/// within 1.5 `wall_m` whose normals differ by more than 120 degrees and that lie within half of `wall_m`
/// beside the normal; the thickness is their mean distance along it, where there are four or more. Less than
/// -0.4 `wall_m` is a gap, not a wall. Precondition: normals. O(N log N).
ThickenedWalls thicken_walls(geometry::PointCloud& cloud, double wall_m);

}  // namespace geocage::stages
