#include "motion/approach.h"

#include <algorithm>
#include <cmath>

#include "motion/tasks/limits.h"
#include "motion/tasks/self_clearance.h"
#include "motion/tasks/state.h"
#include "motion/tasks/winding.h"

namespace geocage::motion {

using Eigen::VectorXd;

std::string_view name_of(ApproachOutcome outcome) {
  switch (outcome) {
    case ApproachOutcome::planned:
      return "planned";
    case ApproachOutcome::closing_collides:
      return "closing collides";
    case ApproachOutcome::goal_blocked:
      return "the open hand at the grasp collides";
    case ApproachOutcome::start_blocked:
      return "the start collides";
    case ApproachOutcome::no_way:
      return "every way to the grasp collides";
  }
  return "";
}

ApproachPlanner::ApproachPlanner(const Mover& mover, const Obstacles& obstacles,
                                 std::vector<std::pair<int, int>> self_pairs, const ApproachRule& rule)
    : mover_(mover),
      obstacles_(obstacles),
      pairs_(std::move(self_pairs)),
      rule_(rule),
      prover_(mover, obstacles, pairs_),
      free_tolerance_(mover.hand().tree.links.size(), rule.tolerance_m),
      closing_tolerance_(free_tolerance_),
      cut_tolerance_(free_tolerance_.size(), -rule.cut_clearance_m) {
  for (const auto& finger : mover.hand().fingers)
    for (int link : finger.links)
      closing_tolerance_[static_cast<std::size_t>(link)] = rule.closing_tolerance_m;
}

Path ApproachPlanner::proven_closing(const ApproachGoal& goal) {
  const Path& exact = goal.closing;
  if (exact.size() < 2) return exact;
  // Every posture that is a step's length of way after the one before, and the ends.
  Path thin = {exact.front()};
  double since = 0;
  const double step = length_of(exact) / rule_.closing_steps;
  for (std::size_t i = 1; i < exact.size(); ++i) {
    since += (exact[i] - exact[i - 1]).norm();
    if (i + 1 < exact.size() && since < step) continue;
    thin.push_back(exact[i]);
    since = 0;
  }
  if (prover_.frees(thin, closing_tolerance_)) return thin;
  return prover_.frees(exact, closing_tolerance_) ? exact : Path();
}

Path ApproachPlanner::way_of(const ApproachGoal& goal) const {
  const VectorXd& open = goal.closing.front();
  Path way = {goal.start};
  if (mover_.floats()) {
    // By way of the point of retreat, turned and opened like the grasp.
    VectorXd retreat = open;
    retreat.head<3>() -= rule_.retreat_m / Mover::unit_m * goal.approach_O;
    if ((goal.start - open).head<3>().norm() * Mover::unit_m > rule_.retreat_m) way.push_back(retreat);
  }
  way.push_back(open);
  return way;
}

std::optional<Path> ApproachPlanner::scripted(const ApproachGoal& goal) {
  const Path way = way_of(goal), steps = respaced(way, rule_.steps);
  if (prover_.frees(steps, free_tolerance_)) return steps;
  if (prover_.frees(way, free_tolerance_)) return way;
  return std::nullopt;
}

Path ApproachPlanner::straight_closing(const ApproachGoal& goal) {
  const VectorXd &closed = goal.closing.back(), &open = goal.closing.front();
  const hands::Hand& hand = mover_.hand();
  const VectorXd lower = mover_.lower().cwiseMin(closed), upper = mover_.upper().cwiseMax(closed);
  const VectorXd opening = (hand.closing_rad.array() * hand.closing_speed.array()).matrix();
  // What doesn't close stays where it is: it has to be free, no more.
  std::vector<double> room(free_tolerance_);
  for (const auto& finger : hand.fingers)
    for (int link : finger.links) room[static_cast<std::size_t>(link)] = -rule_.wrap_clearance_m;
  for (double step = 0.02; step < 0.5; step *= 1.3) {
    VectorXd x = closed;
    x.tail(opening.size()) -= step * opening;
    // Not beyond where the fingers came from.
    x = x.cwiseMax(lower).cwiseMin(upper).cwiseMax(open.cwiseMin(closed)).cwiseMin(open.cwiseMax(closed));
    if (!prover_.posture_free(x, room)) continue;
    const Path path = {x, closed};
    return prover_.frees(path, closing_tolerance_) ? path : Path();
  }
  return {};
}

void ApproachPlanner::box(const ApproachGoal& goal, VectorXd& lower, VectorXd& upper) const {
  lower = mover_.lower();
  upper = mover_.upper();
  const VectorXd& open = goal.closing.front();
  const int base = mover_.base_dofs();
  if (base > 0) {
    const double most = 1.5 * (goal.start - open).head<3>().norm() + 1;
    lower.head<3>().setConstant(-most);
    upper.head<3>().setConstant(most);
    lower.segment<3>(3).setConstant(-M_PI);
    upper.segment<3>(3).setConstant(M_PI);
  }
  for (const VectorXd* x : {&goal.start, &open, &goal.closing.back()}) {
    lower = lower.cwiseMin(*x);
    upper = upper.cwiseMax(*x);
  }
}

std::optional<Path> ApproachPlanner::connected(const ApproachGoal& goal, double room_m) {
  VectorXd lower, upper;
  box(goal, lower, upper);
  const auto free = [&](const VectorXd& x) { return prover_.posture_free(x, room_m); };
  const auto found = rrt_connect(goal.start, goal.closing.front(), lower, upper, free,
                                 {.iterations = rule_.rrt_iterations, .seed = rule_.seed});
  if (found.path.size() < 2 || !prover_.frees(found.path, free_tolerance_)) return std::nullopt;
  return found.path;
}

Path ApproachPlanner::improved(const Path& seed, double collision_precision, ApproachPlan& report,
                               double margin_share, int most_sweeps) {
  const int T = rule_.steps, n = mover_.dim();
  Path path = respaced(seed, T);
  Problem problem{kinematic(Eigen::MatrixXd::Identity(n, n)), T, path.front(), extra_tasks};
  problem.tasks.push_back(state_task(path.back(), final_precision(T, rule_.goal_precision)));
  problem.tasks.push_back(
      limits_task(mover_.lower(), mover_.upper(), constant_precision(T, rule_.limits_precision)));
  std::vector<double> margin;  // fades over the last quarter: the grasp itself is near the surface
  for (int t = 0; t <= T; ++t)
    margin.push_back(margin_share * rule_.margin_m * std::min(1.0, 4 * (1 - double(t) / T)));
  const auto placed = std::make_shared<Mover::Placed>();  // once for both tasks
  problem.tasks.push_back(
      clearance_task(mover_, obstacles_, margin, constant_precision(T, collision_precision), placed));
  if (!pairs_.empty() && rule_.self_margin_m > 0)
    problem.tasks.push_back(self_clearance_task(mover_, pairs_, margin_share * rule_.self_margin_m,
                                                constant_precision(T, collision_precision), placed));
  if (rule_.winding_precision > 0)
    for (Task& task : wrapping_tasks(mover_, path.front(), path.back(), T, rule_.winding_precision))
      problem.tasks.push_back(std::move(task));
  Path answer;
  if (rule_.by_messages) {
    AicoParams params{.max_sweeps = std::min(most_sweeps, rule_.max_sweeps),
                      .damping = rule_.damping,
                      .proximal = true,
                      .step_tolerance = 1e-3,
                      .cost_tolerance = rule_.cost_tolerance};
    params.mode = SweepMode::whole;
    Aico search(problem, params);
    const AicoResult& found = search.search(path);
    report.sweeps += found.sweeps;
    report.cost = found.costs.back();
    answer = found.mean;
  } else {
    GaussNewton search(problem, {.max_steps = std::min(most_sweeps, rule_.max_sweeps),
                                 .damping = rule_.damping,
                                 .cost_tolerance = rule_.cost_tolerance,
                                 .step_tolerance = 1e-3});
    const GaussNewtonResult& found = search.search(path);
    report.sweeps += found.steps;
    report.cost = found.costs.back();
    answer = found.path;
  }
  answer.back() = path.back();
  return answer;
}

bool ApproachPlanner::within_limits(const Path& path) const {
  constexpr double slack_rad = 1e-6;
  const VectorXd lower = mover_.lower(), upper = mover_.upper();
  return std::all_of(path.begin(), path.end(), [&](const VectorXd& x) {
    return ((x - upper).array() <= slack_rad).all() && ((lower - x).array() <= slack_rad).all();
  });
}

bool ApproachPlanner::improve(const Path& way, const Path& rest, const char* closing, ApproachPlan& plan) {
  Path all = way;
  if ((rest.front() - all.back()).norm() > 0) all.push_back(rest.front());
  for (double factor : {1.0, 10.0}) {
    Path smooth = improved(all, factor * rule_.collision_precision, plan);
    if (!within_limits(smooth)) continue;
    if (!prover_.frees(smooth, free_tolerance_)) continue;
    // Once on its way it may pull tight: the same with a quarter of the margins. Two sweeps bring most of it.
    Path tight = improved(smooth, factor * rule_.collision_precision, plan, 0.25, 2);
    if (within_limits(tight) && length_of(tight) < length_of(smooth) && prover_.frees(tight, free_tolerance_))
      smooth = std::move(tight);
    const std::size_t free = smooth.size();
    smooth.insert(smooth.end(), rest.begin() + 1, rest.end());
    const double length = length_of(smooth);
    if (plan.outcome == ApproachOutcome::planned && length >= plan.length) return true;
    plan.outcome = ApproachOutcome::planned;
    plan.planner = rule_.by_messages ? "aico" : "gauss_newton";
    plan.closing = closing;
    plan.path = std::move(smooth);
    plan.free = free;
    plan.length = length;
    return true;
  }
  return false;
}

void ApproachPlanner::shorten(ApproachPlan& plan) {
  Path path = plan.path;
  std::size_t free = plan.free;
  Shortcuts(prover_, {cut_tolerance_, closing_tolerance_}).shorten(path, free);
  const double length = length_of(path);
  if (length >= plan.length) return;
  const auto begin = path.begin() + static_cast<std::ptrdiff_t>(free) - 1;
  if (!prover_.frees(Path(path.begin(), begin + 1), free_tolerance_) ||
      !prover_.frees(Path(begin, path.end()), closing_tolerance_))
    return;
  plan.path = std::move(path);
  plan.free = free;
  plan.length = length;
}

ApproachPlan ApproachPlanner::plan(const ApproachGoal& goal, bool sampling) {
  ApproachPlan plan = found(goal, sampling);
  if (plan.outcome != ApproachOutcome::planned) return plan;
  shorten(plan);
  const Path free(plan.path.begin(), plan.path.begin() + static_cast<std::ptrdiff_t>(plan.free));
  plan.proof = prove_free(free);
  if (plan.proof.outcome != Proof::free) plan.proof = prover_.check(free, free_tolerance_);
  return plan;
}

ApproachPlan ApproachPlanner::found(const ApproachGoal& goal, bool sampling) {
  ApproachPlan plan;
  const Path straight = straight_closing(goal);
  if (!straight.empty()) {
    plan.seed = "script";
    plan.seed_length = length_of(way_of(goal)) + length_of(goal.closing);
    if (improve(way_of(goal), straight, "straight", plan)) return plan;
  }
  plan = {};
  const Path closing = proven_closing(goal);
  if (closing.empty() && straight.empty()) {
    plan.outcome = ApproachOutcome::closing_collides;
    plan.deepest_m = prove_closing(goal.closing).clearance_m;
    return plan;
  }
  const auto take = [&](const Path& way, const char* seed) {
    plan.seed = seed;
    if (!closing.empty()) {
      plan.outcome = ApproachOutcome::planned;
      plan.planner = seed;
      plan.closing = "replayed";
      plan.path = way;
      plan.free = way.size();
      plan.path.insert(plan.path.end(), closing.begin() + 1, closing.end());
      plan.length = plan.seed_length = length_of(plan.path);
    }
    if (!straight.empty() && improve(way, straight, "straight", plan)) return true;
    if (!closing.empty()) improve(way, closing, "replayed", plan);
    return plan.outcome == ApproachOutcome::planned;
  };
  if (const auto way = scripted(goal); way && take(*way, "script")) return plan;
  if (!sampling) return plan;
  // With room between samples first: what sampled edges promise is then proven more often.
  for (double room_m : {0.004, 0.001, -rule_.tolerance_m})
    if (const auto way = connected(goal, room_m); way && take(*way, "rrt_connect")) return plan;
  plan = {};
  plan.deepest_m = prove_free({goal.closing.front()}).clearance_m;
  if (plan.deepest_m < -rule_.tolerance_m) {
    plan.outcome = ApproachOutcome::goal_blocked;
    return plan;
  }
  const double at_start = prove_free({goal.start}).clearance_m;
  if (at_start < -rule_.tolerance_m) {
    plan.outcome = ApproachOutcome::start_blocked;
    plan.deepest_m = at_start;
  }
  return plan;
}

}  // namespace geocage::motion
