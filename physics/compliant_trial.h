#pragma once
#include "physics/cage_trial.h"
#include "physics/posture.h"

namespace geocage::physics {

/// The pull of `cage_trial.h` in a hand that may give way: motors hold `posture` with the force test's limits
/// of torque, force and speed, in its world and at its step, and nothing rubs. Gravity acts on the object
/// alone. Lost once the object has left the hand as it stands then. Tier B1's second run. An `error` is that
/// of the force test: contacts 10 mm deeper than at the start.
CageTrial compliant_pull(const CageProtocol& protocol, const ObjectBody& object, double radius_m,
                         const hands::Hand& hand, const Posture& posture, const geometry::Vec3& axis_O,
                         std::uint64_t seed);

}  // namespace geocage::physics
