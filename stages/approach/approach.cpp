#include "stages/approach/approach.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "geometry/median.h"
#include "hands/arm.h"
#include "hands/closing.h"
#include "motion/approach.h"
#include "motion/duration.h"
#include "motion/reach.h"
#include "motion/tasks/self_clearance.h"
#include "motion/tasks/state.h"
#include "motion/timing.h"
#include "pipeline/each_item.h"

namespace geocage::stages {

using Eigen::VectorXd;
using geometry::Pose;
using geometry::Vec3;
using motion::Mover;
using motion::Path;

void ApproachParams::visit(pipeline::Fields& f) {
  f("start_m", start_m, {0.01, 10}, "the hand starts this far from the grasp");
  f("retreat_m", retreat_m, {0, 10}, "from here on the scripted path is straight along the approach");
  f("steps", steps, {4, 1000}, "steps of the free part of the way");
  f("closing_steps", closing_steps, {1, 1000}, "steps of closing, about");
  f("margin_m", margin_m, {0, 0.1}, "the smoothed path is pushed off surfaces nearer than this");
  f("self_margin_m", self_margin_m, {0, 0.1}, "links are pushed off each other when nearer than this");
  f("collision_precision", collision_precision, {0, 1e6}, "weight of that push; high ones freeze the path");
  f("goal_precision", goal_precision, {0, 1e9}, "weight of the end");
  f("limits_precision", limits_precision, {0, 1e9}, "weight of joint limits");
  f("winding_precision", winding_precision, {0, 1e6},
    "weight of fingers' winding numbers: they wrap as they come; 0: none");
  f("tolerance_m", tolerance_m, {0, 0.01},
    "what may be left unproven: an open hand is nowhere deeper than this");
  f("closing_tolerance_m", closing_tolerance_m, {0, 0.05}, "fingers may touch so deep while they close");
  f("wrap_clearance_m", wrap_clearance_m, {0, 0.1},
    "fingers close on the way as far as they keep this distance");
  f("cut_clearance_m", cut_clearance_m, {0, 0.1},
    "straight pieces replace waypoints where they keep this distance");
  f("search", search, {"gauss_newton", "aico"}, "who smooths: block Gauss-Newton or AICO, on the same cost");
  f("base_speed_m_s", base_speed_m_s, {1e-3, 10}, "speed of the floating hand's base at most");
  f("base_turn_rad_s", base_turn_rad_s, {1e-3, 100}, "turning speed of the base at most");
  f("base_acceleration_m_s2", base_acceleration_m_s2, {1e-3, 1000}, "acceleration of the base at most");
  f("joint_acceleration_rad_s2", joint_acceleration_rad_s2, {1e-3, 1e4}, "acceleration of joints at most");
  f("effort_variance", effort_variance, {1e-6, 1e9},
    "1 / cost rate of accelerations: the likely duration is as long as they are dear");
  f("damping", damping, {0, 1e8}, "damping of the search at the start");
  f("max_sweeps", max_sweeps, {1, 10000}, "sweeps or steps of a search at most");
  f("rrt_iterations", rrt_iterations, {1, 1000000}, "of RRT-Connect, where scripted ways collide");
  f("ways", ways, {1, 14}, "starts that are tried: back along the approach, then tilted ones");
  f("candidates", candidates, {1, 14}, "scripted ways that are planned to the end; the shortest is kept");
  f("arm", arm, {"none", "kuka_lwr4"}, "what carries the hand; none: it floats");
  f("arm_distance_m", arm_distance_m, {0.1, 5},
    "of the arm's base from the object's middle, along the ground")
      .only_with("arm", {"kuka_lwr4"});
  f("arm_below_m", arm_below_m, {-2, 2}, "how far the arm's base stands below the object's middle")
      .only_with("arm", {"kuka_lwr4"});
  f("arm_placements", arm_placements, {1, 64}, "places around the object that are tried")
      .only_with("arm", {"kuka_lwr4"});
}

namespace {

motion::ApproachRule rule_of(const ApproachParams& p) {
  motion::ApproachRule rule;
  rule.steps = p.steps;
  rule.closing_steps = p.closing_steps;
  rule.retreat_m = p.retreat_m;
  rule.margin_m = p.margin_m;
  rule.self_margin_m = p.self_margin_m;
  rule.collision_precision = p.collision_precision;
  rule.goal_precision = p.goal_precision;
  rule.limits_precision = p.limits_precision;
  rule.winding_precision = p.winding_precision;
  rule.damping = p.damping;
  rule.max_sweeps = p.max_sweeps;
  rule.by_messages = p.search == "aico";
  rule.tolerance_m = p.tolerance_m;
  rule.closing_tolerance_m = p.closing_tolerance_m;
  rule.wrap_clearance_m = p.wrap_clearance_m;
  rule.cut_clearance_m = p.cut_clearance_m;
  rule.rrt_iterations = p.rrt_iterations;
  return rule;
}

/// What all ways keep away from.
struct Scene {
  const geometry::SignedDistanceField& field;
  motion::Obstacles obstacles;
  Vec3 middle_O = Vec3::Zero(), up_O = Vec3::UnitZ();

