#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "physics/outcome.h"
#include "physics/posture.h"
#include "physics/protocols.h"
#include "physics/recording.h"
#include "physics/world.h"

#include "geometry/pose.h"

namespace geocage::physics {

/// A load along a unit vector of O: a force through the centre of mass, or where it `turns`, a torque.
struct Direction {
  std::string name;  ///< "+x", "-y+z"
  geometry::Vec3 axis_O;
  bool turns = false;

  /// "push +x", "turn +x".
  std::string trial() const { return (turns ? "turn " : "push ") + name; }
};
/// Along the axes of O.
const std::vector<Direction>& six_directions();
/// The loads of a force test by name. "axes": the six. "all": 26 forces, towards the faces (the six), edges
/// and corners of a cube, then six torques about the axes. UserError (configuration) with the known names.
const std::vector<Direction>& find_loads(std::string_view name);
std::vector<std::string> load_set_names();

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

/// Settles the object in the squeezing hand, then loads it in a world of its own: with mass * acceleration
/// through the centre of mass, or a torque of that force times the radius of gyration. The load keeps its
/// direction in W. Motion is that of the centre of mass and the body's axes against the (fixed) palm. With a
/// `recording`, it gets the frames.
PushTrial push_trial(const Protocol& protocol, const ObjectBody& object, const hands::Hand& hand,
                     const Posture& posture, const Direction& way, std::uint64_t seed,
                     Recording* recording = nullptr);

}  // namespace geocage::physics
