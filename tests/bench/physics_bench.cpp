// Time of a step and of a trial of each tier, one thread. A ball of 70 mm in the three closed fingers of the
// SDH: 13 capsules of a locked hand, or an articulated body whose motors squeeze; and a dumbbell's bare step.
//   physics_bench [--benchmark_filter=...]
#include <numbers>
#include <vector>

#include "physics/cage_trial.h"
#include "physics/force_trial.h"
#include "physics/formula_field.h"
#include "physics/locked_hand.h"
#include <benchmark/benchmark.h>

#include "hands/closing.h"

namespace geocage::bench {
namespace {

using geometry::Pose;
using geometry::Vec3;

/// A ball whose field is as fine as a real object's, and the hand closed around it.
struct Scene {
  static constexpr double radius_m = 0.035, mass_kg = 0.1;
  hands::Hand hand = hands::load_hand("schunk_sdh");
  geometry::SignedDistanceField field =
      physics::filled(Vec3::Constant(0.08), 0.002, [](const Vec3& p) { return p.norm() - radius_m; });
  physics::ObjectBody body{&field, mass_kg, Pose::Identity(),
                           Vec3::Constant(0.4 * mass_kg * radius_m * radius_m)};
  Pose X_OH = Pose::Identity();
  Eigen::VectorXd q;

  Scene() {
    X_OH.translation() = -(hand.palm_H + 0.06 * hand.approach_H);
    Eigen::VectorXd open = hand.open_rad;
    open[hand.tree.dof(hand.spread_dof)] = std::numbers::pi / 3;
    q = hands::close_hand(hand, field, X_OH, open, {}).q;
  }
};

const Scene& scene() {
  static const Scene one;
  return one;
}

void cage_step(benchmark::State& state) {
  const Scene& s = scene();
  const auto locked = physics::lock({}, s.body, Scene::radius_m, s.hand, s.X_OH, s.q);
  physics::CageWorld world(locked.protocol.engine, s.body, Scene::radius_m, locked.escape.capsules(),
                           Pose::Identity(), 0);
  const Vec3 force = s.body.mass_kg * 10 * Vec3(0.6, 0.8, 0);
  double steps = 0;
  for (auto _ : state) steps += world.step(force, Vec3::Zero());
  state.counters["us/step"] =
      benchmark::Counter(1e-6 * steps, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(cage_step);

void force_step(benchmark::State& state) {
  const Scene& s = scene();
  const physics::Protocol& protocol = physics::find_protocol("geocage-force");
  physics::World world(protocol.engine, s.body, s.hand, s.X_OH, s.q, 0);
  world.hold(physics::squeezed(s.hand, s.q, protocol.grip), protocol.grip);
  const Vec3 force = s.body.mass_kg * 10 * Vec3(0.6, 0.8, 0);
  for (auto _ : state) world.step(force);
}
BENCHMARK(force_step)->Unit(benchmark::kMicrosecond);

/// Every amplitude in turn on the same seed.
void wrench_trial(benchmark::State& state, const std::vector<double>& weights) {
  const Scene& s = scene();
  const auto locked = physics::lock({}, s.body, Scene::radius_m, s.hand, s.X_OH, s.q);
  std::size_t trial = 0;
  double steps = 0;
  for (auto _ : state) {
    steps += physics::wrench_trial(locked.protocol, s.body, locked.escape, weights[trial % weights.size()],
                                   trial / weights.size())
                 .steps;
    ++trial;
  }
  state.counters["trials/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["steps"] = steps / static_cast<double>(state.iterations());
}
// Trials differ by their seeds: always the same 30 of an amplitude. All: the cage stage's amplitudes.
#define WRENCHES(name, trials, ...)                                       \
  BENCHMARK_CAPTURE(wrench_trial, name, std::vector<double>{__VA_ARGS__}) \
      ->Iterations(trials)                                                \
      ->Unit(benchmark::kMillisecond)
WRENCHES(weights_half, 30, 0.5);
WRENCHES(weights_1, 30, 1);
WRENCHES(weights_2, 30, 2);
WRENCHES(weights_5, 30, 5);
WRENCHES(all, 120, 0.5, 1, 2, 5);
#undef WRENCHES

void push_trial(benchmark::State& state) {
  const Scene& s = scene();
  const physics::Protocol& protocol = physics::find_protocol("geocage-force");
  const auto posture = physics::posture_at(s.hand, s.field, s.X_OH, s.q);
  std::size_t i = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        physics::push_trial(protocol, s.body, s.hand, posture, physics::six_directions()[i++ % 6], 0));
  state.counters["trials/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(push_trial)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace geocage::bench
