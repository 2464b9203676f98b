// Approaches of placed grasps, by this project's planner and by RRT-Connect with shortcuts to the open and to
// the closed hand, all under the same checker and the same certificate, in one run:
//   motion_study FOLDER OUT.csv [--floating N] [--arm N] [--winding N] [--only a,b] [--seconds S] [--search
//   aico] [--hand NAME] [--rivals 0] [--seed N]
// Grasps of every mesh of the folder come from remesh, balls, score and place. A problem is a grasp and a
// start 0.3 m away in a random direction, turned by up to 0.8 rad, hand open; with the arm the start is what
// the arm reaches of that. One CSV line a problem and planner; tables on stdout. CPU times are of this
// thread. No clock decides anything but when
// --seconds are used up: then the rest of the problems is left out, and the tables say how many there were.
// --rivals 0 leaves the others out, for a profile of the planner; --seed takes other starts.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <random>
#include <sstream>

#include <time.h>

#include "geometry/median.h"
#include "hands/arm.h"
#include "hands/closing.h"
#include "motion/approach.h"
#include "motion/reach.h"
#include "motion/tasks/self_clearance.h"
#include "motion/tasks/winding.h"
#include "motion/tasks/writhe.h"
#include "motion/timing.h"
#include "pipeline/error.h"
#include "reports/statistics.h"
#include "stages/balls/balls.h"
#include "stages/place/place.h"
#include "stages/remesh/remesh.h"
#include "stages/score/score.h"
#include "tests/bench/study_objects.h"
#include "topology/loops.h"

