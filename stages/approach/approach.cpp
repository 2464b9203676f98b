#include "stages/approach/approach.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "hands/closing.h"
#include "motion/certificate.h"
#include "motion/floating_hand.h"
#include "motion/rrt_connect.h"

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
    "what may be left unproven: an open hand is nowhere deeper than this");
  f("closing_tolerance_m", closing_tolerance_m, {0, 0.05}, "fingers may touch so deep while they close");
  f("base_speed_m_s", base_speed_m_s, {1e-3, 10}, "speed of the hand's base at most");
  f("base_turn_rad_s", base_turn_rad_s, {1e-3, 100}, "turning speed of the base at most");
  f("base_acceleration_m_s2", base_acceleration_m_s2, {1e-3, 1000}, "acceleration of the base at most");
  f("joint_acceleration_rad_s2", joint_acceleration_rad_s2, {1e-3, 1e4}, "acceleration of joints at most");
  f("damping", damping, {0, 1e8}, "AICO's damping at the start");
  f("rrt_iterations", rrt_iterations, {1, 1000000}, "of RRT-Connect, when every scripted way collides");
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
        closed_(hands::joint_vector(hand.tree, grasp.joints_rad, "grasp")),
        prover_(floating_, field, support),
        open_tolerance_(hand.tree.links.size(), params.tolerance_m),
        closing_tolerance_(open_tolerance_) {
    for (const auto& finger : hand.fingers)
      for (int link : finger.links)
        closing_tolerance_[static_cast<std::size_t>(link)] = params.closing_tolerance_m;
  }

  motion::Trajectory plan() {
    const Path closing = closing_path();
    if (closing.empty()) return none(fmt::format("closing would go {:.1f} mm deep", -1e3 * deepest_));
    deepest_ = -std::numeric_limits<double>::infinity();
    for (const Vec3& way_O : ways_out()) {
      const Path script = scripted(way_O);
      if (auto found = best_of(script, closing, "script")) return *found;
    }
    // With room between samples first: what sampled edges promise is then proven more often.
    for (double room_m : {0.004, 0.001, -params_.tolerance_m}) {
      const Path connected = connected_path(room_m);
      if (connected.empty()) continue;
      if (auto found = best_of(connected, closing, "rrt_connect")) return *found;
    }
    return none(fmt::format("every way to the grasp collides; the best one goes {:.1f} mm deep",
                            -1e3 * std::min(0.0, deepest_)));
  }

 private:
  /// AICO's version of a path if that is proven free, else the path itself if that one is.
  std::optional<motion::Trajectory> best_of(const Path& path, const Path& closing, const char* planner) {
    const Path smooth = smoothed(path);
    if (within_limits(smooth))
      if (const auto proof = prove(smooth); proof.outcome == motion::Proof::free)
        return answer(smooth, closing, proof.clearance_m, "aico");
    if (const auto proof = prove(path); proof.outcome == motion::Proof::free)
      return answer(path, closing, proof.clearance_m, planner);
    return std::nullopt;
  }

  motion::Certificate prove(const Path& path) {
    const auto proof = prover_.certify(path, open_tolerance_);
    deepest_ = std::max(deepest_, proof.clearance_m);
    return proof;
  }

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

  /// The postures that closing goes through, thinned out to `closing_steps` if that is proven free, else all
  /// of them. Fingers have leave to touch, the palm has not. Empty when neither is free.
  Path closing_path() {
    std::vector<VectorXd> postures = {open_};
    hands::close_hand(hand_, field_, goal_, open_, {}, &postures);
    postures.push_back(closed_);
    Path exact;
    for (const VectorXd& q : postures) {
      const VectorXd x = at(goal_.translation(), q);
      if (exact.empty() || (x - exact.back()).norm() > 0) exact.push_back(x);
    }
    for (const Path& path : {thinned(exact), exact}) {
      const auto proof = prover_.certify(path, closing_tolerance_);
      if (proof.outcome == motion::Proof::free) return path;
      deepest_ = proof.clearance_m;
    }
    return {};
  }

  /// Every posture that is a step's length of way after the one before, and the ends.
  Path thinned(const Path& path) const {
    double length = 0, since = 0;
    for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).norm();
    Path thin = {path.front()};
    for (std::size_t i = 1; i < path.size(); ++i) {
      since += (path[i] - path[i - 1]).norm();
      if (i + 1 < path.size() && since < length / params_.closing_steps) continue;
      thin.push_back(path[i]);
      since = 0;
    }
    return thin;
  }

  /// RRT-Connect from the first free start to the open hand at the grasp; corners are kept, straight parts
  /// are divided into about `steps`. Empty when there is none.
  Path connected_path(double room_m) {
    const auto free = [&](const VectorXd& x) { return prover_.posture_free(x, room_m); };
    const int n = floating_.dim();
    const double most = 1.5 * params_.start_m / FloatingHand::unit_m;
    VectorXd lower(n), upper(n);
    lower << Vec3::Constant(-most), Vec3::Constant(-M_PI), hand_.tree.lower_rad.cwiseMin(open_);
    upper << Vec3::Constant(most), Vec3::Constant(M_PI), hand_.tree.upper_rad.cwiseMax(open_);
    const VectorXd goal = at(goal_.translation(), open_);
    for (const Vec3& way_O : ways_out()) {
      const VectorXd start = at(goal_.translation() + params_.start_m * way_O, open_);
      const auto found =
          motion::rrt_connect(start, goal, lower, upper, free, {.iterations = params_.rrt_iterations});
      if (found.outcome == motion::ConnectOutcome::start_blocked) continue;
      return found.path.empty() ? Path() : divided(found.path);
    }
    return {};
  }

  Path divided(const Path& corners) const {
    double length = 0;
    for (std::size_t i = 1; i < corners.size(); ++i) length += (corners[i] - corners[i - 1]).norm();
    Path path = {corners.front()};
    for (std::size_t i = 1; i < corners.size(); ++i) {
      const VectorXd move = corners[i] - corners[i - 1];
      const int parts = std::max(1, static_cast<int>(std::lround(params_.steps * move.norm() / length)));
      for (int k = 1; k < parts; ++k) path.push_back(corners[i - 1] + double(k) / parts * move);
      path.push_back(corners[i]);
    }
    return path;
  }

  /// AICO from a path; its ends stay exactly.
  Path smoothed(const Path& script) const {
    const int T = static_cast<int>(script.size()) - 1, n = floating_.dim();
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
    t.certified = true;
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
  motion::Prover prover_;
  std::vector<double> open_tolerance_, closing_tolerance_;  ///< of each link
  double deepest_ = 0;                                      ///< of the best path so far, or of closing
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

  int by_aico = 0, by_script = 0, by_rrt = 0;
  std::vector<double> clearances;
  for (const auto& t : set.trajectories) {
    by_aico += t.planner == "aico";
    by_script += t.planner == "script";
    by_rrt += t.planner == "rrt_connect";
    if (t.outcome == "planned") clearances.push_back(t.min_clearance_m);
  }
  run.metric("planned_by_aico", by_aico);
  run.metric("planned_by_script", by_script);
  run.metric("planned_by_rrt_connect", by_rrt);
  run.metric("no_path", static_cast<double>(set.trajectories.size()) - by_aico - by_script - by_rrt);
  run.metric("median_clearance_m", median(clearances));
  return set;
}

}  // namespace geocage::stages
