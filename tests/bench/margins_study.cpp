// How much harder may a load get? Grasps made on noisy copies of every mesh of a folder, tested on the true
// mesh:
//   margins_study FOLDER [--noise M] [--seeds N] [--grasps N] [--draws N] [--halvings N] [--check N]
//                 [--hand NAME] [--only a,b]
// A row a grasp: draws held under the whole pose noise, the margins in the force test, how far each finger
// may open in the cage test, processor time. --check: of the first N grasps of each object, the draws that
// hold at six levels of friction, push and noise, from easy to hard; bisection takes for granted that they
// never grow.
#include <cstdio>
#include <ctime>

#include "physics/escape_test.h"
#include "physics/force_trial.h"
#include "physics/margins.h"
#include "physics/posture.h"
#include <fmt/format.h>

#include "tests/bench/study_grasps.h"

namespace geocage::bench {
namespace {

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::string text(const physics::Margin& margin) {
  if (!margin.level) return fmt::format("fails at {:g}", margin.easy);
  return fmt::format("{}{:.3g}", *margin.level == margin.hard ? "all to " : "", *margin.level);
}

struct Case {
  const physics::ObjectBody& body;
  const hands::Hand& hand;
  geometry::Pose X_OH;
  Eigen::VectorXd q_open;
};

/// "20 20 19 ..., " and whether a harder level holds more draws than an easier one.
bool check(const Case& one, const physics::MarginRule& rule) {
  constexpr int levels = 6;
  bool falls = true;
  for (const char* load : {"friction", "push", "noise"}) {
    std::string counts;
    int before = rule.draws;
    for (int i = 0; i < levels; ++i) {
      const double share = static_cast<double>(i) / (levels - 1);
      physics::Protocol protocol = physics::find_protocol("geocage-force");
      double noise = rule.small_share;
      if (load == std::string("friction")) protocol.engine.friction = 1 - share;
      if (load == std::string("push")) protocol.acceleration_m_s2 = 100 * share;
      if (load == std::string("noise")) noise = 2 * share;
      const int held =
          physics::draws_held(protocol, one.body, one.hand, one.X_OH, one.q_open, rule, noise, 0, rule.draws);
      counts += fmt::format(" {}", held);
      falls &= held <= before;
      before = held;
    }
    std::printf("  %s:%s\n", load, counts.c_str());
  }
  return falls;
}

}  // namespace
}  // namespace geocage::bench

int main(int argc, char** argv) {
  using namespace geocage;
  using namespace geocage::bench;
  StudyOptions options;
  physics::MarginRule rule;
  int checks = 0;
  if (argc < 2 || argc % 2 != 0) return std::fprintf(stderr, "margins_study FOLDER [options]\n"), 2;
  options.folder = argv[1];
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string key = argv[i];
    if (key == "--draws")
      rule.draws = std::stoi(argv[i + 1]);
    else if (key == "--halvings")
      rule.halvings = std::stoi(argv[i + 1]);
    else if (key == "--check")
      checks = std::stoi(argv[i + 1]);
    else if (!read_study_option(options, key, argv[i + 1]))
      return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
  }
  const auto hand = hands::load_hand(options.hand);
  const physics::Protocol& protocol = physics::find_protocol("geocage-force");
  int checked = 0, falling = 0;
  std::printf("| grasp | held of %d | friction | push, m/s^2 | noise | fingers may open | s |\n", rule.draws);
  std::printf("|---|---|---|---|---|---|---|\n");
  for (const StudyObject& object : study_grasps(options, hand)) {
    const auto body = physics::solid_body(object.mesh, object.field, protocol.mass_kg);
    const double radius_m = physics::radius_about_m(object.mesh, body.X_OB.translation());
    for (std::size_t g = 0; g < object.grasps.grasps.size(); ++g) {
      const auto& grasp = object.grasps.grasps[g];
      const auto q = hands::joint_vector(hand.tree, grasp.joints_rad, object.name);
      const Case one{body, hand, grasp.X_OH, physics::open_posture(hand, object.field, grasp).q};
      const double start = processor_s();
      const auto margins = physics::force_margins(protocol, body, hand, one.X_OH, one.q_open, rule, 0);
      const auto loose =
          physics::loosening({}, body, radius_m, hand, one.X_OH, q, one.q_open, rule.halvings, 0);
      std::string fingers = loose.empty() ? "nothing held" : "";
      for (const auto& finger : loose) fingers += (fingers.empty() ? "" : ", ") + text(finger.share);
      std::printf("| %s %zu | %d | %s | %s | %s | %s | %.0f |\n", object.name.c_str(), g, margins.held,
                  text(margins.friction).c_str(), text(margins.push_m_s2).c_str(),
                  text(margins.noise).c_str(), fingers.c_str(), processor_s() - start);
      if (static_cast<int>(g) < checks) ++checked, falling += check(one, rule);
      std::fflush(stdout);
    }
  }
  if (checked > 0)
    std::printf("\n%d of %d grasps checked never hold more draws at a harder level\n", falling, checked);
  return 0;
}