namespace geocage::bench {
namespace {

using Eigen::VectorXd;
using geometry::Pose;
using geometry::Vec3;
using motion::Mover;
using motion::Path;

struct Options {
  std::string folder, csv, hand = "schunk_sdh";
  int floating = 400, arm = 100, winding = 40, seed = 0;
  double seconds = 1e9;
  bool messages = false, rivals = true;
  std::vector<std::string> only;
};

double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

Options read_options(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(
        stderr,
        "motion_study FOLDER OUT.csv [--floating N] [--arm N] [--winding N] [--only a,b] [--seconds S] "
        "[--search gauss_newton|aico] [--hand NAME] [--rivals 0|1] [--seed N]\n");
    std::exit(2);
  }
  Options o;
  o.folder = argv[1];
  o.csv = argv[2];
  for (int i = 3; i + 1 < argc; i += 2) {
    const std::string key = argv[i], value = argv[i + 1];
    if (key == "--floating")
      o.floating = std::stoi(value);
    else if (key == "--arm")
      o.arm = std::stoi(value);
    else if (key == "--winding")
      o.winding = std::stoi(value);
    else if (key == "--only")
      o.only = split(value);
    else if (key == "--seconds")
      o.seconds = std::stod(value);
    else if (key == "--hand")
      o.hand = value;
    else if (key == "--seed")
      o.seed = std::stoi(value);
    else if (key == "--rivals")
      o.rivals = value != "0";
    else if (key == "--search")
      o.messages = value == "aico";
    else
      std::fprintf(stderr, "unknown option %s\n", key.c_str()), std::exit(2);
  }
  return o;
}

/// An object with its field and placed grasps.
struct Object {
  std::string name;
  geometry::SignedDistanceField field;
  std::vector<hands::Grasp> grasps;
  topology::Polyline ring;  ///< along the tube of the first handle, closed; empty without handles
};

Object placed_object(const std::string& name, const geometry::TriangleMesh& mesh, const hands::Hand& hand) {
  pipeline::Run run;
  const auto even = stages::remesh({.edge_length_m = 0.004}, run, mesh);
  const auto balls = stages::balls({.radii_m = {hand.ball_radius_m}}, run, even);
  const auto scores = stages::score({}, run, even, balls);
  Object object{
      name, geometry::build_distance_field(mesh, {.cells = 64, .pad_m = 0.04, .refine = 3}), {}, {}};
  for (const topology::SurfaceLoop& loop : topology::handle_loops(even))
    if (loop.kind == topology::LoopKind::through && object.ring.empty()) {
      const std::size_t stride = std::max<std::size_t>(1, loop.path.size() / 24);
      for (std::size_t i = 0; i < loop.path.size(); i += stride) object.ring.push_back(loop.path[i]);
      object.ring.push_back(loop.path.front());
    }
  stages::PlaceParams params;
  params.min_blocked_share = 0;
  params.max_per_candidate = 2;
  params.max_grasps = 16;
  params.measures = false;
  object.grasps = stages::place(params, run, scores, object.field, {}, {}, hand).grasps;
  return object;
}

double uniform(std::mt19937_64& engine) {
  return static_cast<double>(engine() >> 11) * 0x1p-53;
}
Vec3 direction(std::mt19937_64& engine) {
  for (;;) {
    const Vec3 v(2 * uniform(engine) - 1, 2 * uniform(engine) - 1, 2 * uniform(engine) - 1);
    if (v.norm() < 1 && v.norm() > 1e-3) return v.normalized();
  }
}

/// What one planner made of one problem.
struct Answer {
  bool certified = false;
  double ms = 0, length = 0, effort = 0, clearance_m = 0;
  int sweeps = 0;
  std::string planner;
};

/// One problem, ready to be planned.
struct Problem {
  std::unique_ptr<Mover> mover;
  motion::Obstacles obstacles;
  std::unique_ptr<motion::ApproachPlanner> planner;
  motion::ApproachGoal goal;
  std::size_t grasp = 0;
};

constexpr int even_steps = 70;

void measure(const Path& path, Answer& answer) {
  answer.certified = true;
  answer.length = motion::length_of(path);
  answer.effort = motion::efficiency_of(motion::respaced(path, even_steps), 1.0 / even_steps).effort;
}

Answer ours(Problem& p) {
  const double before = cpu_ms();
  const auto plan = p.planner->plan(p.goal);
  Answer answer;
  answer.ms = cpu_ms() - before;
  answer.planner = plan.planner + " from " + plan.seed + ", " + plan.closing;
  answer.sweeps = plan.sweeps;
  if (plan.outcome != motion::ApproachOutcome::planned) {
    answer.planner = name_of(plan.outcome);
    return answer;
  }
  measure(plan.path, answer);
  answer.clearance_m = plan.proof.clearance_m;
  return answer;
}

/// RRT-Connect to the open hand, then close_hand's closing, both proven.
Answer rrt_open(Problem& p, int seed) {
  const double before = cpu_ms();
  VectorXd lower, upper;
  p.planner->box(p.goal, lower, upper);
  Answer answer;
  for (double room_m : {0.001, -5e-4}) {
    const auto free = [&](const VectorXd& x) { return p.planner->prover().posture_free(x, room_m); };
    auto path = motion::rrt_connect(p.goal.start, p.goal.closing.front(), lower, upper, free,
                                    {.iterations = 3000, .seed = static_cast<std::uint64_t>(seed)})
                    .path;
    if (path.empty()) continue;
    const auto proof = p.planner->prove_free(path);
    if (proof.outcome != motion::Proof::free) continue;
    const Path closing = p.planner->proven_closing(p.goal);
    answer.ms = cpu_ms() - before;
    if (closing.empty()) return answer;
    path.insert(path.end(), closing.begin() + 1, closing.end());
    measure(path, answer);
    answer.clearance_m = proof.clearance_m;
    return answer;
  }
  answer.ms = cpu_ms() - before;
  return answer;
}

/// RRT-Connect to the closed hand; fingers have the leave of closing all the way.
Answer rrt_closed(Problem& p, int seed) {
  const double before = cpu_ms();
  VectorXd lower, upper;
  p.planner->box(p.goal, lower, upper);
  const auto& tolerance = p.planner->closing_tolerance_m();
  const auto free = [&](const VectorXd& x) { return p.planner->prover().posture_free(x, tolerance); };
  // About a second with the arm, where it solves a quarter of the problems in 3000.
  const int most = p.mover->floats() ? 3000 : 20000;
  Answer answer;
  const auto path = motion::rrt_connect(p.goal.start, p.goal.closing.back(), lower, upper, free,
                                        {.iterations = most, .seed = static_cast<std::uint64_t>(seed)})
                        .path;
  if (!path.empty()) {
    const auto proof = p.planner->prove_closing(path);
    answer.clearance_m = proof.clearance_m;
    if (proof.outcome == motion::Proof::free) measure(path, answer);
  }
  answer.ms = cpu_ms() - before;
  return answer;
}

/// The search alone, closed goal: from a polyline by way of the retreat, then detours by a random point;
/// certified as RRT-Connect's closed paths are.
Answer search_alone(Problem& p, int seed) {
  std::mt19937_64 engine(static_cast<std::uint64_t>(seed));
  const double before = cpu_ms();
  Answer answer;
  motion::ApproachPlan report;
  for (int k = 0; k < 7 && !answer.certified; ++k) {
    Path way = {p.goal.start};
    const VectorXd& open = p.goal.closing.front();
    VectorXd retreat = open;
    if (p.mover->floats()) retreat.head<3>() -= 1.2 * p.goal.approach_O;
    if (k > 0) {
      VectorXd knot = (p.goal.start + retreat) / 2;
      const Eigen::Index moved = p.mover->floats() ? 3 : 7;
      for (Eigen::Index i = 0; i < moved; ++i)
        knot[i] += (p.mover->floats() ? 2.5 : 0.7) * (2 * uniform(engine) - 1);
      way.push_back(knot.cwiseMax(p.mover->lower()).cwiseMin(p.mover->upper()));
    }
    if (p.mover->floats()) way.push_back(retreat);
    way.push_back(open);
    way.push_back(p.goal.closing.back());
    for (double precision : {0.5, 5.0}) {
      const Path path = p.planner->improved(way, precision, report);
      const auto proof = p.planner->prove_closing(path);
      if (proof.outcome != motion::Proof::free) continue;
      measure(path, answer);
      answer.clearance_m = proof.clearance_m;
      break;
    }
  }
  answer.ms = cpu_ms() - before;
  answer.sweeps = report.sweeps;
  return answer;
}

struct Study {
  Options options;
  const hands::Hand& hand;
  const hands::ArmedHand& armed;
  std::vector<Object> objects;
  std::FILE* csv;
  double used_until = 0;

