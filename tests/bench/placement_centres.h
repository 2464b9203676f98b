#pragma once
#include <string>
#include <vector>

#include "topology/scores.h"

namespace geocage::bench {

/// How the centres of one group are chosen.
struct Group {
  std::string heuristic;  ///< winding, curvature, random, window (S1 in [4.1, 4.6], smallest offset first),
                          ///< ties (S1, equals by offset)
  bool com_rule = false;  ///< only vertices whose normal's line passes within 20 mm of the centre of mass
  std::string name() const { return heuristic + (com_rule ? "+com" : ""); }
};

/// Up to `count` vertices, best first, 15 mm apart, of those that the group's rules leave; ties at random.
/// Fewer when the surface has no more. The control is `random`.
std::vector<topology::Candidate> centres_of(const Group& group, const geometry::TriangleMesh& mesh,
                                            const topology::BallFields& ball, int count, unsigned seed);

/// Share of vertices whose S1 is a full turn: there S1 ranks nothing.
double saturated_share(const topology::BallFields& ball);

}  // namespace geocage::bench