  Scene(const geometry::SignedDistanceField& object, const geometry::PointCloud& cloud,
        const geometry::SignedDistanceField& others)
      : field(object) {
    obstacles.fields.push_back({&field});
    if (!others.coarse.empty()) obstacles.fields.push_back(motion::map_obstacle(others));
    obstacles.support = cloud.support;
    if (cloud.support) up_O = cloud.support->normal;
    middle_O =
        field.origin + field.cell_m / 2 * Vec3(field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1);
  }
};

/// Plans one grasp with a body that floats or stands.
class GraspPlanner {
 public:
  GraspPlanner(const ApproachParams& params, const Scene& scene, const hands::Hand& hand,
               const hands::ArmedHand* armed, const Pose& X_OB, const hands::Grasp& grasp)
      : params_(params),
        scene_(scene),
        hand_(hand),
        armed_(armed),
        goal_(grasp.X_OH),
        open_(hands::joint_vector(hand.tree, grasp.pregrasp_joints_rad, "pre-grasp")),
        closed_(hands::joint_vector(hand.tree, grasp.joints_rad, "grasp")),
        mover_(armed ? Mover::standing(armed->body, X_OB) : Mover::floating(hand, grasp.X_OH)),
        pairs_(pairs_of()),
        planner_(mover_, scene.obstacles, pairs_, rule_of(params)) {}

  motion::Trajectory plan() {
    motion::ApproachGoal goal;
    goal.approach_O = goal_.linear() * hand_.approach_H;
    VectorXd at_grasp;  // the arm there
    if (armed_) {
      const auto found = motion::reach(mover_, *armed_, planner_.prover(), scene_.obstacles, goal_, open_);
      if (found.outcome != motion::Reach::reached) return out_of_reach(found);
      at_grasp = found.x.head(armed_->arm_dofs);
    }
    goal.closing = closing(at_grasp);
    std::optional<motion::ApproachPlan> best;
    motion::ApproachPlan last;
    const auto list = starts(at_grasp);
    // Scripted ways in first; where all collide, sampled ones. The shortest of the first few that are proven
    // is kept.
    for (bool sampling : {false, true}) {
      int proven = 0;
      for (const VectorXd& start : list) {
        goal.start = start;
        last = planner_.plan(goal, sampling);
        const bool hopeless = last.outcome == motion::ApproachOutcome::closing_collides ||
                              last.outcome == motion::ApproachOutcome::goal_blocked;
        if (hopeless) return none(last);  // no start mends that
        if (last.outcome != motion::ApproachOutcome::planned) continue;
        if (!best || last.length < best->length) best = last;
        if (++proven == (sampling ? 1 : params_.candidates)) break;
      }
      if (best) break;
    }
    if (!best) return none(last);
    return answer(*best);
  }

