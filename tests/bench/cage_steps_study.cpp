// Does the cage test hang on its time step? Grasps made on noisy copies of every mesh of a folder, tested on
// the true mesh:
//   cage_steps_study FOLDER [--noise M] [--seeds N] [--grasps N] [--wrenches N] [--hand NAME] [--only a,b]
//                    [--trials FILE.csv]
// Each trial runs as it is, at half the step, with twice the iterations, and a pull or ring trial without its
// early end at rest. A table of agreements
// by kind of trial, and every disagreement by name. --wrenches: seeds of each of the cage stage's amplitudes.
// --trials: every trial's outcomes, to compare with those of another build.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>

#include "physics/cage_trial.h"
#include "physics/force_trial.h"
#include "physics/locked_hand.h"

#include "tests/bench/study_grasps.h"

namespace geocage::bench {
namespace {

using physics::CageProtocol;
using physics::CageTrial;
using physics::Outcome;

struct Job {
  std::string kind, name;
  std::function<CageTrial(const CageProtocol&)> run;
  CageProtocol protocol;
  CageTrial base, half, twice, restless;
  double base_s = 0;  ///< processor time
};

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void list_jobs(std::vector<Job>& jobs, const StudyObject& object, const physics::ObjectBody& body,
               const hands::Hand& hand, int wrenches) {
  const double radius_m = physics::radius_about_m(object.mesh, body.X_OB.translation());
  for (std::size_t g = 0; g < object.grasps.grasps.size(); ++g) {
    const auto& grasp = object.grasps.grasps[g];
    const auto q = hands::joint_vector(hand.tree, grasp.joints_rad, object.name);
    const auto locked =
        std::make_shared<physics::LockedHand>(physics::lock({}, body, radius_m, hand, grasp.X_OH, q));
    const auto add = [&](const char* kind, const std::string& trial,
                         std::function<CageTrial(const CageProtocol&)> run) {
      jobs.push_back({kind,
                      object.name + " grasp " + std::to_string(g) + " " + trial,
                      std::move(run),
                      locked->protocol,
                      {},
                      {},
                      {},
                      {}});
    };
    for (const auto& way : physics::six_directions())
      add("pull", way.name, [&body, locked, &way](const CageProtocol& protocol) {
        return physics::pull_trial(protocol, body, locked->escape, way.axis_O, 0);
      });
    for (int i = 0; i < 4; ++i)
      add("ring", std::to_string(90 * i) + " deg", [&body, locked, i](const CageProtocol& protocol) {
        return physics::ring_trial(protocol, body, locked->escape, locked->axis_O, i * std::numbers::pi / 2,
                                   0);
      });
    for (const double amplitude : {0.5, 1.0, 2.0, 5.0})  // the cage stage's
      for (int seed = 0; seed < wrenches; ++seed)
        add("wrench", std::to_string(amplitude) + " weights, seed " + std::to_string(seed),
            [&body, locked, amplitude, seed](const CageProtocol& protocol) {
              return physics::wrench_trial(protocol, body, locked->escape, amplitude,
                                           static_cast<std::uint64_t>(seed));
            });
  }
}

struct Counts {
  int trials = 0, half = 0, twice = 0, restless = 0, errors = 0, lost = 0;
  double seconds = 0, steps = 0, restless_steps = 0, deepest_m = 0;
};

void print(const std::vector<Job>& jobs) {
  std::map<std::string, Counts> kinds;
  for (const Job& job : jobs) {
    Counts& counts = kinds[job.kind];
    ++counts.trials;
    counts.half += job.half.outcome == job.base.outcome;
    counts.twice += job.twice.outcome == job.base.outcome;
    counts.restless += job.restless.outcome == job.base.outcome;
    counts.restless_steps += job.restless.steps;
    counts.errors += job.base.outcome == Outcome::error;
    counts.lost += job.base.outcome == Outcome::lost;
    counts.seconds += job.base_s, counts.steps += job.base.steps;
    counts.deepest_m = std::max(counts.deepest_m, job.base.penetration_m);
    for (const auto& [label, other] : {std::pair{"half step", &job.half},
                                       {"twice the iterations", &job.twice},
                                       {"without an end at rest", &job.restless}})
      if (other->outcome != job.base.outcome)
        std::printf("- %s: %s at %.2f s (%.1f mm deep), %s: %s at %.2f s (%.1f mm deep)\n", job.name.c_str(),
                    std::string(name(job.base.outcome)).c_str(), job.base.ended_s,
                    1e3 * job.base.penetration_m, label, std::string(name(other->outcome)).c_str(),
                    other->ended_s, 1e3 * other->penetration_m);
  }
  std::printf(
      "\n| trials | agree at half the step | with twice the iterations | without an end at rest | its steps "
      "| lost | error | deepest mm | "
      "us/step | trials/s |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [kind, c] : kinds)
    std::printf("| %s: %d | %d = %.1f %% | %d = %.1f %% | %d | x %.2f | %d | %d | %.2f | %.1f | %.1f |\n",
                kind.c_str(), c.trials, c.half, 100.0 * c.half / c.trials, c.twice,
                100.0 * c.twice / c.trials, c.restless, c.restless_steps / c.steps, c.lost, c.errors,
                1e3 * c.deepest_m, 1e6 * c.seconds / c.steps, c.trials / c.seconds);
}

void write(const std::vector<Job>& jobs, const std::string& file) {
  std::ofstream out(file);
  out << "trial,outcome,ended_s,deepest_mm,steps,half_step,twice_iterations\n";
  for (const Job& job : jobs)
    out << '"' << job.name << "\"," << name(job.base.outcome) << ',' << job.base.ended_s << ','
        << 1e3 * job.base.penetration_m << ',' << job.base.steps << ',' << name(job.half.outcome) << ','
        << name(job.twice.outcome) << '\n';
}

}  // namespace
}  // namespace geocage::bench

int main(int argc, char** argv) {
  using namespace geocage::bench;
  StudyOptions options;
  int wrenches = 2;
  std::string trials;
  if (argc < 2 || argc % 2 != 0) return std::fprintf(stderr, "cage_steps_study FOLDER [options]\n"), 2;
  options.folder = argv[1];
  for (int i = 2; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--wrenches")
      wrenches = std::stoi(argv[i + 1]);
    else if (std::string(argv[i]) == "--trials")
      trials = argv[i + 1];
    else if (!read_study_option(options, argv[i], argv[i + 1]))
      return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
  }
  const auto hand = geocage::hands::load_hand(options.hand);
  const auto objects = study_grasps(options, hand);
  std::vector<geocage::physics::ObjectBody> bodies;
  for (const StudyObject& object : objects)
    bodies.push_back(geocage::physics::solid_body(object.mesh, object.field, CageProtocol{}.mass_kg));
  std::vector<Job> jobs;
  for (std::size_t i = 0; i < objects.size(); ++i) list_jobs(jobs, objects[i], bodies[i], hand, wrenches);
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    Job& job = jobs[i];
    const CageProtocol half = geocage::physics::at_half_step(job.protocol);
    CageProtocol twice = job.protocol;
    twice.engine.iterations *= 2;
    const double start = processor_s();
    job.base = job.run(job.protocol);
    job.base_s = processor_s() - start;
    job.half = job.run(half);
    job.twice = job.run(twice);
    CageProtocol restless = job.protocol;
    restless.rest_s = job.protocol.pull_s + 1;
    job.restless = job.kind == "wrench" ? job.base : job.run(restless);
  }
  print(jobs);
  if (!trials.empty()) write(jobs, trials);
  return 0;
}
