#include "motion/aico.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "motion/damping.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Path = std::vector<VectorXd>;

std::string_view name_of(SweepMode mode) {
  switch (mode) {
    case SweepMode::forward:
      return "forward";
    case SweepMode::symmetric:
      return "symmetric";
    case SweepMode::local_gauss_newton:
      return "local_gauss_newton";
    case SweepMode::whole:
      return "whole";
  }
  return "";
}

std::string_view name_of(AicoOutcome outcome) {
  switch (outcome) {
    case AicoOutcome::converged:
      return "converged";
    case AicoOutcome::sweep_limit:
      return "sweep limit";
    case AicoOutcome::stalled:
      return "stalled";
  }
  return "";
}

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

constexpr int local_steps = 5;  // relocations of a slice in the mode local_gauss_newton

/// All that a rejected sweep must undo. Forward messages N(s, S), backward messages in information form (h =
/// Vinv v, Vinv). `step[t]` leads from slice t on.
struct Slices {
  std::vector<VectorXd> s, h, belief, at;  ///< `at`: where the tasks are linearised
  std::vector<MatrixXd> S, Vinv, B;
  std::vector<Quadratic> task;
  std::vector<Process> step;
};

void make_symmetric(MatrixXd& M) {
  for (Eigen::Index i = 0; i < M.rows(); ++i)
    for (Eigen::Index j = 0; j < i; ++j) M(i, j) = M(j, i) = (M(i, j) + M(j, i)) / 2;
}

}  // namespace

class Aico::Sweeper {
 public:
  Sweeper(const Problem& problem, const AicoParams& params)
      : problem_(problem),
        params_(params),
        n_(problem.dim()),
        T_(static_cast<std::size_t>(problem.horizon)),
        terms_(problem),
        q_{MatrixXd(n_, n_), VectorXd(n_)},
        M_(n_, n_),
        N_(n_, n_),
        u_(n_),
        v_(n_),
        solver_(n_),
        small_solver_(controls()) {
    const MatrixXd none = MatrixXd::Zero(n_, n_);
    const VectorXd zero = VectorXd::Zero(n_);
    now_.s.assign(T_ + 1, zero);
    now_.h = now_.belief = now_.at = reference_ = now_.s;
    now_.S.assign(T_ + 1, none);
    now_.Vinv = now_.B = now_.S;
    now_.task.assign(T_ + 1, {none, zero});
    // Only a model makes steps differ.
    now_.step.assign(problem.model ? T_ : 1, problem.process);
    before_ = now_;
    result_.mean = now_.belief;
    result_.covariance = now_.B;
    result_.pair_covariance.assign(T_, none);
    const auto m = controls();
    result_.policy.assign(T_, {MatrixXd::Zero(m, n_), VectorXd::Zero(m)});
    result_.costs.reserve(static_cast<std::size_t>(params.max_sweeps) + 1);
    K_ = MatrixXd::Zero(m, n_);
    D_ = MatrixXd::Zero(m, m);
    own_B_ = MatrixXd::Identity(n_, n_);
    own_Q_ = none;
    if (problem.process.B.size() == 0) own_H_ = problem.process.W.llt().solve(own_B_);
  }

  const AicoResult& search(const Path& initial) {
    start(initial);
    result_.outcome = AicoOutcome::sweep_limit;
    result_.costs.clear();
    result_.costs.push_back(terms_.total_cost(now_.belief));
    result_.sweeps = result_.accepted = 0;
    Damping damping(params_.damping, params_.max_rejections);
    while (result_.sweeps < params_.max_sweeps) {
      before_ = now_;
      sweep(damping.value(), result_.accepted == 0);
      ++result_.sweeps;
      const double cost = terms_.total_cost(now_.belief), best = result_.costs.back();
      result_.last_move = largest_move(before_.belief, now_.belief);
      const bool still = result_.last_move < params_.step_tolerance;
      const Verdict verdict = damping.judge(cost, best, still);
      if (verdict != Verdict::keep) now_ = before_;
      if (verdict == Verdict::undo) continue;
      if (verdict != Verdict::keep) {
        result_.outcome = verdict == Verdict::rested ? AicoOutcome::converged : AicoOutcome::stalled;
        break;
      }
      ++result_.accepted;
      result_.costs.push_back(cost);
      if (params_.mode == SweepMode::whole) relinearise();
      const bool flat = best - cost <= params_.cost_tolerance * std::max(1.0, std::abs(cost));
      if (result_.accepted == 1 || !(still || flat)) continue;
      result_.outcome = AicoOutcome::converged;
      break;
    }
    finish();
    return result_;
  }