 private:
  std::vector<std::pair<int, int>> pairs_of() const {
    // Postures of the grasp may touch: only what is apart in the open hand and stays apart in the closed one
    // is asked.
    if (!armed_) return motion::self_pairs(hand_, open_);
    VectorXd q = armed_->body.open_rad;
    q.tail(open_.size()) = open_;
    return motion::self_pairs(armed_->body, q);
  }

  VectorXd state(const VectorXd& at_grasp, const VectorXd& q) const {
    if (!armed_) return mover_.state(goal_, q);
    VectorXd x(mover_.dim());
    x << at_grasp, q;
    return x;
  }

  /// Every posture of close_hand, and the grasp's own at the end.
  Path closing(const VectorXd& at_grasp) const {
    std::vector<VectorXd> postures;
    hands::close_hand(hand_, scene_.field, goal_, open_, {}, &postures);
    postures.push_back(closed_);
    Path path = {state(at_grasp, open_)};
    for (const VectorXd& q : postures) {
      const VectorXd x = state(at_grasp, q);
      if ((x - path.back()).norm() > 0) path.push_back(x);
    }
    return path;
  }

  /// Floating: back along the approach, tilted by 20 and 40 degrees in six directions each, then up. Arm: its
  /// rest, then the hand drawn back.
  std::vector<VectorXd> starts(const VectorXd& at_grasp) {
    const Vec3 back = -(goal_.linear() * hand_.approach_H);
    const Eigen::Matrix3d frame = geometry::frame_from_z(back);
    std::vector<Vec3> ways = {back};
    for (double tilt : {0.35, 0.7})
      for (int k = 0; k < 6; ++k)
        ways.push_back(frame * Vec3(std::sin(tilt) * std::cos(k * M_PI / 3),
                                    std::sin(tilt) * std::sin(k * M_PI / 3), std::cos(tilt)));
    ways.push_back(scene_.up_O);
    ways.resize(std::min(ways.size(), static_cast<std::size_t>(params_.ways)));
    std::vector<VectorXd> list;
    if (armed_) {
      VectorXd rest = armed_->body.open_rad;
      rest.tail(open_.size()) = open_;
      list.push_back(rest);
    }
    for (const Vec3& way : ways) {
      Pose X_OH = goal_;
      X_OH.translation() += params_.start_m * way;
      if (!armed_) {
        list.push_back(mover_.state(X_OH, open_));
        continue;
      }
      if (list.size() > 3) break;
      VectorXd near = at_grasp;
      const auto found = motion::reach(mover_, *armed_, planner_.prover(), scene_.obstacles, X_OH, open_,
                                       {.tries = 2}, &near);
      if (found.outcome == motion::Reach::reached) list.push_back(found.x);
    }
    return list;
  }

  motion::MotionLimits limits() const {
    const int n = mover_.dim(), joints = mover_.hand().tree.dofs();
    motion::MotionLimits limits{VectorXd(n), VectorXd::Constant(n, params_.joint_acceleration_rad_s2)};
    limits.speed.tail(joints) = mover_.hand().tree.velocity_limit_rad_s;
    if (!mover_.floats()) return limits;
    limits.speed.head<3>().setConstant(params_.base_speed_m_s / Mover::unit_m / std::sqrt(3.0));
    limits.speed.segment<3>(3).setConstant(params_.base_turn_rad_s / std::sqrt(3.0));
    limits.acceleration.head<3>().setConstant(params_.base_acceleration_m_s2 / Mover::unit_m /
                                              std::sqrt(3.0));
    return limits;
  }

  /// The duration that makes this end likely from rest to rest with accelerations as dear as
  /// `effort_variance` says (thesis 4.2.3).
  double likely_duration_s(const VectorXd& first, const VectorXd& last) const {
    // All coordinates are alike, so the likelihood is that of one of them that goes the root mean square of
    // all ways.
    const Eigen::Vector2d x_0 = Eigen::Vector2d::Zero(),
                          x_T((last - first).norm() / std::sqrt(static_cast<double>(first.size())), 0);
    const motion::IntegratorRates rates{Eigen::MatrixXd::Constant(1, 1, params_.effort_variance),
                                        VectorXd::Zero(1)};
    const auto prior = [&](double D) { return motion::integrator_prior(x_0, rates, 50, D); };
    return motion::estimate_duration(prior, {motion::state_task(x_T, {0, 1e4})}, 1, x_T, {.precision = 1e-3})
        .duration_s;
  }

