#include "physics/controls.h"

#include <cmath>
#include <numbers>

#include "physics/cage_trial.h"
#include "physics/force_trial.h"
#include "physics/formula_field.h"

#include "pipeline/each_item.h"

namespace geocage::physics {
namespace {

using geometry::Pose;
using geometry::Vec3;
using hands::PlacedCapsule;

constexpr double mass_kg = 0.1;

template <class Trial>
void count(Control& control, const Trial& trial) {
  ++control.trials;
  control.held += trial.outcome == Outcome::held;
}

Control ball_control() {
  return {"ball in a closed box", Control::Rule::all_trials_hold, 1};
}
Control stopped_ring_control() {
  return {"ring on a bar with end stops", Control::Rule::all_trials_hold, 1};
}
Control bare_bar_control() {
  return {"ring along a bare bar", Control::Rule::no_trial_holds, 1};
}

struct BallInABox {
  static constexpr double ball_m = 0.03, wall_m = 0.05, play_m = 5e-4;
  geometry::SignedDistanceField field =
      filled(Vec3::Constant(0.09), 0.003, [](const Vec3& p) { return p.norm() - ball_m; });
  ObjectBody ball{&field, mass_kg, Pose::Identity(), Vec3::Constant(0.4 * mass_kg * ball_m * ball_m)};

  static std::vector<PlacedCapsule> walls() {
    std::vector<PlacedCapsule> walls;
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {1.0, -1.0}) {
        const Vec3 center = side * (ball_m + wall_m + play_m) * Vec3::Unit(axis);
        const Vec3 along = 0.02 * Vec3::Unit((axis + 1) % 3);
        walls.push_back({center - along, center + along, wall_m});
      }
    return walls;
  }
};

Control ball_in_a_box(const CageProtocol& protocol, int seeds) {
  const BallInABox scene;
  const ObjectBody& ball = scene.ball;
  const EscapeTest escape(ball, BallInABox::ball_m, BallInABox::walls());
  Control control = ball_control();
  for (const Direction& way : six_directions())
    count(control, pull_trial(protocol, ball, escape, way.axis_O, 0));
  std::vector<CageTrial> wrenches(2 * static_cast<std::size_t>(seeds));
  pipeline::for_each_item(wrenches.size(), [&](std::size_t i) {
    wrenches[i] = wrench_trial(protocol, ball, escape, i % 2 == 0 ? 1 : 5, i / 2);
  });
  for (const CageTrial& trial : wrenches) count(control, trial);
  return control;
}

struct RingOnBar {
  static constexpr double ring_m = 0.05, spoke_m = 0.12, spoke_radius_m = 0.006;
  double tube_m, bar_m, half_bar_m;
  geometry::SignedDistanceField field;
  ObjectBody ring;

  RingOnBar(double tube, double bar, double half_bar)
      : tube_m(tube),
        bar_m(bar),
        half_bar_m(half_bar),
        field(filled(
            Vec3(0.09, 0.09, tube + 0.032), 0.002,
            [tube](const Vec3& p) { return std::hypot(std::hypot(p.x(), p.y()) - ring_m, p.z()) - tube; })),
        ring{&field, mass_kg, Pose::Identity()} {
    const double across = 0.5 * ring_m * ring_m + 0.625 * tube * tube,
                 along = ring_m * ring_m + 0.75 * tube * tube;
    ring.inertia_kg_m2 = mass_kg * Vec3(across, across, along);
  }
  RingOnBar(const RingOnBar&) = delete;  // the body points at the field

  std::vector<PlacedCapsule> bars(bool stops) const {
    std::vector<PlacedCapsule> bars = {{Vec3(0, 0, -half_bar_m), Vec3(0, 0, half_bar_m), bar_m}};
    for (const double z : {-half_bar_m, half_bar_m})
      for (int spoke = 0; stops && spoke < 6; ++spoke) {
        const double angle = spoke * std::numbers::pi / 3;
        bars.push_back(
            {Vec3(0, 0, z), Vec3(spoke_m * std::cos(angle), spoke_m * std::sin(angle), z), spoke_radius_m});
      }
    return bars;
  }
  EscapeTest escape(bool stops) const { return {ring, ring_m + tube_m, bars(stops)}; }
};

/// Capsules on a base that never moves.
hands::Hand fixed_hand(const std::vector<PlacedCapsule>& capsules) {
  hands::Hand hand;
  hand.name = "fixed", hand.tree.links = {"base"};
  for (const PlacedCapsule& one : capsules) hand.capsules.push_back({0, one.a, one.b, one.radius_m});
  return hand;
}

}  // namespace

bool Control::ok() const {
  switch (rule) {
    case Rule::no_trial_holds:
      return held == 0;
    case Rule::no_grasp_passes:
      return passed == 0;
    case Rule::all_trials_hold:
      return held == trials;
    case Rule::reported:
      break;
  }
  return true;
}

std::string rule_text(Control::Rule rule) {
  switch (rule) {
    case Control::Rule::no_trial_holds:
      return "no trial may hold";
    case Control::Rule::no_grasp_passes:
      return "no grasp may hold in every trial";
    case Control::Rule::all_trials_hold:
      return "every trial must hold";
    case Control::Rule::reported:
      break;
  }
  return "the rate of chance";
}

std::vector<Control> known_cages(const CageProtocol& protocol, int seeds) {
  const RingOnBar scene(0.008, 0.006, 0.06);
  Control stopped = stopped_ring_control();
  for (const Direction& way : six_directions())
    count(stopped, pull_trial(protocol, scene.ring, scene.escape(true), way.axis_O, 0));
  Control open = bare_bar_control();
  for (const double side : {1.0, -1.0})
    count(open, pull_trial(protocol, scene.ring, scene.escape(false), side * Vec3::UnitZ(), 0));
  return {ball_in_a_box(protocol, seeds), stopped, open};
}

std::vector<Control> known_cages(const Protocol& protocol) {
  Protocol slippery = protocol;
  slippery.engine.friction = 0;
  const auto push = [&](Control& control, const ObjectBody& object, const hands::Hand& hand,
                        const Direction& way) {
    count(control, push_trial(slippery, object, hand, {Pose::Identity(), Eigen::VectorXd(0), 0}, way, 0));
  };
  const BallInABox box;
  constexpr double tube_m = 0.02, play_m = 0.005;
  const RingOnBar bar(tube_m, RingOnBar::ring_m - tube_m - play_m,
                      tube_m + RingOnBar::spoke_radius_m + play_m);
  const hands::Hand walls = fixed_hand(BallInABox::walls()), stops = fixed_hand(bar.bars(true)),
                    bare = fixed_hand(bar.bars(false));
  Control ball = ball_control(), stopped = stopped_ring_control(), open = bare_bar_control();
  for (const Direction& way : six_directions()) push(ball, box.ball, walls, way);
  for (const Direction& way : six_directions()) push(stopped, bar.ring, stops, way);
  for (const Direction& way : six_directions())
    if (way.axis_O.z() != 0) push(open, bar.ring, bare, way);
  return {ball, stopped, open};
}

}  // namespace geocage::physics
