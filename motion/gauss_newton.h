#pragma once
#include "motion/aico.h"

namespace geocage::motion {

struct GaussNewtonParams {
  int max_steps = 200;
  int max_rejections = 12;       ///< in a row
  double damping = 1e-2;         ///< Levenberg's, times the unit matrix
  double max_step = 1;           ///< norm of the change of any slice
  double cost_tolerance = 1e-5;  ///< relative
  double step_tolerance = 1e-4;
};

struct GaussNewtonResult {
  AicoOutcome outcome = AicoOutcome::converged;
  std::vector<Eigen::VectorXd> path;  ///< x_0 .. x_T; never costs more than what it started from
  std::vector<double> costs;          ///< of the start and of each accepted step: never rises
};

/// Damped Gauss-Newton on the cost that `aico` lowers, all slices at once: the normal equations are block
/// tridiagonal and solved by block Cholesky, O(T dim^3) a step. In the linear-Gaussian case one undamped step
/// is the mean that messages find: each is the other's oracle. Precondition: W positive definite.
GaussNewtonResult gauss_newton(const Problem& problem, std::vector<Eigen::VectorXd> initial,
                               const GaussNewtonParams& params);

}  // namespace geocage::motion
