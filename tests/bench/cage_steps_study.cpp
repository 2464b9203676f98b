// Does the cage test hang on its time step? Grasps made on noisy copies of every mesh of a folder, tested on
// the true mesh:
//   cage_steps_study FOLDER [--noise M] [--seeds N] [--grasps N] [--wrenches N] [--hand NAME] [--only a,b]
//                    [--trials FILE.csv]
// Each trial runs as it is, at half the step, with twice the iterations, and a pull or ring trial without its
// early end at rest. A table of agreements
// by kind of trial, and every disagreement by name. A trial is in the margin band when its outcome is not the
// same in four repeats whose hand is displaced by 0.05 mm and 0.05 degrees, ways by chance: as much as the
// field itself is off. Nothing of the half step or the iterations enters. --wrenches: seeds of each of the
// cage stage's amplitudes.
// --trials: every trial's outcomes, to compare with those of another build.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <numbers>

#include "physics/cage_trial.h"
#include "physics/force_trial.h"
#include "physics/locked_hand.h"
#include <fmt/format.h>

#include "geometry/noise.h"
#include "tests/bench/study_grasps.h"

namespace geocage::bench {
namespace {

using physics::CageProtocol;
using physics::CageTrial;
using physics::Outcome;

using Locked = std::shared_ptr<const physics::LockedHand>;

constexpr int repeats = 4;

struct Job {
  std::string kind, name;
  std::function<CageTrial(const CageProtocol&, const physics::LockedHand&)> run;
  Locked hand;
  std::array<Locked, repeats> displaced;
  CageTrial base = {}, half = {}, twice = {}, restless = {};
  bool in_band = false;
  double base_s = 0;  ///< processor time
};

geometry::Pose displaced(geometry::Pose X, std::uint64_t seed) {
  constexpr double way_m = 5e-5, turn_rad = 0.05 * std::numbers::pi / 180;
  geometry::RandomStream random(seed, 0);
  const geometry::Vec3 way = way_m * random.direction();
  X.linear() = Eigen::AngleAxisd(turn_rad, random.direction()).toRotationMatrix() * X.linear();
  X.translation() += way;
  return X;
}

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
    const auto locked_at = [&](const geometry::Pose& X_OH) -> Locked {
      return std::make_shared<physics::LockedHand>(physics::lock({}, body, radius_m, hand, X_OH, q));
    };
    const Locked locked = locked_at(grasp.X_OH);
    std::array<Locked, repeats> others;
    for (int i = 0; i < repeats; ++i)
      others[i] = locked_at(displaced(grasp.X_OH, repeats * g + static_cast<std::uint64_t>(i)));
    const auto add = [&](const char* kind, const std::string& trial, decltype(Job::run) run) {
      jobs.push_back(
          {kind, object.name + " grasp " + std::to_string(g) + " " + trial, std::move(run), locked, others});
    };
    for (const auto& way : physics::six_directions())
      add("pull", way.name, [&body, &way](const CageProtocol& protocol, const physics::LockedHand& one) {
        return physics::pull_trial(protocol, body, one.escape, way.axis_O, 0);
      });
    for (int i = 0; i < 4; ++i)
      add("ring", std::to_string(90 * i) + " deg",
          [&body, i](const CageProtocol& protocol, const physics::LockedHand& one) {
            return physics::ring_trial(protocol, body, one.escape, one.axis_O, i * std::numbers::pi / 2, 0);
          });
    for (const double amplitude : {0.5, 1.0, 2.0, 5.0})  // the cage stage's
      for (int seed = 0; seed < wrenches; ++seed)
        add("wrench", fmt::format("{} weights, seed {}", amplitude, seed),
            [&body, amplitude, seed](const CageProtocol& protocol, const physics::LockedHand& one) {
              return physics::wrench_trial(protocol, body, one.escape, amplitude,
                                           static_cast<std::uint64_t>(seed));
            });
  }
}

