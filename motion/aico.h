#pragma once
#include <memory>
#include <string_view>
#include <vector>

#include "motion/problem.h"
#include "pipeline/fields.h"

namespace geocage::motion {

/// When tasks are linearised anew within a sweep.
enum class SweepMode {
  forward,             ///< once at each slice on the way forward
  symmetric,           ///< once at each slice forward and, after the first sweep, backward
  local_gauss_newton,  ///< up to five times at each slice, both ways, until it rests
  whole,               ///< not within a sweep: all slices together after it
};
std::string_view name_of(SweepMode mode);

struct AicoParams {
  int max_sweeps = 100;
  int max_rejections = 10;  ///< in a row: the sweep can't be improved
  double damping = 1e-2;    ///< lambda: pulls beliefs towards the last accepted ones
  bool proximal = false;    ///< lambda enters the messages too, not the beliefs alone
  double max_step = 1;      ///< a relocation moves a slice by at most this (norm)
  double step_tolerance = 1e-4;
  double cost_tolerance = 1e-5;  ///< relative
  SweepMode mode = SweepMode::symmetric;
  void visit(pipeline::Fields& f);
};

enum class AicoOutcome {
  converged,
  sweep_limit,
  stalled,  ///< max_rejections sweeps in a row raised the cost, whatever the damping
};
std::string_view name_of(AicoOutcome outcome);

/// u = gain x + offset.
struct Control {
  Eigen::MatrixXd gain;
  Eigen::VectorXd offset;
};

struct AicoResult {
  AicoOutcome outcome = AicoOutcome::converged;
  std::vector<Eigen::VectorXd> mean;        ///< x_0 .. x_T; never costs more than what it started from
  std::vector<Eigen::MatrixXd> covariance;  ///< of the beliefs; zero for x_0
  /// Cov(x_t, x_{t+1}) of the beliefs, t = 0 .. T - 1.
  std::vector<Eigen::MatrixXd> pair_covariance;
  /// The policy u_t(x), t = 0 .. T - 1: the mean of P(u_t | x_t, tasks to come), as backward messages have
  /// it. With little noise Q the gains of the linear-quadratic regulator of the last linearisation.
  std::vector<Control> policy;
  std::vector<double> costs;  ///< of the start and of each accepted sweep: never rises
  std::vector<Residual> tasks;
  double control_cost = 0;  ///< what is not of tasks
  double last_move = 0;     ///< largest change of a belief in the last sweep
  int sweeps = 0, accepted = 0;
};

/// Approximate inference control (Toussaint 2009; thesis 2.3): Gaussian messages forward and backward along
/// the steps, tasks linearised at the beliefs, Levenberg-like damping with full undo from the first sweep on.
/// In the linear-Gaussian case one undamped sweep is exact. x_0 is clamped. No matrix that may be singular is
/// inverted: messages are kept as covariance forward and as information backward. In the mode `whole` with
/// proximal damping a sweep is a damped Gauss-Newton step on the same cost, computed by messages.
///
/// Takes its memory when it is made; `search` allocates nothing, as far as tasks and model don't. The problem
/// must outlive it. O(sweeps T dim^3).
class Aico {
 public:
  Aico(const Problem& problem, const AicoParams& params);
  ~Aico();
  Aico(const Aico&) = delete;
  Aico& operator=(const Aico&) = delete;
  /// `initial` holds x_0 .. x_T; its x_0 is replaced by the problem's start. The answer holds all but `tasks`
  /// and stays valid until the next call.
  const AicoResult& search(const std::vector<Eigen::VectorXd>& initial);

 private:
  class Sweeper;
  std::unique_ptr<Sweeper> sweeper_;
};

/// For those who ask once.
AicoResult aico(const Problem& problem, const std::vector<Eigen::VectorXd>& initial,
                const AicoParams& params);

}  // namespace geocage::motion
