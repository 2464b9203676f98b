#include "motion/aico.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

void AicoParams::visit(pipeline::Fields& f) {
  f("max_sweeps", max_sweeps, {1, 10000}, "sweeps at most");
  f("max_rejections", max_rejections, {1, 100}, "rejected sweeps in a row that end the search");
  f("damping", damping, {0, 1e8}, "pull of the beliefs towards the last accepted ones");
  f("proximal", proximal, "damp the messages too");
  f("max_step", max_step, {1e-6, 100}, "how far a slice may be moved at once");
  f("step_tolerance", step_tolerance, {0, 1}, "beliefs that move less are converged");
  f("cost_tolerance", cost_tolerance, {0, 1}, "costs that fall less, relatively, are converged");
}

namespace {

constexpr double least_damping = 1e-12, most_damping = 1e8;

/// All that a rejected sweep must undo. Forward messages N(s, S), backward messages in information form (h =
/// Vinv v, Vinv).
struct Slices {
  std::vector<VectorXd> s, h, belief, at;  ///< `at`: where the tasks are linearised
  std::vector<MatrixXd> S, Vinv, B;
  std::vector<Quadratic> task;
};

MatrixXd symmetric(const MatrixXd& M) {
  return (M + M.transpose()) / 2;
}

class Sweeper {
 public:
  Sweeper(const Problem& problem, const AicoParams& params, std::vector<VectorXd> initial)
      : problem_(problem),
        process_(problem.process),
        params_(params),
        n_(problem.dim()),
        T_(problem.horizon) {
    initial[0] = problem.start;
    const auto slices = static_cast<std::size_t>(T_) + 1;
    now_.belief = now_.at = initial;
    now_.s = initial;
    now_.h.assign(slices, VectorXd::Zero(n_));
    now_.S.assign(slices, MatrixXd::Zero(n_, n_));
    now_.Vinv.assign(slices, MatrixXd::Zero(n_, n_));
    now_.B.assign(slices, MatrixXd::Zero(n_, n_));
    now_.task.assign(slices, {MatrixXd::Zero(n_, n_), VectorXd::Zero(n_)});
    for (int t = 1; t <= T_; ++t) now_.task[t] = linearise(problem_, t, now_.at[t]);
    reference_ = now_.belief;
  }

  Slices& slices() { return now_; }

  /// Forward, then backward. The first sweep keeps its linearisation on the way back.
  void sweep(double damping, bool first) {
    reference_ = now_.belief;
    for (int t = 1; t <= T_; ++t) {
      forward(t, damping);
      update_belief(t, damping);
      relocate(t, damping);
    }
    for (int t = T_; t >= 1; --t) {
      if (t < T_) backward(t, damping);
      update_belief(t, damping);
      if (!first) relocate(t, damping);
    }
  }

 private:
  /// The task of slice t as messages see it.
  Quadratic message_task(int t, double damping) const {
    Quadratic q = now_.task[t];
    if (params_.proximal && t > 0) {
      q.R.diagonal().array() += damping;
      q.r += damping * reference_[t];
    }
    return q;
  }

  void forward(int t, double damping) {
    // N(s, S) of the slice before, times its task: (S^-1 + R)^-1 = (I + S R)^-1 S needs no inverse of S,
    // which is 0 at x_0.
    const Quadratic q = message_task(t - 1, damping);
    const MatrixXd& S = now_.S[t - 1];
    const Eigen::PartialPivLU<MatrixXd> solver(MatrixXd::Identity(n_, n_) + S * q.R);
    now_.s[t] = process_.a + process_.A * solver.solve(now_.s[t - 1] + S * q.r);
    now_.S[t] = symmetric(process_.W + process_.A * solver.solve(S) * process_.A.transpose());
  }

  void backward(int t, double damping) {
    // Information L, l of the slice after; (W + L^-1)^-1 = (I + L W)^-1 L needs no inverse of L, which may be
    // 0.
    const Quadratic q = message_task(t + 1, damping);
    const MatrixXd L = now_.Vinv[t + 1] + q.R;
    const VectorXd l = now_.h[t + 1] + q.r;
    const Eigen::PartialPivLU<MatrixXd> solver(MatrixXd::Identity(n_, n_) + L * process_.W);
    now_.Vinv[t] = symmetric(process_.A.transpose() * solver.solve(L) * process_.A);
    now_.h[t] = process_.A.transpose() * solver.solve(l - L * process_.a);
  }

  void update_belief(int t, double damping) {
    MatrixXd C = now_.Vinv[t] + now_.task[t].R;
    C.diagonal().array() += damping;
    const VectorXd c = now_.h[t] + now_.task[t].r + damping * reference_[t];
    const Eigen::PartialPivLU<MatrixXd> solver(MatrixXd::Identity(n_, n_) + now_.S[t] * C);
    now_.belief[t] = solver.solve(now_.s[t] + now_.S[t] * c);
    now_.B[t] = symmetric(solver.solve(now_.S[t]));
  }

  void relocate(int t, double damping) {
    VectorXd move = now_.belief[t] - now_.at[t];
    if (const double length = move.norm(); length > params_.max_step) move *= params_.max_step / length;
    if (move.lpNorm<Eigen::Infinity>() == 0) return;
    now_.at[t] += move;
    now_.task[t] = linearise(problem_, t, now_.at[t]);
    update_belief(t, damping);
  }

  const Problem& problem_;
  const Process& process_;
  const AicoParams& params_;
  const int n_, T_;
  Slices now_;
  std::vector<VectorXd> reference_;  ///< beliefs of the last accepted sweep
};

double largest_move(const std::vector<VectorXd>& a, const std::vector<VectorXd>& b) {
  double most = 0;
  for (std::size_t t = 0; t < a.size(); ++t) most = std::max(most, (a[t] - b[t]).lpNorm<Eigen::Infinity>());
  return most;
}

}  // namespace

AicoResult aico(const Problem& problem, std::vector<VectorXd> initial, const AicoParams& params) {
  Sweeper sweeper(problem, params, std::move(initial));
  AicoResult result;
  result.outcome = AicoOutcome::sweep_limit;
  result.costs.push_back(total_cost(problem, sweeper.slices().belief));
  double damping = params.damping;
  for (int rejections = 0; result.sweeps < params.max_sweeps; ++result.sweeps) {
    Slices before = sweeper.slices();
    sweeper.sweep(damping, result.accepted == 0);
    const double cost = total_cost(problem, sweeper.slices().belief), best = result.costs.back();
    const bool still = largest_move(before.belief, sweeper.slices().belief) < params.step_tolerance;
    if (!(cost <= best)) {
      sweeper.slices() = std::move(before);
      if (still) {  // as good as it gets: the rise is rounding
        result.outcome = AicoOutcome::converged;
        ++result.sweeps;
        break;
      }
      damping = std::min(most_damping, std::max(damping, least_damping) * 10);
      if (++rejections < params.max_rejections) continue;
      result.outcome = AicoOutcome::stalled;
      ++result.sweeps;
      break;
    }
    rejections = 0;
    damping = damping == 0 ? 0 : std::max(least_damping, damping / 5);
    ++result.accepted;
    result.costs.push_back(cost);
    const bool flat = best - cost <= params.cost_tolerance * std::max(1.0, std::abs(cost));
    if (result.accepted == 1 || !(still || flat)) continue;
    result.outcome = AicoOutcome::converged;
    ++result.sweeps;
    break;
  }
  result.mean = sweeper.slices().belief;
  result.covariance = sweeper.slices().B;
  return result;
}

}  // namespace geocage::motion
