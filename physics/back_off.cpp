#include "physics/back_off.h"

#include <algorithm>

#include "hands/closing.h"

namespace geocage::physics {

BackedOff backed_off(const geometry::SignedDistanceField& field, std::vector<hands::PlacedCapsule> capsules_O,
                     double gap_m) {
  constexpr int rounds = 20;
  constexpr double thinnest_share = 0.25;
  BackedOff result;
  for (hands::PlacedCapsule& capsule : capsules_O) {
    const hands::PlacedCapsule start = capsule;
    hands::CapsuleDistance nearest = hands::capsule_distance(field, capsule);
    double share = 1;
    for (int round = 0; round < rounds && nearest.distance_m < gap_m; ++round) {
      const geometry::Vec3 way = share * (gap_m - nearest.distance_m) * nearest.n_O.stableNormalized();
      const hands::PlacedCapsule moved{capsule.a + way, capsule.b + way, capsule.radius_m};
      const hands::CapsuleDistance there = hands::capsule_distance(field, moved);
      if (there.distance_m > nearest.distance_m)
        capsule = moved, nearest = there;
      else
        share /= 2;  // something is on the other side, too
    }
    if (nearest.distance_m < 0)
      capsule.radius_m = std::max(thinnest_share * start.radius_m, capsule.radius_m + nearest.distance_m);
    result.largest_m =
        std::max({result.largest_m, (capsule.a - start.a).norm(), start.radius_m - capsule.radius_m});
  }
  result.capsules_O = std::move(capsules_O);
  return result;
}

}  // namespace geocage::physics
