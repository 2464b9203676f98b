#pragma once
#include <memory>
#include <vector>

#include "topology/balls.h"

namespace geocage::topology {

/// What became of a call: how many sections needed the whole search for the nearest piece, and how many balls
/// a search of their own because a vertex lies within rounding of the radius, or farther than a byte of hops.
struct LaneReport {
  int searched_whole = 0, searched_plainly = 0;
};

/// ball_fields with the section's plane, 128 balls at once, of one mesh as often as asked: the order of its
/// vertices, rings, patches, grid and the searches' memory stay. The mesh must outlive it; one call at a
/// time, which uses all threads. Precondition as of ball_fields. O(V log V) to make.
class LaneBalls {
 public:
  explicit LaneBalls(const geometry::TriangleMesh& mesh);
  ~LaneBalls();
  /// The same bytes as from a new one.
  BallSet fields(const std::vector<double>& radii_m, Metric metric, const BallOptions& options,
                 LaneReport* report = nullptr);

 private:
  struct Kept;
  const geometry::TriangleMesh& mesh_;
  std::unique_ptr<Kept> kept_;
};

/// Of a mesh that is asked about once.
BallSet lane_ball_fields(const geometry::TriangleMesh& mesh, const std::vector<double>& radii_m,
                         Metric metric, const BallOptions& options, LaneReport* report = nullptr);

}  // namespace geocage::topology
