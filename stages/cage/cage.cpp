#include "stages/cage/cage.h"

#include <functional>
#include <numbers>
#include <numeric>
#include <optional>

#include "physics/cage_trial.h"
#include "physics/compliant_trial.h"
#include "physics/force_trial.h"
#include "physics/locked_hand.h"
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pipeline/each_item.h"

namespace geocage::stages {
namespace {

using physics::CageTrial;
using physics::Control;
using physics::Outcome;
using physics::Posture;

constexpr std::size_t ring_ways = 4;

physics::CageProtocol protocol_of(const CageParams& params) {
  physics::CageProtocol protocol;
  protocol.engine.damping_s = params.damping_s;
  protocol.engine.dt_s = params.step_s;
  return protocol;
}

/// One trial of a locked hand; `index` counts pulls, ring ways, or wrenches amplitude by amplitude.
struct Job {
  enum class Kind { pull, ring, wrench } kind;
  std::size_t index;
};

/// All trials of one locked hand.
struct Locked {
  physics::LockedHand hand;
  std::vector<Job> jobs = {};
  std::vector<CageTrial> pulls = {}, ring = {}, wrenches = {};
  std::vector<physics::EscapeSearch> searches = {};  ///< one a seed
  std::vector<CageTrial> compliant = {};             ///< one a pull, or none

