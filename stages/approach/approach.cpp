#include "stages/approach/approach.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "hands/closing.h"
#include "motion/floating_hand.h"

namespace geocage::stages {

using Eigen::VectorXd;
using geometry::Pose;
using geometry::Vec3;
using motion::FloatingHand;
using Path = std::vector<VectorXd>;

void ApproachParams::visit(pipeline::Fields& f) {
  f("start_m", start_m, {0.01, 10}, "the hand starts this far from the grasp");
  f("retreat_m", retreat_m, {0, 10}, "from here on the scripted path is straight along the approach");
  f("steps", steps, {4, 1000}, "steps of the open hand's way");
  f("closing_steps", closing_steps, {1, 1000}, "steps of closing");
  f("margin_m", margin_m, {0, 0.1}, "the smoothed path is pushed off surfaces nearer than this");
  f("collision_precision", collision_precision, {0, 1e6}, "weight of that push; high ones freeze the path");
  f("goal_precision", goal_precision, {0, 1e9}, "weight of the end");
  f("limits_precision", limits_precision, {0, 1e9}, "weight of joint limits");
  f("tolerance_m", tolerance_m, {0, 0.01},
    "an open hand may touch so deep: what the field's interpolation may err");
  f("closing_tolerance_m", closing_tolerance_m, {0, 0.05}, "a closing hand may touch so deep");
  f("base_speed_m_s", base_speed_m_s, {1e-3, 10}, "speed of the hand's base at most");
  f("base_turn_rad_s", base_turn_rad_s, {1e-3, 100}, "turning speed of the base at most");
  f("base_acceleration_m_s2", base_acceleration_m_s2, {1e-3, 1000}, "acceleration of the base at most");
  f("joint_acceleration_rad_s2", joint_acceleration_rad_s2, {1e-3, 1e4}, "acceleration of joints at most");
  f("damping", damping, {0, 1e8}, "AICO's damping at the start");
  f("max_sweeps", max_sweeps, {1, 10000}, "AICO's sweeps at most");
}

namespace {

/// Everything about one grasp's way.
class Planner {
 public:
  Planner(const ApproachParams& params, const geometry::SignedDistanceField& field,
          const std::optional<geometry::Plane>& support, const hands::Hand& hand, const hands::Grasp& grasp)
      : params_(params),
        field_(field),
        support_(support),
        hand_(hand),
        goal_(grasp.X_OH),
        floating_(hand, grasp.X_OH),
        open_(hands::joint_vector(hand.tree, grasp.pregrasp_joints_rad, "pre-grasp")),
        closed_(hands::joint_vector(hand.tree, grasp.joints_rad, "grasp")) {}

  motion::Trajectory plan() {
    const Path closing = closing_path();
    const double closing_clearance = clearance(closing);
    if (closing_clearance < -params_.closing_tolerance_m)
      return none(fmt::format("closing would go {:.1f} mm deep", -1e3 * closing_clearance));
    double best = -std::numeric_limits<double>::infinity();
    for (const Vec3& way_O : ways_out()) {
      const Path script = scripted(way_O);
      const double scripted_clearance = clearance(script);
      const Path smooth = smoothed(script);
      const double smooth_clearance =
          within_limits(smooth) ? clearance(smooth) : -std::numeric_limits<double>::infinity();
      best = std::max({best, scripted_clearance, smooth_clearance});
      if (smooth_clearance >= -params_.tolerance_m) return answer(smooth, closing, smooth_clearance, "aico");
      if (scripted_clearance >= -params_.tolerance_m)
        return answer(script, closing, scripted_clearance, "script");
    }
    return none(
        fmt::format("every way to the grasp collides; the best one goes {:.1f} mm deep", -1e3 * best));
  }

 private:
  /// Directions from the grasp to the start: back along the approach, then tilted ones, then up from the
  /// support.
  std::vector<Vec3> ways_out() const {
    const Vec3 back = -(goal_.linear() * hand_.approach_H);
    const Eigen::Matrix3d frame = geometry::frame_from_z(back);
    std::vector<Vec3> ways = {back};
    for (double tilt : {0.35, 0.7})
      for (int k = 0; k < 6; ++k)
        ways.push_back(frame * Vec3(std::sin(tilt) * std::cos(k * M_PI / 3),
                                    std::sin(tilt) * std::sin(k * M_PI / 3), std::cos(tilt)));
    if (support_) ways.push_back(support_->normal);
    return ways;
  }

