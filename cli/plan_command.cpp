#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/console.h"
#include "cli/plan_scene.h"
#include "hands/grasp.h"
#include "motion/approach.h"
#include "motion/posture.h"
#include "motion/timing.h"

namespace geocage::cli {

using Eigen::VectorXd;
using motion::Path;
using nlohmann::json;

namespace {

/// What a search of a scene came to.
struct Plan {
  Path path;
  std::string planner, outcome;  ///< who answered; how the search ended
  std::vector<double> costs;
  int sweeps = 0;
  motion::Certificate proof;
};

/// Final posture, then the whole motion from a straight line; where that is not proven free, from
/// RRT-Connect's way.
class SceneSearch {
 public:
  explicit SceneSearch(const PlanScene& scene)
      : scene_(scene),
        problem_{motion::kinematic(scene.step_variance *
                                   Eigen::MatrixXd::Identity(scene.mover->dim(), scene.mover->dim())),
                 scene.horizon, scene.start, scene.tasks},
        prover_(*scene.mover, scene.obstacles, scene.self_pairs),
        tolerance_(scene.mover->hand().tree.links.size(), scene.tolerance_m) {}

  const motion::Problem& problem() const { return problem_; }

  Plan search() {
    const int T = scene_.horizon;
    const VectorXd last = motion::final_posture(motion::end_prior(problem_.process, scene_.start, T),
                                                scene_.tasks, T, scene_.start)
                              .mean;
    Plan straight = from(motion::respaced({scene_.start, last}, T));
    if (straight.proof.outcome == motion::Proof::free) return straight;
    const auto free = [&](const VectorXd& x) { return prover_.posture_free(x, -scene_.tolerance_m); };
    VectorXd lower = scene_.mover->lower(), upper = scene_.mover->upper();
    const auto base = scene_.mover->base_dofs();
    if (base > 0) {
      const double far = 2 + (last - scene_.start).head<3>().norm();
      lower.head<3>() = scene_.start.head<3>().array() - far;
      upper.head<3>() = scene_.start.head<3>().array() + far;
      lower.segment<3>(3).setConstant(-M_PI);
      upper.segment<3>(3).setConstant(M_PI);
    }
    const VectorXd end = straight.path.back();
    const auto found =
        motion::rrt_connect(scene_.start, end, lower.cwiseMin(end), upper.cwiseMax(end), free, {});
    if (found.path.size() < 2) return straight;
    Plan detour = from(motion::respaced(found.path, T));
    if (detour.proof.outcome == motion::Proof::free) return detour;
    Plan sampled = detour;
    sampled.path = found.path;
    sampled.planner = "rrt_connect";
    sampled.proof = prover_.certify(sampled.path, tolerance_);
    return sampled.proof.outcome == motion::Proof::free ? sampled : straight;
  }

 private:
  Plan from(const Path& initial) {
    Plan plan;
    if (scene_.by_messages) {
      motion::AicoParams params{.proximal = true, .cost_tolerance = 1e-6};
      params.mode = motion::SweepMode::whole;
      const auto found = motion::aico(problem_, initial, params);
      plan = {found.mean, "aico", std::string(name_of(found.outcome)), found.costs, found.sweeps, {}};
    } else {
      const auto found = motion::gauss_newton(problem_, initial, {.cost_tolerance = 1e-6});
      plan = {found.path, "gauss_newton", std::string(name_of(found.outcome)), found.costs, found.steps, {}};
    }
    plan.proof = prover_.certify(plan.path, tolerance_);
    return plan;
  }

