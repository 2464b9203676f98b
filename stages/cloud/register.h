#pragma once
#include "geometry/cloud.h"

namespace geocage::stages {

/// What a registration did.
struct Registered {
  double rms_before_m = 0, rms_after_m = 0;  ///< of the distances, point to plane, of the pairs within reach
  double largest_move_m = 0;                 ///< of a sensor
};

/// Moves views whose sensors' poses are wrong until they fit: point-to-plane ICP (Chen and Medioni 1992) of
/// all views but the first at once, each against all others, in `rounds` steps, with pairs no farther apart
/// than a reach that shrinks from `reach_m` to a fourth of it, facing alike within 45 degrees, far ones
/// weighted down (Tukey). Sensors move with their views. What a view's surface leaves free (the turn of a
/// ball) is left. Precondition: every point has a view. O(rounds points log points).
Registered register_views(geometry::PointCloud& cloud, double reach_m, int rounds);

}  // namespace geocage::stages
