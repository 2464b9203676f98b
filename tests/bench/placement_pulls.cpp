#include "tests/bench/placement_pulls.h"

#include <numbers>

#include "physics/cage_trial.h"
#include "physics/force_trial.h"
#include "physics/locked_hand.h"

namespace geocage::bench {

Kept kept_by(const hands::Hand& hand, const hands::Grasp& grasp, const physics::ObjectBody& body,
             double radius_m) {
  const auto q = hands::joint_vector(hand.tree, grasp.joints_rad, grasp.object);
  const auto locked = physics::lock({}, body, radius_m, hand, grasp.X_OH, q);
  const auto held = [](const physics::CageTrial& trial) { return trial.outcome == physics::Outcome::held; };
  Kept kept;
  for (const auto& way : physics::six_directions())
    kept.pulls += held(physics::pull_trial(locked.protocol, body, locked.escape, way.axis_O, 0));
  for (int i = 0; i < 4; ++i)
    kept.ring += held(physics::ring_trial(locked.protocol, body, locked.escape, locked.axis_O,
                                          i * std::numbers::pi / 2, 0));
  return kept;
}

}  // namespace geocage::bench
