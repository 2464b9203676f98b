// The proof that a hand's way is free, against looking at 16 postures a step without any guarantee, and
// RRT-Connect to the open hand. A ball of 35 mm, the SDH, 50 steps.

#include <benchmark/benchmark.h>

#include "datasets/shapes.h"
#include "hands/closing.h"
#include "motion/certificate.h"
#include "motion/rrt_connect.h"

namespace {

using namespace geocage;
using Eigen::VectorXd;
using motion::Vec3;

constexpr int steps = 50;

struct Scene {
  hands::Hand hand = hands::load_hand("schunk_sdh");
  geometry::SignedDistanceField field =
      geometry::build_distance_field(datasets::icosphere(0.035, 4), {64, 0.04, 3});
  motion::Mover floating =
      motion::Mover::floating(hand, motion::Pose(Eigen::Translation3d(0, 0, -0.06 - hand.palm_H.z())));
  std::vector<VectorXd> path;

  Scene() {
    motion::Pose far = motion::Pose(Eigen::Translation3d(0.1, 0, -0.36 - hand.palm_H.z()));
    const VectorXd start = floating.state(far, hand.open_rad);
    VectorXd goal = start;
    goal.head<6>().setZero();
    for (int t = 0; t <= steps; ++t) path.push_back(start + double(t) / steps * (goal - start));
  }
};

Scene& scene() {
  static Scene only;
  return only;
}

void proof(benchmark::State& state) {
  Scene& s = scene();
  motion::Prover prover(s.floating, {{{&s.field}}, {}});
  const std::vector<double> tolerance(s.hand.tree.links.size(), 5e-4);
  motion::Certificate answer;
  for (auto _ : state) answer = prover.certify(s.path, tolerance);
  state.counters["free"] = answer.outcome == motion::Proof::free;
  state.counters["postures"] = answer.postures;
}
BENCHMARK(proof)->Unit(benchmark::kMicrosecond);

void sampled(benchmark::State& state) {
  Scene& s = scene();
  motion::Prover prover(s.floating, {{{&s.field}}, {}});
  bool free = true;
  for (auto _ : state)
    for (int k = 0; k <= 16 * steps; ++k) {
      const auto t = static_cast<std::size_t>(std::min(k / 16, steps - 1));
      const double part = double(k) / 16 - double(t);
      free &= prover.posture_free(s.path[t] + part * (s.path[t + 1] - s.path[t]), -5e-4);
    }
  state.counters["free"] = free;
}
BENCHMARK(sampled)->Unit(benchmark::kMicrosecond);

void rrt_connect_to_the_open_hand(benchmark::State& state) {
  Scene& s = scene();
  motion::Prover prover(s.floating, {{{&s.field}}, {}});
  VectorXd lower(s.floating.dim()), upper(s.floating.dim());
  lower << Vec3::Constant(-5), Vec3::Constant(-M_PI), s.hand.tree.lower_rad;
  upper << Vec3::Constant(5), Vec3::Constant(M_PI), s.hand.tree.upper_rad;
  const auto free = [&](const VectorXd& x) { return prover.posture_free(x, 0.001); };
  int found = 0, seed = 0;
  for (auto _ : state)
    found += motion::rrt_connect(s.path.front(), s.path.back(), lower, upper, free,
                                 {.seed = static_cast<std::uint64_t>(++seed)})
                 .outcome == motion::ConnectOutcome::found;
  state.counters["found"] = double(found) / seed;
}
BENCHMARK(rrt_connect_to_the_open_hand)->Unit(benchmark::kMicrosecond);

}  // namespace
