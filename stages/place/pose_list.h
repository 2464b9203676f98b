#pragma once
#include <optional>
#include <vector>

#include "stages/place/place.h"

namespace geocage::stages {

/// One way of putting the hand at a candidate. The palm comes along a line; roll 0 puts the flexion axis
/// along `flexion_O`.
struct PoseChoice {
  geometry::Vec3 p_O, approach_O, flexion_O;
  double roll_rad = 0;
  double gap_m = 0;  ///< of a gripper: how far its pads reach behind p
  double spread_rad = 0;
  double opened_rad = 0;  ///< of the first joints, beyond the open posture
};

/// All ways that the parameters list, and how many are lost because the ball's centre lies on the surface.
struct PoseList {
  std::vector<PoseChoice> choices;
  int no_direction = 0;
};
/// Lines x rolls x `gaps_m` x spreads: those of one line and roll follow each other.
PoseList listed_poses(const PlaceParams& params, const topology::Candidate& candidate,
                      const geometry::TriangleMesh& mesh, const std::vector<double>& gaps_m);

/// `local_samples` draws around the lines of the list: moved sideways, tilted, rolled, spread, opened. The
/// same for the same seed and vertex.
std::vector<PoseChoice> local_poses(const PlaceParams& params, const PoseList& listed,
                                    const topology::Candidate& candidate, const std::vector<double>& gaps_m);

}  // namespace geocage::stages