 private:
  Eigen::Index controls() const { return problem_.process.B.size() ? problem_.process.B.cols() : n_; }
  const Process& step(std::size_t t) const { return now_.step[problem_.model ? t : 0]; }

  void start(const Path& initial) {
    for (std::size_t t = 0; t <= T_; ++t) {
      now_.belief[t] = t == 0 ? problem_.start : initial[t];
      now_.S[t].setZero();
      now_.Vinv[t].setZero();
      now_.B[t].setZero();
      now_.h[t].setZero();
      now_.s[t] = now_.belief[t];
    }
    now_.at = now_.belief;
    relinearise();
  }

  void linearise_slice(std::size_t t) {
    if (t > 0) terms_.linearise(static_cast<int>(t), now_.at[t], now_.task[t]);
    if (problem_.model && t < T_) now_.step[t] = terms_.process(static_cast<int>(t), now_.at[t]);
  }

  /// All slices at the beliefs.
  void relinearise() {
    for (std::size_t t = 0; t <= T_; ++t) {
      now_.at[t] = now_.belief[t];
      linearise_slice(t);
    }
  }

  /// Forward, then backward. The first sweep keeps its linearisation on the way back.
  void sweep(double damping, bool first) {
    reference_ = now_.belief;
    const bool whole = params_.mode == SweepMode::whole;
    const int most = params_.mode == SweepMode::local_gauss_newton ? local_steps : 1;
    for (std::size_t t = 1; t <= T_; ++t) {
      forward(t, damping);
      if (whole) continue;
      update_belief(t, damping);
      relocate(t, damping, first ? 1 : most);
    }
    for (std::size_t t = T_; t >= 1; --t) {
      if (t < T_) backward(t, damping);
      update_belief(t, damping);
      if (!first && !whole && params_.mode != SweepMode::forward) relocate(t, damping, most);
    }
    if (whole) limit_moves();
  }

  /// The task of slice t as messages see it.
  void message_task(std::size_t t, double damping) {
    q_ = now_.task[t];
    if (!params_.proximal || t == 0) return;
    q_.R.diagonal().array() += damping;
    q_.r += damping * reference_[t];
  }

  void forward(std::size_t t, double damping) {
    // N(s, S) of the slice before, times its task: (S^-1 + R)^-1 = (I + S R)^-1 S needs no inverse of S,
    // which is 0 at x_0.
    message_task(t - 1, damping);
    const Process& p = step(t - 1);
    const MatrixXd& S = now_.S[t - 1];
    M_.setIdentity();
    M_.noalias() += S * q_.R;
    solver_.compute(M_);
    u_ = now_.s[t - 1];
    u_.noalias() += S * q_.r;
    v_ = solver_.solve(u_);
    now_.s[t] = p.a;
    now_.s[t].noalias() += p.A * v_;
    M_ = solver_.solve(S);
    N_.noalias() = p.A * M_;
    now_.S[t] = p.W;
    now_.S[t].noalias() += N_ * p.A.transpose();
    make_symmetric(now_.S[t]);
  }

  void backward(std::size_t t, double damping) {
    // Information L, l of the slice after; (W + L^-1)^-1 = (I + L W)^-1 L needs no inverse of L, which may be
    // 0.
    message_task(t + 1, damping);
    const Process& p = step(t);
    q_.R += now_.Vinv[t + 1];
    q_.r += now_.h[t + 1];
    M_.setIdentity();
    M_.noalias() += q_.R * p.W;
    solver_.compute(M_);
    M_ = solver_.solve(q_.R);
    N_.noalias() = M_ * p.A;
    now_.Vinv[t].noalias() = p.A.transpose() * N_;
    make_symmetric(now_.Vinv[t]);
    u_ = q_.r;
    u_.noalias() -= q_.R * p.a;
    v_ = solver_.solve(u_);
    now_.h[t].noalias() = p.A.transpose() * v_;
  }

  void update_belief(std::size_t t, double damping) {
    N_ = now_.Vinv[t] + now_.task[t].R;
    N_.diagonal().array() += damping;
    u_ = now_.h[t] + now_.task[t].r + damping * reference_[t];
    M_.setIdentity();
    M_.noalias() += now_.S[t] * N_;
    solver_.compute(M_);
    v_ = now_.s[t];
    v_.noalias() += now_.S[t] * u_;
    now_.belief[t] = solver_.solve(v_);
    now_.B[t] = solver_.solve(now_.S[t]);
    make_symmetric(now_.B[t]);
  }

