#pragma once
#include <cstdint>

#include "physics/cage_world.h"
#include "physics/escape_test.h"
#include "physics/outcome.h"
#include "physics/protocols.h"
#include "physics/recording.h"

namespace geocage::physics {

/// What an object did among locked capsules: held (not escaped in time), lost (escaped) or error.
struct CageTrial {
  Outcome outcome = Outcome::held;
  double ended_s = 0;                                   ///< escape, rest, failure, or time over
  double max_displacement_m = 0, max_rotation_rad = 0;  ///< of the centre of mass, of the axes
  double penetration_m = 0;                             ///< deepest contact of the trial
  int steps = 0;
};

/// Gravity along `axis_O` without friction: does the object stay in the hand? Lost once it is gone, or beside
/// the hand with a straight way out. Ends early at rest. Tier B1.
/// A `recording` brings the pose of its hand in its first frame, and gets the frames.
CageTrial pull_trial(const CageProtocol& protocol, const ObjectBody& object, const EscapeTest& escape,
                     const geometry::Vec3& axis_O, std::uint64_t seed, Recording* recording = nullptr);

/// The same without translation along `ring_O`, gravity in the plane across it: the fair test of a ring,
/// which a prism leaves along its axis. `angle_rad` counts from an arbitrary direction of that plane. Tier
/// B1r.
CageTrial ring_trial(const CageProtocol& protocol, const ObjectBody& object, const EscapeTest& escape,
                     const geometry::Vec3& ring_O, double angle_rad, std::uint64_t seed,
                     Recording* recording = nullptr);

/// Random wrenches, a new one every `wrench_hold_s`: force direction even over the sphere with magnitude
/// N(0, (a m g)^2), torque likewise with a m g r_g, r_g the radius of gyration.
/// Lost as above, and when a straight way out exists at the end. Tier B2.
CageTrial wrench_trial(const CageProtocol& protocol, const ObjectBody& object, const EscapeTest& escape,
                       double amplitude, std::uint64_t seed, Recording* recording = nullptr);

}  // namespace geocage::physics
