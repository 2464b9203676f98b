#pragma once
#include <memory>

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
  int steps = 0;                      ///< tried
};

/// Damped Gauss-Newton on the cost that `aico` lowers, all slices at once: the normal equations are block
/// tridiagonal and solved by block Cholesky, O(T dim^3) a step. In the linear-Gaussian case one undamped step
/// is the mean that messages find: each is the other's oracle. A process that depends on the state is frozen
/// at the path, as messages freeze it. Precondition: W positive definite.
///
/// Takes its memory when it is made; `search` allocates nothing, as far as tasks and model don't. The problem
/// must outlive it.
class GaussNewton {
 public:
  GaussNewton(const Problem& problem, const GaussNewtonParams& params);
  ~GaussNewton();
  GaussNewton(const GaussNewton&) = delete;
  GaussNewton& operator=(const GaussNewton&) = delete;
  /// x_0 is the problem's start. The answer stays valid until the next call.
  const GaussNewtonResult& search(const std::vector<Eigen::VectorXd>& initial);

 private:
  class Stepper;
  std::unique_ptr<Stepper> stepper_;
};

/// For those who ask once.
GaussNewtonResult gauss_newton(const Problem& problem, const std::vector<Eigen::VectorXd>& initial,
                               const GaussNewtonParams& params);

}  // namespace geocage::motion
