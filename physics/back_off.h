#pragma once
#include <vector>

#include "geometry/distance_field.h"
#include "hands/hand.h"

namespace geocage::physics {

/// Capsules none of which is inside the object.
struct BackedOff {
  std::vector<hands::PlacedCapsule> capsules_O;
  double largest_m = 0;  ///< the farthest that a capsule was moved, or its radius shrunk
};

/// Grasps are made on a noisy surface, so on the true one some fingers start inside the object. Locked there
/// they would wedge it, and what happens next would be the solver's choice. Each capsule that is nearer than
/// `gap_m` moves out along the object's normal by what is missing, as often as that helps; one that is
/// pressed from two sides gets thinner by the rest, to a quarter of its radius at least. O(capsules) looks
/// along their axes.
BackedOff backed_off(const geometry::SignedDistanceField& field, std::vector<hands::PlacedCapsule> capsules_O,
                     double gap_m = 5e-5);

}  // namespace geocage::physics
