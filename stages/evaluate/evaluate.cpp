#include "stages/evaluate/evaluate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>

#include "physics/force_trial.h"
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pipeline/error.h"

namespace geocage::stages {
namespace {

using physics::Control;
using physics::Posture;
using physics::Protocol;
using physics::PushTrial;
using pipeline::Fault;
using pipeline::UserError;

std::size_t directions() {
  return physics::six_directions().size();
}

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

/// All directions of each posture, in order; one world a trial, so threads share nothing.
std::vector<PushTrial> push_all(const Protocol& protocol, const physics::ObjectBody& object,
                                const hands::Hand& hand, const std::vector<Posture>& postures,
                                std::uint64_t seed, pipeline::Run& run) {
  const auto& directions = physics::six_directions();
  std::vector<PushTrial> trials(postures.size() * directions.size());
  std::size_t done = 0;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const Posture& posture = postures[i / directions.size()];
    trials[i] =
        physics::push_trial(protocol, object, hand, posture, directions[i % directions.size()].axis_O, seed);
#pragma omp critical
    run.progress(++done, trials.size());
  }
  return trials;
}

std::string push_name(std::size_t direction) {
  return fmt::format("push {}", physics::six_directions()[direction].name);
}

/// The pushes of the first grasps once more, for playback.
std::vector<physics::Recording> recorded(const Evaluations& all, const Protocol& protocol,
                                         const physics::ObjectBody& object, const hands::Hand& hand,
                                         const std::vector<Posture>& postures,
                                         const hands::GraspSet& grasps) {
  std::vector<physics::Recording> recordings;
  int wanted = all.params.recorded_grasps;
  for (const Evaluation& evaluation : all.list) {
    if (evaluation.outcome == Outcome::rejected || wanted-- <= 0) continue;
    for (std::size_t d = 0; d < directions(); ++d) {
      physics::Recording& one = recordings.emplace_back();
      one.grasp = evaluation.grasp, one.hand = hand.name, one.protocol = protocol.name;
      one.object = grasps.grasps[evaluation.grasp].object;
      one.trial = push_name(d), one.joints = hand.tree.dof_names;
    }
  }
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < recordings.size(); ++i)
    recordings[i].outcome = physics::push_trial(protocol, object, hand, postures[recordings[i].grasp],
                                                physics::six_directions()[i % directions()].axis_O,
                                                all.params.seed, &recordings[i])
                                .outcome;
  return recordings;
}

/// Lift, shake and release of the first grasps, and the margins of the first ones.
void add_lifts_and_margins(Evaluations& all, const Protocol& protocol, const physics::ObjectBody& object,
                           const hands::Hand& hand, const std::vector<Posture>& postures,
                           const hands::GraspSet& grasps) {
  std::vector<Evaluation*> simulated;
  for (Evaluation& evaluation : all.list)
    if (evaluation.outcome != Outcome::rejected) simulated.push_back(&evaluation);
  const auto first = [&](int wanted) { return std::min<std::size_t>(simulated.size(), wanted); };
  std::vector<physics::Recording> films(first(all.params.lift_grasps));
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < films.size(); ++i) {
    const int grasp = simulated[i]->grasp;
    physics::Recording& film = films[i];
    film.grasp = grasp, film.hand = hand.name, film.protocol = protocol.name;
    film.object = grasps.grasps[grasp].object, film.trial = "lift", film.joints = hand.tree.dof_names;
    const bool kept = i < static_cast<std::size_t>(all.params.recorded_grasps);
    simulated[i]->lift =
        physics::lift_trial(protocol, object, hand, postures[grasp], all.params.seed, kept ? &film : nullptr);
    film.outcome = simulated[i]->lift->outcome;
  }
  for (const physics::Recording& film : films)
    if (!film.frames.empty()) all.recordings.push_back(film);

  physics::MarginRule rule;
  rule.draws = all.params.margin_draws;
  for (std::size_t i = 0; i < first(all.params.margin_grasps); ++i) {
    const int grasp = simulated[i]->grasp;
    const auto open = physics::open_posture(hand, *object.field, grasps.grasps[grasp]);
    simulated[i]->margins =
        physics::force_margins(protocol, object, hand, postures[grasp].X_OH, open.q, rule, all.params.seed);
  }
}

/// A sample of the pushes of all simulated grasps, at half the step and with twice the iterations.
physics::SelfCheck checked(const Evaluations& all, const Protocol& protocol,
                           const physics::ObjectBody& object, const hands::Hand& hand,
                           const std::vector<Posture>& postures) {
  struct Again {
    std::size_t grasp, direction;
    Outcome first, at_half_step = Outcome::held, at_twice_iterations = Outcome::held;
  };
  std::vector<Again> pushes, sample;
  for (const Evaluation& evaluation : all.list)
    for (std::size_t d = 0; d < evaluation.directions.size(); ++d)
      pushes.push_back({static_cast<std::size_t>(evaluation.grasp), d, evaluation.directions[d].outcome});
  for (const std::size_t i : physics::even_sample(pushes.size(), all.params.self_check_trials))
    sample.push_back(pushes[i]);
  Protocol half = protocol, twice = protocol;
  half.engine.dt_s /= 2;
  twice.engine.iterations *= 2;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < sample.size(); ++i) {
    const auto again = [&](const Protocol& other) {
      return physics::push_trial(other, object, hand, postures[sample[i].grasp],
                                 physics::six_directions()[sample[i].direction].axis_O, all.params.seed)
          .outcome;
    };
    sample[i].at_half_step = again(half);
    sample[i].at_twice_iterations = again(twice);
  }
  physics::SelfCheck check;
  for (const Again& one : sample)
    check.count(fmt::format("grasp {}, {}", one.grasp, push_name(one.direction)), one.first, one.at_half_step,
                one.at_twice_iterations);
  return check;
}

