#include "physics/escape_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/force_trial.h"
#include <ompl/base/MotionValidator.h>
#include <ompl/base/ScopedState.h>
#include <ompl/base/goals/GoalStates.h>
#include <ompl/base/spaces/SE3StateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>

#include "geometry/noise.h"
#include "hands/caging.h"

namespace geocage::physics {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using geometry::Pose;
using geometry::Vec3;
using Space = ob::SE3StateSpace;

/// Poses of the frame C, at the object's centre of mass with the axes of O: turning then moves little.
Pose pose_of(const ob::State* state) {
  const auto& s = *state->as<Space::StateType>();
  const auto& q = s.rotation();
  Pose X = Pose::Identity();
  X.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).toRotationMatrix();
  X.translation() = Vec3(s.getX(), s.getY(), s.getZ());
  return X;
}

void set_pose(ob::State* state, const Vec3& p, const Eigen::Quaterniond& q) {
  auto& s = *state->as<Space::StateType>();
  s.setXYZ(p.x(), p.y(), p.z());
  s.rotation().w = q.w(), s.rotation().x = q.x(), s.rotation().y = q.y(), s.rotation().z = q.z();
}

/// How far the hand is from the object, anywhere.
struct Clearance {
  const geometry::SignedDistanceField& field;
  const EscapeTest& escape;
  double tolerance_m = 0;
  double border_m = 0;  ///< smallest value at the border of the field's grid
  std::optional<Ceiling> ceiling;

  Pose X_OW(const Pose& X_WC) const {
    return Eigen::Translation3d(escape.object_ball().center) * X_WC.inverse();
  }

  /// A lower bound of the gap, negative when a capsule is inside. A way from outside the field's grid to the
  /// object crosses the grid's border, so it is at least as long as the border's smallest value.
  double operator()(const Pose& X_WC) const {
    const Pose X = X_OW(X_WC);
    double least = std::numeric_limits<double>::infinity();
    for (const hands::PlacedCapsule& capsule : escape.capsules()) {
      const hands::PlacedCapsule here{X * capsule.a, X * capsule.b, capsule.radius_m};
      if (!in_grid(here.a) || !in_grid(here.b)) least = std::min(least, border_m - here.radius_m);
      if (hands::capsule_distance_bound_m(field, here) > least) continue;
      least = std::min(least, hands::capsule_distance(field, here).distance_m);
    }
    return least;
  }

  bool in_grid(const Vec3& p_O) const {
    const Vec3 cells = (p_O - field.origin) / field.cell_m;
    return cells.minCoeff() >= 0 && cells.x() <= field.nodes[0] - 1 && cells.y() <= field.nodes[1] - 1 &&
           cells.z() <= field.nodes[2] - 1;
  }

  /// A motion's centre goes straight, so its ends tell of all of it.
  bool low_enough(const Pose& X_WC) const {
    const Vec3 moved = X_WC.translation() - escape.object_ball().center;
    return !ceiling || -ceiling->gravity_O.dot(moved) <= ceiling->rise_m;
  }

  bool free(const Pose& X_WC) const { return low_enough(X_WC) && (*this)(X_WC) > -tolerance_m; }
};

double border_of(const geometry::SignedDistanceField& field) {
  const auto& n = field.nodes;
  double least = std::numeric_limits<double>::infinity();
  std::size_t i = 0;
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x, ++i)
        if (x == 0 || y == 0 || z == 0 || x == n[0] - 1 || y == n[1] - 1 || z == n[2] - 1)
          least = std::min<double>(least, field.coarse[i]);
  return least;
}

double surface_motion_m(const Pose& from, const Pose& to, double radius_m) {
  const double angle = Eigen::AngleAxisd(Eigen::Matrix3d(from.linear().transpose() * to.linear())).angle();
  return (to.translation() - from.translation()).norm() + angle * radius_m;
}

Pose between(const Pose& from, const Pose& to, double share) {
  Pose X = Pose::Identity();
  X.translation() = from.translation() + share * (to.translation() - from.translation());
  X.linear() =
      Eigen::Quaterniond(from.linear()).slerp(share, Eigen::Quaterniond(to.linear())).toRotationMatrix();
  return X;
}