  CageTrial& trial(const Job& job) {
    return (job.kind == Job::Kind::pull ? pulls : job.kind == Job::Kind::ring ? ring : wrenches)[job.index];
  }
};

void list_jobs(Locked& locked, const CageParams& params, bool with_ring) {
  locked.pulls.resize(physics::six_directions().size());
  locked.ring.resize(with_ring ? ring_ways : 0);
  locked.wrenches.resize(params.wrench_amplitudes.size() * params.wrench_seeds);
  for (std::size_t i = 0; i < locked.pulls.size(); ++i) locked.jobs.push_back({Job::Kind::pull, i});
  for (std::size_t i = 0; i < locked.ring.size(); ++i) locked.jobs.push_back({Job::Kind::ring, i});
  for (std::size_t i = 0; i < locked.wrenches.size(); ++i) locked.jobs.push_back({Job::Kind::wrench, i});
}

std::string ring_name(std::size_t way) {
  return fmt::format("{} deg", 360 * way / ring_ways);
}

std::string name_of(const Job& job, const CageParams& params) {
  const auto seeds = static_cast<std::size_t>(params.wrench_seeds);
  switch (job.kind) {
    case Job::Kind::pull:
      return fmt::format("pull {}", physics::six_directions()[job.index].name);
    case Job::Kind::ring:
      return fmt::format("ring {}", ring_name(job.index));
    case Job::Kind::wrench:
      break;
  }
  return fmt::format("wrench {} weights, seed {}", params.wrench_amplitudes[job.index / seeds],
                     params.seed + job.index % seeds);
}

CageTrial run_job(const Job& job, const CageParams& params, const physics::CageProtocol& protocol,
                  const physics::ObjectBody& body, const physics::LockedHand& hand,
                  physics::Recording* recording = nullptr) {
  const auto seeds = static_cast<std::size_t>(params.wrench_seeds);
  switch (job.kind) {
    case Job::Kind::pull:
      return physics::pull_trial(protocol, body, hand.escape, physics::six_directions()[job.index].axis_O,
                                 params.seed, recording);
    case Job::Kind::ring:
      return physics::ring_trial(protocol, body, hand.escape, hand.axis_O,
                                 2 * std::numbers::pi * static_cast<double>(job.index) / ring_ways,
                                 params.seed, recording);
    case Job::Kind::wrench:
      break;
  }
  return physics::wrench_trial(protocol, body, hand.escape, params.wrench_amplitudes[job.index / seeds],
                               params.seed + job.index % seeds, recording);
}

/// The trials of the first grasps once more, of the wrenches the first seed of each amplitude.
std::vector<physics::Recording> recorded(const std::vector<std::optional<Locked>>& locked,
                                         const std::vector<Posture>& postures, const hands::GraspSet& grasps,
                                         const hands::Hand& hand, const CageParams& params,
                                         const physics::ObjectBody& body) {
  std::vector<physics::Recording> recordings;
  std::vector<Job> jobs;
  int wanted = params.recorded_grasps;
  for (std::size_t i = 0; i < locked.size(); ++i) {
    if (!locked[i] || wanted-- <= 0) continue;
    for (const Job& job : locked[i]->jobs) {
      if (job.kind == Job::Kind::wrench && job.index % static_cast<std::size_t>(params.wrench_seeds) != 0)
        continue;
      jobs.push_back(job);
      physics::Recording& one = recordings.emplace_back();
      one.grasp = static_cast<int>(i), one.hand = hand.name, one.object = grasps.grasps[i].object;
      one.protocol = locked[i]->hand.protocol.name, one.trial = name_of(job, params);
      one.joints = hand.tree.dof_names;
      one.see(0, "start", geometry::Pose::Identity(), postures[i].X_OH, postures[i].q);
    }
  }
  pipeline::for_each_item(jobs.size(), [&](std::size_t k) {
    const physics::LockedHand& one = locked[recordings[k].grasp]->hand;
    recordings[k].outcome = run_job(jobs[k], params, one.protocol, body, one, &recordings[k]).outcome;
  });
  return recordings;
}

/// A sample of all trials, at half the step and with twice the iterations.
physics::SelfCheck checked(std::vector<std::optional<Locked>>& locked, const CageParams& params,
                           const physics::ObjectBody& body) {
  struct Again {
    std::size_t grasp;
    Job job;
    Outcome at_half_step, at_twice_iterations;
  };
  std::vector<Again> all, sample;
  for (std::size_t i = 0; i < locked.size(); ++i)
    if (locked[i])
      for (const Job& job : locked[i]->jobs) all.push_back({i, job, Outcome::held, Outcome::held});
  for (const std::size_t i : physics::even_sample(all.size(), params.self_check_trials))
    sample.push_back(all[i]);
  pipeline::for_each_item(sample.size(), [&](std::size_t i) {
    const physics::LockedHand& one = locked[sample[i].grasp]->hand;
    const physics::CageProtocol half = physics::at_half_step(one.protocol);
    physics::CageProtocol twice = one.protocol;
    twice.engine.iterations *= 2;
    sample[i].at_half_step = run_job(sample[i].job, params, half, body, one).outcome;
    sample[i].at_twice_iterations = run_job(sample[i].job, params, twice, body, one).outcome;
  });
  physics::SelfCheck check;
  for (const Again& again : sample)
    check.count(fmt::format("grasp {}, {}", again.grasp, name_of(again.job, params)),
                locked[again.grasp]->trial(again.job).outcome, again.at_half_step, again.at_twice_iterations);
  return check;
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
    wrench.curve = physics::survival(lives);
    wrench.survival = physics::share_at(wrench.curve, protocol.wrench_s);
    wrench.mean_held_s = physics::mean_held_s(wrench.curve, protocol.wrench_s);
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
  for (std::size_t i = 0; i < ring_ways; ++i) evaluation.ring.push_back(shown(ring_name(i), locked.ring[i]));
  for (std::size_t i = 0; i < locked.compliant.size(); ++i)
    evaluation.compliant.push_back(shown(physics::six_directions()[i].name, locked.compliant[i]));
  evaluation.backed_off_m = locked.hand.backed_off_m;
  evaluation.wrenches = wrenches_of(locked, params, protocol);
  std::vector<physics::AmplitudeShare> shares;
  for (const CageWrench& one : evaluation.wrenches)
    shares.push_back({one.amplitude, one.survival, one.trials});
  evaluation.half = physics::half_amplitude(std::move(shares));
  evaluation.search = physics::merged(locked.searches);
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
                    locked.pulls.size(), locked.wrenches.size(), evaluation.search.samples);
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

/// All that were simulated but those of `loosening`.
int trials_of(const CageEvaluations& all) {
  auto trials = 2 * static_cast<std::size_t>(all.self_check.trials) + all.recordings.size();
  for (const CageEvaluation& evaluation : all.list) {
    trials += evaluation.pulls.size() + evaluation.ring.size() + evaluation.compliant.size();
    for (const CageWrench& wrench : evaluation.wrenches) trials += static_cast<std::size_t>(wrench.trials);
  }
  for (const Control& control : all.controls) trials += static_cast<std::size_t>(control.trials);
  return static_cast<int>(trials);
}

void report(const CageEvaluations& all, int loosening_trials, pipeline::Run& run) {
  int ring = 0, retained = 0;
  for (const CageEvaluation& evaluation : all.list) {
    ring += evaluation.ring_retained() == static_cast<int>(ring_ways);
    retained += evaluation.retained();
  }
  for (const Outcome outcome : physics::outcomes)
    run.metric(std::string(physics::name(outcome)), all.count(outcome));
  run.metric("trials", trials_of(all) + loosening_trials);
  run.metric("ring_held", ring);
  run.metric("pulls_retained", retained);
  run.metric("controls_ok", all.valid());
  run.metric("self_check_trials", all.self_check.trials);
  run.metric("self_check_half_step", all.self_check.half_step);
  run.metric("self_check_twice_iterations", all.self_check.twice_iterations);
  if (all.self_check.trials > 0) run.log("self-check: " + all.self_check.text());
  for (const std::string& line : all.self_check.disagreements) run.log("self-check: " + line);
  for (const Control& one : all.controls)
    if (!one.ok())
      run.log(fmt::format("control '{}' failed ({}): this run proves nothing", one.name,
                          physics::rule_text(one.rule)));
}

/// Only grasps with a way out are bisected.
std::size_t most_bisections(std::size_t grasps, const CageParams& params) {
  return physics::six_directions().size() * std::min<std::size_t>(grasps, params.energy_grasps);
}

/// Searches for ways out with less of a rise than those found, of the first grasps.
void bisect_rises(CageEvaluations& all, const std::vector<std::optional<Locked>>& locked,
                  const CageParams& params, const geometry::SignedDistanceField& field,
                  const std::function<void(std::size_t)>& done) {
  constexpr int halvings = 4;
  struct Wanted {
    physics::EscapeSearch* search;
    const physics::EscapeTest* escape;
    std::size_t way;
  };
  std::vector<Wanted> wanted;
  int grasps = params.energy_grasps;
  for (CageEvaluation& one : all.list) {
    if (one.search.found == 0 || grasps-- <= 0) continue;
    one.search.unfound_rise_m.resize(one.search.rise_m.size());
    for (std::size_t way = 0; way < one.search.rise_m.size(); ++way)
      wanted.push_back({&one.search, &locked[one.grasp]->hand.escape, way});
  }
  done(most_bisections(all.list.size(), params) - wanted.size());  // those that nothing asks for
  pipeline::for_each_item(wanted.size(), [&](std::size_t i) {
    const auto& [search, escape, way] = wanted[i];
    const physics::RiseBound bound = physics::lower_rise(
        field, *escape, {.samples = params.search_samples}, params.seed, params.search_seeds,
        physics::six_directions()[way].axis_O, search->rise_m[way], halvings);
    search->rise_m[way] = bound.rise_m;
    search->unfound_rise_m[way] = bound.unfound_m;
#pragma omp critical
    done(1);
  });
}

}  // namespace

void CageParams::visit(pipeline::Fields& f) {
  f("object_geometry", object_geometry, {"truth", "reconstruction", "given"},
    "which geometry of the object is simulated; kept with the results");
  f("wrench_amplitudes", wrench_amplitudes, {0, 100}, "of the random wrenches, in weights of the object");
  f("wrench_seeds", wrench_seeds, {1, 1e5},
    "random wrench trials an amplitude; the default looks, 100 screen, 1000 are for tables");
  f("search_samples", search_samples, {0, 1e7},
    "random poses of a search for a way out, of each seed; 0: no search");
  f("search_seeds", search_seeds, {1, 1e3}, "searches for a way out");
  f("damping_s", damping_s, {0, 1e3}, "velocities shrink by exp(-t / damping_s); 0: they do not");
  f("step_s", step_s, {1e-5, 0.01}, "longest time step");
  f("control_grasps", control_grasps, {1, 1e6},
    "grasps repeated with the hand 1 m away, with open fingers, and with random ones");
  f("compliant_grasps", compliant_grasps, {0, 1e6},
    "first grasps pulled once more with motors that give way in place of locked fingers");
  f("self_check_trials", self_check_trials, {0, 1e6},
    "trials repeated at half the step and with twice the iterations");
  f("recorded_grasps", recorded_grasps, {0, 1e6}, "first grasps whose trials are kept for playback");
  f("margin_grasps", margin_grasps, {0, 1e6},
    "first grasps of which each finger is opened until the object gets out");
  f("energy_grasps", energy_grasps, {0, 1e6},
    "first grasps with a way out for which the least rise is bisected, against each of six gravities");
  f("seed", seed, "of wrenches and search");
}

CageEvaluations cage(const CageParams& params, pipeline::Run& run, const hands::GraspSet& grasps,
                     const geometry::TriangleMesh& object, const geometry::SignedDistanceField& field,
                     const hands::Hand& hand) {
  const physics::CageProtocol protocol = protocol_of(params);
  physics::check_border(object, field, hand);
  const auto body = physics::solid_body(object, field, protocol.mass_kg);
  const double radius_m = physics::radius_about_m(object, body.X_OB.translation());
  const auto lock = [&](const Posture& posture) {
    return Locked{physics::lock(protocol, body, radius_m, hand, posture.X_OH, posture.q)};
  };

  CageEvaluations all{params, {}, {}, {}, {}};
  const std::vector<Posture> postures =
      hand.net ? std::vector<Posture>{} : physics::postures_of(grasps, hand, field);
  std::vector<std::optional<Locked>> locked(postures.size());
  std::vector<std::function<void()>> work;
  const auto add = [&](Locked& one, bool everything) {
    list_jobs(one, params, everything);
    for (const Job& job : one.jobs)
      work.push_back([&, job] { one.trial(job) = run_job(job, params, one.hand.protocol, body, one.hand); });
    one.searches.resize(everything && params.search_samples > 0 ? params.search_seeds : 0);
    for (std::size_t i = 0; i < one.searches.size(); ++i)
      work.push_back([&, i] {
        const physics::EscapeSearchRule rule{.samples = params.search_samples};
        one.searches[i] = physics::search_escape(field, one.hand.escape, rule, params.seed + i);
      });
  };
  int compliant = params.compliant_grasps;
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
    if (compliant-- <= 0) continue;
    locked[i]->compliant.resize(physics::six_directions().size());
    for (std::size_t way = 0; way < locked[i]->compliant.size(); ++way)
      work.push_back([&, i, way] {
        locked[i]->compliant[way] = physics::compliant_pull(
            protocol, body, radius_m, hand, postures[i], physics::six_directions()[way].axis_O, params.seed);
      });
  }
  const std::size_t controls = std::min<std::size_t>(postures.size(), params.control_grasps);
  std::vector<Locked> far, open, random;
  for (std::size_t i = 0; i < controls; ++i) {
    far.push_back(lock(physics::far_posture(hand, postures[i])));
    open.push_back(lock(physics::open_posture(hand, field, grasps.grasps[i])));
    random.push_back(lock(physics::random_posture(hand, field, postures[i], params.seed, i)));
  }
  for (auto* hands : {&far, &open, &random})
    for (Locked& one : *hands) add(one, false);