  void relocate(std::size_t t, double damping, int most) {
    for (int k = 0; k < most; ++k) {
      u_ = now_.belief[t] - now_.at[t];
      const double length = u_.norm(), move = u_.lpNorm<Eigen::Infinity>();
      if (move == 0 || (k > 0 && move < params_.step_tolerance)) return;
      if (length > params_.max_step) u_ *= params_.max_step / length;
      now_.at[t] += u_;
      linearise_slice(t);
      update_belief(t, damping);
    }
  }

  void limit_moves() {
    for (std::size_t t = 1; t <= T_; ++t) {
      u_ = now_.belief[t] - now_.at[t];
      const double length = u_.norm();
      if (length > params_.max_step) now_.belief[t] = now_.at[t] + u_ * (params_.max_step / length);
    }
  }

  /// Covariances and policy of undamped messages, linearised at the mean, and the rest of the answer.
  void finish() {
    result_.mean = now_.belief;
    relinearise();
    for (std::size_t t = 1; t <= T_; ++t) forward(t, 0);
    now_.Vinv[T_].setZero();
    now_.h[T_].setZero();
    for (std::size_t t = T_; t >= 1; --t) {
      if (t < T_) backward(t, 0);
      update_belief(t, 0);
      result_.covariance[t] = now_.B[t];
    }
    for (std::size_t t = 0; t < T_; ++t) {
      find_pair_covariance(t);
      find_policy(t);
    }
    double of_tasks = 0;
    for (std::size_t t = 1; t <= T_; ++t) of_tasks += terms_.task_cost(static_cast<int>(t), result_.mean[t]);
    result_.control_cost = result_.costs.back() - of_tasks;
  }

  /// With F = (S^-1 + R)^-1 the smoother's gain is F A' S_{t+1}^-1.
  void find_pair_covariance(std::size_t t) {
    const Process& p = step(t);
    result_.pair_covariance[t].setZero();
    if (t == 0) return;  // x_0 is certain
    M_.setIdentity();
    M_.noalias() += now_.S[t] * now_.task[t].R;
    solver_.compute(M_);
    M_ = solver_.solve(now_.S[t]);
    N_.noalias() = p.A * M_.transpose();  // (F A')'
    solver_.compute(now_.S[t + 1]);
    M_ = solver_.solve(N_);
    result_.pair_covariance[t].noalias() = M_.transpose() * now_.B[t + 1];
  }

  /// Integrating x_{t+1} ~ N(A x + a + B u, Q) against the information L, l of what is to come leaves
  /// L~ = (I + L Q)^-1 L and l~: u = (H + B' L~ B)^-1 B' (l~ - L~ (A x + a)).
  void find_policy(std::size_t t) {
    const Process& p = step(t);
    const bool own = p.B.size() == 0;
    const MatrixXd &B = own ? own_B_ : p.B, &H = own ? own_H_ : p.H, &Q = own ? own_Q_ : p.Q;
    q_.R = now_.Vinv[t + 1] + now_.task[t + 1].R;
    u_ = now_.h[t + 1] + now_.task[t + 1].r;
    M_.setIdentity();
    M_.noalias() += q_.R * Q;
    solver_.compute(M_);
    N_ = solver_.solve(q_.R);
    v_ = solver_.solve(u_);
    v_.noalias() -= N_ * p.a;
    K_.noalias() = B.transpose() * N_;
    D_ = H;
    D_.noalias() += K_ * B;
    small_solver_.compute(D_);
    auto& [gain, offset] = result_.policy[t];
    offset.noalias() = B.transpose() * v_;
    small_solver_.solveInPlace(offset);
    gain.noalias() = -K_ * p.A;
    small_solver_.solveInPlace(gain);
  }

  const Problem& problem_;
  const AicoParams params_;
  const Eigen::Index n_;
  const std::size_t T_;
  Terms terms_;
  Slices now_, before_;
  Path reference_;  ///< beliefs of the last accepted sweep
  AicoResult result_;
  Quadratic q_;
  MatrixXd M_, N_, K_, D_, own_B_, own_H_, own_Q_;
  VectorXd u_, v_;
  Eigen::PartialPivLU<MatrixXd> solver_;
  Eigen::LLT<MatrixXd> small_solver_;
};

Aico::Aico(const Problem& problem, const AicoParams& params)
    : sweeper_(std::make_unique<Sweeper>(problem, params)) {}
Aico::~Aico() = default;

const AicoResult& Aico::search(const Path& initial) {
  return sweeper_->search(initial);
}

AicoResult aico(const Problem& problem, const Path& initial, const AicoParams& params) {
  AicoResult result = Aico(problem, params).search(initial);
  result.tasks = residuals(problem, result.mean);
  return result;
}

}  // namespace geocage::motion
