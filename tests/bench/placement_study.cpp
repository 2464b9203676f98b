// Which centres and which poses make a closed hand cage? For every mesh of a folder:
//   placement_study FOLDER OUT.csv [--hand NAME] [--radius M] [--centres N] [--local N] [--only a,b,c]
//   [--skip a,b,c] [--hold-out a,b,c] [--groups a,b,c] [--rules on|off] [--pulls on|off]
// Groups of centres (winding, curvature, random, ties, windows of S1, girths of rings, some with and without
// the centre-of-mass rule) get the same budget: N centres, and for each 2 approaches x 4 rolls x 2 gaps x 2
// spreads, or N poses of a local search. Without the rules the hand comes nearly palm-flush (2 and 15 mm), is
// not opened further, closes all joints together, and two fingers suffice. One CSV line a centre; the summary
// on stdout has Wilson intervals over centres and paired differences over objects (bootstrap of centres
// inside objects). Outcomes are distance queries: blk, the share of 42 straight ways out that are blocked.
// With pulls, a random valid pose of each centre and its best by rank are also locked and pulled without
// friction (physics/cage_trial.h). With objects held out, the window or girth that beats random by most on
// the others is named, and told only for them.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <optional>
#include <random>
#include <sstream>

#include "physics/escape_test.h"
#include "physics/protocols.h"

#include "pipeline/error.h"
#include "reports/statistics.h"
#include "stages/balls/balls.h"
#include "stages/place/place.h"
#include "stages/remesh/remesh.h"
#include "tests/bench/placement_centres.h"
#include "tests/bench/placement_pulls.h"
#include "tests/bench/study_objects.h"