/// Conservative advancement: no point of the object moves farther than the clearance between two looks.
bool motion_free(const Clearance& clearance, const Pose& from, const Pose& to, double least_step_m) {
  const double length = surface_motion_m(from, to, clearance.escape.object_ball().radius_m);
  for (double moved = 0;;) {
    const double gap = clearance(between(from, to, length > 0 ? moved / length : 1)) + clearance.tolerance_m;
    if (gap <= 0) return false;
    if (moved >= length) return true;
    moved = std::min(length, moved + std::max(gap, least_step_m));
  }
}

class Motions final : public ob::MotionValidator {
 public:
  Motions(const ob::SpaceInformationPtr& space, const Clearance& clearance, double least_step_m)
      : MotionValidator(space), clearance_(clearance), least_step_m_(least_step_m) {}
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    const Pose end = pose_of(to);
    return clearance_.low_enough(end) && motion_free(clearance_, pose_of(from), end, least_step_m_);
  }
  bool checkMotion(const ob::State*, const ob::State*, std::pair<ob::State*, double>&) const override {
    throw std::logic_error("RRT-Connect asks for whole motions only");
  }

 private:
  const Clearance& clearance_;
  double least_step_m_;
};

/// OMPL's own samplers draw from generators that all threads share.
class Poses final : public ob::StateSampler {
 public:
  Poses(const ob::StateSpace* space, std::uint64_t seed, int& drawn)
      : StateSampler(space), random_(seed, 1), drawn_(drawn) {}
  void sampleUniform(ob::State* state) override {
    ++drawn_;
    const auto& bounds = space_->as<Space>()->getBounds();
    Vec3 p;
    for (int i = 0; i < 3; ++i) p[i] = bounds.low[i] + random_.uniform() * (bounds.high[i] - bounds.low[i]);
    const double u = random_.uniform(), a = 2 * std::numbers::pi * random_.uniform(),
                 b = 2 * std::numbers::pi * random_.uniform();  // Shoemake 1992
    set_pose(state, p,
             {std::sqrt(u) * std::cos(b), std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a),
              std::sqrt(u) * std::sin(b)});
  }
  void sampleUniformNear(ob::State* state, const ob::State*, double) override { sampleUniform(state); }
  void sampleGaussian(ob::State* state, const ob::State*, double) override { sampleUniform(state); }

 private:
  geometry::RandomStream random_;
  int& drawn_;
};

/// Every pose of the path, `recheck_m` apart at most: the deepest that a capsule gets.
double deepest_m(const Clearance& clearance, const std::vector<Pose>& path, double recheck_m) {
  double deepest = 0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double length = surface_motion_m(path[i], path[i + 1], clearance.escape.object_ball().radius_m);
    const int looks = std::max(1, static_cast<int>(std::ceil(length / recheck_m)));
    for (int k = 0; k <= looks; ++k)
      deepest = std::max(deepest, -clearance(between(path[i], path[i + 1], static_cast<double>(k) / looks)));
  }
  return deepest;
}

std::shared_ptr<Space> space_around(const EscapeTest& escape) {
  auto space = std::make_shared<Space>();
  const double reach = 1.2 * (escape.object_ball().radius_m + escape.hand_ball().radius_m);
  ob::RealVectorBounds bounds(3);
  for (int i = 0; i < 3; ++i) {
    bounds.setLow(i, escape.hand_ball().center[i] - reach);
    bounds.setHigh(i, escape.hand_ball().center[i] + reach);
  }
  space->setBounds(bounds);
  space->setSubspaceWeight(
      1, 2 * escape.object_ball().radius_m);  // OMPL's distance of rotations is half the angle
  return space;
}

}  // namespace

