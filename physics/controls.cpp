#include "physics/controls.h"

#include <cmath>
#include <numbers>

#include "physics/cage_trial.h"
#include "physics/force_trial.h"
#include "physics/formula_field.h"

namespace geocage::physics {
namespace {

using geometry::Pose;
using geometry::Vec3;
using hands::PlacedCapsule;

constexpr double mass_kg = 0.1;

void count(Control& control, const CageTrial& trial) {
  ++control.trials;
  control.held += trial.outcome == Outcome::held;
}

Control ball_in_a_box(const CageProtocol& protocol, int seeds) {
  constexpr double ball_m = 0.03, wall_m = 0.05, play_m = 5e-4;
  const auto field = filled(Vec3::Constant(0.09), 0.003, [](const Vec3& p) { return p.norm() - ball_m; });
  std::vector<PlacedCapsule> walls;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {1.0, -1.0}) {
      const Vec3 center = side * (ball_m + wall_m + play_m) * Vec3::Unit(axis);
      const Vec3 along = 0.02 * Vec3::Unit((axis + 1) % 3);
      walls.push_back({center - along, center + along, wall_m});
    }
  const ObjectBody ball{&field, mass_kg, Pose::Identity(), Vec3::Constant(0.4 * mass_kg * ball_m * ball_m)};
  const EscapeTest escape(ball, ball_m, walls);
  Control control{"ball in a closed box", Control::Rule::all_trials_hold, 1};
  for (const Direction& way : six_directions())
    count(control, pull_trial(protocol, ball, escape, way.axis_O, 0));
  std::vector<CageTrial> wrenches(2 * static_cast<std::size_t>(seeds));
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < wrenches.size(); ++i)
    wrenches[i] = wrench_trial(protocol, ball, escape, i % 2 == 0 ? 1 : 5, i / 2);
  for (const CageTrial& trial : wrenches) count(control, trial);
  return control;
}

struct RingOnBar {
  static constexpr double ring_m = 0.05, tube_m = 0.008, bar_m = 0.006, half_bar_m = 0.06, spoke_m = 0.12;
  geometry::SignedDistanceField field = filled(Vec3(0.09, 0.09, 0.04), 0.002, [](const Vec3& p) {
    return std::hypot(std::hypot(p.x(), p.y()) - ring_m, p.z()) - tube_m;
  });
  ObjectBody ring{&field, mass_kg, Pose::Identity(),
                  mass_kg* Vec3(0.5 * ring_m * ring_m + 0.625 * tube_m * tube_m,
                                0.5 * ring_m * ring_m + 0.625 * tube_m * tube_m,
                                ring_m* ring_m + 0.75 * tube_m * tube_m)};

  EscapeTest escape(bool stops) const {
    std::vector<PlacedCapsule> bars = {{Vec3(0, 0, -half_bar_m), Vec3(0, 0, half_bar_m), bar_m}};
    for (const double z : {-half_bar_m, half_bar_m})
      for (int spoke = 0; stops && spoke < 6; ++spoke) {
        const double angle = spoke * std::numbers::pi / 3;
        bars.push_back({Vec3(0, 0, z), Vec3(spoke_m * std::cos(angle), spoke_m * std::sin(angle), z), bar_m});
      }
    return {ring, ring_m + tube_m, bars};
  }
};

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
  const RingOnBar scene;
  Control stopped{"ring on a bar with end stops", Control::Rule::all_trials_hold, 1};
  for (const Direction& way : six_directions())
    count(stopped, pull_trial(protocol, scene.ring, scene.escape(true), way.axis_O, 0));
  Control open{"ring along a bare bar", Control::Rule::no_trial_holds, 1};
  for (const double side : {1.0, -1.0})
    count(open, pull_trial(protocol, scene.ring, scene.escape(false), side * Vec3::UnitZ(), 0));
  return {ball_in_a_box(protocol, seeds), stopped, open};
}

}  // namespace geocage::physics
