#include "physics/force_trial.h"

#include <algorithm>

#include "physics/phase.h"
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pipeline/error.h"

namespace geocage::physics {

using geometry::Vec3;

namespace {

/// From the middle of a cube to its faces (`axes` 1), edges (2) or corners (3).
void add_directions(int axes, std::vector<Direction>& directions) {
  const auto add = [&](int x, int y, int z) {
    const Vec3 way(x, y, z);
    if (way.lpNorm<1>() != axes) return;
    std::string name;
    for (int axis = 0; axis < 3; ++axis)
      if (way[axis] != 0) name += {way[axis] > 0 ? '+' : '-', "xyz"[axis]};
    directions.push_back({name, way.normalized()});
  };
  if (axes == 1)
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {1, -1}) add(side * (axis == 0), side * (axis == 1), side * (axis == 2));
  else
    for (const int x : {1, 0, -1})
      for (const int y : {1, 0, -1})
        for (const int z : {1, 0, -1}) add(x, y, z);
}

struct LoadSet {
  std::string name;
  std::vector<Direction> loads;
};

const std::vector<LoadSet>& load_sets() {
  static const std::vector<LoadSet> sets = [] {
    std::vector<Direction> axes, all;
    add_directions(1, axes);
    for (const int count : {1, 2, 3}) add_directions(count, all);
    for (const Direction& axis : axes) all.push_back({axis.name, axis.axis_O, true});
    return std::vector<LoadSet>{{"axes", axes}, {"all", all}};
  }();
  return sets;
}

}  // namespace

const std::vector<Direction>& six_directions() {
  return load_sets().front().loads;
}

std::vector<std::string> load_set_names() {
  std::vector<std::string> names;
  for (const LoadSet& set : load_sets()) names.push_back(set.name);
  return names;
}

const std::vector<Direction>& find_loads(std::string_view name) {
  const auto found = std::ranges::find(load_sets(), name, &LoadSet::name);
  if (found != load_sets().end()) return found->loads;
  throw pipeline::UserError(pipeline::Fault::configuration, "evaluate.loads",
                            fmt::format("there are no loads '{}'", name),
                            fmt::format("known: {}", fmt::join(load_set_names(), ", ")));
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
                     const Posture& posture, const Direction& way, std::uint64_t seed, Recording* recording) {
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

  const double newtons = object.mass_kg * protocol.acceleration_m_s2;
  ObjectLoad load;
  if (way.turns)
    load.torque_W_nm = newtons * gyration_m(object) * way.axis_O;
  else
    load.force_W_n = newtons * way.axis_O;
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
