#include "physics/lift_trial.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "physics/phase.h"

namespace geocage::physics {
namespace {

using geometry::Pose;
using geometry::Vec3;

const Vec3 gravity(0, 0, -9.81);

/// From 0 to 1 with speed and acceleration zero at both ends (minimum jerk).
double ease(double share) {
  const double s = std::clamp(share, 0.0, 1.0);
  return s * s * s * (10 + s * (6 * s - 15));
}

/// The palm moves along `axis`, or turns about it, by `amount` at each time of the phase.
struct PalmMotion {
  std::string name;
  double duration_s;
  Vec3 axis;
  bool turns;
  std::function<double(double)> amount;

  double rate(double t) const { return (amount(t + tiny_s) - amount(t - tiny_s)) / (2 * tiny_s); }
  double acceleration(double t) const {
    return (amount(t + tiny_s) - 2 * amount(t) + amount(t - tiny_s)) / (tiny_s * tiny_s);
  }
  static constexpr double tiny_s = 1e-4;  // second differences err by tiny^2 / 12 of the fourth derivative
};

/// A sine that swells and ebbs in a quarter of a second.
PalmMotion shake(const std::string& label, const Vec3& axis, bool turns, double amplitude, double hertz) {
  constexpr double duration = 2, swell = 0.25;
  return {label, duration, axis, turns, [=](double t) {
            return amplitude * std::sin(2 * std::numbers::pi * hertz * t) * ease(t / swell) *
                   ease((duration - t) / swell);
          }};
}

std::vector<PalmMotion> motions() {
  constexpr double height_m = 0.2, sway_m = 0.05, turn_rad = std::numbers::pi / 6;
  const Vec3 x = Vec3::UnitX(), z = Vec3::UnitZ();
  return {{"lift", 2, z, false, [](double t) { return height_m * ease(t / 2); }},
          {"hold", 2, z, false, [](double) { return 0.0; }},
          shake("shake x 1 Hz", x, false, sway_m, 1),
          shake("shake x 2 Hz", x, false, sway_m, 2),
          shake("shake z 1 Hz", z, false, sway_m, 1),
          shake("shake z 2 Hz", z, false, sway_m, 2),
          shake("turn x 1 Hz", x, true, turn_rad, 1)};
}

/// Forces of a frame that turns about `pivot`, on the object alone.
ObjectLoad turning_load(const World& world, const ObjectBody& object, const Vec3& omega, const Vec3& alpha,
                        const Vec3& pivot) {
  const Pose X_WB = world.X_WB();
  const Vec3 r = X_WB.translation() - pivot;
  const Eigen::Matrix3d I_W = X_WB.linear() * object.inertia_kg_m2.asDiagonal() * X_WB.linear().transpose();
  ObjectLoad load;
  load.force_W_n = -object.mass_kg *
                   (alpha.cross(r) + omega.cross(omega.cross(r)) + 2 * omega.cross(world.velocity_m_s()));
  load.torque_W_nm = -(I_W * alpha + omega.cross(I_W * omega));
  return load;
}

}  // namespace

LiftTrial lift_trial(const Protocol& protocol, const ObjectBody& object, const hands::Hand& hand,
                     const Posture& posture, std::uint64_t seed, Recording* recording) {
  constexpr double fallen_m = 0.05, falling_s = 2;
  World world(protocol.engine, object, hand, posture.X_OH, posture.q, seed);
  Camera camera{recording, object.X_OB.inverse(), posture.X_OH};
  world.hold(squeezed(hand, posture.q, protocol.grip), protocol.grip);
  const double deepest = posture.penetration_m + protocol.max_penetration_growth_m;
  LiftTrial trial;
  const auto seen = [&](const Phase& phase, const std::string& label) {
    trial.phase = label;
    trial.steps += phase.steps, trial.ended_s += phase.steps * protocol.engine.dt_s;
    trial.penetration_m = std::max(trial.penetration_m, phase.penetration_m);
  };
  const Phase settle = simulate(
      world, protocol, [](double) { return ObjectLoad{}; }, protocol.settle_s,
      {protocol.max_drift_m, protocol.max_drift_rad, deepest}, camera, "settle");
  seen(settle, "settle");
  trial.outcome = outcome_of(settle.end, Outcome::unsettled);

  const Pose settled = world.X_WB();
  const Vec3 pivot = settled.translation();
  double height_m = 0;
  for (const PalmMotion& motion : motions()) {
    if (trial.outcome != Outcome::held) return trial;
    camera.moving = [&](double t) {
      const double amount = motion.amount(t);
      const Pose raised(Eigen::Translation3d(0, 0, height_m));
      if (!motion.turns) return Pose(raised * Eigen::Translation3d(amount * motion.axis));
      return Pose(raised * Eigen::Translation3d(pivot) * Eigen::AngleAxisd(amount, motion.axis) *
                  Eigen::Translation3d(-pivot));
    };
    const auto load = [&](double t) {
      if (!motion.turns) {
        world.set_gravity(gravity - motion.acceleration(t) * motion.axis);
        return ObjectLoad{};
      }
      world.set_gravity(Eigen::AngleAxisd(-motion.amount(t), motion.axis) * gravity);
      return turning_load(world, object, motion.rate(t) * motion.axis, motion.acceleration(t) * motion.axis,
                          pivot);
    };
    const Phase phase = simulate(world, protocol, load, motion.duration_s,
                                 {protocol.max_translation_m, protocol.max_rotation_rad, deepest, false},
                                 camera, motion.name.c_str(), &settled);
    seen(phase, motion.name);
    trial.displacement_m = std::max(trial.displacement_m, phase.translation_m);
    trial.rotation_rad = std::max(trial.rotation_rad, phase.rotation_rad);
    trial.outcome = outcome_of(phase.end, Outcome::lost);
    if (!motion.turns) height_m += motion.axis.z() * motion.amount(motion.duration_s);
  }
  if (trial.outcome != Outcome::held) return trial;

  // Turned so that the object hangs below the palm, else it would rest on it.
  world.set_gravity(gravity.norm() * (posture.X_OH.linear() * hand.approach_H));
  world.hold(hand.open_rad, protocol.grip);
  camera.moving = [&](double) { return Pose(Eigen::Translation3d(0, 0, height_m)); };
  const double far = 1e300;
  const Phase fall = simulate(
      world, protocol, [](double) { return ObjectLoad{}; }, falling_s, {fallen_m, far, far, false}, camera,
      "release");
  trial.released = fall.end == Phase::End::moved;
  trial.steps += fall.steps;
  return trial;
}

}  // namespace geocage::physics
