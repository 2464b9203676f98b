#include "physics/force_trial.h"

#include <algorithm>
#include <cmath>

namespace geocage::physics {
namespace {

using geometry::Pose;
using geometry::Vec3;

/// How far a body has come from where it was.
struct Motion {
  double translation_m = 0, rotation_rad = 0;
  bool beyond(double limit_m, double limit_rad) const {
    return translation_m >= limit_m || rotation_rad >= limit_rad;
  }
};

Motion motion(const Pose& from, const Pose& to) {
  const Eigen::Matrix3d R = from.linear().transpose() * to.linear();
  return {(to.translation() - from.translation()).norm(), Eigen::AngleAxisd(R).angle()};
}

/// A stretch of simulated time under one force: ends when the object is lost or at rest, or the engine has
/// failed.
struct Phase {
  enum class End { elapsed, rest, moved, failed } end = End::elapsed;
  Motion largest;
  double penetration_m = 0;
  int steps = 0;
};

struct Limits {
  double translation_m, rotation_rad, penetration_m;
};

Phase simulate(World& world, const Protocol& protocol, const Vec3& force, double duration_s,
               const Limits& limits) {
  const Pose start = world.X_WB();
  const double dt = protocol.engine.dt_s;
  const int steps = static_cast<int>(std::lround(duration_s / dt));
  const int rest_steps = static_cast<int>(std::lround(protocol.rest_s / dt));
  Phase phase;
  int resting = 0;
  while (phase.steps < steps) {
    world.step(force);
    ++phase.steps;
    const double speed = world.velocity_m_s().norm(), spin = world.spin_rad_s().norm();
    phase.penetration_m = std::max(phase.penetration_m, world.penetration_m());
    const bool sane = speed <= protocol.max_speed_m_s && std::isfinite(spin);  // false for NaN, too
    if (!sane || phase.penetration_m > limits.penetration_m) return phase.end = Phase::End::failed, phase;

    const Motion now = motion(start, world.X_WB());
    phase.largest.translation_m = std::max(phase.largest.translation_m, now.translation_m);
    phase.largest.rotation_rad = std::max(phase.largest.rotation_rad, now.rotation_rad);
    if (now.beyond(limits.translation_m, limits.rotation_rad)) return phase.end = Phase::End::moved, phase;

    const bool rests = speed < protocol.rest_speed_m_s && spin < protocol.rest_spin_rad_s &&
                       world.fastest_joint() < protocol.rest_spin_rad_s;
    resting = rests ? resting + 1 : 0;
    if (rest_steps > 0 && resting >= rest_steps) return phase.end = Phase::End::rest, phase;
  }
  return phase;
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

}  // namespace

const std::array<Direction, 6>& six_directions() {
  static const std::array<Direction, 6> directions = {{{"+x", Vec3::UnitX()},
                                                       {"-x", -Vec3::UnitX()},
                                                       {"+y", Vec3::UnitY()},
                                                       {"-y", -Vec3::UnitY()},
                                                       {"+z", Vec3::UnitZ()},
                                                       {"-z", -Vec3::UnitZ()}}};
  return directions;
}

Eigen::VectorXd squeezed(const hands::Hand& hand, const Eigen::VectorXd& q, const Grip& grip) {
  Eigen::VectorXd target = q;
  for (const hands::Joint& joint : hand.tree.joints) {
    if (joint.type == hands::Joint::Type::fixed || joint.name != hand.tree.dof_names[joint.dof]) continue;
    const bool slides = joint.type == hands::Joint::Type::prismatic;
    const double closing = hand.closing_rad[joint.dof];
    const double sign = closing > 0 ? 1 : closing < 0 ? -1 : 0;
    target[joint.dof] += sign * (slides ? grip.squeeze_m : grip.squeeze_rad);
  }
  return target.cwiseMin(hand.tree.upper_rad).cwiseMax(hand.tree.lower_rad);
}

PushTrial push_trial(const Protocol& protocol, const ObjectBody& object, const hands::Hand& hand,
                     const Posture& posture, const Vec3& axis_O, std::uint64_t seed) {
  World world(protocol.engine, object, hand, posture.X_OH, posture.q, seed);
  world.hold(squeezed(hand, posture.q, protocol.grip), protocol.grip);
  const double deepest = posture.penetration_m + protocol.max_penetration_growth_m;

  const Phase settle = simulate(world, protocol, Vec3::Zero(), protocol.settle_s,
                                {protocol.max_drift_m, protocol.max_drift_rad, deepest});
  PushTrial trial;
  trial.outcome = outcome_of(settle.end, Outcome::unsettled);
  trial.drift_m = settle.largest.translation_m, trial.drift_rad = settle.largest.rotation_rad;
  trial.penetration_m = settle.penetration_m, trial.steps = settle.steps;
  if (trial.outcome != Outcome::held) return trial;

  const Vec3 force = object.mass_kg * protocol.acceleration_m_s2 * axis_O;
  const Phase push = simulate(world, protocol, force, protocol.push_s,
                              {protocol.max_translation_m, protocol.max_rotation_rad, deepest});
  trial.outcome = outcome_of(push.end, Outcome::lost);
  if (protocol.contact_holds && trial.outcome == Outcome::held && !world.touching())
    trial.outcome = Outcome::lost;
  trial.displacement_m = push.largest.translation_m, trial.rotation_rad = push.largest.rotation_rad;
  trial.ended_s = push.steps * protocol.engine.dt_s;
  trial.penetration_m = std::max(trial.penetration_m, push.penetration_m), trial.steps += push.steps;
  return trial;
}

}  // namespace geocage::physics
