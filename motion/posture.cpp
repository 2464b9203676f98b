#include "motion/posture.h"

#include <cmath>

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

EndPrior random_walk_prior(const VectorXd& q_0, const MatrixXd& covariance_rate, double duration_s) {
  return {q_0, duration_s * covariance_rate, VectorXd::Zero(q_0.size()), covariance_rate};
}

EndPrior integrator_prior(const VectorXd& x_0, const IntegratorRates& rates, int steps, double duration_s) {
  const Eigen::Index n = x_0.size() / 2;
  const double K = steps, D = duration_s, k = hold_factor(rates.hold);
  const double S0 = K, S1 = K * (K - 1) / 2, S2 = (K - 1) * K * (2 * K - 1) / 6;
  const MatrixXd& h = rates.control_covariance;
  const MatrixXd Q1 = rates.position_noise * MatrixXd::Identity(n, n),
                 Q2 = rates.velocity_noise * MatrixXd::Identity(n, n);
  // Noise of the step that has j steps after it arrives as ((k + j) d^2, d) of the control and (1, j d; 0, 1)
  // of Q.
  const MatrixXd cubic = ((k * k * S0 + 2 * k * S1 + S2) * h + S2 * Q2) / (K * K * K),
                 square = ((k * S0 + S1) * h + S1 * Q2) / (K * K), linear = h + Q2;
  EndPrior prior;
  prior.covariance.resize(2 * n, 2 * n);
  prior.covariance << D * D * D * cubic + D * Q1, D * D * square, D * D * square, D * linear;
  prior.covariance_rate.resize(2 * n, 2 * n);
  prior.covariance_rate << 3 * D * D * cubic + Q1, 2 * D * square, 2 * D * square, linear;
  // Held acceleration: sum of (k + j) d^2 is D^2 (k K + K (K - 1) / 2) / K^2.
  const double drift = (k * S0 + S1) / (K * K);
  const VectorXd f = rates.acceleration.size() ? rates.acceleration : VectorXd(VectorXd::Zero(n)),
                 v = x_0.tail(n);
  prior.mean.resize(2 * n);
  prior.mean << x_0.head(n) + D * v + D * D * drift * f, v + D * f;
  prior.mean_rate.resize(2 * n);
  prior.mean_rate << v + 2 * D * drift * f, f;
  return prior;
}

EndPrior end_prior(const Process& process, const VectorXd& x_0, int steps) {
  const Eigen::Index n = x_0.size();
  EndPrior prior{x_0, MatrixXd::Zero(n, n), VectorXd::Zero(n), MatrixXd::Zero(n, n)};
  for (int t = 0; t < steps; ++t) {
    prior.mean = process.A * prior.mean + process.a;
    prior.covariance = MatrixXd(process.A * prior.covariance * process.A.transpose() + process.W);
  }
  return prior;
}

namespace {

/// Rows of all tasks at one state: e, G, and their variances.
struct Rows {
  VectorXd error, variance;
  MatrixXd G;
};

Rows rows_at(const std::vector<Task>& tasks, int t, const VectorXd& x) {
  Rows rows{VectorXd(0), VectorXd(0), MatrixXd(0, x.size())};
  VectorXd error;
  MatrixXd J;
  for (const Task& task : tasks) {
    const double rho = task.precision[static_cast<std::size_t>(t)];
    if (rho == 0) continue;
    task.evaluate(t, x, error, &J);
    for (Eigen::Index i = 0; i < error.size(); ++i) {
      if (task.hinge && error[i] == 0) continue;
      const Eigen::Index m = rows.error.size();
      rows.error.conservativeResize(m + 1);
      rows.variance.conservativeResize(m + 1);
      rows.G.conservativeResize(m + 1, Eigen::NoChange);
      rows.error[m] = error[i];
      rows.variance[m] = 1 / rho;
      rows.G.row(m) = J.row(i);
    }
  }
  return rows;
}

void rate_targets(const EndPrior& prior, const Rows& rows, FinalPosture& posture) {
  const auto m = static_cast<double>(rows.error.size());
  if (rows.error.size() == 0) return;
  const MatrixXd S = rows.G * prior.covariance * rows.G.transpose() + MatrixXd(rows.variance.asDiagonal());
  const Eigen::LDLT<MatrixXd> solver(S);
  const VectorXd r = rows.G * (posture.mean - prior.mean) - rows.error, g = solver.solve(r);
  posture.log_likelihood = -0.5 * (m * std::log(2 * M_PI) + solver.vectorD().array().log().sum() + r.dot(g));
  const MatrixXd S_rate = rows.G * prior.covariance_rate * rows.G.transpose();
  posture.likelihood_rate =
      g.dot(rows.G * prior.mean_rate) + 0.5 * g.dot(S_rate * g) - 0.5 * solver.solve(S_rate).trace();
}

}  // namespace

FinalPosture final_posture(const EndPrior& prior, const std::vector<Task>& tasks, int t,
                           const VectorXd& initial, const GaussNewtonParams& params) {
  const Eigen::Index n = prior.mean.size();
  // One step from nowhere in particular whose noise is the prior.
  Problem problem{
      {MatrixXd::Identity(n, n), prior.mean, prior.covariance, {}, {}, {}}, 1, VectorXd::Zero(n), {}};
  for (const Task& task : tasks) {
    const double rho = task.precision[static_cast<std::size_t>(t)];
    Task last = task;
    last.precision = {0, rho};
    last.evaluate = [t, evaluate = task.evaluate](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
      evaluate(t, x, error, J);
    };
    problem.tasks.push_back(std::move(last));
  }
  const auto found = gauss_newton(problem, {problem.start, initial}, params);
  FinalPosture posture;
  posture.outcome = found.outcome;
  posture.costs = found.costs;
  posture.mean = found.path.back();
  posture.precision =
      prior.covariance.ldlt().solve(MatrixXd::Identity(n, n)) + linearise(problem, 1, posture.mean).R;
  rate_targets(prior, rows_at(tasks, t, posture.mean), posture);
  return posture;
}

}  // namespace geocage::motion
