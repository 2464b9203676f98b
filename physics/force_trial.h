#pragma once
#include <array>
#include <cstdint>

#include "physics/outcome.h"
#include "physics/posture.h"
#include "physics/protocols.h"
#include "physics/recording.h"
#include "physics/world.h"

#include "geometry/pose.h"

namespace geocage::physics {

/// A unit direction along an axis of the object.
struct Direction {
  const char* name;
  geometry::Vec3 axis_O;
};
const std::array<Direction, 6>& six_directions();

/// `q` squeezed along the hand's closing directions, within the joints' limits.
Eigen::VectorXd squeezed(const hands::Hand& hand, const Eigen::VectorXd& q, const Grip& grip);

/// What one push showed.
struct PushTrial {
  Outcome outcome = Outcome::held;              ///< held, lost, unsettled or error
  double drift_m = 0, drift_rad = 0;            ///< largest motion while settling
  double displacement_m = 0, rotation_rad = 0;  ///< largest motion from the settled pose under the push
  double ended_s = 0;                           ///< time after the push began at which the trial was decided
  double penetration_m = 0;                     ///< deepest contact of the whole trial
  int steps = 0;
};

/// Settles the object in the squeezing hand, then pushes its centre of mass with mass * acceleration along
/// `axis_O`, in a world of its own. Motion is that of the centre of mass and the body's axes against the
/// (fixed) palm. With a `recording`, it gets the frames.
PushTrial push_trial(const Protocol& protocol, const ObjectBody& object, const hands::Hand& hand,
                     const Posture& posture, const geometry::Vec3& axis_O, std::uint64_t seed,
                     Recording* recording = nullptr);

}  // namespace geocage::physics