struct Counts {
  int trials = 0, half = 0, twice = 0, restless = 0, errors = 0, lost = 0;
  int outside = 0, half_outside = 0, twice_outside = 0;  ///< of the band
  double seconds = 0, steps = 0, restless_steps = 0, deepest_m = 0;

  void count(const Job& job) {
    const bool at_half = job.half.outcome == job.base.outcome,
               at_twice = job.twice.outcome == job.base.outcome;
    ++trials, half += at_half, twice += at_twice;
    restless += job.restless.outcome == job.base.outcome;
    outside += !job.in_band, half_outside += at_half && !job.in_band,
        twice_outside += at_twice && !job.in_band;
    restless_steps += job.restless.steps;
    errors += job.base.outcome == Outcome::error;
    lost += job.base.outcome == Outcome::lost;
    seconds += job.base_s, steps += job.base.steps;
    deepest_m = std::max(deepest_m, job.base.penetration_m);
  }
};

std::string share(int some, int all) {
  return fmt::format("{} of {} = {:.1f} %", some, all, all > 0 ? 100.0 * some / all : 100);
}

void print(const std::vector<Job>& jobs) {
  std::map<std::string, Counts> kinds;
  for (const Job& job : jobs) {
    for (const char* kind : {job.kind.c_str(), "~ all"}) kinds[kind].count(job);
    for (const auto& [label, other] : {std::pair{"half step", &job.half},
                                       {"twice the iterations", &job.twice},
                                       {"without an end at rest", &job.restless}})
      if (other->outcome != job.base.outcome)
        fmt::print("- {}{}: {} at {:.2f} s ({:.1f} mm deep), {}: {} at {:.2f} s ({:.1f} mm deep)\n", job.name,
                   job.in_band ? " (in the band)" : "", name(job.base.outcome), job.base.ended_s,
                   1e3 * job.base.penetration_m, label, name(other->outcome), other->ended_s,
                   1e3 * other->penetration_m);
  }
  fmt::print(
      "\n| trials | half the step | outside the band | twice the iterations | outside the band | without an "
      "end at rest | its steps | lost | error | deepest mm | us/step | trials/s |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [kind, c] : kinds)
    fmt::print("| {}: {} | {} | {} | {} | {} | {} | x {:.2f} | {} | {} | {:.2f} | {:.1f} | {:.1f} |\n", kind,
               c.trials, share(c.half, c.trials), share(c.half_outside, c.outside), share(c.twice, c.trials),
               share(c.twice_outside, c.outside), c.restless, c.restless_steps / c.steps, c.lost, c.errors,
               1e3 * c.deepest_m, 1e6 * c.seconds / c.steps, c.trials / c.seconds);
}

void write(const std::vector<Job>& jobs, const std::string& file) {
  std::ofstream out(file);
  out << "trial,outcome,ended_s,deepest_mm,steps,half_step,twice_iterations,in_band\n";
  for (const Job& job : jobs)
    out << '"' << job.name << "\"," << name(job.base.outcome) << ',' << job.base.ended_s << ','
        << 1e3 * job.base.penetration_m << ',' << job.base.steps << ',' << name(job.half.outcome) << ','
        << name(job.twice.outcome) << ',' << job.in_band << '\n';
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
    const CageProtocol& own = job.hand->protocol;
    CageProtocol twice = own, restless = own;
    twice.engine.iterations *= 2;
    restless.rest_s = own.pull_s + 1;
    const double start = processor_s();
    job.base = job.run(own, *job.hand);
    job.base_s = processor_s() - start;
    job.half = job.run(geocage::physics::at_half_step(own), *job.hand);
    job.twice = job.run(twice, *job.hand);
    job.restless = job.kind == "wrench" ? job.base : job.run(restless, *job.hand);
    job.in_band = std::ranges::any_of(job.displaced, [&](const Locked& other) {
      return job.run(other->protocol, *other).outcome != job.base.outcome;
    });
  }
  print(jobs);
  if (!trials.empty()) write(jobs, trials);
  return 0;
}