  motion::Trajectory answer(const motion::ApproachPlan& plan) {
    Path path = plan.path;
    std::size_t free = plan.free;
    double clearance_m = plan.proof.clearance_m;
    double dt = motion::shortest_step_s(path, limits());
    // Waypoints where the time goes; kept if that is shorter and proven as well.
    const auto even = motion::evened_in_time(path, limits());
    if (const double even_dt = motion::shortest_step_s(even.path, limits()); even_dt < dt) {
      std::size_t last = 0;  // waypoint of the free part
      while (last + 1 < even.place.size() && even.place[last + 1] <= static_cast<double>(free) - 1) ++last;
      const auto cut = even.path.begin() + static_cast<std::ptrdiff_t>(last);
      const auto proof = planner_.prove_free(Path(even.path.begin(), cut + 1));
      if (proof.outcome == motion::Proof::free &&
          planner_.prove_closing(Path(cut, even.path.end())).outcome == motion::Proof::free) {
        path = even.path;
        free = last + 1;
        clearance_m = proof.clearance_m;
        dt = even_dt;
      }
    }
    motion::Trajectory t;
    t.likely_duration_s = likely_duration_s(path.front(), path.back());
    dt = std::max(dt, t.likely_duration_s / static_cast<double>(path.size() - 1));
    t.joints = mover_.hand().tree.dof_names;
    t.dt_s = dt;
    Mover::Placed placed;
    for (const VectorXd& x : path) {
      const VectorXd q = mover_.joints(x);
      t.q_rad.emplace_back(q.data(), q.data() + q.size());
      mover_.place(x, placed);
      t.X_OH.push_back(
          hands::file_pose(placed.X_OL[armed_ ? static_cast<std::size_t>(armed_->hand_link) : 0]));
    }
    if (!armed_) t.X_OH.back() = hands::file_pose(goal_);
    t.efficiency = motion::efficiency_of(path, dt);
    t.efficiency.cost = plan.cost;
    t.free_steps = static_cast<int>(free);
    t.min_clearance_m = clearance_m;
    t.self_clearance_m = plan.proof.self_clearance_m;
    t.certified = true;
    t.outcome = "planned";
    t.planner = plan.planner;
    t.seed = plan.seed;
    if (armed_) {
      t.arm = params_.arm;
      t.X_OB = hands::file_pose(mover_.pose(path.front()));
    }
    return t;
  }

  motion::Trajectory none(const motion::ApproachPlan& plan) const {
    motion::Trajectory t;
    t.joints = mover_.hand().tree.dof_names;
    t.outcome = fmt::format("no path: {}; the best is {:.1f} mm deep", name_of(plan.outcome),
                            -1e3 * std::min(0.0, plan.deepest_m));
    return t;
  }

  motion::Trajectory out_of_reach(const motion::ReachAnswer& found) const {
    motion::Trajectory t;
    t.joints = mover_.hand().tree.dof_names;
    t.outcome = found.outcome == motion::Reach::blocked
                    ? "no path: every posture of the arm that reaches the grasp collides"
                    : fmt::format("no path: out of the arm's reach by {:.1f} mm and {:.1f} degrees",
                                  1e3 * found.miss_m, found.miss_rad * 180 / M_PI);
    return t;
  }