  motion::ApproachRule rule() const {
    motion::ApproachRule r;
    r.by_messages = options.messages;
    return r;
  }

  /// Problem i of the floating hand, or of the arm; none where start or goal is not free, or out of reach.
  std::unique_ptr<Problem> problem(const Object& object, bool arm, int i) {
    std::mt19937_64 engine(static_cast<std::uint64_t>(1000 * i + 7 + 1000003 * options.seed));
    auto p = std::make_unique<Problem>();
    p->grasp = static_cast<std::size_t>(i) % object.grasps.size();
    const hands::Grasp& grasp = object.grasps[p->grasp];
    p->obstacles.fields = {{&object.field}};
    const VectorXd open = hands::joint_vector(hand.tree, grasp.pregrasp_joints_rad, "pre-grasp"),
                   closed = hands::joint_vector(hand.tree, grasp.joints_rad, "grasp");
    Pose X_OS = grasp.X_OH;
    X_OS.translation() += 0.3 * direction(engine);
    X_OS.linear() = motion::exponential(0.8 * uniform(engine) * direction(engine)) * X_OS.linear();
    VectorXd at_grasp, at_start, q_rest = armed.body.open_rad;
    q_rest.tail(open.size()) = open;
    if (arm) {
      for (int k = 0; k < 8 && at_start.size() == 0; ++k) {
        const double angle = 2 * M_PI * (k + uniform(engine)) / 8;
        Pose X_OB = Pose::Identity();
        const Vec3 away(std::cos(angle), std::sin(angle), 0);
        X_OB.linear() << -away, Vec3::UnitZ().cross(-away), Vec3::UnitZ();
        X_OB.translation() = 0.55 * away - Vec3(0, 0, 0.15);
        p->mover = std::make_unique<Mover>(Mover::standing(armed.body, X_OB));
        motion::Prover prover(*p->mover, p->obstacles, motion::self_pairs(armed.body, q_rest));
        const auto there =
            motion::reach(*p->mover, armed, prover, p->obstacles, grasp.X_OH, open, {.tries = 4});
        if (there.outcome != motion::Reach::reached) continue;
        const auto begin =
            motion::reach(*p->mover, armed, prover, p->obstacles, X_OS, open, {.tries = 4}, &there.x);
        if (begin.outcome != motion::Reach::reached) continue;
        at_grasp = there.x.head(armed.arm_dofs);
        at_start = begin.x;
      }
      if (at_start.size() == 0) return nullptr;
    } else {
      p->mover = std::make_unique<Mover>(Mover::floating(hand, grasp.X_OH));
      at_start = p->mover->state(X_OS, open);
    }
    const auto state = [&](const VectorXd& q) {
      if (!arm) return p->mover->state(grasp.X_OH, q);
      VectorXd x(p->mover->dim());
      x << at_grasp, q;
      return x;
    };
    std::vector<VectorXd> postures;
    hands::close_hand(hand, object.field, grasp.X_OH, open, {}, &postures);
    postures.push_back(closed);
    for (const VectorXd& q : postures)
      if (const VectorXd x = state(q); p->goal.closing.empty() || (x - p->goal.closing.back()).norm() > 0)
        p->goal.closing.push_back(x);
    p->goal.start = at_start;
    p->goal.approach_O = grasp.X_OH.linear() * hand.approach_H;
    VectorXd q_open = arm ? armed.body.open_rad : open;
    q_open.tail(open.size()) = open;
    p->planner = std::make_unique<motion::ApproachPlanner>(
        *p->mover, p->obstacles, motion::self_pairs(p->mover->hand(), q_open), rule());
    if (!p->planner->prover().posture_free(at_start, 0.001)) return nullptr;
    return p;
  }

