#include "physics/phase.h"

#include <algorithm>
#include <cmath>

namespace geocage::physics {

using geometry::Pose;

void Camera::see(const World& world, const char* phase, double time_s, bool last) const {
  if (!recording) return;
  const Pose X = moving ? moving(time_s) : Pose::Identity();
  recording->see(start_s + time_s, phase, X * world.X_WB() * X_BO, X * X_WH, world.hand().joints(), last);
}

Phase simulate(World& world, const Protocol& protocol, const std::function<ObjectLoad(double)>& load,
               double duration_s, const PhaseLimits& limits, Camera& camera, const char* name,
               const Pose* from) {
  const Pose start = from ? *from : world.X_WB();
  const double dt = protocol.engine.dt_s;
  const int steps = static_cast<int>(std::lround(duration_s / dt));
  const int rest_steps = limits.ends_at_rest ? static_cast<int>(std::lround(protocol.rest_s / dt)) : 0;
  Phase phase;
  int resting = 0;
  camera.see(world, name, 0);
  const auto ended = [&](Phase::End end) {
    phase.end = end;
    camera.see(world, name, phase.steps * dt, true);
    camera.start_s += phase.steps * dt;
    return phase;
  };
  while (phase.steps < steps) {
    const ObjectLoad now = load(phase.steps * dt);
    world.step(now.force_W_n, now.torque_W_nm);
    ++phase.steps;
    camera.see(world, name, phase.steps * dt);
    const double speed = world.velocity_m_s().norm(), spin = world.spin_rad_s().norm();
    phase.penetration_m = std::max(phase.penetration_m, world.penetration_m());
    const bool sane = speed <= protocol.max_speed_m_s && std::isfinite(spin);  // false for NaN, too
    if (!sane || phase.penetration_m > limits.penetration_m) return ended(Phase::End::failed);

    const Pose X_WB = world.X_WB();
    const double moved = (X_WB.translation() - start.translation()).norm();
    const double turned =
        Eigen::AngleAxisd(Eigen::Matrix3d(start.linear().transpose() * X_WB.linear())).angle();
    phase.translation_m = std::max(phase.translation_m, moved);
    phase.rotation_rad = std::max(phase.rotation_rad, turned);
    if (moved >= limits.translation_m || turned >= limits.rotation_rad) return ended(Phase::End::moved);

    const bool rests = speed < protocol.rest_speed_m_s && spin < protocol.rest_spin_rad_s &&
                       world.fastest_joint() < protocol.rest_spin_rad_s;
    resting = rests ? resting + 1 : 0;
    if (rest_steps > 0 && resting >= rest_steps) return ended(Phase::End::rest);
  }
  return ended(Phase::End::elapsed);
}

Outcome outcome_of(Phase::End end, Outcome when_moved) {
  switch (end) {
    case Phase::End::failed:
      return Outcome::error;
    case Phase::End::moved:
      return when_moved;
    default:
      return Outcome::held;
  }
}

}  // namespace geocage::physics
