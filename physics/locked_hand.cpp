#include "physics/locked_hand.h"

#include <algorithm>
#include <limits>

#include "physics/back_off.h"
#include "physics/posture.h"

namespace geocage::physics {

LockedHand lock(const CageProtocol& protocol, const ObjectBody& object, double radius_m,
                const hands::Hand& hand, const geometry::Pose& X_OH, const Eigen::VectorXd& q) {
  // Deeper than half of the thinnest finger, its axis comes near the surface, and the field's normal may
  // turn.
  double thinnest_m = std::numeric_limits<double>::infinity();
  for (const hands::Capsule& capsule : hand.capsules) thinnest_m = std::min(thinnest_m, capsule.radius_m);
  CageProtocol own = protocol;
  own.max_penetration_m = thinnest_m / 2;
  // A contact is a plane for one step; past a finger of radius r it is off by s^2 / 2 r after a way of s.
  own.engine.most_motion_m = std::min(own.engine.most_motion_m, thinnest_m / 4);
  BackedOff back = backed_off(*object.field, hands::placed_capsules(hand, X_OH, q));
  return {own,
          {object, radius_m, std::move(back.capsules_O)},
          X_OH.linear() * hand.flexion_axis_H,
          back.largest_m};
}

}  // namespace geocage::physics