  void line(const char* body, const Object& object, int i, const char* who, const Answer& a,
            double straight) const {
    std::fprintf(csv, "%s,%s,%d,\"%s\",%d,%.4f,%.5f,%.5f,%.5f,%.6f,%d,\"%s\"\n", body, object.name.c_str(), i,
                 who, a.certified, a.ms, a.length, straight, a.effort, a.clearance_m, a.sweeps,
                 a.planner.c_str());
  }

  void run(bool arm) {
    const char* body = arm ? "arm" : "floating";
    const int wanted = arm ? options.arm : options.floating;
    const char* names[] = {"ours", "RRT-Connect, open goal, then closing", "RRT-Connect, closed goal",
                           "search alone, closed goal"};
    std::vector<Answer> answers[4];
    const double started = static_cast<double>(std::time(nullptr));
    int left_out = 0, unable = 0;
    for (int i = 0, made = 0; made < wanted && i < 4 * wanted; ++i) {
      const Object& object = objects[static_cast<std::size_t>(i) % objects.size()];
      if (object.grasps.empty()) continue;
      if (static_cast<double>(std::time(nullptr)) - started > options.seconds) {
        left_out = wanted - made;
        break;
      }
      const auto p = problem(object, arm, i / static_cast<int>(objects.size()));
      if (!p) {
        ++unable;
        continue;
      }
      ++made;
      std::vector<Answer> all = {ours(*p)};
      if (options.rivals) all.insert(all.end(), {rrt_open(*p, i), rrt_closed(*p, i), search_alone(*p, i)});
      for (std::size_t k = 0; k < all.size(); ++k) {
        answers[k].push_back(all[k]);
        line(body, object, i, names[k], all[k], (p->goal.closing.back() - p->goal.start).norm());
      }
    }
    table(body, names, answers, left_out, unable);
  }

  static double quantile(std::vector<double> v, double share) {
    if (v.empty()) return std::nan("");
    std::sort(v.begin(), v.end());
    return v[std::min(v.size() - 1, static_cast<std::size_t>(share * static_cast<double>(v.size())))];
  }

  static void table(const char* body, const char* const* names, const std::vector<Answer>* answers,
                    int left_out, int unable) {
    std::printf("\n%s: %zu problems (%d starts not free or out of reach, %d left out for time)\n", body,
                answers[0].size(), unable, left_out);
    std::printf(
        "| planner | certified | 95 %% | of what any solves | CPU ms median | p98 | sweeps median | "
        "clearance mm median "
        "| length / ours | squared acceleration / ours |\n|---|---|---|---|---|---|---|---|---|---|\n");
    for (int k = 0; k < 4 && !answers[k].empty(); ++k) {
      int hits = 0, any = 0;
      std::vector<double> ms, sweeps, clearance, length, effort;
      for (std::size_t i = 0; i < answers[k].size(); ++i) {
        const Answer &a = answers[k][i], &own = answers[0][i];
        hits += a.certified;
        any += std::any_of(answers, answers + 4,
                           [i](const auto& list) { return i < list.size() && list[i].certified; });
        ms.push_back(a.ms);
        sweeps.push_back(a.sweeps);
        if (!a.certified) continue;
        clearance.push_back(1e3 * a.clearance_m);
        if (!own.certified) continue;
        length.push_back(own.length / a.length);
        effort.push_back(own.effort / a.effort);
      }
      const auto w = reports::wilson(hits, static_cast<int>(answers[k].size()));
      std::printf(
          "| %s | %d | %.1f to %.1f %% | %d / %d | %.2f | %.1f | %.0f | %.1f | ours is %.3f | %.3f |\n",
          names[k], hits, 100 * w.low, 100 * w.high, hits, any, geometry::median(ms), quantile(ms, 0.98),
          geometry::median(sweeps), geometry::median(clearance), geometry::median(length),
          geometry::median(effort));
    }
    std::map<std::string, int> planners;
    for (const Answer& a : answers[0]) ++planners[a.planner];
    for (const auto& [name, count] : planners) std::printf("%s: %d  ", name.c_str(), count);
    std::printf("\n");
    std::fflush(stdout);
  }

