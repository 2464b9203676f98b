#pragma once
#include "stages/place/pose_search.h"

namespace geocage::stages {

/// Lays a net of points over the candidate's ball, tightens it, and asks the same rules as of a hand:
/// observed, no penetration, few ways out. One pose a candidate.
CandidatePoses lay_net(const PlaceParams& params, const topology::Scores& scores,
                       const geometry::SignedDistanceField& field, const hands::Hand& hand,
                       const topology::Candidate& candidate);

}  // namespace geocage::stages