  const PlanScene& scene_;
  const motion::Problem problem_;
  motion::Prover prover_;
  const std::vector<double> tolerance_;
};

std::string_view name_of_proof(motion::Proof proof) {
  switch (proof) {
    case motion::Proof::free:
      return "free";
    case motion::Proof::collides:
      return "collides";
    case motion::Proof::undecided:
      return "undecided";
  }
  return "";
}

std::string name_of_other(const PlanScene& scene, int other) {
  if (other >= 0) return scene.mover->hand().tree.links[static_cast<std::size_t>(other)];
  if (other == motion::Certificate::of_support) return "plane";
  return fmt::format("obstacle {}",
                     other == motion::Certificate::of_object ? 0 : motion::Certificate::of_support - other);
}

motion::MotionLimits limits_of(const PlanScene& scene) {
  const int n = scene.mover->dim(), joints = scene.mover->hand().tree.dofs();
  motion::MotionLimits limits{VectorXd::Constant(n, 1), VectorXd::Constant(n, scene.acceleration_rad_s2)};
  limits.speed.tail(joints) = scene.mover->hand().tree.velocity_limit_rad_s;
  return limits;
}

json to_json(const PlanScene& scene, const motion::Problem& problem, const Plan& plan, double dt) {
  json q = json::array(), poses = json::array(), tasks = json::array();
  motion::Mover::Placed placed;
  for (const VectorXd& x : plan.path) {
    const VectorXd joints = scene.mover->joints(x);
    q.push_back(std::vector<double>(joints.data(), joints.data() + joints.size()));
    scene.mover->place(x, placed);
    poses.push_back(hands::to_json(
        hands::file_pose(placed.X_OL[scene.armed ? static_cast<std::size_t>(scene.armed->hand_link) : 0])));
  }
  if (plan.path.size() == static_cast<std::size_t>(problem.horizon) + 1)
    for (const auto& residual : motion::residuals(problem, plan.path))
      tasks.push_back(
          {{"task", residual.task}, {"cost", residual.cost}, {"final_error", residual.final_error}});
  const auto e = motion::efficiency_of(plan.path, dt);
  return {{"schema", "geocage-plan 1"},
          {"planner", plan.planner},
          {"outcome", plan.outcome},
          {"certified", plan.proof.outcome == motion::Proof::free},
          {"proof", name_of_proof(plan.proof.outcome)},
          {"min_clearance_m", plan.proof.clearance_m},
          {"clearance_at_step", plan.proof.at},
          {"clearance_of",
           {scene.mover->hand().tree.links[static_cast<std::size_t>(plan.proof.link)],
            name_of_other(scene, plan.proof.other)}},
          {"self_clearance_m", plan.proof.self_clearance_m},
          {"sweeps", plan.sweeps},
          {"costs", plan.costs},
          {"tasks", tasks},
          {"dt_s", dt},
          {"efficiency",
           {{"effort", e.effort},
            {"duration_s", e.duration_s},
            {"length", e.length},
            {"smoothness", e.smoothness}}},
          {"joints", scene.mover->hand().tree.dof_names},
          {"q_rad", q},
          {"X_OH", poses}};
}

}  // namespace

int plan(const Shared& shared, const std::filesystem::path& file) {
  PlanScene scene;
  read_scene(file, scene);
  SceneSearch search(scene);
  const Plan found = search.search();
  const double dt = motion::shortest_step_s(found.path, limits_of(scene));
  const bool certified = found.proof.outcome == motion::Proof::free;
  if (shared.json) {
    print_json(to_json(scene, search.problem(), found, dt), 1);
    return certified ? 0 : 1;
  }
  fmt::print("{} {} after {} sweeps: cost {:.6g} to {:.6g}\n", found.planner, found.outcome, found.sweeps,
             found.costs.front(), found.costs.back());
  fmt::print("{}: least clearance {:.1f} mm, {} and {}, at step {:.2f}\n",
             certified ? "proven free" : std::string(name_of_proof(found.proof.outcome)),
             1e3 * found.proof.clearance_m,
             scene.mover->hand().tree.links[static_cast<std::size_t>(found.proof.link)],
             name_of_other(scene, found.proof.other), found.proof.at);
  fmt::print("{:.2f} s in {} steps\n", dt * static_cast<double>(found.path.size() - 1),
             found.path.size() - 1);
  if (found.path.size() == static_cast<std::size_t>(scene.horizon) + 1)
    for (const auto& residual : motion::residuals(search.problem(), found.path))
      fmt::print("{:<24} cost {:<12.6g} error at the end {:.6g}\n", residual.task, residual.cost,
                 residual.final_error);
  return certified ? 0 : 1;
}

}  // namespace geocage::cli