EscapeSearch search_escape(const geometry::SignedDistanceField& field, const EscapeTest& escape,
                           const EscapeSearchRule& rule, std::uint64_t seed,
                           const std::optional<Ceiling>& ceiling) {
  constexpr double most_extra_m = 1e-3;
  ompl::msg::noOutputHandler();
  EscapeSearch search;
  Clearance clearance{field, escape, rule.tolerance_m, border_of(field), ceiling};
  const Pose start(Eigen::Translation3d(escape.object_ball().center));
  const double inside = std::max(0.0, -clearance(start));
  if (inside > most_extra_m) {
    search.result = EscapeSearch::Result::stuck, search.deepest_m = inside;
    return search;
  }
  clearance.tolerance_m += inside;

  const auto space = space_around(escape);
  space->setStateSamplerAllocator(
      [&](const ob::StateSpace* of) { return std::make_shared<Poses>(of, seed, search.samples); });
  const auto information = std::make_shared<ob::SpaceInformation>(space);
  information->setStateValidityChecker(
      [&](const ob::State* state) { return clearance.free(pose_of(state)); });
  information->setMotionValidator(std::make_shared<Motions>(information, clearance, rule.recheck_m));
  information->setup();

  const auto problem = std::make_shared<ob::ProblemDefinition>(information);
  ob::ScopedState<Space> state(space);
  set_pose(state.get(), start.translation(), Eigen::Quaterniond::Identity());
  problem->addStartState(state);
  const auto outside = std::make_shared<ob::GoalStates>(information);
  const double away = escape.object_ball().radius_m + escape.hand_ball().radius_m;
  for (const Vec3& way : hands::sphere_directions(2)) {
    set_pose(state.get(), escape.hand_ball().center + away * way, Eigen::Quaterniond::Identity());
    outside->addState(state);
  }
  problem->setGoal(outside);

  og::RRTConnect planner(information);
  planner.setRange(rule.step_m);
  planner.setProblemDefinition(problem);
  planner.setup();
  const ob::PlannerTerminationCondition enough([&] { return search.samples >= rule.samples; });
  if (planner.solve(enough) != ob::PlannerStatus::EXACT_SOLUTION) return search;

  std::vector<Pose> path_WC;
  for (const ob::State* at : problem->getSolutionPath()->as<og::PathGeometric>()->getStates())
    path_WC.push_back(pose_of(at));
  search.deepest_m = deepest_m(clearance, path_WC, rule.recheck_m);
  if (search.deepest_m > clearance.tolerance_m) return search;
  search.result = EscapeSearch::Result::found;
  for (const Pose& X_WC : path_WC) {
    if (!search.path_WO.empty())
      search.path_m += (X_WC * Vec3::Zero() - path_WC[search.path_WO.size() - 1].translation()).norm();
    search.path_WO.push_back(X_WC * Eigen::Translation3d(-escape.object_ball().center));
  }
  search.found = 1;
  search.rise_m = rises_m(search.path_WO, escape.object_ball().center);
  return search;
}

namespace {
double rise_of(const std::vector<Pose>& path_WO, const Vec3& center_O, const Vec3& gravity_O) {
  double rise = 0;
  for (const Pose& X_WO : path_WO)
    rise = std::max(rise, -gravity_O.dot(X_WO * center_O - path_WO.front() * center_O));
  return rise;
}
}  // namespace

std::vector<double> rises_m(const std::vector<Pose>& path_WO, const Vec3& center_O) {
  std::vector<double> rises;
  for (const Direction& gravity : six_directions())
    rises.push_back(rise_of(path_WO, center_O, gravity.axis_O));
  return rises;
}

RiseBound lower_rise(const geometry::SignedDistanceField& field, const EscapeTest& escape,
                     const EscapeSearchRule& rule, std::uint64_t seed, int seeds, const Vec3& gravity_O,
                     double rise_m, int halvings) {
  RiseBound bound{rise_m, 0};
  for (int halving = 0; halving < halvings && bound.rise_m > 0; ++halving) {
    const Ceiling ceiling{gravity_O, (bound.unfound_m + bound.rise_m) / 2};
    EscapeSearch search;
    for (int i = 0; i < seeds && search.found == 0; ++i)
      search = search_escape(field, escape, rule, seed + static_cast<std::uint64_t>(i), ceiling);
    if (search.found > 0)
      bound.rise_m = rise_of(search.path_WO, escape.object_ball().center, gravity_O);
    else
      bound.unfound_m = ceiling.rise_m;
  }
  return bound;
}

EscapeSearch merged(const std::vector<EscapeSearch>& searches) {
  if (searches.empty()) return {};
  const auto first = std::ranges::find(searches, EscapeSearch::Result::found, &EscapeSearch::result);
  EscapeSearch all = first == searches.end() ? searches.front() : *first;
  all.seeds = static_cast<int>(searches.size()), all.found = 0, all.samples = 0;
  for (const EscapeSearch& one : searches) {
    all.found += one.found, all.samples += one.samples;
    for (std::size_t i = 0; i < one.rise_m.size(); ++i)
      all.rise_m[i] = std::min(all.rise_m[i], one.rise_m[i]);
  }
  return all;
}

}  // namespace geocage::physics
