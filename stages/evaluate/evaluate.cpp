#include "stages/evaluate/evaluate.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <span>

#include "physics/force_trial.h"
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pipeline/each_item.h"
#include "pipeline/error.h"

namespace geocage::stages {
namespace {

using physics::Control;
using physics::Posture;
using physics::Protocol;
using physics::PushTrial;
using pipeline::Fault;
using pipeline::UserError;

double degrees(double rad) {
  return rad * 180 / std::numbers::pi;
}

std::optional<std::string> rejection(const Posture& posture, const motion::Trajectory* approach,
                                     const Protocol& protocol) {
  if (approach && approach->outcome != "planned") return "no approach path: " + approach->outcome;
  if (posture.penetration_m > protocol.max_start_penetration_m)
    return fmt::format("the hand starts {:.1f} mm inside the object (limit {:.0f} mm)",
                       1e3 * posture.penetration_m, 1e3 * protocol.max_start_penetration_m);
  return {};
}

/// An entry for each grasp; those that need no simulation have their verdict.
std::vector<Evaluation> screened(const std::vector<Posture>& postures,
                                 const std::vector<motion::Trajectory>& approaches,
                                 const Protocol& protocol) {
  if (!approaches.empty() && approaches.size() != postures.size())
    throw UserError(Fault::input, "trajectories",
                    fmt::format("there are {} for {} grasps", approaches.size(), postures.size()),
                    "plan one approach a grasp, or give none");
  std::vector<Evaluation> list(postures.size());
  for (std::size_t i = 0; i < postures.size(); ++i) {
    list[i].grasp = static_cast<int>(i);
    list[i].start_penetration_m = postures[i].penetration_m;
    if (const auto why = rejection(postures[i], approaches.empty() ? nullptr : &approaches[i], protocol))
      list[i].outcome = Outcome::rejected, list[i].reason = *why;
  }
  return list;
}

using Ways = std::vector<physics::Direction>;

/// What all trials of a run share.
struct Bench {
  Protocol protocol;
  const physics::ObjectBody& object;
  const hands::Hand& hand;
  const Ways& ways;  ///< the loads of each grasp
  std::uint64_t seed;

  PushTrial push(const Posture& posture, std::size_t way, physics::Recording* recording = nullptr) const {
    return physics::push_trial(protocol, object, hand, posture, ways[way], seed, recording);
  }
};

/// The trials of some postures, posture by posture.
struct Trials {
  std::vector<PushTrial> list;
  std::size_t ways;

