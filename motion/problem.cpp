#include "motion/problem.h"

#include <Eigen/Cholesky>

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Quadratic linearise(const Problem& problem, int t, const VectorXd& x) {
  const int n = problem.dim();
  Quadratic q{MatrixXd::Zero(n, n), VectorXd::Zero(n)};
  VectorXd error;
  MatrixXd J;
  for (const Task& task : problem.tasks) {
    const double rho = task.precision[static_cast<std::size_t>(t)];
    if (rho == 0) continue;
    task.evaluate(t, x, error, &J);
    if (error.size() == 0) continue;
    q.R.noalias() += rho * J.transpose() * J;
    q.r.noalias() += rho * J.transpose() * (J * x - error);
  }
  return q;
}

double task_cost(const Problem& problem, int t, const VectorXd& x) {
  double cost = 0;
  VectorXd error;
  for (const Task& task : problem.tasks) {
    const double rho = task.precision[static_cast<std::size_t>(t)];
    if (rho == 0) continue;
    task.evaluate(t, x, error, nullptr);
    cost += rho * error.squaredNorm();
  }
  return cost;
}

double total_cost(const Problem& problem, const std::vector<VectorXd>& trajectory) {
  const Process& p = problem.process;
  const Eigen::LDLT<MatrixXd> W(p.W);
  double cost = 0;
  for (int t = 0; t < problem.horizon; ++t) {
    const VectorXd step = trajectory[t + 1] - p.A * trajectory[t] - p.a;
    cost += step.dot(W.solve(step)) + task_cost(problem, t + 1, trajectory[t + 1]);
  }
  return cost;
}

std::vector<double> constant_precision(int horizon, double precision) {
  return std::vector<double>(static_cast<std::size_t>(horizon) + 1, precision);
}
std::vector<double> final_precision(int horizon, double precision) {
  auto profile = constant_precision(horizon, 0);
  profile.back() = precision;
  return profile;
}

Task state_task(const VectorXd& goal, std::vector<double> precision) {
  return {"state",
          [goal](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            error = x - goal;
            if (J) *J = MatrixXd::Identity(x.size(), x.size());
          },
          std::move(precision)};
}

Task limits_task(const VectorXd& lower, const VectorXd& upper, std::vector<double> precision) {
  return {"limits",
          [lower, upper](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            error = (x - upper).cwiseMax(0) - (lower - x).cwiseMax(0);
            if (J) *J = (error.array() != 0).cast<double>().matrix().asDiagonal();
          },
          std::move(precision)};
}

}  // namespace geocage::motion