  /// The search alone to the closed hand from a straight line: as it is, with the fingers' winding numbers
  /// as a task, and with their writhe with the object's ring.
  void run_topology() {
    const char* names[] = {"none", "winding", "writhe"};
    std::printf("\n%s\n| object | task | certified | clearance mm | cost |\n|---|---|---|---|---|\n",
                options.hand.c_str());
    for (const Object& object : objects) {
      if (object.grasps.empty()) continue;
      int certified[3] = {0, 0, 0}, count = 0;
      std::vector<double> clearance[3], cost[3];
      for (int i = 0; count < options.winding && i < 3 * options.winding; ++i) {
        const auto p = problem(object, false, i);
        if (!p) continue;
        ++count;
        for (std::size_t with = 0; with < 3; ++with) {
          if (with == 2 && object.ring.empty()) continue;
          p->planner->extra_tasks.clear();
          if (with == 1)
            p->planner->extra_tasks =
                motion::wrapping_tasks(*p->mover, p->goal.start, p->goal.closing.back(), rule().steps, 10);
          if (with == 2) add_writhe(*p, object.ring);
          motion::ApproachPlan report;
          const Path path = p->planner->improved(
              {p->goal.start, p->goal.closing.front(), p->goal.closing.back()}, 0.5, report);
          const auto proof = p->planner->prove_closing(path);
          certified[with] += proof.outcome == motion::Proof::free;
          if (proof.outcome == motion::Proof::free) clearance[with].push_back(1e3 * proof.clearance_m);
          cost[with].push_back(report.cost);
        }
      }
      for (std::size_t with = 0; with < 3; ++with)
        if (!cost[with].empty())
          std::printf("| %s | %s | %d / %d | %.1f | %.1f |\n", object.name.c_str(), names[with],
                      certified[with], count, geometry::median(clearance[with]),
                      geometry::median(cost[with]));
      std::fflush(stdout);
    }
  }

  /// The sums of each finger's writhe with the ring, from those of the start to those of the grasp.
  void add_writhe(Problem& p, const topology::Polyline& ring) const {
    const int T = rule().steps;
    for (std::size_t f = 0; f < p.mover->hand().fingers.size(); ++f) {
      const auto chain = motion::chain_of(*p.mover, motion::finger_points(p.mover->hand(), f));
      const auto task = [&](const motion::TargetOf& target, std::vector<double> precision) {
        return motion::writhe_task(chain, ring, motion::WritheForm::scalar, target, std::move(precision));
      };
      motion::Task now = task(motion::constant_target(VectorXd::Zero(1)), {});
      VectorXd first, last;
      now.evaluate(0, p.goal.start, first, nullptr);
      now.evaluate(0, p.goal.closing.back(), last, nullptr);
      p.planner->extra_tasks.push_back(
          task(motion::interpolated_target(first, last, T), motion::constant_precision(T, 10)));
    }
  }
};

}  // namespace

int main_of(int argc, char** argv) {
  const Options options = read_options(argc, argv);
  const auto hand = hands::load_hand(options.hand);
  const auto armed = hands::on_arm(hands::load_arm("kuka_lwr4"), hand);
  std::FILE* csv = std::fopen(options.csv.c_str(), "w");
  if (!csv) {
    std::perror(options.csv.c_str());
    return 2;
  }
  std::fprintf(
      csv,
      "body,object,problem,planner,certified,cpu_ms,length,straight,squared_acceleration,clearance_m,sweeps,"
      "answered\n");
  Study study{options, hand, armed, {}, csv};
  for (const auto& [name, mesh] : objects_of(options.folder)) {
    if (!options.only.empty() &&
        std::find(options.only.begin(), options.only.end(), name) == options.only.end())
      continue;
    study.objects.push_back(placed_object(name, mesh, hand));
    std::printf("%s: %zu grasps\n", name.c_str(), study.objects.back().grasps.size());
    std::fflush(stdout);
  }
  if (options.floating > 0) study.run(false);
  if (options.arm > 0) study.run(true);
  if (options.winding > 0) study.run_topology();
  return std::fclose(csv) == 0 ? 0 : 1;
}

}  // namespace geocage::bench

int main(int argc, char** argv) {
  return geocage::bench::main_of(argc, argv);
}
