#include "motion/problem.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Terms::Terms(const Problem& problem)
    : problem_(problem),
      buffers_(problem.tasks.size()),
      frozen_(problem.process),
      W_(problem.process.W),
      step_(problem.dim()),
      solved_(problem.dim()) {
  for (Buffer& buffer : buffers_) buffer.row.resize(problem.dim());
}

double Terms::linearise(int t, const VectorXd& x, Quadratic& q) {
  q.R.setZero();
  q.r.setZero();
  double cost = 0;
  for (std::size_t k = 0; k < buffers_.size(); ++k) {
    const Task& task = problem_.tasks[k];
    const double rho = task.precision[static_cast<std::size_t>(t)];
    if (rho == 0) continue;
    auto& [error, row, weighted, J, scaled] = buffers_[k];
    task.evaluate(t, x, error, &J);
    if (error.size() == 0) continue;
    cost += rho * error.squaredNorm();
    if (task.hinge) {
      for (Eigen::Index i = 0; i < error.size(); ++i) {
        if (error[i] == 0) continue;
        row = J.row(i).transpose();
        q.r += rho * (row.dot(x) - error[i]) * row;
        q.R.selfadjointView<Eigen::Lower>().rankUpdate(row, rho);
      }
      continue;
    }
    weighted = -error;
    weighted.noalias() += J * x;
    weighted *= rho;
    scaled = rho * J;
    q.r.noalias() += J.transpose() * weighted;
    q.R.triangularView<Eigen::Lower>() += J.transpose() * scaled;
  }
  q.R.triangularView<Eigen::StrictlyUpper>() = q.R.transpose();
  return cost;
}

double Terms::task_cost(int t, const VectorXd& x) {
  double cost = 0;
  for (std::size_t k = 0; k < buffers_.size(); ++k) {
    const Task& task = problem_.tasks[k];
    const double rho = task.precision[static_cast<std::size_t>(t)];
    if (rho == 0) continue;
    task.evaluate(t, x, buffers_[k].error, nullptr);
    cost += rho * buffers_[k].error.squaredNorm();
  }
  return cost;
}

const Process& Terms::process(int t, const VectorXd& x) {
  if (problem_.model) problem_.model(t, x, frozen_);
  return frozen_;
}

double Terms::step_cost(int t, const VectorXd& x, const VectorXd& next) {
  if (problem_.model) {
    problem_.model(t, x, frozen_);
    W_.compute(frozen_.W);
  }
  step_ = next - frozen_.a;
  step_.noalias() -= frozen_.A * x;
  solved_ = W_.solve(step_);
  return step_.dot(solved_);
}

double Terms::total_cost(const std::vector<VectorXd>& trajectory) {
  double cost = 0;
  for (int t = 0; t < problem_.horizon; ++t) {
    const auto i = static_cast<std::size_t>(t);
    cost += step_cost(t, trajectory[i], trajectory[i + 1]) + task_cost(t + 1, trajectory[i + 1]);
  }
  return cost;
}

Quadratic linearise(const Problem& problem, int t, const VectorXd& x) {
  const int n = problem.dim();
  Quadratic q{MatrixXd::Zero(n, n), VectorXd::Zero(n)};
  Terms(problem).linearise(t, x, q);
  return q;
}

double task_cost(const Problem& problem, int t, const VectorXd& x) {
  return Terms(problem).task_cost(t, x);
}

double total_cost(const Problem& problem, const std::vector<VectorXd>& trajectory) {
  return Terms(problem).total_cost(trajectory);
}

std::vector<Residual> residuals(const Problem& problem, const std::vector<VectorXd>& trajectory) {
  std::vector<Residual> list;
  VectorXd error;
  for (const Task& task : problem.tasks) {
    Residual residual{task.name};
    for (int t = 1; t <= problem.horizon; ++t) {
      const auto i = static_cast<std::size_t>(t);
      if (task.precision[i] == 0) continue;
      task.evaluate(t, trajectory[i], error, nullptr);
      residual.cost += task.precision[i] * error.squaredNorm();
      if (t == problem.horizon) residual.final_error = error.norm();
    }
    list.push_back(residual);
  }
  return list;
}

std::vector<double> constant_precision(int horizon, double precision) {
  return std::vector<double>(static_cast<std::size_t>(horizon) + 1, precision);
}
std::vector<double> final_precision(int horizon, double precision) {
  auto profile = constant_precision(horizon, 0);
  profile.back() = precision;
  return profile;
}

}  // namespace geocage::motion
