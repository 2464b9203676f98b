#include "motion/gauss_newton.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Path = std::vector<VectorXd>;

namespace {

constexpr double least_damping = 1e-12, most_damping = 1e8;

/// H dx = -g of slices 1 .. T: H has `diagonal` blocks and `below` them the block of slices t + 1, t.
struct Normal {
  std::vector<MatrixXd> diagonal;
  MatrixXd below;
  std::vector<VectorXd> gradient;
};

Normal normal_equations(const Problem& problem, const MatrixXd& Winv, const Path& path) {
  const Process& p = problem.process;
  const auto T = static_cast<std::size_t>(problem.horizon);
  const MatrixXd AW = p.A.transpose() * Winv, AWA = AW * p.A;
  Normal normal{{}, -AW.transpose(), {}};
  for (std::size_t t = 1; t <= T; ++t) {
    const Quadratic q = linearise(problem, static_cast<int>(t), path[t]);
    MatrixXd H = Winv + q.R;
    VectorXd g = Winv * (path[t] - p.A * path[t - 1] - p.a) + q.R * path[t] - q.r;
    if (t < T) {
      H += AWA;
      g -= AW * (path[t + 1] - p.A * path[t] - p.a);
    }
    normal.diagonal.push_back(std::move(H));
    normal.gradient.push_back(std::move(g));
  }
  return normal;
}

/// The path after a damped step, each slice moved by at most `max_step`.
Path stepped(const Normal& normal, const Path& path, double damping, double max_step) {
  const std::size_t T = normal.diagonal.size();
  std::vector<Eigen::LLT<MatrixXd>> pivot(T);
  std::vector<VectorXd> rest(T);
  for (std::size_t t = 0; t < T; ++t) {
    MatrixXd H = normal.diagonal[t];
    H.diagonal().array() += damping;
    rest[t] = -normal.gradient[t];
    if (t > 0) {
      H -= normal.below * pivot[t - 1].solve(normal.below.transpose());
      rest[t] -= normal.below * pivot[t - 1].solve(rest[t - 1]);
    }
    pivot[t].compute(H);
  }
  Path next = path;
  VectorXd change;
  for (std::size_t t = T; t-- > 0;) {
    if (t + 1 < T) rest[t] -= normal.below.transpose() * change;
    change = pivot[t].solve(rest[t]);
    const double length = change.norm();
    next[t + 1] += length > max_step ? VectorXd(change * (max_step / length)) : change;
  }
  return next;
}

double largest_move(const Path& a, const Path& b) {
  double most = 0;
  for (std::size_t t = 0; t < a.size(); ++t) most = std::max(most, (a[t] - b[t]).lpNorm<Eigen::Infinity>());
  return most;
}

}  // namespace

GaussNewtonResult gauss_newton(const Problem& problem, Path initial, const GaussNewtonParams& params) {
  GaussNewtonResult result{AicoOutcome::sweep_limit, std::move(initial), {}};
  result.path[0] = problem.start;
  result.costs.push_back(total_cost(problem, result.path));
  const MatrixXd Winv = problem.process.W.llt().solve(MatrixXd::Identity(problem.dim(), problem.dim()));
  Normal normal = normal_equations(problem, Winv, result.path);
  double damping = params.damping;
  int rejections = 0;
  for (int step = 0; step < params.max_steps; ++step) {
    Path next = stepped(normal, result.path, damping, params.max_step);
    const double cost = total_cost(problem, next), best = result.costs.back();
    const bool still = largest_move(next, result.path) < params.step_tolerance;
    if (!(cost <= best)) {
      if (still || ++rejections == params.max_rejections) {
        result.outcome = still ? AicoOutcome::converged : AicoOutcome::stalled;
        break;
      }
      damping = std::min(most_damping, std::max(damping, least_damping) * 10);
      continue;
    }
    rejections = 0;
    damping = damping == 0 ? 0 : std::max(least_damping, damping / 5);
    result.path = std::move(next);
    result.costs.push_back(cost);
    if (still || best - cost <= params.cost_tolerance * std::max(1.0, std::abs(cost))) {
      result.outcome = AicoOutcome::converged;
      break;
    }
    normal = normal_equations(problem, Winv, result.path);
  }
  return result;
}

}  // namespace geocage::motion
