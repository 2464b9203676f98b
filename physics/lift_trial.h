#pragma once
#include <string>

#include "physics/force_trial.h"

namespace geocage::physics {

/// What lifting, shaking and letting go showed.
struct LiftTrial {
  Outcome outcome = Outcome::held;  ///< until the hand opens: held, lost, unsettled or error
  std::string phase;                ///< the last one before the hand opens: where it was lost, if it was
  bool released = false;            ///< held, and fell once the hand opened: it was not glued
  double displacement_m = 0, rotation_rad = 0;  ///< largest motion against the palm from the settled pose
  double ended_s = 0, penetration_m = 0;
  int steps = 0;
};

/// Settles as a push does, then under 9.81 m/s^2 along -z of O: lifts by 20 cm in 2 s (minimum jerk), holds 2
/// s, shakes by 5 cm at 1 and 2 Hz along x and z (peak 1.97 and 7.9 m/s^2), turns by 30 deg at 1 Hz about x
/// through the object, 2 s each, and opens the hand with the palm turned above the object, which must fall by
/// 5 cm within 2 s. The form is SimReady's and ACRONYM's, the amplitudes are ours. Simulated in the palm's
/// frame: gravity minus the palm's acceleration acts on object and links, exactly as long as the palm does
/// not turn; turning, the object gets the terms of Euler, Coriolis and centrifugal force, the links (held by
/// motors) the turned gravity only.
LiftTrial lift_trial(const Protocol& protocol, const ObjectBody& object, const hands::Hand& hand,
                     const Posture& posture, std::uint64_t seed, Recording* recording = nullptr);

}  // namespace geocage::physics
