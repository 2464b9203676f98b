// Does the force test hang on its step, its iterations, or its short cuts? Grasps made on noisy copies of
// every mesh of a folder, tested on the true mesh:
//   force_steps_study FOLDER [--noise M] [--seeds N] [--grasps N] [--hand NAME] [--only a,b]
// Each push runs as it is; at half the step; with twice the iterations; without the early end at rest; and
// from one settled state that all six pushes of a grasp share (rebuilt with a cold contact cache). Agreement
// of outcomes, also of the pushes outside the margin band (drift 8-12 mm, displacement 40-60 mm, turns 12-18
// deg), and processor time.
#include <array>
#include <cstdio>
#include <ctime>
#include <string>

#include "physics/force_trial.h"
#include "physics/phase.h"

#include "tests/bench/study_grasps.h"

namespace geocage::bench {
namespace {

using geometry::Pose;
using physics::Outcome;
using physics::Protocol;
using physics::PushTrial;

enum Variant { as_is, half_step, twice_iterations, no_rest, shared_settle, variants };
constexpr std::array<const char*, variants> labels = {"as it is", "half the step", "twice the iterations",
                                                      "no early end at rest", "shared settling"};

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Grasp {
  std::string name;
  std::array<std::array<PushTrial, 6>, variants> trials;
  std::array<double, variants> seconds{};
};

bool in(double value, double low, double high) {
  return value > low && value < high;
}

bool near_a_limit(const PushTrial& trial) {
  constexpr double deg = 3.14159265358979 / 180;
  return in(trial.drift_m, 0.008, 0.012) || in(trial.drift_rad, 12 * deg, 18 * deg) ||
         (trial.outcome == Outcome::held &&
          (trial.displacement_m > 0.04 || in(trial.rotation_rad, 12 * deg, 18 * deg)));
}

/// Settles once, then a fresh world a push at the settled posture and pose.
std::array<PushTrial, 6> share_settling(const Protocol& protocol, const physics::ObjectBody& object,
                                        const hands::Hand& hand, const physics::Posture& posture) {
  std::array<PushTrial, 6> trials;
  const auto target = physics::squeezed(hand, posture.q, protocol.grip);
  const double deepest = posture.penetration_m + protocol.max_penetration_growth_m;
  physics::World settling(protocol.engine, object, hand, posture.X_OH, posture.q, 0);
  settling.hold(target, protocol.grip);
  physics::Camera none;
  const physics::Phase settle = physics::simulate(
      settling, protocol, [](double) { return physics::ObjectLoad{}; }, protocol.settle_s,
      {protocol.max_drift_m, protocol.max_drift_rad, deepest}, none, "settle");
  const Pose X_WO = settling.X_WB() * object.X_OB.inverse();
  const Eigen::VectorXd q =
      settling.hand().joints().cwiseMin(hand.tree.upper_rad).cwiseMax(hand.tree.lower_rad);
  for (std::size_t d = 0; d < 6; ++d) {
    PushTrial& trial = trials[d];
    trial.drift_m = settle.translation_m, trial.drift_rad = settle.rotation_rad;
    trial.outcome = physics::outcome_of(settle.end, Outcome::unsettled);
    if (trial.outcome != Outcome::held) continue;
    physics::World world(protocol.engine, object, hand, posture.X_OH, q, 0, X_WO);
    world.hold(target, protocol.grip);
    const physics::ObjectLoad load{object.mass_kg * protocol.acceleration_m_s2 *
                                   physics::six_directions()[d].axis_O};
    const physics::Phase push = physics::simulate(
        world, protocol, [&](double) { return load; }, protocol.push_s,
        {protocol.max_translation_m, protocol.max_rotation_rad, deepest}, none, "push");
    trial.outcome = physics::outcome_of(push.end, Outcome::lost);
    trial.displacement_m = push.translation_m, trial.rotation_rad = push.rotation_rad;
  }
  return trials;
}

void run(Grasp& grasp, const physics::ObjectBody& body, const hands::Hand& hand,
         const physics::Posture& posture) {
  const Protocol& protocol = physics::find_protocol("geocage-force");
  for (int v = 0; v < variants; ++v) {
    Protocol tested = protocol;
    if (v == half_step) tested.engine.dt_s /= 2;
    if (v == twice_iterations) tested.engine.iterations *= 2;
    if (v == no_rest) tested.rest_s = 0;
    const double start = processor_s();
    if (v == shared_settle)
      grasp.trials[v] = share_settling(tested, body, hand, posture);
    else
      for (std::size_t d = 0; d < 6; ++d)
        grasp.trials[v][d] =
            physics::push_trial(tested, body, hand, posture, physics::six_directions()[d], 0);
    grasp.seconds[v] = processor_s() - start;
  }
}

void print(const std::vector<Grasp>& grasps) {
  std::printf(
      "| variant | same outcome | outside the margin band | held | trials/s |\n|---|---|---|---|---|\n");
  for (int v = 0; v < variants; ++v) {
    int all = 0, same = 0, clear = 0, same_clear = 0, held = 0;
    double seconds = 0;
    for (const Grasp& grasp : grasps) {
      seconds += grasp.seconds[v];
      for (std::size_t d = 0; d < 6; ++d) {
        const PushTrial &base = grasp.trials[as_is][d], &other = grasp.trials[v][d];
        const bool agrees = base.outcome == other.outcome, edge = near_a_limit(base) || near_a_limit(other);
        ++all, same += agrees, clear += !edge, same_clear += agrees && !edge;
        held += other.outcome == Outcome::held;
      }
    }
    std::printf("| %s | %d of %d = %.1f %% | %d of %d = %.1f %% | %d | %.1f |\n", labels[v], same, all,
                100.0 * same / all, same_clear, clear, 100.0 * same_clear / clear, held, all / seconds);
  }
  for (const Grasp& grasp : grasps)
    for (int v = 1; v < variants; ++v)
      for (std::size_t d = 0; d < 6; ++d) {
        const PushTrial &base = grasp.trials[as_is][d], &other = grasp.trials[v][d];
        if (base.outcome == other.outcome) continue;
        std::printf("- %s %s: %s (drift %.1f mm, moved %.1f mm), %s: %s (drift %.1f mm, moved %.1f mm)\n",
                    grasp.name.c_str(), physics::six_directions()[d].name.c_str(),
                    std::string(name(base.outcome)).c_str(), 1e3 * base.drift_m, 1e3 * base.displacement_m,
                    labels[v], std::string(name(other.outcome)).c_str(), 1e3 * other.drift_m,
                    1e3 * other.displacement_m);
      }
}

}  // namespace
}  // namespace geocage::bench

int main(int argc, char** argv) {
  using namespace geocage::bench;
  StudyOptions options;
  if (argc < 2 || argc % 2 != 0) return std::fprintf(stderr, "force_steps_study FOLDER [options]\n"), 2;
  options.folder = argv[1];
  for (int i = 2; i + 1 < argc; i += 2)
    if (!read_study_option(options, argv[i], argv[i + 1]))
      return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
  const auto hand = geocage::hands::load_hand(options.hand);
  const auto objects = study_grasps(options, hand);
  std::vector<geocage::physics::ObjectBody> bodies;
  std::vector<std::pair<std::size_t, geocage::physics::Posture>> postures;
  std::vector<Grasp> grasps;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    bodies.push_back(geocage::physics::solid_body(objects[i].mesh, objects[i].field, 0.1));
    for (const auto& posture : geocage::physics::postures_of(objects[i].grasps, hand, objects[i].field)) {
      postures.emplace_back(i, posture);
      grasps.emplace_back().name = objects[i].name + " grasp " + std::to_string(postures.size() - 1);
    }
  }
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < grasps.size(); ++i)
    run(grasps[i], bodies[postures[i].first], hand, postures[i].second);
  print(grasps);
  return 0;
}
