#include "physics/force_trial.h"

#include "physics/phase.h"

namespace geocage::physics {

using geometry::Vec3;

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
                     const Posture& posture, const Vec3& axis_O, std::uint64_t seed, Recording* recording) {
  Camera camera{recording, object.X_OB.inverse(), posture.X_OH};
  World world(protocol.engine, object, hand, posture.X_OH, posture.q, seed);
  world.hold(squeezed(hand, posture.q, protocol.grip), protocol.grip);
  const double deepest = posture.penetration_m + protocol.max_penetration_growth_m;

  const Phase settle = simulate(
      world, protocol, [](double) { return ObjectLoad{}; }, protocol.settle_s,
      {protocol.max_drift_m, protocol.max_drift_rad, deepest}, camera, "settle");
  PushTrial trial;
  trial.outcome = outcome_of(settle.end, Outcome::unsettled);
  trial.drift_m = settle.translation_m, trial.drift_rad = settle.rotation_rad;
  trial.penetration_m = settle.penetration_m, trial.steps = settle.steps;
  if (trial.outcome != Outcome::held) return trial;

  ObjectLoad load{object.mass_kg * protocol.acceleration_m_s2 * axis_O};
  const Phase push = simulate(
      world, protocol, [&](double) { return load; }, protocol.push_s,
      {protocol.max_translation_m, protocol.max_rotation_rad, deepest}, camera, "push");
  trial.outcome = outcome_of(push.end, Outcome::lost);
  if (protocol.contact_holds && trial.outcome == Outcome::held && !world.touching())
    trial.outcome = Outcome::lost;
  trial.displacement_m = push.translation_m, trial.rotation_rad = push.rotation_rad;
  trial.ended_s = push.steps * protocol.engine.dt_s;
  trial.penetration_m = std::max(trial.penetration_m, push.penetration_m), trial.steps += push.steps;
  return trial;
}

}  // namespace geocage::physics
