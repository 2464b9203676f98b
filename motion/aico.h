#pragma once
#include <vector>

#include "motion/problem.h"
#include "pipeline/fields.h"

namespace geocage::motion {

struct AicoParams {
  int max_sweeps = 100;
  int max_rejections = 10;  ///< in a row: the sweep can't be improved
  double damping = 1e-2;    ///< lambda: pulls beliefs towards the last accepted ones
  bool proximal = false;    ///< lambda enters the messages too, not the beliefs alone
  double max_step = 1;      ///< a relocation moves a slice by at most this (norm)
  double step_tolerance = 1e-4;
  double cost_tolerance = 1e-5;  ///< relative
  void visit(pipeline::Fields& f);
};

enum class AicoOutcome { converged, sweep_limit, stalled };

struct AicoResult {
  AicoOutcome outcome = AicoOutcome::converged;
  std::vector<Eigen::VectorXd> mean;        ///< x_0 .. x_T; never costs more than what it started from
  std::vector<Eigen::MatrixXd> covariance;  ///< of the beliefs; zero for x_0
  std::vector<double> costs;                ///< of the start and of each accepted sweep: never rises
  int sweeps = 0, accepted = 0;
};

/// Approximate inference control (Toussaint 2009; thesis 2.3): Gaussian messages forward and backward along
/// the steps, tasks linearised at the beliefs, symmetric sweeps, Levenberg-like damping with full undo. In
/// the linear-Gaussian case one undamped sweep is exact. x_0 is clamped. `initial` holds x_0 .. x_T; its x_0
/// is replaced by the problem's start. No matrix that may be singular is inverted: messages are kept as
/// covariance forward and as information backward. O(sweeps T dim^3).
AicoResult aico(const Problem& problem, std::vector<Eigen::VectorXd> initial, const AicoParams& params);

}  // namespace geocage::motion