namespace geocage::bench {
namespace {

struct Options {
  std::string folder, csv, hand = "schunk_sdh";
  double radius_m = 0.06;
  int centres = 24, local = 0;
  bool rules = true, pulls = false;
  std::vector<std::string> only, skip, hold_out, groups;
};

/// What the poses of one centre came to.
struct Centre {
  std::string object, group;
  topology::Candidate candidate;
  int poses = 0, valid = 0, full = 0;  ///< full: all ways out blocked
  int sure = 0;                        ///< all blocked, with a closure margin of 0.2 at least
  double best_blocked = 0, best_rank = -1, mean_blocked = 0;  ///< mean over all poses, invalid ones 0
  Kept drawn, best;  ///< by a random valid pose, and by the one of the best rank
};

Options read_options(int argc, char** argv) {
  Options options;
  if (argc < 3) {
    std::fprintf(
        stderr,
        "placement_study FOLDER OUT.csv [--hand NAME] [--radius M] [--centres N] [--local N] "
        "[--only a,b] [--skip a,b] [--hold-out a,b] [--groups a,b] [--rules on|off] [--pulls on|off]\n");
    std::exit(2);
  }
  options.folder = argv[1];
  options.csv = argv[2];
  for (int i = 3; i + 1 < argc; i += 2) {
    const std::string key = argv[i], value = argv[i + 1];
    if (key == "--hand")
      options.hand = value;
    else if (key == "--radius")
      options.radius_m = std::stod(value);
    else if (key == "--centres")
      options.centres = std::stoi(value);
    else if (key == "--local")
      options.local = std::stoi(value);
    else if (key == "--only")
      options.only = split(value);
    else if (key == "--skip")
      options.skip = split(value);
    else if (key == "--hold-out")
      options.hold_out = split(value);
    else if (key == "--groups")
      options.groups = split(value);
    else if (key == "--rules")
      options.rules = value != "off";
    else if (key == "--pulls")
      options.pulls = value == "on";
    else
      std::fprintf(stderr, "unknown option %s\n", key.c_str()), std::exit(2);
  }
  return options;
}

std::vector<Group> groups() {
  std::vector<Group> all;
  for (const char* heuristic : {"random", "winding", "curvature", "ties"})
    for (bool com_rule : {false, true}) all.push_back({heuristic, com_rule});
  all.push_back({"window", true, 3.9, 4.4});
  all.push_back({"window", true, 4.1, 4.6});
  all.push_back({"window", true, 4.3, 4.8});
  all.push_back({"girth", true, 0.06, 0.1});
  all.push_back({"girth", true, 0.08, 0.14});
  return all;
}

/// What is tuned, and held out.
bool is_tuned(const Group& group) {
  return group.heuristic == "window" || group.heuristic == "girth" ||
         (group.heuristic == "ties" && group.com_rule);
}

/// Which random group a group is compared with.
std::string control_of(const Group& group) {
  if (group.heuristic == "random") return "random";
  return Group{"random", group.com_rule}.name();
}

stages::PlaceParams budget(const Options& options) {
  stages::PlaceParams params;
  params.rolls_winding = params.rolls_curvature = 4;
  params.max_com_offset_m = 10;  // the rule under test acts on centres
  params.min_blocked_share = 0;
  params.max_per_candidate = params.max_grasps = 100000;
  params.measures = false;
  if (options.local > 0) {
    params.approaches = {"normal"};
    params.rolls_winding = params.rolls_curvature = 1;
    params.gaps_m = {0.02, 0.035};
    params.spreads_rad = {0};
    params.local_samples = options.local;
  }
  if (!options.rules) {
    params.gaps_m = {0.002, 0.015};
    params.max_opening_rad = 0;
    params.closing_order = "together";
    params.min_fingers = 2;
  }
  return params;
}

void add(Centre& centre, const hands::Grasp& grasp, int poses) {
  const double blocked = grasp.scores.at("blocked_share");
  ++centre.valid;
  centre.full += blocked > 0.999;
  centre.sure += blocked > 0.999 && grasp.scores.at("closure_margin") >= 0.2;
  centre.best_blocked = std::max(centre.best_blocked, blocked);
  centre.best_rank = std::max(centre.best_rank, grasp.scores.at("rank"));
  centre.mean_blocked += blocked / poses;
}

bool has(const std::vector<std::string>& list, const std::string& name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

/// `of_one`: the valid poses of a centre, best first.
void pull(Centre& centre, const std::vector<const hands::Grasp*>& of_one, const hands::Hand& hand,
          const physics::ObjectBody& body, double radius_m) {
  if (of_one.empty()) return;
  std::mt19937_64 random(static_cast<std::uint64_t>(centre.candidate.vertex));
  centre.best = kept_by(hand, *of_one.front(), body, radius_m);
  centre.drawn = kept_by(hand, *of_one[random() % of_one.size()], body, radius_m);
}

std::vector<Centre> study(const Options& options, const std::string& name,
                          const geometry::TriangleMesh& original, const hands::Hand& hand) {
  pipeline::Run run;
  topology::Scores scores;
  scores.mesh = stages::remesh({.edge_length_m = 0.004}, run, original);
  stages::BallsParams balls;
  balls.radii_m = {options.radius_m, 0.75 * options.radius_m, 1.33 * options.radius_m};
  const auto all_balls = stages::balls(balls, run, scores.mesh).radii;
  scores.ball = all_balls.front();
  const double share = topology::median_share(scores.ball, geometry::check_mesh(scores.mesh).area_m2);
  std::printf("| %s | %zu | %.2f | %.2f |\n", name.c_str(), scores.mesh.vertices.size(),
              saturated_share(scores.ball), share);
  const auto field = geometry::build_distance_field(original, {.cells = 64, .pad_m = 0.04, .refine = 3});
  const auto params = budget(options);
  std::optional<physics::ObjectBody> body;
  if (options.pulls) body = physics::solid_body(original, field, physics::CageProtocol{}.mass_kg);
  std::vector<Centre> centres;
  for (const Group& group : groups()) {
    if (!options.groups.empty() && !has(options.groups, group.name())) continue;
    scores.candidates = centres_of(group, scores.mesh, all_balls, options.centres, 11);
    pipeline::Run group_run;
    const auto set = stages::place(params, group_run, scores, field, {}, {}, hand);
    const std::size_t first = centres.size();
    const int poses = scores.candidates.empty()
                          ? 0
                          : static_cast<int>(std::lround(group_run.metrics().at("poses") /
                                                         static_cast<double>(scores.candidates.size())));
    for (const auto& candidate : scores.candidates) {
      centres.push_back({name, group.name(), candidate});
      centres.back().poses = poses;
    }
    std::vector<std::vector<const hands::Grasp*>> valid(scores.candidates.size());
    for (const auto& grasp : set.grasps) {
      const auto i = static_cast<std::size_t>(grasp.scores.at("candidate"));
      add(centres[first + i], grasp, poses);
      valid[i].push_back(&grasp);
    }
    if (!body) continue;
    const double radius_m = physics::radius_about_m(original, body->X_OB.translation());
#pragma omp parallel for schedule(dynamic, 1)
    for (std::size_t i = 0; i < valid.size(); ++i) pull(centres[first + i], valid[i], hand, *body, radius_m);
  }
  return centres;
}

using Outcome = double (*)(const Centre&);

std::map<std::string, std::vector<double>> by_object(const std::vector<Centre>& centres,
                                                     const std::string& group, Outcome outcome) {
  std::map<std::string, std::vector<double>> values;
  for (const Centre& centre : centres)
    if (centre.group == group) values[centre.object].push_back(outcome(centre));
  return values;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (double x : values) sum += x / static_cast<double>(values.size());
  return sum;
}

/// Mean over objects of the difference of two groups' means, with a 95 % bootstrap of centres inside objects;
/// without a control, of the group's mean.
struct Difference {
  double mean = 0, low = 0, high = 0;
  int objects = 0;
};
Difference difference(const std::vector<Centre>& centres, const std::string& group,
                      const std::string& control, Outcome outcome) {
  const auto a = by_object(centres, group, outcome), b = by_object(centres, control, outcome);
  std::mt19937_64 random(5);
  const auto redrawn = [&](const std::vector<double>& values) {
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      sum += values[static_cast<std::size_t>(static_cast<double>(random() >> 11) * 0x1p-53 *
                                             static_cast<double>(values.size()))];
    return sum / static_cast<double>(values.size());
  };
  Difference found;
  std::vector<double> draws(2000, 0.0);
  for (const auto& [object, values] : a) {
    const auto other = b.find(object);
    if (other == b.end() && !control.empty()) continue;
    ++found.objects;
    found.mean += mean(values) - (control.empty() ? 0 : mean(other->second));
    for (double& draw : draws) draw += redrawn(values) - (control.empty() ? 0 : redrawn(other->second));
  }
  if (found.objects == 0) return found;
  std::sort(draws.begin(), draws.end());
  found.mean /= found.objects;
  found.low = draws[50] / found.objects;
  found.high = draws[1949] / found.objects;
  return found;
}
void print(const Difference& d) {
  if (d.objects > 0)
    std::printf(" %+.3f [%+.3f, %+.3f] (%d) |", d.mean, d.low, d.high, d.objects);
  else
    std::printf(" - |");
}

double is_full(const Centre& c) {
  return c.full > 0;
}
double rank_of(const Centre& c) {
  return c.best_rank;
}
double any_of_all(int good, const Centre& c) {
  return c.poses ? double(good) / c.poses : 0;
}

double is_sure(const Centre& c) {
  return c.sure > 0;
}
double share_full(const Centre& c) {
  return any_of_all(c.full, c);
}

std::vector<Centre> of_objects(const std::vector<Centre>& centres, const std::vector<std::string>& names,
                               bool in) {
  std::vector<Centre> some;
  for (const Centre& c : centres)
    if (has(names, c.object) == in) some.push_back(c);
  return some;
}

/// Two outcomes of a group less those of its control, as two cells.
void print_both(const std::vector<Centre>& centres, const Group& group) {
  for (Outcome outcome : {&share_full, &is_full})
    print(difference(centres, group.name(), control_of(group), outcome));
}

/// The tuned groups on the objects they are tuned on, and the best of them on the others.
void print_held_out(const std::vector<Centre>& centres, const std::vector<std::string>& names) {
  const auto tuning = of_objects(centres, names, false);
  std::printf(
      "\nTuned by the share of a centre's poses that block all, less that of random+com:\n\n| group | poses "
      "that "
      "block all | centres with one |\n|---|---|---|\n");
  double most = -2;
  Group best;
  for (const Group& group : groups()) {
    if (!is_tuned(group)) continue;
    std::printf("| %s |", group.name().c_str());
    print_both(tuning, group);
    std::printf("\n");
    const Difference on_others = difference(tuning, group.name(), control_of(group), &share_full);
    if (on_others.objects > 0 && on_others.mean > most) most = on_others.mean, best = group;
  }
  if (best.heuristic.empty()) return;
  std::printf("| **%s**, held out |", best.name().c_str());
  print_both(of_objects(centres, names, true), best);
  for (const std::string& name : names) {
    std::printf("\n| %s |", name.c_str());
    print_both(of_objects(centres, {name}, true), best);
  }
  std::printf("\n");
}

void print_summary(const std::vector<Centre>& centres) {
  std::printf(
      "\n| group | centres | any valid | all blocked | and margin >= 0.2 | a random pose: valid | all "
      "blocked | and margin |\n");
  std::printf("|---|---|---|---|---|---|---|---|\n");
  for (const Group& group : groups()) {
    int n = 0, valid = 0, full = 0, sure = 0;
    double chance_valid = 0, chance_full = 0, chance_sure = 0;
    for (const Centre& c : centres)
      if (c.group == group.name()) {
        ++n, valid += c.valid > 0, full += c.full > 0, sure += c.sure > 0;
        chance_valid += any_of_all(c.valid, c);
        chance_full += any_of_all(c.full, c);
        chance_sure += any_of_all(c.sure, c);
      }
    if (n == 0) continue;
    std::printf("| %s | %d |", group.name().c_str(), n);
    for (int k : {valid, full, sure}) {
      const auto p = reports::wilson(k, n);
      std::printf(" %d = %.0f %% [%.0f, %.0f] |", k, 100 * p.share, 100 * p.low, 100 * p.high);
    }
    std::printf(" %.1f %% | %.1f %% | %.1f %% |\n", 100 * chance_valid / n, 100 * chance_full / n,
                100 * chance_sure / n);
  }
  std::printf(
      "\nDifference from the control of the same rule, mean over objects:\n\n| group | all blocked | with a "
      "margin "
      "of 0.2 | best rank | poses that block all |\n|---|---|---|---|---|\n");
  for (const Group& group : groups()) {
    if (group.heuristic == "random" && !group.com_rule) continue;
    const std::string control = control_of(group);
    std::printf("| %s - %s |", group.name().c_str(), control.c_str());
    for (Outcome outcome : {&is_full, &is_sure, &rank_of, &share_full})
      print(difference(centres, group.name(), control, outcome));
    std::printf("\n");
  }
  std::printf("\nThe same share of poses, object by object (95 %% over its centres):\n\n| object |");
  std::map<std::string, int> objects;
  for (const Centre& c : centres) ++objects[c.object];
  std::vector<Group> compared = groups();
  std::erase_if(compared, [](const Group& group) { return group.name() == "random"; });
  for (const Group& group : compared)
    std::printf(" %s - %s |", group.name().c_str(), control_of(group).c_str());
  std::printf("\n|---|");
  for (std::size_t i = 0; i < compared.size(); ++i) std::printf("---|");
  for (const auto& [object, count] : objects) {
    std::printf("\n| %s |", object.c_str());
    for (const Group& group : compared)
      print(difference(of_objects(centres, {object}, true), group.name(), control_of(group), &share_full));
  }
  std::printf("\n\nCentres with a pose that blocks all with a margin of 0.2, of each object:\n\n| object |");
  for (const Group& group : groups()) std::printf(" %s |", group.name().c_str());
  std::printf("\n|---|");
  for (std::size_t i = 0; i < groups().size(); ++i) std::printf("---|");
  for (const auto& [object, count] : objects) {
    std::printf("\n| %s |", object.c_str());
    for (const Group& group : groups()) {
      int n = 0, sure = 0;
      for (const Centre& c : centres)
        if (c.object == object && c.group == group.name()) ++n, sure += c.sure > 0;
      std::printf(" %d/%d |", sure, n);
    }
  }
  std::printf("\n");
}

/// What a random valid pose and the best one keep, and the difference centre by centre.
void print_pulls(const std::vector<Centre>& centres) {
  std::printf(
      "\n| group | pulls kept: random pose | best | best - random | all six | ring: random pose | best |\n"
      "|---|---|---|---|---|---|---|\n");
  for (const Group& group : groups()) {
    int n = 0, drawn_six = 0, best_six = 0, drawn_ring = 0, best_ring = 0;
    for (const Centre& c : centres)
      if (c.group == group.name()) {
        ++n, drawn_six += c.drawn.pulls == 6, best_six += c.best.pulls == 6;
        drawn_ring += c.drawn.ring == 4, best_ring += c.best.ring == 4;
      }
    if (n == 0) continue;
    std::printf("| %s |", group.name().c_str());
    for (Outcome outcome : {Outcome([](const Centre& c) { return c.drawn.pulls / 6.0; }),
                            Outcome([](const Centre& c) { return c.best.pulls / 6.0; }),
                            Outcome([](const Centre& c) { return (c.best.pulls - c.drawn.pulls) / 6.0; })})
      print(difference(centres, group.name(), "", outcome));
    std::printf(" %d, %d of %d |", drawn_six, best_six, n);
    for (int k : {drawn_ring, best_ring}) {
      const auto p = reports::wilson(k, n);
      std::printf(" %d = %.0f %% [%.0f, %.0f] |", k, 100 * p.share, 100 * p.low, 100 * p.high);
    }
    std::printf("\n");
  }
}

void write_csv(const std::vector<Centre>& centres, const std::string& file) {
  FILE* out = std::fopen(file.c_str(), "w");
  if (!out) return std::perror(file.c_str());
  std::fprintf(
      out,
      "object,group,vertex,winding_angle_rad,curvature_sum_rad,poses,valid,all_blocked,sure,best_blocked,"
      "best_rank,mean_blocked,drawn_pulls,best_pulls,drawn_ring,best_ring\n");
  for (const Centre& c : centres)
    std::fprintf(out, "%s,%s,%d,%.4f,%.4f,%d,%d,%d,%d,%.4f,%.4f,%.4f,%d,%d,%d,%d\n", c.object.c_str(),
                 c.group.c_str(), c.candidate.vertex, c.candidate.winding_angle_rad,
                 c.candidate.curvature_sum_rad, c.poses, c.valid, c.full, c.sure, c.best_blocked, c.best_rank,
                 c.mean_blocked, c.drawn.pulls, c.best.pulls, c.drawn.ring, c.best.ring);
  std::fclose(out);
}

}  // namespace
}  // namespace geocage::bench

int main(int argc, char** argv) {
  using namespace geocage::bench;
  const Options options = read_options(argc, argv);
  const auto hand = geocage::hands::load_hand(options.hand);
  std::vector<Centre> centres;
  std::printf("| object | vertices | S1 saturated | median ball's share |\n|---|---|---|---|\n");
  for (const auto& [name, mesh] : objects_of(options.folder)) {
    if ((!options.only.empty() && !has(options.only, name)) || has(options.skip, name)) continue;
    try {
      const auto of_one = study(options, name, mesh, hand);
      centres.insert(centres.end(), of_one.begin(), of_one.end());
    } catch (const geocage::pipeline::UserError& error) {
      std::fprintf(stderr, "%s is left out: %s\n", name.c_str(), error.what());
    }
    std::fflush(stdout);
  }
  print_summary(centres);
  if (options.pulls) print_pulls(centres);
  if (!options.hold_out.empty()) print_held_out(centres, options.hold_out);
  write_csv(centres, options.csv);
  return 0;
}