  const ApproachParams& params_;
  const Scene& scene_;
  const hands::Hand& hand_;
  const hands::ArmedHand* armed_;
  const Pose goal_;
  const VectorXd open_, closed_;
  const Mover mover_;
  const std::vector<std::pair<int, int>> pairs_;
  motion::ApproachPlanner planner_;
};

/// Where the arm stands: its z up, its x towards the object.
Pose placement(const ApproachParams& params, const Scene& scene, int k) {
  const Eigen::Matrix3d ground = geometry::frame_from_z(scene.up_O);
  const double angle = 2 * M_PI * k / params.arm_placements;
  const Vec3 away = ground * Vec3(std::cos(angle), std::sin(angle), 0);
  Pose X_OB = Pose::Identity();
  X_OB.linear() << -away, scene.up_O.cross(-away), scene.up_O;
  X_OB.translation() = scene.middle_O + params.arm_distance_m * away - params.arm_below_m * scene.up_O;
  return X_OB;
}

/// The placement that reaches most grasps; the first of equals. `reached[k]` are all counts.
Pose best_placement(const ApproachParams& params, const Scene& scene, const hands::ArmedHand& armed,
                    const hands::Hand& hand, const hands::GraspSet& grasps, std::vector<int>& reached) {
  reached.assign(static_cast<std::size_t>(params.arm_placements), 0);
#pragma omp parallel for schedule(dynamic, 1)
  for (int k = 0; k < params.arm_placements; ++k) {
    const Mover mover = Mover::standing(armed.body, placement(params, scene, k));
    motion::Prover prover(mover, scene.obstacles);
    for (const auto& grasp : grasps.grasps) {
      if (!grasp.points_O.empty()) continue;
      const VectorXd open = hands::joint_vector(hand.tree, grasp.pregrasp_joints_rad, "pre-grasp");
      reached[static_cast<std::size_t>(k)] +=
          motion::reach(mover, armed, prover, scene.obstacles, grasp.X_OH, open, {.tries = 4}).outcome ==
          motion::Reach::reached;
    }
  }
  const auto best = std::max_element(reached.begin(), reached.end()) - reached.begin();
  return placement(params, scene, static_cast<int>(best));
}

void report(const motion::TrajectorySet& set, pipeline::Run& run) {
  int by_search = 0, by_script = 0, by_rrt = 0;
  std::vector<double> clearances, durations, lengths;
  for (const auto& t : set.trajectories) {
    by_search += t.planner == "aico" || t.planner == "gauss_newton";
    by_script += t.planner == "script";
    by_rrt += t.planner == "rrt_connect";
    if (t.outcome != "planned") continue;
    clearances.push_back(t.min_clearance_m);
    durations.push_back(t.efficiency.duration_s);
    lengths.push_back(t.efficiency.length);
  }
  run.metric("planned_by_search", by_search);
  run.metric("planned_by_script", by_script);
  run.metric("planned_by_rrt_connect", by_rrt);
  run.metric("no_path", static_cast<double>(set.trajectories.size()) - by_search - by_script - by_rrt);
  run.metric("median_clearance_m", geometry::median(clearances));
  run.metric("median_duration_s", geometry::median(durations));
  run.metric("median_length", geometry::median(lengths));
}

}  // namespace

motion::TrajectorySet approach(const ApproachParams& params, pipeline::Run& run,
                               const hands::GraspSet& grasps, const geometry::SignedDistanceField& field,
                               const geometry::PointCloud& support_cloud,
                               const geometry::SignedDistanceField& others, const hands::Hand& hand) {
  const Scene scene(field, support_cloud, others);
  std::unique_ptr<hands::ArmedHand> armed;
  Pose X_OB = Pose::Identity();
  if (params.arm != "none") {
    armed = std::make_unique<hands::ArmedHand>(hands::on_arm(hands::load_arm(params.arm), hand));
    std::vector<int> reached;
    X_OB = best_placement(params, scene, *armed, hand, grasps, reached);
    for (std::size_t k = 0; k < reached.size(); ++k)
      run.metric(fmt::format("reached_from_placement_{}", k), reached[k]);
  }
  motion::TrajectorySet set;
  set.trajectories.resize(grasps.grasps.size());
  pipeline::for_each_item(grasps.grasps.size(), [&](std::size_t i) {
    if (!grasps.grasps[i].points_O.empty())
      set.trajectories[i].outcome = "a net of points is laid, not moved";
    else
      set.trajectories[i] = GraspPlanner(params, scene, hand, armed.get(), X_OB, grasps.grasps[i]).plan();
  });
  report(set, run);
  return set;
}

}  // namespace geocage::stages
