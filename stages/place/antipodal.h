#pragma once
#include "stages/place/place.h"

namespace geocage::stages {

/// Places for two opposed fingers: pairs of surface points whose normals oppose each other within the
/// friction cone (half angle atan mu), at most `widest_m` apart, near the centre of mass. The hand closes
/// along the line through both, and comes from one of eight sides across it. Best first: smallest distance of
/// the centre of mass from the pair's middle; at most `antipodal_places`, farther apart than 15 mm. The same
/// for the same seed. Nguyen 1988.
std::vector<topology::Candidate> antipodal_candidates(const PlaceParams& params,
                                                      const topology::Scores& scores, double widest_m);

}  // namespace geocage::stages