  std::span<const PushTrial> of(std::size_t posture) const {
    return std::span(list).subspan(posture * ways, ways);
  }
};

/// All that is simulated, in one list, so that no thread waits for the end of a part of it: the longest
/// first. One world a trial, so threads share nothing.
using Work = std::vector<std::function<void()>>;

/// The grasps that are simulated, in their order.
std::vector<int> simulated_grasps(const std::vector<Evaluation>& list) {
  std::vector<int> grasps;
  for (const Evaluation& evaluation : list)
    if (evaluation.outcome != Outcome::rejected) grasps.push_back(evaluation.grasp);
  return grasps;
}

physics::Recording film_of(const Bench& bench, const hands::GraspSet& grasps, int grasp,
                           const std::string& trial) {
  physics::Recording film;
  film.grasp = grasp, film.hand = bench.hand.name, film.protocol = bench.protocol.name;
  film.object = grasps.grasps[grasp].object, film.trial = trial, film.joints = bench.hand.tree.dof_names;
  return film;
}

/// Films of all loads of the first grasps.
std::vector<physics::Recording> films_of_pushes(const Bench& bench, const hands::GraspSet& grasps,
                                                const std::vector<int>& simulated, int wanted) {
  std::vector<physics::Recording> films;
  for (const int grasp : simulated) {
    if (wanted-- <= 0) break;
    for (const physics::Direction& way : bench.ways)
      films.push_back(film_of(bench, grasps, grasp, way.trial()));
  }
  return films;
}

/// All loads of the bench on each posture; the first trials are filmed, one a film.
void add_pushes(Work& work, const Bench& bench, const std::vector<Posture>& postures, Trials& trials,
                std::vector<physics::Recording>& films) {
  trials = {std::vector<PushTrial>(postures.size() * bench.ways.size()), bench.ways.size()};
  for (std::size_t i = 0; i < trials.list.size(); ++i)
    work.push_back([&, i] {
      physics::Recording* const film = i < films.size() ? &films[i] : nullptr;
      trials.list[i] = bench.push(postures[i / trials.ways], i % trials.ways, film);
      if (film) film->outcome = trials.list[i].outcome;
    });
}

/// Lift, shake and release of the first grasps, one a film; kept are the first `recorded_grasps`.
void add_lifts(Work& work, Evaluations& all, const Bench& bench, const std::vector<Posture>& postures,
               std::vector<physics::Recording>& films) {
  for (std::size_t i = 0; i < films.size(); ++i)
    work.push_back([&, i] {
      physics::Recording* const film =
          i < static_cast<std::size_t>(all.params.recorded_grasps) ? &films[i] : nullptr;
      const physics::LiftTrial lift = physics::lift_trial(bench.protocol, bench.object, bench.hand,
                                                          postures[films[i].grasp], bench.seed, film);
      all.list[films[i].grasp].lift = lift;
      films[i].outcome = lift.outcome;
    });
}

void add_margins(Evaluations& all, const Bench& bench, const std::vector<Posture>& postures,
                 const hands::GraspSet& grasps, const std::vector<int>& simulated) {
  const auto& [protocol, object, hand, ways, seed] = bench;
  physics::MarginRule rule;
  rule.draws = all.params.margin_draws;
  int wanted = all.params.margin_grasps;
  for (const int grasp : simulated) {
    if (wanted-- <= 0) break;
    const auto open = physics::open_posture(hand, *object.field, grasps.grasps[grasp]);
    all.list[grasp].margins =
        physics::force_margins(protocol, object, hand, postures[grasp].X_OH, open.q, rule, seed);
  }
}

/// A sample of the trials of all simulated grasps, at half the step and with twice the iterations.
class Sample {
 public:
  Sample(const Bench& bench, std::size_t trials, int wanted) : half_(bench), twice_(bench) {
    half_.protocol.engine.dt_s /= 2;
    twice_.protocol.engine.iterations *= 2;
    for (const std::size_t trial : physics::even_sample(trials, wanted)) list_.push_back({trial});
  }
  void add(Work& work, const std::vector<Posture>& tested) {
    const std::size_t ways = half_.ways.size();
    for (Again& one : list_) {
      work.push_back(
          [&, ways] { one.half = half_.push(tested[one.trial / ways], one.trial % ways).outcome; });
      work.push_back(
          [&, ways] { one.twice = twice_.push(tested[one.trial / ways], one.trial % ways).outcome; });
    }
  }
  physics::SelfCheck compared(const Trials& trials, const std::vector<int>& simulated) const {
    physics::SelfCheck check;
    for (const Again& one : list_)
      check.count(fmt::format("grasp {}, {}", simulated[one.trial / trials.ways],
                              half_.ways[one.trial % trials.ways].trial()),
                  trials.list[one.trial].outcome, one.half, one.twice);
    return check;
  }

