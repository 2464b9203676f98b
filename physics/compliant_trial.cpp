#include "physics/compliant_trial.h"

#include <algorithm>
#include <cmath>

namespace geocage::physics {

using geometry::Pose;
using geometry::Vec3;

CageTrial compliant_pull(const CageProtocol& protocol, const ObjectBody& object, double radius_m,
                         const hands::Hand& hand, const Posture& posture, const Vec3& axis_O,
                         std::uint64_t seed) {
  Protocol grip = find_protocol("geocage-force");
  grip.engine.friction = 0;
  World world(grip.engine, object, hand, posture.X_OH, posture.q, seed);
  world.hold(posture.q, grip.grip);

  constexpr double look_s = 0.05;
  const double dt = grip.engine.dt_s, deepest = posture.penetration_m + grip.max_penetration_growth_m;
  const auto steps_of = [&](double seconds) { return static_cast<int>(std::lround(seconds / dt)); };
  const Vec3 weight = object.mass_kg * protocol.gravity_m_s2 * axis_O;
  const Pose start = world.X_WB(), X_BO = object.X_OB.inverse();
  const auto escaped = [&] {
    const EscapeTest now(object, radius_m, hands::placed_capsules(hand, posture.X_OH, world.hand().joints()));
    const Pose X_WO = world.X_WB() * X_BO;
    return now.gone(X_WO) || (now.beside(X_WO) && now.straight_way_out(X_WO));
  };
  CageTrial seen;
  int resting = 0;
  while (seen.steps < steps_of(protocol.pull_s)) {
    world.step(weight);
    ++seen.steps;
    const double speed = world.velocity_m_s().norm(), spin = world.spin_rad_s().norm();
    seen.penetration_m = std::max(seen.penetration_m, world.penetration_m());
    const bool sane = speed <= protocol.max_speed_m_s && std::isfinite(spin);  // false for NaN, too
    if (!sane || seen.penetration_m > deepest) {
      seen.outcome = Outcome::error;
      break;
    }
    const Pose now = world.X_WB();
    seen.max_displacement_m =
        std::max(seen.max_displacement_m, (now.translation() - start.translation()).norm());
    seen.max_rotation_rad =
        std::max(seen.max_rotation_rad, Eigen::AngleAxisd(start.linear().transpose() * now.linear()).angle());
    if (seen.steps % steps_of(look_s) == 0 && escaped()) {
      seen.outcome = Outcome::lost;
      break;
    }
    const bool rests = speed < protocol.rest_speed_m_s && spin < protocol.rest_spin_rad_s &&
                       world.hand().fastest_joint() < protocol.rest_spin_rad_s;
    resting = rests ? resting + 1 : 0;
    if (resting >= steps_of(protocol.rest_s)) break;
  }
  seen.ended_s = seen.steps * dt;
  return seen;
}

}  // namespace geocage::physics