/// The worst of its pushes decides a grasp.
Outcome worst(std::span<const PushTrial> trials) {
  for (const Outcome outcome : {Outcome::error, Outcome::unsettled, Outcome::lost})
    if (std::ranges::find(trials, outcome, &PushTrial::outcome) != trials.end()) return outcome;
  return Outcome::held;
}

std::string lost_reason(const std::vector<DirectionResult>& pushes, const Protocol& protocol) {
  std::vector<std::string> losses;
  for (const DirectionResult& push : pushes)
    if (push.outcome == Outcome::lost)
      losses.push_back(fmt::format("{} after {:.2f} s", push.name, push.ended_s));
  if (protocol.contact_holds)
    return fmt::format("no contact was left after pushes along {}", fmt::join(losses, ", "));
  if (!std::isfinite(protocol.max_rotation_rad))
    return fmt::format("moved by {:.0f} cm when pushed along {}", 1e2 * protocol.max_translation_m,
                       fmt::join(losses, ", "));
  return fmt::format("moved by {:.0f} cm or {:.0f} deg when pushed along {}",
                     1e2 * protocol.max_translation_m, degrees(protocol.max_rotation_rad),
                     fmt::join(losses, ", "));
}

std::string reason(const Evaluation& evaluation, const Protocol& protocol) {
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
      return lost_reason(evaluation.directions, protocol);
    default:
      return fmt::format("held against {} pushes{}", evaluation.directions.size(),
                         protocol.contact_holds ? ": some contact was left" : "");
  }
}

void judge(Evaluation& evaluation, std::span<const PushTrial> trials, const Protocol& protocol) {
  for (std::size_t d = 0; d < trials.size(); ++d) {
    const PushTrial& trial = trials[d];
    evaluation.drift_m = std::max(evaluation.drift_m, trial.drift_m);
    evaluation.drift_rad = std::max(evaluation.drift_rad, trial.drift_rad);
    evaluation.max_penetration_m = std::max(evaluation.max_penetration_m, trial.penetration_m);
    evaluation.directions.push_back({physics::six_directions()[d].name, trial.outcome, trial.displacement_m,
                                     trial.rotation_rad, trial.ended_s});
  }
  evaluation.outcome = worst(trials);
  evaluation.reason = reason(evaluation, protocol);
}

Control control(const char* label, Control::Rule rule, std::span<const PushTrial> trials) {
  Control control{label, rule};
  control.trials = static_cast<int>(trials.size());
  for (; !trials.empty(); trials = trials.subspan(directions())) {
    const auto held = std::ranges::count(trials.first(directions()), Outcome::held, &PushTrial::outcome);
    ++control.grasps;
    control.held += static_cast<int>(held);
    control.passed += held == static_cast<long>(directions());
  }
  return control;
}

/// The named protocol, with the friction that geocage's own test lets one choose.
Protocol protocol_of(const EvaluateParams& params) {
  Protocol protocol = physics::find_protocol(params.protocol);
  if (params.friction == physics::Engine{}.friction) return protocol;
  if (protocol.name != "geocage-force")
    throw UserError(Fault::configuration, "evaluate.friction",
                    fmt::format("{} names its own friction, {}", protocol.name, protocol.engine.friction),
                    "leave it out, or choose the protocol geocage-force");
  protocol.engine.friction = params.friction;
  return protocol;
}

void report(const Evaluations& all, const std::vector<PushTrial>& trials, pipeline::Run& run) {
  double steps = 0;
  for (const PushTrial& trial : trials) steps += trial.steps;
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

  Evaluations all{params, screened(postures, trajectories.trajectories, protocol), {}, {}, {}};
  std::vector<Posture> tested;
  for (const Evaluation& evaluation : all.list)
    if (evaluation.outcome != Outcome::rejected) tested.push_back(postures[evaluation.grasp]);
  const std::size_t controls = hand.net ? 0 : std::min<std::size_t>(postures.size(), params.control_grasps);
  for (std::size_t i = 0; i < controls; ++i) tested.push_back(physics::far_posture(hand, postures[i]));
  for (std::size_t i = 0; i < controls; ++i)
    tested.push_back(physics::open_posture(hand, field, grasps.grasps[i]));
  for (std::size_t i = 0; i < controls; ++i)
    tested.push_back(physics::random_posture(hand, field, postures[i], params.seed, i));

  const std::vector<PushTrial> trials = push_all(protocol, body, hand, tested, params.seed, run);
  std::span<const PushTrial> rest(trials);
  for (Evaluation& evaluation : all.list) {
    if (evaluation.outcome == Outcome::rejected) continue;
    judge(evaluation, rest.first(directions()), protocol);
    rest = rest.subspan(directions());
  }
  const std::size_t share = rest.size() / 3;
  all.controls = {control("hand 1 m away", Control::Rule::no_trial_holds, rest.first(share)),
                  control("open hand", Control::Rule::no_grasp_passes, rest.subspan(share, share)),
                  control("random fingers", Control::Rule::reported, rest.last(share))};
  all.self_check = checked(all, protocol, body, hand, postures);
  all.recordings = recorded(all, protocol, body, hand, postures, grasps);
  add_lifts_and_margins(all, protocol, body, hand, postures, grasps);
  report(all, trials, run);
  return all;
}

}  // namespace geocage::stages