  VectorXd at(const Vec3& p_O, const VectorXd& q) const {
    Pose X_OH = goal_;
    X_OH.translation() = p_O;
    return floating_.state(X_OH, q);
  }

  /// The open hand: from the start to the point of retreat, then straight to the grasp's pose.
  Path scripted(const Vec3& way_O) const {
    const Vec3 goal = goal_.translation(), back = -(goal_.linear() * hand_.approach_H);
    const Vec3 retreat =
        goal + std::min(params_.retreat_m, params_.start_m) * (way_O.dot(back) > 0.9 ? back : way_O);
    const VectorXd start = at(goal + params_.start_m * way_O, open_), middle = at(retreat, open_),
                   end = at(goal, open_);
    Path path;
    for (int t = 0; t <= params_.steps; ++t) {
      const double s = double(t) / params_.steps;
      path.push_back(s < 0.5 ? VectorXd(start + 2 * s * (middle - start))
                             : VectorXd(middle + (2 * s - 1) * (end - middle)));
    }
    return path;
  }

  /// Proximal joints of all fingers first, then the next ones: the order in which the grasp was closed,
  /// backwards free.
  Path closing_path() const {
    std::size_t levels = 0;
    for (const auto& finger : hand_.fingers) levels = std::max(levels, finger.dofs.size());
    Path path = {at(goal_.translation(), open_)};
    VectorXd q = open_;
    for (std::size_t level = 0; level < levels; ++level) {
      VectorXd next = q;
      for (const auto& finger : hand_.fingers)
        if (level < finger.dofs.size()) next[finger.dofs[level]] = closed_[finger.dofs[level]];
      if (level + 1 == levels) next = closed_;
      const int steps = std::max(1, params_.closing_steps / static_cast<int>(levels));
      for (int k = 1; k <= steps; ++k)
        path.push_back(
            at(goal_.translation(), k == steps ? next : VectorXd(q + double(k) / steps * (next - q))));
      q = next;
    }
    return path;
  }

  /// AICO from the scripted path; its ends stay exactly.
  Path smoothed(const Path& script) const {
    const int T = params_.steps, n = floating_.dim();
    motion::Problem problem{motion::kinematic(Eigen::MatrixXd::Identity(n, n)), T, script.front(), {}};
    problem.tasks.push_back(
        motion::state_task(script.back(), motion::final_precision(T, params_.goal_precision)));
    VectorXd lower = VectorXd::Constant(n, -std::numeric_limits<double>::infinity()), upper = -lower;
    lower.tail(hand_.tree.dofs()) = hand_.tree.lower_rad;
    upper.tail(hand_.tree.dofs()) = hand_.tree.upper_rad;
    problem.tasks.push_back(
        motion::limits_task(lower, upper, motion::constant_precision(T, params_.limits_precision)));
    std::vector<double> margin;  // fades over the last quarter: the grasp itself is near the surface
    for (int t = 0; t <= T; ++t) margin.push_back(params_.margin_m * std::min(1.0, 4 * (1 - double(t) / T)));
    problem.tasks.push_back(motion::clearance_task(
        floating_, field_, support_, margin, motion::constant_precision(T, params_.collision_precision)));
    motion::AicoParams search;
    search.damping = params_.damping;
    search.max_sweeps = params_.max_sweeps;
    search.cost_tolerance = 1e-3;
    search.step_tolerance = 1e-3;
    Path path = motion::aico(problem, script, search).mean;
    path.back() = script.back();
    return path;
  }

  bool within_limits(const Path& path) const {
    constexpr double slack_rad = 1e-6;
    return std::all_of(path.begin(), path.end(), [&](const VectorXd& x) {
      const VectorXd q = floating_.joints(x);
      return ((q - hand_.tree.upper_rad).array() <= slack_rad).all() &&
             ((hand_.tree.lower_rad - q).array() <= slack_rad).all();
    });
  }