  std::vector<std::vector<physics::Loosening>> loosened(postures.size());
  std::vector<int> loosening_trials(postures.size());
  for (std::size_t i = 0, wanted = params.margin_grasps; i < postures.size() && wanted > 0; ++i) {
    if (!locked[i]) continue;
    --wanted;
    work.push_back([&, i] {
      constexpr int halvings = 4;
      const Posture opened = physics::open_posture(hand, field, grasps.grasps[i]);
      loosened[i] = physics::loosening(protocol, body, radius_m, hand, postures[i].X_OH, postures[i].q,
                                       opened.q, halvings, params.seed, &loosening_trials[i]);
    });
  }

  const std::size_t total = work.size() + most_bisections(postures.size(), params);
  std::size_t so_far = 0;
  const auto done = [&](std::size_t n) {
    if (n > 0) run.progress(so_far += n, total);
  };
  pipeline::for_each_item(work.size(), [&](std::size_t i) {
    work[i]();
#pragma omp critical
    done(1);
  });

  for (CageEvaluation& evaluation : all.list)
    if (locked[evaluation.grasp]) {
      judge(evaluation, *locked[evaluation.grasp], params, protocol);
      evaluation.loosening = std::move(loosened[evaluation.grasp]);
    }
  bisect_rises(all, locked, params, field, done);
  all.self_check = checked(locked, params, body);
  all.recordings = recorded(locked, postures, grasps, hand, params, body);
  std::vector<Locked*> fars, opens, randoms;
  for (Locked& one : far) fars.push_back(&one);
  for (Locked& one : open) opens.push_back(&one);
  for (Locked& one : random) randoms.push_back(&one);
  all.controls = physics::known_cages(protocol, params.wrench_seeds);
  all.controls.push_back(
      control("hand 1 m away, pulls", Control::Rule::no_trial_holds, fars, TrialKind::pull));
  all.controls.push_back(
      control("hand 1 m away, wrenches", Control::Rule::no_trial_holds, fars, TrialKind::wrench));
  all.controls.push_back(control("open hand, pulls", Control::Rule::no_grasp_passes, opens, TrialKind::pull));
  all.controls.push_back(
      control("open hand, wrenches", Control::Rule::no_trial_holds, opens, TrialKind::wrench));
  all.controls.push_back(control("random fingers, pulls", Control::Rule::reported, randoms, TrialKind::pull));
  all.controls.push_back(
      control("random fingers, wrenches", Control::Rule::reported, randoms, TrialKind::wrench));
  report(all, std::accumulate(loosening_trials.begin(), loosening_trials.end(), 0), run);
  return all;
}

}  // namespace geocage::stages
