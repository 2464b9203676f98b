#pragma once
#include <vector>

#include "topology/balls.h"

namespace geocage::topology {

/// ball_fields with the section's plane: 128 balls at once. What became of it: how many sections needed the
/// whole search for the nearest piece, and how many balls a search of their own because a vertex lies within
/// rounding of the radius, or farther than a byte of hops.
struct LaneReport {
  int searched_whole = 0, searched_plainly = 0;
};
BallSet lane_ball_fields(const geometry::TriangleMesh& mesh, const std::vector<double>& radii_m,
                         Metric metric, const BallOptions& options, LaneReport* report = nullptr);

}  // namespace geocage::topology
