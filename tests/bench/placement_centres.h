#pragma once
#include <string>
#include <vector>

#include "topology/scores.h"

namespace geocage::bench {

/// How the centres of one group are chosen.
struct Group {
  /// winding, curvature, random; ties (S1, equals by offset); and, smallest offset first, window (S1 in [low,
  /// high]) and girth (the ring's girth, 2 pi times the distance of p from the ball's axis, in [low, high] m,
  /// at the radius that brings it nearest to their middle).
  std::string heuristic;
  bool com_rule = false;  ///< only vertices whose normal's line passes within 20 mm of the centre of mass
  double low = 0, high = 0;
  std::string name() const;
};

/// Up to `count` vertices, best first, 15 mm apart, of those that the group's rules leave; ties at random.
/// Fewer when the surface has no more. The control is `random`. The first of `balls` is the hand's; only
/// girth looks at the others.
std::vector<topology::Candidate> centres_of(const Group& group, const geometry::TriangleMesh& mesh,
                                            const std::vector<topology::BallFields>& balls, int count,
                                            unsigned seed);

/// Share of vertices whose S1 is a full turn: there S1 ranks nothing.
double saturated_share(const topology::BallFields& ball);

}  // namespace geocage::bench
