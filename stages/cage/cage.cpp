#include "stages/cage/cage.h"

#include <functional>
#include <limits>
#include <numbers>
#include <optional>

#include "physics/cage_trial.h"
#include "physics/force_trial.h"
#include "physics/survival.h"
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace geocage::stages {
namespace {

using physics::CageTrial;
using physics::Control;
using physics::Outcome;
using physics::Posture;

constexpr int ring_ways = 4;

physics::CageProtocol protocol_of(const CageParams& params) {
  physics::CageProtocol protocol;
  protocol.engine.damping_s = params.damping_s;
  protocol.engine.dt_s = params.step_s;
  return protocol;
}

/// Half of the thinnest finger: deeper, its axis comes near the surface, and the field's normal may turn.
double most_growth_m(const hands::Hand& hand) {
  double thinnest = std::numeric_limits<double>::infinity();
  for (const hands::Capsule& capsule : hand.capsules) thinnest = std::min(thinnest, capsule.radius_m);
  return thinnest / 2;
}

/// All trials of one locked hand.
struct Locked {
  physics::CageProtocol protocol;
  physics::EscapeTest escape;
  geometry::Vec3 axis_O;
  std::vector<CageTrial> pulls, ring, wrenches;  ///< wrenches: amplitude by amplitude
  physics::EscapeSearch search;
};

std::vector<std::function<void()>> work_of(Locked& locked, const CageParams& params,
                                           const physics::ObjectBody& body, bool everything) {
  std::vector<std::function<void()>> work;
  const auto seed = params.seed;
  locked.pulls.resize(physics::six_directions().size());
  for (std::size_t i = 0; i < locked.pulls.size(); ++i)
    work.push_back([&, i, seed] {
      const auto& way = physics::six_directions()[i].axis_O;
      locked.pulls[i] = physics::pull_trial(locked.protocol, body, locked.escape, way, seed);
    });
  locked.wrenches.resize(params.wrench_amplitudes.size() * params.wrench_seeds);
  for (std::size_t i = 0; i < locked.wrenches.size(); ++i)
    work.push_back([&, i, seed] {
      const auto n = static_cast<std::size_t>(params.wrench_seeds);
      locked.wrenches[i] = physics::wrench_trial(locked.protocol, body, locked.escape,
                                                 params.wrench_amplitudes[i / n], seed + i % n);
    });
  if (!everything) return work;
  locked.ring.resize(ring_ways);
  for (int i = 0; i < ring_ways; ++i)
    work.push_back([&, i, seed] {
      locked.ring[i] = physics::ring_trial(locked.protocol, body, locked.escape, locked.axis_O,
                                           2 * std::numbers::pi * i / ring_ways, seed);
    });
  if (params.search_samples > 0)
    work.push_back([&, seed] {
      const physics::EscapeSearchRule rule{.samples = params.search_samples};
      locked.search = physics::search_escape(*body.field, locked.escape, rule, seed);
    });
  return work;
}

CagePull shown(const std::string& label, const CageTrial& trial) {
  return {label, trial.outcome, trial.max_displacement_m, trial.max_rotation_rad, trial.ended_s};
}

std::vector<CageWrench> wrenches_of(const Locked& locked, const CageParams& params,
                                    const physics::CageProtocol& protocol) {
  std::vector<CageWrench> all;
  for (std::size_t a = 0; a < params.wrench_amplitudes.size(); ++a) {
    CageWrench& wrench = all.emplace_back();
    wrench.amplitude = params.wrench_amplitudes[a];
    std::vector<physics::Life> lives;
    for (int s = 0; s < params.wrench_seeds; ++s) {
      const CageTrial& trial = locked.wrenches[a * params.wrench_seeds + s];
      ++wrench.trials;
      wrench.lost += trial.outcome == Outcome::lost;
      wrench.errors += trial.outcome == Outcome::error;
      lives.push_back({trial.ended_s, trial.outcome == Outcome::lost});
    }
    const auto curve = physics::survival(lives);
    wrench.survival = physics::share_at(curve, protocol.wrench_s);
    wrench.mean_held_s = physics::mean_held_s(curve, protocol.wrench_s);
  }
  return all;
}

/// What got the object out, or broke; empty when nothing did.
std::vector<std::string> ways_out(const CageEvaluation& evaluation) {
  std::vector<std::string> ways;
  for (const CagePull& pull : evaluation.pulls)
    if (pull.outcome == Outcome::lost) ways.push_back(fmt::format("gravity along {}", pull.name));
  for (const CageWrench& wrench : evaluation.wrenches)
    if (wrench.lost > 0)
      ways.push_back(fmt::format("{} of {} random wrenches of {} weights", wrench.lost, wrench.trials,
                                 wrench.amplitude));
  if (evaluation.search.result == physics::EscapeSearch::Result::found)
    ways.push_back(fmt::format("a path of {:.0f} mm", 1e3 * evaluation.search.path_m));
  return ways;
}

void judge(CageEvaluation& evaluation, const Locked& locked, const CageParams& params,
           const physics::CageProtocol& protocol) {
  for (std::size_t i = 0; i < locked.pulls.size(); ++i)
    evaluation.pulls.push_back(shown(physics::six_directions()[i].name, locked.pulls[i]));
  for (int i = 0; i < ring_ways; ++i)
    evaluation.ring.push_back(shown(fmt::format("{:.0f} deg", 360.0 * i / ring_ways), locked.ring[i]));
  evaluation.wrenches = wrenches_of(locked, params, protocol);
  evaluation.search = locked.search;
  int errors = 0;
  for (const auto* trials : {&locked.pulls, &locked.ring, &locked.wrenches})
    for (const CageTrial& trial : *trials) {
      evaluation.max_penetration_m = std::max(evaluation.max_penetration_m, trial.penetration_m);
      errors += trial.outcome == Outcome::error;
    }
  const auto ways = ways_out(evaluation);
  evaluation.outcome = !ways.empty() ? Outcome::lost : errors > 0 ? Outcome::error : Outcome::held;
  if (!ways.empty())
    evaluation.reason = fmt::format("it gets out: {}", fmt::join(ways, ", "));
  else if (errors > 0)
    evaluation.reason =
        fmt::format("{} trials failed: NaN, more than {:.0f} m/s, or a contact {:.1f} mm deep", errors,
                    protocol.max_speed_m_s, 1e3 * evaluation.max_penetration_m);
  else
    evaluation.reason =
        fmt::format("no way out was found: {} pulls, {} random wrenches, {} samples of a search; no proof",
                    locked.pulls.size(), locked.wrenches.size(), locked.search.samples);
}

enum class TrialKind { pull, wrench };

Control control(const char* label, Control::Rule rule, const std::vector<Locked*>& hands, TrialKind kind) {
  Control control{label, rule};
  for (const Locked* locked : hands) {
    const auto& trials = kind == TrialKind::pull ? locked->pulls : locked->wrenches;
    const auto held = std::ranges::count(trials, Outcome::held, &CageTrial::outcome);
    ++control.grasps;
    control.trials += static_cast<int>(trials.size());
    control.held += static_cast<int>(held);
    control.passed += held == static_cast<long>(trials.size());
  }
  return control;
}

void report(const CageEvaluations& all, pipeline::Run& run) {
  int ring = 0, retained = 0;
  for (const CageEvaluation& evaluation : all.list) {
    ring += evaluation.ring_retained() == ring_ways;
    retained += evaluation.retained();
  }
  for (const Outcome outcome : physics::outcomes)
    run.metric(std::string(physics::name(outcome)), all.count(outcome));
  run.metric("ring_held", ring);
  run.metric("pulls_retained", retained);
  run.metric("controls_ok", all.valid());
  for (const Control& one : all.controls)
    if (!one.ok())
      run.log(fmt::format("control '{}' failed ({}): this run proves nothing", one.name,
                          physics::rule_text(one.rule)));
}

}  // namespace

void CageParams::visit(pipeline::Fields& f) {
  f("object_geometry", object_geometry, {"truth", "reconstruction", "given"},
    "which geometry of the object is simulated; kept with the results");
  f("wrench_amplitudes", wrench_amplitudes, {0, 100}, "of the random wrenches, in weights of the object");
  f("wrench_seeds", wrench_seeds, {1, 1e5},
    "random wrench trials an amplitude; 100 to screen, 1000 for tables");
  f("search_samples", search_samples, {0, 1e7}, "random poses of the search for a way out; 0: no search");
  f("damping_s", damping_s, {0, 1e3}, "velocities shrink by exp(-t / damping_s); 0: they do not");
  f("step_s", step_s, {1e-5, 0.01}, "longest time step");
  f("control_grasps", control_grasps, {1, 1e6},
    "grasps repeated with open fingers and with the hand 1 m away");
  f("seed", seed, "of wrenches and search");
}

CageEvaluations cage(const CageParams& params, pipeline::Run& run, const hands::GraspSet& grasps,
                     const geometry::TriangleMesh& object, const geometry::SignedDistanceField& field,
                     const hands::Hand& hand) {
  const physics::CageProtocol protocol = protocol_of(params);
  physics::check_border(object, field, hand);
  const auto body = physics::solid_body(object, field, protocol.mass_kg);
  const double radius_m = physics::radius_about_m(object, body.X_OB.translation());
  const double growth_m = most_growth_m(hand);
  const auto lock = [&](const Posture& posture) {
    physics::CageProtocol own = protocol;
    own.max_penetration_m = posture.penetration_m + growth_m;
    return Locked{own,
                  {body, radius_m, hands::placed_capsules(hand, posture.X_OH, posture.q)},
                  posture.X_OH.linear() * hand.flexion_axis_H};
  };

  CageEvaluations all{params, {}, {}};
  const std::vector<Posture> postures =
      hand.net ? std::vector<Posture>{} : physics::postures_of(grasps, hand, field);
  std::vector<std::optional<Locked>> locked(postures.size());
  std::vector<std::function<void()>> work;
  const auto add = [&](Locked& one, bool everything) {
    for (auto& job : work_of(one, params, body, everything)) work.push_back(std::move(job));
  };
  for (std::size_t i = 0; i < postures.size(); ++i) {
    CageEvaluation& evaluation = all.list.emplace_back();
    evaluation.grasp = static_cast<int>(i);
    evaluation.start_penetration_m = postures[i].penetration_m;
    if (postures[i].penetration_m > protocol.max_start_penetration_m) {
      evaluation.outcome = Outcome::rejected;
      evaluation.reason =
          fmt::format("the hand starts {:.1f} mm inside the object (limit {:.0f} mm)",
                      1e3 * postures[i].penetration_m, 1e3 * protocol.max_start_penetration_m);
      continue;
    }
    locked[i].emplace(lock(postures[i]));
    add(*locked[i], true);
  }
  const std::size_t controls = std::min<std::size_t>(postures.size(), params.control_grasps);
  std::vector<Locked> far, open;
  for (std::size_t i = 0; i < controls; ++i) {
    far.push_back(lock(physics::far_posture(hand, postures[i])));
    open.push_back(lock(physics::open_posture(hand, field, grasps.grasps[i])));
  }
  for (auto* hands : {&far, &open})
    for (Locked& one : *hands) add(one, false);

  std::size_t done = 0;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < work.size(); ++i) {
    work[i]();
#pragma omp critical
    run.progress(++done, work.size());
  }

  for (CageEvaluation& evaluation : all.list)
    if (locked[evaluation.grasp]) judge(evaluation, *locked[evaluation.grasp], params, protocol);
  std::vector<Locked*> fars, opens;
  for (Locked& one : far) fars.push_back(&one);
  for (Locked& one : open) opens.push_back(&one);
  all.controls = physics::known_cages(protocol);
  all.controls.push_back(
      control("hand 1 m away, pulls", Control::Rule::no_trial_holds, fars, TrialKind::pull));
  all.controls.push_back(
      control("hand 1 m away, wrenches", Control::Rule::no_trial_holds, fars, TrialKind::wrench));
  all.controls.push_back(control("open hand, pulls", Control::Rule::no_grasp_passes, opens, TrialKind::pull));
  all.controls.push_back(
      control("open hand, wrenches", Control::Rule::no_trial_holds, opens, TrialKind::wrench));
  report(all, run);
  return all;
}

}  // namespace geocage::stages