  /// Smallest distance of any capsule to object and support along the piecewise linear path, sampled so that
  /// no coordinate moves more than 2 mm (or 0.02 rad) between samples.
  double clearance(const Path& path) const {
    double least = std::numeric_limits<double>::infinity();
    std::vector<Pose> X_HL;
    std::vector<hands::PlacedCapsule> placed;
    const auto look = [&](const VectorXd& x) {
      hands::forward_kinematics(hand_.tree, floating_.joints(x), X_HL);
      hands::place_capsules(hand_, floating_.pose(x), X_HL, placed);
      for (const auto& capsule : placed) {
        if (hands::capsule_distance_bound_m(field_, capsule) < least)
          least = std::min(least, hands::capsule_distance(field_, capsule).distance_m);
        if (support_)
          least = std::min(least, std::min(support_->height_m(capsule.a), support_->height_m(capsule.b)) -
                                      capsule.radius_m);
      }
    };
    look(path.front());
    for (std::size_t t = 0; t + 1 < path.size(); ++t) {
      const VectorXd move = path[t + 1] - path[t];
      const int samples = 1 + static_cast<int>(move.lpNorm<Eigen::Infinity>() / 0.02);
      for (int k = 1; k <= samples; ++k) look(path[t] + double(k) / samples * move);
    }
    return least;
  }

  motion::Trajectory none(const std::string& why) const {
    motion::Trajectory t;
    t.joints = hand_.tree.dof_names;
    t.outcome = "no path: " + why;
    return t;
  }

  motion::Trajectory answer(const Path& open, const Path& closing, double clearance_m,
                            const char* planner) const {
    Path path = open;
    path.insert(path.end(), closing.begin() + 1, closing.end());
    motion::Trajectory t;
    t.joints = hand_.tree.dof_names;
    t.dt_s = step_time_s(path);
    for (const VectorXd& x : path) {
      const VectorXd q = floating_.joints(x);
      t.q_rad.emplace_back(q.data(), q.data() + q.size());
      t.X_OH.push_back(hands::file_pose(floating_.pose(x)));
    }
    t.X_OH.back() = hands::file_pose(goal_);
    t.min_clearance_m = clearance_m;
    t.outcome = "planned";
    t.planner = planner;
    return t;
  }

  /// The shortest step that keeps every speed and acceleration, starting and ending at rest.
  double step_time_s(const Path& path) const {
    const int n = floating_.dim();
    VectorXd speed(n), acceleration(n);
    speed << Vec3::Constant(params_.base_speed_m_s / FloatingHand::unit_m / std::sqrt(3.0)),
        Vec3::Constant(params_.base_turn_rad_s / std::sqrt(3.0)), hand_.tree.velocity_limit_rad_s;
    acceleration << Vec3::Constant(params_.base_acceleration_m_s2 / FloatingHand::unit_m / std::sqrt(3.0)),
        VectorXd::Constant(n - 3, params_.joint_acceleration_rad_s2);
    double dt = 1e-3;
    VectorXd before = VectorXd::Zero(n);
    for (std::size_t t = 0; t < path.size(); ++t) {
      const VectorXd move = t + 1 < path.size() ? VectorXd(path[t + 1] - path[t]) : VectorXd::Zero(n);
      for (int i = 0; i < n; ++i) {
        if (speed[i] > 0) dt = std::max(dt, std::abs(move[i]) / speed[i]);
        dt = std::max(dt, std::sqrt(std::abs(move[i] - before[i]) / acceleration[i]));
      }
      before = move;
    }
    return dt;
  }

  const ApproachParams& params_;
  const geometry::SignedDistanceField& field_;
  const std::optional<geometry::Plane>& support_;
  const hands::Hand& hand_;
  const Pose goal_;
  const FloatingHand floating_;
  const VectorXd open_, closed_;
};

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace

motion::TrajectorySet approach(const ApproachParams& params, pipeline::Run& run,
                               const hands::GraspSet& grasps, const geometry::SignedDistanceField& field,
                               const geometry::PointCloud& support_cloud, const hands::Hand& hand) {
  motion::TrajectorySet set;
  set.trajectories.resize(grasps.grasps.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < grasps.grasps.size(); ++i)
    if (!grasps.grasps[i].points_O.empty())
      set.trajectories[i].outcome = "a net of points is laid, not moved";
    else
      set.trajectories[i] = Planner(params, field, support_cloud.support, hand, grasps.grasps[i]).plan();

  int by_aico = 0, by_script = 0;
  std::vector<double> clearances;
  for (const auto& t : set.trajectories) {
    by_aico += t.planner == "aico";
    by_script += t.planner == "script";
    if (t.outcome == "planned") clearances.push_back(t.min_clearance_m);
  }
  run.metric("planned_by_aico", by_aico);
  run.metric("planned_by_script", by_script);
  run.metric("no_path", static_cast<double>(set.trajectories.size()) - by_aico - by_script);
  run.metric("median_clearance_m", median(clearances));
  return set;
}

}  // namespace geocage::stages
