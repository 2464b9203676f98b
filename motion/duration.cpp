#include "motion/duration.h"

#include <algorithm>
#include <cmath>

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

DurationEstimate estimate_duration(const std::function<EndPrior(double)>& prior,
                                   const std::vector<Task>& tasks, int t, const VectorXd& initial,
                                   const DurationRule& rule) {
  DurationEstimate best;
  VectorXd posture = initial;
  // Relatively 1e-10: the likelihood's slope asks for more of the posture than a motion does.
  const GaussNewtonParams tight{.cost_tolerance = 1e-12, .step_tolerance = 1e-9};
  const auto look = [&](double log_D) {
    const double D = std::exp(log_D);
    FinalPosture found = final_posture(prior(D), tasks, t, posture, tight);
    posture = found.mean;
    const double value = found.log_likelihood;
    if (best.likelihood.empty() || value > best.posture.log_likelihood) {
      best.duration_s = D;
      best.posture = std::move(found);
    }
    best.likelihood.emplace_back(D, value);
    return value;
  };
  const double first = std::log(rule.least_s), last = std::log(rule.most_s);
  const double ratio = (last - first) / (rule.scan - 1);
  for (int i = 0; i < rule.scan; ++i) look(first + i * ratio);
  const double middle = std::log(best.duration_s);
  double low = std::max(first, middle - ratio), high = std::min(last, middle + ratio);
  constexpr double golden = 0.6180339887498949;
  double left = high - golden * (high - low), right = low + golden * (high - low);
  double at_left = look(left), at_right = look(right);
  while (high - low > rule.precision) {
    if (at_left > at_right) {
      high = right;
      right = left;
      at_right = at_left;
      at_left = look(left = high - golden * (high - low));
    } else {
      low = left;
      left = right;
      at_left = at_right;
      at_right = look(right = low + golden * (high - low));
    }
  }
  const double edge = 2 * rule.precision, found = std::log(best.duration_s);
  if (found - first < edge) best.outcome = DurationOutcome::at_least;
  if (last - found < edge) best.outcome = DurationOutcome::at_most;
  return best;
}

double best_step_s(const AicoResult& beliefs, const ContinuousProcess& process, double time_cost) {
  const std::size_t T = beliefs.pair_covariance.size();
  const Eigen::LDLT<MatrixXd> W(process.W);
  double U = 0, V = 2 * static_cast<double>(T) * time_cost;
  for (std::size_t t = 0; t < T; ++t) {
    const VectorXd move = beliefs.mean[t + 1] - beliefs.mean[t],
                   drift = process.A * beliefs.mean[t] + process.a;
    const MatrixXd spread = beliefs.covariance[t + 1] + beliefs.covariance[t] - beliefs.pair_covariance[t] -
                            beliefs.pair_covariance[t].transpose();
    U += move.dot(W.solve(move)) + W.solve(spread).trace();
    V += drift.dot(W.solve(drift)) +
         W.solve(MatrixXd(process.A * beliefs.covariance[t] * process.A.transpose())).trace();
  }
  const double NT = static_cast<double>(process.a.size()) * static_cast<double>(T);
  return 2 * U / (NT + std::sqrt(NT * NT + 4 * U * V));
}

AicoTResult aico_t(const std::function<Problem(double)>& problem_of, const ContinuousProcess& process,
                   double first_step_s, const std::vector<VectorXd>& initial, const AicoParams& params,
                   double time_cost, int rounds, double precision) {
  AicoTResult result;
  result.step_s = first_step_s;
  result.steps_s = {first_step_s};
  std::vector<VectorXd> path = initial;
  for (int round = 0; round < rounds; ++round) {
    result.motion = aico(problem_of(result.step_s), path, params);
    path = result.motion.mean;
    const double next = best_step_s(result.motion, process, time_cost);
    const bool still = std::abs(next - result.step_s) <= precision * result.step_s;
    result.step_s = next;
    result.steps_s.push_back(next);
    if (still) break;
  }
  return result;
}

}  // namespace geocage::motion
