#include "motion/gauss_newton.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "motion/damping.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Path = std::vector<VectorXd>;

class GaussNewton::Stepper {
 public:
  Stepper(const Problem& problem, const GaussNewtonParams& params)
      : problem_(problem),
        params_(params),
        n_(problem.dim()),
        T_(static_cast<std::size_t>(problem.horizon)),
        terms_(problem),
        weights_(problem.model ? T_ : 1),
        defect_(n_),
        pivot_(T_, Eigen::LLT<MatrixXd>(n_)),
        H_(n_, n_) {
    diagonal_.assign(T_, MatrixXd::Zero(n_, n_));
    above_ = diagonal_;
    gradient_.assign(T_, VectorXd::Zero(n_));
    rest_ = gradient_;
    seen_.assign(T_, {diagonal_[0], gradient_[0]});
    tried_ = seen_;
    next_.assign(T_ + 1, VectorXd::Zero(n_));
    result_.path = next_;
    result_.costs.reserve(static_cast<std::size_t>(params.max_steps) + 1);
    for (Weight& w : weights_) {
      w.Winv = w.AW = w.AWA = MatrixXd::Zero(n_, n_);
      w.W = Eigen::LLT<MatrixXd>(n_);
    }
    if (!problem.model) weigh(problem.process, weights_[0]);
  }

  const GaussNewtonResult& search(const Path& initial) {
    for (std::size_t t = 0; t <= T_; ++t) result_.path[t] = t == 0 ? problem_.start : initial[t];
    result_.costs.clear();
    result_.costs.push_back(linearise(result_.path, std::numeric_limits<double>::infinity()));
    std::swap(seen_, tried_);
    result_.outcome = AicoOutcome::sweep_limit;
    normal_equations();
    Damping damping(params_.damping, params_.max_rejections);
    for (result_.steps = 0; result_.steps < params_.max_steps;) {
      ++result_.steps;
      take_step(damping.value());
      const double best = result_.costs.back(), cost = linearise(next_, best);
      const bool still = largest_move(next_, result_.path) < params_.step_tolerance;
      const Verdict verdict = damping.judge(cost, best, still);
      if (verdict == Verdict::undo) continue;
      if (verdict != Verdict::keep) {
        result_.outcome = verdict == Verdict::rested ? AicoOutcome::converged : AicoOutcome::stalled;
        break;
      }
      std::swap(result_.path, next_);
      std::swap(seen_, tried_);
      result_.costs.push_back(cost);
      if (still || best - cost <= params_.cost_tolerance * std::max(1.0, std::abs(cost))) {
        result_.outcome = AicoOutcome::converged;
        break;
      }
      normal_equations();
    }
    return result_;
  }

 private:
  /// W^-1, A' W^-1 and A' W^-1 A of a step.
  struct Weight {
    Eigen::LLT<MatrixXd> W;
    MatrixXd Winv, AW, AWA;
    Process process;
  };

  static void weigh(const Process& p, Weight& w) {
    w.process = p;
    w.W.compute(p.W);
    w.Winv.setIdentity();
    w.W.solveInPlace(w.Winv);
    w.AW.noalias() = p.A.transpose() * w.Winv;
    w.AWA.noalias() = w.AW * p.A;
  }
  const Weight& weight(std::size_t t) const { return weights_[problem_.model ? t : 0]; }

  /// The path's cost, and tasks there in `tried_`; where it is more than `most` it ends early.
  double linearise(const Path& path, double most) {
    double cost = 0;
    for (std::size_t t = 0; t < T_ && !(cost > most); ++t) {
      const int step = static_cast<int>(t);
      cost +=
          terms_.step_cost(step, path[t], path[t + 1]) + terms_.linearise(step + 1, path[t + 1], tried_[t]);
    }
    return cost;
  }

  /// H dx = -g of slices 1 .. T at the path: blocks on the diagonal, and above_[t] that of slices t, t + 1.
  void normal_equations() {
    const Path& path = result_.path;
    if (problem_.model)
      for (std::size_t t = 0; t < T_; ++t) weigh(terms_.process(static_cast<int>(t), path[t]), weights_[t]);
    for (std::size_t t = 1; t <= T_; ++t) {
      MatrixXd& H = diagonal_[t - 1];
      VectorXd& g = gradient_[t - 1];
      const Quadratic& q = seen_[t - 1];
      H = weight(t - 1).Winv + q.R;
      g.noalias() = q.R * path[t];
      g -= q.r;
      find_defect(t - 1);
      g.noalias() += weight(t - 1).Winv * defect_;
      if (t == T_) break;
      H += weight(t).AWA;
      find_defect(t);
      g.noalias() -= weight(t).AW * defect_;
    }
  }

  void find_defect(std::size_t t) {
    const Process& p = weight(t).process;
    defect_ = result_.path[t + 1] - p.a;
    defect_.noalias() -= p.A * result_.path[t];
  }

  /// next_: the path after a damped step, each slice moved by at most `max_step`.
  void take_step(double damping) {
    for (std::size_t t = 0; t < T_; ++t) {
      H_ = diagonal_[t];
      H_.diagonal().array() += damping;
      rest_[t] = -gradient_[t];
      if (t > 0) {
        // With H = L L' of the slice before: E = L^-1 (block above), H -= E' E, rest -= E' L^-1 rest.
        H_.selfadjointView<Eigen::Lower>().rankUpdate(above_[t - 1].transpose(), -1);
        rest_[t].noalias() -= above_[t - 1].transpose() * rest_[t - 1];
      }
      pivot_[t].compute(H_);
      pivot_[t].matrixL().solveInPlace(rest_[t]);
      if (t + 1 == T_) break;
      above_[t] = -weight(t + 1).AW;
      pivot_[t].matrixL().solveInPlace(above_[t]);
    }
    next_[0] = result_.path[0];
    for (std::size_t t = T_; t-- > 0;) {
      VectorXd& change = rest_[t];
      if (t + 1 < T_) change.noalias() -= above_[t] * rest_[t + 1];
      pivot_[t].matrixU().solveInPlace(change);
    }
    for (std::size_t t = 0; t < T_; ++t) {
      const double length = rest_[t].norm();
      next_[t + 1] =
          result_.path[t + 1] + (length > params_.max_step ? params_.max_step / length : 1) * rest_[t];
    }
  }

  const Problem& problem_;
  const GaussNewtonParams params_;
  const Eigen::Index n_;
  const std::size_t T_;
  Terms terms_;
  std::vector<Weight> weights_;
  std::vector<Quadratic> seen_, tried_;  ///< tasks of slices 1 .. T at the path and at the one that is tried
  VectorXd defect_;
  std::vector<Eigen::LLT<MatrixXd>> pivot_;
  MatrixXd H_;
  std::vector<MatrixXd> diagonal_, above_;
  std::vector<VectorXd> gradient_, rest_;
  Path next_;
  GaussNewtonResult result_;
};

GaussNewton::GaussNewton(const Problem& problem, const GaussNewtonParams& params)
    : stepper_(std::make_unique<Stepper>(problem, params)) {}
GaussNewton::~GaussNewton() = default;

const GaussNewtonResult& GaussNewton::search(const Path& initial) {
  return stepper_->search(initial);
}

GaussNewtonResult gauss_newton(const Problem& problem, const Path& initial, const GaussNewtonParams& params) {
  return GaussNewton(problem, params).search(initial);
}

}  // namespace geocage::motion