 private:
  struct Again {
    std::size_t trial;
    Outcome half = Outcome::held, twice = Outcome::held;
  };
  Bench half_, twice_;
  std::vector<Again> list_;
};

/// The worst of its pushes decides a grasp.
Outcome worst(std::span<const PushTrial> trials) {
  for (const Outcome outcome : {Outcome::error, Outcome::unsettled, Outcome::lost})
    if (std::ranges::find(trials, outcome, &PushTrial::outcome) != trials.end()) return outcome;
  return Outcome::held;
}

std::string lost_reason(const Evaluation& evaluation, const Bench& bench) {
  std::vector<std::string> pushes, turns;
  for (std::size_t i = 0; i < bench.ways.size(); ++i) {
    const DirectionResult& one = evaluation.directions[i];
    if (one.outcome == Outcome::lost)
      (bench.ways[i].turns ? turns : pushes)
          .push_back(fmt::format("{} after {:.2f} s", bench.ways[i].name, one.ended_s));
  }
  const Protocol& protocol = bench.protocol;
  if (protocol.contact_holds)
    return fmt::format("no contact was left after pushes along {}", fmt::join(pushes, ", "));
  std::string text = fmt::format("moved by {:.0f} cm", 1e2 * protocol.max_translation_m);
  if (std::isfinite(protocol.max_rotation_rad))
    text += fmt::format(" or {:.0f} deg", degrees(protocol.max_rotation_rad));
  if (!pushes.empty()) text += fmt::format(" when pushed along {}", fmt::join(pushes, ", "));
  if (!turns.empty()) text += fmt::format(" when turned about {}", fmt::join(turns, ", "));
  return text;
}

std::string reason(const Evaluation& evaluation, const Bench& bench) {
  const Protocol& protocol = bench.protocol;
  switch (evaluation.outcome) {
    case Outcome::error:
      return fmt::format("the simulation failed: NaN, more than {:.0f} m/s, or {:.1f} mm inside",
                         protocol.max_speed_m_s, 1e3 * evaluation.max_penetration_m);
    case Outcome::unsettled:
      return fmt::format(
          "the closing hand moved the object by {:.1f} mm and {:.1f} deg (limits {:.0f} mm, {:.0f} deg)",
          1e3 * evaluation.drift_m, degrees(evaluation.drift_rad), 1e3 * protocol.max_drift_m,
          degrees(protocol.max_drift_rad));
    case Outcome::lost:
      return lost_reason(evaluation, bench);
    default:
      break;
  }
  const auto turns = std::ranges::count(bench.ways, true, &physics::Direction::turns);
  return fmt::format("held against {} pushes{}{}", bench.ways.size() - turns,
                     turns > 0 ? fmt::format(" and {} torques", turns) : "",
                     protocol.contact_holds ? ": some contact was left" : "");
}

void judge(Evaluation& evaluation, std::span<const PushTrial> trials, const Bench& bench) {
  for (std::size_t d = 0; d < trials.size(); ++d) {
    const PushTrial& trial = trials[d];
    evaluation.drift_m = std::max(evaluation.drift_m, trial.drift_m);
    evaluation.drift_rad = std::max(evaluation.drift_rad, trial.drift_rad);
    evaluation.max_penetration_m = std::max(evaluation.max_penetration_m, trial.penetration_m);
    const physics::Direction& way = bench.ways[d];
    evaluation.directions.push_back({way.turns ? way.trial() : way.name, trial.outcome, trial.displacement_m,
                                     trial.rotation_rad, trial.ended_s});
  }
  evaluation.outcome = worst(trials);
  evaluation.reason = reason(evaluation, bench);
}

/// Of `count` postures from the first one on.
Control control(const char* label, Control::Rule rule, const Trials& trials, std::size_t first,
                std::size_t count) {
  Control control{label, rule};
  for (std::size_t i = first; i < first + count; ++i) {
    const auto held = std::ranges::count(trials.of(i), Outcome::held, &PushTrial::outcome);
    ++control.grasps;
    control.trials += static_cast<int>(trials.ways);
    control.held += static_cast<int>(held);
    control.passed += held == static_cast<long>(trials.ways);
  }
  return control;
}

/// All that were simulated but those of margins, whose number hangs on the order of threads.
int trials_of(const Evaluations& all) {
  int trials = 2 * all.self_check.trials;
  for (const Evaluation& evaluation : all.list)
    trials += static_cast<int>(evaluation.directions.size()) + evaluation.lift.has_value();
  for (const Control& control : all.controls) trials += control.trials;
  return trials;
}

void report(const Evaluations& all, std::initializer_list<const Trials*> trials, pipeline::Run& run) {
  double steps = 0;
  for (const Trials* some : trials)
    for (const PushTrial& trial : some->list) steps += trial.steps;
  for (const Outcome outcome : physics::outcomes)
    run.metric(std::string(physics::name(outcome)), all.count(outcome));
  for (const Control& control : all.controls) {
    std::string label = control.name;
    std::ranges::replace(label, ' ', '_');
    run.metric("control_" + label + "_trials", control.trials);
    run.metric("control_" + label + "_held", control.held);
    if (!control.ok())
      run.log(fmt::format("control '{}' failed ({}): this run proves nothing", control.name,
                          physics::rule_text(control.rule)));
  }
  run.metric("controls_ok", all.valid());
  run.metric("held_within_2_cm", std::ranges::count_if(all.list, &Evaluation::held_strictly));
  run.metric("starts_within_1_mm", all.starts_within_1_mm());
  run.metric("trials", trials_of(all));
  run.metric("simulated_steps", steps);
  run.metric("self_check_trials", all.self_check.trials);
  run.metric("self_check_half_step", all.self_check.half_step);
  run.metric("self_check_twice_iterations", all.self_check.twice_iterations);
  if (all.self_check.trials > 0) run.log("self-check: " + all.self_check.text());
  for (const std::string& line : all.self_check.disagreements) run.log("self-check: " + line);
}

}  // namespace

void EvaluateParams::visit(pipeline::Fields& f) {
  f("protocol", protocol, physics::protocol_names(),
    "named test: loads, friction, limits and engine settings");
  f("friction", friction, {0, 10}, "Coulomb's mu of every contact, of geocage-force alone");
  f("loads", loads, physics::load_set_names(),
    "axes: six pushes; all: 26 towards faces, edges and corners of a cube, and six torques; of geocage-force "
    "alone");
  f("push_m_s2", push_m_s2, {1e-3, 100},
    "of a push, per mass: 10 is BODex's, 9.81 the weight; of geocage-force alone");
  f("weight", weight, {"mass", "density"}, "which of the next two counts; of geocage-force alone");
  f("mass_kg", mass_kg, {1e-4, 100}, "of the object").only_with("weight", {"mass"});
  f("density_kg_m3", density_kg_m3, {1, 3e4}, "of the object's solid; 500 is DexGraspNet's")
      .only_with("weight", {"density"});
  f("object_geometry", object_geometry, {"truth", "reconstruction", "given"},
    "which geometry of the object is simulated; kept with the results");
  f("control_grasps", control_grasps, {1, 1e6},
    "grasps repeated with the hand 1 m away, with open fingers, and with random ones");
  f("self_check_trials", self_check_trials, {0, 1e6},
    "pushes repeated at half the step and with twice the iterations");
  f("recorded_grasps", recorded_grasps, {0, 1e6}, "first grasps whose pushes are kept for playback");
  f("lift_grasps", lift_grasps, {0, 1e6}, "first grasps that lift, shake and let go of the object, too");
  f("margin_grasps", margin_grasps, {0, 1e6},
    "first grasps whose margins of friction, push and pose noise are bisected; minutes each");
  f("margin_draws", margin_draws, {1, 1e4}, "displaced poses of each level; 95 % of them must hold");
  f("seed", seed, "seed of the solver");
}

Protocol protocol_of(const EvaluateParams& params) {
  Protocol protocol = physics::find_protocol(params.protocol);
  const bool by_density = params.weight == "density";
  if (protocol.name == "geocage-force") {
    protocol.engine.friction = params.friction;
    protocol.acceleration_m_s2 = params.push_m_s2;
    protocol.mass_kg = params.mass_kg;
    if (by_density) protocol.density_kg_m3 = params.density_kg_m3;
    return protocol;
  }
  const EvaluateParams usual;
  const auto refuse = [&](bool chosen, const char* parameter, const std::string& own) {
    if (chosen)
      throw UserError(Fault::configuration, fmt::format("evaluate.{}", parameter),
                      fmt::format("{} names its own {}", protocol.name, own),
                      "leave it out, or choose the protocol geocage-force");
  };
  refuse(params.loads != usual.loads, "loads", "loads, the six pushes");
  refuse(params.friction != usual.friction, "friction",
         fmt::format("friction, {}", protocol.engine.friction));
  refuse(params.push_m_s2 != usual.push_m_s2, "push_m_s2",
         fmt::format("push, {} m/s^2", protocol.acceleration_m_s2));
  const std::string weight = protocol.density_kg_m3
                                 ? fmt::format("weight, {} kg/m^3", *protocol.density_kg_m3)
                                 : fmt::format("weight, {} kg", protocol.mass_kg);
  refuse(by_density, "weight", weight);
  refuse(params.mass_kg != usual.mass_kg, "mass_kg", weight);
  refuse(params.density_kg_m3 != usual.density_kg_m3, "density_kg_m3", weight);
  return protocol;
}

int Evaluation::held_pushes(bool strictly) const {
  return static_cast<int>(std::ranges::count_if(
      directions, [&](const DirectionResult& one) { return strictly ? one.held_strictly() : one.held(); }));
}

const DirectionResult* Evaluation::worst() const {
  const auto worse = [](const DirectionResult& a, const DirectionResult& b) {
    if (a.held() != b.held()) return a.held();
    return a.held() ? a.max_displacement_m < b.max_displacement_m : a.ended_s > b.ended_s;
  };
  if (outcome != Outcome::held && outcome != Outcome::lost) return nullptr;
  const auto found = std::ranges::max_element(directions, worse);
  return found == directions.end() ? nullptr : &*found;
}

int Evaluations::starts_within_1_mm() const {
  return static_cast<int>(
      std::ranges::count_if(list, [](const Evaluation& one) { return one.start_penetration_m < 1e-3; }));
}

int Evaluations::count(Outcome outcome) const {
  return static_cast<int>(std::ranges::count(list, outcome, &Evaluation::outcome));
}

Evaluations evaluate(const EvaluateParams& params, pipeline::Run& run, const hands::GraspSet& grasps,
                     const motion::TrajectorySet& trajectories, const geometry::TriangleMesh& object,
                     const geometry::SignedDistanceField& field, const hands::Hand& hand) {
  const Protocol protocol = protocol_of(params);
  physics::check_border(object, field, hand);
  const auto body = physics::solid_body(object, field, protocol.mass_kg, protocol.density_kg_m3);
  const std::vector<Posture> postures = physics::postures_of(grasps, hand, field);

  const Bench bench{protocol, body, hand, physics::find_loads(params.loads), params.seed};
  const Bench control_bench{protocol, body, hand, physics::six_directions(), params.seed};

  Evaluations all{params, screened(postures, trajectories.trajectories, protocol), {}, {}, {}};
  std::vector<Posture> tested, nulls;
  for (const Evaluation& evaluation : all.list)
    if (evaluation.outcome != Outcome::rejected) tested.push_back(postures[evaluation.grasp]);
  const std::size_t controls = hand.net ? 0 : std::min<std::size_t>(postures.size(), params.control_grasps);
  for (std::size_t i = 0; i < controls; ++i) nulls.push_back(physics::far_posture(hand, postures[i]));
  for (std::size_t i = 0; i < controls; ++i)
    nulls.push_back(physics::open_posture(hand, field, grasps.grasps[i]));
  for (std::size_t i = 0; i < controls; ++i)
    nulls.push_back(physics::random_posture(hand, field, postures[i], params.seed, i));

  const std::vector<int> simulated = simulated_grasps(all.list);
  Trials trials, known;
  std::vector<physics::Recording> films = films_of_pushes(bench, grasps, simulated, params.recorded_grasps);
  std::vector<physics::Recording> lift_films, none;
  for (std::size_t i = 0; i < std::min<std::size_t>(simulated.size(), params.lift_grasps); ++i)
    lift_films.push_back(film_of(bench, grasps, simulated[i], "lift"));
  Sample sample(bench, tested.size() * bench.ways.size(), params.self_check_trials);
  Work work;
  add_lifts(work, all, bench, postures, lift_films);
  sample.add(work, tested);
  add_pushes(work, bench, tested, trials, films);
  add_pushes(work, control_bench, nulls, known, none);
  std::size_t done = 0;
  pipeline::for_each_item(work.size(), [&](std::size_t i) {
    work[i]();
#pragma omp critical
    run.progress(++done, work.size());
  });

  for (std::size_t i = 0; i < simulated.size(); ++i) judge(all.list[simulated[i]], trials.of(i), bench);
  all.controls = {control("hand 1 m away", Control::Rule::no_trial_holds, known, 0, controls),
                  control("open hand", Control::Rule::no_grasp_passes, known, controls, controls),
                  control("random fingers", Control::Rule::reported, known, 2 * controls, controls)};
  std::ranges::move(physics::known_cages(protocol), std::back_inserter(all.controls));
  all.self_check = sample.compared(trials, simulated);
  all.recordings = std::move(films);
  for (physics::Recording& film : lift_films)
    if (!film.frames.empty()) all.recordings.push_back(std::move(film));
  add_margins(all, bench, postures, grasps, simulated);
  report(all, {&trials, &known}, run);
  return all;
}

}  // namespace geocage::stages
