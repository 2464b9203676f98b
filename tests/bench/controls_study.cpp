// Do the controls answer as they must, over many objects and seeds? Grasps made on noisy copies of every mesh
// of a folder, tested on the true mesh with the hand 1 m away and with open fingers, in both tests, and with
// random fingers; and the cages that are known, once:
//   controls_study FOLDER [--noise M] [--seeds N] [--grasps N] [--hand NAME] [--only a,b] [--wrenches N]
// --wrenches: seeds of the random wrenches of 0.5, 1, 2 and 5 weights; a tenth as many random fingers a
// grasp.
#include <algorithm>
#include <cstdio>
#include <string>

#include "physics/cage_trial.h"
#include "physics/controls.h"
#include "physics/force_trial.h"
#include "physics/locked_hand.h"

#include "tests/bench/study_grasps.h"

namespace geocage::bench {
namespace {

using physics::Control;
using physics::Outcome;
using physics::Posture;
using Rule = Control::Rule;

struct Controls {
  std::vector<Control> list = {{"locked hand 1 m away, pulls", Rule::no_trial_holds},
                               {"locked hand 1 m away, wrenches", Rule::no_trial_holds},
                               {"locked open hand, pulls", Rule::no_grasp_passes},
                               {"locked open hand, wrenches", Rule::no_trial_holds},
                               {"closing hand 1 m away, pushes", Rule::no_trial_holds},
                               {"closing open hand, pushes", Rule::no_grasp_passes},
                               {"random fingers, pushes", Rule::reported}};

  void count(std::size_t which, const std::vector<Outcome>& outcomes) {
    Control& control = list[which];
    const auto held = std::ranges::count(outcomes, Outcome::held);
    ++control.grasps, control.trials += static_cast<int>(outcomes.size());
    control.held += static_cast<int>(held);
    control.passed += held == static_cast<long>(outcomes.size());
  }
};

struct Scene {
  const physics::ObjectBody& body;
  double radius_m;
  const hands::Hand& hand;

  void locked(const Posture& posture, int seeds, Controls& controls, std::size_t pulls) const {
    const auto locked = physics::lock({}, body, radius_m, hand, posture.X_OH, posture.q);
    std::vector<Outcome> outcomes;
    for (const auto& way : physics::six_directions())
      outcomes.push_back(physics::pull_trial(locked.protocol, body, locked.escape, way.axis_O, 0).outcome);
    controls.count(pulls, outcomes);
    outcomes.clear();
    for (const double amplitude : {0.5, 1.0, 2.0, 5.0})
      for (int seed = 0; seed < seeds; ++seed)
        outcomes.push_back(physics::wrench_trial(locked.protocol, body, locked.escape, amplitude,
                                                 static_cast<std::uint64_t>(seed))
                               .outcome);
    controls.count(pulls + 1, outcomes);
  }

  void closing(const Posture& posture, Controls& controls, std::size_t which) const {
    std::vector<Outcome> outcomes;
    for (const auto& way : physics::six_directions())
      outcomes.push_back(
          physics::push_trial(physics::find_protocol("geocage-force"), body, hand, posture, way, 0).outcome);
    controls.count(which, outcomes);
  }
};

void print(const char* what, const std::vector<Control>& list) {
  for (const Control& control : list)
    std::printf("| %s | %s | %d | %d | %d | %d | %s | %s |\n", what, control.name.c_str(), control.grasps,
                control.trials, control.held, control.passed, physics::rule_text(control.rule).c_str(),
                control.ok() ? "yes" : "NO");
  std::fflush(stdout);
}

}  // namespace
}  // namespace geocage::bench

int main(int argc, char** argv) {
  using namespace geocage::bench;
  namespace physics = geocage::physics;
  StudyOptions options;
  options.seeds = 1, options.grasps = 2;
  int seeds = 100;
  if (argc < 2 || argc % 2 != 0) return std::fprintf(stderr, "controls_study FOLDER [options]\n"), 2;
  options.folder = argv[1];
  for (int i = 2; i + 1 < argc; i += 2)
    if (std::string(argv[i]) == "--wrenches")
      seeds = std::stoi(argv[i + 1]);
    else if (!read_study_option(options, argv[i], argv[i + 1]))
      return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
  const auto hand = geocage::hands::load_hand(options.hand);
  std::printf("| object | control | postures | trials | held | postures that passed | rule | ok |\n");
  std::printf("|---|---|---|---|---|---|---|---|\n");
  print("none", physics::known_cages({}, seeds));
  Controls all;
  for (const StudyObject& object : study_grasps(options, hand)) {
    Controls own;
    const auto body = physics::solid_body(object.mesh, object.field, 0.1);
    const Scene scene{body, physics::radius_about_m(object.mesh, body.X_OB.translation()), hand};
    const auto postures = physics::postures_of(object.grasps, hand, object.field);
    for (std::size_t g = 0; g < postures.size(); ++g) {
      const Posture far = physics::far_posture(hand, postures[g]),
                    open = physics::open_posture(hand, object.field, object.grasps.grasps[g]);
      scene.locked(far, seeds, own, 0);
      scene.locked(open, seeds, own, 2);
      scene.closing(far, own, 4);
      scene.closing(open, own, 5);
      for (int seed = 0; seed < seeds; seed += 10)
        scene.closing(
            physics::random_posture(hand, object.field, postures[g], 0, static_cast<std::uint64_t>(seed)),
            own, 6);
    }
    print(object.name.c_str(), own.list);
    for (std::size_t i = 0; i < all.list.size(); ++i) {
      all.list[i].grasps += own.list[i].grasps, all.list[i].trials += own.list[i].trials;
      all.list[i].held += own.list[i].held, all.list[i].passed += own.list[i].passed;
    }
  }
  print("all", all.list);
  return 0;
}
