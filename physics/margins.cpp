#include "physics/margins.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "physics/cage_trial.h"
#include "physics/locked_hand.h"

#include "geometry/noise.h"
#include "hands/closing.h"
#include "pipeline/each_item.h"

namespace geocage::physics {

using geometry::Pose;
using geometry::Vec3;

Margin hardest(double easy, double hard, int halvings, const std::function<bool(double)>& holds) {
  Margin margin{easy, hard, {}};
  if (!holds(easy)) return margin;
  if (holds(hard)) return margin.level = hard, margin;
  double good = easy, bad = hard;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (good + bad);
    (holds(middle) ? good : bad) = middle;
  }
  margin.level = good;
  return margin;
}

std::vector<PoseDraw> pose_draws(int count, std::uint64_t seed) {
  std::vector<PoseDraw> draws;
  for (int i = 0; i < count; ++i) {
    geometry::RandomStream random(seed, static_cast<std::uint64_t>(i));
    PoseDraw& draw = draws.emplace_back();
    for (int axis = 0; axis < 3; ++axis) draw.shift[axis] = 2 * random.uniform() - 1;
    draw.axis = random.direction();
    draw.turn = 2 * random.uniform() - 1;
  }
  return draws;
}

Pose displaced(const hands::Hand& hand, const Pose& X_OH, const PoseDraw& draw, double shift_m,
               double turn_rad) {
  return X_OH * Eigen::Translation3d(hand.palm_H + shift_m * draw.shift) *
         Eigen::AngleAxisd(turn_rad * draw.turn, draw.axis) * Eigen::Translation3d(-hand.palm_H);
}

int draws_held(const Protocol& protocol, const ObjectBody& object, const hands::Hand& hand, const Pose& X_OH,
               const Eigen::VectorXd& q_open, const MarginRule& rule, double noise, std::uint64_t seed,
               int most_failures) {
  const std::vector<PoseDraw> draws = pose_draws(rule.draws, seed);
  const auto holds = [&](const PoseDraw& draw) {
    const Pose X = displaced(hand, X_OH, draw, noise * rule.noise_m, noise * rule.noise_rad);
    const hands::ClosedHand closed = hands::close_hand(hand, *object.field, X, q_open, {});
    if (closed.outcome != hands::Closure::closed) return false;
    const Posture posture = posture_at(hand, *object.field, X, closed.q);
    if (posture.penetration_m > protocol.max_start_penetration_m) return false;
    return std::ranges::all_of(six_directions(), [&](const Direction& way) {
      return push_trial(protocol, object, hand, posture, way, seed).outcome == Outcome::held;
    });
  };
  if (noise == 0) return holds(draws.front()) ? rule.draws : 0;  // all are the same
  // Stops once the answer is settled, so it is the same whichever draws come first.
  std::atomic<int> failures = 0;
  pipeline::for_each_item(draws.size(), [&](std::size_t i) {
    if (failures <= most_failures && !holds(draws[i])) ++failures;
  });
  return failures <= most_failures ? rule.draws - failures : 0;
}

ForceMargins force_margins(const Protocol& protocol, const ObjectBody& object, const hands::Hand& hand,
                           const Pose& X_OH, const Eigen::VectorXd& q_open, const MarginRule& rule,
                           std::uint64_t seed) {
  const auto held = [&](const Protocol& tested, double noise, int most_failures) {
    return draws_held(tested, object, hand, X_OH, q_open, rule, noise, seed, most_failures);
  };
  const int needed = static_cast<int>(std::ceil(rule.share * rule.draws - 1e-9));
  const auto enough = [&](const Protocol& tested, double noise) {
    return held(tested, noise, rule.draws - needed) >= needed;
  };

  ForceMargins margins;
  margins.draws = rule.draws, margins.held = held(protocol, 1, rule.draws);
  margins.noise = hardest(0, 2, rule.halvings, [&](double noise) { return enough(protocol, noise); });
  const auto grips = [&](double mu) {
    Protocol tested = protocol;
    tested.engine.friction = mu;
    return enough(tested, rule.small_share);
  };
  margins.friction = hardest(1, 0, rule.halvings, grips);
  // More friction is not always easier: the closing fingers drag more.
  if (!margins.friction.level && protocol.engine.friction < 1)
    margins.friction = hardest(protocol.engine.friction, 0, rule.halvings, grips);
  margins.push_m_s2 = hardest(0, 100, rule.halvings, [&](double push) {
    Protocol tested = protocol;
    tested.acceleration_m_s2 = push;
    return enough(tested, rule.small_share);
  });
  return margins;
}

std::vector<Loosening> loosening(const CageProtocol& protocol, const ObjectBody& object, double radius_m,
                                 const hands::Hand& hand, const Pose& X_OH, const Eigen::VectorXd& q,
                                 const Eigen::VectorXd& q_open, int halvings, std::uint64_t seed,
                                 int* trials) {
  constexpr int pulls = 6, ways = 4;
  const auto holds = [&](const LockedHand& locked, int trial) {
    if (trials) ++*trials;
    if (trial < pulls)
      return pull_trial(locked.protocol, object, locked.escape, six_directions()[trial].axis_O, seed)
                 .outcome == Outcome::held;
    const double angle = 2 * std::numbers::pi * (trial - pulls) / ways;
    return ring_trial(locked.protocol, object, locked.escape, locked.axis_O, angle, seed).outcome ==
           Outcome::held;
  };
  const LockedHand closed = lock(protocol, object, radius_m, hand, X_OH, q);
  std::vector<int> kept;
  for (int trial = 0; trial < pulls + ways; ++trial)
    if (holds(closed, trial)) kept.push_back(trial);
  if (kept.empty()) return {};

  std::vector<Loosening> all;
  for (const hands::Finger& finger : hand.fingers) {
    const auto still = [&](double share) {
      Eigen::VectorXd opened = q;
      for (const int dof : finger.dofs) opened[dof] += share * (q_open[dof] - q[dof]);
      const LockedHand locked = lock(protocol, object, radius_m, hand, X_OH, opened);
      return std::ranges::all_of(kept, [&](int trial) { return holds(locked, trial); });
    };
    all.push_back({finger.name, hardest(0, 1, halvings, still)});
  }
  return all;
}

}  // namespace geocage::physics
